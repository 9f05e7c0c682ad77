"""Random placement problems whose answers are held to an enumeration of all subsets in whole numbers."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from seip_addon.core.choosing.placement.cheapest import cheapest_for_coverage
from seip_addon.core.choosing.placement.problem import Placement, PlacementProblem
from seip_addon.core.choosing.placement.search_limits import SolverLimits
from seip_addon.core.choosing.placement.solver import solve, solve_greedy
from seip_addon.core.errors import SeipError
from seip_addon.core.progress import finish

Integer = NDArray[np.int64]
Boolean = NDArray[np.bool_]

TIE = 1e-9
"""What the project says counts as equal: a share of the budget, and of all weight where that has no common unit."""


@dataclass(frozen=True, eq=False)
class Subsets:
    """All subsets of a problem's candidates in canonical order, as bit masks: what each covers, exactly.

    Weights and prices are numerators over one denominator, so that sums are whole.
    """

    order: list[int]
    allowed: Boolean
    covered: Integer
    doubly: Integer
    price: Integer
    number: Integer
    unit: Fraction
    total: int
    seen: int

    def members(self, subset: int) -> list[int]:
        return [candidate for bit, candidate in enumerate(self.order) if subset >> bit & 1]

    def mask(self, chosen: Integer) -> int:
        return sum(1 << self.order.index(int(candidate)) for candidate in chosen)


def enumerate_subsets(problem: PlacementProblem) -> Subsets:
    number = len(problem.visible)
    order = sorted(
        range(number), key=lambda i: (*problem.xyz[i].tolist(), str(problem.labels[i]), float(problem.prices[i]))
    )
    weights, unit = _whole(problem.weights.tolist())
    prices, price_unit = _whole(problem.prices.tolist())
    once, twice = np.zeros(1, np.int64), np.zeros(1, np.int64)
    price, count, allowed = np.zeros(1, np.int64), np.zeros(1, np.int64), np.ones(1, bool)
    # each candidate doubles the subsets: those without it, then those with it
    for place, candidate in enumerate(order):
        sees = sum(1 << j for j in np.flatnonzero(problem.visible[candidate]).tolist())
        rivals = sum(1 << other for other in range(place) if _exclude(problem, candidate, order[other]))
        with_it = np.arange(1 << place)
        may = allowed & ((with_it & rivals) == 0)
        if problem.forbidden is not None and problem.forbidden[candidate]:
            may[:] = False
        twice = np.concatenate([twice, twice | (once & sees)])
        once = np.concatenate([once, once | sees])
        price = np.concatenate([price, price + prices[candidate]])
        count = np.concatenate([count, count + 1])
        allowed = np.concatenate([allowed, may])
    everything = np.arange(1 << number)
    for group in problem.mandatory_groups:
        allowed &= (everything & sum(1 << order.index(i) for i in np.flatnonzero(group).tolist())) != 0
    if problem.count is not None:
        allowed &= count <= problem.count
    if problem.budget is not None:
        # prices are decimals, whose sums floats round: a budget is kept but for the stated tolerance
        allowed &= price <= int(Fraction(problem.budget) * (1 + Fraction(TIE)) / price_unit)
    of_mask = np.zeros(1, np.int64)
    for weight in weights:
        of_mask = np.concatenate([of_mask, of_mask + weight])
    # what counts as equal is a share of all weight that the candidates together see
    every = sum(1 << place for place, i in enumerate(order) if problem.forbidden is None or not problem.forbidden[i])
    covered = of_mask[once]
    return Subsets(order, allowed, covered, of_mask[twice], price, count, unit, sum(weights), int(covered[every]))


def _whole(values: list[float]) -> tuple[list[int], Fraction]:
    """Return floats as whole multiples of one unit, exactly: a float is a fraction."""
    fractions = [Fraction(value) for value in values]
    unit = Fraction(1, math.lcm(*(value.denominator for value in fractions)))
    numerators = [int(value / unit) for value in fractions]
    assert sum(numerators) < 2**62  # what 64 bits can sum up
    return numerators, unit


def _exclude(problem: PlacementProblem, one: int, other: int) -> bool:
    if problem.positions[one] == problem.positions[other]:
        return True
    return math.dist(problem.xyz[one][:2], problem.xyz[other][:2]) < problem.min_distance - 1e-6


# ---- problems --------------------------------------------------------------------------------------------------------

WEIGHTS: dict[str, Callable[[np.random.Generator, int], NDArray[np.float64]]] = {
    "some zero": lambda random, n: random.choice([0.0, 1.0, 2.0], n),
    "halves": lambda random, n: random.choice([0.5, 1.0, 4.0], n),
    "around single precision": lambda random, n: np.floor(random.uniform(1, 2**25 / n, n)),
    "one beside nearly single precision": lambda random, n: np.where(
        np.arange(n) < 2, 1.0, (2**24 - 4) // max(n - 2, 1) - random.integers(0, 2, n)
    ),
    "just below single precision": lambda random, n: (2**24 - 4 * n) // n + random.integers(0, 4, n).astype(float),
    "near ties": lambda random, n: 2.0**24 + random.integers(0, 3, n),
    "up to the largest whole ones": lambda random, n: np.floor(random.uniform(1, 2**53 / n, n)),
    "one outweighs all": lambda random, n: np.where(np.arange(n) == 0, 2.0**52, random.integers(1, 9, n)),
    "tenths": lambda random, n: random.integers(1, 30, n) / 10,
    "any, decades apart": lambda random, n: np.rint(10.0 ** random.uniform(-4, 4, n) * 2**30) / 2**30,
}


DUST = "any, some of about the tolerance"
"""Every eleventh problem has weights that differ by about as much as the sums that count as equal."""


def _with_dust(random: np.random.Generator, n: int) -> NDArray[np.float64]:
    heavy = np.rint(random.uniform(0.5, 2.0, n) * 2**50)
    light = np.rint(random.uniform(0.05, 1.2, n) * n * 2**20)
    return np.where(random.random(n) < 0.6, light, heavy) / 2**50


def draw_problem(seed: int) -> tuple[str, PlacementProblem]:
    """Draw a problem of up to 18 candidates, full of ties and constraints."""
    random = np.random.default_rng((12, seed))
    kind = str(random.choice(list(WEIGHTS)))
    number, targets = int(random.integers(2, 19)), int(random.integers(1, 17))
    visible = random.random((number, targets)) < random.choice([0.15, 0.3, 0.5, 0.8])
    if random.random() < 0.3:  # copies, which tie
        visible[number // 2 :] = visible[: number - number // 2]
    weights = WEIGHTS[kind](random, targets)
    if seed % 11 == 10:
        kind, weights = DUST, _with_dust(random, targets)
    prices = random.choice([[0.0], [1.0], [1.0, 2.0], [0.0, 0.5, 2.0], [0.7, 1.0, 1.1]][random.integers(5)], number)
    limits = random.random(6) < 0.4
    forbidden = random.random(number) < 0.15 if limits[0] else np.zeros(number, bool)
    groups = random.random((int(random.integers(1, 3)), number)) < 0.3 if limits[1] else np.zeros((0, number), bool)
    positions = random.integers(0, max(number // 2, 1), number) if limits[2] else np.arange(number)
    xy = random.integers(0, 5, (len(np.unique(positions)) + number, 2)).astype(float)
    dearest = float(prices.sum())
    problem = PlacementProblem(
        visible=visible,
        weights=weights,
        prices=prices,
        positions=positions,
        xyz=np.column_stack([xy[positions], random.permutation(number).astype(float)]),
        labels=np.array([f"type{i}" for i in random.permutation(number)]),
        mandatory=groups,
        mandatory_names=np.array([f"area {i}" for i in range(len(groups))]),
        forbidden=forbidden,
        budget=float(random.choice([0.2, 0.4, 0.8])) * dearest if limits[3] else None,
        min_distance=float(random.choice([1.0, 1.5, 2.5])) if limits[4] else 0.0,
    )
    places = len(np.unique(positions[~forbidden]))
    return kind, replace(problem, count=int(random.integers(1, places + 1)) if not limits[5] else None)


# ---- verdicts --------------------------------------------------------------------------------------------------------


def faults(seed: int) -> tuple[str, list[str]]:
    """Return the kind of a drawn problem, and what is wrong with the answers to it."""
    try:
        kind, problem = draw_problem(seed)
    except SeipError:
        return "refused", []
    subsets = enumerate_subsets(problem)
    found = _of_solve(problem, subsets)
    if seed % 3 == 0:
        found += _of_reverse(problem, subsets, seed)
    if seed % 5 == 0:
        found += _of_little_effort(problem, subsets)
    return kind, found


def _slack(subsets: Subsets) -> int:
    """What may be lost: nothing where the weights are whole numbers of an exact sum, else the stated tolerance."""
    return 0 if _is_whole(subsets) else int(TIE * subsets.seen)


def _is_whole(subsets: Subsets) -> bool:
    return subsets.unit == 1 and subsets.total <= 2**53


def _of_solve(problem: PlacementProblem, subsets: Subsets) -> list[str]:
    anything = subsets.allowed & (subsets.covered > 0)
    try:
        answer = finish(solve(problem))
    except SeipError:
        return ["a problem with an answer was refused"] if anything.any() else []
    if not subsets.allowed.any():
        return ["an answer to a problem that has none"]
    found = _of_answer(problem, subsets, answer)
    if answer.status != "optimal":
        return [*found, "not proven"]
    return found + _of_ties(subsets, subsets.mask(answer.chosen))


def _of_answer(problem: PlacementProblem, subsets: Subsets, answer: Placement) -> list[str]:
    chosen, slack = subsets.mask(answer.chosen), _slack(subsets)
    best = int(subsets.covered[subsets.allowed].max())
    found = [] if subsets.allowed[chosen] else ["constraints are broken"]
    if answer.status == "optimal" and int(subsets.covered[chosen]) < best - slack:
        found.append(f"called optimal, covers {subsets.covered[chosen]} where {best} can be had")
    if _below(answer.bound, best - slack, subsets.unit):
        found.append(f"the bound {answer.bound!r} is below {best}")
    if not math.isclose(answer.covered, float(int(subsets.covered[chosen]) * subsets.unit), rel_tol=1e-12):
        found.append("the covered weight is not that of the chosen sensors")
    greedy = solve_greedy(problem)
    if _below(greedy.bound, best - slack, subsets.unit) or not subsets.allowed[subsets.mask(greedy.chosen)]:
        found.append("the greedy algorithm's bound or choice is wrong")
    return found


def _below(value: float, numerator: int, unit: Fraction) -> bool:
    return Fraction(value) < numerator * unit * (1 - Fraction(1, 2**50))


def _of_ties(subsets: Subsets, chosen: int) -> list[str]:
    """Compare number, price, double coverage and order with those of the equally good placements."""
    slack = _slack(subsets)
    covered = subsets.covered
    best = int(covered[subsets.allowed].max())
    if slack and (np.abs(covered[subsets.allowed] - (best - slack)) < slack // 1000).any():
        return []  # so near the tolerance that rounding decides what is a tie
    ties = np.flatnonzero(subsets.allowed & (covered >= best - slack))
    ties = ties[subsets.number[ties] == subsets.number[ties].min()]
    for what, figures in (("number", subsets.number), ("price", subsets.price), ("double coverage", -subsets.doubly)):
        least = int(figures[ties].min())
        if int(figures[chosen]) > least + (slack if what == "double coverage" else 0):
            return [f"{what} {figures[chosen]} where {least} can be had"]
        ties = ties[figures[ties] <= least + (slack if what == "double coverage" else 0)]
    if slack:
        return []
    first = min(ties.tolist(), key=lambda subset: [bit for bit in range(len(subsets.order)) if subset >> bit & 1])
    return [] if first == chosen else ["not the first in canonical order"]


def _of_reverse(problem: PlacementProblem, subsets: Subsets, seed: int) -> list[str]:
    share = float(np.random.default_rng((13, seed)).choice([0.2, 0.5, 0.75, 0.9, 1.0]))
    goal = math.ceil(Fraction(share) * subsets.total)
    slack = math.ceil(TIE * subsets.total)
    reaching = subsets.allowed & (subsets.covered >= goal)
    almost = subsets.allowed & (subsets.covered >= goal - slack)
    if (reaching != almost).any():
        return []  # rounding decides what reaches the goal
    try:
        answer = finish(cheapest_for_coverage(problem, share))
    except SeipError:
        return ["a coverage that can be reached was refused"] if reaching.any() else []
    if not reaching.any():
        return ["a coverage that cannot be reached was answered"]
    chosen = subsets.mask(answer.chosen)
    found = [] if reaching[chosen] else ["the coverage is not reached, or constraints are broken"]
    if answer.status != "optimal":
        return [*found, "the price is not proven"]
    figures = subsets.number if np.ptp(problem.prices) == 0 else subsets.price
    least = int(figures[reaching].min())
    if int(figures[chosen]) > least * (1 + Fraction(1, 10**8)):
        found.append(f"called cheapest at {figures[chosen]} where {least} suffices")
    cheapest = reaching & (figures <= int(figures[chosen]))
    if not any("cover more" in note for note in answer.notes):
        most = int(subsets.covered[cheapest].max())
        if int(subsets.covered[chosen]) < most - _slack(subsets):
            found.append("another of the cheapest placements covers more")
    return found


def _of_little_effort(problem: PlacementProblem, subsets: Subsets) -> list[str]:
    """Stopped at once, an answer is still one, its bound holds, and it is the same again."""
    if not (subsets.allowed & (subsets.covered > 0)).any():
        return []
    answers = [finish(solve(problem, SolverLimits(time_limit=math.inf, effort=1e-6))) for _ in range(2)]
    found = _of_answer(problem, subsets, answers[0])
    if not np.array_equal(answers[0].chosen, answers[1].chosen) or answers[0].bound != answers[1].bound:
        found.append("the same effort gave another answer")
    return found


# ---- many of them ----------------------------------------------------------------------------------------------------

UNDECIDED = ("not proven", "the price is not proven")
"""No faults, but to be few."""


def search(problems: int, first_seed: int = 0) -> Counter[str]:
    """Try problems one after the other and count what was found."""
    total: Counter[str] = Counter()
    for seed in range(first_seed, first_seed + problems):
        kind, found = faults(seed)
        total["problems"] += 1
        total[kind] += 1
        total.update(fault if fault in UNDECIDED else f"FAULT in problem {seed} ({kind}): {fault}" for fault in found)
    return total
