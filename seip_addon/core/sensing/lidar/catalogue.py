"""Catalogue of LiDAR models: the shipped TOML file, and TOML files of users."""

from __future__ import annotations

import difflib
import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, TypeGuard

import numpy as np

from ...base.errors import SeipError
from ...base.limits import CHANNELS, GAIN
from ...storage.toml_table import Key, number, parse_toml, read_table, toml_text
from .carla_dropoff import CarlaDropoff
from .model import DetectionLaw, LidarModel
from .range_equation import MAKER_PROBABILITY, RangeEquation

CALIBRATED = (1.0, 1.0)
SHEET_GAINS = (0.09, 2.3)
"""Gains that sweeps needed in addition to ranges with a reflectivity and a probability of detection."""
UNSTATED_GAINS = (0.09, 39.0)
"""The same for ranges without one of these conditions: sweeps of three makes needed 0.09, 0.19 and 39."""
_UNSTATED = (
    f"its data sheet states no {{}} at its ranges, and such sensors received {UNSTATED_GAINS[0]:g} to "
    f"{UNSTATED_GAINS[1]:g} times the power derived from them: measure one, or place it by the criterion road"
)
_LAWS = (RangeEquation.model, CarlaDropoff.model)
_SQRT_8 = math.sqrt(8.0)
"""Ratio of the ranges at 80 and at 10 % reflectivity if power falls with 1/r² only."""
_FIELDS = {
    "rotation_rate_hz": "rotation_rate",
    "range_noise_std_m": "range_noise_std",
    "range_noise_growth_per_m": "range_noise_growth",
}
"""Fields of a model by their names in a catalogue, which include the unit."""
_DROPOFF = {
    "attenuation_per_m": "attenuation",
    "dropoff_general_rate": "general",
    "dropoff_intensity_limit": "intensity_limit",
    "dropoff_zero_intensity": "zero_intensity",
}
"""Figures of `CarlaDropoff`, by their names in a catalogue."""


def load_catalogue(extra: Iterable[str | os.PathLike[str]] = ()) -> dict[str, LidarModel]:
    """Read the shipped models and those of further files, which replace earlier ones with the same key.

    Parameters
    ----------
    extra : iterable of path-like
        TOML files in the form of the shipped ``catalogue.toml``.

    Returns
    -------
    dict of str to LidarModel
        Models by catalogue key, in the order of the files.

    Raises
    ------
    SeipError
        A file cannot be read, or a model in it is invalid.

    Examples
    --------
    >>> model = find_models(load_catalogue(), ["os1_128"])["os1_128"]
    >>> model.name, len(model.elevations), model.max_range
    ('OS1-128', 128, 120.0)
    >>> find_models(load_catalogue(), ["os1_218"])
    Traceback (most recent call last):
    ...
    seip_addon.core.base.errors.SeipError: no LiDAR 'os1_218' in the catalogue; did you mean os1_128, os2_128, os0_128?
    """
    catalogue = dict(_shipped())
    for path in map(Path, extra):
        models = _parse(toml_text(path, "LiDAR catalogue"), str(path), catalogue)
        if not models:
            raise SeipError(f"{path} has no sensor: write [KEY] and its values below it")
        catalogue |= models
    return catalogue


def find_models(catalogue: Mapping[str, LidarModel], keys: Sequence[str]) -> dict[str, LidarModel]:
    """Return models by key.

    Raises
    ------
    SeipError
        A key is unknown; the message names similar ones.
    """
    for key in keys:
        if key not in catalogue:
            close = difflib.get_close_matches(key, catalogue, n=3, cutoff=0.4) or list(catalogue)
            raise SeipError(f"no LiDAR '{key}' in the catalogue; did you mean {', '.join(close)}?")
    return {key: catalogue[key] for key in keys}


@cache
def _shipped() -> dict[str, LidarModel]:
    """Return the shipped models, which panels ask for at every change; their arrays are shared, so made read-only."""
    text = resources.files(__package__).joinpath("catalogue.toml").read_text(encoding="utf-8")
    models = _parse(text, "catalogue.toml", {})
    for model in models.values():
        model.elevations.setflags(write=False)
        model.azimuth_offsets.setflags(write=False)
    return models


