"""Small scenes with numerically hard rays."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from seip_addon.core.base.arrays import Float

HALF_SIDE = 10.0
"""Half of the side of the street of most scenes, metres."""

GROUND = 128
"""Number of ground triangles, which are the first of the street."""

STREET_YAW = 0.37
"""Rotation of the street about z, radians."""

ORIGIN = np.array([0.3, -0.2, 5.0])  # where rays start in most scenes


@dataclass(frozen=True, eq=False)
class HardScene:
    """A scene and rays.

    Parameters
    ----------
    triangles : (n, 3, 3) float64, metres
    origin : (3,) float64, metres
    directions : (r, 3) float64
        Unit vectors.
    """

    name: str
    triangles: Float
    origin: Float
    directions: Float


def hard_scenes(rays: int, random: np.random.Generator) -> list[HardScene]:
    """Return one scene of each kind of numerical difficulty."""
    street = _street()
    everywhere = _everywhere(rays, random)
    plain = HardScene("an ordinary street", street, ORIGIN, everywhere)
    doubled = np.concatenate([street, street])
    pavement = _square(HALF_SIDE, 5) + np.array([0.31, -0.17, 0.0])
    needles = _needles(120, random)
    gaps = street[random.random(len(street)) < 0.5]
    other_way = np.where((np.arange(len(street)) % 2 == 0)[:, None, None], street[:, ::-1], street)
    skewed = street * (-1.0, 1.0, 1e-3)
    return [
        plain,
        HardScene("rays along shared edges", street, ORIGIN, _towards(_on_inner_edges(street[:GROUND], rays, random))),
        HardScene("rays through vertices", street, ORIGIN, _towards(_inner_vertices(street[:GROUND], rays, random))),
        _grazing(rays, random),
        HardScene("duplicate faces", doubled, ORIGIN, everywhere),
        HardScene("coplanar faces", np.concatenate([street, pavement]), ORIGIN, everywhere),
        HardScene("slivers", needles, ORIGIN, _towards(needles[random.integers(0, len(needles), rays)].mean(axis=1))),
        HardScene("open meshes", gaps, ORIGIN, everywhere),
        HardScene("inside-out normals", other_way, ORIGIN, everywhere),
        HardScene("mirrored and badly scaled", skewed, ORIGIN * (-1.0, 1.0, 1e-3), everywhere),
        HardScene("tiny (20 mm wide)", street * 1e-3, ORIGIN * 1e-3, everywhere),
        HardScene("huge (20 km wide)", street * 1e3, ORIGIN * 1e3, everywhere),
    ]


def stored_far_away(scene: HardScene, distance: float) -> HardScene:
    """Return a scene rounded to float32 far from the origin, as Blender stores it, and moved back."""
    way = distance * np.array([1.0, -1.0, 0.0])
    stored = (scene.triangles + way).astype(np.float32).astype(np.float64)
    return replace(scene, triangles=stored - way)


def with_stray(scene: HardScene, distance: float) -> HardScene:
    """Return a scene with one additional triangle far away, as a forgotten mesh."""
    stray = np.array([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]]) + np.array([distance, 0.0, 0.0])
    return replace(scene, triangles=np.concatenate([scene.triangles, stray]))


def ordinary_scene(rays: int, random: np.random.Generator) -> HardScene:
    """Return a plain street without numerical difficulties."""
    return HardScene("an ordinary street", _street(), ORIGIN, _everywhere(rays, random))


def _street() -> Float:
    """Return a square of 128 triangles with four boxes on it, rotated so that no coordinate is a round number."""
    boxes = [_box((x, y), size) for x, y, size in ((4, 5, 2.0), (-6, 3, 1.0), (5, -6, 3.0), (-4, -5, 0.5))]
    cos, sin = np.cos(STREET_YAW), np.sin(STREET_YAW)
    turn = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
    street: Float = np.concatenate([_square(HALF_SIDE, 8), *boxes]) @ turn
    return street


def _square(half: float, parts: int) -> Float:
    line = np.linspace(-half, half, parts + 1)
    x, y = (values.ravel() for values in np.meshgrid(line[:-1], line[:-1], indexing="ij"))
    step = line[1] - line[0]
    corner = [np.column_stack([x + a * step, y + b * step, 0 * x]) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
    return np.concatenate([np.stack([corner[i] for i in face], axis=1) for face in ((0, 1, 2), (0, 2, 3))])


def _box(place: tuple[float, float], size: float) -> Float:
    corner = np.array([[(i >> axis) & 1 for axis in range(3)] for i in range(8)]) * size - (size / 2, size / 2, 0)
    quads = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
    faces = [face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))]
    triangles: Float = corner[np.array(faces)] + (*place, 0.0)
    return triangles


def _needles(count: int, random: np.random.Generator) -> Float:
    """Return triangles some metres long and 0.01 to 1 mm wide."""
    start = random.uniform((-HALF_SIDE, -HALF_SIDE, 0), (HALF_SIDE, HALF_SIDE, 3), (count, 3))
    along = random.normal(0, 3, (count, 3))
    width = 10 ** random.uniform(-5, -3, (count, 1)) * random.normal(0, 1, (count, 3))
    return np.stack([start, start + along, start + along / 2 + width], axis=1)


def _grazing(rays: int, random: np.random.Generator) -> HardScene:
    """Return a level road with rays that hit it at 0.06° to 6°."""
    road = _square(HALF_SIDE, 8) * (50.0, 1.0, 1.0)
    eye = np.array([-490.0, 0.1, 0.5])
    reach = np.minimum(eye[2] / np.tan(10 ** random.uniform(-3, -1, rays)), 950.0)
    aim = np.column_stack([eye[0] + reach, random.uniform(-HALF_SIDE, HALF_SIDE, rays), np.zeros(rays)])
    return HardScene("grazing rays", road, eye, _towards(aim, eye))


def _everywhere(rays: int, random: np.random.Generator) -> Float:
    directions = random.normal(0, 1, (rays, 3))
    directions[:, 2] = -np.abs(directions[:, 2])
    unit: Float = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    return unit


def _on_inner_edges(ground: Float, count: int, random: np.random.Generator) -> Float:
    """Return points on edges shared by two triangles, (count, 3): the diagonals of the squares."""
    which, share = random.integers(0, len(ground) // 2, count), random.random((count, 1))
    points: Float = ground[which, 0] * (1 - share) + ground[which, 2] * share
    return points


def _inner_vertices(ground: Float, count: int, random: np.random.Generator) -> Float:
    """Return corners of ground triangles that are not on the ground's border, (count, 3)."""
    corners = np.unique(ground.reshape(-1, 3), axis=0)
    inner = corners[np.linalg.norm(corners, axis=1) < HALF_SIDE * 0.99]
    picked: Float = inner[random.integers(0, len(inner), count)]
    return picked


def _towards(points: Float, eye: Float = ORIGIN) -> Float:
    way = points - eye
    unit: Float = way / np.linalg.norm(way, axis=1, keepdims=True)
    return unit
