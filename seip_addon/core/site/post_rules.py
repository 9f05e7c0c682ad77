"""Named rules that exclude positions of new posts; a survey may switch off each rule."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ..base.arrays import Boolean, Float
from ..base.errors import SeipError
from ..geometry.plan import closed, without

RuleName = Literal["cycle-tracks", "driveways", "landings", "private", "islands", "power-poles"]
AllowedName = Literal[RuleName, "assumed-poles"]

MIN_ISLAND_WIDTH = 4.0
"""Metres: islands and medians narrower than this are reserved for pedestrians, signals and signs."""
ASSUMED_POLES: AllowedName = "assumed-poles"
"""Name that lets assumed poles carry sensors: those of traffic lights for which the map has no post."""


@dataclass(frozen=True)
class Rule:
    """A rule that excludes positions.

    Parameters
    ----------
    title : str
        Name of the excluded areas, for panel and scene.
    reason : str
        Reason in counts of excluded positions, as in "12 on a driveway".
    clearance : float, metres
        Distance around the areas within which posts are excluded as well.
    """

    title: str
    reason: str
    clearance: float = 0.0


RULES: dict[RuleName, Rule] = {
    "cycle-tracks": Rule("Cycle tracks", "within 0.5 m of a cycle track", 0.5),
    "driveways": Rule("Driveways", "on a driveway"),
    "landings": Rule("Crossing landings", "on a crossing landing"),
    "private": Rule("Private ground", "on private ground"),
    "islands": Rule("Islands", f"on an island narrower than {MIN_ISLAND_WIDTH:g} m, or a small one of an extract"),
    "power-poles": Rule("Power poles", "on a power pole"),
}
"""Rules in order of application: a position is counted for the first rule that excludes it."""


ALLOWED: tuple[AllowedName, ...] = (*RULES, ASSUMED_POLES)
"""Names that a survey may allow."""


@dataclass(frozen=True, eq=False)
class KeepOffArea:
    """An area in plan from which a rule excludes new posts, local site axes in metres."""

    name: str
    polygon: BaseGeometry
    rule: RuleName


def check_allowed(names: Sequence[str]) -> None:
    """Raise SeipError if a name is not that of a rule, or `ASSUMED_POLES`."""
    for name in names:
        if name not in ALLOWED:
            raise SeipError(f"there is no rule {name!r} to allow: choose among {', '.join(ALLOWED)}")


def excluded_posts(
    plan: Float, areas: Sequence[KeepOffArea], road: BaseGeometry, allow: Collection[str]
) -> dict[RuleName, Boolean]:
    """Return the positions excluded by each rule, without those excluded by an earlier rule.

    Parameters
    ----------
    plan : (n, 2) float64, metres
        Positions of new posts.
    areas : sequence of KeepOffArea
        Areas with their rules.
    road : shapely geometry
        Outline of the carriageways in plan, from which islands follow.
    allow : collection of str
        Names of the rules that do not apply.

    Returns
    -------
    dict of str to (n,) bool
        Excluded positions by rule, for the rules that apply to new posts.
    """
    left = np.ones(len(plan), dtype=bool)
    excluded: dict[RuleName, Boolean] = {}
    for name, rule in RULES.items():
        if name in allow or name == "power-poles":
            continue
        shapes = [area.polygon for area in areas if area.rule == name]
        if name == "islands":
            shapes.append(narrow_islands(road))
        hit = left & _within(plan, shapely.union_all(shapes), rule.clearance)
        excluded[name] = hit
        left &= ~hit
    return excluded


def narrow_islands(road: BaseGeometry) -> BaseGeometry:
    """Return the islands and medians between carriageways that are narrower than ``MIN_ISLAND_WIDTH`` metres.

    These are the gaps filled by a morphological closing of the carriageway. Mitred offsets preserve the corners of
    wider areas, which a closing with a disc would fill as well.
    """
    return road if road.is_empty else without(closed(road, MIN_ISLAND_WIDTH / 2), road)


def _within(plan: Float, area: BaseGeometry, distance: float) -> Boolean:
    if area.is_empty or not len(plan):
        return np.zeros(len(plan), dtype=bool)
    shapely.prepare(area)
    near: Boolean = shapely.dwithin(area, shapely.points(plan), distance)
    return near
