"""Buildings and street furniture as plain arrays, with few faces and true outlines.

Buildings and their windows are in place, in local axes. All other solids have their foot at the origin and z up; arms
reach along +x. Sizes are in metres.
"""

import numpy as np
import shapely

from ...base.arrays import Float
from ...geometry.solids import Solid, join, prism, signed_area, tube
from .terrain import triangulate

STOREY_HEIGHT = 3.2
WINDOW_SPACING = 3.4
WINDOW_OFFSET = 0.03  # metres between panes and wall, so that panes are drawn in front of it
_GRID = 1e-6  # metres that corners of outlines snap to


def house(outline: shapely.Polygon, base: float, top: float, *, side: str) -> Solid:
    """Return a building with a flat roof as a closed solid.

    Parameters
    ----------
    outline : Polygon
        Outline in plan, local axes; courtyards are its holes.
    base, top : float, metres
        Height of the floor and of the roof.
    side : str
        Material of the walls.
    """
    outline = shapely.set_precision(shapely.remove_repeated_points(outline), _GRID)
    corners, index = np.unique(triangulate(outline, least=0.0).reshape(-1, 2), axis=0, return_inverse=True)
    caps = [tuple(face) for face in index.reshape(-1, 3).tolist()]
    count = len(corners)
    # Edges between two triangles occur once in each direction. Those without the opposite one are the outline and its
    # courtyards, where walls stand; all triangles are counter-clockwise, so that walls face outwards.
    edges = dict.fromkeys(edge for face in caps for edge in zip(face, (*face[1:], face[0]), strict=True))
    walls = [(count + a, count + b, b, a) for a, b in edges if (b, a) not in edges]
    floors = [tuple(count + corner for corner in reversed(face)) for face in caps]
    materials = (*([side] * len(walls)), *(["roof"] * len(caps)), *([side] * len(floors)))
    vertices = np.concatenate([np.column_stack([corners, np.full(count, height)]) for height in (top, base)])
    return Solid(vertices, (*walls, *caps, *floors), materials)


def windows(outline: Float, base: float, height: float) -> Solid:
    """Return the window panes of a block: one in each bay of each storey, wide ones on the ground floor."""
    ring = outline[::-1] if signed_area(outline) < 0 else outline
    storeys = int(height / STOREY_HEIGHT + 0.1)  # a low top storey has windows too
    panes = [
        _panes(start, stop, base + storey * STOREY_HEIGHT, shop=storey == 0)
        for start, stop in zip(ring, np.roll(ring, -1, axis=0), strict=True)
        for storey in range(storeys)
    ]
    quads = np.concatenate([np.empty((0, 4, 3)), *panes])
    faces = tuple(map(tuple, np.arange(4 * len(quads)).reshape(-1, 4).tolist()))
    return Solid(quads.reshape(-1, 3), faces, ("glass",) * len(quads))


def street_light(height: float, arm: float) -> Solid:
    """Return a street light: a tapering post, an arm and a flat luminaire."""
    post = tube(np.array([0, 0, 0]), np.array([0, 0, height]), (0.09, 0.05), "steel")
    if arm <= 0:
        return join(post, _box([0, 0, height + 0.1], [0.45, 0.45, 0.2], "luminaire"))
    reach = tube(np.array([0, 0, height - 0.05]), np.array([arm, 0, height + 0.1]), (0.04, 0.03), "steel", sides=4)
    return join(post, reach, _box([arm + 0.2, 0, height + 0.08], [0.7, 0.28, 0.12], "luminaire"))


def signal_pole(height: float, arm: float, *, faces_left: bool = True) -> Solid:
    """Return a signal pole: a post with a head at eye level and, on a mast arm, one above the lane.

    Parameters
    ----------
    height, arm : float, metres
        Height of the post and length of the arm; a post without an arm has only the low head.
    faces_left : bool
        Whether the lamps face +y, left of the arm: towards drivers on the lane below it where traffic keeps right.
        Otherwise they face -y.
    """
    shaft = tube(np.array([0, 0, 0]), np.array([0, 0, height]), (0.11, 0.08), "steel")
    low = _signal_head([0, 0.26, min(2.6, height - 0.5)])
    if arm <= 0:
        pole = join(shaft, low)
    else:
        reach = tube(np.array([0, 0, height - 0.25]), np.array([arm, 0, height - 0.1]), (0.07, 0.04), "steel", sides=4)
        pole = join(shaft, low, reach, _signal_head([max(arm - 0.3, 0.3), 0.2, height - 0.45]))
    return pole if faces_left else _mirrored(pole)


def post(height: float, radius: float) -> Solid:
    """Return a plain post."""
    return tube(np.array([0, 0, 0]), np.array([0, 0, height]), (radius, radius), "steel")


