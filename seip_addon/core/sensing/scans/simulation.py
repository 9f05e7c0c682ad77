"""Frames of scans: all sensors of a scene at the same instants of its traffic.

`tests/core/sensing/scans/test_scans.py` shows its use.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Float, Integer
from ...base.errors import SeipError
from ...base.limits import FRAMES
from ...base.progress import Progress
from ...base.settings import setting
from ...geometry.orientation import rotations
from ..lidar.noisy_returns import measured_returns
from ..traffic.bodies import Body
from ..traffic.trajectories import Snapshot, Trajectories
from ..visibility.ray_casting import make_ray_caster
from ..visibility.settings import Engine
from .frame import STATIC_INSTANCE, Frame, Labels
from .motion import Motion, moving, still
from .scanner import BodySurface, ReflectiveSurface, Scan, Scanner, hulls_of, returns_by_user
from .sensor import MountedSensor
from .static_scene import StaticScene

FOREGROUND_SIGMAS, FOREGROUND_MARGIN = 3.0, 0.05
"""Standard deviations of the range noise, and metres, by which foreground must be nearer than the background."""
_TIME_TOLERANCE = 1e-6
"""Seconds, and shares of a frame: tolerance for times that are decimal fractions."""


@dataclass(frozen=True)
class ScanSettings:
    """Settings of simulated scans.

    Parameters
    ----------
    seed : int
        Seed of noise and lost returns, 0 or more.
    noise : bool
        Whether ranges are noisy and returns get lost, according to the sensors' models.
    rolling_shutter : bool
        Whether the traffic moves during a revolution: each azimuth is scanned at its own time (`Scanner.delay`). Each
        road user's box is then at the mean time of its returns of all sensors, or halfway through the frame if it has
        none. Otherwise a revolution takes no time.
    engine : {"auto", "bvh", "embree"}
        Ray-casting engine.
    weather : tuple of str
        Description of the weather, for the record.
    """

    seed: int = setting(0, "seed of noise and lost returns", minimum=0)
    noise: bool = True
    rolling_shutter: bool = setting(default=False, help="traffic moves while a sensor turns")
    engine: Engine = "auto"
    weather: tuple[str, ...] = ()


class Simulation:
    """The sensors of a scene and its traffic, ready for scans at any time.

    Parameters
    ----------
    shapes : sequence of BodySurface
        Shape of each road user.
    """

    def __init__(
        self,
        static: StaticScene,
        scanners: Sequence[Scanner],
        trajectories: Trajectories,
        shapes: Sequence[BodySurface],
        settings: ScanSettings,
    ) -> None:
        self.scanners = scanners
        self._threads = scanners[0].threads
        self._static, self._trajectories, self._shapes, self._settings = static, trajectories, shapes, settings
        self._revolution = max(1.0 / scanner.sensor.model.rotation_rate for scanner in scanners)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about the scans."""
        blind = tuple(
            f"{scanner.sensor.label} sees nothing of the scene: none of its rays hits anything within its range; "
            "check its position and orientation"
            for scanner in self.scanners
            if scanner.sees_nothing
        )
        return self._static.warnings + blind

    def frame(self, number: int, time: float) -> Frame:
        """Return the measurements of all sensors in the revolution that begins at a time.

        Parameters
        ----------
        number : int
            Number of the frame. Noise and losses depend only on it, the seed, the traffic and the sensor's number.
        time : float, seconds
            Beginning of the revolution.
        """
        snapshot = self._trajectories.at(time)
        return self.measure(number, snapshot, self.scans(snapshot))

    def measure(self, number: int, snapshot: Snapshot, scans: Sequence[Scan]) -> Frame:
        """Return the frame of scans at an instant, with noise, lost returns and labels."""
        parts = [
            _returns(scanner, scan, sensor, self._random(sensor, number), rolling=self._settings.rolling_shutter)
            for sensor, (scanner, scan) in enumerate(zip(self.scanners, scans, strict=True))
        ]
        merged = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
        returns = np.stack([returns_by_user(part["instance"], len(self._trajectories)) for part in parts], axis=1)
        if self._settings.rolling_shutter:
            snapshot = self._when_seen(snapshot, merged["instance"], merged["delay"])
        return Frame(time=snapshot.time, labels=self._labels(snapshot, scans, returns), **merged)

    def scans(self, snapshot: Snapshot) -> list[Scan]:
        """Return the scan of each sensor, without noise and lost returns."""
        motions = self._motions(snapshot)
        shapes = [self._shapes[motion.user] for motion in motions]
        hulls, users = hulls_of(motions, shapes), len(self._trajectories)
        with ThreadPoolExecutor(min(len(self.scanners), self._threads)) as pool:
            return list(pool.map(lambda scanner: scanner.scan(motions, shapes, hulls, users), self.scanners))

    def _motions(self, snapshot: Snapshot) -> list[Motion]:
        rolling = self._settings.rolling_shutter
        return moving(self._trajectories, snapshot, self._revolution) if rolling else still(snapshot)

    def _when_seen(self, snapshot: Snapshot, instance: NDArray[np.int32], delay: NDArray[np.float32]) -> Snapshot:
        """Return each road user at the mean time of its returns, or halfway through the frame if it has none.

        Parameters
        ----------
        instance, delay : (n,) array
            Road user and time of the points of all sensors, as in `Frame`.
        """
        # Points of a moving road user are sheared by its motion during the revolution. A box at the beginning of the
        # frame would be ahead of or behind them; at their mean time it is centred on them.
        of_traffic = instance != STATIC_INSTANCE
        most = len(self._trajectories)
        count = np.bincount(instance[of_traffic], minlength=most)
        total = np.bincount(instance[of_traffic], weights=delay[of_traffic], minlength=most)
        mean = np.where(count > 0, total / np.maximum(count, 1), self._revolution / 2)
        poses = [motion.pose(float(mean[motion.user])) for motion in self._motions(snapshot)]
        if not poses:
            return snapshot
        position, yaw, pitch = (np.array(part) for part in zip(*poses, strict=True))
        return replace(snapshot, position=position, yaw=yaw, pitch=pitch)

    def _random(self, sensor: int, frame: int) -> np.random.Generator | None:
        if not self._settings.noise:
            return None
        # It includes the digest of the traffic: otherwise static surfaces would have the same noise in frames of two
        # runs.
        entropy = [self._settings.seed, int(self._trajectories.key, 16)]
        seed = np.random.SeedSequence(entropy, spawn_key=(sensor, frame))
        return np.random.Generator(np.random.SFC64(seed))

    def _labels(self, snapshot: Snapshot, scans: Sequence[Scan], returns: Integer) -> Labels:
        """Return the labels of the present road users, given the returns (u, s) of all by sensor."""
        users = [self._trajectories.users[number] for number in snapshot.user]
        size = np.array([(user.length, user.width, user.height) for user in users]).reshape(-1, 3)
        up = rotations(snapshot.yaw, snapshot.pitch)[:, :, 2]
        centre = snapshot.position + up * size[:, 2:] / 2
        unoccluded = np.sum([scan.unoccluded for scan in scans], axis=0)
        visible = np.sum([scan.visible for scan in scans], axis=0)
        return Labels(
            user=snapshot.user,
            category=np.array([user.category for user in users], dtype=np.str_),
            centre=centre,
            size=size,
            yaw=(snapshot.yaw + math.pi) % (2 * math.pi) - math.pi,
            pitch=snapshot.pitch,
            speed=snapshot.speed,
            points=returns[snapshot.user],
            visibility=(visible / np.maximum(unoccluded, 1))[snapshot.user],
            inside=self._static.inside(centre),
        )


