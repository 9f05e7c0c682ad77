"""Solvers of integer programs: their names, and which can run here."""

import importlib.metadata
import os

import pulp
from pulp.apis.coin_api import pulp_cbc_path

from ...errors import SeipError

SOLVERS = ("highs", "cbc", "gurobi")  # names of solvers besides ``auto``
_PULP_NAME = {"highs": "HiGHS", "gurobi": "GUROBI"}
_PACKAGE = {"highs": "highspy", "gurobi": "gurobipy"}


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
    if solver not in SOLVERS:
        raise SeipError(f"unknown solver {solver!r}; choose among {', '.join(_available())}")
    if not is_available(solver):
        raise SeipError(f"the solver {solver} is not available here; choose among {', '.join(_available())}")
    if solver == "cbc":
        return f"CBC of PuLP {pulp.__version__}"
    return f"{_PULP_NAME[solver]} {importlib.metadata.version(_PACKAGE[solver])}, PuLP {pulp.__version__}"


def is_available(solver: str) -> bool:
    """Return whether a known solver can run here."""
    if solver == "cbc":
        return os.access(pulp_cbc_path, os.R_OK)
    return bool(pulp.getSolver(_PULP_NAME[solver], msg=False).available())


def _available() -> list[str]:
    return [name for name in SOLVERS if is_available(name)]
