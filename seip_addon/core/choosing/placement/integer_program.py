"""Integer programs in PuLP."""

import math
import os
import shutil
import stat
import tempfile
import threading
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pulp
from pulp.apis.coin_api import pulp_cbc_path

from ...arrays import Boolean, Float, Integer
from ...errors import SeipError
from ...progress import Progress, in_thread
from .constraints import Constrained
from .problem import TIE_TOLERANCE
from .reduced_problem import Instance
from .search_limits import OPERATIONS_PER_UNIT, Clock
from .solvers import solver_name

Expression = Any  # of PuLP, which has no types
TOTAL_WEIGHT = 1e4  # total weight in a program: far above the solvers' absolute tolerances of 1e-6
TOLERANCE = 2e-6  # share of all weight that a solver's tolerance of 1e-6 on every variable may add up to, doubled
MAX_ENTRIES = 1_000_000  # entries of V up to which a program is built: PuLP takes 0.5 kB for each
MAX_REJECTED = 100  # choices in a row that a solver's tolerance admits and exact arithmetic does not, before giving up
MIN_SECONDS = 0.01  # seconds that a solver is given if no time remains
OPERATIONS_PER_ENTRY = 1e4  # multiplications per entry of a program that count as the work of one branch of a solver
CALL_OPERATIONS = 1e8  # multiplications that take as long as handing the smallest program to a solver
ROOT_OPERATIONS = 5.0  # multiplications per squared entry that count as the work of the first linear relaxation
UNLIMITED_SECONDS = 1e7  # seconds that solvers are given without a limit: not all of them accept infinity


@dataclass(frozen=True, eq=False)
class Outcome:
    """Outcome of a solver: choice, bound and status.

    Parameters
    ----------
    chosen : (k,) int64 or None
        The best placement found; None if the time was too short or no placement exists.
    bound : float
        Upper bound on the objective of any placement; infinite if the solver reports none.
    finished : bool
        Whether the solver ran to its end: ``chosen`` is optimal, or nothing is feasible.
    nodes : int
        Branches that the solver took.
    """

    chosen: Integer | None
    bound: float
    finished: bool
    nodes: int = 0


class PlacementProgram:
    """An integer program that chooses candidates, for any objective; constraints can be added between solves.

    Parameters
    ----------
    rules : Constrained
        Candidates and constraints; ``x`` has one binary variable for each candidate.
    entries : int
        Number of non-zero entries of the objective's matrix, with which the work of a solver grows.
    """

    def __init__(self, rules: Constrained, entries: int) -> None:
        self._rules, self._entries = rules, entries
        self.model = pulp.LpProblem("placement", pulp.LpMaximize)
        self.x = [self.model.add_variable(f"x{i}", cat=pulp.LpBinary) for i in range(len(rules))]
        self._checks: list[Callable[[Integer], bool]] = [rules.feasible]
        self.model.setObjective(self.number)
        if rules.count < len(rules):
            self.model += self.number <= rules.count
        if math.isfinite(rules.budget):
            self.model += self.price <= rules.budget * self.price_scale * (1 + TIE_TOLERANCE)
        for group in rules.mandatory:
            self.model += self.number_among(np.flatnonzero(group)) >= 1
        for clique in cover_by_cliques(rules.conflict):
            self.model += self.number_among(clique) <= 1

    @property
    def number(self) -> Expression:
        """The number of sensors."""
        return _linear(self.x, np.ones(len(self.x)))

    @property
    def price(self) -> Expression:
        """The total price, scaled by `price_scale`."""
        return _linear(self.x, self._rules.price * self.price_scale)

    @property
    def price_scale(self) -> float:
        """Factor that scales the highest price to 10,000, far above the solvers' absolute tolerances."""
        highest = float(self._rules.price.max(initial=0.0))
        return 1e4 / highest if highest > 0 else 1.0

    def number_among(self, candidates: Integer, factors: Float | None = None) -> Expression:
        """Return the (weighted) number of sensors among some candidates."""
        return _linear([self.x[i] for i in candidates], np.ones(len(candidates)) if factors is None else factors)

    def require(self, constraint: Expression, check: Callable[[Integer], bool] | None = None) -> None:
        """Add a constraint for this and all later solves, and its check in exact arithmetic."""
        self.model += constraint
        if check is not None:
            self._checks.append(check)

    def maximise(
        self, objective: Expression, solver: str, clock: Clock, share: float = 1.0
    ) -> Generator[Progress, None, Outcome]:
        """Solve for the largest objective within a share of the remaining limits.

        The solver runs in a thread of its own. Closing the generator asks it to stop.
        """
        if clock.left <= 0:
            return Outcome(None, math.inf, finished=False)
        self.model.setObjective(objective)
        ends = clock.elapsed + share * clock.left
        size = self._entries + len(self.x)
        for _ in range(MAX_REJECTED):
            left = max(ends - clock.elapsed, MIN_SECONDS)
            seconds = max(clock.seconds_left, MIN_SECONDS) if clock.counts_work else left
            nodes = math.ceil(left * OPERATIONS_PER_UNIT / (size * OPERATIONS_PER_ENTRY)) if clock.counts_work else None
            outcome = yield from in_thread(
                lambda stop, limits=(seconds, nodes): self._solve(solver, limits, stop),  # type: ignore[misc]
                f"solving an integer program of {len(self.x)} candidates",
            )
            branching = outcome.nodes * size * OPERATIONS_PER_ENTRY
            clock.spend(CALL_OPERATIONS + _root_operations(self._entries) + branching)
            chosen = outcome.chosen
            if chosen is None or all(check(chosen) for check in self._checks):
                return outcome
            self.exclude(chosen)  # solvers have tolerances of their own: forbid exactly what fails in exact arithmetic
        return replace(outcome, chosen=None, finished=False)

    def exclude(self, chosen: Integer) -> None:
        """Forbid a single choice."""
        others = np.setdiff1d(np.arange(len(self.x)), chosen)
        self.model += self.number_among(chosen) - self.number_among(others) <= len(chosen) - 1

    def _solve(self, solver: str, limits: tuple[float, int | None], stop: threading.Event) -> Outcome:
        with _engine(solver, limits, stop) as engine:
            try:
                self.model.solve(engine)
            except (pulp.PulpSolverError, OSError) as error:
                raise SeipError(
                    f"the solver {solver} stopped with an error ({error}); choose another solver"
                ) from error
        status = self.model.sol_status
        solved = status in (pulp.LpSolutionOptimal, pulp.LpSolutionIntegerFeasible)
        chosen = np.flatnonzero([round(x.value() or 0.0) for x in self.x]) if solved else None
        finished = status in (pulp.LpSolutionOptimal, pulp.LpSolutionInfeasible)
        return Outcome(chosen, _bound(self.model, solver), finished, _nodes(self.model, solver))


