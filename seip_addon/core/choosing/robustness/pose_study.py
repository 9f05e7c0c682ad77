"""Coverage of a placement under pose errors, jointly, per sensor and per kind of error.

In each draw all sensors have errors. The same draws give the effect of each sensor's own errors: its row of V with
errors is combined with the planned rows of the others (a first-order effect). Draws with a single kind of error, scaled
from the same standard ones, show which kind costs most.
"""

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np

from ...base.arrays import Float
from ...base.estimates import IntervalEstimate, mean_of, quantile_of
from ...base.progress import Progress
from ...sensing.scenarios.pose_errors import ERROR_KINDS, PoseErrors
from ...sensing.scenarios.scenario_visibility import visibility_under_errors
from ...sensing.visibility.surroundings import Surroundings
from ..placement.deployment import Deployment

LOW_QUANTILE = 0.05  # quantile of coverage that is reported, and by which placements are compared

NOTABLE_LOSS = 0.01  # share of the targets whose loss is worth a warning: in one of twenty draws, or in traffic


@dataclass(frozen=True, eq=False)
class PoseStudy:
    """Coverage of a placement under pose errors, as a share of all targets.

    Parameters
    ----------
    planned : float
        Coverage of the poses as planned.
    together : (n,) float64
        Coverage in each of n draws with errors of all sensors.
    alone : tuple of (n,) float64
        Coverage with errors of only one sensor, for each sensor, in the same draws.
    by_kind : dict of str to (m,) float64
        Coverage in each of m draws with a single kind of error, for each kind.
    """

    errors: PoseErrors
    labels: tuple[str, ...]
    planned: float
    together: Float
    alone: tuple[Float, ...]
    by_kind: dict[str, Float]

    @property
    def low(self) -> IntervalEstimate:
        """5 % quantile of the coverage."""
        return quantile_of(self.together, LOW_QUANTILE)

    def loss_by_sensor(self) -> tuple[IntervalEstimate, ...]:
        """Estimate the mean loss of coverage if only one sensor has errors, for each sensor."""
        return tuple(mean_of(self.planned - coverage) for coverage in self.alone)

    def loss_by_kind(self) -> dict[str, IntervalEstimate]:
        """Estimate the mean loss of coverage from each kind of error by itself."""
        return {kind: mean_of(self.planned - coverage) for kind, coverage in self.by_kind.items()}

    def worst_sensor(self) -> tuple[str, bool]:
        """Return the sensor whose errors cost most, and whether this is significant in the draws."""
        losses = self.loss_by_sensor()
        worst = max(range(len(losses)), key=lambda number: losses[number].value)
        behind = [self.alone[number] - self.alone[worst] for number in range(len(losses)) if number != worst]
        return self.labels[worst], losses[worst].low > 0 and all(mean_of(difference).low > 0 for difference in behind)

    def warnings(self) -> tuple[str, ...]:
        """Return a warning if pose errors cost the placement much of its coverage."""
        return (self.message(),) if self.planned - self.low.value >= NOTABLE_LOSS else ()

    def message(self) -> str:
        """Return a message on the 5 % quantile of the coverage and the sensor whose errors cost most."""
        errors, low = self.errors, self.low
        lost = max(self.planned - low.value, 0.0)
        worst, certain = self.worst_sensor()
        which = f"{worst}'s error costs most" if certain else "no sensor's error stands out"
        return (
            f"with errors of {errors.position:g} m and {np.degrees(errors.tilt):.3g}° of tilt (standard deviations) "
            f"the placement covers less than {low.value:.1%} in one of twenty cases, {lost:.1%} less than planned; "
            f"{which}"
        )


def pose_study(
    around: Surroundings, deployment: Deployment, errors: PoseErrors, seed: int, draws: tuple[int, int]
) -> Generator[Progress, None, PoseStudy]:
    """Compute the coverage of a placement under draws of pose errors.

    Parameters
    ----------
    deployment : Deployment
        Placement at candidate poses of the site.
    draws : (int, int)
        Number of draws with all kinds of errors, and with each single kind; 0 to leave the latter out.
    """
    poses = np.array([sensor.pose for sensor in deployment.sensors], dtype=np.int64)
    every, planned = np.arange(len(poses)), deployment.rows

    together = yield from visibility_under_errors(around, poses, errors, draws[0], seed)
    by_kind = {}
    for kind in ERROR_KINDS:
        if draws[1] and getattr(errors, kind) > 0:
            of_kind = yield from visibility_under_errors(around, poses, errors.alone(kind), draws[1], seed)
            by_kind[kind] = of_kind.seen_by_any(every).mean(axis=1)
    return PoseStudy(
        errors=errors,
        labels=tuple(sensor.label for sensor in deployment.sensors),
        planned=deployment.coverage,
        together=together.seen_by_any(every).mean(axis=1),
        alone=tuple(
            (np.delete(planned, one, axis=0).any(axis=0) | together.seen_by_any(every[[one]])).mean(axis=1)
            for one in every
        ),
        by_kind=by_kind,
    )
