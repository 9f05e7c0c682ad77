"""What the charts of detection show, read back from what was drawn."""

import math

from headless.charts import error_view
from headless.charts.detection import (
    Bin,
    save_parts_chart,
    save_precision_recall_chart,
)
from headless.charts.error_view import ErrorView, save_error_view

import numpy as np
import pytest
import shapely
from matplotlib.collections import PolyCollection

from seip_addon.core.output.pictures import drawing as style
from tests.builders.charts import is_drawn, legend, record_figures, words


@pytest.fixture
def figures(monkeypatch):
    """The figures that were saved."""
    return record_figures(monkeypatch, style)


def test_precision_recall_chart(tmp_path, figures):
    recall, precision = np.array([0.2, 0.5, 0.7]), np.array([1.0, 0.9, 0.6])
    save_precision_recall_chart(tmp_path / "pr.png", recall, precision, "1 × type1: AP 0.63", "Junction")
    assert is_drawn(tmp_path / "pr.png")
    (panel,) = figures[0].axes
    assert legend(figures[0]) == ["1 × type1: AP 0.63"]
    (drawn,) = panel.get_lines()
    assert np.array_equal(drawn.get_xydata(), np.column_stack([recall, precision]))


def test_parts_chart(tmp_path, figures):
    by_distance = [Bin(0, 10, 10, 0.9), Bin(10, 50, 40, 0.5), Bin(50, math.inf, 0, math.nan)]
    by_returns = [Bin(0, 1, 8, 0.25), Bin(1, 5, 8, 0.5)]
    panels = [("distance (m)", "AP", by_distance), ("returns", "recall", by_returns)]
    save_parts_chart(tmp_path / "parts.png", panels, "Junction")
    assert is_drawn(tmp_path / "parts.png")
    first, second = figures[0].axes
    assert [tick.get_text() for tick in first.get_xticklabels()] == ["0–10", "10–50", "50 +"]
    assert first.get_lines()[0].get_ydata()[:2].tolist() == [0.9, 0.5]
    heights = [bar.get_height() for bar in first.patches]
    assert heights == pytest.approx([0.125, 0.5, 0])
    assert words(figures[0]) == ["10", "40", "0", "8", "8"]
    assert second.get_lines()[0].get_ydata().tolist() == [0.25, 0.5]


def errors(**changed):
    told = {
        "name": "1 × type1",
        "cloud": np.random.default_rng(1).uniform(-40, 40, (5000, 2)).astype(np.float32),
        "region": shapely.union(shapely.box(-40, -10, 40, 10), shapely.box(-10, -40, 10, 40)),
        "sensors": np.array([[12.0, 12.0]]),
        "truth": np.array([[0, 0, 4.5, 1.8, 0], [20, 5, 4.5, 1.8, np.pi / 2], [30, 0, 0.6, 0.6, 0]]),
        "wanted": np.array([True, True, False]),
        "missed": np.array([False, True, False]),
        "detected": np.array([[0.2, 0, 4.5, 1.8, 0], [-30, 3, 4.5, 1.8, 1.0], [-20, 3, 4.5, 1.8, 1.0]]),
        "false": np.array([False, True, True]),
    }
    return ErrorView(**told | changed)


def middles(panel, colour, zorder):
    collections = [
        drawn
        for drawn in panel.collections
        if isinstance(drawn, PolyCollection)
        and drawn.get_zorder() == zorder
        and len(drawn.get_edgecolor())
        and np.allclose(drawn.get_edgecolor()[0], matplotlib_colour(colour))
    ]
    return [path.vertices[:-1].mean(axis=0) for drawn in collections[:1] for path in drawn.get_paths()]


def matplotlib_colour(colour):
    return [*(int(colour[place : place + 2], 16) / 255 for place in (1, 3, 5)), 1.0]


def test_error_view(tmp_path, figures):
    save_error_view(tmp_path / "errors.png", [errors(), errors(name="2 × type1")], "Junction")
    assert is_drawn(tmp_path / "errors.png")
    panel = figures[0].axes[0]
    assert panel.get_title(loc="left") == "1 × type1"
    assert panel.get_title(loc="right") == "1 missed of 2, 2 false"
    assert middles(panel, error_view.TRUTH_COLOUR, error_view.TRUTH) == [pytest.approx([0, 0]), pytest.approx([20, 5])]
    assert middles(panel, error_view.IGNORED_COLOUR, error_view.IGNORED) == [pytest.approx([30, 0])]
    assert len(middles(panel, error_view.DETECTED_COLOUR, error_view.DETECTION)) == 3
    (missed,) = middles(panel, error_view.TRUTH_COLOUR, error_view.ERROR)
    assert missed == pytest.approx([20, 5], abs=0.2)
    assert len(middles(panel, error_view.DETECTED_COLOUR, error_view.ERROR)) == 2
