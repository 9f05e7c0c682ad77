"""Coverage of a placement under pose errors, jointly, per sensor and per kind of error.

In each draw all sensors have errors. The same draws give the effect of each sensor's own errors: its row of V with
errors is combined with the planned rows of the others (a first-order effect). Draws with a single kind of error, scaled
from the same standard ones, show which kind costs most.
"""

from collections.abc import Generator, Sequence
from dataclasses import dataclass, field

import numpy as np

from ...arrays import Boolean, Float
from ...estimates import IntervalEstimate, mean_of, quantile_of
from ...progress import Progress
from ...sensing.visibility.surroundings import Surroundings
from ...site.site import Site
from ..placement.deployment import Deployment
from ..placement.scenarios import ERROR_KINDS, PoseErrors
from .scenario_visibility import ScenarioVisibility
from .visibility_under_errors import draws_for, visibility_under_errors

QUANTILES = (0.05, 0.5, 0.95)

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
class Coverages:
    """Coverage of a placement in each of n draws.

    Parameters
    ----------
    whole : (n,) float64
        Share of all targets that is seen.
    central : (n,) float64 or None
        Share of the targets in weighted regions that is seen; None if there are none.
    """

    whole: Float
    central: Float | None


@dataclass(frozen=True, eq=False)
class PoseStudy:
    """Coverage of a placement under pose errors.

    Parameters
    ----------
    planned : Coverages
        Coverage of the poses as planned: n = 1.
    together : Coverages
        Coverage with errors of all sensors.
    alone : tuple of Coverages
        Coverage with errors of only one sensor, for each sensor, in the same draws.
    by_kind : dict of str to Coverages
        Coverage with a single kind of error, for each kind.
    blocked : float
        Share of the drawn poses that were inside an object and were moved out of it.
    """

    settings: PoseStudySettings
    labels: tuple[str, ...]
    planned: Coverages
    together: Coverages
    alone: tuple[Coverages, ...]
    by_kind: dict[str, Coverages]
    blocked: float

    def quantile(self, share: float) -> IntervalEstimate:
        """Estimate a quantile of the whole coverage."""
        return quantile_of(self.together.whole, share)

    def loss_by_sensor(self) -> tuple[IntervalEstimate, ...]:
        """Estimate the mean loss of coverage if only one sensor has errors, for each sensor."""
        return tuple(mean_of(self.planned.whole[0] - coverages.whole) for coverages in self.alone)

    def loss_by_kind(self) -> dict[str, IntervalEstimate]:
        """Estimate the mean loss of coverage from each kind of error by itself."""
        return {kind: mean_of(self.planned.whole[0] - each.whole) for kind, each in self.by_kind.items()}

    def worst_sensor(self) -> tuple[str, bool]:
        """Return the sensor whose errors cost most, and whether this is significant in the draws."""
        losses = self.loss_by_sensor()
        worst = max(range(len(losses)), key=lambda number: losses[number].value)
        behind = [
            self.alone[number].whole - self.alone[worst].whole for number in range(len(losses)) if number != worst
        ]
        return self.labels[worst], losses[worst].low > 0 and all(mean_of(difference).low > 0 for difference in behind)

    def is_converged(self) -> bool:
        """Return whether half of the draws give the same mean and quantiles, within their intervals."""
        whole = self.together.whole
        half = whole[: len(whole) // 2]
        pairs = [(mean_of(half), mean_of(whole)), *((quantile_of(half, q), quantile_of(whole, q)) for q in QUANTILES)]
        return all(one.agrees_with(other) for one, other in pairs)


def pose_study(
    around: Surroundings, deployment: Deployment, settings: PoseStudySettings
) -> Generator[Progress, None, PoseStudy]:
    """Compute the coverage of a placement under draws of pose errors.

    Parameters
    ----------
    deployment : Deployment
        Placement at candidate poses of the site.
    """
    site = around.site
    poses = np.array([sensor.pose for sensor in deployment.sensors if sensor.pose is not None], dtype=np.int64)

    def views(errors: PoseErrors, draws: int) -> Generator[Progress, None, tuple[ScenarioVisibility, Boolean]]:
        drawn, blocked = draws_for(around, poses, errors, draws, settings.seed)
        seen = yield from visibility_under_errors(around, poses, drawn)
        return seen, blocked

    as_planned, _ = yield from views(PoseErrors(0.0, 0.0, 0.0, 0.0), 1)
    planned = as_planned.seen(0)
    together, blocked = yield from views(settings.errors, settings.draws)
    by_kind = {}
    for kind in ERROR_KINDS:
        if settings.draws_of_kind and getattr(settings.errors, kind) > 0:
            of_kind, _ = yield from views(settings.errors.alone(kind), settings.draws_of_kind)
            by_kind[kind] = _coverages(site, [of_kind.seen(draw) for draw in range(len(of_kind))])
    return PoseStudy(
        settings=settings,
        labels=tuple(sensor.label for sensor in deployment.sensors),
        planned=_coverages(site, [planned]),
        together=_coverages(site, [together.seen(draw) for draw in range(len(together))]),
        alone=tuple(_one_errs(site, planned, together, number) for number in range(len(poses))),
        by_kind=by_kind,
        blocked=float(blocked.mean()),
    )


def _coverages(site: Site, views: Sequence[Boolean]) -> Coverages:
    """Return the joint coverage of rows of V in each draw."""
    seen = np.array([rows.any(axis=0) for rows in views])
    central = site.targets.central
    return Coverages(seen.mean(axis=1), seen[:, central].mean(axis=1) if central.any() else None)


def _one_errs(site: Site, planned: Boolean, together: ScenarioVisibility, number: int) -> Coverages:
    others = np.delete(planned, number, axis=0).any(axis=0)
    return _coverages(site, [np.stack([others, row]) for row in together.seen_by_pose(number)])


def pose_warnings(study: PoseStudy) -> tuple[str, ...]:
    """Return a warning if pose errors cost a placement much of its coverage."""
    lost = study.planned.whole[0] - study.quantile(QUANTILES[0]).value
    return (pose_message(study),) if lost >= NOTABLE_LOSS else ()


def pose_message(study: PoseStudy) -> str:
    """Return a message on the 5 % quantile of a placement's coverage and the sensor whose errors cost most."""
    errors, low = study.settings.errors, study.quantile(QUANTILES[0])
    lost = max(study.planned.whole[0] - low.value, 0.0)
    worst, certain = study.worst_sensor()
    which = f"{worst}'s error costs most" if certain else "no sensor's error stands out"
    return (
        f"with errors of {errors.position:g} m and {np.degrees(errors.tilt):.3g}° of tilt (standard deviations) the "
        f"placement covers less than {low.value:.1%} in one of twenty cases, {lost:.1%} less than planned; {which}"
    )
