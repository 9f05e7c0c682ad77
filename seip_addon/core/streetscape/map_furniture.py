"""Objects and signals of a map as parts of the site: buildings, trees, walls, lights and signal poles."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ..arrays import Float
from ..opendrive import Outline, PlacedObject, PlacedSignal
from . import street_furniture
from .parts import Part, Role
from .street_furniture import Solid
from .terrain import Terrain

FLAT_KINDS = {"crosswalk", "parkingspace", "roadmark", "roadsurface", "patch"}
PLANT_KINDS = {"tree", "vegetation"}
POST_KINDS = {"pole", "streetlamp"}
LEAST_HEIGHT = 0.2
"""Outlines lower than this (metres) hide nothing that matters."""
POLE_HEIGHT = 3.0
"""Posts from this height up can carry a sensor."""

TREE_HEIGHT, CROWN_SHARE = 8.0, 0.6
LIGHT_HEIGHT, LIGHT_ARM = 8.0, 1.5
POST_RADIUS, FENCE_WIDTH = 0.06, 0.1
"""Sizes (metres) of what a map gives no size; the crown's diameter as a share of the tree's height."""

SIGNAL_POLE_HEIGHT = 6.0
MAST_ARM = 4.5
KERB_CLEARANCE = 0.6
SAME_POLE = 3.0
"""Signals whose poles would stand nearer than this (metres) share one."""

FACADES = ("facade brick", "facade plaster", "facade sand", "facade grey")


def arm_heading(xy: Float, carriageway: BaseGeometry) -> float:
    """Return the heading (radians) from a point to the nearest carriageway; 0 on it."""
    line = shapely.shortest_line(shapely.Point(xy), carriageway)
    (x, y), (to_x, to_y) = shapely.get_coordinates(line)
    return math.atan2(to_y - y, to_x - x) if line.length > 0 else 0.0


def tree_part(name: str, foot: Float, height: float, crown_diameter: float, number: int) -> Part:
    """Return a tree; neighbours in number differ in shape and turn."""
    golden_turn = math.pi * (3 - math.sqrt(5))
    shape = street_furniture.tree(height, crown_diameter, number % 3)
    return Part(name, shape, (Role.OCCLUDERS,), _xyz(foot), number * golden_turn % math.tau)


def building_parts(name: str, base: Float, height: Float, number: int) -> tuple[Part, ...]:
    """Return a block (k, 3) raised by (k,) metres, and its windows where it is a house with level eaves."""
    walls = street_furniture.block(base, height, side=FACADES[number % len(FACADES)], cap="roof")
    block = Part(name, walls, (Role.OCCLUDERS,))
    level = np.ptp(base[:, 2]) < 0.1 and np.ptp(height) < 0.1
    if not level or height[0] < street_furniture.STOREY:
        return (block,)
    panes = street_furniture.windows(base[:, :2], float(base[0, 2]), float(height[0]))
    return (block, Part(f"{name} windows", panes, (Role.DRESSING,))) if panes.faces else (block,)


def object_parts(objects: Iterable[PlacedObject], origin: Float, carriageway: BaseGeometry) -> tuple[Part, ...]:
    """Return the parts for a map's objects; flat ones (crossings, parking spaces) have none.

    Parameters
    ----------
    objects : iterable of PlacedObject
        In map coordinates.
    origin : (3,) float64, metres
        Map coordinates of the local origin.
    carriageway : shapely geometry
        In local axes, for the arms of street lights.
    """
    return tuple(
        part for number, placed in enumerate(objects) for part in _object(_local(placed, origin), number, carriageway)
    )


def signal_parts(
    signals: Iterable[PlacedSignal], origin: Float, carriageway: BaseGeometry, terrain: Terrain
) -> tuple[Part, ...]:
    """Return signal poles for a map's traffic lights.

    A signal beside the carriageway is its pole; one over it hangs on a mast
    arm from the nearest place beside. Its height in the map is not used, as
    maps give posts below the road and lamps above it.
    """
    poles: list[tuple[Float, float, float, bool]] = []
    for signal in signals:
        if not signal.dynamic:
            continue
        foot, heading, arm = _pole_for(signal.position[:2] - origin[:2], signal.yaw, carriageway)
        if all(np.hypot(*(foot - other[0])) > SAME_POLE for other in poles):
            faces_left = math.sin(signal.yaw + math.pi - heading) >= 0  # the lamps look against the traffic
            poles.append((foot, heading, arm, faces_left))
    return tuple(
        pole_part(
            f"Signal pole {number}",
            street_furniture.signal_pole(SIGNAL_POLE_HEIGHT, arm, faces_left=faces_left),
            _on(foot, terrain),
            heading,
        )
        for number, (foot, heading, arm, faces_left) in enumerate(poles, start=1)
    )


def pole_part(name: str, shape: Solid, foot: Float, heading: float) -> Part:
    """Return a post that can carry a sensor, its arm turned to a heading."""
    return Part(name, shape, (Role.POLES,), _xyz(foot), heading)


def _pole_for(xy: Float, travel: float, carriageway: BaseGeometry) -> tuple[Float, float, float]:
    """Return foot, heading and length of the arm of the pole of a signal."""
    point = shapely.Point(xy)
    if carriageway.contains(point):
        edge = shapely.get_coordinates(shapely.shortest_line(point, shapely.boundary(carriageway)))[1]
        reach = float(np.hypot(*(edge - xy)))
        outwards = (edge - xy) / max(reach, 1e-9)
        foot = edge + KERB_CLEARANCE * outwards
        return foot, math.atan2(*-outwards[::-1]), round(max(reach + KERB_CLEARANCE, 1.0), 1)
    towards = arm_heading(xy, carriageway)
    across = travel + math.pi / 2  # the arm is square to the traffic
    heading = across if math.cos(across - towards) >= 0 else across + math.pi
    return xy, heading, MAST_ARM


def _local(placed: PlacedObject, origin: Float) -> PlacedObject:
    outlines = tuple(dataclasses.replace(outline, base=outline.base - origin) for outline in placed.outlines)
    return dataclasses.replace(placed, position=placed.position - origin, outlines=outlines)


def _object(placed: PlacedObject, number: int, carriageway: BaseGeometry) -> tuple[Part, ...]:
    """Return the parts of one object in local axes; ``number`` varies the looks of equal ones."""
    name = placed.name or f"{placed.kind} {placed.id}"
    size = max(placed.length, placed.width, 2 * placed.radius)
    if placed.kind in FLAT_KINDS:
        return ()
    if placed.outlines:
        return tuple(part for outline in placed.outlines for part in _outlined(placed, outline, name, number))
    if placed.kind in PLANT_KINDS and size <= max(placed.height, 1.0):
        height = placed.height or TREE_HEIGHT
        return (tree_part(name, placed.position, height, size or CROWN_SHARE * height, number),)
    if placed.kind in POST_KINDS or "lamp" in name.lower():
        return (_post(name, placed, carriageway),)
    if size == 0 or placed.height < LEAST_HEIGHT:
        return ()
    base = _footprint(placed) + placed.position
    return _block(placed, name, number, base, np.full(len(base), placed.height))


def _outlined(placed: PlacedObject, outline: Outline, name: str, number: int) -> tuple[Part, ...]:
    if outline.height.max() < LEAST_HEIGHT:
        return ()
    height = np.maximum(outline.height, 0.0)
    if outline.closed and len(outline.base) >= 3:
        return _block(placed, name, number, outline.base, height)
    panels = street_furniture.fence(outline.base, height, placed.width or FENCE_WIDTH, side=_material(placed))
    return (Part(name, panels, (Role.OCCLUDERS,)),)


def _block(placed: PlacedObject, name: str, number: int, base: Float, height: Float) -> tuple[Part, ...]:
    if placed.kind == "building" or "building" in name.lower():
        return building_parts(name, base, height, number)
    return (Part(name, street_furniture.block(base, height, side=_material(placed)), (Role.OCCLUDERS,)),)


def _post(name: str, placed: PlacedObject, carriageway: BaseGeometry) -> Part:
    height = round(placed.height or LIGHT_HEIGHT, 2)
    lit = placed.kind == "streetlamp" or "lamp" in name.lower() or "light" in name.lower()
    if lit and height >= POLE_HEIGHT:
        shape = street_furniture.street_light(height, LIGHT_ARM)
    else:
        shape = street_furniture.post(height, placed.radius or POST_RADIUS)
    role = Role.POLES if height >= POLE_HEIGHT else Role.OCCLUDERS
    return Part(name, shape, (role,), _xyz(placed.position), arm_heading(placed.position[:2], carriageway))


def _footprint(placed: PlacedObject) -> Float:
    """Return the corners (k, 3) of an object's box or cylinder about its position."""
    if placed.radius > 0:
        angle = np.arange(8) * (math.tau / 8)
        return np.column_stack([placed.radius * np.cos(angle), placed.radius * np.sin(angle), np.zeros(8)])
    x, y = (placed.length or placed.width) / 2, (placed.width or placed.length) / 2
    cos, sin = math.cos(placed.yaw), math.sin(placed.yaw)
    corners = np.array([[-x, -y], [x, -y], [x, y], [-x, y]]) @ np.array([[cos, sin], [-sin, cos]])
    return np.column_stack([corners, np.zeros(4)])


def _material(placed: PlacedObject) -> str:
    return "leaves" if placed.kind in PLANT_KINDS else "wall"


def _on(xy: Float, terrain: Terrain) -> Float:
    return np.array([*xy, *terrain.height(xy[None])])


def _xyz(point: Float) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in point)
    return x, y, z
