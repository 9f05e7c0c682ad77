"""Coverage study of a site: types × heights × numbers, vanilla against weighted, and the claims of the paper."""

from .cells import NUMBERS, WEIGHT_SHOWN, WEIGHTS, Case, Cell, CoverageStudy, EmptyCell, coverage_study, solve_cell
from .claims import coverage_claims

__all__ = [
    "NUMBERS",
    "WEIGHTS",
    "WEIGHT_SHOWN",
    "Case",
    "Cell",
    "CoverageStudy",
    "EmptyCell",
    "coverage_claims",
    "coverage_study",
    "solve_cell",
]
