"""What the streets of the shipped maps share: cross sections, profiles and the furniture along them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

from scenes.opendrive_writer import Corner, Cubic, Lane, Repeat, Road, RoadObject, Section, smooth_step, value_at

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

KERB = 0.12
LIGHT_SETBACK = 0.6  # metres from kerb to the axis of a street light


def street_side(lane_widths: Sequence[float], pavement: float) -> tuple[Lane, ...]:
    """Return driving lanes and pavement from the centre outwards."""
    marks = ["broken"] * (len(lane_widths) - 1) + ["solid"]
    driving = (Lane("driving", (Cubic(0.0, width),), mark=mark) for width, mark in zip(lane_widths, marks, strict=True))
    return (*driving, Lane("sidewalk", (Cubic(0.0, pavement),), KERB))


def parking_side(
    lane_widths: Sequence[float], pavement: float, parking: float, length: float, taper: float = 4.0
) -> tuple[Lane, ...]:
    """Return a side whose kerb gives way to a parking lane over the length of a section, so that houses stay put."""
    *driving, _ = street_side(lane_widths, pavement)
    opening = _there_and_back(0.0, parking, length, taper)
    narrowing = _there_and_back(pavement, pavement - parking, length, taper)
    return (*driving, Lane("parking", opening, mark="solid"), Lane("sidewalk", narrowing, KERB))


def _there_and_back(outside: float, inside: float, length: float, taper: float) -> tuple[Cubic, ...]:
    return (
        smooth_step(0.0, taper, outside, inside),
        Cubic(taper, inside),
        smooth_step(length - taper, taper, inside, outside),
    )


def linked(sections: Sequence[Section]) -> tuple[Section, ...]:
    """Return the sections with lanes linked: the first driving lane to the first driving lane, and so on."""
    nothing = Section(0.0, (), ())
    befores, afters = (nothing, *sections[:-1]), (*sections[1:], nothing)
    return tuple(
        replace(
            section,
            left=_linked_side(before.left, section.left, after.left, 1),
            right=_linked_side(before.right, section.right, after.right, -1),
        )
        for before, section, after in zip(befores, sections, afters, strict=True)
    )


def _linked_side(before: Sequence[Lane], lanes: Sequence[Lane], after: Sequence[Lane], sign: int) -> tuple[Lane, ...]:
    predecessors, successors = _by_kind(before, sign), _by_kind(after, sign)
    return tuple(
        replace(lane, predecessor=predecessors.get(key), successor=successors.get(key))
        for lane, key in zip(lanes, _by_kind(lanes, sign), strict=True)
    )


def _by_kind(lanes: Sequence[Lane], sign: int) -> dict[tuple[str, int], int]:
    """Return lane ids by type and rank among the lanes of that type, in order."""
    kinds = [lane.kind for lane in lanes]
    return {(kind, kinds[:index].count(kind)): sign * (index + 1) for index, kind in enumerate(kinds)}


def climb(grade: float, height: float = 0.0, level: float = 10.0, rounding: float = 20.0) -> tuple[Cubic, ...]:
    """Return a profile that leaves a junction level and climbs after a parabolic rounding."""
    if not grade:
        return (Cubic(0.0, height),)
    return (
        Cubic(0.0, height),
        Cubic(level, height, 0.0, grade / (2.0 * rounding)),
        Cubic(level + rounding, height + grade * rounding / 2.0, grade),
    )


def between(first: float, last: float, length: float, level: float = 12.0) -> tuple[Cubic, ...]:
    """Return a profile that leaves one height level and reaches another level."""
    return (
        Cubic(0.0, first),
        smooth_step(level, length - 2.0 * level, first, last),
        Cubic(length - level, last),
    )


class House(NamedTuple):
    """A building beside a road, in metres: stations, distances from the reference line, height of its walls."""

    side: int  # +1 left, -1 right of the reference line
    first: float
    last: float
    near: float
    far: float
    height: float


def buildings(road: Road, houses: Sequence[House], *, bent: bool = False) -> Iterator[RoadObject]:
    """Yield houses, numbered oddly on the left and evenly on the right.

    Their outlines stand in the object's own axes, or, along a bend, in the road's, so that fronts follow the street.
    """
    for side, start in ((1, 1), (-1, 2)):
        row = [house for house in houses if house.side == side]
        for number, house in enumerate(row):
            yield _building(road, f"{road.name} {start + 2 * number}", house, bent=bent)


def _building(road: Road, name: str, house: House, *, bent: bool) -> RoadObject:
    middle, offset = (house.first + house.last) / 2.0, (house.near + house.far) / 2.0
    length, depth = house.last - house.first, house.far - house.near
    front = (house.first, middle, house.last)
    # Houses are level, whatever the street does: they stand on the lowest ground beside them.
    feet = {s: value_at(road.elevation, s) for s in front}
    floor = min(feet.values())
    building = RoadObject(
        "building", name, middle, house.side * offset, house.height, size={"length": length, "width": depth}
    )
    if bent:
        near = [Corner(s, house.side * house.near, house.height, floor - feet[s]) for s in front]
        far = [Corner(s, house.side * house.far, house.height, floor - feet[s]) for s in reversed(front)]
        return replace(building, corners_road=(*near, *far))
    u, v = length / 2.0, depth / 2.0
    corners = tuple(Corner(a, b, house.height) for a, b in ((-u, -v), (u, -v), (u, v), (-u, v)))
    return replace(building, z_offset=floor - feet[middle], corners_local=corners)


def tree_row(name: str, row: Repeat, height: float) -> RoadObject:
    """Return a row of trees on the pavement."""
    return _row("tree", name, row, height, 0.28 * height)


def light_row(row: Repeat) -> RoadObject:
    """Return a row of street lights on the pavement."""
    return _row("streetLamp", "street light", row, 8.0, 0.1)


def _row(kind: str, name: str, row: Repeat, height: float, radius: float) -> RoadObject:
    return RoadObject(kind, name, row.start, row.offset, height, z_offset=KERB, size={"radius": radius}, repeat=row)


def garden_wall(name: str, first: float, last: float, offset: float, height: float = 1.6) -> RoadObject:
    """Return a wall along the road."""
    return RoadObject(
        "barrier",
        name,
        first,
        offset,
        height,
        subtype="wall",
        z_offset=KERB,
        size={"length": last - first, "width": 0.25},
        repeat=Repeat(first, last - first, 0.0, offset),
    )
