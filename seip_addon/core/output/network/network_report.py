"""Report on a network: one page for decisions, then the sites, failures and sources."""

from __future__ import annotations

import math
from collections.abc import Iterator

from ...counts import counted
from ..pictures.drawing import percent
from ..report.blocks import Block, Bullets, Facts, Paragraph, Picture, Report, Section, Table
from ..report.wording import date, dollars
from ..results.answer import sentence
from .network_pictures import caption
from .network_record import PROVEN, NetworkRecord
from .ranked_sites import RankedSite, gain_text, outcome, ranked_sites, sensors_text

GAIN = {
    "road": "Gain per $1,000 is in percentage points of the road seen at the site",
    "returns": "Gain per $1,000 is the growth of 1 + typical returns at the site",
}


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
        yield "Proof", _proof(record)


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


def _proof(record: NetworkRecord) -> str:
    money = f"For {dollars(record.budget_usd)} no other choice of sensors among these sites and positions"
    if record.goal is not None:
        return record.certificate
    if record.gap <= PROVEN:
        return f"{money} does better: this is proven."
    if record.criterion == "road":
        return f"{money} sees more than {math.ceil(record.bound * 1000 - 1e-6) / 10:.1f}%: this is proven."
    return f"{money} gives more than {outcome(record, record.bound)} points: this is proven."


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
