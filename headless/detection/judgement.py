"""What a trained detector finds with the sensors of any placement, on runs of traffic."""

from collections.abc import Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from seip_addon.core.errors import SeipError
from seip_addon.core.estimates import Interval
from seip_addon.core.progress import Progress, finish
from seip_addon.core.scans import Frame, MountedSensor, ScanSettings, Simulation, StaticScene, prepare
from seip_addon.core.traffic.bodies import fitted_body

from .average_precision import Evaluation, balanced_score, evaluate
from .cloud_in_plan import CloudInPlan
from .detection_area import DetectionArea
from .detector import Detector
from .frame_results import FrameResult, frame_result
from .inference import detect
from .recordings import SampledRun
from .rules import MAIN_RULE, precisions
from .settings import CLASS_CATEGORIES
from .training import deterministic


@dataclass(frozen=True, eq=False)
class Judgement:
    """The frames of some runs with what a detector finds in them.

    Parameters
    ----------
    frames : tuple of FrameResult
        Of all runs, one after the other.
    fullest : int
        The frame with the most road users in the region.
    scan : Frame
        Of that instant.
    score : float
        The best balance of precision and recall on these frames.
    """

    frames: tuple[FrameResult, ...]
    evaluation: Evaluation
    fullest: int
    scan: Frame
    score: float

    def precisions(self) -> Iterator[tuple[str, float, Interval | None, int]]:
        """Yield name, average precision, interval and number of road users by each rule by which there are any."""
        for name, found in precisions(self.frames).items():
            if found.road_users:
                yield name, found.value, found.interval, found.road_users


def judge(  # noqa: PLR0913  # a detector, where it looks, what measures there, and how
    detector: Detector,
    area: DetectionArea,
    static: StaticScene,
    sensors: Sequence[MountedSensor],
    runs: Sequence[SampledRun],
    scans: ScanSettings,
    *,
    threads: int,
) -> Generator[Progress, None, Judgement]:
    """Detect road users in every frame of runs of traffic, as some sensors scan them.

    Parameters
    ----------
    area : DetectionArea
        Of this site.
    threads : int
        Of torch.

    Raises
    ------
    SeipError
        There is no sensor, or no vehicle in the region in any frame.
    """
    if not sensors:
        raise SeipError("the scene has no sensors: place some first, or open the placed.blend of a result")
    known: dict[str, Any] = {"region": static.region, "sensors": np.array([sensor.xyz for sensor in sensors])}
    known["classes"] = tuple(CLASS_CATEGORIES.values())
    total = sum(len(run.times) for run in runs)
    frames: list[FrameResult] = []
    most, fullest, scan = -1, 0, None
    for run in runs:
        yield Progress(len(frames), total, f"prepare {run.name}")
        bodies = [fitted_body(user) for user in run.trajectories.users]
        simulation: Simulation = finish(prepare(static, sensors, run.trajectories, bodies, scans))
        for number, time in enumerate(run.times):
            yield Progress(len(frames), total, f"detect in {run.name}")
            frame = simulation.frame(number, float(time))
            with deterministic(threads):
                found = detect(detector, area, frame)
            result = frame_result(frame, CloudInPlan(frame.points), found, run=run.name, parked=run.parked, **known)
            if result.truth.inside.sum() > most:
                most, fullest, scan = int(result.truth.inside.sum()), len(frames), frame
            frames.append(result)
    yield Progress(total, total, "detected")
    evaluation = evaluate(frames, MAIN_RULE)
    if scan is None:
        raise SeipError("there is no run of traffic to detect in: name some with --traffic")
    return Judgement(tuple(frames), evaluation, fullest, scan, balanced_score(evaluation))


def figures(judgement: Judgement) -> Mapping[str, Any]:
    """Return what a record holds of a judgement."""
    return {
        name: {
            "average_precision": value,
            "interval": None if interval is None else list(interval),
            "road_users": users,
        }
        for name, value, interval, users in judgement.precisions()
    }
