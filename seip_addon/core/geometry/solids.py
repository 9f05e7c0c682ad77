"""Solids as plain arrays of vertices and faces, with a material for each face."""

from dataclasses import dataclass

import numpy as np

from ..base.arrays import Float

POST_SIDES = 6


@dataclass(frozen=True, eq=False)
class Solid:
    """Vertices, and faces with a material each.

    Parameters
    ----------
    vertices : (n, 3) float64, metres
    faces : tuple of tuple of int
        Corners of each face, counter-clockwise seen from outside.
    materials : tuple of str
        Material of each face, a key of `scene.materials.COLOURS`.
    """

    vertices: Float
    faces: tuple[tuple[int, ...], ...]
    materials: tuple[str, ...]


def join(*solids: Solid) -> Solid:
    """Join several solids into one."""
    offsets = np.cumsum([0, *(len(solid.vertices) for solid in solids)])
    faces = [
        tuple(corner + int(offset) for corner in face)
        for solid, offset in zip(solids, offsets, strict=False)
        for face in solid.faces
    ]
    vertices = np.concatenate([solid.vertices for solid in solids]) if solids else np.empty((0, 3))
    return Solid(vertices, tuple(faces), tuple(name for solid in solids for name in solid.materials))


def from_faces(faces_xyz: Float, material: str) -> Solid:
    """Return (n, k, 3) triangles or quads as one solid with shared corners."""
    corners = faces_xyz.shape[1]
    vertices, index = np.unique(faces_xyz.reshape(-1, 3), axis=0, return_inverse=True)
    faces = tuple(map(tuple, index.reshape(-1, corners).tolist()))
    return Solid(vertices, faces, (material,) * len(faces))


def prism(outline: Float, base: float, top: float, *, side: str) -> Solid:
    """Return a vertical block of one material over an open outline (k, 2), between two heights (metres)."""
    floor = np.column_stack([outline, np.full(len(outline), base)])
    return block(floor, np.full(len(outline), top - base), side=side)


def block(base: Float, height: Float, *, side: str, cap: str | None = None) -> Solid:
    """Return the solid between an outline (k, 3) and the same outline raised by (k,) metres.

    Examples
    --------
    >>> base = np.array([[0.0, 0.0, 0.0], [8.0, 0.0, 0.0], [8.0, 5.0, 0.0], [0.0, 5.0, 0.0]])
    >>> house = block(base, height=np.full(4, 6.0), side="wall", cap="roof")
    >>> house.materials
    ('wall', 'wall', 'wall', 'wall', 'roof', 'wall')
    >>> house.vertices[list(house.faces[4])].tolist()
    [[0.0, 0.0, 6.0], [8.0, 0.0, 6.0], [8.0, 5.0, 6.0], [0.0, 5.0, 6.0]]
    """
    turned = signed_area(base) < 0
    ring, tall = (base[::-1], height[::-1]) if turned else (base, height)
    count = len(ring)
    upper = ring + tall[:, None] * [0, 0, 1]
    sides = [(i, (i + 1) % count, count + (i + 1) % count, count + i) for i in range(count)]
    faces = (*sides, tuple(range(count, 2 * count)), tuple(reversed(range(count))))
    return Solid(np.concatenate([ring, upper]), faces, (*([side] * count), cap or side, side))


def fence(base: Float, height: Float, thickness: float, *, side: str) -> Solid:
    """Return vertical panels along a path (k, 3), with heights (k,) and a thickness in metres."""
    panels = []
    for i in range(len(base) - 1):
        along = base[i + 1, :2] - base[i, :2]
        length = float(np.hypot(*along))
        if length > 0:
            aside = np.array([-along[1], along[0], 0.0]) / length * thickness / 2
            corners = np.array([base[i] - aside, base[i + 1] - aside, base[i + 1] + aside, base[i] + aside])
            panels.append(block(corners, height[[i, i + 1, i + 1, i]], side=side))
    return join(*panels)


def tube(start: Float, stop: Float, radii: tuple[float, float], material: str, *, sides: int = POST_SIDES) -> Solid:
    """Return a straight tapering tube between two points (3,), closed at the far end.

    Parameters
    ----------
    start, stop : (3,) float64, metres
    radii : pair of float, metres
        Radii at the two ends.
    """
    axis = (stop - start) / np.linalg.norm(stop - start)
    aside = np.array([0.0, 1.0, 0.0]) if abs(axis[1]) < 0.9 else np.array([1.0, 0.0, 0.0])
    across = np.cross(aside, axis) / np.linalg.norm(np.cross(aside, axis))
    second = np.cross(axis, across)
    angle = np.arange(sides) * (2 * np.pi / sides)
    circle = np.cos(angle)[:, None] * across + np.sin(angle)[:, None] * second
    vertices = np.concatenate([start + radii[0] * circle, stop + radii[1] * circle])
    around = [(i, (i + 1) % sides, sides + (i + 1) % sides, sides + i) for i in range(sides)]
    faces = (*around, tuple(range(sides, 2 * sides)))
    return Solid(vertices, faces, (material,) * len(faces))


def signed_area(outline: Float) -> float:
    """Return the area in plan of an outline (k, 2 or 3), positive if it is counter-clockwise."""
    x, y = (outline[:, :2] - outline[0, :2]).T
    return float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))) / 2
