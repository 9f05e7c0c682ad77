"""Runs of traffic that commands read: files of trajectories, in the axes of the scene."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TypeVar

import bpy

from seip_addon.core.arrays import Float
from seip_addon.core.traffic import Trajectories

_Run = TypeVar("_Run")

JUDGES = 1 / 3
"""Share of the runs, the last ones, that placements are judged in and not chosen on."""


def runs_beside(scene: Path | None, kind: str = "") -> list[Path]:
    """Return the runs in the folder that stands beside a scene: ``junction_traffic`` beside ``junction.blend``.

    Parameters
    ----------
    scene : path or None
        None for the scene that is open.
    kind : str
        What else the folder's name ends with: ``_dense`` for ``junction_traffic_dense``.
    """
    path = Path(bpy.data.filepath) if scene is None else scene
    return sorted((path.parent / f"{path.stem}_traffic{kind}").glob("*.npz"))


def load_runs(paths: Sequence[Path], origin: Float) -> list[Trajectories]:
    """Read runs, in the local axes of an origin."""
    return [Trajectories.load(path).moved_to(origin) for path in paths]


def parted(runs: list[_Run]) -> tuple[list[_Run], list[_Run]]:
    """Return the runs to choose on, and those to judge in."""
    judges = max(1, round(JUDGES * len(runs)))
    return runs[:-judges], runs[-judges:]
