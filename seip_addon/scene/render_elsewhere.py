"""A rendered view of a scene, made in a Blender of its own."""

from __future__ import annotations

import json
import re
import sys
import tempfile
from collections.abc import Generator
from pathlib import Path

import bpy
import numpy as np

from ..core.child_process import run_logged
from ..core.choosing.placement.deployment import Deployment
from ..core.errors import SeipError
from ..core.output.pictures.coverage_colours import Legend
from ..core.output.pictures.labelled_view import save_labelled_view
from ..core.progress import Progress
from ..core.site.site import Site
from .render import sample_count, shot_of, sight_of

SAMPLE = re.compile(r"Sample (\d+)/")
"""How Cycles tells of its progress."""


def render_elsewhere(
    path: Path, blend: Path, scene: str, site: Site, deployment: Deployment, legend: Legend | None
) -> Generator[Progress, None, None]:
    """Render a scene as `save_rendered_view` does, in another Blender, so that this one keeps responding.

    Parameters
    ----------
    path : path
        The picture to write.
    blend : path
        Holds the scene.
    scene : str
        Its name.
    deployment : Deployment
        The sensors and what they see.
    legend : Legend or None
        What the colours on the road of the scene mean.

    Yields
    ------
    Progress
        Samples rendered; closing the generator ends the other Blender.

    Raises
    ------
    SeipError
        The other Blender failed.
    """
    shot = shot_of(site, deployment)
    with tempfile.TemporaryDirectory(prefix="seip-") as folder:
        raw, job, log = (Path(folder) / name for name in ("view.png", "job.json", "log"))
        job.write_text(
            json.dumps({"path": sys.path, "blend": str(blend), "scene": scene, "raw": str(raw), "shot": shot.as_json()})
        )
        yield from run_logged(_command(job), log, _samples)
        try:
            hidden = np.array(json.loads(raw.with_suffix(".json").read_text()), dtype=bool)
        except OSError as error:
            last = log.read_text(errors="replace").strip().splitlines()[-1:]
            raise SeipError(f"the view could not be rendered ({' '.join(last)}): export without it") from error
        save_labelled_view(path, raw, site, deployment, legend, sight_of(shot, hidden, site))


def _command(job: Path) -> list[str]:
    """Return what starts a Blender without a window, or the bpy module, on a job of `render_job`."""
    script = str(Path(__file__).with_name("render_job.py"))
    if bpy.app.binary_path:
        tell = ["--log", "*render*", "--log-level", "info"] if bpy.app.version >= (5, 0) else []  # others tell unasked
        return [bpy.app.binary_path, "-b", "--factory-startup", *tell, "-P", script, "--", str(job)]
    return [sys.executable, script, "--", str(job)]


def _samples(line: str) -> Progress:
    counts = SAMPLE.findall(line)
    return Progress(int(counts[-1]) if counts else 0, sample_count(), "rendering")
