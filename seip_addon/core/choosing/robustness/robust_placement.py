r"""Robust placement over scenarios of pose errors, sensor failures or traffic.

With K scenarios of pose errors, V of each known for every candidate,

.. math::
    \max_{x \in X} \; \min_{p \in P} \sum_k p_k \sum_j w_j\, y_{jk}
    \quad\text{subject to}\quad
    y_{jk} \le \sum_i V_{ijk} x_i, \quad y_{jk} \in \{0, 1\},

where X are the placements of the problem (number, budget, one sensor per position, mandatory and forbidden positions,
least distance) and P is defined in `risk`. The expectation is the maximal covering location problem of K × t targets.
Any p in P gives an upper bound,

.. math::
    \max_{x \in X} T(x) \le \max_{x \in X} F_p(x),

With p = 1/K it is the largest expectation. A p with a small bound is found by fictitious play (Brown 1951): each
placement maximises the mean of the scenarios that were worst for the placements before. Branch and bound on F_p then
proves the best T (`BestUnderRisk`), if it ends within the limits. A second bound assumes that each scenario is known
beforehand (Madansky 1960), and takes K problems of t targets:

.. math::
    \max_{x \in X} T(x) \le \min_{p \in P} \sum_k p_k \max_{x \in X} f_k(x),

the mean of the m smallest of the K largest coverages.
"""

import math
from collections.abc import Callable, Generator, Sequence
from dataclasses import replace

import numpy as np

from ...arrays import Float, Integer
from ...progress import Progress, within
from ...sensing.scenarios.scenario_visibility import ScenarioVisibility
from ..placement.bounds import Bound, lagrangian_bound
from ..placement.branch_and_bound import FIRST_STEPS, Search
from ..placement.feasibility import starting_choice
from ..placement.greedy import swap_search
from ..placement.problem import TIE_TOLERANCE, Placement, PlacementProblem, assess, relative_gap
from ..placement.reduced_problem import WHOLE_SLACK, Instance, common_unit, make_instance, merge_targets
from ..placement.risk import Risk
from ..placement.search_limits import DEFAULT_LIMITS, Clock, SolverLimits
from ..placement.solver import solve, solve_within


class BestUnderRisk(Search):
    r"""Search for the placement of largest T.

    The targets of all scenarios are those of the instance, whose value is, in whole units, with φ the value of a target
    by the number n of sensors that see it,

    .. math::
        F(S) = \sum_k p_k \sum_j w_j\, φ(n_{jk}(S)) \ge T(S).

    Branches in which F cannot reach the best T so far are cut, and T is computed for every set that is left.

    Parameters
    ----------
    unit : float
        Unit of F: F divided by it bounds T.
    evaluate : callable
        Function that returns T of candidates of the instance.
    chosen : (k,) int64
        Placement to begin from.
    slack : float
        Largest difference between equal values of T.
    root : (n,) int64 and Bound
        Candidates that a placement as good as ``chosen`` may contain, and an upper bound on the F of placements of
        these.

    Attributes
    ----------
    best : (k,) int64
        Best placement so far.
    value : float
        T of the best placement so far. Of equally good ones, which are those within ``slack`` of the largest T, it is
        the one with fewest sensors, then the cheapest, then the first in the order of candidates.
    """

    def __init__(
        self,
        instance: Instance,
        unit: float,
        evaluate: Callable[[Integer], float],
        chosen: Integer,
        slack: float,
        root: tuple[Integer, Bound],
    ) -> None:
        super().__init__(instance, 0.0, root=root)
        self._unit, self._evaluate, self._slack = unit, evaluate, slack
        self._highest = root[1].value
        self._front: list[tuple[float, tuple[int, float, list[int]], Integer]] = []
        self._keep(np.sort(chosen), evaluate(chosen))

    @property
    def bound(self) -> float:
        """Upper bound on the T of any placement."""
        return max(self.value, min(super().bound, self._highest) / self._unit)

    def _take(self, placement: Integer) -> float:
        if self.instance.feasible(placement):
            self._keep(placement, self._evaluate(placement))
        return self.goal

    def _keep(self, placement: Integer, value: float) -> None:
        """Keep the Pareto front of placements in T and rank; the best placement is in it."""
        # Of placements within the slack of the largest T the one of best rank is the result. As the largest T may still
        # rise, a placement of better rank may drop out later: the next best ones must be kept until then.
        rank = self._rank(placement)
        if any(kept >= value and better <= rank for kept, better, _ in self._front):
            return
        front = [one for one in self._front if one[0] > value or one[1] < rank]
        least = max([value, *(kept for kept, _, _ in front)]) - self._slack
        self._front = [one for one in [*front, (value, rank, placement)] if one[0] >= least]
        self.value, _, self.best = min(self._front, key=lambda one: one[1])
        self.goal = least * self._unit

    def _rank(self, chosen: Integer) -> tuple[int, float, list[int]]:
        return len(chosen), round(math.fsum(self.instance.price[chosen]), 6), chosen.tolist()


