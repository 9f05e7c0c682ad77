"""Objects above the ground in a survey, as the fewest boxes that preserve lines of sight.

Cells of a raster contain the highest and the lowest point of an object. Neighbouring cells of one kind and nearly the
same height are merged into boxes; random rays measure how often boxes and cells block different lines of sight.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ...base.arrays import Boolean, Float, Integer
from ...geometry.height_raster import HeightRaster
from ...geometry.solids import Solid, block, join

MIN_ABOVE = 2.0  # metres above the ground: lower points are ignored, because road users are there
UNCLASSIFIED, VEGETATION, BUILDING = (0, 1), (3, 4, 5), (6,)
CROWN_BASE = 2.5  # metres above the ground from which on the space below a crown is free; lower ones reach the ground
TOLERANCES = (2.0, 1.0, 0.5, 0.25, 0.0)
"""Largest distance of the tops of cells from the top of their box (metres), coarsest first."""
MAX_CHANGED = 0.005  # largest share of rays that may be blocked differently
RAYS, RAY_LENGTH, RAY_STEP = 4000, 60.0, 0.25  # metres
EYES, TARGETS = (3.0, 8.0), (0.3, 1.7)  # metres above the ground between which rays begin and end
FOUNDATION = 0.5  # metres that boxes reach into the ground
TILE = 50.0  # metres: boxes of one kind within a tile form one object
KINDS = ("Surveyed obstacle", "Surveyed vegetation", "Surveyed building")
MATERIALS = (("wall", "wall"), ("leaves", "leaves"), ("facade grey", "roof"))
"""Materials of walls and tops for each kind."""


@dataclass(frozen=True, eq=False)
class ObstacleRaster:
    """Obstacles on a raster of ground heights.

    Parameters
    ----------
    ground : HeightRaster
        Ground heights at the centres of the cells.
    kind : (rows, columns) int64
        Index of `KINDS`; -1 for empty cells.
    low, top : (rows, columns) float64, metres
        Lowest and highest point of the obstacle, with the same zero as the ground.
    """

    ground: HeightRaster
    kind: Integer
    low: Float
    top: Float


@dataclass(frozen=True)
class Box:
    """Ranges of rows and columns of a raster (end excluded), and heights in metres."""

    kind: int
    rows: tuple[int, int]
    columns: tuple[int, int]
    low: float
    top: float


def obstacle_raster(ground: HeightRaster, points: Float, classes: Integer) -> ObstacleRaster:
    """Return the obstacles on the ground from the points of a survey.

    Cells with fewer than two occupied neighbours are left out: posts and wires are narrower than a cell.

    Parameters
    ----------
    ground : HeightRaster
        Heights of the ground.
    points : (n, 3) float64, metres
        Points of the survey.
    classes : (n,) int64
        Classes as in `PointCloud`; only `UNCLASSIFIED`, `VEGETATION` and `BUILDING` are used.
    """
    shape = ground.heights.shape
    column, row = np.floor((points[:, :2] - ground.low) / ground.step + 0.5).astype(np.int64).T
    kind = np.full(len(points), -1)
    for number, own in enumerate((UNCLASSIFIED, VEGETATION, BUILDING)):
        kind[np.isin(classes, own)] = number
    counts = (kind >= 0) & (column >= 0) & (column < shape[1]) & (row >= 0) & (row < shape[0])
    counts &= points[:, 2] - ground.at(points[:, :2]) > MIN_ABOVE
    cell, height, kind = (row * shape[1] + column)[counts], points[counts, 2], kind[counts]
    top, low, of_kind = np.full(shape[0] * shape[1], -np.inf), np.full(shape[0] * shape[1], np.inf), np.full(shape, -1)
    np.maximum.at(top, cell, height)
    np.minimum.at(low, cell, height)
    for number in (1, 0, 2):  # vegetation first, as anything more solid blocks the view down to the ground
        of_kind.ravel()[cell[kind == number]] = number
    top, low = top.reshape(shape), low.reshape(shape)
    stands = np.pad(of_kind >= 0, 1)
    around = np.lib.stride_tricks.sliding_window_view(stands, (3, 3)).sum(axis=(2, 3)) - stands[1:-1, 1:-1]
    of_kind[around < 2] = -1  # at most one of the eight cells around has an object
    raised = (of_kind == 1) & (low - ground.heights > CROWN_BASE)
    return ObstacleRaster(ground, of_kind, np.where(raised, low, ground.heights - FOUNDATION), top)


def merged(raster: ObstacleRaster, tolerance: float) -> tuple[Box, ...]:
    """Return boxes that together cover exactly the occupied cells.

    A box extends along its row as far as cells of its kind follow each other with tops (and undersides, for raised
    crowns) within twice the tolerance, and then over as many rows as this holds for.
    """
    free = raster.kind >= 0
    boxes = []
    raised = raster.low > raster.ground.heights
    # Greedy cover: the first free cell in reading order is the corner of the next box.
    for row, column in np.argwhere(free).tolist():
        if not free[row, column]:
            continue

        def fits(rows: slice, columns: slice, at: tuple[int, int] = (row, column)) -> bool:
            same = (raster.kind[rows, columns] == raster.kind[at]) & (raised[rows, columns] == raised[at])
            if not (free[rows, columns] & same).all():
                return False
            spreads = [np.ptp(raster.top[rows, columns])] + [np.ptp(raster.low[rows, columns])] * bool(raised[at])
            return bool(max(spreads) <= 2 * tolerance)

        right, down = column + 1, row + 1
        while right < free.shape[1] and fits(slice(row, row + 1), slice(column, right + 1)):
            right += 1
        while down < free.shape[0] and fits(slice(row, down + 1), slice(column, right)):
            down += 1
        rows, columns = slice(row, down), slice(column, right)
        free[rows, columns] = False
        top, low = raster.top[rows, columns], raster.low[rows, columns]
        foot = (low.min() + low.max()) / 2 if raised[row, column] else low.min()
        middle = (float(top.min()) + float(top.max())) / 2
        boxes.append(Box(int(raster.kind[row, column]), (row, down), (column, right), float(foot), middle))
    return tuple(boxes)


def of_boxes(raster: ObstacleRaster, boxes: Sequence[Box]) -> ObstacleRaster:
    """Return the raster with the heights of boxes instead of cells."""
    kind, low, top = np.full(raster.kind.shape, -1), raster.low.copy(), raster.top.copy()
    for box in boxes:
        cells = slice(*box.rows), slice(*box.columns)
        kind[cells], low[cells], top[cells] = box.kind, box.low, box.top
    return ObstacleRaster(raster.ground, kind, low, top)


def chosen_boxes(raster: ObstacleRaster, rng: np.random.Generator) -> tuple[tuple[Box, ...], float]:
    """Return the fewest boxes that change at most `MAX_CHANGED` of random lines of sight, and the share they change."""
    begin, end = random_rays(raster, rng)
    true = blocked(raster, begin, end)
    for tolerance in TOLERANCES:  # boxes of the last one, zero, change nothing
        boxes = merged(raster, tolerance)
        changed = float(np.mean(blocked(of_boxes(raster, boxes), begin, end) != true)) if len(begin) else 0.0
        if changed <= MAX_CHANGED:
            break
    return boxes, changed


def random_rays(raster: ObstacleRaster, rng: np.random.Generator) -> tuple[Float, Float]:
    """Return starts and ends (n, 3) of rays: from sensor height above free cells to the height of road users."""
    empty = np.flatnonzero(raster.kind.ravel() < 0)
    if not len(empty):
        return np.empty((0, 3)), np.empty((0, 3))
    places = raster.ground.places[rng.choice(empty, RAYS)]
    # The square root makes ends uniform over the disc.
    angle, length = rng.uniform(0, 2 * np.pi, RAYS), RAY_LENGTH * np.sqrt(rng.random(RAYS))
    ends = places + length[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    ends = np.clip(ends, raster.ground.low, raster.ground.places[-1])
    heights = [raster.ground.at(xy) + rng.uniform(*span, RAYS) for xy, span in ((places, EYES), (ends, TARGETS))]
    return np.column_stack([places, heights[0]]), np.column_stack([ends, heights[1]])


def blocked(raster: ObstacleRaster, begin: Float, end: Float) -> Boolean:
    """Return whether an obstacle lies between starts and ends (n, 3), sampled at least every `RAY_STEP` metres."""
    steps = int(np.ceil(RAY_LENGTH / RAY_STEP))
    hit: Boolean = np.zeros(len(begin), dtype=np.bool_)
    for share in np.linspace(0.0, 1.0, steps + 1):
        place = begin + share * (end - begin)
        column, row = np.floor((place[:, :2] - raster.ground.low) / raster.ground.step + 0.5).astype(np.int64).T
        stands = raster.kind[row, column] >= 0
        hit |= stands & (place[:, 2] >= raster.low[row, column]) & (place[:, 2] <= raster.top[row, column])
    return hit


def solids(raster: ObstacleRaster, boxes: Sequence[Box]) -> Iterator[tuple[str, Solid]]:
    """Yield the name and the solid of the boxes of each kind and tile, in the coordinates of the raster."""
    tiles: dict[tuple[int, int, int], list[Solid]] = {}
    for box in boxes:
        ((x, y), (far_x, far_y)) = (
            raster.ground.low + raster.ground.step * (np.array([column, row]) - 0.5)
            for column, row in zip(box.columns, box.rows, strict=True)
        )
        side, cap = MATERIALS[box.kind]
        base = np.array([[a, b, box.low] for a, b in ((x, y), (far_x, y), (far_x, far_y), (x, far_y))])
        solid = block(base, np.full(4, box.top - box.low), side=side, cap=cap)
        tiles.setdefault((box.kind, int(x // TILE), int(y // TILE)), []).append(solid)
    for (kind, _, _), found in sorted(tiles.items()):
        yield KINDS[kind], join(*found)
