"""Objects of a site description as parts: buildings, walls, slabs, trees and posts."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import shapely

from ...base.arrays import Float
from ...geometry.solids import fence
from ...site.roles import Role
from ...site.scene_geometry import DESCRIBED
from . import street_furniture
from .description import Building, Poles, SiteDescription, Slab, Trees, Wall
from .map_furniture import POLE_HEIGHT, POST_RADIUS, arm_heading, building_parts, facade, pole_part, tree_part
from .parts import Part
from .site_ground import SiteGround


def described_parts(description: SiteDescription, street: SiteGround) -> list[Part]:
    """Return the parts of a description in local axes, standing on the ground."""
    names = Counter[str]()

    def numbered(name: str) -> str:
        names[name] += 1
        return f"{name} {names[name]}"

    parts: list[Part] = []
    for number, building in enumerate(description.buildings, start=1):
        parts += _building_parts(building, numbered("Building"), number, street)
    for wall in description.walls:
        foot = _on_ground(wall.line, street) + np.array([0.0, 0.0, wall.base])
        panels = fence(foot, np.full(len(foot), wall.height), wall.thickness, side=wall.material)
        parts.append(_with_item_source(Part(numbered(wall.name), panels, (Role.OCCLUDERS,)), wall))
    for slab in description.slabs:
        ground = float(street.terrain.height(shapely.get_coordinates(slab.outline)).min())
        plate = street_furniture.house(slab.outline, ground + slab.base, ground + slab.top, side=slab.material)
        parts.append(_with_item_source(Part(numbered(slab.name), plate, (Role.OCCLUDERS,)), slab))
    trees = [(foot, row) for row in description.trees for foot in _on_ground(row.positions, street)]
    parts += [
        _with_item_source(tree_part(f"Tree {number}", foot, row.height, row.crown_diameter, number), row)
        for number, (foot, row) in enumerate(trees, start=1)
    ]
    parts += _pole_parts(description, street)
    return parts


def _building_parts(building: Building, name: str, number: int, street: SiteGround) -> list[Part]:
    plan = shapely.get_coordinates(building.outline.exterior)[:-1]
    ground = float(street.terrain.height(plan).min()) + building.base
    base = np.column_stack([plan, np.full(len(plan), ground)])
    shape = None
    if building.outline.interiors:
        shape = street_furniture.house(building.outline, ground, ground + building.height, side=facade(number))
    made = building_parts(name, base, np.full(len(plan), building.height), number, shape)
    return [_with_item_source(part, building) for part in made]


def _with_item_source(part: Part, item: Building | Wall | Slab | Trees | Poles) -> Part:
    """Return a part with the source of its item; posts also with their rule, and without sensors if they carry none."""
    sourced = replace(part, source=item.source, height_assumed=item.height_assumed)
    if isinstance(item, Poles):
        return replace(sourced, keep_off=item.keep_off, roles=sourced.roles if item.carries else (Role.OCCLUDERS,))
    return sourced


def _pole_parts(description: SiteDescription, street: SiteGround) -> Iterator[Part]:
    for number, (foot, heading, row) in enumerate(_pole_places(description.street_lights, street), start=1):
        shape = street_furniture.street_light(row.height, row.arm)
        yield _with_item_source(pole_part(f"Street light {number}", shape, foot, heading, row.source), row)
    keeps_left = any(lane.keeps_left for lane in street.lanes)
    for number, (foot, heading, row) in enumerate(_pole_places(description.signal_poles, street), start=1):
        shape = street_furniture.signal_pole(row.height, row.arm, faces_left=not keeps_left)
        whose = "the site file" if row.source == DESCRIBED else f"the {row.source}"
        yield _with_item_source(pole_part(f"Signal pole {number} of {whose}", shape, foot, heading, row.source), row)
    for number, (foot, heading, row) in enumerate(_pole_places(description.posts, street), start=1):
        shape = street_furniture.post(row.height, POST_RADIUS)
        pole = _with_item_source(pole_part(f"{row.name} {number}", shape, foot, heading, row.source), row)
        yield pole if row.height >= POLE_HEIGHT else replace(pole, roles=(Role.OCCLUDERS,))


def _pole_places(rows: Sequence[Poles], street: SiteGround) -> Iterator[tuple[Float, float, Poles]]:
    """Yield foot, heading of the arm and row of each post."""
    for row in rows:
        for foot in _on_ground(row.positions, street):
            yield foot, arm_heading(foot[:2], street.roadside.carriageway) if row.heading is None else row.heading, row


def _on_ground(plan: Float, street: SiteGround) -> Float:
    return np.column_stack([plan, street.terrain.height(plan)])
