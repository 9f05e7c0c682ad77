"""Closed parts that bodies of road users are put together from: x forward, y left, z up, metres."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from ..arrays import Float, Integer

PROUD = 0.008
"""How far a pane stands before the face it lies on (metres), so that a ray meets the pane and not the face."""
PANE_DEPTH = 0.05
"""How far below that face its hidden tip lies (metres)."""


@dataclass(frozen=True, eq=False)
class Part:
    """A closed surface of one material.

    Parameters
    ----------
    triangles : (n, 3, 3) float64, metres
        Corners counter-clockwise seen from outside. Every edge belongs to two triangles.
    """

    triangles: Float
    material: str


def hull(outline: Float, material: str) -> Part:
    """Return the body between an outline seen from the side and its mirror image.

    Parameters
    ----------
    outline : (k, 3) float64, metres
        Corners in turn: x, z and half the width there. In x and z it may not cross itself.
    """
    x, z, half = outline.T
    right, left = np.column_stack([x, -half, z]), np.column_stack([x, half, z])
    return skin(right, left, material, cap=_triangulated(outline[:, :2]))


def skin(first: Float, second: Float, material: str, cap: Integer | None = None) -> Part:
    """Return the body between two rings of as many corners.

    Parameters
    ----------
    first, second : (k, 3) float64, metres
    cap : (m, 3) int64
        Triangles that fill a ring, in its own sense of turn; without it the ring is convex.
    """
    count = len(first)
    here = np.arange(count)
    after = (here + 1) % count
    filling = np.column_stack([np.zeros(count - 2, dtype=np.int64), here[1:-1], after[1:-1]]) if cap is None else cap
    sides = [np.column_stack([here, after, after + count]), np.column_stack([here, after + count, here + count])]
    return _closed(np.concatenate([first, second]), [*sides, filling[:, ::-1], filling + count], material)


def cone(ring: Float, tip: Float, material: str) -> Part:
    """Return the body between a convex ring (k, 3) and a point (3,)."""
    count = len(ring)
    here = np.arange(count)
    after = (here + 1) % count
    base = np.column_stack([np.zeros(count - 2, dtype=np.int64), here[1:-1], after[1:-1]])
    sides = np.column_stack([after, here, np.full(count, count)])
    return _closed(np.concatenate([ring, tip[None]]), [base, sides], material)


def box(low: tuple[float, float, float], high: tuple[float, float, float], material: str) -> Part:
    """Return the upright box between two corners."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    floor, ceiling = (np.array([[x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z]]) for z in (z0, z1))
    return skin(floor, ceiling, material)


def pane(face: Float, across: tuple[float, float], up: tuple[float, float], material: str) -> Part:
    """Return a flat piece of another material on a face: a window, a lamp.

    Its hidden side is a shallow tip inside the body, which closes it with few triangles.

    Parameters
    ----------
    face : (4, 3) float64, metres
        Lower left, lower right, upper right and upper left corner seen from outside.
    across, up : pair of float, 0 to 1
        What part of the face it covers.
    """
    u = np.array([across[0], across[1], across[1], across[0]])[:, None]
    v = np.array([up[0], up[0], up[1], up[1]])[:, None]
    ring = (1 - v) * ((1 - u) * face[0] + u * face[1]) + v * ((1 - u) * face[3] + u * face[2])
    normal = np.cross(ring[1] - ring[0], ring[3] - ring[0])
    normal /= np.linalg.norm(normal)
    return cone(ring + PROUD * normal, ring.mean(axis=0) - PANE_DEPTH * normal, material)


def face_across(low: Float, high: Float, *, front: bool) -> Float:
    """Return the face (4, 3) of a hull from one corner of its outline up to the next, seen from the front or rear."""
    sign = -1.0 if front else 1.0  # seen from the front the right-hand side of the vehicle is on the left
    (x0, z0, half0), (x1, z1, half1) = low, high
    return np.array([[x0, sign * half0, z0], [x0, -sign * half0, z0], [x1, -sign * half1, z1], [x1, sign * half1, z1]])


def side_faces(corners: Float) -> tuple[Float, Float]:
    """Return a face on a hull's right side and its mirror image on the left, (4, 3) each.

    Parameters
    ----------
    corners : (4, 3) float64, metres
        x, z and half the width of the rear lower, front lower, front upper and rear upper corner.
    """
    x, z, half = corners.T
    mirrored = np.array([1, 0, 3, 2])  # seen from the left the front is on the left
    return np.column_stack([x, -half, z]), np.column_stack([x, half, z])[mirrored]


def wheel(axle: float, outer: float, inner: float, radius: float, sides: int = 8) -> Part:
    """Return a tyre that stands on the ground, a flat of it downwards.

    Parameters
    ----------
    axle : float, metres
        x of the axle.
    outer, inner : float, metres
        y of its two sides.
    radius : float, metres
    """
    return skin(_disc(axle, outer, radius, radius, sides), _disc(axle, inner, radius, radius, sides), "tyre")


