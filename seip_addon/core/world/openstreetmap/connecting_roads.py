"""Repair of maps written by netconvert whose roads do not meet at junctions.

netconvert cuts each road where its junction begins. Where nodes of a street lie close together, as in a roundabout, the
cut road may turn back over its last piece; its connecting road is then a straight line across the island or the corner.
Lanes of a junction that end in one lane all widen to its width, so that the edge of the carriageway jumps there.
"""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

MAX_TURN_BACK = math.radians(120.0)  # between two pieces of a road: a sharper turn is an error of the cut
MAX_MISFIT = math.radians(20.0)  # between a connecting road and the road that it leads from or into
MAX_SWING = math.radians(80.0)  # between the chord of a curve and its ends: others would swing out, and stay as is
MAX_STUB = 1.0  # metres of a road beyond a curve that turns back
MIN_LENGTH = 0.5  # metres: shorter connecting roads are left as they are
CURVE_STEPS = 64  # straight pieces by which the length of a curve is measured

_ROAD = re.compile(r"<road .*?</road>", re.DOTALL)
_PIECE = re.compile(r"<geometry ([^>]*)>(.*?)</geometry>", re.DOTALL)
_PLAN = re.compile(r"<planView>.*?</planView>", re.DOTALL)
_LANE = re.compile(r'<lane id="(-?\d+)"[^>]*>.*?</lane>', re.DOTALL)
_WIDTH = re.compile(r"<width [^>]*/>")
_HEIGHT = re.compile(r"<elevation [^>]*/>")
_ATTRIBUTE = re.compile(r'(\w+)="([^"]*)"')
_LINK = re.compile(r'<(predecessor|successor) elementType="road" elementId="([^"]*)" contactPoint="(\w+)"/>')
_LANE_LINK = re.compile(r'<(predecessor|successor) id="(-?\d+)"/>')


@dataclass(frozen=True)
class _Frame:
    """Position on a reference line, metres, and its heading, radians."""

    x: float
    y: float
    heading: float

    def aside(self, t: float) -> "_Frame":
        """Return the frame ``t`` metres to the left."""
        return replace(self, x=self.x - t * math.sin(self.heading), y=self.y + t * math.cos(self.heading))


@dataclass(frozen=True)
class _Piece:
    """One ``<geometry>`` of the file: its attributes and the text of its inner element."""

    start: _Frame
    length: float
    shape: str

    @property
    def end(self) -> _Frame:
        """End of the piece, which is a line or a cubic curve over a parameter from 0 to 1."""
        given = {key: float(value) for key, value in _ATTRIBUTE.findall(self.shape) if key != "pRange"}
        if not given:
            u, v, along, aside = self.length, 0.0, 1.0, 0.0
        else:
            u, v = (sum(given[f"{term}{axis}"] for term in "abcd") for axis in "UV")
            along, aside = (given[f"b{axis}"] + 2 * given[f"c{axis}"] + 3 * given[f"d{axis}"] for axis in "UV")
        cos, sin = math.cos(self.start.heading), math.sin(self.start.heading)
        heading = self.start.heading + math.atan2(aside, along)
        return _Frame(self.start.x + cos * u - sin * v, self.start.y + sin * u + cos * v, heading)


@dataclass(frozen=True)
class _Road:
    """A road of the map.

    Parameters
    ----------
    text : str
        Text of its element.
    pieces : tuple of _Piece
        Pieces of the reference line.
    is_cut : bool
        Whether pieces that turned back were removed.
    links : dict of str to (str, str)
        Id and end of the road at its ``predecessor`` and its ``successor``.
    widths : dict of int to (float, float)
        Widths of each lane at the start and at the end of the road, metres.
    """

    text: str
    pieces: tuple[_Piece, ...]
    is_cut: bool
    links: Mapping[str, tuple[str, str]]
    widths: Mapping[int, tuple[float, float]]

    @property
    def in_junction(self) -> bool:
        """Whether the road connects others within a junction."""
        return 'junction="-1"' not in self.text.split(">", 1)[0]

    @property
    def length(self) -> float:
        """Length of the reference line, metres."""
        return sum(piece.length for piece in self.pieces)

    def inner_edge(self, lane: int, end: int) -> float:
        """Offset of the inner edge of a lane to the left of the reference line, metres, at its start (0) or end (1)."""
        side = 1 if lane > 0 else -1
        return side * sum(self.widths.get(side * number, (0.0, 0.0))[end] for number in range(1, abs(lane)))


def mended_text(text: str) -> str:
    """Return the text of a map of netconvert with connecting roads that lead from one road to the next without gaps.

    Roads that turn back at an end are cut there. A connecting road that does not begin or end in the direction of the
    roads that it joins becomes a cubic curve between them. Its lanes take the widths of the lanes that they join at
    each end; if several join one lane, all except the innermost taper to zero.
    """
    roads = {_number(match[0]): _read(match[0]) for match in _ROAD.finditer(text)}

    def mended(match: re.Match[str]) -> str:
        road = roads[_number(match[0])]
        ends = _joined(road, roads)
        if ends is None:
            return _written(road, road.pieces) if road.is_cut else road.text
        return _connected(road, *ends)

    return _ROAD.sub(mended, text)


