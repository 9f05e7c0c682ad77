"""Objects of a map as parts of the site: buildings, trees, walls, posts and street lights."""

import math
from collections.abc import Iterable, Iterator

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...base.arrays import Float
from ...geometry.solids import Solid, block, fence
from ...site.roles import Role
from ...site.scene_geometry import FROM_MAP
from ..opendrive.objects import Outline, PlacedObject
from . import street_furniture
from .object_kinds import MAX_POST_THICKNESS, SIGN_WORDS, VAGUE_TYPES, Kind, Post, height_of, kind_of, post_of, size_of
from .parts import Part

MIN_HEIGHT = 0.2  # metres: lower outlines hide nothing that matters
POLE_HEIGHT, POLE_THICKNESS = 3.0, 0.08
"""Least height and thickness (metres) of posts that can carry a sensor: posts of traffic signs, 5 to 6 cm, cannot."""

LANDING_DEPTH = 2.0  # metres from the kerb that the ground in front of a crossing is deep
TREE_HEIGHT, CROWN_SHARE = 8.0, 0.6
MIN_CROWN_SHARE = 0.15  # width to height: more slender trees are given by their trunk, and get a crown by their height
LIGHT_HEIGHT, LIGHT_ARM = 8.0, 1.5
POST_RADIUS, FENCE_WIDTH = 0.06, 0.1
"""Sizes (metres) assumed for objects without sizes; the diameter of a crown is a share of the tree's height."""

MAX_FACADE_AREA = 200_000.0  # square metres of walls beyond which a building has no windows: there would be too many
FACADES = ("facade brick", "facade plaster", "facade sand", "facade grey")


def arm_heading(xy: Float, carriageway: BaseGeometry) -> float:
    """Return the heading (radians) from a point to the nearest carriageway; 0 on it."""
    line = shapely.shortest_line(shapely.Point(xy), carriageway)
    (x, y), (to_x, to_y) = shapely.get_coordinates(line)
    return math.atan2(to_y - y, to_x - x) if line.length > 0 else 0.0


def tree_part(name: str, foot: Float, height: float, crown_diameter: float, number: int) -> Part:
    """Return a tree; consecutive numbers differ in shape and rotation."""
    # Multiples of the golden angle never come close to each other: few trees look the same, however many there are.
    golden_turn = math.pi * (3 - math.sqrt(5))
    shape = street_furniture.tree(height, crown_diameter, number % 3)
    return Part(name, shape, (Role.OCCLUDERS,), _xyz(foot), number * golden_turn % math.tau)


def building_parts(name: str, base: Float, height: Float, number: int, shape: Solid | None = None) -> tuple[Part, ...]:
    """Return a building: a block on `base` (k, 3) of `height` (k,) metres, with windows if its eaves are level.

    A ``shape`` replaces the block and gets the same windows.
    """
    walls = shape or block(base, height, side=facade(number), cap="roof")
    building = Part(name, walls, (Role.OCCLUDERS,))
    level = np.ptp(base[:, 2]) < 0.1 and np.ptp(height) < 0.1
    walls_area = float(np.hypot(*np.diff(base[:, :2], axis=0, append=base[:1, :2]).T).sum()) * float(height[0])
    if not level or height[0] < street_furniture.STOREY_HEIGHT or walls_area > MAX_FACADE_AREA:
        return (building,)
    panes = street_furniture.windows(base[:, :2], float(base[0, 2]), float(height[0]))
    return (building, Part(f"{name} windows", panes, (Role.DRESSING,), of=name)) if panes.faces else (building,)


def facade(number: int) -> str:
    """Return the material of the walls of a building from its number."""
    return FACADES[number % len(FACADES)]


def object_parts(objects: Iterable[PlacedObject], carriageway: BaseGeometry) -> tuple[Part, ...]:
    """Return the parts for the objects of a map; flat ones (crossings, parking spaces) have none.

    Parameters
    ----------
    objects : iterable of PlacedObject
        Objects in local axes.
    carriageway : shapely geometry
        Carriageway that arms of street lights point to.
    """
    return tuple(part for number, placed in enumerate(objects) for part in _object(placed, number, carriageway))


def landings(objects: Iterable[PlacedObject]) -> Iterator[BaseGeometry]:
    """Yield the crossings of a map with the ground at their ends, in local axes.

    Each rectangle is extended along both of its axes, because it is unknown which of them leads across the road; the
    extension along the road lies on the carriageway.
    """
    for placed in objects:
        if placed.kind == "crosswalk":
            rings = [ring.base for ring in placed.outlines] or [footprint(placed) + placed.position]
            for ring in rings:
                corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(shapely.MultiPoint(ring[:, :2])))
                if len(corners) == 5:
                    yield from (_extended(corners[:4], side) for side in (corners[1:3], corners[2:4]))


def _extended(corners: Float, side: Float) -> BaseGeometry:
    """Return a rectangle (4, 2) extended by the depth of a landing at both ends of its side (2, 2)."""
    along = side[1] - side[0]
    by = LANDING_DEPTH * along / (np.hypot(*along) or 1.0)
    return shapely.MultiPoint(np.concatenate([corners + by, corners - by])).convex_hull


