"""Coverage of a placement under pose errors, jointly, per sensor and per kind of error.

In each draw all sensors have errors. The same draws give the effect of each sensor's own errors: its row of V with
errors is combined with the planned rows of the others (a first-order effect). Draws with a single kind of error, scaled
from the same standard ones, show which kind costs most.
"""

from collections.abc import Generator
from dataclasses import dataclass, field

import numpy as np

from ...arrays import Float
from ...estimates import IntervalEstimate, mean_of, quantile_of
from ...progress import Progress
from ...sensing.scenarios.pose_errors import ERROR_KINDS, PoseErrors
from ...sensing.scenarios.scenario_visibility import ScenarioVisibility
from ...sensing.scenarios.visibility_under_errors import draws_for, visibility_under_errors
from ...sensing.visibility.surroundings import Surroundings
from ..placement.deployment import Deployment

LOW_QUANTILE = 0.05  # quantile of coverage that is reported, and by which placements are compared

NOTABLE_LOSS = 0.01  # share of the targets whose loss, in one of twenty draws, is worth a warning


@dataclass(frozen=True)
class PoseStudySettings:
    """Settings of a study of pose errors.

    Parameters
    ----------
    errors : PoseErrors
        Standard deviations of the errors.
    draws : int
        Number of draws with all kinds of errors.
    draws_of_kind : int
        Number of draws with each single kind of error; 0 to leave these out.
    seed : int
        Seed of the draws.
    """

    errors: PoseErrors = field(default_factory=PoseErrors)
    draws: int = 500
    draws_of_kind: int = 100
    seed: int = 0


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

    settings: PoseStudySettings
    labels: tuple[str, ...]
    planned: float
    together: Float
    alone: tuple[Float, ...]
    by_kind: dict[str, Float]

    def quantile(self, share: float) -> IntervalEstimate:
        """Estimate a quantile of the coverage."""
        return quantile_of(self.together, share)

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


def pose_study(
    around: Surroundings, deployment: Deployment, settings: PoseStudySettings
) -> Generator[Progress, None, PoseStudy]:
    """Compute the coverage of a placement under draws of pose errors.

    Parameters
    ----------
    deployment : Deployment
        Placement at candidate poses of the site.
    """
    poses = np.array([sensor.pose for sensor in deployment.sensors if sensor.pose is not None], dtype=np.int64)
    every = np.arange(len(poses))

    def views(errors: PoseErrors, draws: int) -> Generator[Progress, None, ScenarioVisibility]:
        drawn = draws_for(around, poses, errors, draws, settings.seed)
        return (yield from visibility_under_errors(around, poses, drawn))

    planned = (yield from views(PoseErrors(0.0, 0.0, 0.0, 0.0), 1)).seen(0)
    together = yield from views(settings.errors, settings.draws)
    by_kind = {}
    for kind in ERROR_KINDS:
        if settings.draws_of_kind and getattr(settings.errors, kind) > 0:
            of_kind = yield from views(settings.errors.alone(kind), settings.draws_of_kind)
            by_kind[kind] = of_kind.seen_by_any(every).mean(axis=1)
    return PoseStudy(
        settings=settings,
        labels=tuple(sensor.label for sensor in deployment.sensors),
        planned=float(planned.any(axis=0).mean()),
        together=together.seen_by_any(every).mean(axis=1),
        alone=tuple(
            (np.delete(planned, number, axis=0).any(axis=0) | together.seen_by_pose(number)).mean(axis=1)
            for number in every
        ),
        by_kind=by_kind,
    )


def pose_warnings(study: PoseStudy) -> tuple[str, ...]:
    """Return a warning if pose errors cost a placement much of its coverage."""
    lost = study.planned - study.quantile(LOW_QUANTILE).value
    return (pose_message(study),) if lost >= NOTABLE_LOSS else ()


def pose_message(study: PoseStudy) -> str:
    """Return a message on the 5 % quantile of a placement's coverage and the sensor whose errors cost most."""
    errors, low = study.settings.errors, study.quantile(LOW_QUANTILE)
    lost = max(study.planned - low.value, 0.0)
    worst, certain = study.worst_sensor()
    which = f"{worst}'s error costs most" if certain else "no sensor's error stands out"
    return (
        f"with errors of {errors.position:g} m and {np.degrees(errors.tilt):.3g}° of tilt (standard deviations) the "
        f"placement covers less than {low.value:.1%} in one of twenty cases, {lost:.1%} less than planned; {which}"
    )