def _parse(content: str, file: str, known: Mapping[str, LidarModel]) -> dict[str, LidarModel]:
    """Return the models of a file; those of single units refer to the known ones."""
    return {
        key: _like(key, table, file, known) if isinstance(table, dict) and "like" in table else _model(key, table, file)
        for key, table in parse_toml(content, file).items()
    }


def _like(key: str, table: Any, file: str, known: Mapping[str, LidarModel]) -> LidarModel:  # noqa: ANN401 - as `_model`
    """Return a known model with the received power of a single unit, as `seip verify` writes it."""
    where = f"LiDAR '{key}' in {file}"
    values = read_table(table, where, _UNIT)
    try:
        model = find_models(known, [values["like"]])[values["like"]]
        calibration = values["calibration"]
        gains = tuple(values["gain_band"] or (CALIBRATED if calibration else model.gains))
        unit = model.amplified(values["gain"])
        name, calibration = values["name"] or model.name, calibration or model.calibration
        assumed = "" if calibration else model.assumed_law
        return replace(unit, key=key, name=name, calibration=calibration, assumed_law=assumed, gains=gains)
    except SeipError as error:
        raise SeipError(f"{where}: {error}") from error


def _model(key: str, table: Any, file: str) -> LidarModel:  # noqa: ANN401 - whatever the file holds
    where = f"LiDAR '{key}' in {file}"
    if not isinstance(table, dict):
        raise SeipError(f"{where} is not a table; write [{key}] and its values below it")
    values = read_table(table, where, _keys(table, where))
    if "channels" in values:
        low, high = values.pop("field_of_view_deg")
        if not low < high:
            raise SeipError(f"{where}: field_of_view_deg must be increasing, lower edge first, not {[low, high]}")
        values["elevations_deg"] = np.linspace(high, low, values.pop("channels"))
    (low, high), price_range = values.pop("range_m"), tuple(values.pop("price_usd"))
    given = {_FIELDS.get(name, name): value for name, value in values.items() if value is not None}
    angles = {name: np.radians(given.pop(f"{name}_deg")) for name in ("elevations", "azimuth_offsets")}
    field_of_view = math.radians(given.pop("horizontal_field_of_view_deg"))
    kind = given.pop("model", (CarlaDropoff if _DROPOFF.keys() & given.keys() else RangeEquation).model)
    beams = given.pop("assumed")
    own = {name: given.pop(name) for name in (*_DROPOFF, *_DETECTION) if name in given}
    strange = [name for name in own if name not in (_DROPOFF if kind == CarlaDropoff.model else _DETECTION)]
    if strange:
        raise SeipError(
            f'{where}: {strange[0]} is not a figure of the model "{kind}": leave it out, or name the other model'
        )
    try:
        calibration, gains = given.pop("calibration", ""), given.pop("gain_band", None)
        law: DetectionLaw
        if kind == CarlaDropoff.model:
            law, assumed, likely = _dropoff(own), "", CALIBRATED
        else:
            law, assumed, likely = _range_equation(own, high)
            calibration = calibration or ("a measurement of its own" if "detection_law" in own else "")
        return LidarModel(
            key=key,
            min_range=low,
            max_range=high,
            price_range=price_range,
            law=law,
            assumed_beams=beams,
            assumed_law="" if calibration else assumed,
            calibration=calibration,
            gains=tuple(gains or (CALIBRATED if calibration else likely)),
            field_of_view=field_of_view,
            **angles,
            **given,
        )
    except SeipError as error:
        sentence = str(error)
        raise SeipError(f"{sentence} (in {file})" if key in sentence else f"{where}: {sentence}") from error


def _keys(table: Mapping[str, Any], where: str) -> dict[str, Key]:
    """Return the keys that a table may have, which depend on the form of its beams."""
    if "elevations_deg" in table and _EVEN.keys() & table.keys():
        raise SeipError(f"{where}: give either elevations_deg or {', '.join(_EVEN)}")
    return _KEYS | _ROTATION | (_UNEVEN if "elevations_deg" in table else _EVEN)


def _dropoff(given: Mapping[str, float]) -> CarlaDropoff:
    return CarlaDropoff(**{_DROPOFF[name]: value for name, value in given.items()})