def _number(element: str) -> str:
    attributes: dict[str, str] = dict(_ATTRIBUTE.findall(element.split(">", 1)[0]))
    return attributes["id"]


def _read(element: str) -> _Road:
    pieces = []
    for attributes, shape in _PIECE.findall(element):
        given = {key: float(value) for key, value in _ATTRIBUTE.findall(attributes)}
        pieces.append(_Piece(_Frame(given["x"], given["y"], given["hdg"]), given["length"], shape.strip()))
    kept = _without_turns_back(pieces)
    length = sum(piece.length for piece in pieces)
    links = {which: (road, end) for which, road, end in _LINK.findall(element)}
    widths = {int(lane[1]): found for lane in _LANE.finditer(element) if (found := _lane_widths(lane[0], length))}
    return _Road(element, tuple(kept), len(kept) < len(pieces), links, widths)


def _without_turns_back(pieces: Sequence[_Piece]) -> Sequence[_Piece]:
    """Return the pieces of a reference line without pieces at its ends that turn back."""

    def turns_back(one: _Piece, other: _Piece) -> bool:
        before = one.start if one is other else one.end
        after = other.end if one is other else other.start
        return _turn(before.heading, after.heading) > MAX_TURN_BACK

    # A single curve that turns back, with only a stub beyond it, is replaced by its chord: cutting it off would remove
    # a part of the road that exists. Then remove pieces that turn back against their neighbour, from both ends.
    if len(pieces) > 1 and turns_back(pieces[-2], pieces[-2]) and pieces[-1].length <= MAX_STUB:
        pieces = [*pieces[:-2], _straight(pieces[-2])]
    if len(pieces) > 1 and turns_back(pieces[1], pieces[1]) and pieces[0].length <= MAX_STUB:
        pieces = [_straight(pieces[1]), *pieces[2:]]
    while len(pieces) > 1 and turns_back(pieces[-2], pieces[-1]):
        pieces = pieces[:-1]
    while len(pieces) > 1 and turns_back(pieces[0], pieces[1]):
        pieces = pieces[1:]
    return pieces


def _straight(piece: _Piece) -> _Piece:
    """Return the straight line between the ends of a piece."""
    x, y = piece.end.x - piece.start.x, piece.end.y - piece.start.y
    return _Piece(replace(piece.start, heading=math.atan2(y, x)), math.hypot(x, y), "<line/>")


def _turn(one: float, other: float) -> float:
    """Return the angle between two headings, radians."""
    return abs(math.remainder(one - other, math.tau))


def _lane_widths(lane: str, length: float) -> tuple[float, float] | None:
    """Return the width of a lane at the start and at the end of its road, metres; None where it has no width."""
    records = [{key: float(value) for key, value in _ATTRIBUTE.findall(width)} for width in _WIDTH.findall(lane)]
    if not records:
        return None
    # Widths are cubic polynomials of the distance from the start of their record (OpenDRIVE): the value at the end of
    # the road comes from the last record.
    last = records[-1]
    along = length - last["sOffset"]
    return records[0]["a"], sum(last[term] * along**power for power, term in enumerate("abcd"))


def _joined(road: _Road, roads: Mapping[str, _Road]) -> tuple[_Road, _Road] | None:
    """Return the roads before and after a connecting road; None for roads of a different kind."""
    before, after = (road.links.get(which, ("", "")) for which in ("predecessor", "successor"))
    if not road.in_junction or before[1] != "end" or after[1] != "start" or not {before[0], after[0]} <= roads.keys():
        return None
    return roads[before[0]], roads[after[0]]


def _connected(road: _Road, before: _Road, after: _Road) -> str:
    """Return the text of a connecting road adjusted to meet the roads before and after it."""
    links = {lane: dict(_LANE_LINK.findall(match[0])) for match in _LANE.finditer(road.text) if (lane := int(match[1]))}
    pieces: Sequence[_Piece] = road.pieces
    # The reference line of a connecting road is the inner edge of its innermost lane. Its ends therefore lie on the
    # inner edges of the lanes that this lane joins.
    inner = min(road.widths, key=abs, default=0)
    if links.get(inner, {}).keys() >= {"predecessor", "successor"}:
        first, last = int(links[inner]["predecessor"]), int(links[inner]["successor"])
        start = before.pieces[-1].end.aside(before.inner_edge(first, 1))
        end = after.pieces[0].start.aside(after.inner_edge(last, 0))
        misfit = max(
            _turn(pieces[0].start.heading, start.heading),
            _turn(pieces[-1].end.heading, end.heading),
        )
        fits = misfit <= MAX_MISFIT and not before.is_cut and not after.is_cut
        if not fits and _leads_to(start, end):
            pieces = [_curve(start, end)]
    widths = dict(_joined_widths(road, links, before, after))
    return _written(road, pieces, widths)


