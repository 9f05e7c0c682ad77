"""The detector's chapter of the stability page: train on a scene, then test under disturbances."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import replace
from pathlib import Path

from headless import runtime, survey
from headless.detection.average_precision import balanced_score
from headless.detection.detector import SHIPPED_DETECTOR, Detector
from headless.detection.recordings import Simulator, sampled_runs
from headless.detection.settings import NetworkSettings, TrainingSettings
from headless.detection.training import TrainedDetector
from headless.studies.detection import case_study
from headless.studies.detection.sensor_configuration import SensorConfiguration
from headless.studies.detector_limits.disturbances import Disturbance
from headless.studies.detector_limits.study import LimitsStudy, OtherSite, TrainingPlan, limits_study, training_plan
from headless.studies.detector_limits.trials import EvaluatedDetector, TrialSite, trials

import bpy

from seip_addon.core.progress import Progress
from seip_addon.core.sensing.scans.simulation import ScanSettings
from seip_addon.core.workflows.survey import Layout, Survey, lay_out, see
from seip_addon.scene.read import read_scene

TRAINING_INTERVAL = 2.5  # seconds between frames to learn from
TEST_INTERVAL = TRAINING_INTERVAL * case_study.TEST_STRIDE


def detector_limits(
    surveyed: Survey,
    scene: Path | None,
    others: Sequence[Path],
    folder: Path,
    *,
    seeds: int = 3,
    steps: int = TrainingSettings().steps,
) -> Generator[Progress, None, LimitsStudy]:
    """Train detectors on a scene, and evaluate them under growing disturbances.

    Parameters
    ----------
    scene : path or None
        File of the scene; its runs of traffic are next to it, and optionally runs of denser traffic.
    others : sequence of path
        Other scenes with traffic next to them, to test the detectors on.
    folder : path
        Folder of detectors and trials; an interrupted study resumes from it.
    seeds : int
        Number of detectors that differ only in their seeds.
    steps : int
        Steps of each training.

    Yields
    ------
    Progress

    Returns
    -------
    LimitsStudy
    """
    network = NetworkSettings()
    origin = surveyed.geometry.origin
    traffic = case_study.read_traffic(survey.runs_beside(scene), origin, TRAINING_INTERVAL)
    configurations = yield from case_study.place_all(surveyed)
    simulator = _studio(surveyed)
    plan = training_plan(configurations, network, TrainingSettings(steps=steps), seeds=seeds, padding=True)
    trained = yield from _trained(plan, simulator, configurations, traffic, folder)
    shipped = EvaluatedDetector("shipped", Detector.load(SHIPPED_DETECTOR))
    candidates = plan.candidates([one.detector for one in trained], shipped=(shipped,))

    main = _most(configurations)
    home = TrialSite(simulator.site, simulator, traffic.test)
    practice = TrialSite(simulator.site, simulator, traffic.validation)
    (validated,) = yield from trials(practice, main, Disturbance(), candidates.tested[:1], folder)
    other_sites = []
    dense = sampled_runs(survey.runs_beside(scene, "_dense"), origin, TEST_INTERVAL)
    if dense:
        other_sites.append(OtherSite(TrialSite("denser traffic", simulator, dense), (main,)))
    for other in others:
        there = yield from _on_other_scene(other, surveyed, main, folder)
        other_sites.append(there)
    return (
        yield from limits_study(
            home, [main], candidates, other_sites, folder, score=balanced_score(validated.evaluation)
        )
    )


def _trained(
    plan: TrainingPlan,
    simulator: Simulator,
    configurations: Sequence[SensorConfiguration],
    traffic: case_study.Traffic,
    folder: Path,
) -> Generator[Progress, None, list[TrainedDetector]]:
    network = NetworkSettings()
    training_set = yield from case_study.simulate_training_set(simulator, configurations, traffic, network)
    return (yield from case_study.train_all(plan.models, training_set, folder, device="cpu"))


def _on_other_scene(
    scene: Path, surveyed: Survey, main: SensorConfiguration, folder: Path
) -> Generator[Progress, None, OtherSite]:
    """Place the largest number of sensors of the same type on another scene, and read its runs of traffic."""
    settings = surveyed.settings
    runtime.open_scene(scene)
    reading = read_scene(bpy.context.scene)
    candidates = replace(settings.candidates, sensors=(main.sensor,))
    layout = lay_out(reading.geometry, replace(settings, candidates=candidates), reading.warnings)
    there = yield from case_study.place_all((yield from see(layout, folder / f"visibility_{scene.stem}.npz")))
    runs = sampled_runs(survey.runs_beside(scene), layout.geometry.origin, TEST_INTERVAL)
    return OtherSite(TrialSite(layout.site.name, _studio(layout), runs), (_most(there),))


def _studio(layout: Layout) -> Simulator:
    return Simulator(layout.geometry, ScanSettings(rolling_shutter=True, engine=layout.settings.engine))


def _most(configurations: Sequence[SensorConfiguration]) -> SensorConfiguration:
    """Return the configuration with the most sensors of the middle type.

    Its average precision is high enough to fall, and it has several sensors, of which one can fail.
    """
    types = list(dict.fromkeys(one.sensor for one in configurations))
    own = [one for one in configurations if one.sensor == types[len(types) // 2]]
    return max(own, key=lambda one: one.count)