def _range_equation(given: Mapping[str, Any], longest: float) -> tuple[RangeEquation, str, tuple[float, float]]:
    """Return the law from published ranges or a measurement, its assumptions, and its plausible gains."""
    if "detection_law" in given:
        if len(given) > 1:
            raise SeipError("give either detection_law, as measured, or detection_range_m and detection_probability")
        threshold, spread, ceiling = given["detection_law"]
        return RangeEquation(threshold, spread, ceiling), "", CALIBRATED
    probability = given.get("detection_probability", MAKER_PROBABILITY)
    if "detection_range_m" in given:
        published = given["detection_range_m"]
        law = RangeEquation.of_ranges(published[0], [*published, published[0] * _SQRT_8][1], probability)
        if "detection_probability" in given:
            return law, "", SHEET_GAINS
        return law, _UNSTATED.format("probability of detection"), UNSTATED_GAINS
    assumed = f"its longest range, {longest:g} m, is taken to be the range at 10 % reflectivity; "
    law = RangeEquation.of_ranges(longest, longest * _SQRT_8, probability)
    return law, assumed + _UNSTATED.format("reflectivity"), UNSTATED_GAINS


def _is_number(value: object) -> TypeGuard[float]:
    # Whole numbers of any length are valid TOML, but no measure of anything beyond this.
    return isinstance(value, (int, float)) and not isinstance(value, bool) and not abs(value) > 1e300


def _number(value: object) -> float:
    if not _is_number(value):
        raise ValueError(f"must be a number, not {value!r}")
    return float(value)


def _boolean(value: object) -> bool:
    if not isinstance(value, bool):
        raise ValueError(f"must be true or false, not {value!r}")  # noqa: TRY004 -- what `read_table` takes
    return value


def _numbers(value: object) -> list[float]:
    if not isinstance(value, list) or not all(map(_is_number, value)):
        raise ValueError(f"must be a list of numbers, not {value!r}")
    return [float(one) for one in value]


def _several(count: int) -> Callable[[object], list[float]]:
    def read(value: object) -> list[float]:
        numbers = _numbers(value)
        if len(numbers) != count:
            raise ValueError(f"must hold {count} numbers, not {len(numbers)}")
        return numbers

    return read


def _one_or_two(value: object) -> list[float]:
    numbers = _numbers(value)
    if len(numbers) not in {1, 2}:
        raise ValueError(f"must hold the range at 10 % reflectivity, and that at 80 % if it is known, not {numbers}")
    return numbers


def _law(value: object) -> str:
    if value not in _LAWS:
        raise ValueError(f"must be one of {', '.join(map(repr, _LAWS))}, not {value!r}")
    return str(value)


def _channels(value: object) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not CHANNELS.allow(value):
        raise ValueError(f"must be a whole number from {CHANNELS}, not {value!r}")
    return value


_pair = _several(2)
_OPTIONAL = Key(_number, None)
_DETECTION = {
    "detection_range_m": Key(_one_or_two, None),
    "detection_probability": _OPTIONAL,
    "detection_law": Key(_several(3), None),
}
"""Figures of the range equation."""

_UNIT = {
    "like": Key(str),
    "gain": Key(number(GAIN)),
    "gain_band": Key(_pair, None),
    "name": Key(str, ""),
    "calibration": Key(str, ""),
}
"""Keys of a single unit of a known model."""

_KEYS = {
    "name": Key(str),
    "manufacturer": Key(str),
    "source": Key(str),
    "range_m": Key(_pair),
    "points_per_second": Key(_number),
    "price_usd": Key(_pair),
    "price_source": Key(str, None),
    "assumed": Key(str, ""),
    "calibration": Key(str, ""),
    "gain_band": Key(_pair, None),
    "range_noise_std_m": _OPTIONAL,
    "range_noise_growth_per_m": _OPTIONAL,
    "model": Key(_law, None),
    **_DETECTION,
    **dict.fromkeys(_DROPOFF, _OPTIONAL),
}
_ROTATION = {
    "rotation_rate_hz": Key(_number),
    "azimuth_offsets_deg": Key(_numbers, ()),
    "horizontal_field_of_view_deg": Key(_number, 360.0),
    "clockwise": Key(_boolean, False),  # noqa: FBT003 -- the value where none is given
}
_EVEN = {"channels": Key(_channels), "field_of_view_deg": Key(_pair)}
_UNEVEN = {"elevations_deg": Key(_numbers)}
"""Keys of beams at even elevations between two limits, and of beams at given elevations."""
