"""The map of an arterial street with three signalised junctions."""

from __future__ import annotations

import math
from dataclasses import replace

from scenes.alignment import Alignment, Piece, Pose, transition_curve
from scenes.junctions import Arm, connect, equip
from scenes.opendrive_writer import Lane, Map, Neighbour, Road, RoadObject, Section
from scenes.streets import (
    KERB,
    LIGHT_SETBACK,
    House,
    between,
    buildings,
    climb,
    garden_wall,
    light_row,
    linked,
    parking_side,
    street_side,
    tree_row,
)

ARTERIAL = Alignment(
    Pose(-110.0, 0.0, 0.0),
    (*transition_curve(160.0, 25.0, 40.0, 180.0), *transition_curve(100.0, 25.0, 45.0, -220.0, rest=235.0)),
)
MILL, SCHOOL, STATION = 110.0, 310.0, 540.0  # stations of the junctions, named after their side streets
LANES = (3.5, 3.5)
SIDE_LANES = (3.25,)
PAVEMENT = 3.5
PARKING_PAVEMENT = 4.5  # beside a parking lane 2.2 m of it are given up
PARKING = 2.2


def corridor_map() -> Map:
    """Return the map; the first junction's centre is the origin."""
    west = _furnish(_arterial("1", (0.0, MILL - 11.0), (-0.6, 0.0), (None, "100")))
    middle = _furnish(_arterial("2", (MILL + 11.0, SCHOOL - 10.0), (0.0, 1.6), ("100", "200"), parking=-1))
    inner = _furnish(_arterial("3", (SCHOOL + 10.0, STATION - 15.0), (1.6, 0.9), ("200", "300"), parking=1))
    east = _furnish(_arterial("4", (STATION + 15.0, ARTERIAL.length), (0.9, 1.5), ("300", None)))
    mill_north = _side_street("11", "Mill Lane North", (MILL, 90.0, 14.5, 75.0), "100", 0.0, SIDE_LANES, grade=0.02)
    mill_south = _side_street("12", "Mill Lane South", (MILL, -95.0, 14.5, 75.0), "100", 0.0, SIDE_LANES)
    school = _side_street("13", "School Street", (SCHOOL, -82.0, 13.5, 80.0), "200", 1.6, SIDE_LANES, grade=-0.01)
    north = _side_street("14", "Station Road North", (STATION, 86.0, 15.0, 90.0), "300", 0.9, LANES)
    south = _side_street("15", "Station Road South", (STATION, -88.0, 15.0, 90.0), "300", 0.9, LANES, grade=-0.012)
    junctions = (
        connect(
            "100",
            "Mill Lane junction",
            (Arm(middle, "start"), Arm(mill_north, "start"), Arm(west, "end"), Arm(mill_south, "start")),
            phases=((0, 2), (1, 3)),
        ),
        connect(
            "200",
            "School Street junction",
            (Arm(inner, "start"), Arm(middle, "end"), Arm(school, "start")),
            phases=((0, 1), (2,)),
        ),
        connect(
            "300",
            "Station Road junction",
            (Arm(east, "start"), Arm(north, "start"), Arm(inner, "end"), Arm(south, "start")),
            phases=((0, 2), (1, 3)),
        ),
    )
    roads = [west, middle, inner, east, mill_north, mill_south, school, north, south]
    connecting = [road for roads_of_one, _ in junctions for road in roads_of_one]
    return Map("Arterial corridor", (*roads, *connecting), tuple(junction for _, junction in junctions))


def _arterial(
    identity: str,
    stations: tuple[float, float],
    heights: tuple[float, float],
    ends: tuple[str | None, str | None],
    parking: int = 0,
) -> Road:
    """Return a stretch of the arterial between two stations, with the junctions at its ends and a parking side."""
    line = ARTERIAL.cut(*stations)
    road = Road(
        identity,
        "High Street",
        line.geometries(),
        _parking_sections(line.length, parking) if parking else (_arterial_section(0.0, 0),),
        between(*heights, line.length),
        predecessor=Neighbour("junction", ends[0]) if ends[0] else None,
        successor=Neighbour("junction", ends[1]) if ends[1] else None,
    )
    road = equip(road, "start") if ends[0] else road
    return equip(road, "end") if ends[1] else road


