"""The LiDAR model: beam table, ranges, rates, price and noise parameters."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from ...base import limits
from ...base.arrays import Boolean, Float, Integer
from ...base.errors import SeipError
from ...base.limits import Limits
from .carla_dropoff import CarlaDropoff
from .range_equation import RangeEquation

DetectionLaw = RangeEquation | CarlaDropoff
"""Law by which returns are detected: physical, or the one of CARLA."""
MAX_RAYS = 50_000_000
"""Limit on the rays of a revolution: fifty times the finest type of the study."""


def short_name(name: str) -> str:
    """Return the name of a product without the remark in brackets: ``VLP-16`` for ``VLP-16 (Puck)``."""
    return name.partition(" (")[0]


@dataclass(frozen=True, eq=False)
class LidarModel:
    """A LiDAR that rotates, or scans a limited horizontal field of view in columns.

    Parameters
    ----------
    key : str
        Name in the catalogue.
    name, manufacturer : str
        Names to display.
    source : str
        Document with the figures.
    elevations : (c,) float64, radians
        Elevation of each channel above the sensor's horizontal plane, in the published order.
    min_range, max_range : float, metres
        Limits of the distances that are measured.
    points_per_second : float
        Rate of single returns of all channels together.
    rotation_rate : float, hertz
        Revolutions per second, or frames per second if the field of view is limited.
    price_range : tuple of two floats, US dollars
        Lowest and highest price.
    price_source : str
        Source of the price.
    azimuth_offsets : (c,) float64, radians
        Azimuth of each channel relative to the head's, counter-clockwise; zeros by default.
    field_of_view : float, radians
        Horizontal field of view, symmetrical about azimuth zero: 2π for a sensor that rotates.
    clockwise : bool
        Whether it rotates clockwise, seen from above. That only changes the time at which each azimuth is scanned.
    range_noise_std : float, metres
        Standard deviation of the range noise (Gaussian) near the sensor.
    range_noise_growth : float, 1/m
        Growth of the standard deviation with r².
    law : RangeEquation or CarlaDropoff
        Law by which returns are detected.
    calibration : str
        Sweep on which the law was calibrated; empty if it is derived from a data sheet.
    gains : (float, float)
        Lowest and highest plausible gain: received power as a multiple of that in the law. Both are 1 for a calibrated
        law, and for one that counts every return.
    assumed_beams, assumed_law : str
        Assumptions about the beams and about the law that no document confirms; empty if all is published.

    Examples
    --------
    >>> four = LidarModel(
    ...     key="own", name="Own 4 (prototype)", manufacturer="Example Optics", source="data sheet",
    ...     elevations=np.radians([-15.0, -5.0, 5.0, 15.0]), min_range=0.5, max_range=100.0,
    ...     points_per_second=28_800.0, rotation_rate=10.0, price_range=(3_000.0, 5_000.0),
    ... )
    >>> four.short_name, four.channels, four.azimuth_count, round(math.degrees(four.azimuth_step), 6), four.price
    ('Own 4', 4, 720, 0.5, 4000.0)
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
    field_of_view: float = math.tau
    clockwise: bool = False
    range_noise_std: float = 0.03
    range_noise_growth: float = 0.0
    law: DetectionLaw = field(default_factory=CarlaDropoff)
    calibration: str = ""
    gains: tuple[float, float] = (1.0, 1.0)
    assumed_beams: str = ""
    assumed_law: str = ""

    def __post_init__(self) -> None:
        if self.azimuth_offsets.size == 0:
            object.__setattr__(self, "azimuth_offsets", np.zeros(len(self.elevations)))
        _require_valid(self)

    @property
    def short_name(self) -> str:
        """Name without the remark in brackets, for labels."""
        return short_name(self.name)

    @property
    def channels(self) -> int:
        """Number of channels."""
        return len(self.elevations)

    @property
    def azimuth_count(self) -> int:
        """Azimuth steps in a revolution or frame, from points per second, rotation and channels."""
        return max(1, round(self.points_per_second / self.rotation_rate / self.channels))

    @property
    def all_round(self) -> bool:
        """Whether the field of view is the full circle, so that step 0 follows the last one."""
        return self.field_of_view == math.tau

    @property
    def azimuth_step(self) -> float:
        """Radians between neighbouring azimuth steps."""
        return self.field_of_view / self.azimuth_count

    @property
    def first_azimuth(self) -> float:
        """Azimuth of step 0, radians; the steps of a limited field of view lie symmetrically about azimuth zero."""
        return 0.0 if self.all_round else (self.azimuth_step - self.field_of_view) / 2

    def faces(self, vectors: Float) -> Boolean:
        """Return which vectors (n, 3) in the sensor's axes lie within its horizontal field of view, (n,) bool."""
        within: Boolean = np.abs(np.arctan2(vectors[:, 1], vectors[:, 0])) <= self.field_of_view / 2
        return within

    @property
    def price(self) -> float:
        """Middle of the price range in US dollars."""
        return sum(self.price_range) / 2

    @property
    def assumed(self) -> str:
        """Assumptions about beams and law that no document confirms."""
        return "; ".join(filter(None, (self.assumed_beams, self.assumed_law)))

    def range_noise(self, distance: Float) -> Float:
        """Return the standard deviation of the range noise, (n,) float64, at distances (n,), all in metres."""
        return self.range_noise_std + self.range_noise_growth * distance**2

    @property
    def beams_key(self) -> str:
        """Digest of the directions of the beams."""
        steps = (float(self.azimuth_count), self.field_of_view)
        return hashlib.sha256(np.concatenate([self.elevations, self.azimuth_offsets, steps]).tobytes()).hexdigest()[:16]

    def delay(self, ray: Integer) -> Float:
        """Return the time of rays (n,) int64 after the beginning of the revolution or frame, (n,) float64, seconds."""
        steps = self.azimuth_count
        order = ray % steps
        if self.clockwise:  # all round it begins at azimuth zero, else at the other end of the field of view
            order = -order % steps if self.all_round else steps - 1 - order
        return order / (steps * self.rotation_rate)

    @property
    def evidence(self) -> str:
        """Evidence for the law of detection, as text."""
        if isinstance(self.law, CarlaDropoff):
            return "every return in range counts (CARLA's model)"
        if self.calibration:
            return f"calibrated on {self.calibration}"
        low, high = self.gains
        conditions = "without the conditions of its ranges" if self.assumed_law else "with reflectivity and probability"
        return f"derived from a data sheet {conditions}; plausible gains {low:g} to {high:g}"

    def amplified(self, gain: float) -> LidarModel:
        """Return the sensor with ``gain`` times the received power; a law without power does not change."""
        if gain == 1.0 or isinstance(self.law, CarlaDropoff):
            return self
        return replace(self, law=self.law.amplified(gain))

    def in_air(self, extinction: float) -> LidarModel:
        """Return the sensor in air with additional extinction, in 1/m, on the way out and back."""
        return replace(self, law=self.law.in_air(extinction))


