"""Site descriptions read from a small TOML file.

The keys are explained in docs/site-description.md. Coordinates are map coordinates in metres; headings are degrees in
the file and radians in a `SiteDescription`.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from shapely import MultiPolygon, Polygon
from shapely.validation import explain_validity

from ...base import limits
from ...base.arrays import Float
from ...base.errors import SeipError
from ...site.scene_geometry import DEFAULT_WEIGHT
from ...storage.toml_table import Key, Reader, is_number, number, parse_toml, read_table, text, toml_text
from .description import Area, Building, Poles, SiteDescription, Trees, Wall, WeightedRegion

DESCRIPTION_SUFFIX = ".toml"
MAX_SIZE, MAX_RADIUS = limits.SIZE.most, limits.SITE_RADIUS.most  # metres
MIN_AREA = 1e-4  # square metres below which an outline encloses nothing
MAX_ROW_LENGTH = 10_000  # limit on the trees or lights of a row
_SIZE = number(limits.SIZE)
_HEIGHT = number(limits.HEIGHT)
_EXTENT = Key(number(limits.SITE_RADIUS), None)
_ARM = number(limits.DISTANCE)


def read_site_description(path: Path) -> SiteDescription:
    """Read a site description.

    Parameters
    ----------
    path : Path
        TOML file. The path of its map is relative to its folder.

    Raises
    ------
    SeipError
        The file does not exist, is not valid TOML, or has an unknown key (close ones are suggested), a value of the
        wrong type or an invalid shape.
    """
    written = toml_text(path, "site description")
    keys = _PLACE | {name: Key(_tables(name), ()) for name in _LISTED}
    values = read_table(parse_toml(written, str(path)), str(path), keys)
    for name, (make, own) in _LISTED.items():
        numbered = enumerate(values.pop(name), start=1)
        values[f"{name}s"] = tuple(_listed(table, f"{path}, {name} {number}", make, own) for number, table in numbered)
    if values["map"] is not None:
        values["map"] = path.parent / values["map"]
    description = SiteDescription(**values)
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
    """Return the map and description of a place; arguments given here replace those of the file.

    Parameters
    ----------
    source : Path
        Map, or a site description that names it.
    site : Path, optional
        Site description to use with a map.
    near, junction, radius, approaches
        See `SiteDescription`.

    Raises
    ------
    SeipError
        See `read_site_description`; or no map is named, or a number is invalid.

    Examples
    --------
    >>> text = '''
    ... map = "town.xodr"
    ... junction = "Mill Lane"
    ... [[tree]]
    ... from = [0, 8]
    ... to = [20, 8]
    ... spacing = 10
    ... '''
    >>> _ = Path("site.toml").write_text(text, encoding="utf-8")
    >>> map_path, description = describe_place(Path("site.toml"), approaches=60.0)
    >>> map_path.name, description.along, description.trees[0].positions.tolist()
    ('town.xodr', 60.0, [[0.0, 8.0], [10.0, 8.0], [20.0, 8.0]])
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
        if length is not None and not limits.SITE_RADIUS.allow(length):
            raise SeipError(f"the {name} must be {limits.SITE_RADIUS}, not {length:g}")
    if radius is not None or approaches is not None:
        described = replace(described, radius=radius, approaches=approaches, region=None)
    if described.approaches is not None and described.junction is None:
        raise SeipError("the approaches are those of a junction: name one, or give a radius")
    return map_path, described


def _described(source: Path, site: Path | None) -> SiteDescription:
    """Return the description of a place from its files."""
    if source.suffix.lower() == DESCRIPTION_SUFFIX:
        if site is not None:
            raise SeipError(f"{source} is a site description already; leave out the other one, {site}")
        return read_site_description(source)
    return replace(SiteDescription() if site is None else read_site_description(site), map=source)


def _listed(table: dict[str, Any], where: str, make: Callable[..., Any], keys: Mapping[str, Key]) -> Any:  # noqa: ANN401
    values = read_table(table, where, keys)
    try:
        return make(**values)
    except ValueError as error:
        raise SeipError(f"{where}: {error}") from error


def _tables(key: str) -> Reader:
    def read(value: Any) -> list[dict[str, Any]]:  # noqa: ANN401  # TOML holds values of any kind
        if not isinstance(value, list) or not all(isinstance(row, dict) for row in value):
            raise ValueError(f"must be tables, each of which begins with [[{key}]]")
        return value

    return read


def _texts(value: object) -> tuple[str, ...]:
    values = value if isinstance(value, list) else [value]
    if not all(isinstance(one, str) and one for one in values):
        raise ValueError("must be a text in quotes, or a list of them")
    return tuple(values)


def _is_point(value: object) -> bool:
    return isinstance(value, list) and len(value) == 2 and all(map(is_number, value))


def _point(value: Any) -> tuple[float, float]:  # noqa: ANN401  # TOML holds values of any kind
    if not _is_point(value):
        raise ValueError("must be a point [x, y]")
    return float(value[0]), float(value[1])


