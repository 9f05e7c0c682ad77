"""Exhaustive search over all subsets, and random small problems to compare with it."""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np
from hypothesis import strategies as st

from seip_addon.core.choosing.placement.problem import PlacementProblem

WEIGHTS = [[1.0], [1.0, 2.0], [0.0, 0.5, 3.0], [1e-3, 1.0, 7.0], [2.0**21 - 1, 2.0**21 + 1]]
"""Weights to draw from. The last ones have sums that single precision holds, while sums of their sums are rounded."""


@st.composite
def small_problems(draw: st.DrawFn, *, limits: bool = True, seen: bool = True) -> PlacementProblem:
    """Return problems that are full of ties; with ``seen``, some allowed candidate sees a target that counts."""
    number = draw(st.integers(1, 8))
    targets = draw(st.integers(1, 7))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    visible = rng.random((number, targets)) < draw(st.sampled_from([0.2, 0.4, 0.7]))
    weights = rng.choice(draw(st.sampled_from(WEIGHTS)), targets)
    forbidden = rng.random(number) < (0.15 if limits else 0)
    forbidden[0] = False
    positions = rng.integers(0, 5, number) if limits else np.arange(number)
    if seen:
        visible[0, 0], weights[0] = True, 1.0
    groups = draw(st.integers(0, 2)) if limits else 0
    mandatory = rng.random((groups, number)) < 0.4
    mandatory[~(mandatory & ~forbidden).any(axis=1), 0] = True
    if seen and draw(st.booleans()):
        visible[mandatory.any(axis=0)] = False  # mandatory poses that see nothing, but for the first
        visible[0, 0] = True
    places = len(np.unique(positions[~forbidden]))
    return PlacementProblem(
        visible=visible,
        weights=weights,
        prices=rng.choice(draw(st.sampled_from([[2.0], [1.0, 2.0, 3.0]])), number),
        positions=positions,
        xyz=rng.integers(0, 4, (number, 3)).astype(float),
        labels=np.array([f"type{i}" for i in rng.permutation(number)]),
        mandatory=mandatory,
        mandatory_names=np.array([f"area {i}" for i in range(groups)]),
        forbidden=forbidden,
        count=draw(st.integers(1, places)) if not limits or draw(st.booleans()) else None,
        budget=draw(st.sampled_from([None, 3.0, 4.0, 6.5])) if limits else None,
        min_distance=draw(st.sampled_from([0.0, 0.0, 1.5, 2.5])) if limits else 0.0,
    )


def all_placements(problem: PlacementProblem) -> list[tuple[int, ...]]:
    """Return every feasible choice, each in canonical order, the empty one included where it is feasible."""
    order = canonical(problem)
    choices = (choice for k in range(len(order) + 1) for choice in combinations(order, k))
    return [choice for choice in choices if _feasible(problem, choice)]


def canonical(problem: PlacementProblem) -> list[int]:
    """Return the candidates in canonical order."""
    return sorted(range(len(problem.visible)), key=lambda i: (*problem.xyz[i], str(problem.labels[i])))


def covered(problem: PlacementProblem, choice: tuple[int, ...]) -> float:
    """Return the covered weight."""
    return sum(
        w for w, column in zip(problem.weights, problem.visible.T, strict=True) if any(column[i] for i in choice)
    )


def _feasible(problem: PlacementProblem, choice: tuple[int, ...]) -> bool:
    return (
        not problem.forbidden[list(choice)].any()
        and len({problem.positions[i] for i in choice}) == len(choice)
        and (problem.count is None or len(choice) <= problem.count)
        and (problem.budget is None or sum(problem.prices[i] for i in choice) <= problem.budget)
        and all(any(group[i] for i in choice) for group in problem.mandatory)
        and all(
            math.dist(problem.xyz[i][:2], problem.xyz[j][:2]) >= problem.min_distance
            for i, j in combinations(choice, 2)
        )
    )
