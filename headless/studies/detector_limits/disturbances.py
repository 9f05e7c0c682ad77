"""Disturbances of measurements (noise, loss, rain, pose and clock errors), each with a size.

A disturbance changes the sensors, the traffic, the scan of a frame, its points,
or the detector, and nothing else. At size 0 nothing changes, bit for bit.
Random draws depend only on the frame's number and a seed. A larger loss removes
everything that a smaller one removes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

from headless.detection.detector import Detector
from headless.studies.frame_points import POINT_FIELDS, recounted, some_points
from headless.studies.random_sites.varied_bodies import resized

import numpy as np

from seip_addon.core.arrays import Boolean, Float
from seip_addon.core.progress import finish
from seip_addon.core.sensing.lidar.carla_dropoff import CarlaDropoff
from seip_addon.core.sensing.lidar.model import DetectionLaw, LidarModel
from seip_addon.core.sensing.scans.frame import STATIC_INSTANCE, Frame
from seip_addon.core.sensing.scans.sensor import MountedSensor
from seip_addon.core.sensing.scans.simulation import Simulation
from seip_addon.core.sensing.traffic.trajectories import Trajectories, some_users

ERROR_AXIS = np.array([1.0, 1.0, 0.0]) / math.sqrt(2)
"""Unit vector of position and tilt errors, diagonal in plan, along no street."""

DROP_RANGE = 10.0
"""Largest distance of a raindrop that causes a return from the sensor, metres."""

DROP_INTENSITY = 0.05
"""Intensity of a drop's return: at the dark end of the range of surfaces."""


@dataclass(frozen=True)
class Disturbance:
    """Base class of disturbances, without effect; subclasses override one of the methods.

    Parameters
    ----------
    size : float
        Size in `unit`.
    """

    size: float = 0.0
    name: ClassVar[str] = "undisturbed"
    unit: ClassVar[str] = ""

    def disturbed_sensors(self, sensors: Sequence[MountedSensor]) -> tuple[MountedSensor, ...]:
        """Return the disturbed sensors."""
        return tuple(sensors)

    def disturbed_traffic(self, trajectories: Trajectories) -> Trajectories:
        """Return the disturbed traffic."""
        return trajectories

    def disturbed_scan(self, simulation: Simulation, number: int, time: float) -> Frame:
        """Return a frame of a disturbed scan."""
        return simulation.frame(number, time)

    def disturbed_frame(self, frame: Frame, sensors: Sequence[MountedSensor], random: np.random.Generator) -> Frame:  # noqa: ARG002  # for overriding methods
        """Return the disturbed frame."""
        return frame

    def disturbed_detector(self, detector: Detector) -> Detector:
        """Return the disturbed detector."""
        return detector


@dataclass(frozen=True)
class RangeNoise(Disturbance):
    """Additional range noise: normally distributed errors of this standard deviation on top of the sensor's own."""

    name: ClassVar[str] = "more range noise"
    unit: ClassVar[str] = "m"

    def disturbed_sensors(self, sensors: Sequence[MountedSensor]) -> tuple[MountedSensor, ...]:
        """Return the sensors with both errors: independent, so their variances add."""

        def noisier(model: LidarModel) -> LidarModel:
            return replace(model, range_noise_std=math.hypot(model.range_noise_std, self.size))

        return _with_models(sensors, noisier)


@dataclass(frozen=True)
class DropOff(Disturbance):
    """Loss of a share of all returns, independent of surface and range."""

    name: ClassVar[str] = "returns lost"
    unit: ClassVar[str] = "of the returns"

    def disturbed_sensors(self, sensors: Sequence[MountedSensor]) -> tuple[MountedSensor, ...]:
        """Return the sensors with a larger general drop-off."""

        def lossy(model: LidarModel) -> LidarModel:
            return replace(model, law=losing(model.law, self.size))

        return _with_models(sensors, lossy)


