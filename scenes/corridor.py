"""The map of an arterial street with three signalised junctions."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

from scenes.alignment import Alignment, Piece, Pose, transition_curve
from scenes.junctions import Arm, End, connect, equip
from scenes.opendrive_writer import Lane, Map, Neighbour, Repeat, Road, RoadObject, Section
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


class Stretch(NamedTuple):
    """A part of the arterial between two stations, with the junctions at its ends and a side for parking."""

    id: str
    stations: tuple[float, float]
    heights: tuple[float, float]
    ends: tuple[str | None, str | None]
    parking: int = 0


STRETCHES = (
    Stretch("1", (0.0, MILL - 11.0), (-0.6, 0.0), (None, "100")),
    Stretch("2", (MILL + 11.0, SCHOOL - 10.0), (0.0, 1.6), ("100", "200"), parking=-1),
    Stretch("3", (SCHOOL + 10.0, STATION - 15.0), (1.6, 0.9), ("200", "300"), parking=1),
    Stretch("4", (STATION + 15.0, ARTERIAL.length), (0.9, 1.5), ("300", None)),
)


class SideStreet(NamedTuple):
    """A street off the arterial: where, at which angle to it in degrees, and how far from its middle it begins."""

    id: str
    name: str
    junction: str
    station: float
    angle: float
    setback: float
    length: float
    height: float
    lanes: tuple[float, ...]
    grade: float = 0.0


SIDE_STREETS = (
    SideStreet("11", "Mill Lane North", "100", MILL, 90.0, 14.5, 75.0, 0.0, SIDE_LANES, grade=0.02),
    SideStreet("12", "Mill Lane South", "100", MILL, -95.0, 14.5, 75.0, 0.0, SIDE_LANES),
    SideStreet("13", "School Street", "200", SCHOOL, -82.0, 13.5, 80.0, 1.6, SIDE_LANES, grade=-0.01),
    SideStreet("14", "Station Road North", "300", STATION, 86.0, 15.0, 90.0, 0.9, LANES),
    SideStreet("15", "Station Road South", "300", STATION, -88.0, 15.0, 90.0, 0.9, LANES, grade=-0.012),
)


class Crossing(NamedTuple):
    """A junction with its arms, counter-clockwise, and those that have green together."""

    id: str
    name: str
    arms: tuple[tuple[str, End], ...]
    phases: tuple[tuple[int, ...], ...]


CROSSINGS = (
    Crossing(
        "100",
        "Mill Lane junction",
        (("2", "start"), ("11", "start"), ("1", "end"), ("12", "start")),
        ((0, 2), (1, 3)),
    ),
    Crossing("200", "School Street junction", (("3", "start"), ("2", "end"), ("13", "start")), ((0, 1), (2,))),
    Crossing(
        "300",
        "Station Road junction",
        (("4", "start"), ("14", "start"), ("3", "end"), ("15", "start")),
        ((0, 2), (1, 3)),
    ),
)


def corridor_map() -> Map:
    """Return the map; the first junction's centre is the origin."""
    stretches = [_furnish(_arterial(stretch)) for stretch in STRETCHES]
    roads = [*stretches, *(_side_street(street) for street in SIDE_STREETS)]
    of_id = {road.id: road for road in roads}
    connecting: list[Road] = []
    junctions = []
    for crossing in CROSSINGS:
        arms = tuple(Arm(of_id[road], contact) for road, contact in crossing.arms)
        roads_of_one, junction = connect(crossing.id, crossing.name, arms, phases=crossing.phases)
        connecting += roads_of_one
        junctions.append(junction)
    return Map("Arterial corridor", (*roads, *connecting), tuple(junctions))


def _arterial(stretch: Stretch) -> Road:
    """Return a stretch of the arterial, ready to meet the junctions at its ends."""
    line = ARTERIAL.cut(*stretch.stations)
    before, behind = stretch.ends
    road = Road(
        stretch.id,
        "High Street",
        line.geometries(),
        _parking_sections(line.length, stretch.parking) if stretch.parking else (_arterial_section(0.0, 0),),
        between(*stretch.heights, line.length),
        predecessor=Neighbour("junction", before) if before else None,
        successor=Neighbour("junction", behind) if behind else None,
    )
    road = equip(road, "start") if before else road
    return equip(road, "end") if behind else road


def _arterial_section(start: float, parking: int) -> Section:
    left, right = (street_side(LANES, PARKING_PAVEMENT if parking == side else PAVEMENT) for side in (1, -1))
    return Section(start, left, right, "solid")


