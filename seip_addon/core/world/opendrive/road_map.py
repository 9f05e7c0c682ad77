"""Data model of a map: roads with profiles, lanes, objects and signals, and junctions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...base.arrays import Float
from .objects import PlacedObject, PlacedSignal
from .profile import FLAT, ZERO_PROFILE, LateralShape, Profile
from .reference_line import ReferenceLine

MIDDLE_STEP = 10.0  # metres along a road between the candidates for the middle of a map


@dataclass(frozen=True)
class Junction:
    """A junction by its ``id`` and its ``name``, which may be empty; ``kind`` is ``direct`` or ``virtual``, or ""."""

    id: str
    name: str
    kind: str = ""


@dataclass(frozen=True, eq=False)
class Lane:
    """One lane record of a lane section.

    Parameters
    ----------
    id : int
        Positive to the left of the centre lane, negative to the right.
    type : str
        Type as in the file: ``driving``, ``sidewalk``, ...
    level : bool
        Whether the lane keeps level instead of following superelevation and crossfall.
    width, border : Profile
        Profiles over metres along the road. A border is the offset of the outer edge from the centre lane and is used
        if there is no width.
    inner_height, outer_height : Profile
        Heights of the edges above the road surface, over metres along the road.
    """

    id: int
    type: str
    level: bool
    width: Profile
    border: Profile
    inner_height: Profile
    outer_height: Profile


@dataclass(frozen=True, eq=False)
class LaneSection:
    """Lanes from ``start`` to ``end``, metres along the road, each side from the centre outwards."""

    start: float
    end: float
    left: tuple[Lane, ...]
    right: tuple[Lane, ...]


@dataclass(frozen=True)
class RoadLink:
    """Link at an end of a road to a ``junction``, or to the ``start`` or ``end`` of a ``road``, by its id."""

    kind: str
    id: str
    contact: str = ""


@dataclass(frozen=True, eq=False)
class Road:
    """A road: its reference line in plan, and the profiles along it.

    Parameters
    ----------
    id, name : str
        Id and name as in the file; the name may be empty.
    elevation, lane_offset : Profile
        Profiles in metres over metres along the road.
    superelevation, left_crossfall, right_crossfall : Profile
        Profiles in radians over metres along the road. With superelevation above zero a road falls to the right; with
        crossfall above zero it falls outwards.
    shape : LateralShape
        Height of the surface above the plane given by these.
    sections : tuple of LaneSection
        Lane sections in order along the road.
    predecessor, successor : RoadLink or None
        Links at its start and at its end.
    """

    id: str
    name: str
    junction_id: str | None
    keeps_left: bool
    reference_line: ReferenceLine
    elevation: Profile
    superelevation: Profile = ZERO_PROFILE
    left_crossfall: Profile = ZERO_PROFILE
    right_crossfall: Profile = ZERO_PROFILE
    shape: LateralShape = FLAT
    lane_offset: Profile = ZERO_PROFILE
    sections: tuple[LaneSection, ...] = ()
    predecessor: RoadLink | None = None
    successor: RoadLink | None = None

    @property
    def length(self) -> float:
        """Length of the reference line in plan, metres."""
        return self.reference_line.end

    def frame(self, s: Float) -> RoadFrame:
        """Return the axes of the road at ``s``, (k,) metres along it; beyond an end those of the end."""
        s = np.clip(s, 0.0, self.length)
        x, y, heading = self.reference_line(s)
        return RoadFrame(
            origin=np.stack([x, y, self.elevation(s)], axis=-1),
            heading=heading,
            pitch=np.arctan(self.elevation.slope(s)),
            roll=self.superelevation(s),
        )

    def place(self, s: Float, t: Float) -> Float:
        """Return the points, (k, 3) metres, at ``s`` along and ``t`` to the left of the road, (k,) metres each."""
        frame = self.frame(s)
        return frame.origin + t[:, None] * frame.left


def lifted(points: Float, height: Float) -> Float:
    """Return points (k, 3) lifted straight up by (k,) metres, so that they stay where they are in plan."""
    return np.asarray(points + height[:, None] * np.array([0.0, 0.0, 1.0]))


@dataclass(frozen=True, eq=False)
class RoadFrame:
    """Moving axes of a road at k stations.

    Superelevation turns the road about its reference line, which itself climbs at the pitch of the elevation profile.

    Parameters
    ----------
    origin : (k, 3) float64, metres
        Points of the reference line in map coordinates.
    heading, pitch, roll : (k,) float64, radians
        Counter-clockwise from +x; positive uphill; positive falling to the right.
    """

    origin: Float
    heading: Float
    pitch: Float
    roll: Float

    @property
    def level_left(self) -> Float:
        """Unit vectors to the left of the road that stay level, (k, 3)."""
        return np.stack([-np.sin(self.heading), np.cos(self.heading), np.zeros_like(self.heading)], axis=-1)

    @property
    def left(self) -> Float:
        """Unit vectors to the left within the road surface, (k, 3)."""
        roll = self.roll[:, None]
        return np.asarray(np.cos(roll) * self.level_left + np.sin(roll) * self._unrolled_up)

    @property
    def up(self) -> Float:
        """Unit normals of the road surface, (k, 3)."""
        roll = self.roll[:, None]
        return np.asarray(np.cos(roll) * self._unrolled_up - np.sin(roll) * self.level_left)

    @property
    def _unrolled_up(self) -> Float:
        back = -np.sin(self.pitch)
        return np.stack([back * np.cos(self.heading), back * np.sin(self.heading), np.cos(self.pitch)], axis=-1)


@dataclass(frozen=True, eq=False)
class RoadMap:
    """Contents of an OpenDRIVE file.

    Parameters
    ----------
    name : str
        Name in the header, or the name of the file if there is none.
    header_offset : (4,) float64
        x, y, z in metres and heading in radians of the header's ``<offset>``. It is not applied: map coordinates are
        those of the file.
    geo_reference : str or None
        Projection as in the file, valid or not.
    roads : tuple of Road
        Roads in the order of the file.
    junctions : tuple of Junction
        Junctions in the order of the file.
    objects : tuple of PlacedObject
        Objects, with repeated ones as often as they are repeated.
    signals : tuple of PlacedSignal
        Traffic lights.
    attribution : tuple of str
        Credits in the header's ``<userData code="attribution">``.

    Examples
    --------
    A road of 100 m along x that climbs by 5 %, and the point 3.5 m to the right of it after 40 m:

    >>> from pathlib import Path
    >>> from seip_addon.core.world.opendrive.read import read_map
    >>> text = '''<OpenDRIVE><header name="Mill Lane"/><road id="1">
    ... <planView><geometry s="0" x="0" y="0" hdg="0" length="100"><line/></geometry></planView>
    ... <elevationProfile><elevation s="0" a="2" b="0.05" c="0" d="0"/></elevationProfile>
    ... <lanes><laneSection s="0"/></lanes></road></OpenDRIVE>'''
    >>> _ = Path("lane.xodr").write_text(text, encoding="utf-8")
    >>> (road,) = read_map("lane.xodr").roads
    >>> road.length, road.place(np.array([40.0]), np.array([-3.5])).round(3).tolist()
    (100.0, [[40.0, -3.5, 4.0]])
    """

    name: str
    header_offset: Float
    geo_reference: str | None
    roads: tuple[Road, ...]
    junctions: tuple[Junction, ...]
    objects: tuple[PlacedObject, ...] = ()
    signals: tuple[PlacedSignal, ...] = ()
    attribution: tuple[str, ...] = ()

    @cached_property
    def names(self) -> dict[str, str]:
        """Names of the streets by the ids of their roads, "" for roads without one."""
        return {road.id: road.name for road in self.roads}

    def junctions_with_roads(self) -> tuple[Junction, ...]:
        """Return the junctions that have roads, in the order of the file."""
        used = {road.junction_id for road in self.roads}
        return tuple(junction for junction in self.junctions if junction.id in used)

    def middle(self) -> tuple[float, float]:
        """Return x and y (metres) of the point on a reference line nearest to the middle of the map."""
        lines = [road.frame(np.linspace(0.0, road.length, 2 + int(road.length / MIDDLE_STEP))) for road in self.roads]
        plan = np.concatenate([line.origin[:, :2] for line in lines])
        from_middle = plan - (plan.min(axis=0) + plan.max(axis=0)) / 2
        x, y = plan[np.argmin(np.hypot(*from_middle.T))].tolist()
        return x, y
