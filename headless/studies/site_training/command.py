"""Train a detector on random placements at several sites, for any placement at unseen sites.

seip study random-sites -o out/sites --sites 16
seip study site-training out/sites/*/site.blend -o out/detector

The runs of traffic of each scene are in the folder SCENE_traffic next to it. Half of the frames are changed to be as
recordings are, and pedestrians walk in groups. The last sites are set aside for validation, which decides when
to stop. Rerun the command to resume an interrupted training.
"""

import argparse
import math
from collections.abc import Generator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from headless import runtime, survey
from headless.charts.detection import save_training_chart
from headless.detection.detector import check_device
from headless.detection.detector_evaluation import AT_ONCE, side_by_side
from headless.detection.frames import SampledRecording
from headless.detection.recordings import MountedSensors, Simulator, sampled_runs
from headless.detection.settings import NetworkSettings, TrainingSettings
from headless.detection.training import train
from headless.options import add_settings, new_parser, read_settings, real_number
from headless.studies.detection.case_study import recorded, simulate_all

import bpy
import numpy as np

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.limits import TIME_STEP
from seip_addon.core.base.progress import Progress
from seip_addon.core.geometry.orientation import orientation
from seip_addon.core.sensing.lidar.catalogue import find_models, load_catalogue
from seip_addon.core.sensing.lidar.model import LidarModel, fields_of_view
from seip_addon.core.sensing.scans.sensor import MountedSensor
from seip_addon.core.sensing.scans.simulation import ScanSettings
from seip_addon.core.sensing.traffic.site_traffic import require_own_traffic
from seip_addon.core.site.candidates import Candidates, CandidateSettings
from seip_addon.core.site.scene_geometry import SceneGeometry
from seip_addon.core.site.site import make_site
from seip_addon.scene.read import read_scene

from .companions import with_companions
from .field_conditions import field_recording

HEIGHTS = (3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0)  # metres
TILTS = (0.0, math.radians(5.0), math.radians(10.0), math.radians(15.0))
MAX_SENSORS = 5  # of a random placement
NETWORK = NetworkSettings()
ASIDE = 8  # one of this number of sites is set aside
MIN_SITES = 2

Site = TypeVar("Site")


def main(argv: list[str]) -> None:
    """Simulate scans of random placements at every site, and train a detector on them."""
    options = _parser().parse_args(argv)
    training = read_settings(TrainingSettings, options)
    sensors = tuple(options.sensor or load_catalogue(()))
    check_device(options.device)
    runtime.check_folder(options.output)
    training_recordings, validation = (
        [
            recording
            for number, scene in scenes
            for recording in runtime.finish_with_bar(
                site_recordings(scene, sensors, options.placements, options.every, [training.seed, number])
            )
        ]
        for scenes in set_aside(list(enumerate(options.scenes)))
    )
    store = options.output / "training.pt"
    steps = train(training_recordings, validation, NETWORK, training, device=options.device, store=store)
    detector, curve = runtime.finish_with_bar(steps)
    best = curve.best
    detector.save(options.output / "detector.pt", half=True)
    save_training_chart(options.output / "training.png", curve.loss, curve.validation, "training")
    runtime.print_line(f"best after {best:,} steps: average precision {curve.validation[best]:.1%} at sites set aside")
    runtime.print_line(f"written to {options.output}/")


