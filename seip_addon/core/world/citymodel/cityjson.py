"""Buildings of a CityJSON file (1.1 and 2.0): polygons with holes, and the kind of each surface.

Follows https://www.cityjson.org/specs/2.0.1; all contents of a file are checked.
"""

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from ...arrays import Float, Integer
from ...errors import SeipError
from ...geometry.reference_systems import epsg_code
from ...limits import ELEVATION, MAP_COORDINATE
from ...site.sources import one_line
from ...storage.files import parse_json, read_small

VERSIONS = ("1.1", "2.0")
HIGHEST_LOD = 2.2
MAX_BYTES = 300_000_000
MAX_VERTICES = 3_000_000
MAX_DEPTH = 20  # levels of parts within parts
NO_DETAIL = (
    "building without surfaces of a supported level of detail is",
    "buildings without surfaces of a supported level of detail are",
)
"""Reason to leave out a building, for one and for several."""
INSIDE = {"InteriorWallSurface", "CeilingSurface", "FloorSurface"}
"""Surfaces within a building, which are not visible from the street."""
_SHELL_DEPTH = {"MultiSurface": 0, "CompositeSurface": 0, "Solid": 1, "MultiSolid": 2, "CompositeSolid": 2}
"""Number of nested lists around the surfaces of a geometry."""


@dataclass(frozen=True, eq=False)
class Surface:
    """A polygon in space.

    Parameters
    ----------
    rings : tuple of (n,) int64
        Vertex indices of its outline, counter-clockwise seen from outside, and of its holes.
    kind : str
        Kind such as ``RoofSurface``, or "".
    """

    rings: tuple[Integer, ...]
    kind: str


@dataclass(frozen=True, eq=False)
class ModelledBuilding:
    """Id and surfaces of a building, parts included."""

    id: str
    surfaces: tuple[Surface, ...]


@dataclass(frozen=True, eq=False)
class CityModel:
    """The buildings of a city model.

    Parameters
    ----------
    name : str
        Name of its file.
    epsg : int or None
        EPSG code of its reference system.
    vertices : (n, 3) float64
        Vertices in its reference system, metres.
    left_out : Counter
        Number of objects left out, by reason (singular and plural).
    attribution : str
        Title, point of contact and date of the model, as far as given in the metadata.
    """

    name: str
    epsg: int | None
    vertices: Float
    buildings: tuple[ModelledBuilding, ...]
    left_out: Counter[tuple[str, str]]
    attribution: str = ""


def read_city_model(path: Path) -> CityModel:
    """Read the buildings of a CityJSON file, each in the highest level of detail up to `HIGHEST_LOD`.

    Raises
    ------
    SeipError
        The file cannot be read, is not CityJSON of a known version, is too large, or is inconsistent.
    """
    content = _parsed(path)
    reader = _Reader(path.name, content)
    buildings = tuple(reader.buildings())
    if not buildings:
        raise SeipError(
            f"{path.name} has no building with surfaces of level of detail 1 to {HIGHEST_LOD}: use a model with these"
        )
    return CityModel(path.name, _code(content), reader.vertices, buildings, reader.left_out, _attribution(content))


def _attribution(content: dict[str, Any]) -> str:
    """Return the credit from the metadata; values that are not text are skipped."""
    metadata = content.get("metadata")
    metadata = metadata if isinstance(metadata, dict) else {}
    contact = metadata.get("pointOfContact")
    contact = contact if isinstance(contact, dict) else {}
    parts = (metadata.get("title"), contact.get("contactName"), metadata.get("referenceDate"))
    return ", ".join(one_line(part) for part in parts if isinstance(part, str) and part.strip())


def _parsed(path: Path) -> dict[str, Any]:
    name = path.name
    try:
        content = parse_json(read_small(path, MAX_BYTES, _CUT))
    except (ValueError, RecursionError) as error:  # invalid JSON, encoding or numbers
        sequence = "a sequence of features is collected into one model by cjseq collect"
        why = sequence if "Extra data" in str(error) else f"{str(error)[:120]}; download the model again"
        raise SeipError(f"{name} is not readable JSON: {why}") from error
    if not isinstance(content, dict) or content.get("type") != "CityJSON":
        raise SeipError(f"{name} is not CityJSON: its type must be 'CityJSON'; convert it (citygml-tools to-cityjson)")
    version = str(content.get("version", ""))[:20]
    if not version.startswith(VERSIONS):
        raise SeipError(
            f"{name} is CityJSON of version {version!r}, and {' and '.join(VERSIONS)} are supported: convert it "
            f"(cjio {name} upgrade save new.city.json)"
        )
    return content