@dataclass(frozen=True)
class Rain(Disturbance):
    r"""Rain or fog with an extinction coefficient α, in 1/km.

    Light is lost on the way there and back (Beer and Lambert): the LiDAR
    equation, :math:`P \propto e^{-2αr} / r^2`, as for example in C. Goodin, D.
    Carruth, M. Doude, C. Hudson: Predicting the influence of rain on LIDAR in
    ADAS. Electronics 8 (2019), 89. So returns are darker, and the maximum range
    is reduced to the range at which returns are as strong as at the sensor's
    maximum range in clear air.

    A share :math:`1 - e^{-α · 10 m}` of the rays return from a drop near the
    sensor instead of the surface behind it. This assumes that all light
    scattered by drops there causes returns, which is the worst case.

    Rain of R mm/h has α = 0.248 R^0.67 per km (1.076 R^0.67 dB/km, Carbonneau
    and Wisely 1998, in ITU-R P.1814): 2.1 at 25 mm/h, 5.4 at 100 mm/h. Larger
    values are fog, with a visibility of 3/α (WMO: meteorological optical range).
    """

    name: ClassVar[str] = "rain or fog"
    unit: ClassVar[str] = "extinction per km"

    def disturbed_sensors(self, sensors: Sequence[MountedSensor]) -> tuple[MountedSensor, ...]:
        """Return the sensors with the extinction of the air."""

        def dimmed(model: LidarModel) -> LidarModel:
            lost = 2 * self.size / 1000.0
            return replace(model.in_air(self.size / 1000.0), max_range=range_in(model.max_range, lost))

        return _with_models(sensors, dimmed)

    def disturbed_frame(self, frame: Frame, sensors: Sequence[MountedSensor], random: np.random.Generator) -> Frame:
        """Return the frame with the returns of some rays replaced by those of drops."""
        wet = random.random(len(frame)) < -math.expm1(-self.size / 1000.0 * DROP_RANGE)
        near = random.random(len(frame))
        places = np.array([sensor.xyz for sensor in sensors])[frame.sensor]
        way = frame.points - places
        distance = np.linalg.norm(way, axis=1)
        drop = places + way * (near * np.minimum(DROP_RANGE, distance) / np.maximum(distance, 1e-9))[:, None]
        return recounted(
            replace(
                frame,
                points=np.where(wet[:, None], drop, frame.points).astype(np.float32),
                intensity=np.where(wet, np.float32(DROP_INTENSITY), frame.intensity),
                instance=np.where(wet, np.int32(STATIC_INSTANCE), frame.instance),
            )
        )


def range_in(clear: float, lost: float) -> float:
    """Return the range in metres in air with a two-way extinction of ``lost`` per metre, from that in clear air.

    It solves exp(−lost · r) / r² = 1 / clear² by bisection: the left side falls with r.
    """
    low, high = 0.0, clear
    if lost == 0.0:
        return clear
    for _ in range(60):
        middle = (low + high) / 2
        if math.exp(-lost * middle) * clear**2 > middle**2:
            low = middle
        else:
            high = middle
    return high


@dataclass(frozen=True)
class OfOneSensor(Disturbance):
    """A disturbance of one sensor.

    Parameters
    ----------
    sensor : int
        Number of the sensor in the placement, from 0.
    """

    sensor: int = 0


@dataclass(frozen=True)
class PositionError(OfOneSensor):
    """Error of a sensor's assumed position: its points are shifted along `ERROR_AXIS`."""

    name: ClassVar[str] = "sensor misplaced"
    unit: ClassVar[str] = "m"

    def disturbed_frame(self, frame: Frame, sensors: Sequence[MountedSensor], random: np.random.Generator) -> Frame:  # noqa: ARG002  # nothing random
        """Return the frame with this sensor's points moved."""
        return _moved(frame, self.sensor, sensors[self.sensor].xyz, np.eye(3), self.size * ERROR_AXIS)


@dataclass(frozen=True)
class YawError(OfOneSensor):
    """Error of a sensor's assumed yaw, in degrees."""

    name: ClassVar[str] = "yaw wrong"
    unit: ClassVar[str] = "°"

    def disturbed_frame(self, frame: Frame, sensors: Sequence[MountedSensor], random: np.random.Generator) -> Frame:  # noqa: ARG002  # nothing random
        """Return the frame with this sensor's points rotated about its position."""
        return _rotated(frame, self, sensors, np.array([0.0, 0.0, 1.0]))


@dataclass(frozen=True)
class TiltError(OfOneSensor):
    """Error of a sensor's assumed tilt, in degrees about `ERROR_AXIS`."""

    name: ClassVar[str] = "tilt wrong"
    unit: ClassVar[str] = "°"

    def disturbed_frame(self, frame: Frame, sensors: Sequence[MountedSensor], random: np.random.Generator) -> Frame:  # noqa: ARG002  # nothing random
        """Return the frame with this sensor's points rotated about its position."""
        return _rotated(frame, self, sensors, ERROR_AXIS)


@dataclass(frozen=True)
class ClockOffset(OfOneSensor):
    """Late clock of a sensor: its points were measured `size` seconds earlier."""

    name: ClassVar[str] = "clock late"
    unit: ClassVar[str] = "s"

    def disturbed_scan(self, simulation: Simulation, number: int, time: float) -> Frame:
        """Return the frame with this sensor's points from an earlier one."""
        now, before = simulation.frame(number, time), simulation.frame(number, time - self.size)
        return _merged(now, now.sensor != self.sensor, before, before.sensor == self.sensor)