class CoverProgram(PlacementProgram):
    """The integer program of maximal covering; see `PlacementProblem` for the formulation.

    The covered share ``y`` of each target is continuous: it is integral at an optimum.
    """

    def __init__(self, instance: Instance) -> None:
        super().__init__(instance, np.count_nonzero(instance.visible))
        self.instance = instance

    @cached_property
    def covered(self) -> Expression:
        """The covered weight, scaled by `weight_scale`."""
        for y, seen in zip(self._y, self._seen, strict=True):
            self.model += y <= seen
        return _linear(self._y, self.instance.weight * self.weight_scale)

    @property
    def weight_scale(self) -> float:
        """Factor that brings the total weight to `TOTAL_WEIGHT`."""
        return TOTAL_WEIGHT / self.instance.total if self.instance.total > 0 else 1.0

    def require_coverage(self, goal: float) -> None:
        """Require a covered weight, within the instance's slack."""
        instance = self.instance
        self.require(self._at_least(self.covered, goal), lambda c: instance.value(c) >= goal - instance.slack)

    def require_better(self, than: float) -> None:
        """Require a covered weight that is larger than ``than`` by at least the instance's step."""
        instance, goal = self.instance, than + self.instance.step
        self.require(self._at_least(self.covered, goal), lambda c: instance.value(c) >= goal)

    def maximise_coverage(self, solver: str, clock: Clock, share: float = 1.0) -> Generator[Progress, None, Outcome]:
        """Solve for the largest covered weight within the limits; the outcome's bound is not scaled."""
        outcome = yield from self.maximise(self.covered, solver, clock, share)
        return replace(outcome, bound=outcome.bound / self.weight_scale)

    def _at_least(self, covered: Expression, goal: float) -> Expression:
        """Return the constraint for a least weight, lowered by a solver's tolerance."""
        margin = max(self.instance.step / 2, TOLERANCE * self.instance.total)
        return covered >= (goal - margin) * self.weight_scale

    @cached_property
    def _y(self) -> list[Any]:
        return [self.model.add_variable(f"y{j}", 0, 1) for j in range(len(self.instance.weight))]

    @cached_property
    def _seen(self) -> list[Any]:
        return [self.number_among(np.flatnonzero(column)) for column in self.instance.visible.T]


def _root_operations(entries: int) -> float:
    """Return the work of the first linear relaxation of a program, in multiplications.

    The benchmark measures it against the entries of V (`seip study benchmark`, under “Growth”).
    """
    return ROOT_OPERATIONS * float(entries) ** 2


def is_affordable(instance: Instance, clock: Clock, share: float = 1.0) -> bool:
    """Return whether an instance's program fits into memory and its first relaxation into the remaining limits."""
    return fits(np.count_nonzero(instance.visible), clock, share)


def fits(entries: int, clock: Clock, share: float = 1.0) -> bool:
    """Return whether a program fits into memory and its first relaxation into the remaining limits.

    A solver cannot be stopped by counted work within a relaxation, and PuLP takes long to build a large program.
    """
    if clock.left <= 0 or entries > MAX_ENTRIES:
        return False
    return _root_operations(entries) <= share * clock.left * OPERATIONS_PER_UNIT


