"""Reports: what they say, that nothing in a name becomes markup, and that the same folder gives the same bytes."""

import re
from dataclasses import replace
from functools import cache
from html import unescape
from html.parser import HTMLParser

import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement.objective import FrontPoint
from seip_addon.core.choosing.placement.returns_summary import ReturnsPoint, ReturnsSummary
from seip_addon.core.output.report.blocks import Card, Facts, Paragraph, Picture, Table, as_html
from seip_addon.core.output.report.evidence import load_evidence
from seip_addon.core.output.report.sections import make_report, returns_within, write_report
from seip_addon.core.output.results.answer import costs_of
from seip_addon.core.output.results.file_names import REPORT_FILES
from seip_addon.core.site.installed_cost import load_installed_cost
from tests.builders.report_folder import CROSSING, NAME, make_folder

EFFORT = 0.2
VOID = {"meta", "img", "link", "br"}


class Page(HTMLParser):
    """Tags in order, balanced, with the text between them."""

    def __init__(self, text):
        super().__init__()
        self.open, self.tags, self.text, self.sources = [], [], "", []
        self.feed(text)
        assert not self.open

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.sources += [value for name, value in attrs if name in {"src", "href"}]
        assert not any(name.startswith("on") for name, _ in attrs)
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if "style" not in self.open:
            self.text += data


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("report") / "out"
    make_folder(folder, effort=EFFORT, pictures=True)
    finish(write_report(folder))
    return folder


@pytest.fixture(scope="module")
def page(folder):
    return Page((folder / "report.html").read_text(encoding="utf-8"))


def blocks_of(report, kind):
    """Return all blocks of a kind, those within cards included."""
    tops = [*report.first, *(block for blocks in report.sections.values() for block in blocks)]
    within = [inner for block in tops if isinstance(block, Card) for inner in block.blocks]
    return [block for block in (*tops, *within) if isinstance(block, kind)]


@cache
def report_of(folder):
    return make_report(load_evidence(folder))


def blocks(folder, kind):
    return blocks_of(report_of(folder), kind)


def text_of(folder, **changes):
    """Return the page of a folder with parts of its record changed."""
    evidence = load_evidence(folder)
    return unescape(as_html(make_report(replace(evidence, record=replace(evidence.record, **changes)))))


def test_names_stay_text(page):
    assert "script" not in page.tags
    assert "i" not in page.tags
    assert NAME in page.text
    assert "Mill Lane <i>" in page.text  # without the mark that would reverse the order of what follows
    assert "Type 2 (32 channels): sees <far>." in page.text


def test_nothing_comes_from_elsewhere(page):
    assert page.sources
    assert all(source.startswith("data:image/png;base64,") for source in page.sources)


@pytest.mark.slow
def test_the_same_folder_gives_the_same_bytes(folder, tmp_path):
    first = [(folder / name).read_bytes() for name in REPORT_FILES]
    finish(write_report(folder))
    assert [(folder / name).read_bytes() for name in REPORT_FILES] == first
    make_folder(tmp_path / "elsewhere", effort=EFFORT, pictures=True)
    finish(write_report(tmp_path / "elsewhere"))
    assert [(tmp_path / "elsewhere" / name).read_bytes() for name in REPORT_FILES] == first


def test_the_pdf_is_whole_and_dated_by_the_record(folder):
    content = (folder / "report.pdf").read_bytes()
    assert content.startswith(b"%PDF-1.")
    assert content.rstrip().endswith(b"%%EOF")
    assert b"(D:20260102030405Z)" in content


def test_every_sensor_has_a_card_with_its_place_and_its_costs(folder):
    record = load_evidence(folder).record
    cards = blocks(folder, Card)
    assert [card.title.split()[0] for card in cards] == [sensor.id for sensor in record.sensors]
    for sensor, card in zip(record.sensors, cards, strict=True):
        facts = dict(next(block for block in card.blocks if isinstance(block, Facts)).rows)
        assert facts["Location"] == sensor.location
        assert sensor.position in facts["Mounted on"]
        assert facts["Height, tilt"].startswith(f"{sensor.height_m:.2f} m above the ground, ")
        east, north = sensor.map_m[0] - 4_500_000.0, sensor.map_m[1] + 5_300_000.0
        assert facts["Easting, northing"] == f"{east:.1f}, {north:.1f} m"
        assert facts["Altitude"] == f"{sensor.altitude_m:.1f} m"
        assert facts["Latitude, longitude"] == f"{sensor.latitude_deg:.6f}°, {sensor.longitude_deg:.6f}°"
        assert f"sensor ${sensor.price_usd:,.0f}" in facts["Cost"]
        assert ("mounting on the pole" in facts["Cost"]) == sensor.on_pole
        assert ("Yaw" in facts) == (not sensor.all_round)
        assert all(value.strip() for value in facts.values())


