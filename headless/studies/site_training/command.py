"""Train a detector on random placements at several sites, for any placement at unseen sites.

seip study random-sites -o out/sites --sites 16
seip study site-training out/sites/*/site.blend -o out/detector

The runs of traffic of each scene are in the folder SCENE_traffic next to it. The last sites are set aside for
validation, which decides when to stop. Rerun the command to resume an interrupted training.
"""

import argparse
import math
from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

from headless import runtime, survey
from headless.charts.detection import save_training_chart
from headless.detection.detector import Detector, check_device
from headless.detection.detector_evaluation import AT_ONCE, side_by_side
from headless.detection.frames import SampledRecording
from headless.detection.recordings import Simulator, sampled_runs
from headless.detection.settings import NetworkSettings, TrainingSettings
from headless.detection.training import train
from headless.options import add_settings, new_parser, read_settings, real_number
from headless.studies.detection.case_study import simulated
from headless.studies.site_training.training_site import TrainingSite, field_runs

import bpy
import numpy as np

from seip_addon.core.errors import SeipError
from seip_addon.core.limits import TIME_STEP
from seip_addon.core.progress import Progress
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.lidar.model import fields_of_view
from seip_addon.core.sensing.scans.simulation import ScanSettings
from seip_addon.core.sensing.traffic.site_traffic import require_own_traffic
from seip_addon.core.site.candidates import CandidateSettings
from seip_addon.core.site.site import make_site
from seip_addon.core.workflows.survey_settings import SurveySettings
from seip_addon.scene.read import read_scene

HEIGHTS = (3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0)  # metres
TILTS = (0.0, math.radians(5.0), math.radians(10.0), math.radians(15.0))
TYPES = (
    "type1",
    "type2",
    "type3",
    "vlp16",
    "vlp32c",
    "hdl64e",
    "os0_128",
    "os1_64_rev7",
    "os1_128",
    "pandar64",
    "xt32",
    "ruby_plus",
    "helios_5515",
    "at128",
)
NETWORK = NetworkSettings()
ASIDE = 8  # one of this number of sites is set aside
MIN_SITES = 2

Site = TypeVar("Site")


def main(argv: list[str]) -> None:
    """Simulate scans of random placements at every site, and train a detector on them."""
    options = _parser().parse_args(argv)
    network, training = NETWORK, read_settings(TrainingSettings, options)
    every_type = tuple(load_catalogue(())) if options.field_conditions else TYPES
    learning = LearningSettings(
        tuple(options.sensor or every_type), options.placements, options.every, training.seed, options.field_conditions
    )
    check_device(options.device)
    runtime.check_folder(options.output)
    training_recordings, validation = (
        [
            recording
            for number, scene in scenes
            for recording in runtime.finish_with_bar(_sampled(read_site(scene, learning), number, network, learning))
        ]
        for scenes in set_aside(list(enumerate(options.scenes)))
    )
    store = options.output / "training.pt"
    start = None if options.start is None else Detector.load(options.start, options.device)
    if start is not None and start.settings != network:
        raise SeipError(f"{options.start} is of another network: give the network's options as in its training")
    steps = train(training_recordings, validation, network, training, device=options.device, store=store, start=start)
    trained = runtime.finish_with_bar(steps)
    best = trained.curve.best
    trained.detector.save(options.output / "detector.pt", half=True)
    save_training_chart(options.output / "training.png", trained.curve.loss, trained.curve.validation, "training")
    runtime.print_line(
        f"best after {best:,} steps: average precision {trained.curve.validation[best]:.1%} at sites set aside"
    )
    runtime.print_line(f"written to {options.output}/")


