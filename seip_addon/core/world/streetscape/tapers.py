"""Tapers where the number of lanes changes: the edge of a road widens gradually, not in one step.

SUMO's netconvert adds a lane over a few metres of a joint between two roads. Here the narrower road is widened towards
the joint, together with pavements and other strips next to its outermost lane.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...arrays import Float
from ...geometry.plan import united
from ..opendrive.lanes import LaneSurface
from .road_surface import CARRIAGEWAY, by_road, group, inner_edge, outer_edge, with_rows_at

RATE = 10.0  # metres along the road for each metre that it widens
MIN_JUMP = 0.5  # metres: smaller jumps need no taper
MAX_JUMP = 8.0  # metres: larger jumps are not added lanes
MAX_SHARE = 0.9  # largest share of a road's length that its taper takes
TOUCH = 0.5  # metres between ends of roads that meet
MIN_MEDIAN = 4.0  # metres that remain to the next carriageway: otherwise a median would be closed
STEP = 5.0  # metres between the rows of a taper
Side = tuple[str, int, bool]
"""Id of a road, sign of the lane ids on one side, and whether it is the outer edge of that side."""


@dataclass(frozen=True, eq=False)
class _End:
    """End of one edge of a carriageway: its position, and the direction away from the carriageway."""

    side: Side
    s: float
    row: int
    edge: Float
    aside: Float


@dataclass(frozen=True)
class _Taper:
    """Widening at one edge of a road: ``jump`` metres at ``s``, linear to zero ``length`` metres away."""

    s: float
    jump: float
    length: float

    def widening(self, s: Float) -> Float:
        """Return the widening (n,) at places (n,) along the road, metres."""
        width: Float = self.jump * np.clip(1.0 - np.abs(s - self.s) / self.length, 0.0, 1.0)
        return width


def with_tapers(surfaces: Sequence[LaneSurface], joints: Mapping[str, str]) -> tuple[LaneSurface, ...]:
    """Return the lanes with edges that widen gradually towards joints where lanes are added or end.

    Parameters
    ----------
    surfaces : sequence of LaneSurface
        All lanes of a map made from centre lines.
    joints : mapping of str to str
        Joint of each road that lies in one. A joint is a junction where a street only continues.
    """
    tapers, links = _tapers(surfaces, joints)
    dense = [_with_rows(lane, tapers) for lane in surfaces]
    last_lanes = _last_lanes(dense)
    widened = []
    for lane in dense:
        for outer in (True, False):
            side = _side(lane, outer=outer)
            last = last_lanes.get((side, lane.section))
            if last is not None and len(lane.s) == len(last.s) and (side in tapers or side in links):
                shift = _shift(last, tapers.get(side, ()), links.get(side), outer=outer)
                lane = _widened(lane, shift, last, outer=outer)  # noqa: PLW2901 -- at one edge, then at the other
        widened.append(lane)
    return tuple(widened)


def _tapers(
    surfaces: Sequence[LaneSurface], joints: Mapping[str, str]
) -> tuple[dict[Side, list[_Taper]], dict[Side, Float]]:
    """Return the tapers of roads, and for roads within joints the straight line (2, 2) that an edge follows."""
    tapers: dict[Side, list[_Taper]] = {}
    roads = by_road([lane for lane in surfaces if group(lane) in CARRIAGEWAY])
    outside = [end for road, lanes in roads.items() if road not in joints for end in _ends(lanes)]
    tree = shapely.STRtree(shapely.points(np.array([end.edge for end in outside]).reshape(-1, 2)))
    carriageways = {road: united(lane.polygon for lane in lanes) for road, lanes in roads.items() if road not in joints}
    moved: dict[tuple[Side, int], Float] = {}
    joined = []
    # For each edge of a road within a joint find the ends of the edges outside that it connects, and how far sideways
    # the second lies from the first. The one farther inside belongs to the narrower road, which is widened by that
    # much, unless another carriageway is so near that the median would close.
    for road in sorted(joints.keys() & roads.keys()):
        for inside in _through(roads[road]):
            before, after = (_nearest(outside, tree, one, roads) for one in inside)
            if before is not None and after is not None and before.side != after.side:
                joined.append((inside, (before, after)))
                jump = float((after.edge - before.edge) @ _unit(before.aside + after.aside))
                narrow = before if jump > 0 else after
                if not MIN_JUMP <= abs(jump) <= MAX_JUMP or (narrow.side, narrow.row) in moved:
                    continue
                if not _meets(narrow, abs(jump) + MIN_MEDIAN, carriageways, {road, before.side[0], after.side[0]}):
                    moved[narrow.side, narrow.row] = narrow.edge + abs(jump) * narrow.aside
                    lanes = roads[narrow.side[0]]
                    whole = max(lane.s[-1] for lane in lanes) - min(lane.s[0] for lane in lanes)
                    taper = _Taper(narrow.s, abs(jump), min(RATE * abs(jump), MAX_SHARE * whole))
                    tapers.setdefault(narrow.side, []).append(taper)
    # Widened edges meet at the joint, but the roads within it still have their old edges: let these follow the straight
    # line between the ends outside. Several roads may run through a joint between the same two edges; the one with a
    # pavement, or nearest to the line, is the outermost and moves.
    walked = {_side(lane, outer=True) for lane in surfaces if group(lane) == "sidewalk"}
    nearest: dict[tuple[Side, ...], tuple[tuple[bool, float], Side, Float]] = {}
    for inside, outer in joined:
        line = np.array([moved.get((end.side, end.row), end.edge) for end in outer])
        gaps = [float((point - one.edge) @ one.aside) for point, one in zip(line, inside, strict=True)]
        sides = tuple(end.side for end in outer)
        changed = any((end.side, end.row) in moved for end in outer)
        rank = (inside[0].side not in walked, sum(gaps))  # the pavement goes with the edge
        if changed and max(gaps) <= MAX_JUMP and (sides not in nearest or rank < nearest[sides][0]):
            nearest[sides] = (rank, inside[0].side, line)
    return tapers, {side: line for _, side, line in nearest.values()}


def _through(lanes: Sequence[LaneSurface]) -> Iterator[tuple[_End, _End]]:
    """Yield both ends of each edge of a road."""
    ends = list(_ends(lanes))
    for side in dict.fromkeys(end.side for end in ends):
        first, last = (end for end in ends if end.side == side)
        yield first, last


def _ends(lanes: Sequence[LaneSurface]) -> Iterator[_End]:
    for sign in (1, -1):
        own = [lane for lane in lanes if _sign(lane) == sign]
        for row, section in ((0, min), (-1, max)):
            there = [lane for lane in own if lane.section == section(one.section for one in own)]
            for outer, which in ((True, max), (False, min)):
                if there:
                    lane = which(there, key=lambda one: abs(one.lane_id))
                    edges = inner_edge(lane)[row, :2], outer_edge(lane)[row, :2]
                    inside, edge = edges if outer else edges[::-1]
                    side = (lane.road_id, sign, outer)
                    yield _End(side, float(lane.s[row]), row, edge, _unit(edge - inside))


def _nearest(
    ends: Sequence[_End], tree: shapely.STRtree, inside: _End, roads: Mapping[str, Sequence[LaneSurface]]
) -> _End | None:
    """Return the end of a road outside that an end of a road within a joint meets, None without one."""
    for index in tree.query(shapely.Point(inside.edge).buffer(MAX_JUMP)):
        end: _End = ends[int(index)]
        across = [
            shapely.LineString([lane.left[end.row, :2], lane.right[end.row, :2]])
            for lane in roads[end.side[0]]
            if _sign(lane) == end.side[1] and lane.s[end.row] == end.s
        ]
        same_edge = end.side[2] == inside.side[2] and float(end.aside @ inside.aside) > 0.9
        if same_edge and shapely.union_all(across).distance(shapely.Point(inside.edge)) < TOUCH:
            return end
    return None


def _meets(end: _End, distance: float, carriageways: Mapping[str, BaseGeometry], own: Collection[str]) -> bool:
    """Return whether another carriageway lies within a distance of an edge's end."""
    outwards = shapely.LineString([end.edge + TOUCH * end.aside, end.edge + distance * end.aside])
    return any(road not in own and area.intersects(outwards) for road, area in carriageways.items())


