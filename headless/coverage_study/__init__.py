"""Coverage study of a site: types × heights × numbers, vanilla against weighted, and the claims of the paper.

The claims are those of Qu, Huang and Suo, "SEIP: Simulation-based Design and
Evaluation of Infrastructure-based Collective Perception", section V.
"""

from .cells import NUMBERS, WEIGHT_SHOWN, WEIGHTS, Case, Cell, CoverageStudy, EmptyCell, coverage_study, solve_cell
from .claims import Claim, judge

__all__ = [
    "NUMBERS",
    "WEIGHTS",
    "WEIGHT_SHOWN",
    "Case",
    "Cell",
    "Claim",
    "CoverageStudy",
    "EmptyCell",
    "coverage_study",
    "judge",
    "solve_cell",
]
