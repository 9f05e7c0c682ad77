"""Reports: what they say, that nothing in a name becomes markup, and that the same folder gives the same bytes."""

import math
import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from seip_addon.core.choosing.placement.cheapest import SAME_PRICE, cheapest_for_coverage
from seip_addon.core.choosing.placement.objective import MOVED, Objective
from seip_addon.core.choosing.placement.returns_summary import ReturnsSummary
from seip_addon.core.choosing.placement.search_limits import SolverLimits
from seip_addon.core.choosing.placement.solver import solve
from seip_addon.core.errors import SeipError
from seip_addon.core.geometry.geo_reference import GeoReference
from seip_addon.core.output.report.blocks import Bullets, Code, Paragraph, Picture, Table
from seip_addon.core.output.report.evidence import load_evidence
from seip_addon.core.output.report.html import as_html
from seip_addon.core.output.report.losses import front
from seip_addon.core.output.report.sections import certificate_sentence, make_report
from seip_addon.core.output.report.write import write_report
from seip_addon.core.output.results.file_names import REPORT_FILES
from seip_addon.core.output.results.placement_record import RecordedGreedy
from seip_addon.core.progress import finish
from tests.builders.report_folder import NAME, make_folder

EFFORT = 0.2
GOAL = 0.6  # coverage that takes several sensors
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
    first = [(folder / name).read_bytes() for name in REPORT_FILES]
    finish(write_report(folder, EFFORT))
    assert [(folder / name).read_bytes() for name in REPORT_FILES] == first
    make_folder(tmp_path / "elsewhere")
    finish(write_report(tmp_path / "elsewhere", EFFORT))
    assert [(tmp_path / "elsewhere" / name).read_bytes() for name in REPORT_FILES] == first


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
            f"{sensor.map_m[0] - 4_500_000.0:.3f}",
            f"{sensor.map_m[1] + 5_300_000.0:.3f}",
        ):
            assert words in page.text


def test_places_and_blind_spots_are_named(page):
    assert "High Street" in page.text
    assert "of road is not seen" in page.text
    assert "High Street, 48 m east of the centre of central box" in page.text
    assert "counted from the centre of the weighted region “central box”; north is the direction of" in page.text
    assert "middle" not in page.text.split("Blind spots")[1].split("Optimality")[0]
    assert not re.search("Road (north|east|south|west) of", page.text)


def test_figures_agree_with_the_grid(folder):
    evidence = load_evidence(folder)
    assert evidence.seen.mean() == pytest.approx(evidence.record.coverage.whole)
    points = finish(front(evidence, EFFORT))
    assert [point.count for point in points] == [1, 2, 3, 4, 5]
    assert all(np.diff([point.coverage for point in points]) >= 0)
    assert points[2].coverage == pytest.approx(
        evidence.record.coverage.whole, abs=1e-8
    )  # of which the record has 9 digits
    assert points[2].missed == 0


@pytest.mark.parametrize(
    ("goal", "found", "says"),
    [
        (
            Objective(count=3),
            {},
            (
                r"No other choice of at most 3 sensors among the 32 positions, under the same rules, covers more of "
                r"the road: this is proven\."
            ),
        ),
        (
            Objective(count=3),
            {"status": "feasible", "objective": 500.0, "bound": 509.4, "gap": 0.0188},
            r"covers more than 1\.4 percentage points more of the road: this bound is proven",
        ),
        (
            Objective(coverage=0.5),
            {"objective": 30_000.0, "bound": 24_000.0, "gap": 0.2, "status": "feasible"},
            r"is more than \$6,000 cheaper: this bound is proven",
        ),
        (
            Objective(count=5, budget=60_000.0),
            {},
            (
                r"No other choice of at most 5 sensors for at most \$60,000 among the 32 positions, under the same "
                r"rules, covers more of the road: this is proven\."
            ),
        ),
        (
            Objective(budget=60_000.0),
            {},
            r"No other choice for at most \$60,000 among the 32 positions, under the same rules, covers more",
        ),
        (Objective(coverage=0.5), {}, r"reaches the required coverage at a lower price: this is proven\."),
        (Objective(count=3), {"status": "feasible", "bound": np.inf, "gap": np.inf}, "how much better is not known"),
        (Objective(count=3), {"status": MOVED, "bound": np.nan, "gap": np.inf}, "without proof of optimality"),
        (
            Objective(count=3),
            {
                "notes": ("chosen for the worst failure",),
                "objective": 500.0,
                "bound": 750.0,
                "gap": 0.5,
                "status": "feasible",
            },
            r"Within 50\.00% of the best",
        ),
    ],
)
def test_the_certificate_is_a_sentence_for_engineers(tmp_path, goal, found, says):
    make_folder(tmp_path, goal=goal, **found)
    assert re.search(says, certificate_sentence(load_evidence(tmp_path)))


