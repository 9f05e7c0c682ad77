"""Cost of installing a sensor at a position, in addition to the price of the sensor."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

from ..base.limits import DISTANCE, PRICE
from ..storage.toml_table import REQUIRED, Key, number, parse_toml, read_table, toml_text
from .candidates import Candidates

DEFAULTS = Path(__file__).with_name("installed_cost.toml")


@dataclass(frozen=True)
class InstalledCost:
    """Costs of installing a sensor, in dollars; the keys of the tables are the names of the fields.

    Parameters
    ----------
    new_post_usd, existing_pole_usd : float
        Cost of a new post for the sensor, and of mounting it on an existing pole.
    mast_arm_usd, mast_arm_beyond_m : float
        Cost of an arm, and distance (metres) from the axis of an existing pole beyond which one is needed.
    power_new_post_usd, power_existing_pole_usd, backhaul_usd : float
        Costs of electricity and of the data line.
    """

    new_post_usd: float
    existing_pole_usd: float
    mast_arm_usd: float
    mast_arm_beyond_m: float
    power_new_post_usd: float
    power_existing_pole_usd: float
    backhaul_usd: float

    def over(self, candidates: Candidates, bracket: float) -> Candidates:
        """Return candidates with the cost of installation at each position.

        Parameters
        ----------
        candidates : Candidates
            Candidate poses.
        bracket : float, metres
            Distance of sensors from the axis of an existing pole.
        """
        pole, post = (sum(self.items(on_pole=on_pole, bracket=bracket).values()) for on_pole in (True, False))
        return replace(candidates, installation=np.where(candidates.on_pole, pole, post))

    def items(self, *, on_pole: bool, bracket: float) -> dict[str, float]:
        """Return the cost of each item of an installation by its name, in dollars; items without cost are left out.

        Parameters
        ----------
        on_pole : bool
            Whether the sensor is mounted on an existing pole.
        bracket : float, metres
            Distance of sensors from the axis of an existing pole.
        """
        arm = self.mast_arm_usd if bracket > self.mast_arm_beyond_m else 0.0
        items = (
            {"mounting on the pole": self.existing_pole_usd, "mast arm": arm, "power": self.power_existing_pole_usd}
            if on_pole
            else {"new post": self.new_post_usd, "power": self.power_new_post_usd}
        )
        return {name: cost for name, cost in {**items, "data line": self.backhaul_usd}.items() if cost}


def load_installed_cost(path: str | os.PathLike[str] | None = None) -> InstalledCost:
    """Return the shipped table, updated with the values of a file if one is given.

    Raises
    ------
    SeipError
        The file cannot be read, or has an unknown key or an invalid value.
    """
    shipped = _table(DEFAULTS, {})
    return InstalledCost(**(shipped if path is None else _table(Path(path), shipped)))


def _table(path: Path, defaults: Mapping[str, float]) -> dict[str, float]:
    content = parse_toml(toml_text(path, "installed costs"), str(path))
    keys = {
        each.name: Key(number(DISTANCE if each.name.endswith("_m") else PRICE), defaults.get(each.name, REQUIRED))
        for each in fields(InstalledCost)
    }
    return read_table(content, str(path), keys)
