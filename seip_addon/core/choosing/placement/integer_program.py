r"""The maximal covering location problem as an integer program, solved through PuLP.

.. math::
    \max \sum_t w_t v_t \quad\text{subject to}\quad
    v_t \le \sum_i A_{it} s_i, \quad 0 \le v_t \le 1, \quad
    \sum_i s_i \le N, \quad \sum_i p_i s_i \le B, \quad s_i \in \{0, 1\},

with the further constraints of `PlacementProblem`: the vanilla and weighted programs of the SEIP paper, whose v are
whole at an optimum.
"""

from __future__ import annotations

import importlib.metadata
import math
import os
import shutil
import stat
import tempfile
import threading
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pulp
from pulp.apis.coin_api import pulp_cbc_path

from ...base.arrays import Boolean, Float, Integer
from ...base.errors import SeipError
from ...base.progress import Progress, in_thread
from .incumbent import Incumbent
from .instance import Instance
from .problem import TIE_TOLERANCE
from .search_limits import OPERATIONS_PER_UNIT, Work

SOLVERS = ("highs", "cbc", "gurobi")  # names of solvers besides ``auto``
_PULP_NAME = {"highs": "HiGHS", "gurobi": "GUROBI"}
_PACKAGE = {"highs": "highspy", "gurobi": "gurobipy"}

Expression = Any  # of PuLP, which has no types
TOTAL_VALUE = 1e4  # largest value in a program: far above the solvers' absolute tolerances of 1e-6
TOLERANCE = 2e-6  # share of the largest value that a solver's tolerances of 1e-6 may add up to, doubled
MAX_ENTRIES = 1_000_000  # entries of A up to which a program is built: PuLP takes 0.5 kB for each
OPERATIONS_PER_ENTRY = 2.5e4  # multiplications per entry of a program that count as the work of one branch of a solver
LATEST = 1.5  # seconds per unit of work after which a solver ends that a user has named
CALL_OPERATIONS = 3e7  # multiplications that take as long as handing the smallest program to a solver
ROOT_OPERATIONS = 1.5  # multiplications per squared entry that count as the work of the first linear relaxation


def solver_name(solver: str) -> str:
    """Return the solver for a name; ``auto`` is HiGHS if it is installed, otherwise CBC."""
    if solver == "auto":
        return "highs" if is_available("highs") else "cbc"
    return solver


def check_solver(solver: str) -> str:
    """Return name and version of a solver.

    Raises
    ------
    SeipError
        The solver is unknown or cannot run here; the message lists those that can.
    """
    solver = solver_name(solver)
    available = ", ".join(name for name in SOLVERS if is_available(name))
    if solver not in SOLVERS:
        raise SeipError(f"unknown solver {solver!r}; choose among {available}")
    if not is_available(solver):
        raise SeipError(f"the solver {solver} is not available here; choose among {available}")
    if solver == "cbc":
        return f"CBC of PuLP {pulp.__version__}"
    return f"{_PULP_NAME[solver]} {importlib.metadata.version(_PACKAGE[solver])}, PuLP {pulp.__version__}"


def is_available(solver: str) -> bool:
    """Return whether a known solver can run here."""
    if solver == "cbc":
        return os.access(pulp_cbc_path, os.R_OK)
    return bool(pulp.getSolver(_PULP_NAME[solver], msg=False).available())


@dataclass(frozen=True, eq=False)
class Outcome:
    """Outcome of a solver: choice, bound and status.

    Parameters
    ----------
    chosen : (k,) int64 or None
        The best placement found; None if the work did not suffice or no placement exists.
    bound : float
        Upper bound on the objective of any placement; infinite if the solver reports none.
    finished : bool
        Whether the solver ran to its end: ``chosen`` is optimal, or nothing is feasible.
    nodes : int, optional
        Branches that the solver took; None if it does not report them.
    """

    chosen: Integer | None
    bound: float
    finished: bool
    nodes: int | None = 0