def _line(value: object) -> Float:
    if not isinstance(value, list) or len(value) < 2 or not all(map(_is_point, value)):
        raise ValueError("must be a list of at least two points [[x, y], [x, y]]")
    return np.array(value, dtype=np.float64)


def _outline(value: object) -> Polygon:
    if not isinstance(value, list) or len(value) < 3 or not all(map(_is_point, value)):
        raise ValueError("must be a list of at least three points [[x, y], [x, y], [x, y]]")
    polygon = Polygon(value)
    if not polygon.is_valid or polygon.area < MIN_AREA:
        reason = explain_validity(polygon) if not polygon.is_valid else "no area"
        raise ValueError(f"must be the outline of an area that does not cross itself ({reason})")
    if polygon.length > MAX_SIZE:
        raise ValueError(f"must be an outline of at most {MAX_SIZE:g} m, not {polygon.length:.3g} m")
    return polygon


def _region(value: object) -> MultiPolygon:
    rings = value if isinstance(value, list) and value and not _is_point(value[0]) else [value]
    region = MultiPolygon([_outline(ring) for ring in rings])
    low_x, low_y, high_x, high_y = region.bounds
    if max(high_x - low_x, high_y - low_y) > 2 * MAX_RADIUS:
        raise ValueError(f"must be at most {2 * MAX_RADIUS:g} m across")
    return region


def _weighted_region(name: str | None, weight: float, polygon: Polygon | None, junction: str | None) -> WeightedRegion:
    if (polygon is None) == (junction is None):
        raise ValueError("give either polygon or junction")
    usual = f"Junction {junction}" if junction is not None else "Weighted region"
    return WeightedRegion(name or usual, weight, polygon, junction)


def _trees(height: float, crown_diameter: float | None, **row: Any) -> Trees:  # noqa: ANN401  # `_ROW`
    crown_diameter = 0.6 * height if crown_diameter is None else crown_diameter
    return Trees(_positions(row), height, crown_diameter)


def _poles(height: float, arm: float, heading: float | None, **row: Any) -> Poles:  # noqa: ANN401  # `_ROW`
    return Poles(_positions(row), height, arm, None if heading is None else math.radians(heading))


def _positions(row: Mapping[str, Any]) -> Float:
    """Return positions (n, 2): a single one, or a row from one point to another at a spacing."""
    given = {key for key, value in row.items() if value is not None}
    if given == {"position"}:
        return np.array([row["position"]])
    if given != {"from", "to", "spacing"}:
        raise ValueError("give either position = [x, y] or a row with from, to and spacing")
    ends, spacing = np.array([row["from"], row["to"]]), row["spacing"]
    length = float(np.hypot(*(ends[1] - ends[0])))
    if length / spacing > MAX_ROW_LENGTH:
        raise ValueError(f"this row has {length / spacing:.3g} places; make it {MAX_ROW_LENGTH:,} at most")
    gaps = int(length / spacing + 1e-9)  # a row ends on its last whole step in spite of rounding
    along = np.arange(gaps + 1) * (spacing / length if length > 0 else 0.0)
    positions: Float = ends[0] + along[:, None] * (ends[1] - ends[0])
    return positions


_ROW = {"position": Key(_point, None), "from": Key(_point, None), "to": Key(_point, None), "spacing": Key(_SIZE, None)}

_POLE = _ROW | {"heading": Key(number(limits.DEGREES), None)}


_AREA = {"name": Key(text, "Area"), "polygon": Key(_outline)}

_PLACE = {
    "name": Key(text, ""),
    "map": Key(text, None),
    "near": Key(_point, None),
    "junction": Key(text, None),
    "radius": _EXTENT,
    "approaches": _EXTENT,
    "region": Key(_region, None),
    "level": Key(_texts, ()),
    "attribution": Key(_texts, ()),
}
"""Keys of the file itself."""

_LISTED: Mapping[str, tuple[Callable[..., Any], Mapping[str, Key]]] = {
    "weighted_region": (
        _weighted_region,
        {
            "name": Key(text, None),
            "weight": Key(number(limits.CHOSEN_WEIGHT), DEFAULT_WEIGHT),
            "polygon": Key(_outline, None),
            "junction": Key(text, None),
        },
    ),
    "building": (
        Building,
        {"outline": Key(_outline), "height": Key(_HEIGHT), "base": Key(number(limits.ABOVE_GROUND), 0.0)},
    ),
    "tree": (_trees, _ROW | {"height": Key(_HEIGHT, 8.0), "crown_diameter": Key(_SIZE, None)}),
    "wall": (Wall, {"line": Key(_line), "height": Key(_HEIGHT, 2.0), "thickness": Key(_SIZE, 0.25)}),
    "street_light": (_poles, _POLE | {"height": Key(_HEIGHT, 8.0), "arm": Key(_ARM, 1.5)}),
    "signal_pole": (_poles, _POLE | {"height": Key(_HEIGHT, 6.0), "arm": Key(_ARM, 5.0)}),
    "forbidden_area": (Area, _AREA),
    "mandatory_area": (Area, _AREA),
}
"""Constructor and keys of each kind of table in the file; the field ``buildings`` holds all tables ``building``."""