def rim(axle: float, outer: float, inwards: float, radius: float, sides: int = 5) -> Part:
    """Return the rim in a tyre's outer side; ``inwards`` is the y-direction of the vehicle's middle, 1 or -1."""
    ring = _disc(axle, outer - inwards * PROUD / 2, 0.58 * radius, radius, sides)
    return cone(ring, np.array([axle, outer + inwards * PANE_DEPTH, radius]), "rim")


def hoop(axle: float, radius: float, width: float, sides: int = 8) -> Part:
    """Return a thin tyre that one can see through: a ring of triangular section, as of a spoked wheel."""
    middle = _disc(axle, 0.0, radius, radius, sides)
    left, right = (_disc(axle, y, radius - width, radius, sides) for y in (width / 2, -width / 2))
    here = np.arange(sides)
    after = (here + 1) % sides
    faces = []
    for one, other in ((0, 1), (1, 2), (2, 0)):
        a, b = here + one * sides, after + one * sides
        c, d = after + other * sides, here + other * sides
        faces += [np.column_stack([a, b, c]), np.column_stack([a, c, d])]
    return _closed(np.concatenate([middle, left, right]), faces, "tyre")


def limb(start: Float, stop: Float, radii: tuple[float, float], material: str, sides: int = 4) -> Part:
    """Return a straight tapering bar between two points (3,)."""
    axis = (stop - start) / np.linalg.norm(stop - start)
    aside = np.array([0.0, 1.0, 0.0]) if abs(axis[1]) < 0.9 else np.array([1.0, 0.0, 0.0])
    across = np.cross(aside, axis)
    across /= np.linalg.norm(across)
    second = np.cross(axis, across)
    angle = (np.arange(sides) + 0.5) * (2 * np.pi / sides)
    circle = np.cos(angle)[:, None] * across + np.sin(angle)[:, None] * second
    return skin(start + radii[0] * circle, stop + radii[1] * circle, material)


def ball(middle: Float, radii: Float, material: str) -> Part:
    """Return an ellipsoid of 20 triangles: an icosahedron with a tip upwards."""
    angle = np.arange(5) * (2 * np.pi / 5)
    level, reach = 1 / 5**0.5, 2 / 5**0.5
    upper = np.column_stack([reach * np.cos(angle), reach * np.sin(angle), np.full(5, level)])
    lower = np.column_stack([reach * np.cos(angle + np.pi / 5), reach * np.sin(angle + np.pi / 5), np.full(5, -level)])
    here, after = np.arange(5), (np.arange(5) + 1) % 5
    faces = [
        np.column_stack([here, after, np.full(5, 10)]),
        np.column_stack([here, here + 5, after]),
        np.column_stack([after, here + 5, after + 5]),
        np.column_stack([after + 5, here + 5, np.full(5, 11)]),
    ]
    return _closed(np.concatenate([upper, lower, [[0, 0, 1], [0, 0, -1]]]) * radii + middle, faces, material)


def signed_volume(triangles: Float) -> float:
    """Return the volume that closed triangles (n, 3, 3) enclose, below zero where they are inside out."""
    inner = triangles - triangles[0, 0]
    return float(np.einsum("ij,ij->", inner[:, 0], np.cross(inner[:, 1], inner[:, 2]))) / 6


def _closed(vertices: Float, faces: list[Integer], material: str) -> Part:
    triangles = vertices[np.concatenate(faces)]
    return Part(triangles if signed_volume(triangles) > 0 else triangles[:, ::-1], material)


def _disc(x: float, y: float, radius: float, height: float, sides: int) -> Float:
    """Return the corners (sides, 3) of an upright disc whose lowest edge is level."""
    angle = (np.arange(sides) + 0.5) * (2 * np.pi / sides) - np.pi / 2
    return np.column_stack([x + radius * np.cos(angle), np.full(sides, y), height + radius * np.sin(angle)])


def _triangulated(ring: Float) -> Integer:
    """Return triangles (m, 3) of corners that fill a simple ring (k, 2), in its sense of turn."""
    number = {(x, y): index for index, (x, y) in enumerate(ring.tolist())}
    pieces = shapely.get_parts(shapely.constrained_delaunay_triangles(shapely.Polygon(ring)))
    corners = np.array([[number[x, y] for x, y in piece.exterior.coords[:3]] for piece in pieces])
    after = np.roll(ring, -1, axis=0)
    turn = np.sign((ring[:, 0] * after[:, 1] - ring[:, 1] * after[:, 0]).sum())
    a, b, c = ring[corners].transpose(1, 0, 2)
    turns = np.sign((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    return np.where((turns == turn)[:, None], corners, corners[:, ::-1])
