"""Ray casting against static triangles, behind one interface.

Blender's BVH tree exists only within Blender's Python and is imported where its caster is made. Embree (embreex) is
used if it is installed.
"""

from __future__ import annotations

import functools
import gc
import importlib.util
import itertools
import operator
import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

import numpy as np

from ...base.arrays import Boolean, Float, Integer
from ...base.errors import SeipError
from .settings import Engine

# Rays are cast a little beyond their range and cut off afterwards, in float64: a hit at the very end of one ray is then
# the same as on a longer ray.
_EXCESS = 1 + 1e-6

_MAX_NEEDLE_HEIGHT = 1 / 300
"""Height over longest side below which Embree's float32 distances are off by centimetres, though its hits are right."""

MAX_THREADS = min(4, os.cpu_count() or 1)
"""Largest useful number of threads that cast: the work between casts holds Python's lock part of the time."""
_FACE, _DISTANCE = operator.itemgetter(2), operator.itemgetter(3)  # items of a result of Blender's tree


class RayCaster(Protocol):
    """Interface of ray casters. Both sides of a triangle stop a ray.

    Attributes
    ----------
    triangles : (n, 3, 3) float64, metres
        All given triangles, which hits index.
    threads : int
        Useful number of threads that cast at once.
    """

    triangles: Float
    threads: int

    def cast(self, origin: Float, directions: Float, max_range: float) -> tuple[Float, Integer]:
        """Cast rays from one point, or each from a point of its own.

        Parameters
        ----------
        origin : (3,) or (n, 3) float64, metres
            Start of the rays.
        directions : (n, 3) float64
            Unit vectors.
        max_range : float, metres
            Largest distance of a hit.

        Returns
        -------
        distance : (n,) float64, metres
            Distance to the first triangle; infinite on a miss. A ray's result does not depend on the other rays.
        triangle : (n,) int64
            Index of that triangle; -1 on a miss.
        """


def engine_name(engine: Engine) -> Engine:
    """Return ``bvh`` or ``embree``; ``auto`` is Embree if it is installed, otherwise Blender's BVH tree."""
    if engine == "auto":
        return "embree" if importlib.util.find_spec("embreex") else "bvh"
    return engine


def threads_of(engine: Engine) -> int:
    """Return the number of threads in which casters of an engine may cast at once."""
    return EmbreeRayCaster.threads if engine_name(engine) == "embree" else BvhRayCaster.threads


def make_ray_caster(triangles: Float, engine: Engine = "auto") -> RayCaster:
    """Build a ray caster; see `engine_name` for ``auto``.

    Parameters
    ----------
    triangles : (n, 3, 3) float64, metres
    engine : {"auto", "bvh", "embree"}

    Raises
    ------
    SeipError
        A coordinate is not finite, or the engine is not available.

    Examples
    --------
    >>> wall = np.array([[[10.0, -5.0, 0.0], [10.0, 5.0, 0.0], [10.0, 0.0, 6.0]]])
    >>> caster = make_ray_caster(wall)
    >>> distance, triangle = caster.cast(np.array([0.0, 0.0, 2.0]), np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), 100.0)
    >>> distance.round(3).tolist(), triangle.tolist()
    ([10.0, inf], [0, -1])
    """
    name = engine_name(engine)
    if name == "embree":
        return EmbreeRayCaster(triangles)
    if name == "bvh":
        return BvhRayCaster(triangles)
    raise SeipError(f"unknown ray-casting engine '{engine}'; choose auto, bvh or embree")


class BvhRayCaster:
    """Ray caster with ``mathutils.bvhtree``.

    Parameters
    ----------
    triangles : (n, 3, 3) float64, metres
        Corners of the triangles.
    """

    threads = 1  # casting a ray holds Python's lock

    def __init__(self, triangles: Float) -> None:
        try:
            from mathutils.bvhtree import BVHTree  # noqa: PLC0415 - exists only within Blender's Python
        except ImportError as error:
            raise SeipError(
                "the ray-casting engine bvh needs Blender's Python: run within Blender, or import bpy first"
            ) from error
        self.triangles = triangles
        self._index, self._centre, corners = _rebased(triangles)
        with _no_garbage_collection():  # otherwise it walks the growing lists repeatedly
            points = corners.reshape(-1, 3).tolist()
            faces = np.arange(len(points)).reshape(-1, 3).tolist()
            self._tree = BVHTree.FromPolygons(points, faces, all_triangles=True)

    def cast(self, origin: Float, directions: Float, max_range: float) -> tuple[Float, Integer]:
        """Cast rays; see `RayCaster.cast`."""
        start = (origin - self._centre).tolist()
        starts = itertools.repeat(start) if origin.ndim == 1 else start
        with _no_garbage_collection():
            hits = list(map(self._tree.ray_cast, starts, directions.tolist(), itertools.repeat(max_range * _EXCESS)))
            # None, on a miss, becomes NaN
            face = np.array(list(map(_FACE, hits)), dtype=np.float64)
            distance = np.array(list(map(_DISTANCE, hits)), dtype=np.float64)
        return _result(distance, np.where(face >= 0, face, -1.0).astype(np.int64), self._index, max_range)


