"""Synthetic visibility grids of streets, without a scene: junctions, shadows of buildings and trees, ranges."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from seip_addon.core.choosing.placement.problem import PlacementProblem

MAX_RANGE = 110.0
"""Maximum range of every sensor in these streets, metres."""


def street_problem(
    positions: int, targets: int, seed: int = 0, heights: int = 3, blocks: int = 3, **limits: object
) -> PlacementProblem:
    """Return candidates at kerbs and targets on the roads of a street grid with built-up blocks between."""
    rng = np.random.default_rng(seed)
    pitch, width = 100.0, 18.0
    extent = blocks * pitch
    points = _on_roads(rng, targets, extent, pitch, width * 0.4)
    posts = _on_kerbs(rng, positions, extent, pitch, width * 0.5)
    buildings = _buildings(rng, blocks, pitch, width)
    trees = np.column_stack(
        [_on_kerbs(rng, 12 * blocks * blocks, extent, pitch, width * 0.5), rng.uniform(0.8, 2.5, 12 * blocks * blocks)]
    )
    distance = np.hypot(*(posts[:, None] - points[None]).transpose(2, 0, 1))
    hidden = _hidden(posts, points, buildings, trees)
    visible, xyz = [], []
    for level in range(heights):
        height = 3.5 + 2.25 * level
        reach = rng.normal(60.0 + 12.0 * level, 4.0, positions)[:, None]
        blind = 0.35 * height / 0.27
        # rings of the lower channels thin out with range: some cells fall between them
        between = rng.random(distance.shape) < 0.25 * (distance / reach) ** 2
        visible.append((distance < reach) & (distance > blind) & ~hidden & ~between)
        xyz.append(np.column_stack([posts, np.full(positions, height)]))
    return PlacementProblem(
        amounts=np.concatenate(visible),
        weights=np.ones(targets),
        prices=np.full(positions * heights, 6000.0),
        positions=np.tile(np.arange(positions), heights),
        xyz=np.concatenate(xyz),
        labels=np.full(positions * heights, "type1"),
        **limits,  # type: ignore[arg-type]
    )


def _on_roads(rng: np.random.Generator, number: int, extent: float, pitch: float, half: float) -> NDArray[Any]:
    along = rng.uniform(0, extent, number)
    across = rng.integers(0, round(extent / pitch), number) * pitch + pitch / 2 + rng.uniform(-half, half, number)
    flip = rng.random(number) < 0.5
    return np.column_stack([np.where(flip, along, across), np.where(flip, across, along)])


def _on_kerbs(rng: np.random.Generator, number: int, extent: float, pitch: float, offset: float) -> NDArray[Any]:
    along = rng.uniform(0, extent, number)
    side = rng.choice([-1.0, 1.0], number) * offset
    across = rng.integers(0, round(extent / pitch), number) * pitch + pitch / 2 + side
    flip = rng.random(number) < 0.5
    return np.column_stack([np.where(flip, along, across), np.where(flip, across, along)])


def _buildings(rng: np.random.Generator, blocks: int, pitch: float, width: float) -> NDArray[Any]:
    boxes = []
    for i in range(blocks + 1):
        for j in range(blocks + 1):
            low = np.array([i, j]) * pitch - pitch / 2 + width / 2 + rng.uniform(3, 10, 2)
            high = np.array([i, j]) * pitch + pitch / 2 - width / 2 - rng.uniform(3, 10, 2)
            boxes.append(np.concatenate([low, high]))
    return np.array(boxes)


def _hidden(posts: NDArray[Any], points: NDArray[Any], boxes: NDArray[Any], discs: NDArray[Any]) -> NDArray[Any]:
    """Return whether a building or a tree stands between post and point; beyond `MAX_RANGE` everything is hidden."""
    hidden = np.ones((len(posts), len(points)), bool)
    for index, post in enumerate(posts):
        near = np.flatnonzero(np.hypot(*(points - post).T) < MAX_RANGE)
        step = points[near] - post
        step[np.abs(step) < 1e-9] = 1e-9
        hidden[index, near] = _behind_boxes(step, boxes - np.tile(post, 2)) | _behind_discs(step, discs - [*post, 0.0])
    return hidden


def _behind_boxes(step: NDArray[Any], boxes: NDArray[Any]) -> NDArray[Any]:
    hidden = np.zeros(len(step), bool)
    for box in boxes[(np.minimum(np.abs(boxes[:, :2]), np.abs(boxes[:, 2:])) < MAX_RANGE).all(axis=1)]:
        first, second = box[:2] / step, box[2:] / step
        enter = np.minimum(first, second).max(axis=1)
        leave = np.maximum(first, second).min(axis=1)
        hidden |= (enter < leave) & (leave > 0) & (enter < 1)
    return hidden


def _behind_discs(step: NDArray[Any], discs: NDArray[Any]) -> NDArray[Any]:
    hidden = np.zeros(len(step), bool)
    length = (step**2).sum(axis=1)
    distance = np.hypot(discs[:, 0], discs[:, 1])
    for x, y, radius in discs[(distance > discs[:, 2] + 0.5) & (distance < MAX_RANGE)]:
        share = np.clip(step @ [x, y] / length, 0, 1)
        hidden |= np.hypot(*(share[:, None] * step - [x, y]).T) < radius
    return hidden
