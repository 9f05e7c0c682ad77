"""Frames of a recording: sweeps of all sensors in site axes, with foreground and intensity as in simulated scans."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from ...base.arrays import Boolean, Float
from ...base.errors import SeipError
from ...base.progress import Progress
from ...geometry.height_raster import HeightRaster
from ...geometry.orientation import rotated
from ..lidar.model import LidarModel
from ..scans.frame import STATIC_INSTANCE, Frame, Labels
from ..scans.scanner import ReflectiveSurface
from ..scans.sensor import MountedSensor
from .background import Background, learn_background
from .box_labels import BoxLabels
from .comparison import MOST_VEHICLE_HEIGHT, NEARER, RayComparison, compare_rays
from .ground import estimated_ground, pose_above_ground
from .recording import Recording, SensorRecording, paired
from .registration import register
from .sweep_files import Sweep

ROAD_REFLECTIVITY = 0.17
"""Reflectivity of the road near the sensor, by which intensities are scaled: that of dry asphalt."""

UNKNOWN_INTENSITY = 0.2
"""Intensity of all points of a recording without intensities: about the median of road users in training."""

_NEAR, _FAR = 5.0, 25.0  # metres: range of the ground points that scale intensities
_GROUND_MARGIN = 0.1  # metres from the ground
_LEAST_GROUND = 100  # points
_INTENSITY_SWEEPS = 5


@dataclass(frozen=True, eq=False)
class PosedRecording:
    """Recording of one sensor with its pose and its background.

    Parameters
    ----------
    mounted : MountedSensor
        Model and pose in site axes.
    record : SensorRecording
        Its sweeps.
    background : Background
        Its static surroundings.
    intensity_scale : float, optional
        Factor from recorded intensities to those of simulated scans; None without intensities.
    """

    mounted: MountedSensor
    record: SensorRecording
    background: Background
    intensity_scale: float | None

    def returns(self, sweep: Sweep, ground: HeightRaster) -> tuple[NDArray[np.float32], NDArray[np.float32], Boolean]:
        """Return points in site axes (n, 3), intensities (n,) and the foreground mask (n,) of a sweep."""
        xyz = rotated(sweep.points.astype(np.float64), self.mounted.orientation) + self.mounted.xyz
        if sweep.intensity is None or self.intensity_scale is None:
            intensity = np.full(len(xyz), UNKNOWN_INTENSITY, dtype=np.float32)
        else:
            intensity = np.clip(sweep.intensity * np.float32(self.intensity_scale), 0.0, 1.0)
        foreground = self.background.foreground(sweep.points, xyz[:, 2] - ground.at(xyz[:, :2]))
        return xyz.astype(np.float32), intensity, foreground


@dataclass(frozen=True, eq=False)
class RecordedScene:
    """Scene of a recording.

    Parameters
    ----------
    surface : ReflectiveSurface
        Static surfaces in site axes.
    road : callable
        From positions (n, 2) to the height of the road (n,); NaN beside it.
    region : shapely geometry, metres
        Region of interest in plan.
    """

    surface: ReflectiveSurface
    road: Callable[[Float], Float]
    region: BaseGeometry


@dataclass(frozen=True, eq=False)
class RecordedFrames:
    """A recording that is ready for detection.

    Parameters
    ----------
    sensors : tuple of PosedRecording
    sweeps : tuple of tuple of int or None
        Numbers of the sweeps of each frame, by sensor; None if a sensor has none at that time.
    ground : HeightRaster
        Height of the ground in site axes: of the road of a scene, or estimated from the background of all sensors.
    region : shapely geometry, metres
        Region of interest in plan.
    """

    sensors: tuple[PosedRecording, ...]
    sweeps: tuple[tuple[int | None, ...], ...]
    ground: HeightRaster
    region: BaseGeometry

    def __len__(self) -> int:
        return len(self.sweeps)

    def time(self, number: int) -> float:
        """Return the time of a frame in seconds: that of its first sensor."""
        pairs = zip(self.sensors, self.sweeps[number], strict=True)
        return min(float(sensor.record.times[sweep]) for sensor, sweep in pairs if sweep is not None)

    def frame(self, number: int, labels: BoxLabels | None = None) -> Frame:
        """Return a frame, read on access.

        Parameters
        ----------
        labels : BoxLabels, optional
            Road users in site axes. Points in a box are returns from it.
        """
        parts: list[dict[str, NDArray[Any]]] = []
        for index, (sensor, sweep) in enumerate(zip(self.sensors, self.sweeps[number], strict=True)):
            if sweep is None:
                continue
            points, intensity, foreground = sensor.returns(sensor.record.sweep(sweep), self.ground)
            sensors = np.full(len(points), index, dtype=np.int16)
            parts.append({"points": points, "intensity": intensity, "foreground": foreground, "sensor": sensors})
        merged = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
        count = len(merged["points"])
        boxes = labels or BoxLabels(np.zeros((0, 7)), np.zeros(0, dtype=np.str_))
        instance = _instances(merged["points"], boxes.boxes)
        return Frame(
            time=self.time(number),
            delay=np.zeros(count, dtype=np.float32),
            instance=instance,
            labels=_labels(boxes, instance, merged["sensor"], len(self.sensors), self.region),
            **merged,
        )


def prepare_frames(
    recording: Recording,
    models: Mapping[str, LidarModel],
    poses: Mapping[str, Float],
    *,
    radius: float,
    scene: RecordedScene | None = None,
) -> Generator[Progress, None, RecordedFrames]:
    """Learn background, ground and intensity scale of each sensor.

    Parameters
    ----------
    models : mapping of str to LidarModel
        Model of each sensor, by the name of its recording.
    poses : mapping of str to (4, 4) float64
        Pose of each sensor in site axes. It may be empty for one sensor: its axes are then levelled, with their origin
        on the ground below it.
    radius : float, metres
        Radius around each sensor of the region of interest, unless there is a scene.
    scene : RecordedScene, optional
        Scene that the poses are from. They are fitted to it, and vehicles that stood during the whole recording are
        found in front of its surfaces.

    Yields
    ------
    Progress
        Number of sweeps read.

    Raises
    ------
    SeipError
        The recording does not fit its models, or a pose is missing.
    """
    missing = [one.name for one in recording.sensors if one.name not in poses and _viewpoint(one) is None]
    if missing and len(recording.sensors) > 1:
        raise SeipError(f"the recording has several sensors, and {', '.join(missing)} has no pose: give --poses")
    sensors = []
    for record in recording.sensors:
        background = yield from learn_background(record, models[record.name])
        pose = poses.get(record.name, _viewpoint(record))
        if pose is None:
            pose = pose_above_ground(background.points(), record.name)
        mounted = MountedSensor(record.name, models[record.name], pose[:3, 3], pose[:3, :3])
        if scene is not None:
            mounted = register(scene.surface, mounted, background).sensor
            background = _without_standing(background, compare_rays(scene.surface, mounted, background), scene)
        sensors.append(PosedRecording(mounted, record, background, None))
    ground = estimated_ground(np.concatenate([static_points(sensor) for sensor in sensors]))
    around = shapely.MultiPoint([sensor.mounted.xyz[:2] for sensor in sensors]).buffer(radius)
    region = around if scene is None else scene.region
    scaled = [replace(sensor, intensity_scale=_intensity_scale(sensor, ground)) for sensor in sensors]
    return RecordedFrames(tuple(scaled), tuple(paired(recording)), ground, region)


def _without_standing(background: Background, one: RayComparison, scene: RecordedScene) -> Background:
    """Return a background in which the scene's surface takes the place of vehicles that stand on the road."""
    points = one.sensor.xyz + one.directions * np.where(one.result == NEARER, one.measured, 0.0)[:, None]
    standing = (one.result == NEARER) & (points[:, 2] < scene.road(points[:, :2]) + MOST_VEHICLE_HEIGHT)
    behind = np.where(np.isfinite(one.predicted), one.predicted, np.nan)
    return replace(background, usual=np.where(standing, behind, background.usual).astype(np.float32))