ROUNDS = 16  # rounds of fictitious play; weights of scenarios are multiples of 1 / (ROUNDS · m)
SCENARIO_SHARE = 0.5  # share of the time for the problems of single scenarios
MIN_SECONDS = 1.0  # least time, seconds or units of work, for the later steps, however long the earlier ones took


UNPROVEN_MESSAGE = (
    "the search ended before this placement was proven optimal: the gap is the most by which it may fall short"
)


def solve_robust(
    problem: PlacementProblem,
    scenarios: ScenarioVisibility,
    risk: Risk,
    limits: SolverLimits = DEFAULT_LIMITS,
    foreseen: Sequence[Placement] | None = None,
) -> Generator[Progress, None, Placement]:
    """Choose the placement that maximises a risk measure over scenarios.

    Parameters
    ----------
    problem : PlacementProblem
        Problem with the visibility of the poses as planned.
    scenarios : ScenarioVisibility
        Visibility of all candidates in each scenario.
    foreseen : sequence of Placement, optional
        Best placement of each scenario, see `foresee`. By default they are computed within the time limit.

    Returns
    -------
    Placement
        Placement whose objective and bound are T, in units of the targets' weight; ``covered`` is its coverage as
        planned. It does not depend on the order of candidates. Of equally good placements it is the one with fewest
        sensors, then the cheapest; for the expectation it is chosen as by `placement.solve`.

    Raises
    ------
    SeipError
        Same as for `placement.solve`, or fewer sensors are allowed than the risk measure needs.
    """
    most = problem.most_sensors
    risk.require_sensors(most)
    different = _without_copies(scenarios)
    if risk.failure == "none" and len(different) == 1:
        planned = replace(problem, visible=different.seen(0))
        placement = yield from solve(planned, limits)
        return replace(placement, covered=problem.covered(placement.chosen))
    solver, clock = limits.solver, limits.clock()
    if foreseen is None:
        foreseen = yield from foresee(problem, different, solver, clock.part(SCENARIO_SHARE * clock.left))
    slack = equal_within(problem, risk, len(different))
    placement = yield from _searched(problem, different, risk, slack, solver, clock.part(math.inf, MIN_SECONDS))
    placement = _with_foresight(problem, different, risk, slack, placement, foreseen)
    return replace(placement, seconds=clock.seconds)


def equal_within(problem: PlacementProblem, risk: Risk, scenarios: int) -> float:
    """Return the largest difference between equal values of T, consistent with `placement.solve`.

    If the weights have a common unit, T is a multiple of a share of that unit, and different multiples differ.
    Otherwise values are equal if they differ by less than `TIE_TOLERANCE` of all weight.
    """
    tolerance = TIE_TOLERANCE * math.fsum(problem.weights)
    unit, whole = common_unit(problem.weights[problem.weights > 0])
    parts = risk.counted(scenarios) * (problem.most_sensors if risk.failure == "mean" else 1)
    return min(tolerance, WHOLE_SLACK * unit / parts) if whole else tolerance


