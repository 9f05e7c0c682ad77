"""The site description: what a map does not say about a place, read from a small TOML file.

The keys are explained in docs/site-description.md. Coordinates are map
coordinates in metres; headings are degrees in the file and radians here.
"""

from __future__ import annotations

import difflib
import math
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from shapely import MultiPolygon, Polygon
from shapely.validation import explain_validity

from ..arrays import Float
from ..errors import SeipError
from ..site.scene_geometry import DEFAULT_WEIGHT

DEFAULT_RADIUS = 80.0
DESCRIPTION_SUFFIX = ".toml"

LARGEST = 100_000.0
"""Metres (or degrees, or a weight) that nothing described may exceed."""

HIGHEST = 1_000.0
"""Metres that nothing described is high."""

LARGEST_RADIUS = 5_000.0
"""Metres from the middle of the place to the end of its region at most."""

LONGEST_ROW = 10_000
"""Trees or lights of a row beyond which its spacing is a slip."""


@dataclass(frozen=True, eq=False)
class Area:
    """A named area in plan, map coordinates."""

    name: str
    polygon: Polygon


@dataclass(frozen=True, eq=False)
class WeightedRegion:
    """A region whose targets count ``weight`` times: a polygon, or the central box of a junction."""

    name: str
    weight: float
    polygon: Polygon | None = None
    junction: str | None = None


@dataclass(frozen=True, eq=False)
class Building:
    """A block with a flat roof: ``height`` metres from ``base`` metres above the ground."""

    outline: Polygon
    height: float
    base: float = 0.0


@dataclass(frozen=True, eq=False)
class Trees:
    """Trees of one size at ``positions`` (n, 2)."""

    positions: Float
    height: float
    crown_diameter: float


@dataclass(frozen=True, eq=False)
class Wall:
    """A wall along ``line`` (n, 2)."""

    line: Float
    height: float
    thickness: float


@dataclass(frozen=True, eq=False)
class Poles:
    """Posts of one kind at ``positions`` (n, 2).

    Parameters
    ----------
    positions : (n, 2) float64, metres
        Feet of the posts, map coordinates.
    height, arm : float, metres
        Of the post, and of the arm it carries.
    heading : float or None, radians
        Where the arm points, counter-clockwise from map x (east). None: to the nearest carriageway.
    """

    positions: Float
    height: float
    arm: float
    heading: float | None


@dataclass(frozen=True, eq=False)
class SiteDescription:
    """A place to study and what stands there.

    Parameters
    ----------
    name : str
        Title of the place; empty: the map's name.
    map : Path or None
        The OpenDRIVE file.
    near : (x, y) or None
        Middle of the place, map coordinates.
    junction : str or None
        Id or name of the junction that is the middle of the place.
    radius : float or None, metres
        The region of interest is the driving surface this near to the middle.
    approaches : float or None, metres
        Instead of the radius: the driving surface of the junction, and of its
        approaches this far along the roads. Without either a junction has
        approaches of `DEFAULT_RADIUS`, and another place that radius.
    region : shapely geometry or None
        Instead of both: the driving surface within this area.
    level : tuple of str
        Ids of roads that lie on the level to study, where roads lie above each other.
    weighted_regions, buildings, trees, walls, street_lights, signal_poles, forbidden_areas, mandatory_areas : tuple
        What the file lists.
    """

    name: str = ""
    map: Path | None = None
    near: tuple[float, float] | None = None
    junction: str | None = None
    radius: float | None = None
    approaches: float | None = None
    region: MultiPolygon | None = None
    level: tuple[str, ...] = ()
    weighted_regions: tuple[WeightedRegion, ...] = ()
    buildings: tuple[Building, ...] = ()
    trees: tuple[Trees, ...] = ()
    walls: tuple[Wall, ...] = ()
    street_lights: tuple[Poles, ...] = ()
    signal_poles: tuple[Poles, ...] = ()
    forbidden_areas: tuple[Area, ...] = ()
    mandatory_areas: tuple[Area, ...] = ()

    @property
    def along(self) -> float | None:
        """How far the region follows the approaches of the junction, metres; None where it is a circle or an area."""
        if self.junction is None or self.region is not None or self.radius is not None:
            return None
        return DEFAULT_RADIUS if self.approaches is None else self.approaches


