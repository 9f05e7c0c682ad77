"""What the charts of average precision show, read back from what was drawn."""

import math

from headless.studies import precision_charts
from headless.studies.precision_charts import (
    DetectorSetting,
    PrecisionCell,
    save_count_chart,
    save_coverage_chart,
    save_price_chart,
    save_setting_chart,
)

import numpy as np
import pytest

from seip_addon.core.errors import SeipError
from seip_addon.core.output.pictures import chart_style as style
from tests.builders.charts import is_drawn, legend, line, record_figures, words

CELLS = (
    PrecisionCell("type1", 1, 6_000, 0.2, (0.55, 0.57, 0.59), (0.52, 0.62)),
    PrecisionCell("type1", 2, 12_000, 0.3, (0.70, 0.72, 0.74), (0.67, 0.77)),
    PrecisionCell("type2", 1, 15_000, 0.4, (0.65, 0.66, 0.67), None),
    PrecisionCell("type2", 2, 30_000, 0.6, (0.80, 0.80, 0.80), (0.80, 0.80)),
)


@pytest.fixture
def figures(monkeypatch):
    """The figures that were saved."""
    return record_figures(monkeypatch, precision_charts, style)


def test_count_chart(tmp_path, figures):
    save_count_chart(tmp_path / "count.png", CELLS, "Junction")
    assert is_drawn(tmp_path / "count.png")
    (panel,) = figures[0].axes
    for sensor, means in (("type1", [0.57, 0.72]), ("type2", [0.66, 0.80])):
        assert line(panel, sensor).get_ydata() == pytest.approx(means)
        assert np.round(line(panel, sensor).get_xdata()).tolist() == [0, 1]
    assert [tick.get_text() for tick in panel.get_xticklabels()] == ["1", "2"]
    drawn = [tuple(one.get_ydata()) for one in panel.get_lines()]
    assert (0.52, 0.62) in drawn
    assert (0.70, 0.72, 0.74) in drawn
    assert legend(figures[0]) == ["type1", "type2"]
    low, high = panel.get_ylim()
    assert low < 0.52
    assert high >= 1


def test_price_chart_names_the_front(tmp_path, figures):
    save_price_chart(tmp_path / "price.png", CELLS, "Junction")
    assert is_drawn(tmp_path / "price.png")
    (panel,) = figures[0].axes
    front = line(panel, "front: nothing cheaper detects as well")
    assert front.get_xdata().tolist() == [6_000, 12_000, 30_000]
    assert front.get_ydata() == pytest.approx([0.57, 0.72, 0.80])
    weights = {text.get_text(): text.get_weight() for text in panel.texts}
    assert weights == {"1 × type1": "bold", "2 × type1": "bold", "1 × type2": "normal", "2 × type2": "bold"}
    boxes = [text.get_window_extent() for text in panel.texts]
    assert not any(a.overlaps(b) for row, a in enumerate(boxes) for b in boxes[:row])


def test_coverage_chart_tells_the_correlation(tmp_path, figures):
    save_coverage_chart(tmp_path / "coverage.png", CELLS, 0.8, (0.31, 0.95), "Junction")
    assert is_drawn(tmp_path / "coverage.png")
    (panel,) = figures[0].axes
    assert panel.get_title() == "rank correlation ρ = 0.80 (0.31 to 0.95)"
    assert line(panel, "type2").get_xdata() == pytest.approx([0.4, 0.6])
    assert line(panel, "type2").get_ydata() == pytest.approx([0.66, 0.80])
    save_coverage_chart(tmp_path / "coverage.png", CELLS[:2], 1.0, None, "Junction")
    assert figures[1].axes[0].get_title() == "rank correlation ρ = 1.00"


def test_setting_chart_marks_the_default(tmp_path, figures):
    settings = [
        DetectorSetting("centre head", "head", 300, 90, 0.82, (0.80, 0.84), default=True),
        DetectorSetting("anchor head", "head", 400, 120, 0.79),
        DetectorSetting("pillars 0.24 m", "pillars", 700, 200, 0.84),
    ]
    save_setting_chart(tmp_path / "settings.png", settings, "Junction")
    assert is_drawn(tmp_path / "settings.png")
    training, inference = figures[0].axes
    assert line(training, "default").get_xydata().tolist() == [[300, 0.82]]
    assert line(inference, "default").get_xydata().tolist() == [[90, 0.82]]
    assert line(training, "head").get_xydata().tolist() == [[300, 0.82], [400, 0.79]]
    assert line(inference, "pillars").get_xydata().tolist() == [[200, 0.84]]
    assert words(figures[0]) == [setting.name for setting in settings] * 2


def test_the_same_chart_has_the_same_bytes(tmp_path):
    for name in ("a.png", "b.png"):
        save_price_chart(tmp_path / name, CELLS, "Junction")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_names_are_not_read_as_formulas(tmp_path):
    cells = [PrecisionCell("$a_b$ \\x", 1, 5000, 0.5, (0.5,)), PrecisionCell("type1", 1, 9000, 0.6, (0.6,))]
    save_count_chart(tmp_path / "count.png", cells, "$x$ _")
    save_price_chart(tmp_path / "price.png", cells, "$x$ _")
    assert is_drawn(tmp_path / "price.png")


@pytest.mark.parametrize(
    "draw",
    [
        lambda path: save_count_chart(path, [], "Junction"),
        lambda path: save_price_chart(path, [], "Junction"),
        lambda path: save_coverage_chart(path, [], math.nan, None, "Junction"),
        lambda path: save_setting_chart(path, [], "Junction"),
    ],
)
def test_nothing_to_draw_is_an_error(tmp_path, draw):
    with pytest.raises(SeipError, match="there are no data for a chart"):
        draw(tmp_path / "chart.png")
    assert not (tmp_path / "chart.png").exists()