def fields_of_view(models: Mapping[str, LidarModel]) -> dict[str, float]:
    """Return the horizontal field of view of each model by its key, radians."""
    return {key: model.field_of_view for key, model in models.items()}


def _require_valid(model: LidarModel) -> None:
    fault = Limits.first_fault(
        {
            "an elevation": (np.degrees(model.elevations), limits.BEAM_ELEVATION),
            "an azimuth offset": (np.degrees(model.azimuth_offsets), limits.BEAM_OFFSET),
            "the horizontal field of view": (math.degrees(model.field_of_view), limits.HORIZONTAL_VIEW),
            "its range": ((model.min_range, model.max_range), limits.LIDAR_RANGE),
            "the number of points per second": (model.points_per_second, limits.POINT_RATE),
            "the rotation rate": (model.rotation_rate, limits.ROTATION_RATE),
            "a plausible gain": (model.gains, limits.GAIN),
            "its price": (model.price_range, limits.PRICE),
            "the range noise": (model.range_noise_std, limits.RANGE_NOISE),
            "the growth of the range noise": (model.range_noise_growth, limits.NOISE_GROWTH),
        }
    )
    if fault:
        raise SeipError(f"LiDAR '{model.key}': {fault}")
    low, high = model.price_range
    checks = {
        "it needs at least one channel": model.channels > 0,
        "it needs one azimuth offset per channel": model.azimuth_offsets.shape == model.elevations.shape,
        "its range must be increasing": model.min_range < model.max_range,
        f"a revolution must have at most {MAX_RAYS:,} rays": (
            model.points_per_second <= MAX_RAYS * model.rotation_rate and model.channels <= MAX_RAYS
        ),
        "its plausible gains must not be decreasing": model.gains[0] <= model.gains[1],
        "its price range must be positive and not decreasing": 0 < low <= high,
    }
    for sentence, holds in checks.items():
        if not holds:
            raise SeipError(f"LiDAR '{model.key}': {sentence}")
