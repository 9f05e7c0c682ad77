"""Plan geometry of roads: alignments of lines, clothoids and arcs, and the curves that join two of them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)  # type: ignore[no-untyped-call]  # numpy 1.26 has no types here
SHORTEST = 1e-6  # metres; anything shorter comes from rounding and would only burden readers
STRAIGHT = 1e-9  # radians


@dataclass(frozen=True)
class Pose:
    """A point in plan (metres) and a heading (radians, counter-clockwise from +x)."""

    x: float
    y: float
    heading: float

    def moved(self, ahead: float = 0.0, left: float = 0.0) -> Pose:
        """Return the pose so many metres ahead and to the left."""
        cosine, sine = math.cos(self.heading), math.sin(self.heading)
        return Pose(self.x + ahead * cosine - left * sine, self.y + ahead * sine + left * cosine, self.heading)

    def turned(self, angle: float) -> Pose:
        """Return the pose turned on the spot by an angle in radians."""
        return Pose(self.x, self.y, self.heading + angle)

    def seen_from(self, other: Pose) -> tuple[float, float]:
        """Return (ahead, left) of this point in the axes of another pose."""
        dx, dy = self.x - other.x, self.y - other.y
        cosine, sine = math.cos(other.heading), math.sin(other.heading)
        return dx * cosine + dy * sine, dy * cosine - dx * sine


def turn_between(first: Pose, second: Pose) -> float:
    """Return the turn from one heading to another, in (-pi, pi], left positive."""
    turn = (second.heading - first.heading) % math.tau
    return turn - math.tau if turn > math.pi else turn


@dataclass(frozen=True)
class Geometry:
    """One ``<geometry>`` record of OpenDRIVE: both ends, length in metres, element name and its attributes."""

    start: Pose
    end: Pose
    length: float
    shape: str
    attributes: dict[str, float | str]


@dataclass(frozen=True)
class Piece:
    """A stretch whose curvature (1/metres, left positive) runs linearly: line, arc or clothoid."""

    length: float
    curvature_start: float = 0.0
    curvature_end: float = 0.0

    def curvature(self, distance: float) -> float:
        """Return the curvature at a distance from the start."""
        return self.curvature_start + (self.curvature_end - self.curvature_start) * distance / self.length

    def part(self, first: float, last: float) -> Piece:
        """Return what lies between two distances from the start."""
        return Piece(last - first, self.curvature(first), self.curvature(last))

    def end(self, start: Pose) -> Pose:
        """Return the pose at the end; Gauss-Legendre is exact here to rounding for any street's clothoid."""
        along = self.length * (_NODES + 1.0) / 2.0
        change = (self.curvature_end - self.curvature_start) / self.length
        heading = start.heading + self.curvature_start * along + change * along**2 / 2.0
        weights = self.length / 2.0 * _WEIGHTS
        turn = self.length * (self.curvature_start + self.curvature_end) / 2.0
        return Pose(
            start.x + float(weights @ np.cos(heading)),
            start.y + float(weights @ np.sin(heading)),
            start.heading + turn,
        )

    def geometry(self, start: Pose) -> Geometry:
        """Return the record of this piece from a start."""
        if self.curvature_start != self.curvature_end:
            curvatures: dict[str, float | str] = {"curvStart": self.curvature_start, "curvEnd": self.curvature_end}
            return Geometry(start, self.end(start), self.length, "spiral", curvatures)
        if self.curvature_start:
            return Geometry(start, self.end(start), self.length, "arc", {"curvature": self.curvature_start})
        return Geometry(start, self.end(start), self.length, "line", {})


