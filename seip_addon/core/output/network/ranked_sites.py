"""Sites of a network ordered by gain per dollar, and their figures in words."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from ...choosing.placement.returns_summary import returns_text
from ..pictures.drawing import percent
from .network_record import NetworkRecord, NetworkSensor, NetworkSite

COVERAGE_STEPS, RETURNS_STEPS = (0.2, 0.4, 0.6, 0.8), (1.0, 5.0, 20.0, 100.0)
"""Coverages, and typical returns, at which a site gets the next of `SHARE_COLOURS`."""
_ORDER = ("equipped", "without sensor", "failed")


@dataclass(frozen=True)
class RankedSite:
    """Site with its place in the order.

    Parameters
    ----------
    number : int
        From 1.
    gain : float or None
        Gain of the criterion for $1,000 spent at the site, times its weight over the mean weight; None if no money is
        spent there.
    """

    number: int
    site: NetworkSite
    gain: float | None

    @property
    def rank(self) -> int | None:
        """Rank by gain per dollar; None if no money is spent at the site."""
        return None if self.gain is None else self.number


def ranked_sites(record: NetworkRecord) -> tuple[RankedSite, ...]:
    """Return the sites by falling gain per dollar; those without money, without sensor and failed ones follow."""
    weights = [site.weight for site in record.sites if site.status != "failed"]
    mean = math.fsum(weights) / len(weights) if weights else 0.0
    gains = [_gain(site, site.weight / mean if mean > 0 else 1.0) for site in record.sites]
    keys = [
        (_ORDER.index(site.status), gain is None, -(gain or 0.0))
        for site, gain in zip(record.sites, gains, strict=True)
    ]
    order = sorted(range(len(keys)), key=keys.__getitem__)
    return tuple(RankedSite(number, record.sites[at], gains[at]) for number, at in enumerate(order, start=1))


def _gain(site: NetworkSite, relative_weight: float) -> float | None:
    if site.status != "equipped" or site.price_usd <= 0:
        return None
    return relative_weight * site.value / site.price_usd * 1000.0


def sensors_text(sensors: Sequence[NetworkSensor], names: Mapping[str, str]) -> str:
    """Return the number of sensors of each type, by name or key, most frequent first: ``2 × OS1-128, 1 × VLP-32C``."""
    types = Counter(sensor.sensor for sensor in sensors)
    return ", ".join(f"{number} × {names.get(key, key)}" for key, number in types.most_common())


def outcome(record: NetworkRecord, value: float) -> str:
    """Return a value of the criterion as coverage in per cent, or as a typical number of returns."""
    return percent(value) if record.criterion == "road" else returns_text(math.expm1(value))


def gain_text(record: NetworkRecord, gain: float | None) -> str:
    """Return a gain per $1,000 in percentage points, or as the percentage by which 1 + typical returns grows."""
    if gain is None:
        return "–"
    return f"{gain:.2%}".replace("%", " points") if record.criterion == "road" else f"{math.expm1(min(gain, 50)):.1%}"


def level(record: NetworkRecord, site: NetworkSite) -> int:
    """Return the index of a site's colour among `SHARE_COLOURS`."""
    if record.criterion == "road":
        return bisect_right(COVERAGE_STEPS, site.coverage)
    return bisect_right(RETURNS_STEPS, math.expm1(site.value))


def level_words(record: NetworkRecord) -> tuple[str, ...]:
    """Return what each of `SHARE_COLOURS` means."""
    road = record.criterion == "road"
    steps = [f"{step:.0%}" if road else f"{step:g}" for step in (COVERAGE_STEPS if road else RETURNS_STEPS)]
    between = [f"{low.removesuffix('%')}–{high}" for low, high in pairwise(steps)]
    return (f"< {steps[0]}", *between, f"≥ {steps[-1]}")


def colour_title(record: NetworkRecord) -> str:
    """Return what the colours of sites show."""
    return "Road seen" if record.criterion == "road" else "Typical returns from a road user"
