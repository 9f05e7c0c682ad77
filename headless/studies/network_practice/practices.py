"""Common practices of spending a budget on the junctions of a network, for comparison with its allocation."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from seip_addon.core.arrays import Float
from seip_addon.core.choosing.network.site_problem import SiteProblem
from seip_addon.core.choosing.placement.problem import TIE_TOLERANCE
from seip_addon.core.progress import finish

Chosen = tuple[int, ...]
Practice = Callable[[Sequence[SiteProblem], Float, float], list[Chosen]]
"""Returns the poses at each site for the sites, their weights and the money."""

USUAL_HEIGHT = 5.4
"""Height in metres of sensors by the four-corner rule, or the nearest height among the candidates."""
EFFORT = 8.0
"""Counted work of each search."""


def equal_money(sites: Sequence[SiteProblem], _weights: Float, money: float) -> list[Chosen]:
    """Give each junction the same money, and place its sensors as well as possible."""
    share = money / len(sites)
    return [
        finish(site.solve(share, EFFORT)).chosen if site.prices.min() <= share * (1 + TIE_TOLERANCE) else ()
        for site in sites
    ]


def greedy_with_equal_money(sites: Sequence[SiteProblem], _weights: Float, money: float) -> list[Chosen]:
    """Give each junction the same money, and add there the sensor that gains most until the money is spent."""
    return [greedy(site, money / len(sites)) for site in sites]


def four_corners(sites: Sequence[SiteProblem], weights: Float, money: float) -> list[Chosen]:
    """Equip the most important junctions with a sensor at each of four corners, as long as the money lasts."""
    chosen: list[Chosen] = [() for _ in sites]
    left = money
    for number in np.argsort(-weights, kind="stable").tolist():
        corners = _corners(sites[number])
        price = math.fsum(sites[number].prices[list(corners)])
        if price <= left * (1 + TIE_TOLERANCE):
            chosen[number] = corners
            left -= price
    return chosen


PRACTICES: dict[str, Practice] = {
    "equal money": equal_money,
    "equal money, greedy": greedy_with_equal_money,
    "four corners": four_corners,
}
"""Practices by name."""


def greedy(site: SiteProblem, money: float) -> Chosen:
    """Return poses at a site, each of which adds the most to the value of those before it within the money."""
    chosen: list[int] = []
    left = money
    while len(chosen) < site.most_sensors:
        free = ~np.isin(site.positions, site.positions[chosen]) & (site.prices <= left * (1 + TIE_TOLERANCE))
        poses = np.flatnonzero(free)
        if not len(poses):
            break
        values = [site.value([*chosen, pose]) for pose in poses.tolist()]
        best = int(np.argmax(values))
        if values[best] <= site.value(chosen):
            break
        chosen.append(int(poses[best]))
        left -= float(site.prices[chosen[-1]])
    return tuple(chosen)


def _corners(site: SiteProblem) -> Chosen:
    """Return the pose nearest to the middle of a junction in each of four quadrants; fewer where one has none."""
    height = site.heights[np.argmin(np.abs(site.heights - USUAL_HEIGHT))]
    plan = site.xyz[:, :2] - np.median(site.xyz[:, :2], axis=0)
    usual = site.heights == height
    chosen = []
    for east in (True, False):
        for north in (True, False):
            there = np.flatnonzero(usual & ((plan[:, 0] >= 0) == east) & ((plan[:, 1] >= 0) == north))
            if len(there):
                chosen.append(int(there[np.argmin(np.hypot(*plan[there].T))]))
    return tuple(chosen[: site.most_sensors])
