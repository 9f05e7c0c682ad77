"""Comparison of a LiDAR model with a measured sensor: shares returned, beams, and range noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from seip_addon.core.arrays import Float
from seip_addon.core.errors import SeipError
from seip_addon.core.sensing.lidar.model import LidarModel
from seip_addon.core.sensing.lidar.range_equation import RangeEquation

from .reference import MeasuredSensor, NoiseBin
from .share_fit import Fits, fit


@dataclass(frozen=True)
class BeamDifference:
    """Largest and root mean square differences of beams, in degrees.

    The common rotation is removed from azimuths first. Of the two possible senses of rotation, the one that fits
    better is taken.
    """

    elevation_largest: float
    elevation_rms: float
    azimuth_largest: float
    azimuth_rms: float


@dataclass(frozen=True)
class NoiseRatio:
    """Range noise of a model over the measured one, in a bin of ranges."""

    bin: NoiseBin
    ratio: float


@dataclass(frozen=True)
class Comparison:
    """Comparison of a model with a measured sensor.

    Parameters
    ----------
    name : str
        Name of the measured sensor.
    fits : Fits or None
        Fitted laws of detection; None if no bin has enough rays.
    """

    name: str
    sensor: MeasuredSensor
    model: LidarModel
    fits: Fits | None
    beams: BeamDifference
    ground_noise: tuple[NoiseRatio, ...]
    vertical_noise: tuple[NoiseRatio, ...]


def compare(name: str, sensor: MeasuredSensor, model: LidarModel) -> Comparison:
    """Compare a model with a measured sensor.

    Raises
    ------
    SeipError
        The model does not follow the range equation.
    """
    law = model.law
    if not isinstance(law, RangeEquation):
        raise SeipError(
            f"LiDAR '{model.key}' uses the drop-off of CARLA instead of the range equation: name another model"
        )
    return Comparison(
        name=name,
        sensor=sensor,
        model=model,
        fits=fit(sensor, law),
        beams=_beam_difference(sensor, model),
        ground_noise=_noise_ratios(sensor.range_noise_ground, model),
        vertical_noise=_noise_ratios(sensor.range_noise_vertical, model),
    )


def _beam_difference(sensor: MeasuredSensor, model: LidarModel) -> BeamDifference:
    """Match beams by elevation: in order if their numbers are equal, otherwise each measured beam to the nearest."""
    measured = np.asarray(sensor.beams.elevation_deg)
    published = np.degrees(model.elevations)
    if len(measured) == len(published):
        rows = np.argsort(measured, kind="stable")
        partner = np.argsort(published, kind="stable")
    else:
        rows = np.arange(len(measured))
        partner = np.abs(measured[:, None] - published).argmin(axis=1)
    elevation = np.abs(measured[rows] - published[partner])
    offsets, of_model = np.asarray(sensor.beams.azimuth_offset_deg)[rows], np.degrees(model.azimuth_offsets[partner])
    azimuth = min((_unrotated(of_model - sense * offsets) for sense in (1.0, -1.0)), key=_rms)
    return BeamDifference(float(elevation.max()), _rms(elevation), float(azimuth.max()), _rms(azimuth))


def _unrotated(difference: Float) -> Float:
    """Return the absolute differences of angles (n,), degrees, without their common rotation (the circular mean)."""
    turns = np.exp(1j * np.radians(difference))
    rest: Float = np.abs(np.degrees(np.angle(turns * np.conj(turns.mean()))))
    return rest


def _rms(values: Float) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _noise_ratios(bins: Sequence[NoiseBin], model: LidarModel) -> tuple[NoiseRatio, ...]:
    closed = [one for one in bins if one.middle < np.inf]
    noise = model.range_noise(np.array([one.middle for one in closed]))
    return tuple(NoiseRatio(one, float(std) / one.robust_std_m) for one, std in zip(closed, noise, strict=True))
