"""Rank correlation of criteria with average precision, on placements of known quality."""

from dataclasses import dataclass, field

from headless.studies.criteria import agreement

import numpy as np
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
        drawn = rng.integers(RUNS, size=(RESAMPLES, RUNS))
        self.resampled = (trained.mean(axis=0) + runs[drawn].mean(axis=1)).T


def spread(seed=1):
    return np.random.default_rng(seed).uniform(0.3, 0.9, PLACEMENTS)


def test_intervals_hold_what_they_should():
    """Of a criterion whose correlation with what is measured is known from many placements."""
    rng = np.random.default_rng(5)
    many = rng.uniform(0.3, 0.9, 20_000)
    true = scipy.stats.spearmanr(many + rng.normal(0, 0.1, len(many)), Told(many, 0.2, 0.03).values).statistic
    held = []
    for seed in range(40):
        quality = spread(seed)
        values = quality + np.random.default_rng(seed + 99).normal(0, 0.1, PLACEMENTS)
        found = agreement.correlate(values, Told(quality, 0.2, 0.03, seed))
        assert -1 <= found.low <= found.value <= found.high <= 1
        held.append(found.low <= true <= found.high)
    assert np.mean(held) >= 0.88
