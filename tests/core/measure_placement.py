"""Print what placement costs on synthetic streets: `python tests/core/measure_placement.py [seconds]`."""

from __future__ import annotations

import resource
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from street_visibility import street_problem

from seip_addon.core.placement import solve, solve_greedy
from seip_addon.core.progress import finish

SIZES = (
    (66, 2000, 2, (1, 2, 4)),
    (450, 5000, 4, (1, 2, 3, 4)),
    (333, 5000, 5, (16,)),
    (1000, 20000, 8, (4, 16)),
)
"""Positions (three poses at each), targets, blocks per side, numbers of sensors."""


def main(seconds: float) -> None:
    """Solve each size with each number of sensors and print a line for it."""
    write = sys.stdout.write
    write(
        f"{'poses':>6}{'targets':>8}{'N':>4}{'greedy':>9}{'found':>9}{'bound':>11}{'gap':>8}{'s':>7}{'MB':>6}  status\n"
    )
    for positions, targets, blocks, counts in SIZES:
        for count in counts:
            problem = street_problem(positions, targets, blocks=blocks, count=count)
            greedy, best = solve_greedy(problem), finish(solve(problem, time_limit=seconds))
            memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
            write(
                f"{3 * positions:6}{targets:8}{count:4}{greedy.objective:9.0f}{best.objective:9.0f}{best.bound:11.2f}"
                f"{best.gap:8.2%}{best.seconds:7.1f}{memory:6}  {best.status} {' '.join(best.notes)}\n"
            )


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 60.0)