class PlacementProgram:
    """An integer program that chooses candidates under the constraints of an instance, for any objective."""

    def __init__(self, instance: Instance) -> None:
        self.instance = instance
        self.model = pulp.LpProblem("placement", pulp.LpMaximize)
        self.x = [self.model.add_variable(f"x{i}", cat=pulp.LpBinary) for i in range(len(instance))]
        # Scaled to 10,000 for the budget or the highest price, prices are far above the solvers' tolerances: what these
        # let pass is within the tolerance of a budget, too.
        most = instance.budget if math.isfinite(instance.budget) else float(instance.price.max(initial=0.0))
        price = instance.price * (TOTAL_VALUE / most) if most > 0 else instance.price
        self.price = _linear(self.x, np.minimum(price, 2 * TOTAL_VALUE))
        self.number = _linear(self.x, np.ones(len(self.x)))
        if instance.count < len(instance):
            self.model += self.number <= instance.count
        if math.isfinite(instance.budget):
            self.model += self.price <= (TOTAL_VALUE if most > 0 else 0.0) * (1 + TIE_TOLERANCE / 2)
        for group in instance.mandatory:
            self.model += self.number_among(np.flatnonzero(group)) >= 1
        for clique in _cover_by_cliques(instance.conflict):
            self.model += self.number_among(clique) <= 1

    def number_among(self, candidates: Integer) -> Expression:
        """Return the number of sensors among some candidates."""
        return _linear([self.x[i] for i in candidates], np.ones(len(candidates)))

    def maximise(
        self, objective: Expression, solver: str, work: Work, entries: int = 0
    ) -> Generator[Progress, None, Outcome]:
        """Solve for the largest objective within a limit of work, in a thread of its own.

        Closing the generator, and a user's request to end the search, ask the solver to stop. The limit is a number of
        branches, whose time differs: a solver that the user has named also ends after a time, which depends on the
        machine.
        """
        self.model.setObjective(objective)
        size = entries + len(self.x)
        each = size * OPERATIONS_PER_ENTRY
        nodes = math.ceil(work.left * OPERATIONS_PER_UNIT / each) if math.isfinite(work.left) else None
        seconds = LATEST * work.left if nodes is not None and solver != "auto" else None
        solving = in_thread(
            lambda stop: self._solve(solver, nodes, seconds, stop),
            f"solving an integer program of {len(self.x)} candidates",
        )
        outcome = Outcome(None, math.inf, finished=False)
        while work.left > 0:
            try:
                yield next(solving)
            except StopIteration as stop:
                outcome = stop.value
                break
        solving.close()
        work.spend(CALL_OPERATIONS + _root_operations(entries) + (outcome.nodes or 0) * each)
        if nodes is not None and not outcome.finished and outcome.nodes is None:
            work.spend(work.left * OPERATIONS_PER_UNIT)
        return outcome

    def _solve(self, solver: str, nodes: int | None, seconds: float | None, stop: threading.Event) -> Outcome:
        with _engine(solver, nodes, seconds, stop) as engine:
            try:
                self.model.solve(engine)
            except (pulp.PulpSolverError, OSError) as error:
                raise SeipError(
                    f"the solver {solver} stopped with an error ({error}); choose another solver"
                ) from error
        status = self.model.sol_status
        solved = status in (pulp.LpSolutionOptimal, pulp.LpSolutionIntegerFeasible)
        chosen = np.flatnonzero([round(x.value() or 0.0) for x in self.x]) if solved else None
        # PuLP has no status of the solution where CBC finds the integers infeasible, and calls one infeasible that
        # Gurobi has not found yet: only the status of the problem is the same for all solvers
        finished = status == pulp.LpSolutionOptimal or self.model.status == pulp.LpStatusInfeasible
        return Outcome(chosen, _bound(self.model, solver), finished, _nodes(self.model, solver))


