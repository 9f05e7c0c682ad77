"""Files of a network of sites."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from ...storage.csv_table import save_csv
from ...storage.files import save_json, whole_file
from ..report.html import as_html
from ..report.pdf import as_pdf
from ..results.file_names import REPORT_FILES
from ..results.geojson import Feature, feature, save_features
from ..results.located import DECIMALS
from .network_page import network_page
from .network_pictures import MAP_SHAPE, draw_curve, draw_map
from .network_record import NetworkRecord, network_json
from .network_report import make_network_report
from .network_view import Street, network_view
from .ranked_sites import RankedSite, ranked_sites, sensors_text

COLUMNS = (
    *("rank", "name", "latitude_deg", "longitude_deg", "weight", "status", "sensors", "types", "price_usd", "value"),
    *("bound", "coverage", "gain_per_1000_usd", "folder", "message"),
)
DIGITS = 9  # of values


def save_sites_table(path: Path, record: NetworkRecord) -> None:
    """Write a row for each site, by gain per dollar."""
    save_csv(path, COLUMNS, [[_figures(one)[name] for name in COLUMNS] for one in ranked_sites(record)])


def save_network_geojson(path: Path, record: NetworkRecord) -> None:
    """Write the sites and their sensors as points on WGS 84 (RFC 7946)."""
    about: dict[str, object] = {"type": "FeatureCollection", "name": record.name}
    if record.attribution:
        about["attribution"] = record.attribution
    save_features(path, about, _features(record))


def _features(record: NetworkRecord) -> Iterator[Feature]:
    ranked = ranked_sites(record)
    for one in ranked:
        figures = _figures(one)
        place = _point(figures.pop("longitude_deg"), figures.pop("latitude_deg"))
        yield feature("site", place, **figures)
    for one in ranked:
        for sensor in one.site.sensors:
            place = _point(_within_a_turn(sensor.longitude), round(sensor.latitude, DECIMALS))
            figures = {"id": sensor.id, "site": one.site.name, "folder": one.site.folder, "sensor": sensor.sensor}
            figures |= {"position": sensor.position, "height_m": round(sensor.height_m, 3)}
            yield feature("sensor", place, **figures, price_usd=round(sensor.price_usd, 2))


def _figures(one: RankedSite) -> dict[str, object]:
    site = one.site
    figures = {name: getattr(site, name) for name in ("name", "weight", "status", "folder", "message")}
    figures |= {name: round(getattr(site, name), DIGITS) for name in ("value", "bound", "coverage")}
    return figures | {
        "rank": one.rank,
        "latitude_deg": round(site.latitude, DECIMALS),
        "longitude_deg": _within_a_turn(site.longitude),
        "sensors": len(site.sensors),
        "types": sensors_text(site.sensors, {}),
        "price_usd": round(site.price_usd, 2),
        "gain_per_1000_usd": None if one.gain is None else round(one.gain, DIGITS),
    }


def _point(longitude: object, latitude: object) -> dict[str, object]:
    return {"type": "Point", "coordinates": [longitude, latitude]}


def _within_a_turn(longitude: float) -> float:
    """Return a longitude from -180 to 180 degrees, which RFC 7946 asks for."""
    return round(longitude - 360.0 * round(longitude / 360.0), DECIMALS)


NETWORK_FILES = ("network.json", "network.geojson", "sites.csv")
PICTURES = ("map.png", "curve.png")
PAGE = "network.html"


def write_network(folder: Path, record: NetworkRecord, streets: Sequence[Street] | None = None) -> tuple[Path, ...]:
    """Write record, tables, pictures, map and report of a network; the same arguments give the same bytes.

    Parameters
    ----------
    folder : Path
        Created if it is missing.
    streets : sequence of ((n, 2) float64, int), optional
        Background of the maps: latitudes and longitudes of each street in degrees, and its importance from 0 to 2.

    Returns
    -------
    tuple of path

    Raises
    ------
    SeipError
        The folder or a file cannot be written.
    """
    picture = draw_map(record, network_view(record, streets, (MAP_SHAPE, MAP_SHAPE)))
    curve = draw_curve(record)
    report = make_network_report(record, picture, curve)
    contents = (picture, curve, network_page(record, streets).encode(), as_html(report).encode(), as_pdf(report))
    save_json(folder / NETWORK_FILES[0], network_json(record))
    save_network_geojson(folder / NETWORK_FILES[1], record)
    save_sites_table(folder / NETWORK_FILES[2], record)
    names = (*PICTURES, PAGE, *REPORT_FILES)
    for name, content in zip(names, contents, strict=True):
        with whole_file(folder / name) as temporary:
            temporary.write_bytes(content)
    return tuple(folder / name for name in (*NETWORK_FILES, *names))