def set_aside(sites: Sequence[Site]) -> tuple[Sequence[Site], Sequence[Site]]:
    """Return the training sites, and the last sites, which are for validation.

    Raises
    ------
    SeipError
        There are fewer than two sites.
    """
    if len(sites) < MIN_SITES:
        raise SeipError("name two sites or more: the last is set aside for validation")
    aside = max(1, len(sites) // ASIDE)
    return sites[:-aside], sites[-aside:]


def site_recordings(
    scene: Path, sensors: Sequence[str], placements: int, every: float, seed: Sequence[int]
) -> Generator[Progress, None, list[SampledRecording]]:
    """Simulate scans of all runs of traffic next to a scene, by random placements.

    Parameters
    ----------
    sensors : sequence of str
        Catalogue keys of the types.
    placements : int
        Number of random placements for each run of traffic, different ones for each run.
    every : float, seconds
        Time between frames.
    seed : (int, int)
        Seed of the training, and number of the site.

    Raises
    ------
    SeipError
        The scene cannot be read, or has no runs of traffic.
    """
    runtime.open_scene(scene)
    geometry = read_scene(bpy.context.scene).geometry
    models = find_models(load_catalogue(()), sensors)
    candidates = candidates_of_types(geometry, models)
    runs = sampled_runs(survey.runs_beside(scene), geometry.origin, every)
    if not runs:
        raise SeipError(f"{scene} has no runs of traffic in the folder next to it: simulate some with `seip traffic`")
    for run in runs:
        require_own_traffic(run.trajectories, geometry, run.name)
    simulator = Simulator(geometry, ScanSettings(seed=seed[0], rolling_shutter=True))
    area, random = simulator.area(NETWORK.pillar), np.random.default_rng(seed)
    name = f"{scene.parent.name}/{scene.stem}"
    grouped = []
    for run in runs:
        trajectories = yield from with_companions(run.trajectories, int(random.integers(1 << 31)))
        grouped.append(replace(run, trajectories=trajectories))
    drawn = [
        (random_placement(f"{name}, placement {number}", candidates, models, random), run)
        for run in grouped
        for number in range(1, placements + 1)
    ]
    scans = [
        field_recording(recorded(simulator, placed, run), area, placed.sensors, [*seed, number])
        for number, (placed, run) in enumerate(drawn)
    ]
    recordings = [SampledRecording(one, area, NETWORK.most_points) for one in scans]
    yield from side_by_side([simulate_all([one]) for one in recordings], AT_ONCE)
    simulator.forget()
    return recordings


def candidates_of_types(geometry: SceneGeometry, models: Mapping[str, LidarModel]) -> dict[str, Candidates]:
    """Return the candidate poses of each sensor type; types of the same field of view share them.

    The candidates of all types together would be more than a site may have.
    """
    fields = fields_of_view(models)
    by_field: dict[float, Candidates] = {}
    for key, field in fields.items():
        if field not in by_field:
            settings = CandidateSettings(sensors=(key,), heights=HEIGHTS, tilts=TILTS)
            by_field[field] = make_site(geometry, settings, fields_of_view=fields).candidates
    return {key: by_field[field] for key, field in fields.items()}


def random_placement(
    name: str, candidates: Mapping[str, Candidates], models: Mapping[str, LidarModel], random: np.random.Generator
) -> MountedSensors:
    """Return 1 to `MAX_SENSORS` sensors at different positions; positions, and then their poses, are equally likely.

    Half of the placements have sensors of only one type.

    Parameters
    ----------
    candidates : mapping of str to Candidates
        Candidate poses of each type, all at the same positions.
    """
    positions = np.unique(next(iter(candidates.values())).position_of)
    count = int(random.integers(1, min(MAX_SENSORS, len(positions)) + 1))
    types = sorted(models)
    if random.integers(2):
        types = [types[int(random.integers(len(types)))]]
    sensors = []
    for number, position in enumerate(random.choice(positions, count, replace=False).tolist(), 1):
        key = types[int(random.integers(len(types)))]
        own = candidates[key]
        poses = np.flatnonzero(own.position_of == position)
        pose = int(poses[int(random.integers(len(poses)))])
        rotation = orientation(float(own.yaw[pose]), float(own.tilt[pose]))
        sensors.append(MountedSensor(f"S{number}", models[key], own.xyz[pose], rotation))
    return MountedSensors(name, tuple(sensors))


def _parser() -> argparse.ArgumentParser:
    parser = new_parser("seip study site-training", "Train a detector on random placements at several sites.")
    parser.add_argument(
        "scenes", nargs="+", type=Path, metavar="SCENE", help="scenes (.blend), each with its traffic next to it"
    )
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for the detector")
    data = parser.add_argument_group("training data")
    data.add_argument(
        "--sensor", nargs="+", metavar="KEY", help="types in the placements (default: all of the catalogue)"
    )
    data.add_argument(
        "--placements", type=int, default=1, metavar="N", help="random placements for each run of traffic"
    )
    data.add_argument(
        "--every", type=real_number(TIME_STEP), default=2.5, metavar="S", help="time between frames, seconds"
    )
    data.add_argument("--seed", type=int, default=1, metavar="N", help="seed for placements, noise, weights and order")
    work = parser.add_argument_group("training")
    add_settings(work, TrainingSettings, "steps", "batch", "learning_rate", "patience")
    work.add_argument("--device", default="cpu", help="device of torch: cpu, cuda")
    add_settings(work, TrainingSettings, "threads")
    return parser