def static_points(sensor: PosedRecording) -> Float:
    """Return a sensor's background in site axes, (n, 3) metres."""
    return rotated(sensor.background.points(), sensor.mounted.orientation) + sensor.mounted.xyz


def _viewpoint(record: SensorRecording) -> Float | None:
    """Return the pose that the files of a sensor state."""
    return record.sweep(0).viewpoint if len(record) else None


def _intensity_scale(sensor: PosedRecording, ground: HeightRaster) -> float | None:
    """Return the factor that gives the road near the sensor its known reflectivity.

    Makers report intensity in units of their own, corrected for range or not. On the road both the reflectivity and the
    angle of incidence are known, so that the intensity of a simulated scan is: the median of its ratio to the recorded
    one is the unit.
    """
    ratios = []
    for number in np.linspace(0, len(sensor.record) - 1, _INTENSITY_SWEEPS).round().astype(int).tolist():
        sweep = sensor.record.sweep(number)
        if sweep.intensity is None:
            return None
        points, _, foreground = sensor.returns(sweep, ground)
        distance = np.linalg.norm(sweep.points, axis=1)
        height = np.abs(points[:, 2] - ground.at(points[:, :2].astype(np.float64)))
        road = ~foreground & (distance > _NEAR) & (distance < _FAR) & (height < _GROUND_MARGIN) & (sweep.intensity > 0)
        incidence = (sensor.mounted.xyz[2] - points[road, 2]) / distance[road]
        expected = sensor.mounted.model.law.intensity(distance[road], ROAD_REFLECTIVITY * incidence)
        ratios.append(expected / sweep.intensity[road])
    ratio = np.concatenate(ratios)
    return float(np.median(ratio)) if len(ratio) >= _LEAST_GROUND else None


