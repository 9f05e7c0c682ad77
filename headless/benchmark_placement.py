"""Measure placement on synthetic streets: ``python -m headless.benchmark_placement [--plain] [--limit 60]``."""

from __future__ import annotations

import argparse
import resource
import sys
import time

from headless.street_visibility import street_problem

import numpy as np
import pulp

from seip_addon.core.placement import PlacementProblem, solve, solve_greedy
from seip_addon.core.progress import finish

SIZES = (
    (66, 2000, 2, (1, 2, 4)),
    (333, 5000, 5, (4, 16)),
    (450, 5000, 4, (4,)),
    (1000, 20000, 8, (4, 16)),
)
"""Positions (three poses at each), targets, blocks per side, numbers of sensors."""


def main(argv: list[str]) -> None:
    """Solve each size with each number of sensors and print a line for it."""
    parser = argparse.ArgumentParser(prog="benchmark_placement", description=__doc__)
    parser.add_argument("--limit", type=float, default=60.0, metavar="S", help="time limit of each solve")
    parser.add_argument("--plain", action="store_true", help="also solve the plain formulation with PuLP and CBC")
    parser.add_argument("--poses", type=int, help="only the sizes with so many poses")
    options = parser.parse_args(argv)
    write = sys.stdout.write
    write(
        f"{'poses':>6}{'targets':>8}{'N':>4}{'greedy':>8}{'found':>8}{'bound':>10}{'gap':>8}{'s':>7}{'MB':>6}  status\n"
    )
    for positions, targets, blocks, counts in SIZES:
        if options.poses not in {None, 3 * positions}:
            continue
        for count in counts:
            problem = street_problem(positions, targets, blocks=blocks, count=count)
            greedy, best = solve_greedy(problem), finish(solve(problem, time_limit=options.limit))
            memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
            write(
                f"{3 * positions:6}{targets:8}{count:4}{greedy.objective:8.0f}{best.objective:8.0f}{best.bound:10.2f}"
                f"{best.gap:8.2%}{best.seconds:7.1f}{memory:6}  {best.status}\n"
            )
            if options.plain:
                value, seconds = plain_cbc(problem, options.limit)
                write(f"    plain, PuLP + CBC: {value:.0f} in {seconds:.1f} s: {seconds / best.seconds:.1f}×\n")
            sys.stdout.flush()


def plain_cbc(problem: PlacementProblem, limit: float) -> tuple[float, float]:
    """Solve the textbook's integer program, all variables binary, and return objective and seconds."""
    start = time.perf_counter()
    model = pulp.LpProblem("plain", pulp.LpMaximize)
    x = [model.add_variable(f"x{i}", cat=pulp.LpBinary) for i in range(len(problem.visible))]
    y = [model.add_variable(f"y{j}", cat=pulp.LpBinary) for j in range(len(problem.weights))]
    model.setObjective(pulp.LpAffineExpression(list(zip(y, problem.weights.tolist(), strict=True))))
    for y_j, column in zip(y, problem.visible.T, strict=True):
        model += y_j <= pulp.lpSum(x[i] for i in np.flatnonzero(column))
    for position in np.unique(problem.positions):
        model += pulp.lpSum(x[i] for i in np.flatnonzero(problem.positions == position)) <= 1
    model += pulp.lpSum(x) <= problem.count
    model.solve(pulp.PULP_CBC_CMD(msg=False, timeLimit=limit, threads=1))
    return float(pulp.value(model.objective) or 0.0), time.perf_counter() - start


if __name__ == "__main__":
    main(sys.argv[1:])