def prepare(
    static: StaticScene,
    sensors: Sequence[MountedSensor],
    trajectories: Trajectories,
    bodies: Sequence[Body],
    settings: ScanSettings,
) -> Generator[Progress, None, Simulation]:
    """Cast all rays against the static scene, once for all frames.

    Parameters
    ----------
    trajectories : Trajectories
        Trajectories in the scene's local axes.
    bodies : sequence of Body
        Body of each road user. Bodies with the same array of triangles share a ray caster.

    Yields
    ------
    Progress
        Number of sensors done.

    Raises
    ------
    SeipError
        There is no sensor, or the seed is negative.
    """
    if not sensors:
        raise SeipError("there is no sensor to scan with: place some first")
    if settings.seed < 0:
        raise SeipError(f"the seed must be a whole number of at least 0, not {settings.seed}")
    shapes = body_surfaces(bodies, settings.engine)
    ground = ReflectiveSurface(make_ray_caster(static.triangles, settings.engine), static.reflectivity)
    scanners = []
    for number, sensor in enumerate(sensors):
        yield Progress(number, len(sensors), "scanning the static scene")
        scanners.append(Scanner(sensor, ground))
    yield Progress(len(sensors), len(sensors), "scanning the static scene")
    return Simulation(static, scanners, trajectories, shapes, settings)