def tree(height: float, crown_diameter: float, variant: int) -> Solid:
    """Return a tree: a trunk and an uneven crown.

    Parameters
    ----------
    height, crown_diameter : float, metres
    variant : int
        Seed of the crown's shape, so that neighbours differ.
    """
    crown_height = min(0.68 * height, 1.35 * crown_diameter)
    middle = height - crown_height / 2
    trunk = tube(np.array([0, 0, 0]), np.array([0, 0, middle]), (0.025 * height, 0.012 * height), "bark")
    random = np.random.default_rng(variant)
    directions, faces = _icosphere()
    bumps = 1.0 - 0.22 * random.random(len(directions))
    half = np.array([crown_diameter, crown_diameter, crown_height]) / 2
    shape = directions * bumps[:, None]
    low, high = shape.min(axis=0), shape.max(axis=0)
    shape = 2 * (shape - low) / (high - low) - 1  # bumps must not change the width and height of the crown
    crown = Solid(shape * half + [0, 0, middle], faces, ("leaves",) * len(faces))
    return join(trunk, crown)


def _panes(start: Float, stop: Float, floor: float, *, shop: bool) -> Float:
    """Return (n, 4, 3) panes of one storey of one side, counter-clockwise seen from outside."""
    along = stop - start
    length = float(np.hypot(*along))
    bays = int(length / WINDOW_SPACING)
    if bays == 0:
        return np.empty((0, 4, 3))
    along = along / length
    outwards = np.array([along[1], -along[0]])
    wide, sill, head = (0.82 * length / bays, 0.3, 2.7) if shop else (1.5, 0.95, 2.45)
    middles = (np.arange(bays) + 0.5) * length / bays
    low = start + outwards * WINDOW_OFFSET + (middles - wide / 2)[:, None] * along
    high = low + wide * along
    corners = np.stack([low, high, high, low], axis=1)
    heights = np.broadcast_to(floor + np.array([sill, sill, head, head]), (bays, 4))
    return np.concatenate([corners, heights[..., None]], axis=2)


def _box(middle: list[float], size: list[float], material: str) -> Solid:
    x, y, z = middle
    dx, dy, dz = np.asarray(size) / 2
    outline = np.array([[x - dx, y - dy], [x + dx, y - dy], [x + dx, y + dy], [x - dx, y + dy]])
    return prism(outline, z - dz, z + dz, side=material)


def _signal_head(middle: list[float]) -> Solid:
    """Return a head of three lamps that face +y."""
    x, y, z = middle
    lamps = [_lamp(x, y + 0.13, z + offset, colour) for offset, colour in ((0.3, "red"), (0, "amber"), (-0.3, "green"))]
    return join(_box(middle, [0.34, 0.24, 1.0], "signal housing"), *lamps)


def _lamp(x: float, y: float, z: float, colour: str) -> Solid:
    r = 0.11
    vertices = np.array([[x + r, y, z - r], [x - r, y, z - r], [x - r, y, z + r], [x + r, y, z + r]])
    return Solid(vertices, ((0, 1, 2, 3),), (f"{colour} lamp",))


def _mirrored(solid: Solid) -> Solid:
    """Return the solid with left and right of the arm exchanged."""
    return Solid(solid.vertices * [1, -1, 1], tuple(face[::-1] for face in solid.faces), solid.materials)


def _icosphere() -> tuple[Float, tuple[tuple[int, ...], ...]]:
    """Return the unit icosahedron with each face divided into four: 42 vertices, 80 faces."""
    golden = (1 + 5**0.5) / 2
    corners = [
        [-1, golden, 0], [1, golden, 0], [-1, -golden, 0], [1, -golden, 0],
        [0, -1, golden], [0, 1, golden], [0, -1, -golden], [0, 1, -golden],
        [golden, 0, -1], [golden, 0, 1], [-golden, 0, -1], [-golden, 0, 1],
    ]  # fmt: skip
    twenty = [
        (0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11),
        (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6), (7, 1, 8),
        (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9),
        (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1),
    ]  # fmt: skip
    points = [np.array(corner, dtype=np.float64) for corner in corners]
    middles: dict[tuple[int, int], int] = {}

    def middle(a: int, b: int) -> int:
        key = (min(a, b), max(a, b))
        if key not in middles:
            middles[key] = len(points)
            points.append(points[a] + points[b])
        return middles[key]

    faces: list[tuple[int, ...]] = []
    for a, b, c in twenty:
        ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
        faces += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
    directions = np.array(points)
    return directions / np.linalg.norm(directions, axis=1, keepdims=True), tuple(faces)
