"""Reports: what they say, that nothing in a name becomes markup, and that the same folder gives the same bytes."""

import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from report_folder import NAME, make_folder

from seip_addon.core.errors import SeipError
from seip_addon.core.opendrive.geo_reference import GeoReference
from seip_addon.core.placement.objective import MOVED, Objective
from seip_addon.core.progress import finish
from seip_addon.core.report.blocks import Bullets, Code, Paragraph, Picture, Table
from seip_addon.core.report.evidence import load_evidence
from seip_addon.core.report.html import as_html
from seip_addon.core.report.losses import front
from seip_addon.core.report.sections import certificate_sentence, make_report
from seip_addon.core.report.write import FILES, write_report

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
    make_folder(folder)
    finish(write_report(folder, EFFORT))
    return folder


@pytest.fixture(scope="module")
def page(folder):
    return Page((folder / "report.html").read_text(encoding="utf-8"))


def blocks(folder, kind, points=()):
    report = make_report(load_evidence(folder), points)
    return [block for section in report.sections for block in section.blocks if isinstance(block, kind)]


def test_names_stay_text(page):
    assert "script" not in page.tags
    assert "i" not in page.tags
    assert NAME in page.text
    assert "Mill Lane <i>" in page.text
    assert "type2: sees <far>." in page.text


def test_nothing_comes_from_elsewhere(page):
    assert page.sources
    assert all(source.startswith("data:image/png;base64,") for source in page.sources)


@pytest.mark.slow
def test_the_same_folder_gives_the_same_bytes(folder, tmp_path):
    first = [(folder / name).read_bytes() for name in FILES]
    finish(write_report(folder, EFFORT))
    assert [(folder / name).read_bytes() for name in FILES] == first
    make_folder(tmp_path / "elsewhere")
    finish(write_report(tmp_path / "elsewhere", EFFORT))
    assert [(tmp_path / "elsewhere" / name).read_bytes() for name in FILES] == first


def test_the_pdf_is_whole_and_dated_by_the_record(folder):
    content = (folder / "report.pdf").read_bytes()
    assert content.startswith(b"%PDF-1.")
    assert content.rstrip().endswith(b"%%EOF")
    assert b"(D:20260102030405Z)" in content


def test_every_sensor_has_its_places_and_its_price(folder, page):
    record = load_evidence(folder).record
    for sensor in record.sensors:
        for words in (
            sensor.position,
            f"{sensor.latitude_deg:.8f}",
            f"{sensor.price_usd:,.0f}",
            f"{sensor.map_m[0]:.3f}",
        ):
            assert words in page.text


def test_places_and_blind_spots_are_named(page):
    assert "High Street" in page.text
    assert "of road is not seen" in page.text
    assert "Road to the" not in page.text


def test_figures_agree_with_the_grid(folder):
    evidence = load_evidence(folder)
    assert evidence.seen.mean() == pytest.approx(evidence.record.coverage.whole)
    points = finish(front(evidence, EFFORT))
    assert [point.count for point in points] == [1, 2, 3, 4, 5]
    assert all(np.diff([point.coverage for point in points]) >= 0)
    placed = points[2]
    assert placed.coverage + placed.missed >= evidence.record.coverage.whole


@pytest.mark.parametrize(
    ("goal", "found", "says"),
    [
        (
            Objective(count=3),
            {},
            r"No other choice among the 32 places where a sensor may hang .* covers more of the road: this is proven\.",
        ),
        (
            Objective(count=3),
            {"status": "feasible", "objective": 500.0, "bound": 509.4, "gap": 0.0188},
            r"covers more than 1\.4 percentage points more of the road: this much is proven",
        ),
        (
            Objective(coverage=0.5),
            {"objective": 30_000.0, "bound": 24_000.0, "gap": 0.2, "status": "feasible"},
            r"is more than \$6,000 cheaper: this much is proven",
        ),
        (Objective(coverage=0.5), {}, r"reaches the coverage that was asked for at a lower price: this is proven\."),
        (Objective(count=3), {"status": "feasible", "bound": np.inf, "gap": np.inf}, "how much better is not known"),
        (Objective(count=3), {"status": MOVED, "bound": np.nan, "gap": np.inf}, "nothing is proven of it"),
        (
            Objective(count=3),
            {"notes": ("chosen for the worst failure",), "gap": 0.5, "status": "feasible"},
            r"Within 50\.00% of the best",
        ),
    ],
)
def test_the_certificate_is_a_sentence_for_engineers(tmp_path, goal, found, says):
    make_folder(tmp_path, goal=goal, **found)
    assert re.search(says, certificate_sentence(load_evidence(tmp_path)))