def _last_lanes(surfaces: Sequence[LaneSurface]) -> dict[tuple[Side, int], LaneSurface]:
    """Return the last lane of the carriageway at each edge of each section of the roads."""
    found: dict[tuple[Side, int], LaneSurface] = {}
    for lane in surfaces:
        for outer in (True, False):
            key = (_side(lane, outer=outer), lane.section)
            if group(lane) in CARRIAGEWAY and (key not in found or _is_beyond(lane, found[key], outer=outer)):
                found[key] = lane
    return found


def _is_beyond(lane: LaneSurface, other: LaneSurface, *, outer: bool) -> bool:
    """Return whether a lane is nearer to an edge of the road than another lane."""
    return abs(lane.lane_id) > abs(other.lane_id) if outer else abs(lane.lane_id) < abs(other.lane_id)


def _widened(lane: LaneSurface, shift: Float, last: LaneSurface, *, outer: bool) -> LaneSurface:
    """Return a lane moved by `shift` (n, 3): the last lane at its outer edge only, lanes beyond it as a whole."""
    is_beyond = _is_beyond(lane, last, outer=outer)
    if not is_beyond and lane.lane_id != last.lane_id:
        return lane
    inner = inner_edge(lane) + shift * (is_beyond or not outer)
    return _with_edges(lane, inner, outer_edge(lane) + shift * (is_beyond or outer))


