"""Which candidates to choose: maximal covering with a certificate."""

from .exact import solve, solve_greedy
from .problem import Placement, PlacementProblem
from .reverse import cheapest_for_coverage

__all__ = ["Placement", "PlacementProblem", "cheapest_for_coverage", "solve", "solve_greedy"]
