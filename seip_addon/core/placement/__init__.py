"""Sensor placement: the maximal covering location problem, solved with a certificate."""

from .cheapest import cheapest_for_coverage
from .problem import Placement, PlacementProblem
from .search_limits import SolverLimits
from .solver import solve, solve_greedy

__all__ = ["Placement", "PlacementProblem", "SolverLimits", "cheapest_for_coverage", "solve", "solve_greedy"]
