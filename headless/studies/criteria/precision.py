"""Average precision of one detector with each of several placements, on the same test runs."""

from dataclasses import dataclass
from functools import cached_property

from headless.detection.average_precision import (
    Evaluation,
    average_precision_interval,
    average_precisions_of_runs,
)

import numpy as np

from seip_addon.core.base.arrays import Float, Text
from seip_addon.core.base.estimates import RESAMPLES

TRAFFIC_SEED, TRAINING_SEED, PLACEMENT_SEED = 0, 1, 2  # of resamples: draws of one must not follow from another's
RESAMPLES_AT_ONCE = 100  # the number that needs a few hundred megabytes
FOLDER = "detections"  # of the folder of results: what was detected with each placement


@dataclass(frozen=True, eq=False)
class Precisions:
    """Evaluations of n placements by t trainings on the same frames.

    Parameters
    ----------
    runs : (f,) str
        Name of the run of each frame.
    evaluations : tuple of tuple of Evaluation
        Average precision of each placement by each training.
    """

    runs: Text
    evaluations: tuple[tuple[Evaluation, ...], ...]

    @property
    def trainings(self) -> int:
        """Number of trainings."""
        return len(self.evaluations[0])

    @cached_property
    def by_training(self) -> Float:
        """Average precision, (t, n)."""
        return np.array([[one.average_precision for one in own] for own in self.evaluations]).T

    @property
    def values(self) -> Float:
        """Average precision of each placement, the mean over the trainings, (n,)."""
        mean: Float = self.by_training.mean(axis=0)
        return mean

    @cached_property
    def resampled(self) -> Float:
        """Average precision in resamples of the test runs and of the trainings, (n, r).

        A resample draws the same runs and the same trainings for all placements.
        """
        runs = int(self.evaluations[0][0].run.max()) + 1
        drawn = np.random.default_rng(TRAFFIC_SEED).multinomial(runs, np.full(runs, 1 / runs), RESAMPLES)
        parts = np.split(drawn, range(RESAMPLES_AT_ONCE, RESAMPLES, RESAMPLES_AT_ONCE))
        trainings = self.trainings
        times = np.random.default_rng(TRAINING_SEED).multinomial(
            trainings, np.full(trainings, 1 / trainings), RESAMPLES
        )
        return np.array(
            [
                sum(
                    times[:, number]
                    / trainings
                    * np.concatenate([average_precisions_of_runs(one, some) for some in parts])
                    for number, one in enumerate(own)
                )
                for own in self.evaluations
            ]
        )

    @cached_property
    def has_intervals(self) -> bool:
        """Whether there is enough test traffic for intervals."""
        return average_precision_interval(self.evaluations[0][0]) is not None
