"""What a placement for the empty road holds in traffic, and what placing on traffic wins back.

Placements are chosen at some instants of traffic and judged at others, of other runs. What is judged is a share of
time: of each target, and of the targets' weight. Instants near in time see the same queues, so that intervals come of
stretches of time (`mean_over_time`).
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, field

import numpy as np

from ..arrays import Boolean, Float, Integer
from ..placement import Placement, PlacementProblem, solve
from ..progress import Progress
from .disturbed_views import Surroundings
from .estimates import Estimate, mean_over_time
from .risk import Risk
from .robust_placement import solve_robust
from .rows import Row
from .traffic_instants import NOBODY, Instants
from .traffic_views import HEIGHT, traffic_views
from .views import Views

NOTABLE = 0.01
"""Share of the targets' weight whose loss in traffic a user should know of."""

MOSTLY = 0.9
"""Share of time from which on a target counts as mostly seen."""


@dataclass(frozen=True)
class TrafficSettings:
    """How placements in traffic are chosen.

    Parameters
    ----------
    solver : str
    time_limit : float, seconds
        For each placement.
    risk : Risk
        What of the instants is to be large: the expectation, their worst tail, …
    """

    solver: str = "highs"
    time_limit: float = 60.0
    risk: Risk = field(default_factory=Risk)


@dataclass(frozen=True, eq=False)
class Seen:
    """What a placement sees on the empty road and at n instants of traffic.

    Parameters
    ----------
    empty : float
        Share of the targets' weight on the empty road.
    at : (n,) float64
        The same share at each instant.
    empty_targets : (t,) bool
        Which targets on the empty road.
    time : (t,) float64
        Share of the instants at which each target is seen.
    """

    empty: float
    at: Float
    empty_targets: Boolean
    time: Float

    @property
    def rarely(self) -> float:
        """Of the targets seen on the empty road, the share that is seen less than `MOSTLY` of the time."""
        return float((self.time[self.empty_targets] < MOSTLY).mean()) if self.empty_targets.any() else 0.0


@dataclass(frozen=True, eq=False)
class InTraffic:
    """A placement and what becomes of it in traffic that it was not chosen on.

    Parameters
    ----------
    name : str
        What it was chosen for.
    placement : Placement
    road : Seen
        The targets themselves.
    height : Seen
        The points `HEIGHT` above them.
    stretch : (n,) int64
        Of the instants.
    """

    name: str
    placement: Placement
    road: Seen
    height: Seen
    stretch: Integer

    def held(self) -> Estimate:
        """Estimate the share of the targets' weight that is seen, on average over time."""
        return mean_over_time(self.road.at, self.stretch)

    def lost(self) -> Estimate:
        """Estimate how much less that is than on the empty road."""
        return mean_over_time(self.road.empty - self.road.at, self.stretch)

    def held_above(self) -> Estimate:
        """Estimate the share of the points above the targets that is seen, by weight, on average over time."""
        return mean_over_time(self.height.at, self.stretch)

    def lost_above(self) -> Estimate:
        """Estimate how much less that is than on the empty road."""
        return mean_over_time(self.height.empty - self.height.at, self.stretch)


@dataclass(frozen=True, eq=False)
class TrafficStudy:
    """The optimum of the empty road beside the placement chosen on traffic.

    Parameters
    ----------
    chosen_at : int
        Instants of traffic that one of the two was chosen on.
    road_users : float
        On the road at an instant that is judged, on average.
    empty : InTraffic
        Chosen for the empty road.
    traffic : InTraffic
        Chosen on traffic.
    """

    chosen_at: int
    road_users: float
    empty: InTraffic
    traffic: InTraffic

    def won(self) -> Estimate:
        """Estimate how much more of the targets' weight the placement chosen on traffic sees in traffic."""
        return mean_over_time(self.traffic.road.at - self.empty.road.at, self.empty.stretch)

    def won_above(self) -> Estimate:
        """Estimate the same of the points above the targets."""
        return mean_over_time(self.traffic.height.at - self.empty.height.at, self.empty.stretch)

    def is_converged(self) -> bool:
        """Whether every other instant says the same as all: means whose intervals meet."""
        halved = slice(None, None, 2)
        pairs = [
            (mean_over_time(values[halved], self.empty.stretch[halved]), mean_over_time(values, self.empty.stretch))
            for values in (
                self.empty.road.at,
                self.traffic.road.at,
                self.empty.height.at,
                self.traffic.road.at - self.empty.road.at,
            )
        ]
        return all(half.agrees_with(whole) for half, whole in pairs)