@pytest.mark.parametrize(("status", "room"), [("optimal", 0.0), ("feasible", 30.0)])
def test_the_front_has_the_bound_of_the_certificate_and_bounds_do_not_cross(tmp_path, status, room):
    example = make_folder(tmp_path)
    best = finish(solve(example_problem(tmp_path)))
    covered = best.objective
    make_folder(tmp_path, status=status, objective=covered, bound=covered + room, chosen=best.chosen)
    evidence = load_evidence(tmp_path)
    points = finish(front(evidence, 1e-6))  # searches end at once: only what is known can bound them
    assert example.visible.any()
    whole = len(evidence.site.targets)
    own = points[2]
    assert (own.count, own.coverage, own.missed) == (3, covered / whole, room / whole)
    bounds = [point.coverage + point.missed for point in points]
    assert bounds == sorted(bounds)
    assert [point.coverage for point in points] == sorted(point.coverage for point in points)
    more = certificate_sentence(evidence)
    assert ("this is proven" in more) == (own.missed == 0)
    report = as_html(make_report(evidence, points))
    stated = f"{math.ceil(1000 * room / whole - 1e-9) / 10:.1f} percentage points more"
    assert (stated in report) == (room > 0)
    assert report.count(stated) == (2 if room else 0)


def front_of(folder, **changes):
    """Return evidence and front where searches end at once, so that only what is known can bound them."""
    make_folder(folder, **changes)
    evidence = load_evidence(folder)
    return evidence, {point.count: point for point in finish(front(evidence, 1e-6))}


@pytest.mark.parametrize("notes", [(), ("chosen for returns from road users: 240 returns from a car",)])
def test_the_table_of_numbers_says_where_the_placement_was_chosen_for_something_else(tmp_path, notes):
    evidence, points = front_of(tmp_path, notes=notes)
    report = as_html(make_report(evidence, list(points.values())))
    told = "This placement was chosen for returns from road users, not for coverage: the table does not rank it."
    assert (told in report) == bool(notes)


def test_the_question_names_a_budget_as_a_price(tmp_path):
    make_folder(tmp_path, goal=Objective(budget=60_000.0))
    text = as_html(make_report(load_evidence(tmp_path), ()))
    assert "Find the positions of sensors that see most of the road, for at most $60,000." in text


def test_the_area_of_the_squares_is_not_said_to_be_that_of_the_region(folder):
    evidence = load_evidence(folder)
    squares = len(evidence.site.targets)
    assert (
        f"The region of interest is evaluated in {squares:,} squares of 2 m, {4 * squares:,} m² of road together."
        in as_html(make_report(evidence, ()))
    )


def test_greedy_loses_returns_where_these_were_sought(folder):
    evidence = load_evidence(folder)
    returns = ReturnsSummary(40.0, {"car": 80.0, "cyclist": 30.0, "pedestrian": 20.0}, ())
    for found, lost, words in (
        (None, 0.0313, "gives 3.13% less."),
        (None, 0.0, "gives no less."),
        (returns, 0.0313, "gives 3.13% fewer returns."),
        (returns, 0.0, "gives no fewer returns."),
    ):
        greedy = RecordedGreedy(1.0, None, lost, (), ())
        record = replace(evidence.record, returns=found, greedy=greedy)
        assert words in as_html(make_report(replace(evidence, record=record), ()))


def test_a_budget_that_any_choice_meets_does_not_loosen_the_bound(tmp_path):
    """The same placement is proven the best of three sensors for $240,000, which buys any three of them."""
    best = finish(solve(replace(example_problem_of(tmp_path), count=3)))
    prices = example_problem(tmp_path).prices
    found = {"objective": best.covered, "bound": best.covered, "chosen": best.chosen}
    _, enough = front_of(tmp_path, goal=Objective(budget=3 * float(prices.max())), **found)
    assert enough[3].missed == 0
    _, both = front_of(tmp_path, goal=Objective(count=3, budget=3 * float(prices.max())), **found)
    assert both[3].missed == 0
    evidence, short = front_of(tmp_path, goal=Objective(count=3, budget=best.price), **found)
    if best.price < 3 * float(prices.max()):  # other choices of three cost more, and may cover more
        assert short[3].missed > 0
    text = as_html(make_report(evidence, tuple(short.values())))
    assert f"The budget of ${best.price:,.0f} does not limit the choices of this table." in text
    assert f"at most 3 sensors for at most ${best.price:,.0f}" in text


