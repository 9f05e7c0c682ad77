"""Trainings with all ingredients and without each; variants with the same scan ingredients share their scans."""

from __future__ import annotations

import functools
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from headless.detection.detector import Detector
from headless.detection.frames import LazyFrames, Recording, SampledRecording
from headless.detection.run_detection import AT_ONCE
from headless.detection.settings import NetworkSettings, TrainingSettings
from headless.detection.training import TrainedDetector, deterministic, train
from headless.side_by_side import side_by_side
from headless.studies.coverage.cells import Cell, solve_cell
from headless.studies.detection.sensor_configuration import SensorConfiguration
from headless.studies.simulated_recordings import recorded
from headless.studies.site_training.training_site import TrainingSite

import numpy as np

from seip_addon.core.progress import Progress, finish
from seip_addon.core.site.candidates import CandidateSettings
from seip_addon.core.site.scene_geometry import SceneGeometry
from seip_addon.core.workflows.survey import lay_out, see
from seip_addon.core.workflows.survey_settings import SurveySettings

from .variants import FEW_SITES, Ingredients, ScanIngredients, with_bodies

SENSOR, COUNT = "type2", 4  # of the placement that covers most

Scans = list[tuple[TrainingSite, Recording]]
"""Recordings, each with the site where it was made."""


@dataclass(frozen=True, eq=False)
class TrainingSites:
    """Training sites, and validation sites, which decide when to stop.

    Parameters
    ----------
    training, validation : tuple of TrainingSite
        Training sites and validation sites.
    store : path
        Folder of visibility grids and trainings.
    seed : int
        Seed of random placements.
    """

    training: tuple[TrainingSite, ...]
    validation: tuple[TrainingSite, ...]
    store: Path
    seed: int

    def scans(self, ingredients: ScanIngredients) -> Generator[Progress, None, Scans]:
        """Return the training scans."""
        sites = self.training if ingredients.many_sites else self.training[:FEW_SITES]
        scans: Scans = []
        for number, site in enumerate(sites):
            yield Progress(number, len(sites), f"draw scans of {site.name}")
            runs = tuple(finish(with_bodies(run, ingredients, self.seed)) for run in site.runs)
            if ingredients.random_placements:
                recordings = replace(site, runs=runs).scans(len(self.training) // len(sites), self._random(number))
            else:
                placement = yield from covering_most(site.geometry, self.store / f"visibility-{number}.npz")
                recordings = [recorded(site.simulator, placement, run) for run in runs]
            scans += [(site, recording) for recording in recordings]
        return scans

    def validation_scans(self) -> Scans:
        """Return the validation scans, the same for all variants."""
        return [
            (site, recording)
            for number, site in enumerate(self.validation, len(self.training))
            for recording in site.scans(1, self._random(number))
        ]

    def _random(self, site: int) -> np.random.Generator:
        return np.random.default_rng([self.seed, site])


def covering_most(geometry: SceneGeometry, path: Path) -> Generator[Progress, None, SensorConfiguration]:
    """Place `COUNT` sensors of type `SENSOR` for the largest coverage; the visibility grid is cached in a file."""
    settings = SurveySettings(candidates=CandidateSettings(sensors=(SENSOR,)))
    survey = yield from see(lay_out(geometry, settings), path)
    cell = Cell(SENSOR, None, COUNT, 1.0)
    case = yield from solve_cell(survey.site, survey.models, survey.grid.visible, cell, survey.settings.limits)
    return SensorConfiguration.of_case(case)


def train_variants(
    sites: TrainingSites,
    variants: Mapping[str, Ingredients],
    network: NetworkSettings,
    training: TrainingSettings,
    trainings: int,
) -> Generator[Progress, None, dict[str, list[Detector]]]:
    """Train a detector of each variant with each of `trainings` seeds; finished trainings are read from the store.

    Returns
    -------
    dict of str to list of Detector
        Detectors by the name of the variant, in the order of the seeds.
    """
    samples: dict[str, list[SampledRecording]] = {}
    validation = yield from _sampled(sites.validation_scans(), variants, network)
    for scans in dict.fromkeys(one.scans for one in variants.values()):
        sharing = {name: one for name, one in variants.items() if one.scans == scans}
        samples |= yield from _sampled((yield from sites.scans(scans)), sharing, network)
    works = {
        (name, seed): train(
            samples[name],
            validation[name],
            network,
            replace(training, seed=seed),
            store=sites.store / f"{name.replace(' ', '-')}-{seed}.pt",
        )
        for seed in range(1, trainings + 1)
        for name in variants
    }
    with deterministic(training.threads):
        trained = yield from side_by_side(list(works.values()), AT_ONCE)
    return {name: list(_of_variant(name, zip(works, trained, strict=True))) for name in variants}


def _of_variant(name: str, trained: Iterator[tuple[tuple[str, int], TrainedDetector]]) -> Iterator[Detector]:
    return (one.detector for (variant, _), one in trained if variant == name)


def _sampled(
    scans: Scans, variants: Mapping[str, Ingredients], network: NetworkSettings
) -> Generator[Progress, None, dict[str, list[SampledRecording]]]:
    """Simulate each frame once, and store the training sample of each variant."""
    sampled: list[dict[str, SampledRecording]] = []
    works: dict[TrainingSite, list[Generator[Progress, None, None]]] = {}
    for site, recording in scans:
        area, latest = site.simulator.area(network.pillar), functools.lru_cache(1)(recording.frames.__getitem__)
        cached = replace(recording, frames=LazyFrames(len(recording.frames), latest))
        by_variant = {
            name: SampledRecording(cached, one.area(area), network.most_points) for name, one in variants.items()
        }
        sampled.append(by_variant)
        works.setdefault(site, []).append(_simulated(list(by_variant.values()), latest.cache_clear))
    for site, of_site in works.items():
        yield from side_by_side(of_site, AT_ONCE)
        site.simulator.forget()
    return {name: [of_one[name] for of_one in sampled] for name in variants}


def _simulated(samples: Sequence[SampledRecording], forget: Callable[[], None]) -> Generator[Progress, None, None]:
    total = len(samples[0])
    for number in range(total):
        yield Progress(number, total, f"simulate {samples[0].recording.name}")
        for one in samples:
            one.get(number)
    forget()