def _arterial_section(start: float, parking: int) -> Section:
    left, right = (street_side(LANES, PARKING_PAVEMENT if parking == side else PAVEMENT) for side in (1, -1))
    return Section(start, left, right, "solid")


def _parking_sections(length: float, parking: int, clear: float = 24.0) -> tuple[Section, ...]:
    """Return three sections, the middle one with a parking lane on the left (1) or right (-1)."""
    ends = _arterial_section(0.0, parking)
    bay = parking_side(LANES, PARKING_PAVEMENT, PARKING, length - 2.0 * clear)
    middle = replace(ends, start=clear, left=bay) if parking > 0 else replace(ends, start=clear, right=bay)
    return linked((ends, middle, replace(ends, start=length - clear)))


def _side_street(  # noqa: PLR0913  # a street has these properties
    identity: str,
    name: str,
    course: tuple[float, float, float, float],
    junction: str,
    height: float,
    lanes: tuple[float, ...],
    grade: float = 0.0,
) -> Road:
    """Return a street off the arterial; its course is station, angle to the arterial (degrees), set-back and length."""
    station, angle, setback, length = course
    start = ARTERIAL.pose(station).turned(math.radians(angle)).moved(ahead=setback)
    pavement = 2.5 if lanes == SIDE_LANES else 3.0
    side = street_side(lanes, pavement)
    road = Road(
        identity,
        name,
        Alignment(start, (Piece(length),)).geometries(),
        (Section(0.0, side, side, "broken" if lanes == SIDE_LANES else "solid"),),
        climb(grade, height),
        predecessor=Neighbour("junction", junction),
        speed=30 if lanes == SIDE_LANES else 50,
    )
    return _furnish_side_street(equip(road, "start"), sum(lanes), pavement)


def _furnish(road: Road) -> Road:
    """Return a stretch of the arterial with its houses, trees, street lights and what else stands there."""
    rows = []
    for side in (1, -1):
        parking = any(lane.kind == "parking" for section in road.sections for lane in _lanes(section, side))
        first, last = (32.0, road.length - 32.0) if parking else (16.0, road.length - 16.0)
        kerb = sum(LANES) + (PARKING if parking else 0.0)
        rows.append(light_row("street light", first, last, 28.0, side * (kerb + LIGHT_SETBACK)))
        if not parking:  # beside parking the pavement is too narrow for trees
            rows.append(tree_row("lime tree", first + 7.0, last, 14.0, side * (kerb + 1.1), 7.0))
    houses = buildings(road, HOUSES[road.id], bent=len(road.geometries) > 1)
    return replace(road, objects=(*road.objects, *houses, *rows, *FURNITURE.get(road.id, ())))


def _lanes(section: Section, side: int) -> tuple[Lane, ...]:
    return section.left if side > 0 else section.right


def _furnish_side_street(road: Road, kerb: float, pavement: float) -> Road:
    """Return a side street with houses, trees on its left and street lights on its right."""
    front = kerb + pavement + 1.5
    houses = (
        House(1, 19.0, 34.0, front, front + 11.0, 11.0),
        House(1, 40.0, 58.0, front, front + 13.0, 14.0),
        House(1, 63.0, 74.0, front + 3.0, front + 13.0, 7.0),
        House(-1, 19.0, 44.0, front, front + 12.0, 13.0),
        House(-1, 52.0, 72.0, front, front + 12.0, 9.0),
    )
    rows = (
        tree_row("maple", 18.0, road.length - 8.0, 11.0, kerb + 1.0, 5.5),
        light_row("street light", 14.0, road.length - 5.0, 26.0, -kerb - LIGHT_SETBACK),
    )
    return replace(road, objects=(*road.objects, *buildings(road, houses), *rows))


