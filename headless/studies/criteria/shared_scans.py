"""Detection with many placements that share poses: each pose scans a frame once, for all placements that have it."""

from collections.abc import Generator, Iterator, Sequence
from pathlib import Path

from headless.detection.detector import Detector
from headless.detection.frame_results import FrameResult, frame_result
from headless.detection.inference import detect
from headless.detection.recordings import MountedSensors, SampledRun, Simulator
from headless.detection.training import deterministic
from headless.studies.detection.sensor_configuration import SensorConfiguration
from headless.studies.frame_points import some_points
from headless.studies.simulated_recordings import frames_key
from headless.studies.stored_detections import load_frames, save_frames

from seip_addon.core.progress import Progress, finish
from seip_addon.core.sensing.scans.frame import Frame
from seip_addon.core.sensing.scans.scanner import Scanner
from seip_addon.core.sensing.scans.sensor import MountedSensor
from seip_addon.core.sensing.scans.simulation import Simulation, body_surfaces, prepare
from seip_addon.core.sensing.traffic.bodies import fitted_body
from seip_addon.core.storage.files import digest
from seip_addon.core.storage.source_digest import source_digest

FOLDER = "detections"


class SharedScans:
    """The sensors of several placements at a site, each of which casts its rays at the static scene once.

    Frames have the same bytes as those of `Simulator.frame`: what a sensor's rays meet does not depend on the other
    sensors, and noise and losses are drawn for each placement, by the sensor's place in it.

    Parameters
    ----------
    placements : sequence of SensorConfiguration
    """

    def __init__(self, simulator: Simulator, placements: Sequence[SensorConfiguration]) -> None:
        self._simulator, self.placements = simulator, placements
        mounted: dict[tuple[object, ...], MountedSensor] = {}
        keys = [[_key(sensor) for sensor in one.sensors] for one in placements]
        for one, own in zip(placements, keys, strict=True):
            mounted.update(zip(own, one.sensors, strict=True))
        numbers = {key: number for number, key in enumerate(mounted)}
        self._sensors = tuple(mounted.values())
        self._parts = [[numbers[key] for key in own] for own in keys]
        self._scanners: list[Scanner] = []

    def frames(self, run: SampledRun) -> Iterator[tuple[int, Frame]]:
        """Yield the frames of a run with the number of their placement: of all placements at each instant in turn."""
        simulation = self._simulation(run)
        parts = [simulation.part(numbers) for numbers in self._parts]
        for number, time in enumerate(run.times.tolist()):
            snapshot = run.trajectories.at(time)
            scans = simulation.scans(snapshot)
            for placement, (part, numbers) in enumerate(zip(parts, self._parts, strict=True)):
                yield placement, part.measure(number, snapshot, [scans[one] for one in numbers])

    def key(self, run: SampledRun) -> str:
        """Return a digest of all that the frames of a run follow from."""
        return digest(
            frames_key(self._simulator, MountedSensors("", self._sensors), [run]),
            *(str(numbers) for numbers in self._parts),
        )

    def _simulation(self, run: SampledRun) -> Simulation:
        simulator = self._simulator
        bodies = [fitted_body(user) for user in run.trajectories.users]
        if not self._scanners:
            first = finish(prepare(simulator.static, self._sensors, run.trajectories, bodies, simulator.settings))
            self._scanners = list(first.scanners)
        scanners = [scanner.for_other_traffic() for scanner in self._scanners]
        shapes = body_surfaces(bodies, simulator.settings.engine)
        return Simulation(simulator.static, scanners, run.trajectories, shapes, simulator.settings)


def detect_with_all(
    shared: SharedScans, simulator: Simulator, runs: Sequence[SampledRun], detector: Detector, folder: Path
) -> Generator[Progress, None, list[list[FrameResult]]]:
    """Detect road users in every frame of some runs with each placement; return the frames' results by placement.

    What was detected in a run is kept in a folder, under a digest of all that it follows from, so that a study that was
    stopped goes on with the next run. Densities and points of detections are those of the foreground.
    """
    results: list[list[FrameResult]] = [[] for _ in shared.placements]
    total = sum(len(run.times) for run in runs) * len(shared.placements)
    done = 0
    for run in runs:
        scene = digest(source_digest(__name__), shared.key(run), detector.key)
        path = folder / FOLDER / f"{scene[:32]}.npz"
        if not path.exists():
            found: list[list[FrameResult]] = [[] for _ in shared.placements]
            for number, frame in shared.frames(run):
                yield Progress(done, total, f"detect in {run.name}")
                found[number].append(_detected(simulator, shared.placements[number], run, frame, detector))
                done += 1
            save_frames(path, [frame for own in found for frame in own])
        else:
            done += len(run.times) * len(shared.placements)
        kept, times = load_frames(path), len(run.times)
        for number, own in enumerate(results):
            own.extend(kept[number * times : (number + 1) * times])
    yield Progress(total, total, "detected")
    return results


def _detected(
    simulator: Simulator, placement: SensorConfiguration, run: SampledRun, frame: Frame, detector: Detector
) -> FrameResult:
    with deterministic(1):
        found = detect(detector, simulator.area(detector.settings.pillar), frame)
    return frame_result(
        some_points(frame, frame.foreground),
        found,
        region=simulator.static.region,
        sensors=placement.places,
        run=run.name,
        parked=run.parked,
    )


def _key(sensor: MountedSensor) -> tuple[object, ...]:
    return (sensor.model.key, *sensor.xyz.tolist(), *sensor.orientation.ravel().tolist())
