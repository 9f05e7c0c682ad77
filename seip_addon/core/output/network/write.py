"""Files of a network of sites: tables, pictures, map, and a report with one page for decisions."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path

from ...counts import counted
from ...storage.csv_table import save_csv
from ...storage.files import save_json, whole_file
from ..pictures.drawing import percent
from ..report.blocks import Block, Bullets, Facts, Paragraph, Picture, Report, Section, Table
from ..report.html import as_html
from ..report.pdf import as_pdf
from ..report.wording import date, dollars
from ..results.answer import sentence
from ..results.file_names import REPORT_FILES
from ..results.geographic_files import DECIMALS, Feature, feature, save_features
from .network_map import MAP_SHAPE, Street, caption, draw_curve, draw_map, network_view
from .network_page import network_page
from .network_record import NetworkRecord, RankedSite, gain_text, network_json, outcome, ranked_sites, sensors_text

COLUMNS = (
    *("rank", "name", "latitude_deg", "longitude_deg", "weight", "status", "sensors", "types", "price_usd", "value"),
    *("bound", "coverage", "gain_per_1000_usd", "folder", "message"),
)
DIGITS = 9  # of values
NETWORK_FILES = ("network.json", "network.geojson", "sites.csv")
PICTURES = ("map.png", "curve.png")
PAGE = "network.html"
GAIN = {
    "road": "Gain per $1,000 is in percentage points of the road seen at the site",
    "returns": "Gain per $1,000 is the growth of 1 + typical returns at the site",
}


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


def make_network_report(record: NetworkRecord, drawn_map: bytes, drawn_curve: bytes) -> Report:
    """Return the report with the map and the curve, PNG, on its first page."""
    ranked = ranked_sites(record)
    sections = (
        Section("Sites with sensors", tuple(_equipped(record, ranked))),
        Section("Sites that failed", tuple(_failed(ranked))),
        Section("Notes", (Bullets(tuple(map(sentence, record.notes))),) if record.notes else ()),
        Section("Sources", (Bullets(record.attribution),) if record.attribution else ()),
    )
    when = f", {date(record.created)}" if record.created else ""
    first = (
        Facts(tuple(_key_figures(record)), large=True),
        Picture(drawn_map, "Sites, north is up. Colour shows the result, area the money; hollow: without sensor."),
        Picture(drawn_curve, caption(record)),
    )
    title = f"Roadside LiDAR sensors at the sites of a network{when}"
    return Report(record.name, title, record.created, first, tuple(each for each in sections if each.blocks))


def _key_figures(record: NetworkRecord) -> Iterator[tuple[str, str]]:
    count = {status: sum(site.status == status for site in record.sites) for status in ("equipped", "failed")}
    failed = f", {count['failed']:,} failed" if count["failed"] else ""
    yield "Sites", f"{count['equipped']:,} of {len(record.sites):,} have sensors{failed}"
    sensors = [sensor for site in record.sites for sensor in site.sensors]
    yield "Sensors", f"{len(sensors):,}: {sensors_text(sensors, record.sensor_names)}" if sensors else "none"
    yield "Money", f"{dollars(record.price_usd)} of a budget of {dollars(record.budget_usd)}"
    yield "Quality", _quality(record)
    if count["failed"] < len(record.sites):
        yield "Proof", record.certificate


def _quality(record: NetworkRecord) -> str:
    usable = [site for site in record.sites if site.status != "failed"]
    if not usable:
        return "no site could be computed"
    weights = {site.weight for site in usable}
    mean = "mean of the sites" if len(weights) == 1 else "mean of the sites by their weights"
    if record.criterion == "road":
        return f"{outcome(record, record.value)} of the road is seen ({mean})"
    total = math.fsum(site.weight for site in usable) or 1.0
    seen = math.fsum(site.weight * site.coverage for site in usable) / total
    points = f"about {outcome(record, record.value)} measured points on a typical road user in each revolution"
    return f"{points}; {percent(min(seen, 1.0))} of the road is seen ({mean})"


def _equipped(record: NetworkRecord, ranked: tuple[RankedSite, ...]) -> Iterator[Block]:
    equipped = [one for one in ranked if one.site.status == "equipped"]
    bare = sum(one.site.status == "without sensor" for one in ranked)
    if bare:
        yield Paragraph(f"{counted(bare, 'site has no sensor', 'sites have no sensor')}.")
    if not equipped:
        return
    yield Paragraph(f"Sites by gain per dollar. {GAIN[record.criterion]}, times its weight over the mean weight.")
    figure = "Road seen" if record.criterion == "road" else "Returns"
    rows = tuple(
        (
            *(str(one.rank or "–"), one.site.name, sensors_text(one.site.sensors, record.sensor_names)),
            *(dollars(one.site.price_usd), _result(record, one), gain_text(record, one.gain)),
        )
        for one in equipped
    )
    yield Table(("Rank", "Site", "Sensors", "Money", figure, "Gain per $1,000"), rows, frozenset({0, 3, 4, 5}))


def _result(record: NetworkRecord, one: RankedSite) -> str:
    return percent(one.site.coverage) if record.criterion == "road" else outcome(record, one.site.value)


def _failed(ranked: tuple[RankedSite, ...]) -> Iterator[Block]:
    rows = tuple((one.site.name, one.site.message) for one in ranked if one.site.status == "failed")
    if rows:
        yield Paragraph("The figures of the network leave these sites out.")
        yield Table(("Site", "Reason"), rows)