def read_site_description(path: Path) -> SiteDescription:
    """Read a site description.

    Parameters
    ----------
    path : Path
        The TOML file. A map that it names is looked for beside it.

    Raises
    ------
    SeipError
        No such file, broken TOML, an unknown key (close ones are offered), a
        value of the wrong kind, or a shape that is none.
    """
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is no UTF-8 text"
        raise SeipError(f"cannot read the site description {path}: {reason}") from error
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise SeipError(f"{path} is not valid TOML: {error}") from error
    table = _Table(content, str(path))
    map_name = table.text("map", None)
    description = SiteDescription(
        name=table.text("name", "") or "",
        map=None if map_name is None else path.parent / map_name,
        near=table.point("near"),
        junction=table.text("junction", None),
        radius=table.optional("radius", most=LARGEST_RADIUS),
        approaches=table.optional("approaches", most=LARGEST_RADIUS),
        region=table.region("region"),
        level=table.texts("level"),
        weighted_regions=tuple(_weighted_region(row) for row in table.rows("weighted_region")),
        buildings=tuple(_building(row) for row in table.rows("building")),
        trees=tuple(_trees(row) for row in table.rows("tree")),
        walls=tuple(_wall(row) for row in table.rows("wall")),
        street_lights=tuple(_poles(row, height=8.0, arm=1.5) for row in table.rows("street_light")),
        signal_poles=tuple(_poles(row, height=6.0, arm=5.0) for row in table.rows("signal_pole")),
        forbidden_areas=tuple(_area(row) for row in table.rows("forbidden_area")),
        mandatory_areas=tuple(_area(row) for row in table.rows("mandatory_area")),
    )
    table.finish()
    if description.near is not None and description.junction is not None:
        raise SeipError(f"{path}: give either near or junction, not both")
    if description.radius is not None and description.approaches is not None:
        raise SeipError(f"{path}: give either radius or approaches, not both")
    return description


def describe_place(
    source: Path,
    *,
    site: Path | None = None,
    near: tuple[float, float] | None = None,
    junction: str | None = None,
    radius: float | None = None,
    approaches: float | None = None,
) -> tuple[Path, SiteDescription]:
    """Return a place's map and description, what is given here in place of what a file says.

    Parameters
    ----------
    source : Path
        The map, or a site description that names it.
    site : Path, optional
        Site description to go with a map.
    near : (x, y), metres, optional
        Middle of the place, map coordinates.
    junction : str, optional
        Id or name of the junction in the middle of the place.
    radius : float, metres, optional
        Of the region of interest.
    approaches : float, metres, optional
        How far the region follows the approaches of the junction.

    Raises
    ------
    SeipError
        As for `read_site_description`; no map is named, or a number makes no sense.
    """
    described = _described(source, site)
    map_path = described.map
    if map_path is None:
        raise SeipError(f'{source} names no map: add map = "file.xodr" to it, or give the map and the description')
    if near is not None or junction is not None:
        if near is not None and not all(map(math.isfinite, near)):
            raise SeipError("the middle of the place must be two finite numbers, x and y in metres")
        along = None if junction is None else described.approaches
        described = replace(described, near=near, junction=junction, region=None, approaches=along)
    for name, length in (("radius", radius), ("length of the approaches", approaches)):
        if length is not None and not 0 < length <= LARGEST_RADIUS:
            raise SeipError(f"the {name} must be above 0 m and at most {LARGEST_RADIUS:g} m, not {length:g}")
    if radius is not None or approaches is not None:
        described = replace(described, radius=radius, approaches=approaches, region=None)
    if described.approaches is not None and described.junction is None:
        raise SeipError("the approaches are those of a junction: name one, or give a radius")
    return map_path, described