def _instances(points: NDArray[np.float32], boxes: Float) -> NDArray[np.int32]:
    """Return the box that contains each point, or `STATIC_INSTANCE`."""
    instance = np.full(len(points), STATIC_INSTANCE, dtype=np.int32)
    for number, (x, y, z, length, width, height, yaw) in enumerate(boxes.tolist()):
        reach = np.hypot(length, width) / 2
        near = np.flatnonzero((np.abs(points[:, 0] - x) <= reach) & (np.abs(points[:, 1] - y) <= reach))
        offset = points[near].astype(np.float64) - (x, y, z)
        instance[near[within_box(offset, (length, width, height), yaw)]] = number
    return instance


def within_box(offset: Float, size: tuple[float, float, float], yaw: float) -> Boolean:
    """Return which points (n, 3), from the middle of an upright box of given length, width and height, lie in it."""
    ahead = np.cos(yaw) * offset[:, 0] + np.sin(yaw) * offset[:, 1]
    aside = np.cos(yaw) * offset[:, 1] - np.sin(yaw) * offset[:, 0]
    inside: Boolean = (np.abs(np.stack([ahead, aside, offset[:, 2]], axis=1)) <= np.array(size) / 2).all(axis=1)
    return inside


def _labels(
    labels: BoxLabels,
    instance: NDArray[np.int32],
    sensor: NDArray[np.int16],
    sensors: int,
    region: BaseGeometry,
) -> Labels:
    count = len(labels.boxes)
    points = np.zeros((count, sensors), dtype=np.int64)
    hit = instance != STATIC_INSTANCE
    np.add.at(points, (instance[hit], sensor[hit]), 1)
    return Labels(
        user=np.arange(count),
        category=labels.category,
        centre=labels.boxes[:, :3],
        size=labels.boxes[:, 3:6],
        yaw=labels.boxes[:, 6],
        pitch=np.zeros(count),
        speed=np.zeros(count),
        points=points,
        visibility=np.ones(count),
        inside=np.asarray(shapely.contains_xy(region, labels.boxes[:, 0], labels.boxes[:, 1]), dtype=bool),
    )
