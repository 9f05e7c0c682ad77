"""LiDAR models: what a sensor type's beams are, what they cost, and how its returns are disturbed.

Visibility uses the beam pattern and the range alone. Noise, intensity and
drop-off are for scans of traffic, and seeded by the generator that is passed in.
"""

from __future__ import annotations

import difflib
import functools
import math
import os
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from .arrays import Float, Integer
from .errors import SeipError

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


@dataclass(frozen=True, eq=False)
class LidarModel:
    """A spinning LiDAR.

    Parameters
    ----------
    key : str
        Name in the catalogue.
    name, manufacturer : str
        For people.
    source : str
        Document that the figures are from.
    elevations : (c,) float64, radians
        Elevation of each channel above the sensor's horizontal plane, in the
        order in which they are published.
    min_range, max_range : float, metres
        A return nearer or farther than these is none.
    points_per_second : float
        Single returns, all channels together.
    rotation_rate : float, hertz
        Revolutions per second at which the sensor is used.
    price_range : tuple of two floats, US dollars
        Lowest and highest price.
    price_source : str
        Where the price is from.
    azimuth_offsets : (c,) float64, radians
        What each channel's azimuth is ahead of the head's, counter-clockwise.
        Zeros when not given.
    range_noise_std : float, metres
        Standard deviation of the range noise (Gaussian).
    attenuation : float, 1/m
        a in the intensity law I = ρ · cos θ · exp(−a · r).
    dropoff_general : float
        Share of all returns that is lost whatever their intensity.
    dropoff_intensity_limit, dropoff_zero_intensity : float
        A return of at least the limit is kept; below it the probability to be
        lost grows linearly to ``dropoff_zero_intensity`` at intensity 0.
        (The drop-off model of CARLA's ray-cast LiDAR.)
    """

    key: str
    name: str
    manufacturer: str
    source: str
    elevations: Float
    min_range: float
    max_range: float
    points_per_second: float
    rotation_rate: float
    price_range: tuple[float, float]
    price_source: str = ""
    azimuth_offsets: Float = field(default_factory=lambda: np.zeros(0))
    range_noise_std: float = 0.03
    attenuation: float = 0.004
    dropoff_general: float = 0.0
    dropoff_intensity_limit: float = 0.8
    dropoff_zero_intensity: float = 0.4

    def __post_init__(self) -> None:
        if self.azimuth_offsets.size == 0:
            object.__setattr__(self, "azimuth_offsets", np.zeros(len(self.elevations)))
        _require_valid(self)

    @property
    def channels(self) -> int:
        """Number of channels."""
        return len(self.elevations)

    @property
    def azimuth_count(self) -> int:
        """Azimuth steps in a revolution, from points per second, rotation and channels."""
        return max(1, round(self.points_per_second / self.rotation_rate / self.channels))

    @property
    def price(self) -> float:
        """Middle of the price range in US dollars."""
        return sum(self.price_range) / 2


class BeamPattern:
    """The directions of a model's rays, computed alike whichever of them are asked for.

    Ray (channel c, step k) points at azimuth yaw + offset[c] + 2πk/azimuth_count,
    counter-clockwise from +x, and at elevation[c]. Sines and cosines are looked
    up and turned by the addition theorem, because products and sums of float64
    are the same bits in every batch and vectorised sines need not be.

    Parameters
    ----------
    model : LidarModel
    yaw : float, radians
        Direction of azimuth zero.
    """

    def __init__(self, model: LidarModel, yaw: float = 0.0) -> None:
        self.shape = (model.channels, model.azimuth_count)
        self._step_cos, self._step_sin = _turns(model.azimuth_count)
        turn = yaw + model.azimuth_offsets
        level = np.cos(model.elevations)
        self._turn_cos, self._turn_sin = np.cos(turn) * level, np.sin(turn) * level
        self._rise = np.sin(model.elevations)

    def directions(self, rays: Integer) -> Float:
        """Return unit directions of rays given by ``channel * azimuth_count + step``.

        Parameters
        ----------
        rays : (n,) int64

        Returns
        -------
        (n, 3) float64
        """
        channel, step = np.divmod(rays, self.shape[1])
        cos, sin = self._step_cos[step], self._step_sin[step]
        turn_cos, turn_sin = self._turn_cos[channel], self._turn_sin[channel]
        out = np.empty((len(rays), 3))
        out[:, 0] = cos * turn_cos - sin * turn_sin
        out[:, 1] = sin * turn_cos + cos * turn_sin
        out[:, 2] = self._rise[channel]
        return out


@functools.cache
def _turns(steps: int) -> tuple[Float, Float]:
    """Cosines and sines of a revolution in equal steps."""
    angle = 2 * math.pi / steps * np.arange(steps)
    return np.cos(angle), np.sin(angle)