def _described(source: Path, site: Path | None) -> SiteDescription:
    """Return what files say of a place."""
    if source.suffix.lower() == DESCRIPTION_SUFFIX:
        if site is not None:
            raise SeipError(f"{source} is a site description already; leave the other one, {site}, out")
        return read_site_description(source)
    return replace(SiteDescription() if site is None else read_site_description(site), map=source)


def _weighted_region(table: _Table) -> WeightedRegion:
    polygon = table.polygon("polygon", needed=False)
    junction = table.text("junction", None)
    if (polygon is None) == (junction is None):
        raise SeipError(f"{table.where}: give either polygon or junction")
    name = table.text("name", f"Junction {junction}" if junction is not None else "Weighted region")
    region = WeightedRegion(name or "", table.number("weight", DEFAULT_WEIGHT, above=0.0), polygon, junction)
    table.finish()
    return region


def _building(table: _Table) -> Building:
    outline = table.polygon("outline")
    assert outline is not None  # noqa: S101  # for the type checker: a needed polygon is there
    building = Building(
        outline, table.number("height", None, above=0.0, most=HIGHEST), table.number("base", 0.0, most=HIGHEST)
    )
    table.finish()
    return building


def _trees(table: _Table) -> Trees:
    height = table.number("height", 8.0, above=0.0, most=HIGHEST)
    trees = Trees(table.positions(), height, table.number("crown_diameter", 0.6 * height, above=0.0))
    table.finish()
    return trees


def _wall(table: _Table) -> Wall:
    line = table.line("line")
    wall = Wall(line, table.number("height", 2.0, above=0.0, most=HIGHEST), table.number("thickness", 0.25, above=0.0))
    table.finish()
    return wall


def _poles(table: _Table, *, height: float, arm: float) -> Poles:
    degrees = table.number("heading", math.nan)
    poles = Poles(
        table.positions(),
        table.number("height", height, above=0.0, most=HIGHEST),
        table.number("arm", arm, least=0.0),
        None if math.isnan(degrees) else math.radians(degrees),
    )
    table.finish()
    return poles


def _area(table: _Table) -> Area:
    polygon = table.polygon("polygon")
    assert polygon is not None  # noqa: S101  # for the type checker: a needed polygon is there
    area = Area(table.text("name", "Area") or "Area", polygon)
    table.finish()
    return area