def foresee(
    problem: PlacementProblem, scenarios: ScenarioVisibility, solver: str, clock: Clock
) -> Generator[Progress, None, tuple[Placement, ...]]:
    """Find the best placement of each scenario by itself.

    Returns
    -------
    tuple of Placement
        One for each scenario; a single one if all scenarios are the same.
    """
    scenarios = _without_copies(scenarios)
    found = []
    for scenario in range(len(scenarios)):
        here = Progress(scenario, len(scenarios), "solving each scenario by itself", counted=False)
        yield here
        alone = replace(problem, visible=scenarios.seen(scenario))
        # time that quick scenarios do not use is shared by those that follow
        part = clock.part(clock.left / (len(scenarios) - scenario), MIN_SECONDS)
        found.append((yield from within(here, solve_within(alone, solver, part))))
    return tuple(found)


def _with_foresight(
    problem: PlacementProblem,
    scenarios: ScenarioVisibility,
    risk: Risk,
    slack: float,
    placement: Placement,
    foreseen: Sequence[Placement],
) -> Placement:
    """Lower the bound by that of known scenarios, and replace the placement by one of theirs if that is better."""
    value, chosen = placement.objective, placement.chosen
    for other in foreseen:
        reached = risk.of(outcomes_of(problem, scenarios, risk, other.chosen))
        if reached > value + slack and placement.status != "optimal":
            value, chosen = reached, other.chosen
    bound = max(min(placement.bound, risk.of(np.array([other.bound for other in foreseen]))), value)
    optimal = placement.status == "optimal" or bound <= value + slack
    return assess(
        problem,
        chosen,
        bound,
        optimal=optimal,
        solver=placement.solver,
        seconds=placement.seconds,
        notes=() if optimal else placement.notes,
        objective=value,
    )


def at_least(found: Placement, other: Placement, reached: float) -> Placement:
    """Return the placement found, or another one that reaches more of the same objective.

    A search that ran out of time may be worse than the placement that was optimised without scenarios.
    """
    if reached <= found.objective * (1 + TIE_TOLERANCE):
        return found
    bound = max(found.bound, reached)
    return replace(
        found,
        chosen=other.chosen,
        objective=reached,
        bound=bound,
        gap=relative_gap(reached, bound),
        covered=other.covered,
        price=other.price,
    )


def outcomes_of(problem: PlacementProblem, scenarios: ScenarioVisibility, risk: Risk, chosen: Integer) -> Float:
    """Return the outcome of chosen candidates in each scenario, (K,) float64, in units of the targets' weight."""
    return risk.outcomes(scenarios.seen_by_each(chosen), problem.weights, problem.most_sensors)


def _without_copies(scenarios: ScenarioVisibility) -> ScenarioVisibility:
    """Return a single scenario if all are the same, so that results without errors have no other rounding."""
    same = (scenarios.packed == scenarios.packed[:1]).all()
    return ScenarioVisibility(scenarios.packed[:1], scenarios.targets) if same else scenarios


def _stacked(problem: PlacementProblem, scenarios: ScenarioVisibility, share: Float) -> PlacementProblem:
    """Return the problem of the targets of all scenarios with a share, weighted by the shares."""
    used = np.flatnonzero(share)
    visible = np.concatenate([scenarios.seen(scenario) for scenario in used], axis=1)
    return replace(problem, visible=visible, weights=np.concatenate([share[k] * problem.weights for k in used]))


