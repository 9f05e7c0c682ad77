"""Training frames as recordings of real sensors give them: inexact background, ground, poses and intensities.

Simulated frames have the true background and the true height of the road. In a recording both are estimated, sensors
are calibrated to decimetres, rows of beams fail, and intensities may be unknown. Each function changes one of these in
a frame, by a generator of random numbers and nothing else. Sensor types and groups of pedestrians are drawn before the
scans are simulated (`site_training.command`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from headless.detection.detection_area import DetectionArea
from headless.detection.frames import Recording
from headless.detection.shared_scans import POINT_FIELDS, some_points

import numpy as np
from numpy.typing import NDArray

from seip_addon.core.base.arrays import Boolean, Float
from seip_addon.core.geometry.orientation import rotated
from seip_addon.core.sensing.recordings.background import MARGIN, MARGIN_SHARE
from seip_addon.core.sensing.recordings.recorded_frames import UNKNOWN_INTENSITY
from seip_addon.core.sensing.recordings.registration import rotation_of
from seip_addon.core.sensing.scans.frame import STATIC_INSTANCE, Frame
from seip_addon.core.sensing.scans.sensor import MountedSensor

SHARE = 0.5
"""Share of the frames that are changed; detectors are also used on simulated scans."""

POSITION_ERROR, ANGLE_ERROR = 0.1, math.radians(0.3)
"""Largest calibration error of a sensor: metres, radians."""

GROUND_ERROR = 0.15
"""Largest error of the estimated height of the ground, metres."""

_PATCHES, _PATCH_RADIUS = 6, (0.3, 1.5)  # of background left in at most; metres
_SPECKLE = 0.003  # share of the background points left in one by one at most
_SPREAD = 0.15  # metres: largest standard deviation of the range of a ray, which widens the margin of the background
_HIDDEN, _HIDDEN_RADIUS = 2, (0.5, 1.5)  # places where standing traffic became background at most; metres
_ROW = math.radians(0.2)  # elevations that count as one row of beams
_LOST_ROWS = 0.3  # largest share of the rows that a sensor loses
_SPURIOUS = 60  # points in the air at most
_SPURIOUS_INTENSITY = 0.05
_WAVELENGTH = (10.0, 40.0)  # metres, of the errors of the ground
_UNKNOWN, _SCALED, _SCALE = 0.25, 0.5, math.log(1.5)  # shares of the frames, and largest logarithm of the factor


def field_recording(
    recording: Recording, area: DetectionArea, sensors: Sequence[MountedSensor], seed: Sequence[int]
) -> Recording:
    """Return a recording of which a random share of the frames (`SHARE`) is as in a field recording.

    Parameters
    ----------
    seed : sequence of int
        Seed of the recording; each frame has its own stream.
    """

    def frame(number: int) -> Frame:
        random = np.random.default_rng([*seed, number])
        simulated = recording.load(number)
        return field_frame(simulated, area, sensors, random) if random.random() < SHARE else simulated

    return replace(recording, load=frame)


def field_frame(
    frame: Frame, area: DetectionArea, sensors: Sequence[MountedSensor], random: np.random.Generator
) -> Frame:
    """Return a frame as in a field recording: each of the changes below, of random size."""
    frame = with_lost_rows(frame, sensors, random)
    frame = with_spurious_points(frame, sensors, random)
    frame = with_inexact_background(frame, area, sensors, random)
    frame = with_hidden_parts(frame, random)
    frame = with_uncertain_intensity(frame, random)
    frame = with_calibration_errors(frame, sensors, random)
    return recounted(with_inexact_ground(frame, random))


def with_lost_rows(frame: Frame, sensors: Sequence[MountedSensor], random: np.random.Generator) -> Frame:
    """Return the frame without up to 30 % of the rows of each sensor, half of which lose none."""
    kept = np.ones(len(frame), dtype=np.bool_)
    rows = round(math.pi / _ROW) + 1
    for number, sensor in enumerate(sensors):
        share = random.uniform(0.0, _LOST_ROWS) if random.random() < 0.5 else 0.0
        lost = random.random(rows) < share
        own = np.flatnonzero(frame.sensor == number)
        way = rotated(frame.points[own] - sensor.xyz, sensor.orientation.T)
        elevation = np.arctan2(way[:, 2], np.hypot(way[:, 0], way[:, 1]))
        kept[own] = ~lost[np.round((elevation + math.pi / 2) / _ROW).astype(np.int64)]
    return some_points(frame, kept)


def with_spurious_points(frame: Frame, sensors: Sequence[MountedSensor], random: np.random.Generator) -> Frame:
    """Return the frame with up to 60 foreground points more, each somewhere on the way of a ray to its return."""
    if not len(frame):
        return frame
    chosen = random.integers(len(frame), size=int(random.integers(_SPURIOUS + 1)))
    places = np.array([sensor.xyz for sensor in sensors])[frame.sensor[chosen]]
    added = {name: getattr(frame, name)[chosen] for name in POINT_FIELDS}
    share = random.uniform(0.1, 0.95, len(chosen))[:, None]
    added["points"] = (places + share * (frame.points[chosen] - places)).astype(np.float32)
    added["intensity"] = np.full(len(chosen), _SPURIOUS_INTENSITY, dtype=np.float32)
    added["instance"] = np.full(len(chosen), STATIC_INSTANCE, dtype=np.int32)
    added["foreground"] = np.ones(len(chosen), dtype=np.bool_)
    return replace(frame, **{name: np.concatenate([getattr(frame, name), added[name]]) for name in POINT_FIELDS})


def with_inexact_background(
    frame: Frame, area: DetectionArea, sensors: Sequence[MountedSensor], random: np.random.Generator
) -> Frame:
    """Return the frame with background left in, in patches and points, and without road users close to the ground.

    A point at a height h above level ground is nearer than the background by h / sin(e) at an elevation of −e. It is
    lost where this is less than the margin of an estimated background.
    """
    static = ~frame.foreground
    foreground = frame.foreground | (static & (random.random(len(frame)) < random.uniform(0.0, _SPECKLE)))
    holds = np.flatnonzero(static & area.grid.holds(frame.points - _lift(frame, area)))
    for _ in range(int(random.integers(_PATCHES + 1)) if len(holds) else 0):
        centre = _place_of(frame.points[holds, :2], random)
        radius = random.uniform(*_PATCH_RADIUS)
        foreground[holds] |= _within(frame.points[holds], centre, radius)
    way = frame.points - np.array([sensor.xyz for sensor in sensors])[frame.sensor]
    distance = np.linalg.norm(way, axis=1)
    height = frame.points[:, 2] - area.road.at(frame.points[:, :2].astype(np.float64))
    nearer = height * distance / np.maximum(-way[:, 2], 1e-3)
    margin = MARGIN + MARGIN_SHARE * distance + 2 * random.uniform(0.0, _SPREAD)
    lost = frame.foreground & (way[:, 2] < 0) & (nearer < margin)
    return some_points(replace(frame, foreground=foreground), ~lost)


def with_hidden_parts(frame: Frame, random: np.random.Generator) -> Frame:
    """Return the frame without the points at up to two places, each at a road user that stood there for long."""
    kept = np.ones(len(frame), dtype=np.bool_)
    for _ in range(int(random.integers(_HIDDEN + 1)) if len(frame.labels) else 0):
        user = int(random.integers(len(frame.labels)))
        own = frame.points[frame.instance == frame.labels.user[user]]
        if len(own):
            centre = own[int(random.integers(len(own))), :2]
            kept &= ~(frame.foreground & _within(frame.points, centre, random.uniform(*_HIDDEN_RADIUS)))
    return some_points(frame, kept)


def with_uncertain_intensity(frame: Frame, random: np.random.Generator) -> Frame:
    """Return the frame with one intensity for all points (a quarter), in another unit (half), or unchanged."""
    drawn, scale = random.random(), math.exp(random.uniform(-_SCALE, _SCALE))
    if drawn < _UNKNOWN:
        return replace(frame, intensity=np.full(len(frame), UNKNOWN_INTENSITY, dtype=np.float32))
    if drawn < _UNKNOWN + _SCALED:
        return replace(frame, intensity=np.clip(frame.intensity * np.float32(scale), 0.0, 1.0))
    return frame


def with_calibration_errors(frame: Frame, sensors: Sequence[MountedSensor], random: np.random.Generator) -> Frame:
    """Return the frame with the points of each sensor moved by up to 0.1 m, and turned about it by up to 0.3°.

    A single sensor has no error: its axes are those of the boxes.
    """
    if len(sensors) < 2:
        return frame
    points = frame.points.copy()
    for number, sensor in enumerate(sensors):
        shift, turn = (_random_vector(most, random) for most in (POSITION_ERROR, ANGLE_ERROR))
        own = frame.sensor == number
        points[own] = rotated(points[own] - sensor.xyz, rotation_of(turn)) + (sensor.xyz + shift)
    return replace(frame, points=points)


def with_inexact_ground(frame: Frame, random: np.random.Generator) -> Frame:
    """Return the frame with points and boxes raised or lowered by up to 0.15 m, as by an inexact ground.

    The error is a sum of three waves in random directions.
    """
    amplitudes = random.uniform(0.0, GROUND_ERROR / 3, 3)
    angles, phases = random.uniform(0.0, math.tau, (2, 3))
    waves = np.stack([np.cos(angles), np.sin(angles)]) * math.tau / random.uniform(*_WAVELENGTH, 3)

    def error(xy: Float) -> Float:
        heights: Float = np.sin(xy @ waves + phases) @ amplitudes
        return heights

    points, centre = frame.points.copy(), frame.labels.centre.copy()
    points[:, 2] += error(points[:, :2].astype(np.float64)).astype(np.float32)
    centre[:, 2] += error(centre[:, :2])
    return replace(frame, points=points, labels=replace(frame.labels, centre=centre))


def recounted(frame: Frame) -> Frame:
    """Return the frame with updated numbers of returns in its labels."""
    labels = frame.labels
    most = max(int(labels.user.max(initial=0)), int(frame.instance.max(initial=0))) + 1
    on_users = frame.instance != STATIC_INSTANCE
    sensors = labels.points.shape[1]
    cell = frame.instance[on_users].astype(np.int64) * sensors + frame.sensor[on_users]
    counts = np.bincount(cell, minlength=most * sensors).reshape(most, sensors)
    return replace(frame, labels=replace(labels, points=counts[labels.user]))


def _lift(frame: Frame, area: DetectionArea) -> Float:
    """Return the height of the road under each point as a shift (n, 3)."""
    height = area.road.at(frame.points[:, :2].astype(np.float64))
    return np.column_stack([np.zeros((len(height), 2)), height])


def _place_of(xy: NDArray[np.float32], random: np.random.Generator) -> Float:
    """Return the middle of a random square metre that has points: far ones are as likely as near ones."""
    squares = np.unique(np.floor(xy).astype(np.int64) @ np.array([1 << 20, 1]))
    number = int(squares[int(random.integers(len(squares)))])
    y = (number + (1 << 19)) % (1 << 20) - (1 << 19)
    return np.array([(number - y) >> 20, y]) + 0.5


def _within(points: NDArray[np.float32], centre: Float | NDArray[np.float32], radius: float) -> Boolean:
    inside: Boolean = ((points[:, :2] - centre) ** 2).sum(axis=1) < radius**2
    return inside


def _random_vector(most: float, random: np.random.Generator) -> Float:
    """Return a vector (3,) in a random direction, with a length of up to ``most``."""
    direction = random.standard_normal(3)
    vector: Float = direction * (random.uniform(0.0, most) / np.linalg.norm(direction))
    return vector