@dataclass
class _Table:
    """One TOML table: values are taken by key, and what is left at the end is a mistake."""

    content: dict[str, Any]
    where: str
    known: list[str] = field(default_factory=list)

    def _take(self, key: str) -> Any:  # noqa: ANN401  # TOML holds values of any kind
        self.known.append(key)
        return self.content.get(key)

    def _wrong(self, key: str, wish: str) -> SeipError:
        return SeipError(f"{self.where}: {key} must be {wish}")

    def text(self, key: str, default: str | None) -> str | None:
        value = self._take(key)
        if value is None:
            return default
        if not isinstance(value, str) or not value:
            raise self._wrong(key, "a text in quotes")
        return value

    def optional(self, key: str, *, most: float) -> float | None:
        value = self.number(key, math.nan, above=0.0, most=most)
        return None if math.isnan(value) else value

    def texts(self, key: str) -> tuple[str, ...]:
        value = self._take(key)
        values = value if isinstance(value, list) else [] if value is None else [value]
        if not all(isinstance(one, str) and one for one in values):
            raise self._wrong(key, "a text in quotes, or a list of them")
        return tuple(values)

    def number(
        self,
        key: str,
        default: float | None,
        *,
        above: float = -math.inf,
        least: float = -math.inf,
        most: float = LARGEST,
    ) -> float:
        value = self._take(key)
        if value is None:
            if default is None:
                close = difflib.get_close_matches(key, set(self.content) - set(self.known), n=1, cutoff=0.6)
                raise SeipError(f"{self.where}: {key} is missing{f' (is {close[0]!r} a slip?)' if close else ''}")
            return default
        if not _is_number(value):
            raise self._wrong(key, "a number below 1e9")
        if abs(value) > most:
            raise self._wrong(key, f"at most {most:g}, not {value:g}")
        if not (value > above and value >= least):
            raise self._wrong(
                key, f"{'above' if above > -math.inf else 'at least'} {max(above, least):g}, not {value:g}"
            )
        return float(value)

    def point(self, key: str) -> tuple[float, float] | None:
        value = self._take(key)
        if value is None:
            return None
        if not _is_point(value):
            raise self._wrong(key, "a point [x, y]")
        return float(value[0]), float(value[1])

    def line(self, key: str) -> Float:
        value = self._take(key)
        if not isinstance(value, list) or len(value) < 2 or not all(map(_is_point, value)):
            raise self._wrong(key, "a list of at least two points [[x, y], [x, y]]")
        return np.array(value, dtype=np.float64)

    def polygon(self, key: str, *, needed: bool = True) -> Polygon | None:
        value = self._take(key)
        if value is None and not needed:
            return None
        return self._ring(key, value)

    def region(self, key: str) -> MultiPolygon | None:
        value = self._take(key)
        if value is None:
            return None
        several = isinstance(value, list) and bool(value) and not _is_point(value[0])
        rings = value if several else [value]
        region = MultiPolygon([self._ring(key, ring) for ring in rings])
        low_x, low_y, high_x, high_y = region.bounds
        if max(high_x - low_x, high_y - low_y) > 2 * LARGEST_RADIUS:
            raise self._wrong(key, f"at most {2 * LARGEST_RADIUS:g} m across")
        return region

    def positions(self) -> Float:
        """Return (n, 2) positions: one, or a row from one point to another at a spacing."""
        position, start, stop = self.point("position"), self.point("from"), self.point("to")
        spacing = self.number("spacing", math.nan, above=0.0)
        is_row = start is not None and stop is not None and not math.isnan(spacing)
        if position is not None and start is None and stop is None and math.isnan(spacing):
            return np.array([position])
        if position is not None or not is_row:
            raise SeipError(f"{self.where}: give either position = [x, y] or a row with from, to and spacing")
        ends = np.array([start, stop])
        length = float(np.hypot(*(ends[1] - ends[0])))
        if length / spacing > LONGEST_ROW:
            raise SeipError(
                f"{self.where}: this row has {length / spacing:.3g} places; make it {LONGEST_ROW:,} at most"
            )
        gaps = int(length / spacing + 1e-9)
        along = np.arange(gaps + 1) * (spacing / length if length > 0 else 0.0)
        row: Float = ends[0] + along[:, None] * (ends[1] - ends[0])
        return row

    def rows(self, key: str) -> Iterator[_Table]:
        value = self._take(key)
        if value is None:
            return
        if not isinstance(value, list) or not all(isinstance(row, dict) for row in value):
            raise SeipError(f"{self.where}: write each {key} as a table that begins with [[{key}]]")
        for number, row in enumerate(value, start=1):
            yield _Table(row, f"{self.where}, {key} {number}")

    def finish(self) -> None:
        """Raise an error for the first key that nobody asked for."""
        for key in self.content:
            if key not in self.known:
                close = difflib.get_close_matches(key, self.known, n=3, cutoff=0.5) or sorted(self.known)
                raise SeipError(f"{self.where}: unknown key {key!r}; did you mean {' or '.join(close)}?")

    def _ring(self, key: str, value: Any) -> Polygon:  # noqa: ANN401  # as _take
        if not isinstance(value, list) or len(value) < 3 or not all(map(_is_point, value)):
            raise self._wrong(key, "a list of at least three points [[x, y], [x, y], [x, y]]")
        polygon = Polygon(value)
        if not polygon.is_valid or polygon.area == 0.0:
            reason = explain_validity(polygon) if not polygon.is_valid else "no area"
            raise self._wrong(key, f"the outline of an area that does not cross itself ({reason})")
        if polygon.length > LARGEST:
            raise self._wrong(key, f"an outline of at most {LARGEST:g} m, not {polygon.length:.3g} m")
        return polygon


def _is_number(value: object) -> bool:
    # Whole numbers of any length are valid TOML; no coordinate on Earth reaches this.
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < 1e9


def _is_point(value: object) -> bool:
    return isinstance(value, list) and len(value) == 2 and all(map(_is_number, value))
