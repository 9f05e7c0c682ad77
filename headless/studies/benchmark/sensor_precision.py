"""Average precision of one detector on frames scanned by three models of one LiDAR; needs PyTorch."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from headless.detection.average_precision import evaluate
from headless.detection.detection_area import area_of
from headless.detection.frame_results import FrameResult, frame_result
from headless.detection.inference import detect
from headless.detection.matching import Rule
from headless.detection.recordings import SampledRun, Simulator
from headless.detection.settings import NetworkSettings, TrainingSettings
from headless.detection.training import TrainedDetector, deterministic
from headless.studies.benchmark.sensor_models import FINEST, SHIPPED, PrecisionFront, SensorModel
from headless.studies.benchmark.visibility import Cost
from headless.studies.coverage.cells import Cell, solve_cell
from headless.studies.detection import case_study
from headless.studies.detection.sensor_configuration import SensorConfiguration
from headless.studies.paired_change import ResampledPrecision, change, level

from seip_addon.core.progress import Progress, within
from seip_addon.core.sensing.scans.frame import Frame
from seip_addon.core.sensing.scans.scanner import BodySurface, ReflectiveSurface, Scanner
from seip_addon.core.sensing.scans.sensor import MountedSensor
from seip_addon.core.sensing.scans.simulation import ScanSettings, Simulation
from seip_addon.core.sensing.scans.static_scene import StaticScene, static_scene
from seip_addon.core.sensing.traffic.bodies import fitted_body
from seip_addon.core.sensing.traffic.trajectories import Trajectories
from seip_addon.core.workflows.survey import Survey

FRAME_INTERVAL = 2.5  # seconds


def simulation_by(
    model: SensorModel, static: StaticScene, sensors: Sequence[MountedSensor], traffic: Trajectories, seed: int
) -> Simulation:
    """Return the simulation of traffic with every sensor replaced by `model`.

    Parameters
    ----------
    sensors : sequence of MountedSensor
        Mounted sensors of the model's LiDAR type.
    seed : int
        Seed of noise and losses.
    """
    bodies = [fitted_body(user) for user in traffic.users]
    casters = {
        key: model.caster(triangles) for key, triangles in {id(b.triangles): b.triangles for b in bodies}.items()
    }
    shapes = [BodySurface(casters[id(body.triangles)], body.reflectivity) for body in bodies]
    ground = ReflectiveSurface(model.caster(static.triangles), static.reflectivity)
    scanners = [Scanner(replace(sensor, model=model.lidar), ground) for sensor in sensors]
    return Simulation(static, scanners, traffic, shapes, ScanSettings(seed=seed))


def frames_by(
    model: SensorModel,
    static: StaticScene,
    sensors: Sequence[MountedSensor],
    runs: Sequence[SampledRun],
    *,
    seed: int,
    cost: Cost,
) -> Generator[tuple[SampledRun, Frame], None, None]:
    """Scan runs of traffic by a model and add the time to ``cost``; see `simulation_by`."""
    for run in runs:
        simulation = cost.expense.time(partial(simulation_by, model, static, sensors, run.trajectories, seed))
        for number, time in enumerate(run.times.tolist()):
            frame = cost.expense.time(partial(simulation.frame, number, time))
            cost.rays += model.rays_per_beam * sum(len(scanner.directions) for scanner in simulation.scanners)
            cost.seen += len(frame.points)
            yield run, frame


def precision_front(
    survey: Survey,
    models: Sequence[SensorModel],
    runs: Sequence[Path],
    folder: Path,
    *,
    count: int,
    training: TrainingSettings,
) -> Generator[Progress, None, PrecisionFront]:
    """Train a detector on scans of the shipped model, and test it on the same traffic scanned by each model.

    Parameters
    ----------
    survey : Survey
        Survey of only the LiDAR.
    runs : sequence of path
        Traffic runs, the last two of them for the test; the others are for training and validation.
    folder : path
        Folder of the detector; a detector that is already there is not trained again.
    count : int
        Number of sensors, placed for the largest coverage.
    training : TrainingSettings
        Training settings; their seed is also the seed of the scans.

    Yields
    ------
    Progress

    Raises
    ------
    SeipError
        There are too few runs.
    """
    lidar = next(model.lidar for model in models if model.name == SHIPPED)
    traffic = case_study.read_traffic(runs, survey.geometry.origin, FRAME_INTERVAL)
    progress = Progress(0, 1, "place")
    cell = Cell(lidar.key, None, count, 1.0)
    placed = solve_cell(survey.site, survey.models, survey.grid.visible, cell, survey.settings.limits)
    configuration = SensorConfiguration.of_case((yield from within(progress, placed)))
    static, area = static_scene(survey.geometry), area_of(survey.geometry, NetworkSettings().pillar)
    trained = yield from _trained(configuration, traffic, survey, training, folder)

    costs = {model.name: Cost() for model in models}
    results: dict[str, list[FrameResult]] = {model.name: [] for model in models}
    scans = [
        frames_by(model, static, configuration.sensors, traffic.test, seed=training.seed, cost=costs[model.name])
        for model in models
    ]
    total = sum(len(run.times) for run in traffic.test)
    for done, frames in enumerate(zip(*scans, strict=True)):
        yield Progress(done, total, "scan and detect")
        for model, (run, frame) in zip(models, frames, strict=True):
            with deterministic(1):
                found = detect(trained.detector, area, frame)
            results[model.name].append(
                frame_result(
                    frame,
                    found,
                    region=static.region,
                    sensors=configuration.places,
                    run=run.name,
                )
            )
    precise = {name: ResampledPrecision(evaluate(own, Rule())) for name, own in results.items()}
    return PrecisionFront(
        survey.site.name,
        configuration.name,
        total,
        training.steps,
        costs,
        {name: level([one]) for name, one in precise.items()},
        {name: change([one], [precise[FINEST]]) for name, one in precise.items()},
    )


def _trained(
    configuration: SensorConfiguration,
    traffic: case_study.Traffic,
    survey: Survey,
    training: TrainingSettings,
    folder: Path,
) -> Generator[Progress, None, TrainedDetector]:
    network = NetworkSettings()
    simulator = Simulator(survey.geometry, ScanSettings(seed=training.seed))
    name = f"detector-{configuration.sensor}-{training.steps}-{training.seed}"
    model = case_study.ModelConfiguration(name, (configuration,), network, training)
    samples = yield from case_study.simulate_training_set(simulator, [configuration], traffic, network)
    (trained,) = yield from case_study.train_all([model], samples, folder, device="cpu")
    return trained