def _with_rows(lane: LaneSurface, tapers: Mapping[Side, Sequence[_Taper]]) -> LaneSurface:
    own = [taper for outer in (True, False) for taper in tapers.get(_side(lane, outer=outer), ())]
    if not own:
        return lane
    # A taper bends within a lane: without extra rows the edge would stay straight between the lane's own rows.
    places = [np.arange(one.s - one.length, one.s + one.length, STEP) for one in own]
    ends = [place for one in own for place in (one.s - one.length, one.s + one.length)]
    return with_rows_at(lane, np.concatenate([*places, ends]))


def _shift(lane: LaneSurface, tapers: Sequence[_Taper], line: Float | None, *, outer: bool) -> Float:
    """Return the displacement (n, 3) of the edge of the last lane of a carriageway, metres."""
    edge, inside = (outer_edge(lane), inner_edge(lane)) if outer else (inner_edge(lane), outer_edge(lane))
    if line is not None:
        along = (lane.s - lane.s[0]) / (lane.s[-1] - lane.s[0])
        target = line[0] + along[:, None] * (line[1] - line[0])
        return np.column_stack([target - edge[:, :2], np.zeros(len(edge))])
    aside = (edge - inside) * [1.0, 1.0, 0.0]
    aside /= np.maximum(np.linalg.norm(aside, axis=1), 1e-9)[:, None]
    by = np.sum([taper.widening(lane.s) for taper in tapers], axis=0)
    moved: Float = aside * by[:, None]
    return moved


def _with_edges(lane: LaneSurface, inner: Float, outer: Float) -> LaneSurface:
    return replace(lane, left=outer, right=inner) if lane.lane_id > 0 else replace(lane, left=inner, right=outer)


def _side(lane: LaneSurface, *, outer: bool) -> Side:
    return lane.road_id, _sign(lane), outer


def _sign(lane: LaneSurface) -> int:
    return 1 if lane.lane_id > 0 else -1


def _unit(vector: Float) -> Float:
    unit: Float = vector / (np.hypot(*vector) or 1.0)
    return unit
