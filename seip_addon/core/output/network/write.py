"""Files of a network of sites: tables, map, and a report with one page for decisions."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from ...base.counts import counted
from ...storage.csv_table import save_csv
from ...storage.files import save_json, whole_file
from ..pictures.drawing import percent
from ..report.blocks import Block, Bullets, Facts, Paragraph, Picture, Report, Table, make_sections
from ..report.pdf import save_report
from ..report.wording import date, dollars
from ..results.answer import sentence
from ..results.geographic_files import DECIMALS, Feature, feature, save_features
from .network_map import Street, draw_map
from .network_record import (
    NetworkRecord,
    RankedSite,
    gain_text,
    network_json,
    outcome,
    ranked_sites,
    result,
    sensors_text,
)

COLUMNS = (
    *("rank", "name", "latitude_deg", "longitude_deg", "weight", "status", "sensors", "types", "price_usd", "value"),
    *("bound", "coverage", "gain_per_1000_usd", "folder", "message"),
)
DIGITS = 9  # of values
NETWORK_FILES = ("network.json", "network.geojson", "sites.csv")
PICTURE = "map.png"
GAIN = {
    "road": "Gain per $1,000 is in percentage points of the road seen at the site",
    "returns": "Gain per $1,000 is the growth of 1 + typical returns at the site",
}


def write_network(folder: Path, record: NetworkRecord, streets: Sequence[Street] | None = None) -> tuple[Path, ...]:
    """Write record, tables, map and report of a network; the same arguments give the same bytes.

    Parameters
    ----------
    folder : Path
        Created if it is missing.
    streets : sequence of ((n, 2) float64, int), optional
        Background of the map: latitudes and longitudes of each street in degrees, and its importance from 0 to 2.

    Returns
    -------
    tuple of path

    Raises
    ------
    SeipError
        The folder or a file cannot be written.
    """
    drawn = draw_map(record, streets)
    save_json(folder / NETWORK_FILES[0], network_json(record))
    save_features(folder / NETWORK_FILES[1], record.name, record.attribution, _features(record))
    save_csv(
        folder / NETWORK_FILES[2], COLUMNS, [[_figures(one)[name] for name in COLUMNS] for one in ranked_sites(record)]
    )
    with whole_file(folder / PICTURE) as temporary:
        temporary.write_bytes(drawn)
    report = save_report(folder, make_network_report(record, drawn))
    return (*(folder / name for name in (*NETWORK_FILES, PICTURE)), *report)


def _features(record: NetworkRecord) -> Iterator[Feature]:
    """Yield the sites and their sensors as points on WGS 84."""
    ranked = ranked_sites(record)
    for one in ranked:
        figures = _figures(one)
        yield feature("site", "Point", [figures.pop("longitude_deg"), figures.pop("latitude_deg")], **figures)
    for one in ranked:
        for sensor in one.site.sensors:
            place = [_within_a_turn(sensor.longitude), round(sensor.latitude, DECIMALS)]
            figures = {"id": sensor.id, "site": one.site.name, "folder": one.site.folder, "sensor": sensor.sensor}
            figures |= {"position": sensor.position, "height_m": round(sensor.height_m, 3)}
            yield feature("sensor", "Point", place, **figures, price_usd=round(sensor.price_usd, 2))


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


def _within_a_turn(longitude: float) -> float:
    """Return a longitude from -180 to 180 degrees, which RFC 7946 asks for."""
    return round(longitude - 360.0 * round(longitude / 360.0), DECIMALS)


def make_network_report(record: NetworkRecord, drawn_map: bytes) -> Report:
    """Return the report with the map, PNG, on its first page."""
    ranked = ranked_sites(record)
    failed = tuple((one.site.name, one.site.message) for one in ranked if one.site.status == "failed")
    left_out = (Paragraph("The figures of the network leave these sites out."), Table(("Site", "Reason"), failed))
    contents: dict[str, Iterable[Block]] = {
        "Sites with sensors": _equipped(record, ranked),
        "Sites that failed": left_out if failed else (),
        "Notes": [Bullets(tuple(map(sentence, record.notes)))] if record.notes else [],
        "Sources": [Bullets(record.attribution)] if record.attribution else [],
    }
    first = (
        Facts(tuple(_key_figures(record)), large=True),
        Picture(drawn_map, "Sites, north is up. Colour shows the result, area the money; hollow: without sensor."),
    )
    title = f"Roadside LiDAR sensors at the sites of a network{f', {date(record.created)}' if record.created else ''}"
    return Report(record.name, title, record.created, first, make_sections(contents))


def _key_figures(record: NetworkRecord) -> Iterator[tuple[str, str]]:
    usable = [site for site in record.sites if site.status != "failed"]
    equipped, failed = sum(site.status == "equipped" for site in usable), len(record.sites) - len(usable)
    yield "Sites", f"{equipped:,} of {len(record.sites):,} have sensors{f', {failed:,} failed' if failed else ''}"
    sensors = [sensor for site in record.sites for sensor in site.sensors]
    yield "Sensors", f"{len(sensors):,}: {sensors_text(sensors, record.sensor_names)}" if sensors else "none"
    yield "Money", f"{dollars(record.price_usd)} of a budget of {dollars(record.budget_usd)}"
    if not usable:
        yield "Quality", "no site could be computed"
        return
    mean = f"mean of the sites{' by their weights' if len({site.weight for site in usable}) > 1 else ''}"
    typical = outcome(record, record.value)
    if record.criterion == "road":
        yield "Quality", f"{typical} of the road is seen ({mean})"
    else:
        total = math.fsum(site.weight for site in usable) or 1.0
        seen = percent(min(math.fsum(site.weight * site.coverage for site in usable) / total, 1.0))
        points = f"about {typical} measured points on a typical road user in each revolution"
        yield "Quality", f"{points}; {seen} of the road is seen ({mean})"
    yield "Proof", record.certificate


def _equipped(record: NetworkRecord, ranked: tuple[RankedSite, ...]) -> Iterator[Block]:
    equipped = [one for one in ranked if one.site.status == "equipped"]
    bare = sum(one.site.status == "without sensor" for one in ranked)
    if bare:
        yield Paragraph(f"{counted(bare, 'site has no sensor', 'sites have no sensor')}.")
    if not equipped:
        return
    yield Paragraph(f"Sites by gain per dollar. {GAIN[record.criterion]}, times its weight over the mean weight.")
    rows = tuple(
        (
            *(str(one.rank or "–"), one.site.name, sensors_text(one.site.sensors, record.sensor_names)),
            *(dollars(one.site.price_usd), result(record, one.site), gain_text(record, one.gain)),
        )
        for one in equipped
    )
    figure = "Road seen" if record.criterion == "road" else "Returns"
    yield Table(("Rank", "Site", "Sensors", "Money", figure, "Gain per $1,000"), rows, frozenset({0, 3, 4, 5}))
