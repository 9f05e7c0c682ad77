"""The study's coverage figures on any site: types × heights × numbers, vanilla against weighted, and what holds.

The claims are those of Qu, Huang and Suo, "SEIP: Simulation-based Design and
Evaluation of Infrastructure-based Collective Perception", section V.
"""

from .cells import NUMBERS, WEIGHT_SHOWN, WEIGHTS, Case, CoverageStudy, EmptyCell, coverage_study
from .claims import Claim, judge

__all__ = [
    "NUMBERS",
    "WEIGHTS",
    "WEIGHT_SHOWN",
    "Case",
    "Claim",
    "CoverageStudy",
    "EmptyCell",
    "coverage_study",
    "judge",
]