class CoverageProgram(PlacementProgram):
    """The integer program of an instance with one block of coverage and no failures.

    Attributes
    ----------
    entries : int
        Number of pairs of a candidate and a target that it sees.
    scale : float
        Value in the program of one unit of the instance's.
    margin : float
        What the solver's tolerances may add up to, in units of the instance.
    """

    def __init__(self, instance: Instance) -> None:
        super().__init__(instance)
        (block,) = instance.blocks
        self.entries = int(np.count_nonzero(block.amounts))
        covered = [self.model.add_variable(f"v{t}", 0, 1) for t in range(len(block.weight))]
        for v, column in zip(covered, block.amounts.T, strict=True):
            self.model += v <= self.number_among(np.flatnonzero(column))
        largest = float(block.weight.sum())
        self.scale, self.margin = TOTAL_VALUE / largest, TOLERANCE * largest
        self.objective = _linear(covered, block.weight * self.scale)


def prove_by_program(incumbent: Incumbent, among: Integer, solver: str, work: Work) -> Generator[Progress, None, None]:
    """Improve the best placement and its bound by an integer program, within a limit of work.

    The bound is that of the solver, raised by what its tolerances may add up to: less than one unit of whole weights.

    Parameters
    ----------
    among : (n,) int64
        Candidates of the best placement, and those that a better one may contain.
    """
    program = CoverageProgram(incumbent.instance.of(among))
    outcome = yield from program.maximise(program.objective, solver, work, program.entries)
    if outcome.chosen is not None:
        incumbent.offer(among[outcome.chosen])
    incumbent.bound = max(incumbent.value, min(incumbent.bound, outcome.bound / program.scale + program.margin))


def _root_operations(entries: int) -> float:
    """Return the work of the first linear relaxation of a program, in multiplications."""
    return ROOT_OPERATIONS * float(entries) ** 2


def is_affordable(instance: Instance, work: Work) -> bool:
    """Return whether an instance's program fits into memory and its first relaxation into the work that is left.

    A solver cannot be stopped by counted work within a relaxation, and PuLP takes long to build a large program.
    """
    entries = int(np.count_nonzero(instance.blocks[0].amounts))
    return entries <= MAX_ENTRIES and _root_operations(entries) <= work.left * OPERATIONS_PER_UNIT


def _cover_by_cliques(conflict: Boolean) -> Iterator[Integer]:
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
def _engine(solver: str, nodes: int | None, seconds: float | None, stop: threading.Event) -> Iterator[Any]:
    """Yield PuLP's interface to a solver that proves optimality within a number of branches and a time, if given.

    HiGHS ends soon after ``stop`` is set; PuLP offers no way to stop the others.
    """
    solver = solver_name(solver)
    if solver == "highs":
        import highspy  # noqa: PLC0415 -- imported only for HiGHS: an installation may have another solver only

        def interrupt(kind: object, message: object, output: object, answer: Any, data: object) -> None:  # noqa: ANN401, ARG001
            answer.user_interrupt = stop.is_set()

        kinds = highspy.cb.HighsCallbackType
        yield _Highs(
            msg=False,
            gapRel=0.0,
            threads=1,
            timeLimit=seconds,
            callbackTuple=(interrupt, None),
            callbacksToActivate=[kinds.kCallbackMipInterrupt, kinds.kCallbackSimplexInterrupt],
            **({} if nodes is None else {"mip_max_nodes": nodes}),
        )
    elif solver == "cbc":
        with _executable_cbc() as path:
            yield pulp.COIN_CMD(path=path, msg=False, gapRel=0.0, threads=1, maxNodes=nodes, timeLimit=seconds)
    else:
        limit = {} if nodes is None else {"NodeLimit": nodes}
        yield pulp.GUROBI(msg=False, gapRel=0.0, Threads=1, timeLimit=seconds, **limit)


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


def _nodes(model: pulp.LpProblem, solver: str) -> int | None:
    """Return the number of branches that a solver took; None if it does not report it."""
    return max(int(model.solverModel.getInfo().mip_node_count), 0) if solver_name(solver) == "highs" else None


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
