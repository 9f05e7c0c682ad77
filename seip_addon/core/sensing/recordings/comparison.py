"""Comparison of a recording with a scene, ray by ray: what the scene lacks, and what is no longer there."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from ...base.arrays import Boolean, Float, Integer
from ...site.scene_geometry import Mesh
from ..scans.scanner import ReflectiveSurface
from ..scans.sensor import MountedSensor
from .background import Background, range_margin

_SURFACE = 0.15  # metres across the surface: unevenness that the scene leaves out
_CELL = 0.5  # metres: side of the cells in plan that join points to an object
_LEAST_RAYS = 20  # that show an object
_LEAST_HEIGHT = 0.4  # metres: lower things do not hide road users
_LEAST_VEHICLE = 2.0  # metres: length from which a group beside an object is a vehicle of its own
_BOX_POINTS = 2000  # of an object, from which the direction of its box is found
_LEAST_RADIUS = 0.05  # metres around points, so that a wall has a width
_GONE_SHARE = 0.6  # of the rays towards an object that pass through it if it is not there
_LEAST_NEIGHBOURS = 2  # of the four neighbouring rays that must differ in the same way

MOST_VEHICLE_HEIGHT = 4.5
"""Metres above the road up to which a new object may be a vehicle."""

VEHICLE = "vehicle"
"""Kind of a new object that stands on the road and is no higher than a truck: traffic, not an obstacle."""

AGREES, NEARER, FARTHER, NOTHING, UNKNOWN = range(5)
"""Result for a ray: as predicted, nearer, farther, no return though a surface is predicted, no surface predicted."""


@dataclass(frozen=True, eq=False)
class RayComparison:
    """Predicted and measured range of each ray of a sensor, at its fitted pose; r rays.

    Parameters
    ----------
    sensor : MountedSensor
    directions : (r, 3) float64
        Unit vectors in site axes.
    predicted : (r,) float64, metres
        Range of the scene's surface; infinite without one.
    triangle : (r,) int64
        Triangle met, -1 without one.
    reflected : (r,) float64
        Reflectivity times cosine of incidence there; 0 without one.
    measured : (r,) float64, metres
        Usual range; NaN without a background.
    returned : (r,) float64, 0 to 1
        Share of the sweeps with a return from the usual range or beyond.
    result : (r,) int64
        `AGREES`, `NEARER`, `FARTHER`, `NOTHING` or `UNKNOWN`.
    """

    sensor: MountedSensor
    directions: Float
    predicted: Float
    triangle: Integer
    reflected: Float
    measured: Float
    returned: Float
    result: Integer


@dataclass(frozen=True, eq=False)
class Change:
    """An object that is there or in the scene, but not both.

    Parameters
    ----------
    kind : {"new", "gone", "vehicle"}
        Whether the scene lacks it, it is no longer there, or it is a vehicle that stands on the road.
    name : str
        Name of the scene's object; "" for new objects.
    box : (7,) float64
        x, y, z of the middle, length, width, height (metres), yaw (radians).
    rays : int
        Rays that show it.
    part : (n,) int64
        Triangles of the scene's object that belong to it; empty for new objects.
    """

    kind: str
    name: str
    box: Float
    rays: int
    part: Integer


def compare_rays(surface: ReflectiveSurface, sensor: MountedSensor, background: Background) -> RayComparison:
    """Compare the predicted range of each ray with its usual range."""
    directions = background.rays.directions() @ sensor.orientation.T
    predicted, triangle = surface.caster.cast(sensor.xyz, directions, sensor.model.max_range)
    hit = triangle >= 0
    reflected = np.zeros(len(directions))
    reflected[hit] = surface.reflected(directions[hit], triangle[hit])
    slope = np.abs(np.einsum("ni,ni->n", surface.normals[triangle], directions))
    measured, returned = background.usual.astype(np.float64), background.returned.astype(np.float64)
    # The same unevenness changes the range more, the flatter a ray meets the surface.
    margin = range_margin(np.where(hit, predicted, 0.0), background.spread) + _SURFACE / np.maximum(slope, 0.02)
    known = np.isfinite(measured)
    with np.errstate(invalid="ignore"):
        nearer = known & (measured < np.where(hit, predicted - margin, np.inf))
        farther = known & hit & (measured > predicted + margin)
    result = np.full(len(directions), UNKNOWN)
    result[hit] = NOTHING
    result[known & hit] = AGREES
    result[_with_neighbours(nearer, background)] = NEARER
    result[_with_neighbours(farther, background)] = FARTHER
    return RayComparison(sensor, directions, predicted, triangle, reflected, measured, returned, result)


def new_objects(comparisons: Sequence[RayComparison], road: Callable[[Float], Float]) -> list[Change]:
    """Return the objects that the scene lacks, and vehicles that stand on the road, each with most rays first.

    Points in front of the scene's surfaces are joined in plan; each group becomes a box. Points over the road up to the
    height of a truck are joined apart from others, so that a queue does not become one with the tree next to it. A
    group that is too short for a vehicle and touches an object with more points belongs to it, as leaves over the road.

    Parameters
    ----------
    road : callable
        From positions (n, 2) to the height of the road (n,); NaN beside it.
    """
    points = np.concatenate([_points(one, one.result == NEARER, one.measured) for one in comparisons])
    traffic = points[:, 2] < road(points[:, :2]) + MOST_VEHICLE_HEIGHT  # false beside the road
    traffic &= ~_overhanging(points, traffic)
    found = []
    for kind, some in (("new", points[~traffic]), (VEHICLE, points[traffic])):
        groups = [some[group] for group in _groups(some) if len(group) >= _LEAST_RAYS]
        spans = [np.quantile(group[:, 2], [0.02, 0.98]) for group in groups]
        boxes = [
            (len(group), _box(group[:, :2], _yaw_of_sides(group[:, :2]), *span.tolist()))
            for group, span in zip(groups, spans, strict=True)
            if span[1] - span[0] >= _LEAST_HEIGHT
        ]
        boxes.sort(key=lambda one: (-one[0], one[1].tolist()))
        found += [Change(kind, "", box, rays, np.zeros(0, dtype=np.int64)) for rays, box in boxes]
    return found


def _overhanging(points: Float, traffic: Boolean) -> Boolean:
    """Return which points over the road are of objects beside it, (n,) bool."""
    beside = np.flatnonzero(~traffic)
    objects = [beside[group] for group in _groups(points[beside]) if len(group) >= _LEAST_RAYS]
    over = np.flatnonzero(traffic)
    found = np.zeros(len(points), dtype=np.bool_)
    for group in _groups(points[over]):
        xy = points[over[group], :2]
        own = shapely.MultiPoint(xy)
        length = _box(xy, _yaw_of_sides(xy), 0.0, 0.0)[3]
        found[over[group]] = length < _LEAST_VEHICLE and any(
            len(other) > len(group) and own.dwithin(shapely.MultiPoint(points[other, :2]), _CELL) for other in objects
        )
    return found


def gone_objects(comparisons: Sequence[RayComparison], meshes: Sequence[Mesh], triangles: Float) -> list[Change]:
    """Return the objects of a scene that are no longer there, with most rays first.

    Parameters
    ----------
    meshes : sequence of Mesh
        Objects that may have been removed. Each connected part of a mesh is an object.
    triangles : (n, 3, 3) float64, metres
        Triangles that the comparisons refer to.
    """
    part_of, parts = _connected_parts(meshes, triangles)
    passed, stopped = np.zeros(len(parts), dtype=np.int64), np.zeros(len(parts), dtype=np.int64)
    for one in comparisons:
        for counts, result in ((passed, FARTHER), (stopped, AGREES)):
            rays = (one.result == result) & (one.triangle >= 0)
            part = part_of[one.triangle[rays]]
            np.add.at(counts, part[part >= 0], 1)
    found = []
    for number, (name, own, corners) in enumerate(parts):
        count = int(passed[number])
        if count < _LEAST_RAYS or count < _GONE_SHARE * (count + stopped[number]):
            continue
        low, high = float(corners[:, 2].min()), float(corners[:, 2].max())
        box = _box(corners[:, :2], _yaw_of_hull(corners[:, :2]), low, high)
        found.append(Change("gone", name, box, count, own))
    return sorted(found, key=lambda one: (-one.rays, one.name))


def _with_neighbours(mask: Boolean, background: Background) -> Boolean:
    """Return the rays of a mask with enough neighbours in it: edges of objects differ along single rays."""
    grid = mask.reshape(len(background.rays.elevation), background.rays.steps)
    beside = np.roll(grid, 1, axis=1).astype(np.int64) + np.roll(grid, -1, axis=1)
    beside[1:] += grid[:-1]
    beside[:-1] += grid[1:]
    kept: Boolean = (grid & (beside >= _LEAST_NEIGHBOURS)).ravel()
    return kept


def _points(one: RayComparison, rays: Boolean, distance: Float) -> Float:
    points: Float = one.sensor.xyz + one.directions[rays] * distance[rays, None]
    return points


def _groups(points: Float) -> list[Integer]:
    """Return the indices of points that are joined in plan."""
    if not len(points):
        return []
    cell = np.floor(points[:, :2] / _CELL).astype(np.int64)
    cells, of = np.unique(cell, axis=0, return_inverse=True)
    low, high = cells * _CELL - 0.25 * _CELL, (cells + 1) * _CELL + 0.25 * _CELL  # diagonal neighbours overlap
    squares = shapely.box(low[:, 0], low[:, 1], high[:, 0], high[:, 1])
    joined = shapely.get_parts(shapely.union_all(squares))
    centres = shapely.points((cells + 0.5) * _CELL)
    square, group = shapely.STRtree(joined).query(centres, predicate="within")
    group_of = np.empty(len(cells), dtype=np.int64)
    group_of[square] = group
    own = group_of[of.ravel()]
    return [np.flatnonzero(own == number) for number in range(len(joined))]


def _box(xy: Float, yaw: float, low: float, high: float) -> Float:
    """Return the upright box of a given yaw around points in plan, (7,), with its length along its longer side."""
    axes = np.array([[math.cos(yaw), math.sin(yaw)], [-math.sin(yaw), math.cos(yaw)]])
    first, last = (xy @ axes.T).min(axis=0) - _LEAST_RADIUS, (xy @ axes.T).max(axis=0) + _LEAST_RADIUS
    x, y = (first + last) / 2 @ axes
    length, width = last - first
    if width > length:
        length, width, yaw = width, length, yaw + math.pi / 2
    return np.array([x, y, (low + high) / 2, length, width, high - low, yaw])


def _yaw_of_sides(xy: Float) -> float:
    """Return the yaw of the rectangle whose sides points are nearest to (Zhang et al. 2017).

    A sensor sees two sides of most objects. The smallest rectangle around two sides lies askew.
    """
    some = xy[:: max(1, len(xy) // _BOX_POINTS)]
    turn = np.arange(90) * (math.pi / 180)
    along = some @ np.array([np.cos(turn), np.sin(turn)])
    across = some @ np.array([-np.sin(turn), np.cos(turn)])
    gaps = [part - part.min(axis=0) for part in (along, across)] + [part.max(axis=0) - part for part in (along, across)]
    return float(turn[np.minimum.reduce(gaps).mean(axis=0).argmin()])


def _yaw_of_hull(xy: Float) -> float:
    """Return the yaw of the smallest rectangle around points in plan."""
    corners = shapely.get_coordinates(shapely.MultiPoint(xy).buffer(_LEAST_RADIUS).minimum_rotated_rectangle)
    x, y = corners[1] - corners[0]
    return math.atan2(y, x)


def _connected_parts(meshes: Sequence[Mesh], triangles: Float) -> tuple[Integer, list[tuple[str, Integer, Float]]]:
    """Return the part of each triangle, -1 without one, and each part's mesh, triangles and corners."""
    number_of = {row.tobytes(): number for number, row in enumerate(triangles)}
    part_of = np.full(len(triangles), -1)
    parts: list[tuple[str, Integer, Float]] = []
    for mesh in meshes:
        numbers = np.array([number_of.get(row.tobytes(), -1) for row in mesh.triangles])
        label = _labels_of(mesh.triangles)
        for part in np.unique(label):
            own = (label == part) & (numbers >= 0)
            if own.any():
                part_of[numbers[own]] = len(parts)
                parts.append((mesh.name, numbers[own], mesh.triangles[own].reshape(-1, 3)))
    return part_of, parts


def _labels_of(triangles: Float) -> Integer:
    """Return the connected part of each triangle (n, 3, 3), by common corners."""
    _, corner = np.unique(np.round(triangles.reshape(-1, 3), 4), axis=0, return_inverse=True)
    corner = corner.reshape(-1, 3)
    label = np.arange(corner.max() + 1)
    # Each corner takes the lowest label of its triangles until nothing changes; following labels of labels halves the
    # number of rounds each time.
    while True:
        lowest = label[corner].min(axis=1)
        fresh = label.copy()
        np.minimum.at(fresh, corner.ravel(), np.repeat(lowest, 3))
        fresh = fresh[fresh]
        if (fresh == label).all():
            found: Integer = label[corner[:, 0]]
            return found
        label = fresh
