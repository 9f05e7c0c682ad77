"""Sight lines of one sensor, and the targets in range that it does not see, by reason."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...base.arrays import Boolean, Float, Integer
from ...site.candidates import Candidates
from ...site.site import Site
from ...site.targets import target_squares
from ..lidar.model import LidarModel
from .ray_casting import engine_name, make_ray_caster
from .settings import Engine

MAX_LINES = 1500
"""Largest number of lines; if there are more targets, a random sample is drawn."""
SAMPLE_SEED = 0
POSE_DISTANCE = 0.01
"""Metres; a sensor no farther than this from a candidate pose is at that pose: Blender uses single precision."""
SAME_TURN = 5e-5
"""Largest difference of matrix entries between equal orientations."""


@dataclass(frozen=True, eq=False)
class SightLines:
    """Sight lines of one pose, and its unseen targets in range.

    Parameters
    ----------
    eye : (3,) float64, metres
        Optical centre, local site axes.
    ends : (n, 3) float64, metres
        Targets that the sensor sees, or a sample of `MAX_LINES` of them.
    seen : int
        Number of targets that it sees.
    in_range : int
        Number of targets within its range and its horizontal field of view.
    hidden : (m, 4, 3) float64, metres
        Squares of the targets in range that something hides from it.
    missed : (k, 4, 3) float64, metres
        Squares of the other targets in range that it does not see: they lie between its rings or outside its vertical
        field of view, or return too little light.
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
    """Return the sight lines of a pose, and the targets that it does not see.

    A target is hidden if the ray to it ends at a distance of δ or more in front of it.

    Parameters
    ----------
    pose : int
        Index among the site's candidates.
    row : (t,) bool
        Row of the pose in the visibility grid.
    delta : float, metres
        δ, the distance within which a return sees a target.
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
    """Return the candidate pose of a sensor type at a position and orientation, or None.

    Parameters
    ----------
    sensor : str
        Catalogue key of the sensor type.
    xyz : (3,) float64, metres
        Position of the sensor.
    orientation : (3, 3) float64
        Rotation from the sensor's axes to the site's.
    """
    same = np.flatnonzero(candidates.sensor == sensor)
    away = np.linalg.norm(candidates.xyz[same] - xyz, axis=1)
    near = same[np.argsort(away, kind="stable")][: np.count_nonzero(away <= POSE_DISTANCE)]
    differences = (np.abs(candidates.orientation(int(pose)) - orientation).max() for pose in near)
    return next((int(pose) for pose, apart in zip(near, differences, strict=True) if apart <= SAME_TURN), None)


def _sample(numbers: Integer) -> Integer:
    if len(numbers) <= MAX_LINES:
        return numbers
    chosen: Integer = np.sort(np.random.default_rng(SAMPLE_SEED).choice(numbers, MAX_LINES, replace=False))
    return chosen
