"""What goes into the charts, from what was measured."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from tests.builders.labelled_frames import box, detected, frame, truth

pytest.importorskip("torch", reason="the detector's torch is optional")

from headless.charts.detection import save_parts_chart
from headless.detection.average_precision import evaluate
from headless.detection.breakdown import average_precision_by
from headless.detection.matching import Rule
from headless.detection_results import curve, error_view
from headless.studies.detection.claims import SeedResult
from headless.studies.detection.results import cells
from headless.studies.false_positives import false_by

from seip_addon.core.output.pictures import chart_style
from tests.builders.charts import line, record_figures, words

RULE = Rule()
TOLD = frame(
    truth([box(0), box(20), box(40)], distance=[5, 15, 25], inside=[True, True, False]),
    detected([box(0), box(20), box(90), box(-90)], [0.9, 0.3, 0.6, 0.7], inside=[True, True, True, False]),
)


def test_cells_gather_seeds():
    one = SeedResult("type1", 2, 0, 0.6, 12_000, 0.5, 1.0, 0.5)
    trials = [one, replace(one, seed=1, average_precision=0.7), replace(one, sensor="type2", average_precision=0.8)]
    first, second = cells(trials)
    assert (first.name, first.price, first.coverage, first.values) == ("2 × type1", 12_000, 0.5, (0.6, 0.7))
    low, high = first.interval
    assert (low, high) == pytest.approx((0.65 - 12.7062 * 0.05, 1.0), abs=1e-5)  # no average precision is above 1
    assert second.values == (0.8,)
    assert second.interval is None
    assert cells([]) == ()


def test_curve_is_that_of_the_evaluation():
    evaluation = evaluate([TOLD], RULE)
    drawn = curve("type1", 2, evaluation)
    assert drawn.recall.tolist() == [0.5, 0.5, 1]
    assert drawn.precision.tolist() == pytest.approx([1, 1 / 2, 2 / 3])
    assert drawn.average_precision == evaluation.average_precision


def test_parts_have_the_edges_of_the_bins(tmp_path, monkeypatch):
    evaluation = evaluate([TOLD], RULE)
    edges = (0, 10, math.inf)
    panels = [
        ("distance (m)", "AP", {"2 × type1": average_precision_by(evaluation, "distance", edges)}),
        ("density", "false", {"2 × type1": false_by(evaluation, "density", edges, 0.1)}),
    ]
    figures = record_figures(monkeypatch, chart_style)
    save_parts_chart(tmp_path / "parts.png", panels, "Junction")
    precision, false = figures[0].axes
    assert [tick.get_text() for tick in precision.get_xticklabels()] == ["0–10", "10 +"]
    assert line(precision, "2 × type1").get_ydata().tolist() == [1.0, 0.5]
    assert words(figures[0]) == ["1", "1"]
    assert len(precision.patches) == 2
    assert not false.patches


def test_error_view_shows_what_reaches_the_score():
    place = {"cloud": np.zeros((4, 3), np.float32), "region": shapely.box(0, 0, 1, 1), "sensors": np.ones((1, 3))}
    view = error_view("a", TOLD, RULE, score=0.5, **place)
    assert view.wanted.tolist() == [True, True, False]
    assert view.missed.tolist() == [False, True, False]
    assert view.false.tolist() == [False, True, False]  # outside the region nothing is false
    assert view.truth[0].tolist() == [0, 0, 4.5, 1.8, 0]
    assert error_view("a", TOLD, RULE, score=0.1, **place).missed.tolist() == [False, False, False]
