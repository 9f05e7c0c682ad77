"""Each claim's verdict, both ways and open, on trials that are told and not run."""

from headless.studies.detection import price_chart
from headless.studies.detection.claims import SeedResult, detection_claims, mean_interval
from headless.studies.detection.price_chart import PrecisionCell, save_price_chart

import numpy as np
import pytest

from seip_addon.core.output.pictures import drawing as style
from tests.builders.charts import is_drawn, line, record_figures

PRICE = {"type1": 6000.0, "type2": 15000.0, "type3": 80000.0}
PUBLISHED = {"type1": (0.60, 0.80, 0.87), "type2": (0.75, 0.85, 0.90), "type3": (0.90, 0.91, 0.91)}
FALSE = (5.0, 3.0, 1.0)
SPREAD = (-0.004, 0.0, 0.004)


def trials(precision=None, *, false=FALSE, sparse=0.8, spread=SPREAD):
    told = []
    for sensor, reached in (PUBLISHED if precision is None else precision).items():
        way = 1 if sensor == "type1" else -1  # seeds that suit one type do not suit another
        for count, value, wrong in zip((1, 2, 4), reached, false, strict=True):
            for seed, off in enumerate(spread):
                told.append(
                    SeedResult(
                        sensor=sensor,
                        count=count,
                        seed=seed,
                        average_precision=value + way * off * count,  # gains vary as well, not the level alone
                        price=PRICE[sensor] * count,
                        coverage=0.9,
                        false_positives=wrong + off,
                        sparse=sparse + off,
                    )
                )
    return told


def verdicts(*told, **more):
    return {claim.number: claim.verdict for claim in detection_claims(trials(*told, **more))}


def test_the_published_figures_hold():
    assert verdicts() == dict.fromkeys((5, 6, 7, 8), "holds")


def test_half_and_twice_the_gain_is_about_it():
    assert verdicts({"type1": (0.50, 0.62, 0.69)})[5] == "holds"  # 12 and 7 points
    assert verdicts({"type1": (0.40, 0.76, 0.87)})[5] == "holds"  # 36 and 11
    assert verdicts({"type1": (0.50, 0.55, 0.62)})[5] == "does not hold"  # 5 and 7
    assert verdicts({"type1": (0.30, 0.65, 0.90)})[5] == "does not hold"  # 35 and 25
    assert verdicts({"type1": (0.50, 0.60, 0.67)})[5] == "undecided"  # 10 is half of 20


def test_seeds_that_disagree_decide_nothing():
    assert verdicts(spread=(-0.1, 0.0, 0.1)) == dict.fromkeys((5, 6, 7), "undecided") | {8: "holds"}


def test_the_simplest_type_has_to_gain_more_than_every_other():
    assert verdicts(PUBLISHED | {"type3": (0.50, 0.80, 0.92)})[7] == "does not hold"
    assert verdicts(PUBLISHED | {"type3": (0.63, 0.80, 0.90)})[7] == "undecided"


def test_mean_interval_of_three_seeds_by_hand():
    """Mean 0.7, standard deviation 0.1, t = 4.303: ± 4.303 · 0.1/√3 = 0.248."""
    assert mean_interval([0.6, 0.7, 0.8]) == pytest.approx((0.7 - 0.24841, 0.7 + 0.24841), abs=1e-5)


def test_three_seeds_are_covered_nineteen_times_of_twenty():
    rng = np.random.default_rng(1)
    intervals = np.array([mean_interval(values) for values in rng.normal(0.5, 0.1, (2000, 3))])
    assert ((intervals[:, 0] <= 0.5) & (intervals[:, 1] >= 0.5)).mean() == pytest.approx(0.95, abs=0.015)


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
