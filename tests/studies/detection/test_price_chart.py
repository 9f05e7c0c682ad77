"""The chart of average precision against price, read back from what was drawn."""

from headless.studies.detection import price_chart
from headless.studies.detection.price_chart import PrecisionCell, save_price_chart

import pytest

from seip_addon.core.output.pictures import chart_style as style
from tests.builders.charts import is_drawn, line, record_figures

CELLS = (
    PrecisionCell("type1", 1, 6_000, 0.2, (0.55, 0.57, 0.59), (0.52, 0.62)),
    PrecisionCell("type1", 2, 12_000, 0.3, (0.70, 0.72, 0.74), (0.67, 0.77)),
    PrecisionCell("type2", 1, 15_000, 0.4, (0.65, 0.66, 0.67), None),
    PrecisionCell("type2", 2, 30_000, 0.6, (0.80, 0.80, 0.80), (0.80, 0.80)),
)


@pytest.fixture
def figures(monkeypatch):
    """The figures that were saved."""
    return record_figures(monkeypatch, price_chart, style)


def test_price_chart_has_its_front_and_names(tmp_path, figures):
    save_price_chart(tmp_path / "price.png", CELLS, "Junction")
    assert is_drawn(tmp_path / "price.png")
    (panel,) = figures[0].axes
    front = line(panel, "front: nothing cheaper detects as well")
    assert front.get_xdata().tolist() == [6_000, 12_000, 30_000]
    assert front.get_ydata() == pytest.approx([0.57, 0.72, 0.80])
    assert {text.get_text() for text in panel.texts} == {"1 × type1", "2 × type1", "1 × type2", "2 × type2"}
    boxes = [text.get_window_extent() for text in panel.texts]
    assert not any(a.overlaps(b) for row, a in enumerate(boxes) for b in boxes[:row])


def test_the_same_chart_has_the_same_bytes(tmp_path):
    for name in ("a.png", "b.png"):
        save_price_chart(tmp_path / name, CELLS, "Junction")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
