"""Footprints and lines of an extract in map coordinates; invalid ones are repaired, or left out and counted."""

import math
from collections import Counter
from collections.abc import Iterator

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...base.arrays import Float
from ...geometry.geo_reference import TransverseMercator
from .extract import Extract, Node, Relation, Way

MIN_FOOTPRINT = 0.5  # square metres: smaller outlines are ignored
OUTER_ROLES, INNER_ROLES = {"outer", "outline", "part", ""}, {"inner"}

# reasons counted in `PlanShapes.dropped`: singular and plural
MENDED = ("outline that crosses itself was mended", "outlines that cross themselves were mended")
NOT_CLOSED = (
    "outline that is not closed, or is cut off by the extract, was closed",
    "outlines that are not closed, or are cut off by the extract, were closed",
)
TOO_LITTLE = (
    "outline of which the extract has too little was left out",
    "outlines of which the extract has too little were left out",
)
PIECES = ("piece of an outline that does not close was left out", "pieces of outlines that do not close were left out")
DRAWN_TWICE = ("outline that is drawn twice was used once", "outlines that are drawn twice were used once")


class PlanShapes:
    """Shapes of an extract in map coordinates.

    Parameters
    ----------
    to_map : TransverseMercator
        Projection of the map.
    offset : (2,) float64, metres
        Offset in the map's header, which is subtracted from projected coordinates.
    """

    def __init__(self, extract: Extract, to_map: TransverseMercator, offset: Float) -> None:
        self.extract = extract
        self._to_map, self._offset = to_map, offset
        self._known: dict[int, tuple[float, float]] = {}
        self.dropped: Counter[tuple[str, str]] = Counter()
        """Number of elements left out or repaired, by reason."""

    def point(self, node: Node) -> Float:
        """Return the position of a node, (2,) metres."""
        place: Float = np.array(self._to_map(math.radians(node.latitude), math.radians(node.longitude))) - self._offset
        return place

    def line(self, way: Way) -> Float:
        """Return the nodes of a way that the extract contains (n, 2), metres, without consecutive repeats."""
        points = [self._place(number) for number in way.nodes if number in self.extract.nodes]
        kept = [point for place, point in enumerate(points) if place == 0 or point != points[place - 1]]
        return np.array(kept).reshape(-1, 2)

    def lines(self, area: BaseGeometry, key: str, values: set[str] | None) -> Iterator[tuple[Way, Float]]:
        """Yield the ways with a tag that reach into an area, with their lines (n, 2).

        Parameters
        ----------
        area : shapely geometry
            Prepared.
        values : set of str or None
            Accepted values of the tag; None accepts any.
        """
        for way in self.extract.ways.values():
            if key in way.tags and (values is None or way.tags[key] in values):
                line = self.line(way)
                if len(line) > 1 and area.intersects(shapely.LineString(line)):
                    yield way, line

    def footprint(self, element: Way | Relation) -> BaseGeometry | None:
        """Return the area of a closed way or of a multipolygon relation; None if it has no usable outline.

        A way that is not closed, or is cut off by the extract, is closed by a straight line if at least three corners
        and half of its nodes are left. An outline that crosses itself is made valid.
        """
        area = self._of_way(element) if isinstance(element, Way) else self._of_relation(element)
        if area is None or area.is_empty:
            return None
        if not area.is_valid:
            self.dropped[MENDED] += 1
            area = shapely.make_valid(area)
        # make_valid may leave lines and points besides polygons.
        parts = [part for part in shapely.get_parts(area) if part.geom_type == "Polygon" and part.area >= MIN_FOOTPRINT]
        return shapely.union_all(parts) if parts else None

    def _of_way(self, way: Way) -> BaseGeometry | None:
        line = self.line(way)
        if way.nodes[:1] != way.nodes[-1:] or len(line) < len(way.nodes):
            if len(line) < 3 or 2 * len(line) < len(way.nodes):
                self.dropped[TOO_LITTLE] += 1
                return None
            self.dropped[NOT_CLOSED] += line[0].tolist() != line[-1].tolist()
        if len(np.unique(line, axis=0)) < 3:
            return None
        return shapely.Polygon(line)

    def _of_relation(self, relation: Relation) -> BaseGeometry | None:
        outer = self._joined(relation, OUTER_ROLES)
        if not outer:
            return None
        inner = self._joined(relation, INNER_ROLES)
        # Holes are subtracted from the union of all outer rings: roles are explicit, so that it need not be known which
        # hole belongs to which ring.
        area = shapely.union_all([shapely.make_valid(ring) for ring in outer])
        return area.difference(shapely.union_all([shapely.make_valid(ring) for ring in inner]))

    def _joined(self, relation: Relation, roles: set[str]) -> list[shapely.Polygon]:
        """Return the areas within the ways of a relation with given roles, joined end to end to rings."""
        refs = [ref for kind, ref, role in relation.members if kind == "way" and role in roles]
        ways = [self.extract.ways[ref] for ref in refs if ref in self.extract.ways]
        lines = [shapely.LineString(line) for line in map(self.line, ways) if len(line) > 1]
        found, *rest, crossed = shapely.polygonize_full(lines)
        # The ends of what the extract cuts off are joined by a straight line; other open lines are left out.
        left = shapely.get_parts(shapely.line_merge(shapely.union_all(rest)))
        is_cut = any(number not in self.extract.nodes for way in ways for number in way.nodes)
        closed = [shapely.Polygon(line) for line in left if is_cut and len(line.coords) > 2]
        self.dropped[PIECES] += len(left) - len(closed)
        return [*shapely.get_parts(found), *map(shapely.Polygon, shapely.get_parts(crossed)), *closed]

    def _place(self, number: int) -> tuple[float, float]:
        if number not in self._known:
            x, y = self.point(self.extract.nodes[number])
            self._known[number] = (float(x), float(y))
        return self._known[number]


def polygons(area: BaseGeometry) -> Iterator[shapely.Polygon]:
    """Yield the polygons of an area."""
    return (part for part in shapely.get_parts(area) if part.geom_type == "Polygon" and not part.is_empty)


def spaced(line: Float, spacing: float) -> Float:
    """Return equidistant points (n, 2) along a line (k, 2), ends included, about `spacing` metres apart."""
    path = shapely.LineString(line)
    gaps = max(round(path.length / spacing), 1)
    points = shapely.line_interpolate_point(path, np.linspace(0.0, path.length, gaps + 1))
    return np.asarray(shapely.get_coordinates(points))