def _parking_sections(length: float, parking: int, clear: float = 24.0) -> tuple[Section, ...]:
    """Return three sections, the middle one with a parking lane on the left (1) or right (-1)."""
    ends = _arterial_section(0.0, parking)
    bay = parking_side(LANES, PARKING_PAVEMENT, PARKING, length - 2.0 * clear)
    middle = replace(ends, start=clear, left=bay) if parking > 0 else replace(ends, start=clear, right=bay)
    return linked((ends, middle, replace(ends, start=length - clear)))


def _side_street(street: SideStreet) -> Road:
    start = ARTERIAL.pose(street.station).turned(math.radians(street.angle)).moved(ahead=street.setback)
    narrow = street.lanes == SIDE_LANES
    pavement = 2.5 if narrow else 3.0
    side = street_side(street.lanes, pavement)
    road = Road(
        street.id,
        street.name,
        Alignment(start, (Piece(street.length),)).geometries(),
        (Section(0.0, side, side, "broken" if narrow else "solid"),),
        climb(street.grade, street.height),
        predecessor=Neighbour("junction", street.junction),
        speed=30 if narrow else 50,
    )
    return _furnish_side_street(equip(road, "start"), sum(street.lanes), pavement)


def _furnish(road: Road) -> Road:
    """Return a stretch of the arterial with its houses, trees, street lights and what else stands there."""
    rows = []
    for side in (1, -1):
        parking = any(lane.kind == "parking" for section in road.sections for lane in _lanes(section, side))
        first, last = (32.0, road.length - 32.0) if parking else (16.0, road.length - 16.0)
        kerb = sum(LANES) + (PARKING if parking else 0.0)
        rows.append(light_row(Repeat(first, last - first, 28.0, side * (kerb + LIGHT_SETBACK))))
        if not parking:  # beside parking the pavement is too narrow for trees
            rows.append(tree_row("lime tree", Repeat(first + 7.0, last - first - 7.0, 14.0, side * (kerb + 1.1)), 7.0))
    houses = buildings(road, HOUSES[road.id], bent=len(road.geometries) > 1)
    return replace(road, objects=(*road.objects, *houses, *rows, *FURNITURE.get(road.id, ())))


def _lanes(section: Section, side: int) -> tuple[Lane, ...]:
    return section.left if side > 0 else section.right


def _furnish_side_street(road: Road, kerb: float, pavement: float) -> Road:
    """Return a side street with houses, trees on its left and street lights on its right."""
    front = kerb + pavement + 1.5
    houses = [house._replace(near=front + house.near, far=front + house.far) for house in HOUSES[road.id]]
    rows = (
        tree_row("maple", Repeat(18.0, road.length - 26.0, 11.0, kerb + 1.0), 5.5),
        light_row(Repeat(14.0, road.length - 19.0, 26.0, -kerb - LIGHT_SETBACK)),
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
    # Along the side streets the distances count from the line of their fronts.
    "11": (
        House(1, 19.0, 34.0, 0.0, 11.0, 11.0),
        House(1, 40.0, 58.0, 0.0, 13.0, 14.0),
        House(1, 63.0, 74.0, 3.0, 13.0, 7.0),
        House(-1, 19.0, 44.0, 0.0, 12.0, 13.0),
        House(-1, 52.0, 72.0, 0.0, 12.0, 9.0),
    ),
    "12": (
        House(1, 20.0, 48.0, 0.0, 12.0, 10.0),
        House(1, 55.0, 74.0, 4.0, 14.0, 7.0),
        House(-1, 19.0, 33.0, 0.0, 10.0, 12.0),
        House(-1, 38.0, 73.0, 1.0, 13.0, 15.0),
    ),
    "13": (
        House(1, 22.0, 40.0, 0.0, 12.0, 9.0),
        House(1, 47.0, 78.0, 2.0, 14.0, 12.0),
        House(-1, 22.0, 60.0, 5.0, 19.0, 11.0),
        House(-1, 66.0, 78.0, 0.0, 10.0, 7.0),
    ),
    "14": (
        House(1, 18.0, 44.0, 0.0, 14.0, 20.0),
        House(1, 52.0, 86.0, 2.0, 15.0, 14.0),
        House(-1, 18.0, 36.0, 0.0, 12.0, 16.0),
        House(-1, 42.0, 60.0, 0.0, 12.0, 13.0),
        House(-1, 68.0, 88.0, 3.0, 15.0, 18.0),
    ),
    "15": (
        House(1, 18.0, 33.0, 0.0, 11.0, 12.0),
        House(1, 39.0, 57.0, 0.0, 13.0, 15.0),
        House(1, 65.0, 88.0, 1.0, 13.0, 9.0),
        House(-1, 18.0, 52.0, 0.0, 14.0, 17.0),
        House(-1, 60.0, 86.0, 4.0, 16.0, 8.0),
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