def example_problem_of(folder):
    make_folder(folder)
    return example_problem(folder)


def equally_priced(folder, goal, notes=()):
    """Return evidence of the cheapest placement for a coverage where all sensors cost $10,000, and the placement."""
    problem = example_problem_of(folder)
    problem = replace(problem, prices=np.full(len(problem.prices), 10_000.0))
    best = finish(cheapest_for_coverage(problem, goal, SolverLimits(effort=1000.0)))
    assert best.status == "optimal"
    make_folder(folder, goal=Objective(coverage=goal), notes=notes, chosen=best.chosen)
    evidence = load_evidence(folder)
    site = replace(evidence.site, problem=replace(evidence.site.problem, prices=problem.prices))
    objective = replace(evidence.record.objective, value=best.price, bound=best.price, gap=0.0)
    return replace(evidence, site=site, record=replace(evidence.record, objective=objective)), best


def test_the_cheapest_placement_has_one_bound_on_its_coverage(tmp_path):
    evidence, best = equally_priced(tmp_path, GOAL)
    points = {point.count: point for point in finish(front(evidence, 1e-6))}
    count, whole = len(best.chosen), len(evidence.site.targets)
    assert count > 1
    assert (points[count].missed, points[count].coverage) == (0, best.covered / whole)
    for fewer in range(1, count):  # what costs less does not reach the coverage
        assert points[fewer].coverage + points[fewer].missed <= GOAL + 1e-9
    text = as_html(make_report(evidence, tuple(points.values())))
    assert "reaches the required coverage at a lower price: this is proven." in text
    assert f"No other choice of {count} sensors, at the same price, covers more: this is proven." in text
    assert "equally cheap" not in text


def test_a_note_on_equally_cheap_placements_gives_way_to_what_the_table_proves(tmp_path):
    note = f"{SAME_PRICE}another one may cover up to 9.9 percentage points more"
    evidence, best = equally_priced(tmp_path, GOAL, notes=(note,))
    points = finish(front(evidence, EFFORT * 50))
    own = points[len(best.chosen) - 1]
    assert own.missed == 0
    text = as_html(make_report(evidence, points))
    assert "equally cheap" not in text
    assert f"No other choice of {own.count} sensors, at the same price, covers more: this is proven." in text
    better = replace(own, coverage=own.coverage + 0.05)
    text = as_html(make_report(evidence, (*points[: own.count - 1], better, *points[own.count :])))
    assert f"Another choice of {own.count} sensors, at the same price, covers 5.0 percentage points more" in text
    assert "up to 9.9 percentage points more" in as_html(make_report(evidence, ()))  # without the table


def example_problem(folder):
    evidence = load_evidence(folder)
    return evidence.site.with_visibility(evidence.grid)


def test_without_a_projection_there_are_no_latitudes(tmp_path):
    make_folder(tmp_path, place=GeoReference())
    evidence = load_evidence(tmp_path)
    text = as_html(make_report(evidence, ()))
    assert "no latitudes and longitudes" in text
    assert "Latitude, °" not in text
    assert "Map x, m" in text
    assert "Easting" not in text


def test_positions_are_coordinates_of_the_projection_that_the_report_names(folder):
    record = load_evidence(folder).record
    mercator = GeoReference("EPSG:32632").mercator
    sensors, spots = (one for one in blocks(folder, Table) if "Easting, m" in one.head)
    for row in sensors.rows + spots.rows:
        cells = dict(zip((sensors if row in sensors.rows else spots).head, row, strict=True))
        latitude, longitude = (math.radians(float(cells[name])) for name in ("Latitude, °", "Longitude, °"))
        metres = [float(cells[name]) for name in ("Easting, m", "Northing, m")]
        assert mercator(latitude, longitude) == pytest.approx(metres, abs=0.2)
    x, y = (record.site.origin_m[0] - 4_500_000.0, record.site.origin_m[1] + 5_300_000.0)
    assert f"easting {x:,.2f} m, northing {y:,.2f} m" in as_html(make_report(load_evidence(folder), ()))


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
    assert any("was not requested" in one.text for one in blocks(folder, Paragraph))


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
    with pytest.raises(SeipError, match=r"site\.npz is damaged or not a table .*; place the sensors again"):
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