@dataclass(frozen=True)
class SensorFailure(OfOneSensor):
    """Failure of a sensor. Its number, from 1, is the size, so that the failures of all sensors make a series."""

    name: ClassVar[str] = "sensor lost"
    unit: ClassVar[str] = "number of the sensor"

    @classmethod
    def each(cls, sensor: int) -> SensorFailure:
        """Return the failure of the sensor with this number, from 0."""
        return cls(sensor + 1.0, sensor)

    def disturbed_frame(self, frame: Frame, sensors: Sequence[MountedSensor], random: np.random.Generator) -> Frame:  # noqa: ARG002  # nothing random
        """Return the frame without this sensor's points."""
        return recounted(some_points(frame, frame.sensor != self.sensor))


@dataclass(frozen=True)
class Thinned(Disturbance):
    """Traffic without a share of the road users."""

    seed: int = 0
    name: ClassVar[str] = "thinner traffic"
    unit: ClassVar[str] = "of the road users missing"

    def disturbed_traffic(self, trajectories: Trajectories) -> Trajectories:
        """Return the motion of the remaining road users."""
        stays = np.random.default_rng(self.seed).random(len(trajectories)) >= self.size
        return some_users(trajectories, stays)


@dataclass(frozen=True)
class OtherSizes(Disturbance):
    """Changed dimensions of all road users, each by a random relative change up to this size."""

    seed: int = 0
    name: ClassVar[str] = "other sizes"
    unit: ClassVar[str] = "of each dimension at most"

    def disturbed_traffic(self, trajectories: Trajectories) -> Trajectories:
        """Return the same motion with changed sizes of the road users."""
        return finish(resized(trajectories, self.size, self.seed))


@dataclass(frozen=True)
class CappedPillars(Disturbance):
    """Pillars with fewer points than in training; the size is the largest number of points, 0 for no change."""

    name: ClassVar[str] = "fuller pillars cut"
    unit: ClassVar[str] = "points that a pillar keeps"

    def disturbed_detector(self, detector: Detector) -> Detector:
        """Return the detector with the smaller limit of points in a pillar."""
        return keeping_at_most(detector, round(self.size)) if self.size else detector


def _with_models(
    sensors: Sequence[MountedSensor], change: Callable[[LidarModel], LidarModel]
) -> tuple[MountedSensor, ...]:
    return tuple(replace(sensor, model=change(sensor.model)) for sensor in sensors)


def losing(law: DetectionLaw, share: float) -> DetectionLaw:
    """Return a law of detection with a share, below 1, of the detected returns lost."""
    if isinstance(law, CarlaDropoff):
        return replace(law, general=law.general + (1.0 - law.general) * share)
    return replace(law, ceiling=law.ceiling * (1.0 - share))


def _rotated(frame: Frame, wrong: OfOneSensor, sensors: Sequence[MountedSensor], axis: Float) -> Frame:
    return _moved(
        frame, wrong.sensor, sensors[wrong.sensor].xyz, _rotation(axis, math.radians(wrong.size)), np.zeros(3)
    )


def _rotation(axis: Float, angle: float) -> Float:
    """Return the matrix of a rotation about a unit vector (Rodrigues' formula)."""
    x, y, z = axis
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turn: Float = np.eye(3) + math.sin(angle) * across + (1 - math.cos(angle)) * across @ across
    return turn


def _moved(frame: Frame, sensor: int, about: Float, turn: Float, by: Float) -> Frame:
    """Return the frame with one sensor's points rotated about a position and moved."""
    own = frame.sensor == sensor
    points = frame.points.copy()
    points[own] = ((points[own] - about) @ turn.T + about + by).astype(np.float32)
    return replace(frame, points=points)


def _merged(one: Frame, of_one: Boolean, other: Frame, of_other: Boolean) -> Frame:
    """Return selected points of two frames, ordered by sensor, with the road users of the first."""
    kept = [some_points(one, of_one), some_points(other, of_other)]
    sensor = np.concatenate([part.sensor for part in kept])
    order = np.argsort(sensor, kind="stable")
    points = {name: np.concatenate([getattr(part, name) for part in kept])[order] for name in POINT_FIELDS}
    return recounted(replace(one, **points))


def keeping_at_most(detector: Detector, points: int) -> Detector:
    """Return the detector with another limit on the points in a pillar."""
    settings = replace(detector.settings, most_points=points)
    other = Detector(settings, training_record=detector.training_record)
    other.load_state_dict(detector.state_dict())
    return other.to(detector.device).eval()