HOUSES = {
    "1": (
        House(1, 3.0, 24.0, 12.0, 26.0, 12.0),
        House(1, 30.0, 52.0, 14.0, 27.0, 15.0),
        House(1, 58.0, 74.0, 12.0, 24.0, 9.0),
        House(1, 79.0, 97.0, 12.0, 24.0, 16.0),
        House(-1, 2.0, 30.0, 11.5, 25.0, 18.0),
        House(-1, 38.0, 60.0, 16.0, 28.0, 8.0),
        House(-1, 66.0, 97.0, 11.5, 25.0, 20.0),
    ),
    "2": (
        House(1, 4.0, 32.0, 12.0, 25.0, 18.0),
        House(1, 38.0, 60.0, 12.0, 24.0, 12.0),
        House(1, 68.0, 96.0, 14.0, 27.0, 15.0),
        House(1, 104.0, 122.0, 12.0, 24.0, 9.0),
        House(1, 128.0, 168.0, 12.0, 26.0, 17.0),
        House(-1, 4.0, 30.0, 13.0, 26.0, 14.0),
        House(-1, 36.0, 66.0, 13.0, 26.0, 18.0),
        House(-1, 74.0, 92.0, 17.0, 28.0, 8.0),
        House(-1, 98.0, 128.0, 13.0, 26.0, 12.0),
        House(-1, 136.0, 172.0, 13.0, 25.0, 16.0),
    ),
    "3": (
        House(1, 2.0, 30.0, 13.0, 26.0, 14.0),
        House(1, 36.0, 58.0, 13.0, 26.0, 19.0),
        House(1, 66.0, 90.0, 13.0, 26.0, 12.0),
        House(1, 98.0, 120.0, 17.0, 28.0, 9.0),
        House(1, 128.0, 156.0, 13.0, 26.0, 16.0),
        House(1, 164.0, 198.0, 13.0, 26.0, 20.0),
        House(-1, 6.0, 28.0, 12.0, 25.0, 15.0),
        House(-1, 34.0, 60.0, 12.0, 25.0, 10.0),
        House(-1, 70.0, 94.0, 12.0, 25.0, 17.0),
        House(-1, 100.0, 118.0, 15.0, 27.0, 8.0),
        House(-1, 124.0, 150.0, 12.0, 25.0, 14.0),
        House(-1, 158.0, 198.0, 12.0, 25.0, 18.0),
    ),
    "4": (
        House(1, 3.0, 26.0, 12.0, 25.0, 17.0),
        House(1, 34.0, 56.0, 12.0, 25.0, 12.0),
        House(1, 62.0, 90.0, 14.0, 27.0, 15.0),
        House(1, 96.0, 122.0, 12.0, 25.0, 10.0),
        House(-1, 3.0, 28.0, 12.0, 25.0, 14.0),
        House(-1, 35.0, 50.0, 12.0, 25.0, 9.0),
        House(-1, 58.0, 84.0, 12.0, 25.0, 18.0),
        House(-1, 92.0, 120.0, 16.0, 28.0, 8.0),
    ),
}

FURNITURE = {
    "1": (garden_wall("garden wall", 36.0, 62.0, -10.8),),
    "2": (RoadObject("obstacle", "advertising column", 20.0, 9.6, 3.2, z_offset=KERB, size={"radius": 0.7}),),
    "3": (
        RoadObject("obstacle", "bus shelter", 112.0, -9.4, 2.6, z_offset=KERB, size={"length": 4.0, "width": 1.4}),
        garden_wall("garden wall", 96.0, 122.0, 12.0),
    ),
    "4": (garden_wall("garden wall", 90.0, 122.0, -10.8),),
}