class EmbreeRayCaster:
    """Ray caster with Embree, through embreex.

    Parameters
    ----------
    triangles : (n, 3, 3) float64, metres
        Corners of the triangles.
    """

    threads = MAX_THREADS

    def __init__(self, triangles: Float) -> None:
        try:
            from embreex.mesh_construction import TriangleMesh  # noqa: PLC0415 - an extra that need not be installed
            from embreex.rtcore_scene import EmbreeScene  # noqa: PLC0415 - as above
        except ImportError as error:
            raise SeipError("the ray-casting engine embree is not installed; choose bvh or install embreex") from error
        self.triangles = triangles
        self._index, self._centre, corners = _rebased(triangles)
        self._scene = EmbreeScene(_embree_device(), robust=True)  # robust: no leaks along shared edges
        self._mesh = TriangleMesh(self._scene, corners.astype(np.float32)) if len(corners) else None
        self._needle = _needles(corners)
        self._any_needle = bool(self._needle.any())
        self.cast(self._centre, np.array([[0.0, 0.0, 1.0]]), 1.0)  # builds the tree before several threads use it

    def cast(self, origin: Float, directions: Float, max_range: float) -> tuple[Float, Integer]:
        """Cast rays; see `RayCaster.cast`."""
        if self._mesh is None or len(directions) == 0:
            return np.full(len(directions), np.inf), np.full(len(directions), -1, dtype=np.int64)
        start = np.broadcast_to((origin - self._centre).astype(np.float32), directions.shape)
        reach = np.full(len(directions), max_range * _EXCESS, dtype=np.float32)
        hits = self._scene.run(np.ascontiguousarray(start), directions.astype(np.float32), dists=reach, output=True)
        distance, face = hits["tfar"].astype(np.float64), hits["primID"].astype(np.int64)
        if self._any_needle:
            needle = np.flatnonzero((face >= 0) & self._needle[face])
            met = self.triangles[self._index[face[needle]]]
            distance[needle] = _to_plane(np.broadcast_to(origin, directions.shape)[needle], directions[needle], met)
        return _result(distance, face, self._index, max_range)


@functools.cache
def _embree_device() -> object:
    """Return the one Embree device of all casters.

    Each device uses one of the roughly thousand keys of thread-local storage of a process; Embree crashes when none is
    left.
    """
    from embreex.rtcore import EmbreeDevice  # noqa: PLC0415 - an extra that need not be installed

    return EmbreeDevice()


def _rebased(triangles: Float) -> tuple[Integer, Float, Float]:
    """Select the triangles that have an area, and move them to the common centre of all.

    Both engines compute in float32, whose error is metres at map coordinates.

    Returns
    -------
    index : (k,) int64
        Indices of the selected triangles.
    centre : (3,) float64, metres
        Centre of the bounding box of all triangles.
    corners : (k, 3, 3) float64, metres
        Corners of the selected triangles relative to the centre.
    """
    if triangles.ndim != 3 or triangles.shape[1:] != (3, 3):
        raise SeipError(f"triangles must be an array of n x 3 corners x 3 coordinates, not {triangles.shape}")
    broken = np.flatnonzero(~np.isfinite(triangles).all(axis=(1, 2)))
    if len(broken):
        raise SeipError(f"{len(broken)} triangles have coordinates that are not finite, the first is {broken[0]}")
    if len(triangles) == 0:
        return np.zeros(0, dtype=np.int64), np.zeros(3), triangles
    points = triangles.reshape(-1, 3)
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    corners = triangles - centre
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    index = np.flatnonzero(area > 0)
    return index, centre, corners[index]


def _needles(corners: Float) -> Boolean:
    """Return which triangles have a height far below the length of their longest side, (n,) bool."""
    sides = corners - np.roll(corners, 1, axis=1)
    longest = np.linalg.norm(sides, axis=2).max(axis=1, initial=0.0)
    twice_area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    thin: Boolean = twice_area < _MAX_NEEDLE_HEIGHT * longest**2
    return thin


def _to_plane(start: Float, directions: Float, corners: Float) -> Float:
    """Return the distances (n,) at which rays (n, 3) meet the planes of the triangles (n, 3, 3) that they hit."""
    way = corners - start[:, None]
    normal = np.cross(way[:, 1] - way[:, 0], way[:, 2] - way[:, 0])
    along = (way * directions[:, None]).sum(axis=2)
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (way[:, 0] * normal).sum(axis=1) / (directions * normal).sum(axis=1)
    distance = np.where(np.isfinite(distance), distance, along.mean(axis=1))
    met: Float = np.clip(distance, along.min(axis=1), along.max(axis=1))  # a ray that grazes meets no plane
    return met


def _result(distance: Float, face: Integer, index: Integer, max_range: float) -> tuple[Float, Integer]:
    """Return hits as indices of the given triangles, with hits beyond the range as misses."""
    hit = (face >= 0) & (distance <= max_range)
    triangle = np.full(len(face), -1, dtype=np.int64)
    triangle[hit] = index[face[hit]]
    return np.where(hit, distance, np.inf), triangle


@contextmanager
def _no_garbage_collection() -> Iterator[None]:
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()