def _searched(
    problem: PlacementProblem, scenarios: ScenarioVisibility, risk: Risk, slack: float, solver: str, clock: Clock
) -> Generator[Progress, None, Placement]:
    """Find scenarios' weights with a small bound, then the best placement by branch and bound."""
    yield Progress(0, 0, "reducing the scenarios' targets")
    # Candidates that no scenario needs are dropped first, for all shares: so indices mean the same in every later step.
    whole, _ = make_instance(_stacked(problem, scenarios, np.ones(len(scenarios))))
    game = FictitiousPlay(problem, scenarios, risk, whole, clock)
    start = yield from starting_choice(problem, whole, solver)
    chosen, share = yield from game.play(start)
    # T is at most F in the instance of these shares. Branch and bound on F with T evaluated for every placement found
    # gives the best T once no open node has a larger F.
    instance, unit = game.instance(share), game.unit(share)
    goal = (game.evaluate(chosen) - slack) * unit
    root = yield from lagrangian_bound(instance, goal, clock, iterations=FIRST_STEPS)
    search = BestUnderRisk(instance, unit, game.evaluate, chosen, slack, root)
    finished = yield from search.run(clock, clock.left)
    return assess(
        problem,
        whole.original[search.best],
        search.bound,
        optimal=finished,
        solver="branch and bound",
        seconds=clock.seconds,
        notes=() if finished else (UNPROVEN_MESSAGE,),
        objective=search.value,
    )


class FictitiousPlay:
    """Fictitious play for scenario weights with a small bound: each placement answers the worst scenarios so far.

    Parameters
    ----------
    whole : Instance
        Instance of all scenarios: the candidates that can matter, with their constraints.
    clock : Clock
        Limits of the search; evaluations count as work.
    """

    def __init__(
        self, problem: PlacementProblem, scenarios: ScenarioVisibility, risk: Risk, whole: Instance, clock: Clock
    ) -> None:
        self._scenarios, self._risk, self._whole, self._clock = scenarios, risk, whole, clock
        self._weight = problem.weights
        self._used = problem.weights > 0
        self._unit, _ = common_unit(problem.weights[self._used])
        self._sensors = problem.most_sensors
        self._cover = risk.cover(self._sensors)

    def evaluate(self, chosen: Integer) -> float:
        """Return T of chosen candidates of the whole instance."""
        self._clock.spend(8.0 * self._scenarios.packed[:, 0].size * len(chosen))
        seen = self._scenarios.seen_by_each(self._whole.original[chosen])
        return self._risk.of(self._risk.outcomes(seen, self._weight, self._sensors))

    def instance(self, share: Integer) -> Instance:
        """Return the instance whose objective value is F, for whole shares of the scenarios."""
        weight = np.rint(self._weight[self._used] / self._unit)
        scenarios = np.flatnonzero(share).tolist()
        columns = [self._scenarios.seen(k)[np.ix_(self._whole.original, self._used)] for k in scenarios]
        weights = np.concatenate([share[k] * weight for k in scenarios])
        visible, merged = merge_targets(np.concatenate(columns, axis=1), weights)
        return replace(self._whole, visible=visible, weight=merged, cover=self._cover)

    def unit(self, share: Integer) -> float:
        """Return the factor by which T is multiplied to be compared with F."""
        return float(share.sum()) * self._cover.unit / self._unit

    def play(self, start: Integer) -> Generator[Progress, None, tuple[Integer, Integer]]:
        """Return the best placement found, and how often each scenario was among the worst, (K,) int64."""
        # A game between a chooser of placements and an opponent who chooses scenarios. In each round the opponent adds
        # the worst scenarios for the last placement, and the chooser answers the shares so far. The shares approach the
        # opponent's optimal ones, which give the smallest bound; any shares give a valid one.
        even = np.ones(len(self._scenarios), dtype=np.int64)
        instance = self.instance(even)
        chosen = yield from swap_search(instance, start)
        best, value = chosen, self.evaluate(chosen)
        # the expectation: all scenarios have the same weight, and there is no game
        if self._risk.counted(len(even)) == len(even):
            return best, even
        share = np.zeros_like(even)
        for _ in range(ROUNDS):
            if self._clock.left < 0:
                break
            yield Progress(0, 0, "weighing the scenarios")
            self._clock.spend(2 * self._scenarios.packed.size * 8)
            seen = self._scenarios.seen_by_each(self._whole.original[chosen])
            share[self._risk.worst(self._risk.outcomes(seen, self._weight, self._sensors))] += 1
            chosen = yield from swap_search(self.instance(share), chosen)
            if self.evaluate(chosen) > value:
                best, value = chosen, self.evaluate(chosen)
        return best, share if share.any() else even