def is_trunk(placed: PlacedObject) -> bool:
    """Return whether what a map gives as the size of a tree can be no more than its trunk."""
    height, size = height_of(placed) or TREE_HEIGHT, size_of(placed)
    return kind_of(placed) is Kind.TREE and 0 < size < MIN_CROWN_SHARE * height


def can_carry(post: Post) -> bool:
    """Return whether a post is high and thick enough for a sensor; unknown sizes count as sufficient."""
    thick_enough = post.thickness == 0 or post.thickness >= POLE_THICKNESS
    return thick_enough and not post.words & SIGN_WORDS and (post.height or LIGHT_HEIGHT) >= POLE_HEIGHT


def pole_part(name: str, shape: Solid, foot: Float, heading: float, source: str) -> Part:
    """Return a post that can carry a sensor, with its arm at a heading; for ``source`` see `Part`."""
    return Part(name, shape, (Role.POLES,), _xyz(foot), heading, source=source)


def _object(placed: PlacedObject, number: int, carriageway: BaseGeometry) -> tuple[Part, ...]:
    """Return the parts of one object in local axes; ``number`` varies the appearance of equal objects."""
    kind, name = kind_of(placed), placed.name or f"{placed.kind} {placed.id}"
    height, size = height_of(placed), size_of(placed)
    if kind is Kind.FLAT:
        return ()
    if _is_single_tree(kind, height, size):
        height = height or TREE_HEIGHT
        crown = size if size and not is_trunk(placed) else CROWN_SHARE * height
        return (tree_part(name, _middle(placed), height, crown, number),)
    post = post_of(placed)
    if post is not None and (size <= MAX_POST_THICKNESS or not placed.outlines):
        return _post(name, placed, post, carriageway)
    if placed.outlines:
        return tuple(part for outline in placed.outlines for part in _outlined(placed, outline, name, number))
    if size <= 0 or placed.height < MIN_HEIGHT:
        return ()
    base = footprint(placed) + placed.position
    return _block(placed, name, number, base, np.full(len(base), placed.height))


def _is_single_tree(kind: Kind, height: float, size: float) -> bool:
    """Return whether an object is a single tree, not a row or a wood given by its whole extent."""
    if kind is Kind.TREE:
        return size <= (height or TREE_HEIGHT)
    return kind is Kind.PLANTS and size <= max(height, 1.0)


def _outlined(placed: PlacedObject, outline: Outline, name: str, number: int) -> tuple[Part, ...]:
    if outline.height.max() < MIN_HEIGHT:
        return ()
    height = np.maximum(outline.height, 0.0)
    if outline.closed and len(outline.base) >= 3:
        return _block(placed, name, number, outline.base, height)
    panels = fence(outline.base, height, placed.width or FENCE_WIDTH, side=_material(placed))
    return (Part(name, panels, (Role.OCCLUDERS,)),)


def _block(placed: PlacedObject, name: str, number: int, base: Float, height: Float) -> tuple[Part, ...]:
    if kind_of(placed) is Kind.BUILDING:
        return building_parts(name, base, height, number)
    return (Part(name, block(base, height, side=_material(placed)), (Role.OCCLUDERS,)),)


def _post(name: str, placed: PlacedObject, post: Post, carriageway: BaseGeometry) -> tuple[Part, ...]:
    if post.height == 0 and not post.is_lamp and placed.kind in VAGUE_TYPES:
        return ()  # the map gives only its name
    height = round(post.height or LIGHT_HEIGHT, 2)
    lit = post.is_lamp or "light" in name.lower()
    if lit and height >= POLE_HEIGHT:
        shape = street_furniture.street_light(height, LIGHT_ARM)
    else:
        shape = street_furniture.post(height, post.thickness / 2 or POST_RADIUS)
    role = Role.POLES if can_carry(post) else Role.OCCLUDERS
    heading = arm_heading(post.xy, carriageway)
    return (Part(name, shape, (role,), _xyz(_middle(placed)), heading, source=FROM_MAP if role is Role.POLES else ""),)


def _middle(placed: PlacedObject) -> Float:
    """Return the foot (3,) of a shape at the centre of an object."""
    return placed.outlines[0].base.mean(axis=0) if placed.outlines else placed.position


def footprint(placed: PlacedObject) -> Float:
    """Return the corners (k, 3) of an object's box or cylinder, relative to its position."""
    if placed.radius > 0:
        angle = np.arange(8) * (math.tau / 8)
        return np.column_stack([placed.radius * np.cos(angle), placed.radius * np.sin(angle), np.zeros(8)])
    x, y = (placed.length or placed.width) / 2, (placed.width or placed.length) / 2
    cos, sin = math.cos(placed.yaw), math.sin(placed.yaw)
    corners = np.array([[-x, -y], [x, -y], [x, y], [-x, y]]) @ np.array([[cos, sin], [-sin, cos]])
    return np.column_stack([corners, np.zeros(4)])


def _material(placed: PlacedObject) -> str:
    return "leaves" if kind_of(placed) in (Kind.TREE, Kind.PLANTS) else "wall"


def _xyz(point: Float) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in point)
    return x, y, z
