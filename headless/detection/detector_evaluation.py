"""Detections of a trained detector with the sensors of a placement, on runs of traffic."""

from collections.abc import Generator, Sequence
from dataclasses import dataclass

from headless.detection.run_detection import AT_ONCE, detect_in_runs
from headless.side_by_side import side_by_side

from seip_addon.core.errors import SeipError
from seip_addon.core.output.results.detection_record import Precision
from seip_addon.core.progress import Progress
from seip_addon.core.sensing.scans.frame import Frame

from .average_precision import Evaluation, balanced_score, evaluate
from .breakdown import recall_by_category
from .detector import Detector
from .frame_results import FrameResult
from .recordings import MountedSensors, SampledRun, Simulator
from .rules import MAIN_RULE, precisions
from .training import deterministic


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
    works = [detect_in_runs(simulator, placed, [run], [detector], 1) for run in runs]
    with deterministic(1):  # all the time, as torch keeps one such setting for all threads
        found = yield from side_by_side(works, AT_ONCE if detector.device.type == "cpu" else 1)
    frames = tuple(frame for (of_run,) in found for frame in of_run)
    evaluation = evaluate(frames, MAIN_RULE)
    users = [int(frame.truth.inside.sum()) for frame in frames]
    fullest = users.index(max(users))
    instants = [(run, number) for run in runs for number in range(len(run.times))]
    scan = simulator.frame(placed, *instants[fullest])
    return DetectorEvaluation(frames, evaluation, fullest, scan, balanced_score(evaluation))