def _leads_to(start: _Frame, end: _Frame) -> bool:
    """Return whether a curve between two frames is long enough and does not swing out."""
    x, y = end.x - start.x, end.y - start.y
    chord = math.atan2(y, x)
    swing = max(_turn(start.heading, chord), _turn(end.heading, chord))
    return math.hypot(x, y) >= MIN_LENGTH and swing < MAX_SWING


def _joined_widths(
    road: _Road, links: Mapping[int, Mapping[str, str]], before: _Road, after: _Road
) -> Iterator[tuple[int, tuple[float, float]]]:
    """Yield each lane that joins two others, with its widths at its start and end."""
    # Innermost lanes come first and take the full width of the lane that they join. Others that join the same lane have
    # zero width there, so that the carriageway is not wider than the road that it leads into.
    taken: tuple[set[int], set[int]] = (set(), set())
    for lane in sorted(road.widths, key=abs):
        found = links.get(lane, {})
        if "predecessor" in found and "successor" in found:
            ends = []
            for end, (other, which) in enumerate(((before, "predecessor"), (after, "successor"))):
                number = int(found[which])
                width = other.widths.get(number, (road.widths[lane],) * 2)[1 - end]
                ends.append(0.0 if number in taken[end] else float(np.max(width)))
                taken[end].add(number)
            yield lane, (ends[0], ends[1])


def _curve(start: _Frame, end: _Frame) -> _Piece:
    """Return a cubic curve between two frames that has their headings; it approximates a circular arc if one fits."""
    cos, sin = math.cos(start.heading), math.sin(start.heading)
    x, y = end.x - start.x, end.y - start.y
    turn = math.remainder(end.heading - start.heading, math.tau)
    # Cubic Hermite curve with end tangents of equal length. For an arc of angle θ and chord c the usual Bézier handle,
    # 4/3·tan(θ/4)·radius, gives tangents of c/cos²(θ/4) = 2c/(1 + cos(θ/2)).
    handle = 2.0 * math.hypot(x, y) / (1.0 + math.cos(turn / 2.0))  # three times that of a Bézier curve
    stop = np.array([cos * x + sin * y, cos * y - sin * x])
    first, last = handle * np.array([1.0, 0.0]), handle * np.array([math.cos(turn), math.sin(turn)])
    # Coefficients of p(t) = first·t + second·t² + third·t³ from p(1) = stop and p'(1) = last, in the frame of the start
    # (OpenDRIVE's u and v).
    second, third = 3 * stop - 2 * first - last, first + last - 2 * stop
    at = np.linspace(0.0, 1.0, CURVE_STEPS + 1)[:, None]
    length = float(np.hypot(*np.diff(at * (first + at * (second + at * third)), axis=0).T).sum())
    terms = zip("bcd", (first, second, third), strict=True)
    cubic = " ".join(f'{term}U="{both[0]:.8f}" {term}V="{both[1]:.8f}"' for term, both in terms)
    return _Piece(start, length, f'<paramPoly3 aU="0" aV="0" {cubic} pRange="normalized"/>')


def _written(road: _Road, pieces: Sequence[_Piece], widths: Mapping[int, tuple[float, float]] | None = None) -> str:
    """Return the text of a road with new pieces and widths, and its heights stretched to the new length."""
    length = sum(piece.length for piece in pieces)
    places = np.concatenate([[0.0], np.cumsum([piece.length for piece in pieces])])
    plan = "".join(
        f'<geometry s="{s:.8f}" x="{piece.start.x:.8f}" y="{piece.start.y:.8f}" hdg="{piece.start.heading:.8f}" '
        f'length="{piece.length:.8f}">{piece.shape}</geometry>'
        for s, piece in zip(places[:-1], pieces, strict=True)
    )
    text = re.sub(r'length="[^"]*"', f'length="{length:.8f}"', road.text, count=1)
    text = _PLAN.sub(lambda _: f"<planView>{plan}</planView>", text)
    text = _HEIGHT.sub(lambda record: _stretched(record[0], length / road.length), text)

    def resized(match: re.Match[str]) -> str:
        own = (widths or {}).get(int(match[1]))
        if own is None:
            return match[0]
        slope = (own[1] - own[0]) / length
        record = f'<width sOffset="0" a="{own[0]:.8f}" b="{slope:.8f}" c="0" d="0"/>'
        # One linear record replaces all records of the lane: the first is exchanged, the others are deleted.
        first, *others = _WIDTH.findall(match[0])
        lane = match[0].replace(first, record, 1)
        for other in others:
            lane = lane.replace(other, "", 1)
        return lane

    return _LANE.sub(resized, text)


def _stretched(record: str, by: float) -> str:
    """Return an elevation record scaled along its road by a factor."""
    given = {key: float(value) for key, value in _ATTRIBUTE.findall(record)}
    # With s' = by·s the height stays the same if the coefficient of the n-th power is divided by by**n.
    powers = {"s": -1, "a": 0, "b": 1, "c": 2, "d": 3}
    return "<elevation " + " ".join(f'{key}="{given[key] / by**power:.8f}"' for key, power in powers.items()) + "/>"
