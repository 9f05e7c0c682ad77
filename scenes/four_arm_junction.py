"""The map of the four-arm signalised junction."""

from __future__ import annotations

import math

from scenes.alignment import Alignment, Piece, Pose, transition_curve
from scenes.junctions import Arm, connect, equip
from scenes.opendrive_writer import Map, Neighbour, Road, Section
from scenes.streets import climb, street_side

LANES = (3.5, 3.5)
SETBACK = 15.0  # metres from the centre to where the arms begin


def junction_map() -> Map:
    """Return the map; its centre is the origin."""
    arms = [
        _arm("1", "East Street", 0.0, transition_curve(45.0, 20.0, 35.0, 120.0), pavements=(3.0, 3.0)),
        _arm("2", "North Street", 83.0, (Piece(120.0),), pavements=(2.5, 2.0)),
        _arm("3", "West Street", 180.0, (Piece(120.0),), pavements=(4.0, 3.0), grade=0.015),
        _arm("4", "South Street", 268.0, transition_curve(70.0, 15.0, 20.0, -300.0), pavements=(3.5, 2.5)),
    ]
    connecting, junction = connect(
        "100", "Central junction", [Arm(arm, "start") for arm in arms], phases=((0, 2), (1, 3))
    )
    return Map("Four-arm signalised junction", (*arms, *connecting), (junction,))


def _arm(  # an arm has these properties
    identity: str,
    name: str,
    azimuth: float,
    pieces: tuple[Piece, ...],
    *,
    pavements: tuple[float, float],
    grade: float = 0.0,
) -> Road:
    """Return a road that leads out at an azimuth (degrees); pavements are those on the left and on the right of it."""
    start = Pose(0.0, 0.0, math.radians(azimuth)).moved(ahead=SETBACK)
    left, right = (street_side(LANES, pavement) for pavement in pavements)
    road = Road(
        identity,
        name,
        Alignment(start, pieces).geometries(),
        (Section(0.0, left, right, "solid"),),
        climb(grade),
        predecessor=Neighbour("junction", "100"),
    )
    return equip(road, "start")
