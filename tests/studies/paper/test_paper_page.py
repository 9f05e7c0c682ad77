"""The page on the paper's case, from figures that are told and not measured."""

from dataclasses import dataclass
from itertools import product

from headless.studies.claims import FAILS, HOLDS, UNDECIDED, Claim
from headless.studies.coverage.cells import CHARTED_WEIGHT, COUNTS, Case, CoverageStudy, EmptyCell
from headless.studies.paper.figures import PlacementFigures, reversals
from headless.studies.paper.page import CaseFacts, page
from headless.studies.paper.published import PUBLISHED_CLAIMS

import numpy as np

from seip_addon.core.sensing.lidar.catalogue import load_catalogue

TYPES, HEIGHTS, TARGETS = ("type1", "type2", "type3"), (3.5, 5.4, 8.0), 1000
FACTS = CaseFacts(
    command="seip study paper Town.xodr --junction 7 -o docs",
    scene="the map alone",
    criterion="δ = 1 m",
    traffic="SUMO alone",
    training="60 steps",
    trainings=1,
    bare=True,
    most_overlap=0.16,
    overlaps=(0.02, 0.08, 0.15),
    copied=(0.5, 0.6, 0.7),
    doubts=("One training.",),
)


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


def placement(sensor, count, coverage, precision, returns=0.5, enough=0.85, runs=None, copies=0.9, unfamiliar=0.7):
    without = None if runs is None else np.array(runs)
    interval = (precision - 0.03, precision + 0.02)
    name, false_positives = f"{count} × {sensor}", 0.25
    return PlacementFigures(
        name,
        sensor,
        count,
        coverage,
        enough,
        returns,
        precision,
        interval,
        without,
        false_positives,
        copies,
        unfamiliar,
    )


SPREAD = np.array([0.01, -0.01, 0.01, -0.01])
PLACEMENTS = (
    placement("type1", 1, 0.20, 0.60, 30, 0.85, 0.60 + 0.01 * SPREAD),
    placement("type1", 2, 0.30, 0.80, 60, 0.95, 0.80 + 0.01 * SPREAD, 0.98, 0.90),
    placement("type1", 4, 0.50, 0.70, 70, 0.94, 0.70 - 0.01 * SPREAD),
    placement("type2", 1, 0.504, 0.65, 40, 0.96, 0.65 + 8 * SPREAD),
)


def test_reversals_are_the_pairs_in_which_less_coverage_detects_more():
    found = reversals(PLACEMENTS)
    expected = [
        (better.name, worse.name)
        for better in PLACEMENTS
        for worse in PLACEMENTS
        if worse.coverage - better.coverage > 0.005 and better.precision - worse.precision > 0
    ]
    assert {(one.better.name, one.worse.name) for one in found} == set(expected)
    assert [round(one.gain, 2) for one in found] == [0.15, 0.1]
    assert [(one.stands, one.more_returns) for one in found] == [(False, False), (True, True)]


CLAIMS = (
    Claim(1, "a", FAILS, "17.4% | 30.7%"),
    Claim(3, "b", HOLDS, "3.5 m"),
    Claim(5, "c", UNDECIDED, "+9.0 points"),
)


def made(**changes):
    facts = CaseFacts(**{**vars(FACTS), **changes})
    return page(facts, study(), CLAIMS, PLACEMENTS, load_catalogue(), [("pictures/a.png", "A chart")])


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
    assert rows(table, 9)[0][4] == "**–**"
    assert [one.number for one in PUBLISHED_CLAIMS] == list(range(1, 11))


def test_figures_stand_beside_those_of_the_paper():
    text = made()
    assert ["type1", "any", "10.0%", "20.0%", "30.0%"] in rows(text, "type1")
    assert ["type2", "8 m", "19.0% (to 24.0%)", "29.0% (to 34.0%)", "39.0% (to 44.0%)"] in rows(text, "type2")
    assert ["type3", "3.5 m", *["no placement"] * 3] in rows(text, "type3")
    assert ["type1", "50.0%", "50.0%", "30.0%", "30.0%"] in rows(text, "type1")
    (second,) = rows(text[: text.index("## Leak")], "2 × type1")
    assert second[:5] == ["2 × type1", "30.0%", "80.0% (77.0% to 82.0%)", "+ about 20 %", "+20.0 points"]
    assert second[5:] == ["60, 95.0%", "0.25", "98.0%", "90.0%"]
    (third,) = rows(text[: text.index("## Leak")], "4 × type1")
    assert third[3:5] == ["+ 7 %", "-10.0 points"]
