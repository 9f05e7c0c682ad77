"""Yaws of sensors with a limited horizontal field of view."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from shapely.geometry.base import BaseGeometry

from ..base.arrays import Boolean, Float
from ..base.errors import SeipError
from .candidates import Candidates, headings

NOTHING_BEFORE = "looking past all targets"
"""Reason for dropping poses."""


def with_yaws(
    candidates: Candidates, fields_of_view: Mapping[str, float], yaws: int, region: BaseGeometry, targets: Float
) -> Candidates:
    """Repeat poses of sensors with a limited field of view for several yaws, evenly and the first towards the region.

    Yaws without a target in the field of view in plan are left out, and so are positions without a pose.

    Parameters
    ----------
    candidates : Candidates
        Candidates with one yaw at each position, height and tilt.
    fields_of_view : mapping of str to float, radians
        Horizontal field of view of each sensor type; types that are missing see the full circle.
    yaws : int
        Number of yaws over the circle.
    region : shapely geometry
        Region of interest in plan.
    targets : (t, 3) float64, metres
        Positions of the targets.

    Returns
    -------
    Candidates
        Poses of sensors with a full field of view are unchanged; those of others follow each other in order of yaw.

    Raises
    ------
    SeipError
        No pose is left, or none at the positions of which one must carry a sensor.
    """
    kinds, kind = np.unique(candidates.sensor, return_inverse=True)
    one_way = np.array([fields_of_view.get(str(key), math.tau) < math.tau for key in kinds], dtype=bool)
    if not one_way.any():
        return candidates
    # Repeat each pose once for each of its yaws; `turn` counts the repeats of a pose from 0.
    many = np.where(one_way, yaws, 1)[kind]
    pose = np.repeat(np.arange(len(candidates)), many)
    turn = np.arange(len(pose)) - np.repeat(np.cumsum(many) - many, many)
    kind, position = kind[pose], candidates.position_of[pose]

    ahead = headings(candidates.position, region)[:, None] + math.tau / yaws * np.arange(yaws)
    ahead = np.round((ahead + math.pi) % math.tau - math.pi, 6)
    yaw = np.where(one_way[kind], ahead[position, turn], candidates.yaw[pose])
    looks = np.ones(len(pose), dtype=bool)
    _, first = np.unique(candidates.position_of, return_index=True)
    for number in np.flatnonzero(one_way):
        own = kind == number
        seen = _any_within(candidates.xyz[first], ahead, fields_of_view[str(kinds[number])], targets)
        looks[own] = seen[position[own], turn[own]]
    if not looks.any():
        raise SeipError(f"no candidate is left ({len(pose)} {NOTHING_BEFORE}): use more yaws, or a wider field of view")
    left = replace(candidates.only(pose[looks]), yaw=yaw[looks])
    dropped = {NOTHING_BEFORE: int((~looks).sum())} if not looks.all() else {}
    return _without_empty_positions(replace(left, dropped=candidates.dropped | dropped))


def _any_within(xyz: Float, ahead: Float, field_of_view: float, targets: Float) -> Boolean:
    """Return whether a target lies in the field of view in plan, for each yaw (p, y) of sensors at (p, 3)."""
    within = np.zeros(ahead.shape, dtype=bool)
    for place, yaws, row in zip(xyz, ahead, within, strict=True):
        azimuth = np.arctan2(targets[:, 1] - place[1], targets[:, 0] - place[0])
        for number, yaw in enumerate(yaws):
            row[number] = (np.abs((azimuth - yaw + math.pi) % math.tau - math.pi) <= field_of_view / 2).any()
    return within


def _without_empty_positions(candidates: Candidates) -> Candidates:
    used, position_of = np.unique(candidates.position_of, return_inverse=True)
    mandatory = candidates.mandatory[:, used]
    for name in candidates.mandatory_name[~mandatory.any(axis=1)]:
        raise SeipError(f"{str(name)!r} must carry a sensor, but no yaw there has a target in view: use more yaws")
    names = ("position", "position_name", "on_pole", "pole_source")
    of_positions = {name: getattr(candidates, name)[used] for name in names}
    return replace(candidates, **of_positions, position_of=position_of.astype(np.int64), mandatory=mandatory)