def body_surfaces(bodies: Sequence[Body], engine: Engine) -> list[BodySurface]:
    """Return the surfaces of road users' bodies; those who share an array of triangles share its tree."""
    distinct = {id(body.triangles): body.triangles for body in bodies}
    trees = {key: make_ray_caster(triangles, engine) for key, triangles in distinct.items()}
    return [BodySurface(trees[id(body.triangles)], body.reflectivity) for body in bodies]


def frame_times(
    trajectories: Trajectories,
    sensors: Sequence[MountedSensor],
    *,
    start: float | None = None,
    duration: float | None = None,
    rate: float | None = None,
) -> Float:
    """Return the times (n,) of frames in seconds.

    Parameters
    ----------
    start : float, seconds, optional
        Time of the first frame; by default that of the first sample.
    duration : float, seconds, optional
        Time from the first to the last frame; by default up to the last sample.
    rate : float, hertz, optional
        Rate of frames, no higher than that of the slowest sensor, which is the default.

    Raises
    ------
    SeipError
        The times are outside the trajectories, or the rate is higher than that of a sensor.
    """
    begin, end = trajectories.span
    slowest = min(sensors, key=lambda sensor: sensor.model.rotation_rate)
    fastest = slowest.model.rotation_rate
    rate = fastest if rate is None else rate
    if not 0 < rate <= fastest * (1 + 1e-9):
        raise SeipError(
            f"{slowest.label} rotates {fastest:g} times a second: choose a rate above 0 and up to {fastest:g} Hz"
        )
    start = begin if start is None else start
    duration = end - start if duration is None else duration
    if not (begin <= start <= end and 0 <= duration <= end - start + _TIME_TOLERANCE):
        raise SeipError(f"the traffic lasts from {begin:g} s to {end:g} s: choose start and duration within that")
    count = math.floor(duration * rate + _TIME_TOLERANCE) + 1
    if not FRAMES.allow(count):
        raise SeipError(
            f"{duration:g} s at {rate:g} Hz are {count:,} frames, but a run must have {FRAMES}: choose a shorter "
            "duration or a lower rate"
        )
    return start + np.arange(count) / rate


def _returns(
    scanner: Scanner, scan: Scan, number: int, random: np.random.Generator | None, *, rolling: bool
) -> dict[str, NDArray[Any]]:
    """Return the arrays of a `Frame` for one sensor's scan, with noise and lost returns if a generator is given."""
    sensor = scanner.sensor
    if random is None:
        ray = np.flatnonzero(scanner.in_range(scan.distance))
        measured = scan.distance[ray]
    else:
        ray, measured = measured_returns(sensor.model, scan.distance, scan.chance, random)
    noise = sensor.model.range_noise(measured) if random is not None else 0.0
    points = scanner.coarse_directions.take(ray, axis=0)
    points *= measured.astype(np.float32)[:, None]
    points += sensor.xyz.astype(np.float32)
    delay = scanner.delay[ray] if rolling else np.zeros(len(ray))
    return {
        "points": points,
        "sensor": np.full(len(ray), number, dtype=np.int16),
        "delay": delay.astype(np.float32),
        "intensity": scan.intensity[ray].astype(np.float32),
        "instance": scan.instance[ray],
        "foreground": measured + FOREGROUND_SIGMAS * noise + FOREGROUND_MARGIN < scan.empty[ray],
    }