def beam_directions(model: LidarModel, yaw: float = 0.0) -> Float:
    """Return the unit directions of one revolution.

    Parameters
    ----------
    model : LidarModel
    yaw : float, radians
        Direction of azimuth zero, counter-clockwise from +x.

    Returns
    -------
    (channels, azimuth_count, 3) float64
    """
    rays = np.arange(model.channels * model.azimuth_count)
    return BeamPattern(model, yaw).directions(rays).reshape(model.channels, model.azimuth_count, 3)


def return_intensity(
    model: LidarModel, distance: Float, cos_incidence: Float, reflectivity: Float | float = 1.0
) -> Float:
    """Return I = ρ · |cos θ| · exp(−a · r), the Lambertian law with attenuation in air.

    Parameters
    ----------
    model : LidarModel
        Its ``attenuation`` is a.
    distance : (n,) float64, metres
        Range r of each return; infinite on a miss, which has intensity 0.
    cos_incidence : (n,) float64
        Cosine of the angle between ray and surface normal.
    reflectivity : (n,) float64 or float
        Reflectivity ρ of each surface, 0 to 1.

    Returns
    -------
    (n,) float64, 0 to 1
    """
    hit = np.isfinite(distance)
    intensity: Float = np.abs(cos_incidence) * reflectivity * np.exp(-model.attenuation * np.where(hit, distance, 0.0))
    return np.where(hit, intensity, 0.0)


def measured_returns(model: LidarModel, distance: Float, intensity: Float, random: np.random.Generator) -> Float:
    """Return ranges as the sensor measures them: without the lost returns, and with noise.

    Parameters
    ----------
    model : LidarModel
    distance : (n,) float64, metres
        True ranges, infinite on a miss.
    intensity : (n,) float64
        Of each return, as `return_intensity` gives it.
    random : numpy.random.Generator
        The same number of values is drawn whatever the ranges are, so that one
        ray's fate does not change another's.

    Returns
    -------
    (n,) float64, metres
        Infinite where there is no return.
    """
    general, by_intensity = random.random((2, len(distance)))
    noise = random.normal(0.0, model.range_noise_std, len(distance))
    slope = model.dropoff_zero_intensity / model.dropoff_intensity_limit
    keep = np.minimum(1.0, slope * intensity + 1.0 - model.dropoff_zero_intensity)
    kept = (general >= model.dropoff_general) & (by_intensity < keep)
    within = (distance >= model.min_range) & (distance <= model.max_range)
    return np.where(kept & within, np.maximum(distance + noise, 0.0), np.inf)


def load_catalogue(extra: Iterable[str | os.PathLike[str]] = ()) -> dict[str, LidarModel]:
    """Read the shipped models and those of further files, later ones winning.

    Parameters
    ----------
    extra : iterable of path-like
        TOML files in the form of ``lidar_catalogue.toml``.

    Returns
    -------
    dict of str to LidarModel
        By catalogue key, in the order of the files.

    Raises
    ------
    SeipError
        A file cannot be read, or a model in it is at fault.
    """
    shipped = resources.files(__package__).joinpath("lidar_catalogue.toml").read_text(encoding="utf-8")
    catalogue = _parse(shipped, "lidar_catalogue.toml")
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
    except tomllib.TOMLDecodeError as error:
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
    if not isinstance(channels, int) or isinstance(channels, bool) or channels < 2:
        raise SeipError(f"{where}: channels must be a whole number of at least 2, not {channels!r}")
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
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _require_valid(model: LidarModel) -> None:
    right_angle = math.pi / 2
    low, high = model.price_range
    checks = {
        "it needs at least one channel": model.channels > 0,
        "elevations must lie between -90 and 90 degrees": bool((np.abs(model.elevations) < right_angle).all()),
        "it needs one azimuth offset per channel": model.azimuth_offsets.shape == model.elevations.shape,
        "azimuth offsets must be finite": bool(np.isfinite(model.azimuth_offsets).all()),
        "its range must be increasing, from 0 m or more, and finite": 0 <= model.min_range < model.max_range < math.inf,
        "points per second must be positive and finite": 0 < model.points_per_second < math.inf,
        "the rotation rate must be positive and finite": 0 < model.rotation_rate < math.inf,
        "its price range must be positive, finite and not decreasing": 0 < low <= high < math.inf,
        "the range noise must be 0 m or more and finite": 0 <= model.range_noise_std < math.inf,
        "attenuation must be 0 or more and finite": 0 <= model.attenuation < math.inf,
        "the general drop-off must lie between 0 and 1": 0 <= model.dropoff_general <= 1,
        "the drop-off at zero intensity must lie between 0 and 1": 0 <= model.dropoff_zero_intensity <= 1,
        "the drop-off's intensity limit must lie above 0 and up to 1": 0 < model.dropoff_intensity_limit <= 1,
    }
    for sentence, holds in checks.items():
        if not holds:
            raise SeipError(f"LiDAR '{model.key}': {sentence}")