@dataclass(frozen=True)
class LearningSettings:
    """Settings of the training scans of each site.

    Parameters
    ----------
    sensors : tuple of str
        Catalogue keys of the types.
    placements : int
        Number of random placements for each run of traffic.
    every : float, seconds
        Time between frames.
    seed : int
        Seed of random placements, and of the noise of scans.
    field_conditions : bool
        Whether half of the frames are changed to be as recordings are (`field_conditions.field_frame`), with a rolling
        shutter, groups of pedestrians, and sizes changed by up to `SIZE_CHANGE` in half of the runs.
    """

    sensors: tuple[str, ...] = TYPES
    placements: int = 1
    every: float = 2.5
    seed: int = 1
    field_conditions: bool = False


def read_site(scene: Path, learning: LearningSettings) -> TrainingSite:
    """Read a scene with the runs of traffic next to it.

    Raises
    ------
    SeipError
        The scene cannot be read, or has no runs of traffic.
    """
    runtime.open_scene(scene)
    geometry = read_scene(bpy.context.scene).geometry
    survey_settings = SurveySettings(
        candidates=CandidateSettings(sensors=learning.sensors, heights=HEIGHTS, tilts=TILTS)
    )
    models = survey_settings.models()
    candidates = make_site(
        geometry,
        survey_settings.candidates,
        survey_settings.grid_spacing,
        survey_settings.reach(),
        fields_of_view(models),
    ).candidates
    runs = sampled_runs(survey.runs_beside(scene), geometry.origin, learning.every)
    if not runs:
        raise SeipError(f"{scene} has no runs of traffic in the folder next to it: simulate some with `seip traffic`")
    for run in runs:
        require_own_traffic(run.trajectories, geometry, run.name)
    simulator = Simulator(geometry, ScanSettings(seed=learning.seed, rolling_shutter=learning.field_conditions))
    return TrainingSite(f"{scene.parent.name}/{scene.stem}", geometry, candidates, models, runs, simulator)


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


def _sampled(
    site: TrainingSite, number: int, network: NetworkSettings, learning: LearningSettings
) -> Generator[Progress, None, list[SampledRecording]]:
    """Simulate scans of random placements in all runs of a site."""
    area = site.simulator.area(network.pillar)
    random = np.random.default_rng([learning.seed, number])
    if learning.field_conditions:
        site = replace(site, runs=(yield from field_runs(site.runs, random)))
        scans = site.field_scans(learning.placements, random, area, [learning.seed, number])
    else:
        scans = site.scans(learning.placements, random)
    recordings = [SampledRecording(one, area, network.most_points) for one in scans]
    yield from side_by_side([simulated([one]) for one in recordings], AT_ONCE)
    site.simulator.forget()
    return recordings


def _parser() -> argparse.ArgumentParser:
    parser = new_parser("study site-training", "Train a detector on random placements at several sites.")
    parser.add_argument(
        "scenes", nargs="+", type=Path, metavar="SCENE", help="scenes (.blend), each with its traffic next to it"
    )
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for the detector")
    learning = parser.add_argument_group("training data")
    default = LearningSettings()
    learning.add_argument(
        "--sensor",
        nargs="+",
        metavar="KEY",
        help="types in the placements (default: several, in field conditions all of the catalogue)",
    )
    learning.add_argument(
        "--placements",
        type=int,
        default=default.placements,
        metavar="N",
        help="random placements for each run of traffic",
    )
    learning.add_argument(
        "--every", type=real_number(TIME_STEP), default=default.every, metavar="S", help="time between frames, seconds"
    )
    learning.add_argument(
        "--field-conditions",
        action="store_true",
        help="change half of the frames to be as recordings are, and vary groups and sizes of road users",
    )
    learning.add_argument(
        "--seed", type=int, default=default.seed, metavar="N", help="seed for placements, noise, weights and order"
    )
    work = parser.add_argument_group("training")
    work.add_argument("--start", type=Path, metavar="PT", help="detector to start from (default: random weights)")
    add_settings(work, TrainingSettings, "steps", "batch", "learning_rate", "patience")
    work.add_argument("--device", default="cpu", help="device of torch: cpu, cuda")
    add_settings(work, TrainingSettings, "threads")
    return parser
