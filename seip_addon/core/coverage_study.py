"""The study's coverage figures on any site: types × heights × numbers, vanilla against weighted, and what holds.

The claims are those of Qu, Huang and Suo, "SEIP: Simulation-based Design and
Evaluation of Infrastructure-based Collective Perception", section V.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from .goal import Goal, placement_problem
from .lidar import LidarModel
from .placement import Placement, solve, solve_greedy
from .progress import Progress, within
from .results.deployment import Deployment, deploy
from .site import Site

NUMBERS = (1, 2, 4)
WEIGHTS = (2.0, 4.0, 8.0, 16.0)

NEGLIGIBLE = 0.01
"""Share of the region below which a gain or loss of coverage counts as none."""


@dataclass(frozen=True, eq=False)
class Case:
    """One solved cell of the study.

    Parameters
    ----------
    sensor : str
        Catalogue key of the one type allowed.
    height : float or None, metres
        The one height allowed; None where heights are free.
    count : int
        N, the largest number of sensors.
    weight : float
        Weight of central targets; 1 is the vanilla problem.
    placement, greedy : Placement
        The integer program's and the greedy algorithm's answer.
    deployment : Deployment
        What the integer program's sensors see.
    """

    sensor: str
    height: float | None
    count: int
    weight: float
    placement: Placement
    greedy: Placement
    deployment: Deployment

    @property
    def span(self) -> tuple[float, float]:
        """Least and largest possible best objective: they meet where the optimum is proven."""
        return self.placement.objective, max(self.placement.objective, self.placement.bound)


@dataclass(frozen=True)
class Claim:
    """A claim of the study and what this site says to it.

    Parameters
    ----------
    number : int
        Number in the study's list of claims.
    text : str
    verdict : str
        ``holds``, ``does not hold``, or ``undecided`` where bounds leave it open.
    evidence : str
        The figures behind the verdict.
    """

    number: int
    text: str
    verdict: str
    evidence: str


@dataclass(frozen=True, eq=False)
class CoverageStudy:
    """All cells of the study on one site.

    Parameters
    ----------
    sensors : tuple of str
        Catalogue keys, from the simplest type to the best.
    heights : tuple of float, metres
    cases : tuple of Case
    targets : int
        Number of targets, the unit of vanilla objectives.
    """

    sensors: tuple[str, ...]
    heights: tuple[float, ...]
    cases: tuple[Case, ...]
    targets: int

    def case(self, sensor: str, count: int, height: float | None = None, weight: float = 1.0) -> Case:
        """Return one cell."""
        wanted = (sensor, count, height, weight)
        return next(c for c in self.cases if (c.sensor, c.count, c.height, c.weight) == wanted)


def coverage_study(
    site: Site,
    models: Mapping[str, LidarModel],
    visible: NDArray[np.bool_],
    *,
    solver: str = "highs",
    time_limit: float = 60.0,
) -> Generator[Progress, None, CoverageStudy]:
    """Solve every cell: each type, each height alone and all together, N = 1, 2, 4; then a sweep of central weights.

    Parameters
    ----------
    site : Site
        With poses of every type and height to be studied.
    models : mapping of str to LidarModel
    visible : (c, t) bool
        The visibility grid.
    solver : str
    time_limit : float, seconds
        For each cell.

    Returns
    -------
    CoverageStudy
    """
    sensors = tuple(dict.fromkeys(site.candidates.sensor.tolist()))
    heights = tuple(sorted(set(site.candidates.height.tolist())))
    plan = [(s, h, n, 1.0) for s in sensors for h in (*heights, None) for n in NUMBERS]
    if site.targets.central.any():
        plan += [(s, None, n, w) for s in sensors for n in NUMBERS for w in WEIGHTS]
    cases = []
    for done, (sensor, height, count, weight) in enumerate(plan):
        at = "any height" if height is None else f"{height:g} m"
        progress = Progress(done, len(plan), f"{sensor}, {at}, N = {count}, central weight {weight:g}")
        yield progress
        allowed = site.candidates.sensor == sensor
        if height is not None:
            allowed &= site.candidates.height == height
        goal = Goal(count=count, central_weight=None if weight == 1.0 else weight)
        problem = replace(placement_problem(site, visible, models, goal), forbidden=~allowed)
        placement = yield from within(progress, solve(problem, solver=solver, time_limit=time_limit))
        deployment = deploy(site, models, visible, placement.chosen)
        cases.append(Case(sensor, height, count, weight, placement, solve_greedy(problem), deployment))
    yield Progress(len(plan), len(plan), "all cells solved")
    return CoverageStudy(sensors, heights, tuple(cases), len(site.targets))


def judge(study: CoverageStudy) -> tuple[Claim, ...]:
    """Hold claims 1 to 4 and 10 of the study against the solved cells."""
    claims = [_more_is_better(study), _four_of_the_best(study), _heights(study), _weighting(study), _greedy(study)]
    return tuple(claim for claim in claims if claim is not None)


def _share(study: CoverageStudy, sensor: str, count: int, height: float | None = None) -> tuple[float, float]:
    low, high = study.case(sensor, count, height).span
    return low / study.targets, high / study.targets


def _more_is_better(study: CoverageStudy) -> Claim:
    best = study.sensors[-1]
    rows, verdicts = [], []
    for sensor in study.sensors:
        rows.append(f"{sensor} " + ", ".join(f"{_share(study, sensor, n)[0]:.1%}" for n in NUMBERS))
        verdicts += [_at_least(_share(study, sensor, b), _share(study, sensor, a)) for a, b in pairwise(NUMBERS)]
    for worse, better in pairwise(study.sensors):
        verdicts += [_at_least(_share(study, better, n), _share(study, worse, n)) for n in NUMBERS]
    gain = _share(study, best, NUMBERS[-1])[0] - _share(study, best, NUMBERS[-2])[0]
    verdicts.append("holds" if gain < NEGLIGIBLE else "does not hold")
    numbers = ", ".join(map(str, NUMBERS))
    return Claim(
        1,
        f"coverage rises with N and with a better type; for {best} the gain is negligible",
        _all(verdicts),
        f"N = {numbers}: {'; '.join(rows)}; {best} gains {gain:.2%} from N = {NUMBERS[-2]} to {NUMBERS[-1]}",
    )


def _four_of_the_best(study: CoverageStudy) -> Claim:
    best, most = study.sensors[-1], NUMBERS[-1]
    low, high = _share(study, best, most)
    used = len(study.case(best, most).placement.chosen)
    full = "holds" if low >= 1 else "does not hold" if high < 1 else "undecided"
    return Claim(
        2,
        f"four {best} sensors see 100 %, and fewer would do",
        _all([full, "holds" if used < most else "does not hold"]),
        f"{low:.2%} with {used} of {most} sensors used",
    )


def _heights(study: CoverageStudy) -> Claim | None:
    if len(study.heights) < 2:
        return None
    verdicts, rows = [], []
    for sensor in study.sensors:
        wanted_low = sensor == study.sensors[0]
        for n in NUMBERS:
            shares = {h: _share(study, sensor, n, h) for h in study.heights}
            best = max(shares, key=lambda h: shares[h][0])
            rows.append(f"{sensor} N = {n}: {best:g} m")
            if wanted_low:
                lowest = study.heights[0]
                verdicts += [_at_least(shares[lowest], shares[h]) for h in study.heights[1:]]
            else:
                higher = (max(shares[h][i] for h in study.heights[1:]) for i in (0, 1))
                verdicts.append(_at_least(tuple(higher), shares[study.heights[0]]))
    return Claim(
        3,
        f"{study.sensors[0]} does best at {study.heights[0]:g} m; the other types prefer higher, at every N",
        _all(verdicts),
        "best height: " + ", ".join(rows),
    )


def _weighting(study: CoverageStudy) -> Claim | None:
    if not any(case.weight != 1 for case in study.cases):
        return None
    verdicts, rows = [], []
    for sensor in study.sensors:
        plain = study.case(sensor, NUMBERS[-1]).deployment
        weighted = [study.case(sensor, NUMBERS[-1], weight=w).deployment for w in WEIGHTS]
        gains = [((d.central or 0) - (plain.central or 0), d.coverage - plain.coverage) for d in weighted]
        gain, loss = max((g for g in gains if g[1] > -NEGLIGIBLE), default=max(gains))
        rows.append(f"{sensor}: central {plain.central:.1%} {gain:+.2%}, whole {plain.coverage:.1%} {loss:+.2%}")
        if sensor == study.sensors[-1]:
            verdicts.append("holds" if abs(gain) < NEGLIGIBLE else "does not hold")
        else:
            verdicts.append("holds" if gain >= NEGLIGIBLE and loss > -NEGLIGIBLE else "does not hold")
    return Claim(
        4,
        "weighting raises central coverage of all but the best type without hurting the whole; the best gains nothing",
        _all(verdicts),
        f"N = {NUMBERS[-1]}, best weight that costs the whole under {NEGLIGIBLE:.0%}: {'; '.join(rows)}",
    )


def _greedy(study: CoverageStudy) -> Claim:
    worst = min(case.greedy.objective / case.span[1] for case in study.cases)
    short = sum(case.greedy.objective < case.placement.objective * (1 - 1e-9) for case in study.cases)
    return Claim(
        10,
        "greedy reaches 1 − 1/e of the optimum",
        "holds" if worst >= 1 - 1 / math.e else "undecided",
        f"at worst {worst:.1%} of the bound; below the integer program in {short} of {len(study.cases)} cells",
    )


def _at_least(more: Sequence[float], less: Sequence[float]) -> str:
    """Whether one span of possible optima lies at or above another."""
    if more[0] >= less[1]:
        return "holds"
    return "does not hold" if more[1] < less[0] else "undecided"


def _all(verdicts: Sequence[str]) -> str:
    for verdict in ("does not hold", "undecided"):
        if verdict in verdicts:
            return verdict
    return "holds"