def views_to_choose_on(
    around: Surroundings, problem: PlacementProblem, instants: Instants
) -> Generator[Progress, None, Views]:
    """Look from all candidates that may be chosen at instants of traffic; the others see nothing."""
    every = np.flatnonzero(problem.allowed)
    views = yield from traffic_views(around, every, instants.standing())
    return views.spread_to(every, len(problem.visible))


def traffic_study(
    around: Surroundings, problem: PlacementProblem, scenarios: Views, judged: Instants, settings: TrafficSettings
) -> Generator[Progress, None, TrafficStudy]:
    """Place for the empty road and on traffic, and judge both at other instants.

    Parameters
    ----------
    around : Surroundings
    problem : PlacementProblem
        Of all candidates of the site, on the empty road.
    scenarios : Views
        See `views_to_choose_on`.
    judged : Instants
        Of runs that are not those of the scenarios.
    settings : TrafficSettings

    Yields
    ------
    Progress

    Returns
    -------
    TrafficStudy
    """
    empty = yield from solve(problem, solver=settings.solver, time_limit=settings.time_limit)
    found = yield from solve_robust(
        problem, scenarios, settings.risk, solver=settings.solver, time_limit=settings.time_limit
    )
    placements = [("the empty road", empty), (f"{settings.risk.in_words()} in traffic", found.placement)]
    used = np.unique(np.concatenate([placement.chosen for _, placement in placements]))
    crowds = judged.standing()
    road = yield from traffic_views(around, used, [NOBODY, *crowds])
    height = yield from traffic_views(around, used, [NOBODY, *crowds], "height")
    one, other = (
        InTraffic(
            name,
            placement,
            _seen(road, np.searchsorted(used, placement.chosen), problem.weights),
            _seen(height, np.searchsorted(used, placement.chosen), problem.weights),
            judged.stretch,
        )
        for name, placement in placements
    )
    return TrafficStudy(len(scenarios), float(np.mean([len(crowd.hulls) for crowd in crowds])), one, other)


def _seen(views: Views, rows: Integer, weight: Float) -> Seen:
    """Return what some poses see together; the first of the views is of the empty road."""
    seen = views.seen_by_any(rows)
    share = seen @ weight / weight.sum()
    return Seen(float(share[0]), share[1:], seen[0], seen[1:].mean(axis=0))


def traffic_warnings(study: TrafficStudy) -> tuple[str, ...]:
    """Say where a placement for the empty road does not hold in traffic what it promises, in a sentence."""
    lost = study.empty.lost()
    if lost.value < NOTABLE:
        return ()
    sentence = (
        f"in traffic ({study.road_users:.0f} road users at a time) the placement for the empty road sees "
        f"{study.empty.held().value:.1%} on average over time, not {study.empty.road.empty:.1%}: "
        f"vehicles hide {lost.value:.1%}"
    )
    return (sentence,)


def traffic_rows(study: TrafficStudy) -> tuple[Row, ...]:
    """Return what the study says as rows of the page of stability."""
    empty, traffic = study.empty, study.traffic
    regime = f"{study.road_users:.0f} road users at a time"
    instants, stretches = len(empty.stretch), len(np.unique(empty.stretch))
    how = (
        f"{instants} instants in {stretches} stretches of time, of runs that nothing was chosen on; every other one "
        f"{'says the same' if study.is_converged() else 'says something else: take more'}"
    )
    return (
        Row(
            "coverage of a placement",
            regime,
            f"the empty road promises {empty.road.empty:.2%}, traffic leaves {empty.held().in_words()} of the time; "
            f"{empty.road.rarely:.1%} of the targets that count as seen are seen less than {MOSTLY:.0%} of the time",
            how,
            f"a warning where vehicles hide {NOTABLE:.0%} or more, and a map of the share of time",
        ),
        Row(
            f"coverage {HEIGHT:g} m above the road",
            regime,
            f"the empty road promises {empty.height.empty:.2%}, traffic leaves {empty.held_above().in_words()}; "
            f"{empty.height.rarely:.1%} of the points that count as seen are seen less than {MOSTLY:.0%} of the time",
            how,
            "the same map for points above the road",
        ),
        Row(
            "placement for the empty road",
            regime,
            f"placing on traffic holds {traffic.held().in_words()}, {study.won().in_words()} more, and "
            f"{study.won_above().in_words()} more {HEIGHT:g} m above the road",
            f"chosen on {study.chosen_at} instants; {how}",
            f"placement over instants of traffic, certificate: within {traffic.placement.gap:.2%} of the best possible",
        ),
    )
