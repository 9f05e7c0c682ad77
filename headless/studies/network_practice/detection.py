"""Average precision over a network with the placements of several practices."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from headless.detection.average_precision import average_precisions_without_each_run, evaluate
from headless.detection.detector import SHIPPED_DETECTOR, Detector
from headless.detection.frame_results import FrameResult
from headless.detection.jackknife import jackknife_reach
from headless.detection.recordings import MountedSensors, Simulator, sampled_runs
from headless.detection.rules import RULES
from headless.detection.run_detection import AT_ONCE
from headless.detection.training import deterministic
from headless.side_by_side import side_by_side
from headless.studies.criteria.precision import CLASSES
from headless.studies.stored_detections import stored_detections

import bpy
import numpy as np

from seip_addon.core.choosing.network.site_problem import SiteProblem
from seip_addon.core.errors import SeipError
from seip_addon.core.estimates import IntervalEstimate
from seip_addon.core.progress import Progress
from seip_addon.core.sensing.lidar.catalogue import find_models, load_catalogue
from seip_addon.core.sensing.scans.sensor import MountedSensor
from seip_addon.core.sensing.scans.simulation import ScanSettings
from seip_addon.core.sensing.traffic.trajectories import WARM_UP
from seip_addon.core.workflows.traffic_simulation import SIMULATION, SimulationSettings, listed_runs, simulate_runs
from seip_addon.scene.blend_file import open_blend
from seip_addon.scene.read import read_scene

from .practices import Chosen

TRAFFIC, DETECTIONS = "traffic", "detections"
"""Folders of a site's runs of traffic and of what was detected in them."""
EVERY, FRAMES = 5.0, 8
"""Seconds from frame to frame, and frames of a run."""

Results = dict[str, list[FrameResult]]
"""Results of frames by practice."""


@dataclass(frozen=True)
class PrecisionOverSites:
    """Average precision with the placements of a practice, and that of the allocation less it.

    Parameters
    ----------
    value : IntervalEstimate
        Average precision over the road users of all sites.
    gain : IntervalEstimate
        Average precision with the allocation less that with the practice; both over sites like these.
    road_users : int
        Number of boxes that count.
    """

    value: IntervalEstimate
    gain: IntervalEstimate
    road_users: int


def detect_at_site(
    folder: Path, problem: SiteProblem, chosen: Mapping[str, Chosen], runs: int, output: Path
) -> Generator[Progress, None, Results]:
    """Detect road users in simulated traffic at a site of a network, with the placement of each practice.

    Parameters
    ----------
    folder : path
        Folder of the site, with its scene and its map.
    chosen : mapping of str to tuple of int
        Poses by practice. Without a sensor, nothing is detected.
    runs : int
        Number of runs of simulated traffic.
    output : path
        Folder for the traffic and for what was detected, from which an interrupted study goes on.

    Raises
    ------
    SeipError
        The site was not built from a map, SUMO is missing, or a sensor is not all-round.
    """
    open_blend(folder / "site.blend")
    geometry = read_scene(bpy.context.scene).geometry
    if not (folder / "site.xodr").is_file():
        raise SeipError(f"{folder} has no map to simulate traffic on: build the network from extracts")
    traffic = output / TRAFFIC
    traffic.mkdir(parents=True, exist_ok=True)
    if len(listed_runs(traffic / SIMULATION)) != runs:
        settings = SimulationSettings(duration=WARM_UP + FRAMES * EVERY)
        yield from simulate_runs(folder / "site.xodr", settings, runs, geometry, traffic)
    sampled = sampled_runs(sorted(traffic.glob("*.npz")), geometry.origin, EVERY)
    placements = {poses: _mounted(problem, poses) for poses in {*chosen.values()} - {()}}
    # Road users at a site without sensors count all the same, so their boxes are taken from frames with a sensor.
    placements = placements or {(0,): _mounted(problem, (0,))}
    simulator = Simulator(geometry, ScanSettings())
    detector = Detector.load(SHIPPED_DETECTOR)
    works = [
        stored_detections(simulator, placed, [detector], sampled, output / DETECTIONS) for placed in placements.values()
    ]
    with deterministic(1):
        found = yield from side_by_side(works, AT_ONCE)
    frames = {poses: _of_site(own, folder.name) for poses, (own,) in zip(placements, found, strict=True)}
    frames[()] = [_without_sensors(frame) for frame in next(iter(frames.values()))]
    return {practice: frames[poses] for practice, poses in chosen.items()}


def compare_precision(results: Results, allocation: str) -> dict[str, dict[str, PrecisionOverSites]]:
    """Return for each practice the average precision of each class of road users over all sites.

    Parameters
    ----------
    results : dict
        Results of the frames of all sites, the same frames for each practice.
    allocation : str
        Name of the practice with which the others are compared.

    Returns
    -------
    dict
        By practice and class; classes without road users are left out. Intervals are jackknife intervals over sites.
    """
    compared: dict[str, dict[str, PrecisionOverSites]] = {practice: {} for practice in results}
    for name, rule in CLASSES.items():
        try:
            found = {practice: evaluate(frames, RULES[rule]) for practice, frames in results.items()}
        except SeipError:  # no road user of this class
            continue
        left_out = {practice: average_precisions_without_each_run(one) for practice, one in found.items()}
        best, without_best = found[allocation].average_precision, left_out[allocation]
        for practice, one in found.items():
            without, value = left_out[practice], one.average_precision
            reach, reach_of_gain = np.inf, np.inf
            if without is not None and without_best is not None:
                reach, reach_of_gain = jackknife_reach(without), jackknife_reach(without_best - without)
            gain = best - value
            compared[practice][name] = PrecisionOverSites(
                IntervalEstimate(value, max(0.0, value - reach), min(1.0, value + reach)),
                IntervalEstimate(gain, gain - reach_of_gain, gain + reach_of_gain),
                len(one.wanted),
            )
    return compared


def _mounted(problem: SiteProblem, poses: Sequence[int]) -> MountedSensors:
    """Return sensors at poses of a site, in axes that are not turned."""
    models = find_models(load_catalogue(), sorted({str(problem.labels[pose]) for pose in poses}))
    turned = [model.key for model in models.values() if not model.all_round]
    if turned:
        raise SeipError(f"{turned[0]} is not all-round: only placements of all-round sensors are compared by detection")
    mounted = (
        MountedSensor(f"S{number}", models[str(problem.labels[pose])], problem.xyz[pose], np.eye(3))
        for number, pose in enumerate(poses, start=1)
    )
    return MountedSensors("+".join(map(str, poses)), tuple(mounted))


def _of_site(frames: Sequence[FrameResult], site: str) -> list[FrameResult]:
    """Return frames as those of one run, the site, as sites are what is independent."""
    return [replace(frame, run=site) for frame in frames]


def _without_sensors(frame: FrameResult) -> FrameResult:
    """Return a frame in which nothing is measured and nothing is detected."""
    truth, found = frame.truth, frame.detected
    nothing = {name: values[:0] for name, values in vars(found).items()}
    unseen = replace(
        truth,
        points=np.zeros_like(truth.points),
        visibility=np.zeros_like(truth.visibility),
        distance=np.full_like(truth.distance, np.inf),
    )
    return replace(frame, truth=unseen, detected=replace(found, **nothing))
