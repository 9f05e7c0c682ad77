"""The page on the paper's case, from figures that are told and not measured."""

import re
from dataclasses import dataclass
from itertools import product
from pathlib import Path

from headless.studies.claims import FAILS, HOLDS, UNDECIDED, Claim
from headless.studies.coverage.cells import CHARTED_WEIGHT, COUNTS, Case, CoverageStudy, EmptyCell
from headless.studies.paper.page import PUBLISHED_CLAIMS, PlacementFigures, page

import pytest

pytest.importorskip("torch", reason="torch is not installed: make detection")
from headless.studies.paper import command as paper_case

from matplotlib.image import imread

from seip_addon.core.base.errors import SeipError
from tests.sumo_here import needs_sumo

TYPES, HEIGHTS, TARGETS = ("type1", "type2", "type3"), (3.5, 5.4, 8.0), 1000
FACTS = {"scene": "the map", "criterion": "δ = 1 m", "traffic": "only SUMO", "training": "60 steps"}


@dataclass(frozen=True)
class Answer:
    objective: float
    bound: float


@dataclass(frozen=True)
class View:
    coverage: float
    central: float


def study():
    def cell(sensor, height, count, weight):
        if (sensor, height) == ("type3", 3.5):
            return EmptyCell(sensor, height, count, weight, "no room")
        share = 0.1 * (1 + TYPES.index(sensor)) + 0.1 * COUNTS.index(count) + (0.0 if height is None else -0.01)
        high = share + 0.05 if height == 8.0 else share
        return Case(
            sensor, height, count, weight, Answer(share * TARGETS, high * TARGETS), None, View(share, share + 0.2)
        )

    keys = [*product(TYPES, (*HEIGHTS, None), COUNTS, [1.0]), *product(TYPES, [None], COUNTS, [CHARTED_WEIGHT])]
    return CoverageStudy(TYPES, HEIGHTS, tuple(cell(*key) for key in keys), TARGETS)


PLACEMENTS = (
    PlacementFigures("1 × type1", "type1", 1, 0.20, 0.60, None, 0.25),
    PlacementFigures("2 × type1", "type1", 2, 0.30, 0.80, (0.77, 0.82), 0.25),
    PlacementFigures("4 × type1", "type1", 4, 0.50, 0.70, None, 0.25),
)


CLAIMS = (
    Claim(1, "a", FAILS, "17.4% | 30.7%"),
    Claim(3, "b", HOLDS, "3.5 m"),
    Claim(5, "c", UNDECIDED, "+9.0 points"),
)


def made():
    return page("seip study paper Town.xodr", FACTS, study(), CLAIMS, PLACEMENTS, "pictures/a.png")


def rows(text, first):
    return [
        [cell.strip() for cell in line.replace("\\|", "/").strip("|").split("|")]
        for line in text.splitlines()
        if line.startswith(f"| {first} |")
    ]


def test_every_claim_of_the_paper_has_a_row_with_ours():
    text = made()
    table = text[text.index("## Claims") : text.index("## Figures")]
    for one in PUBLISHED_CLAIMS:
        (row,) = rows(table, one.number)
        assert row[1:3] == [one.where, one.says]
    assert rows(table, 1)[0][3:] == ["17.4% / 30.7%", "**does not hold**"]
    assert rows(table, 9)[0][3:] == ["not measured", "–"]
    assert [one.number for one in PUBLISHED_CLAIMS] == list(range(1, 11))


def test_figures_stand_beside_those_of_the_paper():
    text = made()
    assert ["type1", "any", "10.0%", "20.0%", "30.0%"] in rows(text, "type1")
    assert ["type2", "8 m", "19.0% (to 24.0%)", "29.0% (to 34.0%)", "39.0% (to 44.0%)"] in rows(text, "type2")
    assert ["type3", "3.5 m", *["no placement"] * 3] in rows(text, "type3")
    assert ["type1", "50.0%", "50.0%", "30.0%", "30.0%"] in rows(text, "type1")
    (second,), (third,) = (rows(text, f"{count} × type1") for count in (2, 4))
    assert second == ["2 × type1", "30.0%", "80.0% (77.0% to 82.0%)", "+ about 20 %", "+20.0 points", "0.25"]
    assert third[3:5] == ["+ 7 %", "-10.0 points"]
    assert (
        "| Traffic | SUMO and CARLA together; length, runs and split into training and test are not given | only"
        in text
    )


MAP = Path(__file__).resolve().parents[3] / "scenes" / "junction.xodr"


@pytest.fixture
def run(tmp_path):
    def run(*options, junction="100", source=MAP):
        folders = ["--work", str(tmp_path / "work"), "-o", str(tmp_path / "docs")]
        paper_case.main([str(source), "--junction", junction, *folders, *options])

    return run


@needs_sumo
@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"junction": "965"}, r"no junction '965' in map"),
        ({"source": MAP.with_name("none.xodr")}, r"there is no file .*none.xodr: check its path"),
    ],
)
def test_files_that_do_not_fit_are_one_sentence(run, tmp_path, changes, message):
    with pytest.raises(SeipError, match=message):
        run(**changes)
    assert not (tmp_path / "docs" / "paper.md").exists()
    assert not list(tmp_path.glob("work/*traffic*/*"))


@needs_sumo
@pytest.mark.slow
def test_the_page_is_written_with_its_charts(run, tmp_path, capsys):
    brief = ["--runs", "4", "--duration", "12", "--every", "9", "--steps", "1", "--trainings", "1"]
    few = ["--approaches", "20", "--effort", "2"]
    run(*brief, *few)
    text = (tmp_path / "docs" / "paper.md").read_text(encoding="utf-8")
    assert "--steps 1 --trainings 1 --every 9" in text
    assert str(tmp_path) not in text
    assert "validation AP was still rising" in text
    pictures = re.findall(r"!\[.*?\]\((.*?)\)", text)
    assert len(pictures) == 1
    assert all(imread(tmp_path / "docs" / picture).shape[1] > 600 for picture in pictures)
    said = capsys.readouterr().out
    assert "claim 8 (" in said
    assert "undecided" in text
