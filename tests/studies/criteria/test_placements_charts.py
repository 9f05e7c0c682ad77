"""What the charts of placements show, read back from what was drawn."""

import math

from headless.studies.criteria.charts import CriterionBar, PlacementMark, save_criteria_chart, save_placements_chart

import pytest

from seip_addon.core.errors import SeipError
from seip_addon.core.estimates import IntervalEstimate
from seip_addon.core.output.pictures import chart_style as style

MARKS = (
    PlacementMark("optimal", 0.8, 0.75, (0.7, 0.8)),
    PlacementMark("random", 0.5, 0.45, (0.4, 0.5)),
    PlacementMark("random", 0.6, 0.55),
)
BARS = (
    CriterionBar("coverage", IntervalEstimate(0.9, 0.8, 0.95)),
    CriterionBar("hindsight", IntervalEstimate(0.95, -math.inf, math.inf), beforehand=False),
)


@pytest.fixture
def figures(monkeypatch):
    """The figures that were saved."""
    saved = []
    monkeypatch.setattr(style, "save_png", lambda path, figure: saved.append(figure))
    return saved


def test_each_placement_is_at_its_coverage_and_precision(figures, tmp_path):
    save_placements_chart(tmp_path / "chart.png", MARKS, "ρ = 0.9", "Site")
    (panel,) = figures[0].axes
    drawn = {line.get_label(): line.get_xydata().tolist() for line in panel.get_lines()}
    assert drawn["random"] == [[0.5, 0.45], [0.6, 0.55]]
    assert panel.get_lines()[-1].get_xydata().tolist() == [[0.8, 0.75]]  # ringed
    assert [[0.5, 0.4], [0.5, 0.5]] in [line.get_xydata().tolist() for line in panel.get_lines()]
    assert panel.get_title() == "ρ = 0.9"


def test_bars_are_as_long_as_correlations_and_the_ceiling_stands_at_its_own(figures, tmp_path):
    save_criteria_chart(tmp_path / "chart.png", BARS, IntervalEstimate(0.97, 0.93, 0.99), "Site")
    (panel,) = figures[0].axes
    assert [bar.get_width() for bar in panel.patches[:2]] == [0.9, 0.95]
    assert [tick.get_text() for tick in panel.get_yticklabels()] == ["coverage", "hindsight"]
    (ceiling,) = [line for line in panel.get_lines() if str(line.get_label()).startswith("noise ceiling")]
    assert set(ceiling.get_xdata()) == {0.97}
    assert [[0.8, 0.0], [0.95, 0.0]] in [line.get_xydata().tolist() for line in panel.get_lines()]


def test_without_placements_there_is_a_sentence(tmp_path):
    with pytest.raises(SeipError, match="evaluate some first"):
        save_placements_chart(tmp_path / "chart.png", (), "", "Site")
    with pytest.raises(SeipError, match="evaluate some placements first"):
        save_criteria_chart(tmp_path / "chart.png", (), IntervalEstimate(1.0, 0.9, 1.0), "Site")