def _code(content: Mapping[str, Any]) -> int | None:
    metadata = content.get("metadata")
    text = metadata.get("referenceSystem") if isinstance(metadata, dict) else None
    return epsg_code(text) if isinstance(text, str) else None


_CUT = "cut the place out of the model (cjio model.city.json subset --bbox minx miny maxx maxy save place.city.json)"


class _Reader:
    """Reader of the objects of a file, from buildings to their parts."""

    def __init__(self, name: str, content: Mapping[str, Any]) -> None:
        self._name = name
        self.left_out: Counter[tuple[str, str]] = Counter()
        self.vertices = self._vertices(content)
        objects = content.get("CityObjects")
        if not isinstance(objects, dict) or not all(isinstance(one, dict) for one in objects.values()):
            self._refuse("CityObjects must be a table of objects")
        self._objects: dict[str, dict[str, Any]] = objects

    def buildings(self) -> Iterator[ModelledBuilding]:
        """Yield the buildings that have surfaces."""
        kinds = ("Building", "BuildingPart")  # a type may be anything, and need not be hashable
        wanted = [number for number, one in self._objects.items() if one.get("type") in kinds]
        children = {number: self._children(number) for number in wanted}
        parts = {child for own in children.values() for child in own}
        reached: set[str] = set()
        for number in wanted:
            if number in parts:
                continue
            own = list(self._with_parts(number, children, reached))
            surfaces = tuple(surface for geometry in self._chosen(own) for surface in self._surfaces(geometry))
            if surfaces:
                yield ModelledBuilding(number, surfaces)
            else:
                self.left_out[NO_DETAIL] += 1
        if lost := [number for number in wanted if number not in reached]:
            self._refuse(f"buildings are parts of each other, {lost[0][:60]!r} among them")

    def _vertices(self, content: Mapping[str, Any]) -> Float:
        given = content.get("vertices")
        if not isinstance(given, list) or not given:
            self._refuse("vertices must be a list of places")
        if len(given) > MAX_VERTICES:
            raise SeipError(f"{self._name} holds {len(given):,} vertices, more than {MAX_VERTICES:,}; {_CUT}")
        transform = content.get("transform", {})
        try:
            places = np.array(given, dtype=np.float64).reshape(len(given), 3)
            moves = [np.array(transform.get(key, [usual] * 3), np.float64).reshape(3) for key, usual in _TRANSFORM]
            with np.errstate(all="ignore"):
                placed: Float = places * moves[0] + moves[1]
        except (ValueError, TypeError, AttributeError, OverflowError):
            self._refuse("vertices, and scale and translate of the transform, must be of three numbers each")
        for what, limits, values in (
            ("a coordinate of a vertex", MAP_COORDINATE, placed[:, :2]),
            ("the height of a vertex", ELEVATION, placed[:, 2]),
        ):
            if fault := limits.fault(values):
                self._refuse(f"{what} {fault}")
        return placed

    def _children(self, number: str) -> list[str]:
        listed = self._objects[number].get("children", [])
        if not isinstance(listed, list) or not all(isinstance(one, str) for one in listed):
            self._refuse(f"children of {number[:60]!r} must be a list of names")
        for one in listed:
            if one not in self._objects:
                self._refuse(f"{number[:60]!r} has a part {one[:60]!r} that is not there")
        return listed

    def _with_parts(self, root: str, children: Mapping[str, list[str]], reached: set[str]) -> Iterator[tuple[str, int]]:
        """Yield the ids of a building and its parts with their depth; installations count as parts."""
        waiting = [(root, 0)]
        while waiting:
            number, depth = waiting.pop()
            if number in reached or depth > MAX_DEPTH:
                self._refuse(f"{number[:60]!r} is a part twice, or of itself")
            reached.add(number)
            yield number, depth
            waiting += [(child, depth + 1) for child in reversed(children.get(number, []))]

    def _chosen(self, family: Sequence[tuple[str, int]]) -> Iterator[Mapping[str, Any]]:
        """Yield the geometry to use for each object; a whole is left out if its parts have more detail."""
        best = [(depth, self._best(number)) for number, depth in family]
        finest = max((lod for depth, (lod, _) in best if depth > 0), default=0.0)
        for depth, (lod, geometry) in best:
            if geometry is not None and (depth > 0 or lod >= finest):
                yield geometry

    def _best(self, number: str) -> tuple[float, Mapping[str, Any] | None]:
        """Return the highest supported level of detail of an object and its geometry, or 0 and None."""
        listed = self._objects[number].get("geometry", [])
        if not isinstance(listed, list) or not all(isinstance(one, dict) for one in listed):
            self._refuse(f"geometry of {number[:60]!r} must be a list of tables")
        found: tuple[float, Mapping[str, Any] | None] = (0.0, None)
        for one in listed:
            if one.get("type") == "GeometryInstance":
                raise SeipError(
                    f"{self._name}: {number[:60]!r} is made of geometry templates, which are not read: export the "
                    "model without templates"
                )
            lod = self._lod(one.get("lod"), number)
            if one.get("type") in tuple(_SHELL_DEPTH) and 1.0 <= lod <= HIGHEST_LOD and lod > found[0]:
                found = (lod, one)
        return found

    def _lod(self, given: object, number: str) -> float:
        try:
            lod = float(str(given))
        except ValueError:
            lod = math.nan
        if not math.isfinite(lod):
            self._refuse(f"a geometry of {number[:60]!r} has the level of detail {str(given)[:20]!r}")
        return lod

    def _surfaces(self, geometry: Mapping[str, Any]) -> Iterator[Surface]:
        semantics = geometry.get("semantics")
        kinds, values = ([], None)
        if isinstance(semantics, dict):
            kinds, values = semantics.get("surfaces", []), semantics.get("values")
        if not isinstance(kinds, list):
            self._refuse("surfaces of semantics must be a list")
        depth = _SHELL_DEPTH[geometry["type"]]
        for boundary, value in self._flat(geometry.get("boundaries"), values, depth):
            kind = ""
            if isinstance(value, int) and not isinstance(value, bool):
                if not 0 <= value < len(kinds) or not isinstance(kinds[value], dict):
                    self._refuse(f"semantics name a surface {value} that is not there")
                kind = str(kinds[value].get("type", ""))
            if kind not in INSIDE:
                yield Surface(tuple(self._ring(ring) for ring in self._list(boundary)), kind)

    def _flat(self, boundaries: object, values: object, depth: int) -> Iterator[tuple[object, object]]:
        """Yield surfaces with their semantic values; of a solid only the outer shell."""
        listed = self._list(boundaries)
        given = values if isinstance(values, list) else []
        if depth == 1:
            listed, given = listed[:1], given[:1]
        if values is not None and len(given) != len(listed):
            self._refuse("the number of values of semantics differs from the number of surfaces")
        for place, one in enumerate(listed):
            value = given[place] if given else None
            if depth > 0:
                yield from self._flat(one, value, depth - 1)
            else:
                yield one, value

    def _list(self, value: object) -> list[Any]:
        if not isinstance(value, list):
            self._refuse("boundaries must be lists of lists of vertices")
        return value

    def _ring(self, ring: object) -> Integer:
        corners = self._list(ring)
        for corner in corners:
            if type(corner) is not int or not 0 <= corner < len(self.vertices):
                self._refuse(
                    f"a surface names the vertex {str(corner)[:20]}, and there are {len(self.vertices):,} from 0 on"
                )
        return np.array(corners, dtype=np.int64)

    def _refuse(self, what: str) -> NoReturn:
        raise SeipError(f"{self._name} is damaged: {what}; download it again or repair it (cjio validate names more)")


_TRANSFORM = (("scale", 1.0), ("translate", 0.0))
