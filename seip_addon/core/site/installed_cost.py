"""What it costs to install a sensor at a position, beside the sensor's own price."""

from __future__ import annotations

import math
import os
import tomllib
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import SeipError
from .candidates import Candidates

DEFAULTS = Path(__file__).with_name("installed_cost.toml")
MOST = 1e9
"""Dollars or metres above which a figure is taken for a typing error."""


@dataclass(frozen=True)
class InstalledCost:
    """Costs of installing a sensor, in dollars; the keys of the tables are the names of the fields.

    Parameters
    ----------
    new_post_usd, existing_pole_usd : float
        Of a post that is put up for the sensor, and of mounting it on a pole that is there.
    mast_arm_usd, mast_arm_beyond_m : float
        Of an arm, where the sensor hangs farther (metres) than that from the axis of an existing pole.
    power_new_post_usd, power_existing_pole_usd, backhaul_usd : float
        Of electricity and of the line that takes the data away.
    """

    new_post_usd: float
    existing_pole_usd: float
    mast_arm_usd: float
    mast_arm_beyond_m: float
    power_new_post_usd: float
    power_existing_pole_usd: float
    backhaul_usd: float

    def over(self, candidates: Candidates, bracket: float) -> Candidates:
        """Return candidates whose positions cost what they do here.

        Parameters
        ----------
        bracket : float, metres
            How far from the axis of an existing pole sensors hang.
        """
        arm = self.mast_arm_usd if bracket > self.mast_arm_beyond_m else 0.0
        pole = self.existing_pole_usd + arm + self.power_existing_pole_usd
        post = self.new_post_usd + self.power_new_post_usd
        return replace(candidates, installation=np.where(candidates.on_pole, pole, post) + self.backhaul_usd)


def load_installed_cost(path: str | os.PathLike[str] | None = None) -> InstalledCost:
    """Return the shipped table, or that of a file over it.

    Raises
    ------
    SeipError
        The file cannot be read, or one of its keys or values is none of the table's.
    """
    table = _read(DEFAULTS)
    if path is not None:
        own = _read(Path(path))
        for name, value in own.items():
            _check(name, value, path)
        table |= own
    return InstalledCost(**{name: float(value) for name, value in table.items()})


def _read(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise SeipError(f"cannot read the installed costs {path}: {error.strerror}") from error
    except ValueError as error:
        raise SeipError(f"the installed costs {path} are no TOML: {error}") from error


def _check(name: str, value: object, path: str | os.PathLike[str]) -> None:
    known = [each.name for each in fields(InstalledCost)]
    if name not in known:
        raise SeipError(f"{path} has the key {name!r}, which no installed cost has; there are {', '.join(known)}")
    number = value if isinstance(value, int | float) and not isinstance(value, bool) else math.nan
    if not 0 <= number <= MOST:
        raise SeipError(f"{name} in {path} must be a number from 0 to {MOST:g}, not {value!r}")
