"""``network.json``: sensors at the sites of a network within one budget."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from ...choosing.placement.returns_summary import returns_text
from ..pictures.drawing import percent

SCHEMA = "seip-network/3"

PROVEN = 1e-9
"""Gap up to which a network is proven optimal: smaller differences are rounding, as in `problem.TIE_TOLERANCE`."""
_ORDER = ("equipped", "without sensor", "failed")


@dataclass(frozen=True)
class NetworkSensor:
    """Sensor at a site of a network.

    Parameters
    ----------
    id, sensor : str
        Its label within the site, and its type's key in the catalogue.
    latitude, longitude : float, degrees
    height_m : float
        Height above the ground.
    position : str
        Name of the pole or the area that carries it.
    """

    id: str
    sensor: str
    latitude: float
    longitude: float
    height_m: float
    position: str
    price_usd: float


@dataclass(frozen=True)
class NetworkSite:
    """Site of a network with its share of the budget.

    Parameters
    ----------
    name, folder : str
        Name, and folder of its own files below that of the network.
    weight : float
        Importance of the site, as given.
    message : str
        Reason if the site failed, otherwise "".
    value, bound : float
        Value of the criterion at the site with its sensors, and a bound on it for that money.
    coverage : float, 0 to 1
        Share of the road that its sensors see.
    """

    name: str
    folder: str
    latitude: float
    longitude: float
    weight: float
    status: Literal["equipped", "without sensor", "failed"]
    message: str = ""
    price_usd: float = 0.0
    value: float = 0.0
    bound: float = 0.0
    coverage: float = 0.0
    sensors: tuple[NetworkSensor, ...] = ()


@dataclass(frozen=True)
class NetworkRecord:
    """Content of ``network.json``.

    Parameters
    ----------
    name : str
        Name of the network: that of its extract or table of sites.
    criterion : {"road", "returns"}
        ``road``: share of the targets on the road that are seen, 0 to 1. ``returns``: mean of ln(1 + expected returns)
        of road users. The value of the network is the mean over its sites, by their weights; sites that failed are left
        out.
    sensor_types : tuple of str
        Types to choose from, by their keys in the catalogue; ``sensor_names`` has the products.
    created : str
        Time of the placement (ISO 8601), "" if it is not recorded.
    """

    name: str
    criterion: Literal["road", "returns"]
    budget_usd: float
    price_usd: float
    value: float
    bound: float
    sites: tuple[NetworkSite, ...]
    sensor_types: tuple[str, ...]
    sensor_names: Mapping[str, str] = field(default_factory=dict)
    attribution: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    created: str = ""

    @property
    def gap(self) -> float:
        """Gap of the network; see `network_gap`."""
        return network_gap(self.criterion, self.value, self.bound)

    @property
    def certificate(self) -> str:
        """Certificate as a sentence."""
        money = f"${self.budget_usd:,.0f}"
        use = f"Proven: no other use of {money} among these sites and candidates"
        if self.criterion == "road":
            most = "" if self.gap <= PROVEN else f" than {math.ceil(self.bound * 1000 - 1e-6) / 10:.1f}%"
            return f"{use} sees more{most} of the road."
        most = "" if self.gap <= PROVEN else f" than {math.ceil(10 * math.expm1(self.bound) - 1e-6) / 10:,.1f}"
        return f"{use} has more{most} returns from a typical road user."


def network_gap(criterion: Literal["road", "returns"], value: float, bound: float) -> float:
    """Return the largest possible gain of another use of the same money, as a share.

    For returns it is that of their geometric mean over road users and sites, as for a single site.
    """
    if criterion == "returns":
        return math.expm1(max(0.0, bound - value))
    return max(0.0, bound / value - 1.0) if value > 0 else math.inf if bound > 0 else 0.0


def ranked_sites(record: NetworkRecord) -> list[tuple[NetworkSite, float | None]]:
    """Return the sites with their gains, by falling gain; those without sensor and failed ones follow.

    A gain is that of the criterion for $1,000 spent at the site, times its weight over the mean weight; None if no
    money is spent there.
    """
    weights = [site.weight for site in record.sites if site.status != "failed"]
    mean = math.fsum(weights) / len(weights) if weights else 0.0
    rows: list[tuple[NetworkSite, float | None]] = []
    for site in record.sites:
        paid = site.status == "equipped" and site.price_usd > 0
        relative = site.weight / mean if mean > 0 else 1.0
        rows.append((site, relative * site.value / site.price_usd * 1000.0 if paid else None))
    return sorted(rows, key=lambda row: (_ORDER.index(row[0].status), row[1] is None, -(row[1] or 0.0)))


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
