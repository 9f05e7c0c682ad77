"""What the charts of detection show, read back from what was drawn."""

import math

from headless.charts import detection as detection_charts
from headless.charts import error_view, style
from headless.charts.detection import (
    BinnedFigure,
    DetectorSetting,
    PrecisionCell,
    PrecisionRecallLine,
    save_count_chart,
    save_coverage_chart,
    save_parts_chart,
    save_precision_recall_chart,
    save_price_chart,
    save_setting_chart,
    save_training_chart,
)
from headless.charts.error_view import ErrorView, save_error_view

import numpy as np
import pytest
import shapely
from matplotlib.collections import PolyCollection
from PIL import Image

from seip_addon.core.errors import SeipError

CELLS = (
    PrecisionCell("type1", 1, 6_000, 0.2, (0.55, 0.57, 0.59), (0.52, 0.62)),
    PrecisionCell("type1", 2, 12_000, 0.3, (0.70, 0.72, 0.74), (0.67, 0.77)),
    PrecisionCell("type2", 1, 15_000, 0.4, (0.65, 0.66, 0.67), None),
    PrecisionCell("type2", 2, 30_000, 0.6, (0.80, 0.80, 0.80), (0.80, 0.80)),
)


@pytest.fixture
def figures(monkeypatch):
    """The figures that were saved, which go on to be saved."""
    saved = []
    save = detection_charts.save_png

    def keep(path, figure):
        saved.append(figure)
        save(path, figure)

    for module in (detection_charts, style):
        monkeypatch.setattr(module, "save_png", keep)
    return saved


def line(panel, label):
    return next(drawn for drawn in panel.get_lines() if drawn.get_label() == label)


def words(figure):
    return [text.get_text() for panel in figure.axes for text in panel.texts]


