"""Costs of a placement by item: sensors, posts, mounting, power and data lines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

from ...site.installed_cost import InstalledCost, load_installed_cost
from .placement_record import PlacementRecord, RecordedSensor

SENSOR = "sensor"
CENT = 0.01  # dollars to which prices are rounded


@dataclass(frozen=True)
class Costs:
    """Cost items of each sensor, in dollars, in the order of the record.

    Parameters
    ----------
    items : tuple of mapping of str to float
        `SENSOR` first.
    estimated : bool
        Whether the placement was made on the prices of sensors only, and installation is added here.
    """

    items: tuple[Mapping[str, float], ...]
    estimated: bool

    @property
    def sensors(self) -> float:
        """Price of all sensors."""
        return sum(items[SENSOR] for items in self.items)

    @property
    def total(self) -> float:
        """Price of all sensors with their installation."""
        return sum(sum(items.values()) for items in self.items)

    @property
    def by_item(self) -> list[tuple[str, int, float]]:
        """Name, number and sum of each item."""
        names = dict.fromkeys(name for items in self.items for name in items)
        found = [(name, [items[name] for items in self.items if name in items]) for name in names]
        return [(name, len(each), sum(each)) for name, each in found]


def costs_of(record: PlacementRecord) -> Costs:
    """Return the costs of a placement; installation is that of the record, or of the shipped table if it has none."""
    settings = record.request
    table, bracket = settings.installed_cost or _shipped(), settings.candidates.bracket
    return Costs(tuple(_items(sensor, table, bracket) for sensor in record.sensors), not record.installed)


def _items(sensor: RecordedSensor, table: InstalledCost, bracket: float) -> dict[str, float]:
    installation = table.items(on_pole=sensor.on_pole, bracket=bracket)
    recorded = sensor.installation_usd
    if recorded is not None and abs(recorded - sum(installation.values())) > CENT:
        installation = {"installation": recorded}
    return {SENSOR: sensor.price_usd - (recorded or 0.0), **installation}


@cache  # the panel asks at every redraw
def _shipped() -> InstalledCost:
    return load_installed_cost()