@dataclass(frozen=True)
class Alignment:
    """A reference line: a start and the pieces that follow each other smoothly."""

    start: Pose
    pieces: tuple[Piece, ...]

    @property
    def length(self) -> float:
        """Length in metres."""
        return sum(piece.length for piece in self.pieces)

    def poses(self) -> list[Pose]:
        """Return the start of every piece, and the end."""
        poses = [self.start]
        for piece in self.pieces:
            poses.append(piece.end(poses[-1]))
        return poses

    def pose(self, station: float) -> Pose:
        """Return the pose at a station in metres."""
        return self.cut(station, self.length).start if station < self.length else self.poses()[-1]

    def cut(self, first: float, last: float) -> Alignment:
        """Return what lies between two stations."""
        stations = np.cumsum([0.0] + [piece.length for piece in self.pieces]).tolist()
        start, pieces = None, []
        for pose, piece, (begin, end) in zip(self.poses(), self.pieces, pairwise(stations), strict=False):
            low, high = max(first, begin) - begin, min(last, end) - begin
            if high - low > SHORTEST:
                start = start or (piece.part(0.0, low).end(pose) if low > 0.0 else pose)
                pieces.append(piece.part(low, high))
        if start is None:
            message = f"no road between stations {first} and {last}"
            raise ValueError(message)
        return Alignment(start, tuple(pieces))

    def geometries(self) -> tuple[Geometry, ...]:
        """Return the records of this reference line."""
        return tuple(piece.geometry(pose) for pose, piece in zip(self.poses(), self.pieces, strict=False))


def transition_curve(straight: float, spiral: float, arc: float, radius: float, rest: float = 0.0) -> tuple[Piece, ...]:
    """Return line, clothoid, arc, clothoid and line; a positive radius bends to the left."""
    curvature = 1.0 / radius
    pieces = (
        Piece(straight),
        Piece(spiral, 0.0, curvature),
        Piece(arc, curvature, curvature),
        Piece(spiral, curvature, 0.0),
        Piece(rest),
    )
    return tuple(piece for piece in pieces if piece.length > SHORTEST)


def join(start: Pose, end: Pose) -> tuple[Geometry, ...]:
    """Return the curve from one pose to another: a line, a cubic sway, or an arc with straight ends."""
    turn = turn_between(start, end)
    ahead, left = end.seen_from(start)
    if abs(turn) < STRAIGHT and abs(left) < SHORTEST:
        return (Geometry(start, end, ahead, "line", {}),)
    if abs(turn) < math.radians(30.0):
        return (_cubic(start, end),)
    return _rounded_corner(start, ahead, left, turn).geometries()


def _rounded_corner(start: Pose, ahead: float, left: float, turn: float) -> Alignment:
    """Return the largest arc that touches both straight lines between the poses, and what is left of the lines."""
    after = left / math.sin(turn)
    before = ahead - after * math.cos(turn)
    tangent = min(before, after)
    curvature = math.tan(turn / 2.0) / tangent
    pieces = (Piece(before - tangent), Piece(turn / curvature, curvature, curvature), Piece(after - tangent))
    return Alignment(start, tuple(piece for piece in pieces if piece.length > SHORTEST))


def _cubic(start: Pose, end: Pose) -> Geometry:
    """Return the cubic Hermite curve with both tangents as long as the chord."""
    turn = turn_between(start, end)
    ahead, left = end.seen_from(start)
    chord = math.hypot(ahead, left)
    tangent = chord * math.cos(turn), chord * math.sin(turn)
    u = np.array([0.0, chord, 3.0 * ahead - 2.0 * chord - tangent[0], chord + tangent[0] - 2.0 * ahead])
    v = np.array([0.0, 0.0, 3.0 * left - tangent[1], tangent[1] - 2.0 * left])
    p = (_NODES + 1.0) / 2.0
    speed = np.hypot(u[1] + 2.0 * u[2] * p + 3.0 * u[3] * p**2, v[1] + 2.0 * v[2] * p + 3.0 * v[3] * p**2)
    attributes: dict[str, float | str] = {
        name + axis: float(value)
        for axis, values in (("U", u), ("V", v))
        for name, value in zip("abcd", values, strict=True)
    }
    return Geometry(start, end, float(speed @ _WEIGHTS) / 2.0, "paramPoly3", attributes | {"pRange": "normalized"})
