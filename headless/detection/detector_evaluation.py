"""Detections of a trained detector with the sensors of a placement, on runs of traffic."""

import os
import threading
from collections.abc import Generator, Sequence
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from contextlib import closing
from dataclasses import dataclass

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import REPORT_INTERVAL, Progress, Result, finish
from seip_addon.core.output.results.detection_record import Precision
from seip_addon.core.sensing.scans.frame import Frame

from .average_precision import Evaluation, balanced_score, evaluate
from .breakdown import recall_by_category
from .detector import Detector
from .frame_results import FrameResult, frame_result
from .inference import detect
from .recordings import MountedSensors, SampledRun, Simulator
from .rules import MAIN_RULE, precisions
from .training import make_deterministic

AT_ONCE = (os.cpu_count() or 1) + 1  # works in threads on the CPU: one more than cores, as each also waits


def side_by_side(
    works: Sequence[Generator[Progress, None, Result]], threads: int
) -> Generator[Progress, None, list[Result]]:
    """Run pieces of work in parallel threads, for work that mostly releases Python's global lock.

    Parameters
    ----------
    works : sequence of generators
        Pieces of work, each with its own units of progress.
    threads : int
        Largest number of pieces that run at the same time.

    Yields
    ------
    Progress
        Sum over the pieces that have begun, ten times a second, with the description of the last one.

    Returns
    -------
    list
        Results in the order of the pieces.
    """
    stop = threading.Event()
    latest: dict[int, Progress] = {}

    def run(number: int) -> Result:
        def report(progress: Progress) -> None:
            # A thread cannot be stopped from outside: it stops itself at its next report.
            latest[number] = progress
            if stop.is_set():
                raise _Stopped

        with closing(works[number]) as work:
            return finish(work, report)

    pool = ThreadPoolExecutor(threads)
    try:
        futures = [pool.submit(run, number) for number in range(len(works))]
        while any(not future.done() for future in futures):
            for ended in wait(futures, REPORT_INTERVAL, FIRST_EXCEPTION).done:
                ended.result()  # raises the exception of that thread
            yield _sum_of(list(latest.values()), len(works))
        return [future.result() for future in futures]
    finally:
        stop.set()
        pool.shutdown(wait=False, cancel_futures=True)  # do not wait for the next report of each piece


class _Stopped(BaseException):
    """Raised in a worker thread whose result is no longer wanted."""


def _sum_of(parts: Sequence[Progress], works: int) -> Progress:
    if not parts:
        return Progress(0, 0, "begin")
    done, total = sum(part.done for part in parts), sum(part.total for part in parts)
    counted = all(part.counted and part.total for part in parts)
    return Progress(done, total * works // len(parts), parts[-1].what, counted)


def detect_in_runs(  # what measures where, what looks at it, and how
    simulator: Simulator,
    placed: MountedSensors,
    runs: Sequence[SampledRun],
    detectors: Sequence[Detector],
) -> Generator[Progress, None, list[list[FrameResult]]]:
    """Detect road users in every frame of some runs; return the frames' results by detector."""
    region = simulator.static.region
    looking = [simulator.area(detector.settings.pillar) for detector in detectors]
    results: list[list[FrameResult]] = [[] for _ in detectors]
    total = sum(len(run.times) for run in runs)
    done = 0
    for run in runs:
        for number in range(len(run.times)):
            yield Progress(done, total, f"detect with {placed.name}")
            done += 1
            frame = simulator.frame(placed, run, number)
            for detector, area, own in zip(detectors, looking, results, strict=True):
                found = detect(detector, area, frame)
                own.append(
                    frame_result(frame, found, region=region, sensors=placed.positions, run=run.name, parked=run.parked)
                )
    yield Progress(total, total, f"detect with {placed.name}")
    return results


@dataclass(frozen=True, eq=False)
class DetectorEvaluation:
    """Frames of some runs with the detections of a detector.

    Parameters
    ----------
    frames : tuple of FrameResult
        Results of all runs, one after the other.
    fullest : int
        The frame with the most road users in the region.
    scan : Frame
        Scan of the fullest frame.
    score : float
        The best balance of precision and recall on these frames.
    """

    frames: tuple[FrameResult, ...]
    evaluation: Evaluation
    fullest: int
    scan: Frame
    score: float

    @property
    def recall(self) -> dict[str, dict[str, float]]:
        """Share of the road users found with that score or more, and their number, by category."""
        return {
            name: {"recall": share, "road_users": users}
            for name, (share, users) in recall_by_category(self.evaluation, self.score).items()
        }

    @property
    def precisions(self) -> dict[str, Precision]:
        """Average precision by the name of each rule by which road users count."""
        return {name: found for name, found in precisions(self.frames).items() if found.road_users}


def evaluate_detector(
    detector: Detector, simulator: Simulator, placed: MountedSensors, runs: Sequence[SampledRun]
) -> Generator[Progress, None, DetectorEvaluation]:
    """Detect road users in every frame of runs of traffic, scanned by given sensors.

    Raises
    ------
    SeipError
        There is no sensor, or no vehicle in the region in any frame.
    """
    if not placed.sensors:
        raise SeipError("the scene has no sensors: place some first, or open the placed.blend of a result")
    works = [detect_in_runs(simulator, placed, [run], [detector]) for run in runs]
    make_deterministic(1)
    found = yield from side_by_side(works, AT_ONCE if detector.device.type == "cpu" else 1)
    frames = tuple(frame for (of_run,) in found for frame in of_run)
    evaluation = evaluate(frames, MAIN_RULE)
    users = [int(frame.truth.inside.sum()) for frame in frames]
    fullest = users.index(max(users))
    instants = [(run, number) for run in runs for number in range(len(run.times))]
    scan = simulator.frame(placed, *instants[fullest])
    return DetectorEvaluation(frames, evaluation, fullest, scan, balanced_score(evaluation))
