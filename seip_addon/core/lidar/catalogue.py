"""The catalogue of LiDAR models: TOML files, the shipped one and those that users add."""

from __future__ import annotations

import difflib
import os
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays import Float
from ..errors import SeipError
from .model import LidarModel

_REQUIRED = {"name", "manufacturer", "source", "range_m", "points_per_second", "rotation_rate_hz", "price_usd"}
_UNIFORM = {"channels", "field_of_view_deg"}
_TABLE = {"elevations_deg", "azimuth_offsets_deg"}
_OPTIONAL = {
    "price_source",
    "range_noise_std_m",
    "attenuation_per_m",
    "dropoff_general_rate",
    "dropoff_intensity_limit",
    "dropoff_zero_intensity",
}


def load_catalogue(extra: Iterable[str | os.PathLike[str]] = ()) -> dict[str, LidarModel]:
    """Read the shipped models and those of further files, later ones winning.

    Parameters
    ----------
    extra : iterable of path-like
        TOML files in the form of the shipped ``catalogue.toml``.

    Returns
    -------
    dict of str to LidarModel
        By catalogue key, in the order of the files.

    Raises
    ------
    SeipError
        A file cannot be read, or a model in it is at fault.
    """
    shipped = resources.files(__package__).joinpath("catalogue.toml").read_text(encoding="utf-8")
    catalogue = _parse(shipped, "catalogue.toml")
    for path in extra:
        try:
            text = Path(path).read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise SeipError(f"cannot read the LiDAR catalogue {path}: {error}; name a TOML file") from error
        catalogue |= _parse(text, str(path))
    return catalogue


def find_models(catalogue: Mapping[str, LidarModel], keys: Sequence[str]) -> dict[str, LidarModel]:
    """Pick models by key; an unknown key is an error that names close ones."""
    for key in keys:
        if key not in catalogue:
            close = difflib.get_close_matches(key, catalogue, n=3, cutoff=0.4) or list(catalogue)
            raise SeipError(f"no LiDAR '{key}' in the catalogue; did you mean {', '.join(close)}?")
    return {key: catalogue[key] for key in keys}


def _parse(text: str, file: str) -> dict[str, LidarModel]:
    try:
        tables = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise SeipError(f"{file} is not valid TOML: {error}") from error
    return {key: _model(key, table, file) for key, table in tables.items()}


def _model(key: str, table: Any, file: str) -> LidarModel:  # noqa: ANN401 - whatever the file holds
    where = f"LiDAR '{key}' in {file}"
    if not isinstance(table, dict):
        raise SeipError(f"{where} is no table; write [{key}] and its values below it")
    _require_keys(table, where)
    elevations = _numbers(table, "elevations_deg", where) if "elevations_deg" in table else _uniform(table, where)
    low, high = _numbers(table, "range_m", where, 2)
    cheap, dear = _numbers(table, "price_usd", where, 2)
    optional = {
        name: _number(table, entry, where)
        for name, entry in {
            "range_noise_std": "range_noise_std_m",
            "attenuation": "attenuation_per_m",
            "dropoff_general": "dropoff_general_rate",
            "dropoff_intensity_limit": "dropoff_intensity_limit",
            "dropoff_zero_intensity": "dropoff_zero_intensity",
        }.items()
        if entry in table
    }
    offsets = _numbers(table, "azimuth_offsets_deg", where) if "azimuth_offsets_deg" in table else np.zeros(0)
    try:
        return LidarModel(
            key=key,
            name=str(table["name"]),
            manufacturer=str(table["manufacturer"]),
            source=str(table["source"]),
            elevations=np.radians(elevations),
            min_range=float(low),
            max_range=float(high),
            points_per_second=_number(table, "points_per_second", where),
            rotation_rate=_number(table, "rotation_rate_hz", where),
            price_range=(float(cheap), float(dear)),
            price_source=str(table.get("price_source", "")),
            azimuth_offsets=np.radians(offsets),
            **optional,
        )
    except SeipError as error:
        raise SeipError(f"{error} (in {file})") from error


def _require_keys(table: Mapping[str, Any], where: str) -> None:
    beams = _TABLE - {"azimuth_offsets_deg"} if "elevations_deg" in table else _UNIFORM
    missing = sorted((_REQUIRED | beams) - set(table))
    if missing:
        raise SeipError(f"{where} lacks {', '.join(missing)}")
    known = _REQUIRED | _OPTIONAL | (_TABLE if "elevations_deg" in table else _UNIFORM | {"azimuth_offsets_deg"})
    unknown = sorted(set(table) - known)
    if unknown:
        raise SeipError(f"{where} has {', '.join(unknown)}, which means nothing there; known are {sorted(known)}")


def _uniform(table: Mapping[str, Any], where: str) -> Float:
    low, high = _numbers(table, "field_of_view_deg", where, 2)
    channels = table["channels"]
    if not isinstance(channels, int) or isinstance(channels, bool) or not 2 <= channels <= 10_000:
        raise SeipError(f"{where}: channels must be a whole number from 2 to 10,000, not {channels!r}")
    if not low < high:
        raise SeipError(f"{where}: field_of_view_deg must be increasing, lower edge first, not {[low, high]}")
    elevations: Float = np.linspace(high, low, channels)
    return elevations


def _numbers(table: Mapping[str, Any], entry: str, where: str, count: int | None = None) -> Float:
    values = table[entry]
    if not isinstance(values, list) or not all(_is_number(value) for value in values):
        raise SeipError(f"{where}: {entry} must be a list of numbers, not {values!r}")
    if count is not None and len(values) != count:
        raise SeipError(f"{where}: {entry} must hold {count} numbers, not {len(values)}")
    return np.array(values, dtype=np.float64)


def _number(table: Mapping[str, Any], entry: str, where: str) -> float:
    if not _is_number(table[entry]):
        raise SeipError(f"{where}: {entry} must be a number, not {table[entry]!r}")
    return float(table[entry])


def _is_number(value: object) -> bool:
    # Whole numbers of any length are valid TOML, but no measure of anything beyond this.
    return isinstance(value, (int, float)) and not isinstance(value, bool) and not abs(value) > 1e300