def test_without_a_projection_there_are_no_latitudes(tmp_path):
    make_folder(tmp_path, place=GeoReference())
    evidence = load_evidence(tmp_path)
    text = as_html(make_report(evidence, ()))
    assert "no latitudes and longitudes" in text
    assert "Latitude, °" not in text


def test_without_its_grid_a_folder_has_no_front_and_the_report_says_why(tmp_path):
    make_folder(tmp_path)
    (tmp_path / "visibility.npz").unlink()
    evidence = load_evidence(tmp_path)
    assert finish(front(evidence, EFFORT)) == ()
    assert any("does not hold the visibility grid" in one.text for one in blocks(tmp_path, Paragraph))
    (tmp_path / "plan.png").unlink()
    assert len(blocks(tmp_path, Picture)) == 1


def test_a_front_can_be_left_out(folder):
    assert finish(front(load_evidence(folder), 0.0)) == ()
    assert any("was not asked for" in one.text for one in blocks(folder, Paragraph))


def test_all_rows_are_as_long_as_their_heads(folder):
    for table in blocks(folder, Table):
        assert {len(row) for row in table.rows} == {len(table.head)}


def broken(folder, name, content):
    make_folder(folder)
    (folder / name).write_bytes(content)
    return folder


def test_each_wrong_folder_has_its_sentence(tmp_path):
    with pytest.raises(SeipError, match=r"there is no folder .*nowhere: name the one that `seip place`"):
        load_evidence(tmp_path / "nowhere")
    with pytest.raises(SeipError, match=r"holds no placement\.json: name a folder"):
        load_evidence(tmp_path)
    with pytest.raises(SeipError, match=r"placement\.json is damaged"):
        load_evidence(broken(tmp_path / "a", "placement.json", b"{"))
    with pytest.raises(SeipError, match=r"site\.npz is no table .*; place the sensors again"):
        load_evidence(broken(tmp_path / "b", "site.npz", b"PK\x03\x04"))
    with pytest.raises(SeipError, match=r"plan\.png is damaged or no picture"):
        load_evidence(broken(tmp_path / "c", "plan.png", b"\x89PNG"))
    with pytest.raises(SeipError, match=r"visibility\.npz .*damaged"):
        load_evidence(broken(tmp_path / "d", "visibility.npz", b"PK\x03\x04"))


def test_files_of_different_placements_are_told_apart(tmp_path):
    make_folder(tmp_path)
    path = tmp_path / "placement.json"
    path.write_text(path.read_text(encoding="utf-8").replace("abab", "cdcd"), encoding="utf-8")
    with pytest.raises(SeipError, match="holds files of different placements"):
        load_evidence(tmp_path)


def test_a_report_of_a_wrong_folder_leaves_nothing(tmp_path):
    broken(tmp_path, "site.npz", b"")
    before = {path.name for path in tmp_path.iterdir()}
    with pytest.raises(SeipError):
        finish(write_report(tmp_path))
    assert {path.name for path in tmp_path.iterdir()} == before


def test_signs_that_the_type_does_not_have_do_no_harm(tmp_path, recwarn):
    make_folder(tmp_path)
    path = tmp_path / "placement.json"
    path.write_text(path.read_text(encoding="utf-8").replace("Crossing", "路口"), encoding="utf-8")
    finish(write_report(tmp_path, 0.0))
    assert (tmp_path / "report.pdf").stat().st_size > 10_000
    assert not [one for one in recwarn if "Glyph" in str(one.message)]


def test_sensors_moved_by_hand_have_no_command(tmp_path):
    make_folder(tmp_path)
    record = load_evidence(tmp_path).record
    moved = replace(record, objective=replace(record.objective, solver="none", status=MOVED))
    evidence = replace(load_evidence(tmp_path), record=moved)
    kinds = [type(block) for section in make_report(evidence, ()).sections for block in section.blocks]
    assert Code not in kinds
    assert Bullets in kinds
