"""Write the maps of the shipped scenes: ``python -m scenes.author_maps`` from the root of the repository.

``junction.xodr``
    A four-arm signalised urban junction. Two lanes of 3.5 m each way on every arm, pavements of 2 to 4 m, the
    northern arm off the right angle by seven degrees, the western one climbing 1.5 %, the eastern one bending away.
    Its buildings, trees, walls and street lights stand in ``junction.toml``.
``corridor.xodr``
    An arterial street of 680 m with three signalised junctions, the middle one a T. Its buildings, trees and street
    lights are objects of the map.

Both places are invented, so the maps carry no geographic reference. The scenes are built from them by
``headless/build_scene.py``.
"""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from pathlib import Path

from scenes.alignment import Alignment, Piece, Pose, transition_curve
from scenes.junctions import Arm, connect, equip
from scenes.opendrive_writer import Cubic, Junction, Lane, Neighbour, Road, Section, opendrive

LANE = 3.5
KERB = 0.12


def main() -> None:
    """Write both maps beside this file."""
    folder = Path(__file__).parent
    for name, build in MAPS.items():
        (folder / name).write_bytes(build())


def junction_map() -> bytes:
    """Return the map of the four-arm junction."""
    arms = [
        _junction_arm("1", "East Street", 0.0, transition_curve(45.0, 20.0, 35.0, 120.0), (3.0, 3.0)),
        _junction_arm("2", "North Street", 83.0, (Piece(120.0),), (2.5, 2.0)),
        _junction_arm("3", "West Street", 180.0, (Piece(120.0),), (4.0, 3.0), grade=0.015),
        _junction_arm("4", "South Street", 268.0, transition_curve(70.0, 15.0, 20.0, -300.0), (3.5, 2.5)),
    ]
    phases = ((0, 2), (1, 3))
    connecting, junction = connect("100", "Central junction", [Arm(arm, "start") for arm in arms], phases)
    return _document("Four-arm signalised junction", [*arms, *connecting], [junction])


def _junction_arm(
    identity: str,
    name: str,
    azimuth: float,
    pieces: tuple[Piece, ...],
    pavements: tuple[float, float],
    grade: float = 0.0,
) -> Road:
    """Return a road that leads out from near (0, 0); pavements are those on the left and on the right of it."""
    start = Pose(0.0, 0.0, math.radians(azimuth)).moved(ahead=15.0)
    left, right = (_street_side(2, pavement) for pavement in pavements)
    road = Road(
        identity,
        name,
        Alignment(start, pieces).geometries(),
        (Section(0.0, left, right, "solid"),),
        _climb(grade),
        predecessor=Neighbour("junction", "100"),
    )
    return equip(road, "start")


def _street_side(lanes: int, pavement: float, lane_width: float = LANE) -> tuple[Lane, ...]:
    """Return driving lanes and pavement from the centre outwards."""
    marks = ["broken"] * (lanes - 1) + ["solid"]
    driving = tuple(Lane("driving", (Cubic(0.0, lane_width),), mark=mark) for mark in marks)
    return (*driving, Lane("sidewalk", (Cubic(0.0, pavement),), KERB))


def _climb(grade: float, level: float = 10.0, rounding: float = 20.0) -> tuple[Cubic, ...]:
    """Return a profile that leaves the junction level and climbs after a parabolic rounding."""
    if not grade:
        return (Cubic(0.0, 0.0),)
    return (
        Cubic(0.0, 0.0),
        Cubic(level, 0.0, 0.0, grade / (2.0 * rounding)),
        Cubic(level + rounding, grade * rounding / 2.0, grade),
    )


def _document(name: str, roads: Sequence[Road], junctions: Sequence[Junction]) -> bytes:
    """Return a map's file."""
    file = io.BytesIO()
    opendrive(name, roads, junctions).write(file, encoding="utf-8", xml_declaration=True)
    file.write(b"\n")
    return file.getvalue()


MAPS = {"junction.xodr": junction_map}

if __name__ == "__main__":
    main()