def reaching(instance: Instance, goal: float) -> CoverProgram:
    """Return the program of an instance whose placements cover at least ``goal``."""
    program = CoverProgram(instance)
    program.require_coverage(goal)
    return program


def cover_by_cliques(conflict: Boolean) -> Iterator[Integer]:
    """Cover all conflicts by cliques, sets of candidates of which at most one can be chosen, (k,) int64.

    Cliques give a tighter linear relaxation than the pairs they consist of. They are grown greedily, in order, so the
    result is always the same.

    Parameters
    ----------
    conflict : (c, c) bool
        Symmetric, false on the diagonal.
    """
    left = np.triu(conflict)
    for first in range(len(conflict)):
        while left[first].any():
            clique = [first, int(np.argmax(left[first]))]
            common = conflict[clique[0]] & conflict[clique[1]]
            while common.any():
                # prefer candidates whose conflict with the first is not covered yet
                uncovered = common & left[first]
                grown = int(np.argmax(uncovered if uncovered.any() else common))
                clique.append(grown)
                common &= conflict[grown]
            members = np.sort(np.array(clique, np.int64))
            left[np.ix_(members, members)] = False
            yield members


def _linear(variables: list[Any], factors: Float) -> Expression:
    return pulp.LpAffineExpression(list(zip(variables, factors.tolist(), strict=True)))


class _Highs(pulp.HiGHS):  # type: ignore[misc]
    """PuLP's interface to HiGHS, with a status that PuLP lacks: the limit on the number of nodes was reached."""

    def findSolutionValues(self, lp: pulp.LpProblem) -> tuple[int, int]:  # noqa: N802 -- PuLP's name
        """Return PuLP's status of problem and solution, after setting the variables."""
        try:
            status: tuple[int, int] = super().findSolutionValues(lp)
        except KeyError:  # raised last of all: the variables are set
            if math.isfinite(lp.solverModel.getObjectiveValue()):
                return pulp.LpStatusOptimal, pulp.LpSolutionIntegerFeasible
            return pulp.LpStatusNotSolved, pulp.LpSolutionNoSolutionFound
        return status


@contextmanager
def _engine(solver: str, limits: tuple[float, int | None], stop: threading.Event) -> Iterator[Any]:
    """Yield PuLP's interface to a solver that proves optimality within seconds and, if given, a number of branches.

    HiGHS ends soon after ``stop`` is set; PuLP offers no way to stop the others before their time limit.
    """
    limit, nodes = min(limits[0], UNLIMITED_SECONDS), limits[1]
    solver = solver_name(solver)
    if solver == "highs":
        import highspy  # noqa: PLC0415 -- imported only for HiGHS: an installation may have another solver only

        def interrupt(kind: object, message: object, output: object, answer: Any, data: object) -> None:  # noqa: ANN401, ARG001
            answer.user_interrupt = stop.is_set()

        kinds = highspy.cb.HighsCallbackType
        yield _Highs(
            msg=False,
            timeLimit=limit,
            gapRel=0.0,
            threads=1,
            callbackTuple=(interrupt, None),
            callbacksToActivate=[kinds.kCallbackMipInterrupt, kinds.kCallbackSimplexInterrupt],
            **({} if nodes is None else {"mip_max_nodes": nodes}),
        )
    elif solver == "cbc":
        with _executable_cbc() as path:
            yield pulp.COIN_CMD(path=path, msg=False, timeLimit=limit, gapRel=0.0, threads=1, maxNodes=nodes)
    else:
        more = {} if nodes is None else {"NodeLimit": nodes}
        yield pulp.GUROBI(msg=False, timeLimit=limit, gapRel=0.0, Threads=1, **more)


def _bound(model: pulp.LpProblem, solver: str) -> float:
    """Return the solver's own upper bound on the objective."""
    if model.sol_status == pulp.LpSolutionOptimal:
        return float(pulp.value(model.objective))
    solver = solver_name(solver)
    if solver == "highs":
        return -float(model.solverModel.getInfo().mip_dual_bound)
    if solver == "gurobi":
        return float(model.solverModel.ObjBound)
    return math.inf


def _nodes(model: pulp.LpProblem, solver: str) -> int:
    """Return the number of branches that a solver took; 0 if it does not report it."""
    return max(int(model.solverModel.getInfo().mip_node_count), 0) if solver_name(solver) == "highs" else 0


@contextmanager
def _executable_cbc() -> Iterator[str]:
    """Yield a path of PuLP's CBC that can be run.

    Archives that drop permissions leave it without its executable bit. A read-only installation cannot be repaired in
    place, so a copy is made executable.
    """
    if os.access(pulp_cbc_path, os.X_OK):
        yield pulp_cbc_path
        return
    with tempfile.TemporaryDirectory(prefix="seip-cbc-") as folder:
        copy = Path(folder) / Path(pulp_cbc_path).name
        shutil.copyfile(pulp_cbc_path, copy)
        copy.chmod(stat.S_IRWXU)
        yield str(copy)