def legend(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def is_drawn(path):
    """A picture of some size with as much on it as a chart has."""
    picture = np.asarray(Image.open(path).convert("L"))
    return min(picture.shape) > 400 and 0.005 < (picture < 200).mean() < 0.5


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


def test_precision_recall_chart(tmp_path, figures):
    recall, precision = np.array([0.2, 0.5, 0.7]), np.array([1.0, 0.9, 0.6])
    curves = [
        PrecisionRecallLine(sensor, count, recall, precision, 0.63) for sensor in ("type1", "type2") for count in (1, 2)
    ]
    save_precision_recall_chart(tmp_path / "pr.png", curves, "Junction")
    assert is_drawn(tmp_path / "pr.png")
    (panel,) = figures[0].axes
    assert legend(figures[0])[0] == "1 × type1: AP 0.63"
    assert len({(one.get_color(), str(one._dash_pattern)) for one in panel.get_lines()}) == 4  # noqa: SLF001 - no getter
    for one in panel.get_lines():
        assert np.array_equal(one.get_xdata(), recall)
        assert np.array_equal(one.get_ydata(), precision)


def test_parts_chart(tmp_path, figures):
    by_distance = BinnedFigure(
        "distance (m)", "AP", (0, 10, 50, math.inf), {"1 × type1": (0.9, 0.5, math.nan)}, (10, 40, 0)
    )
    by_density = BinnedFigure("returns per m²", "false per frame", (0, 1, 5), {"1 × type1": (2.0, 0.5)})
    save_parts_chart(tmp_path / "parts.png", [by_distance, by_density], "Junction")
    assert is_drawn(tmp_path / "parts.png")
    first, second = figures[0].axes
    assert [tick.get_text() for tick in first.get_xticklabels()] == ["0–10", "10–50", "50 +"]
    assert line(first, "1 × type1").get_ydata()[:2].tolist() == [0.9, 0.5]
    heights = [bar.get_height() for bar in first.patches]
    assert heights == pytest.approx([0.125, 0.5, 0])
    assert words(figures[0]) == ["10", "40", "0"]
    assert line(second, "1 × type1").get_ydata().tolist() == [2.0, 0.5]
    assert second.get_ylim()[1] > 2


def test_training_chart_marks_the_best(tmp_path, figures):
    loss = [4.0 / step for step in range(1, 201)]
    save_training_chart(tmp_path / "training.png", loss, {50: 0.3, 100: 0.6, 150: 0.5}, "Seed 0")
    assert is_drawn(tmp_path / "training.png")
    panel, beside = figures[0].axes
    assert line(panel, "loss").get_ydata().tolist() == loss
    # Five at a time, fewer at the ends.
    assert line(panel, "smoothed").get_ydata()[[0, 100]] == pytest.approx([np.mean(loss[:3]), np.mean(loss[98:103])])
    assert line(beside, "validation AP").get_ydata().tolist() == [0.3, 0.6, 0.5]
    assert line(beside, "best: 0.60 after 100 steps").get_xdata().tolist() == [100]
    save_training_chart(tmp_path / "training.png", loss, {}, "Seed 0")
    assert len(figures[1].axes) == 1


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


@pytest.mark.parametrize("count", [1, 2, 3])
def test_the_legend_of_errors_is_whole(tmp_path, figures, count):
    save_error_view(tmp_path / "errors.png", [errors()] * count, "Junction")
    (legend,) = figures[0].legends
    extent = legend.get_window_extent()
    assert extent.x0 >= 0
    assert extent.x1 <= figures[0].bbox.width


def test_corners_of_a_turned_box():
    """4 × 2 m about (10, 0), a right angle to the left: the front left corner is at (9, 2)."""
    (turned,) = error_view.corners(np.array([[10, 0, 4, 2, np.pi / 2]]))
    assert turned == pytest.approx(np.array([[9, 2], [9, -2], [11, -2], [11, 2]]))


def test_error_view_of_an_empty_frame(tmp_path, figures):
    none = np.zeros((0, 5))
    nobody = np.zeros(0, dtype=bool)
    view = errors(cloud=np.zeros((0, 2)), truth=none, wanted=nobody, missed=nobody, detected=none, false=nobody)
    save_error_view(tmp_path / "errors.png", [view], "Junction")
    assert figures[0].axes[0].get_title(loc="right") == "0 missed of 0, 0 false"


def test_dense_clouds_are_thinned_evenly(tmp_path, figures):
    cloud = np.column_stack([np.arange(500_000) / 10_000, np.zeros(500_000)])
    save_error_view(tmp_path / "errors.png", [errors(cloud=cloud)], "Junction")
    drawn = figures[0].axes[0].get_lines()[0].get_xdata()
    assert error_view.MAX_POINTS / 2 < len(drawn) <= error_view.MAX_POINTS
    assert np.diff(drawn) == pytest.approx(drawn[1] - drawn[0])


def test_the_same_chart_has_the_same_bytes(tmp_path):
    for name in ("a.png", "b.png"):
        save_price_chart(tmp_path / name, CELLS, "Junction")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


@pytest.mark.parametrize(
    "draw",
    [
        lambda path: save_count_chart(path, [], "Junction"),
        lambda path: save_price_chart(path, [], "Junction"),
        lambda path: save_coverage_chart(path, [], math.nan, None, "Junction"),
        lambda path: save_precision_recall_chart(path, [], "Junction"),
        lambda path: save_parts_chart(path, [], "Junction"),
        lambda path: save_training_chart(path, [], {}, "Junction"),
        lambda path: save_setting_chart(path, [], "Junction"),
        lambda path: save_error_view(path, [], "Junction"),
    ],
)
def test_nothing_to_draw_is_said(tmp_path, draw):
    with pytest.raises(SeipError, match=r"there are no data for a chart|there are no frames to draw"):
        draw(tmp_path / "chart.png")
    assert not (tmp_path / "chart.png").exists()


def test_names_are_not_read_as_formulas(tmp_path):
    cells = [PrecisionCell("$a_b$ \\x", 1, 5000, 0.5, (0.5,)), PrecisionCell("type1", 1, 9000, 0.6, (0.6,))]
    save_count_chart(tmp_path / "count.png", cells, "$x$ _")
    save_price_chart(tmp_path / "price.png", cells, "$x$ _")
    assert is_drawn(tmp_path / "price.png")
