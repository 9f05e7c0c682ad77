"""What agrees with average precision, how well anything could, and what is said of it, on placements that are told."""

from dataclasses import dataclass, field

from headless.studies.criteria import agreement
from headless.studies.criteria.criteria import Criterion

import numpy as np
import pytest
import scipy.stats

PLACEMENTS, RUNS, TRAININGS, RESAMPLES = 40, 8, 2, 200


@dataclass
class Told:
    """Precisions of placements of known quality, with an error for each run and for each training."""

    quality: np.ndarray
    run_error: float
    training_error: float
    seed: int = 0
    has_intervals: bool = True
    trainings: int = TRAININGS
    by_training: np.ndarray = field(init=False)

    def __post_init__(self):
        rng = np.random.default_rng(self.seed)
        number = len(self.quality)
        runs = self.quality + self.run_error * rng.normal(size=(RUNS, number))
        trained = self.training_error * rng.normal(size=(self.trainings, number))
        self.by_training = trained + runs.mean(axis=0)
        self.values = self.by_training.mean(axis=0)
        half = RUNS // 2
        self.halves = trained.mean(axis=0) + np.array([[runs[:half].mean(axis=0), runs[half:].mean(axis=0)]])
        drawn = rng.integers(RUNS, size=(RESAMPLES, RUNS))
        self.resampled = (trained.mean(axis=0) + runs[drawn].mean(axis=1)).T

    def interval(self, placement):
        return tuple(np.quantile(self.resampled[placement], (0.025, 0.975)))


def spread(seed=1):
    return np.random.default_rng(seed).uniform(0.3, 0.9, PLACEMENTS)


@pytest.mark.parametrize(("run_error", "training_error"), [(0.3, 0.05), (0.1, 0.1), (0.4, 0.0)])
def test_the_ceiling_is_what_the_true_quality_reaches(run_error, training_error):
    """The oracle knows the quality without error; the ceiling knows measurements alone."""
    reached, ceilings = [], []
    for seed in range(40):
        told = Told(spread(seed), run_error, training_error, seed)
        reached.append(scipy.stats.spearmanr(told.quality, told.values).statistic)
        ceilings.append(agreement.noise_ceiling(told).ceiling.value)
    assert np.mean(ceilings) == pytest.approx(np.mean(reached), abs=0.03)


def test_intervals_hold_what_they_should():
    """Of a criterion whose correlation with what is measured is known from many placements."""
    rng = np.random.default_rng(5)
    many = rng.uniform(0.3, 0.9, 20_000)
    true = scipy.stats.spearmanr(many + rng.normal(0, 0.1, len(many)), Told(many, 0.2, 0.03).values).statistic
    held = []
    for seed in range(40):
        quality = spread(seed)
        criterion = Criterion("one", "one", quality + np.random.default_rng(seed + 99).normal(0, 0.1, PLACEMENTS))
        found = agreement.correlate(criterion, Told(quality, 0.2, 0.03, seed)).spearman
        assert -1 <= found.low <= found.value <= found.high <= 1
        held.append(found.low <= true <= found.high)
    assert np.mean(held) >= 0.88


def test_a_criterion_is_paired_with_coverage():
    told = Told(spread(), 0.05, 0.0)
    coverage = Criterion("coverage", "coverage", told.quality + np.random.default_rng(2).normal(0, 0.15, PLACEMENTS))
    same, true = Criterion("same", "same", 2 * coverage.values), Criterion("true", "true", told.quality)
    first, alike, better = agreement.assess((coverage, same, true), told)
    assert (first.difference.value, first.gain.value) == (0, 0)
    assert (alike.difference.low, alike.difference.high) == (0, 0)
    assert 0 < better.difference.low < better.difference.value < better.difference.high
    alone = better.correlation.spearman
    assert better.difference.high - better.difference.low < alone.high - first.correlation.spearman.low
    best, liked = np.argmax(told.quality), np.argmax(coverage.values)
    assert better.gain.value == pytest.approx(told.values[best] - told.values[liked])
    assert better.gain.low <= better.gain.value <= better.gain.high
