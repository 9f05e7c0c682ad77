"""Rendered pictures of a scene, made in a Blender of its own."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Generator
from functools import partial
from itertools import pairwise
from pathlib import Path

import bpy

from ..core.base.errors import SeipError
from ..core.base.progress import Progress
from ..core.choosing.placement.deployment import Deployment
from ..core.programs.child_process import run_logged
from ..core.site.site import Site
from .render import RenderedPictures, Taken, labelled_pictures, raw_files, sample_count, shots_of

SAMPLE = re.compile(r"Sample (\d+)/")
"""Words in which Cycles tells of its progress."""


def render_elsewhere(
    folder: Path, blend: Path, scene: str, site: Site, deployment: Deployment
) -> Generator[Progress, None, RenderedPictures]:
    """Render a scene from the side that hides least of the road, and close to each sensor, in a Blender of its own.

    The program that asks goes on answering, and Ctrl-C ends it at once; Blender's own rendering lets neither happen.

    Parameters
    ----------
    folder : path
        Folder for raw pictures.
    blend : path
        Holds the scene.
    scene : str
        Its name.
    deployment : Deployment
        The sensors and what they see.

    Yields
    ------
    Progress
        Samples rendered; closing the generator ends the other Blender.

    Raises
    ------
    SeipError
        The other Blender failed.
    """
    shots = shots_of(site, deployment)
    raws = raw_files(folder, shots)
    job, log, answer = (folder / name for name in ("job.json", "log", "taken.json"))
    request = {"path": sys.path, "blend": str(blend), "scene": scene, "answer": str(answer)}
    pictures = {"raws": [str(raw) for raw in raws], "shots": [shot.as_json() for shot in shots]}
    job.write_text(json.dumps(request | pictures))
    temporary = dict.fromkeys(("TMPDIR", "TEMP", "TMP"), str(folder))  # which Blender leaves when it is ended
    yield from run_logged(_command(job), log, partial(_samples, len(raws)), environment=temporary)
    try:
        taken = [Taken.from_json(one) for one in json.loads(answer.read_text())]
    except OSError as error:
        last = log.read_text(errors="replace").strip().splitlines()[-1:]
        raise SeipError(f"the view could not be rendered ({' '.join(last)}): export without it") from error
    return labelled_pictures(shots, taken, raws, site, deployment)


def _command(job: Path) -> list[str]:
    """Return what starts a Blender without a window, or the bpy module, on a job of `render_job`."""
    script = str(Path(__file__).with_name("render_job.py"))
    if bpy.app.binary_path:
        tell = ["--log", "*render*", "--log-level", "info"] if bpy.app.version >= (5, 0) else []  # others tell unasked
        return [bpy.app.binary_path, "-b", "--factory-startup", *tell, "-P", script, "--", str(job)]
    return [sys.executable, script, "--", str(job)]


def _samples(pictures: int, output: str) -> Progress:
    """Return the samples done of all pictures, from all that Cycles has printed: each picture counts from the start."""
    counts = [int(count) for count in SAMPLE.findall(output)]
    finished = sum(later < earlier for earlier, later in pairwise(counts))
    each = sample_count()
    return Progress(min(finished, pictures - 1) * each + counts[-1] if counts else 0, pictures * each, "rendering")
