"""Detection in every frame of runs of traffic."""

import os
from collections.abc import Generator, Sequence

from seip_addon.core.progress import Progress

from .detection_area import DetectionArea
from .detector import Detector
from .frame_results import FrameResult, frame_result
from .inference import detect
from .recordings import MountedSensors, SampledRun, Simulator
from .training import deterministic

AT_ONCE = (os.cpu_count() or 1) + 1  # works in threads on the CPU: one more than cores, as each also waits


def detect_in_runs(  # what measures where, what looks at it, and how
    simulator: Simulator,
    placed: MountedSensors,
    runs: Sequence[SampledRun],
    detectors: Sequence[Detector],
    threads: int,
    areas: Sequence[DetectionArea] | None = None,
) -> Generator[Progress, None, list[list[FrameResult]]]:
    """Detect road users in every frame of some runs; return the frames' results by detector.

    Parameters
    ----------
    areas : sequence of DetectionArea, optional
        Where each detector looks, where that is not the scene's own.
    """
    region = simulator.static.region
    looking = areas or [simulator.area(detector.settings.pillar) for detector in detectors]
    results: list[list[FrameResult]] = [[] for _ in detectors]
    total = sum(len(run.times) for run in runs)
    done = 0
    for run in runs:
        for number in range(len(run.times)):
            yield Progress(done, total, f"detect with {placed.name}")
            done += 1
            frame = simulator.frame(placed, run, number)
            for detector, area, own in zip(detectors, looking, results, strict=True):
                with deterministic(threads):
                    found = detect(detector, area, frame)
                own.append(
                    frame_result(frame, found, region=region, sensors=placed.places, run=run.name, parked=run.parked)
                )
    yield Progress(total, total, f"detect with {placed.name}")
    return results
