"""The catalogue of LiDAR models: TOML files, the shipped one and those that users add."""

from __future__ import annotations

import difflib
import os
from collections.abc import Iterable, Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any, TypeGuard

import numpy as np

from ..errors import SeipError
from ..storage.toml_table import Key, parse_toml, read_table
from .model import LidarModel


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
            content = Path(path).read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise SeipError(f"cannot read the LiDAR catalogue {path}: {error}; name a TOML file") from error
        catalogue |= _parse(content, str(path))
    return catalogue


def find_models(catalogue: Mapping[str, LidarModel], keys: Sequence[str]) -> dict[str, LidarModel]:
    """Pick models by key; an unknown key is an error that names close ones."""
    for key in keys:
        if key not in catalogue:
            close = difflib.get_close_matches(key, catalogue, n=3, cutoff=0.4) or list(catalogue)
            raise SeipError(f"no LiDAR '{key}' in the catalogue; did you mean {', '.join(close)}?")
    return {key: catalogue[key] for key in keys}


def _parse(content: str, file: str) -> dict[str, LidarModel]:
    return {key: _model(key, table, file) for key, table in parse_toml(content, file).items()}


def _model(key: str, table: Any, file: str) -> LidarModel:  # noqa: ANN401 - whatever the file holds
    where = f"LiDAR '{key}' in {file}"
    if not isinstance(table, dict):
        raise SeipError(f"{where} is no table; write [{key}] and its values below it")
    if "elevations_deg" in table and _EVEN.keys() & table.keys():
        raise SeipError(f"{where}: give either elevations_deg or {', '.join(_EVEN)}")
    values = read_table(table, where, _KEYS | (_UNEVEN if "elevations_deg" in table else _EVEN))
    if "channels" in values:
        low, high = values.pop("field_of_view_deg")
        if not low < high:
            raise SeipError(f"{where}: field_of_view_deg must be increasing, lower edge first, not {[low, high]}")
        values["elevations_deg"] = np.linspace(high, low, values.pop("channels"))
    (low, high), price_range = values.pop("range_m"), tuple(values.pop("price_usd"))
    given = {_FIELDS.get(name, name): value for name, value in values.items() if value is not None}
    angles = {name: np.radians(given.pop(f"{name}_deg")) for name in ("elevations", "azimuth_offsets")}
    try:
        return LidarModel(key=key, min_range=low, max_range=high, price_range=price_range, **angles, **given)
    except SeipError as error:
        raise SeipError(f"{error} (in {file})") from error


def _is_number(value: object) -> TypeGuard[float]:
    # Whole numbers of any length are valid TOML, but no measure of anything beyond this.
    return isinstance(value, (int, float)) and not isinstance(value, bool) and not abs(value) > 1e300


def _number(value: object) -> float:
    if not _is_number(value):
        raise ValueError(f"must be a number, not {value!r}")
    return float(value)


def _numbers(value: object) -> list[float]:
    if not isinstance(value, list) or not all(map(_is_number, value)):
        raise ValueError(f"must be a list of numbers, not {value!r}")
    return [float(one) for one in value]


def _pair(value: object) -> list[float]:
    numbers = _numbers(value)
    if len(numbers) != 2:
        raise ValueError(f"must hold 2 numbers, not {len(numbers)}")
    return numbers


def _channels(value: object) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not 2 <= value <= 10_000:
        raise ValueError(f"must be a whole number from 2 to 10,000, not {value!r}")
    return value


_FIELDS = {
    "rotation_rate_hz": "rotation_rate",
    "range_noise_std_m": "range_noise_std",
    "attenuation_per_m": "attenuation",
    "dropoff_general_rate": "dropoff_general",
}
"""Fields of a model that a catalogue calls by another name, with their units."""

_OPTIONAL = Key(_number, None)
_KEYS = {
    "name": Key(str),
    "manufacturer": Key(str),
    "source": Key(str),
    "range_m": Key(_pair),
    "points_per_second": Key(_number),
    "rotation_rate_hz": Key(_number),
    "price_usd": Key(_pair),
    "price_source": Key(str, None),
    "azimuth_offsets_deg": Key(_numbers, ()),
    "range_noise_std_m": _OPTIONAL,
    "attenuation_per_m": _OPTIONAL,
    "dropoff_general_rate": _OPTIONAL,
    "dropoff_intensity_limit": _OPTIONAL,
    "dropoff_zero_intensity": _OPTIONAL,
}
_EVEN = {"channels": Key(_channels), "field_of_view_deg": Key(_pair)}
_UNEVEN = {"elevations_deg": Key(_numbers)}
"""Beams at even elevations between two, or at elevations of their own."""
