"""Sight lines of one sensor, and the targets in range that it does not see, by why it does not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Boolean, Float, Integer
from ...site.candidates import Candidates
from ...site.site import Site
from ...site.target_squares import target_squares
from ..lidar.model import LidarModel
from .ray_casting import Engine, engine_name, make_ray_caster

MAX_LINES = 1500
"""Limit on the lines drawn: of more targets a sample is taken."""
SAMPLE_SEED = 0
POSE_DISTANCE = 0.01
"""Metres that a sensor may be from a candidate pose and still hang there: Blender's numbers are single precision."""
SAME_TURN = 5e-5
"""Difference of cosines up to which two orientations are the same."""


@dataclass(frozen=True, eq=False)
class SightLines:
    """Sight lines of one pose, and its unseen targets in range.

    Parameters
    ----------
    eye : (3,) float64, metres
        Optical centre, local site axes.
    ends : (n, 3) float64, metres
        Targets that it sees, a sample of `MAX_LINES` where there are more.
    seen : int
        How many it sees.
    in_range : int
        How many are within its range and its horizontal field of view.
    hidden : (m, 4, 3) float64, metres
        Squares of those that something hides from it.
    missed : (k, 4, 3) float64, metres
        Squares of those in its view that it does not see: they lie between its rings, outside its vertical field of
        view, or return too little light.
    """

    eye: Float
    ends: Float
    seen: int
    in_range: int
    hidden: Float
    missed: Float


def sight_lines(
    site: Site, pose: int, model: LidarModel, row: Boolean, delta: float, engine: Engine = "auto"
) -> SightLines:
    """Return what a pose sees, and what it does not.

    Something hides a target if the ray to it ends at a distance of δ or more before it.

    Parameters
    ----------
    pose : int
        Index among the site's candidates.
    row : (t,) bool
        Which targets it sees: its row of the visibility grid.
    delta : float, metres
        Within which a return is a target's, as for the grid.
    """
    targets = site.targets
    eye = site.candidates.xyz[pose]
    distance = np.linalg.norm(targets.xyz - eye, axis=1)
    faced = model.faces((targets.xyz - eye) @ site.candidates.orientation(pose))
    in_range = row | (faced & (distance >= model.min_range) & (distance <= model.max_range))
    seen = np.flatnonzero(row)
    unseen = np.flatnonzero(in_range & ~row)
    away = distance[unseen]
    caster = make_ray_caster(site.triangles, engine_name(engine))
    first, _ = caster.cast(eye, (targets.xyz[unseen] - eye) / away[:, None], float(model.max_range))
    hidden = first <= away - delta
    squares = target_squares(targets)
    return SightLines(
        eye=eye,
        ends=targets.xyz[_sample(seen)],
        seen=len(seen),
        in_range=int(np.count_nonzero(in_range)),
        hidden=squares[unseen[hidden]],
        missed=squares[unseen[~hidden]],
    )


def pose_at(candidates: Candidates, sensor: str, xyz: Float, orientation: Float) -> int | None:
    """Return the candidate pose of a sensor type at a position and orientation, None where there is none.

    Parameters
    ----------
    sensor : str
        Its catalogue key.
    xyz : (3,) float64, metres
    orientation : (3, 3) float64
        Rotation from the sensor's axes to the site's.
    """
    same = np.flatnonzero(candidates.sensor == sensor)
    away = np.linalg.norm(candidates.xyz[same] - xyz, axis=1)
    near = same[np.argsort(away, kind="stable")][: np.count_nonzero(away <= POSE_DISTANCE)]
    turned_alike = (np.abs(candidates.orientation(int(pose)) - orientation).max() <= SAME_TURN for pose in near)
    return next((int(pose) for pose, alike in zip(near, turned_alike, strict=True) if alike), None)


def _sample(numbers: Integer) -> Integer:
    if len(numbers) <= MAX_LINES:
        return numbers
    chosen: Integer = np.sort(np.random.default_rng(SAMPLE_SEED).choice(numbers, MAX_LINES, replace=False))
    return chosen