def test_the_first_page_says_where_what_how_many_what_price_and_how_good(folder):
    report = report_of(folder)
    (facts,) = (block for block in report.first if isinstance(block, Facts))
    assert [name for name, _ in facts.rows] == ["Where", "What", "How many", "Price", "Quality"]
    assert all(value.strip() for _, value in facts.rows)
    assert sum(isinstance(block, Picture) for block in report.first) == 1
    (paragraph,) = (block for block in report.first if isinstance(block, Paragraph))
    assert paragraph.text.endswith("By the criterion, no placement of these candidates is better.")
    assert report.subtitle.endswith("2 January 2026")


def test_prices_are_installed_whether_or_not_the_placement_counted_that(folder):
    record = load_evidence(folder).record
    table = load_installed_cost()
    added = [sum(table.items(on_pole=sensor.on_pole, bracket=0.4).values()) for sensor in record.sensors]
    costs = costs_of(record)
    assert costs.estimated
    assert costs.total == pytest.approx(record.price_usd + sum(added))
    paid = tuple(
        replace(sensor, price_usd=sensor.price_usd + extra, installation_usd=extra)
        for sensor, extra in zip(record.sensors, added, strict=True)
    )
    installed = costs_of(replace(record, sensors=paid))
    assert not installed.estimated
    assert (installed.total, installed.sensors) == (pytest.approx(costs.total), pytest.approx(costs.sensors))
    other = costs_of(replace(record, sensors=tuple(replace(one, installation_usd=1.0) for one in record.sensors)))
    assert all(items["installation"] == 1.0 for items in other.items)
    assert f"about ${costs.total:,.0f} installed" in text_of(folder)


def test_places_crossings_and_blind_spots_are_named(page):
    assert "High Street, 48 m east of the centre (" in page.text
    assert "counted from the centre of “central box”; north is the direction of the map's y axis" in page.text
    assert CROSSING.name in page.text
    assert re.search(rf"{CROSSING.name}\s*[\d.]+%\s*4\.2", page.text)
    assert f"Fewer than 5: {CROSSING.name}." in page.text


def test_no_field_is_empty_and_no_json_is_shown(folder, page):
    for table in blocks(folder, Table):
        assert {len(row) for row in table.rows} == {len(table.head)}
        for row in table.rows:
            assert all(cell.strip() for cell in row) or row[0] == "Total"
    assert all(value.strip() for facts in blocks(folder, Facts) for _, value in facts.rows)
    assert not re.search(r"[{}]|null|None|nan", page.text)


def test_the_table_of_numbers_is_that_of_the_record(folder):
    record = load_evidence(folder).record
    (table,) = (table for table in blocks(folder, Table) if table.head[0] == "Sensors")
    assert [row[0] for row in table.rows] == [str(point.count) for point in record.front]
    assert "With fewer or more sensors" not in text_of(folder, front=record.front[:1])
    proven = (FrontPoint(1, 0.5, 10_000.0, 0.0), FrontPoint(2, 0.75, 20_000.0, 0.0132))
    text = text_of(folder, front=proven)
    assert "none sees more" in text
    assert "at most 1.4 percentage points more" in text


def test_bounds_on_returns_are_numbers_of_points_rounded_up(folder):
    front = (ReturnsPoint(1, 13.0, 10_000.0, 0.0), ReturnsPoint(2, 51.6, 20_000.0, 0.0534))
    text = text_of(folder, returns=ReturnsSummary(51.6, {"pedestrian": 51.6}, (), front))
    assert "none has more than 55" in text  # 52.6 × 1.0534 − 1 = 54.41
    alone = text_of(folder, returns=ReturnsSummary(0.26, {"pedestrian": 0.26}, (), (ReturnsPoint(2, 0.26, 1.0, 1.1),)))
    assert "With fewer or more sensors" not in alone
    assert returns_within(0.26, 1.119) == "1.7"


def broken(folder, name, content):
    make_folder(folder)
    (folder / name).write_bytes(content)
    return folder


def test_each_wrong_folder_has_its_sentence(tmp_path):
    with pytest.raises(SeipError, match=r"nowhere holds no placement\.json: name a folder that `seip place`"):
        load_evidence(tmp_path / "nowhere")
    with pytest.raises(SeipError, match=r"placement\.json is damaged"):
        load_evidence(broken(tmp_path / "a", "placement.json", b"{"))
    with pytest.raises(SeipError, match=r"site\.npz is damaged or not a table .*; place the sensors again"):
        load_evidence(broken(tmp_path / "b", "site.npz", b"PK\x03\x04"))


def test_files_of_different_placements_are_told_apart(tmp_path):
    make_folder(tmp_path)
    path = tmp_path / "placement.json"
    path.write_text(path.read_text(encoding="utf-8").replace("abab", "cdcd"), encoding="utf-8")
    with pytest.raises(SeipError, match="holds files of different placements"):
        load_evidence(tmp_path)
