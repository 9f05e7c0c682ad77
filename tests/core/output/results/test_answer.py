"""The answer of a placement in short sentences, on records of the small junction."""

import math
from dataclasses import replace

import pytest

from seip_addon.core.choosing.placement.objective import ACCEPTED_MESSAGE, MOVED
from seip_addon.core.choosing.placement.returns_summary import CrossingReturns, ReturnsSummary
from seip_addon.core.output.results.answer import (
    answer,
    change_text,
    costs_of,
    possible_improvement,
    recommendation,
    status_text,
)
from seip_addon.core.output.results.placement_record import load_placement
from tests.builders.report_folder import make_folder


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    folder = tmp_path_factory.mktemp("answer")
    make_folder(folder, objective=500.0, bound=500.0)
    made = load_placement(folder / "placement.json")
    sensors = tuple(replace(one, coverage_marginal=0.2, price_usd=16_000.0) for one in made.sensors)
    return replace(made, sensors=sensors, price_usd=48_000.0, coverage=replace(made.coverage, whole=0.9444))


def within(record, bound, status="feasible", **changes):
    gap = abs(bound / record.objective.value - 1.0)
    return replace(record, objective=replace(record.objective, bound=bound, gap=gap, status=status, **changes))


def with_returns(record, least=30.0, typical=150.0):
    crossings = (CrossingReturns("Rope Lane", 80.0), CrossingReturns("Harbour Road", least))
    returns = ReturnsSummary(typical, {"car": 494.0, "cyclist": 71.0, "pedestrian": 36.0}, crossings)
    objective = replace(record.objective, sought="most returns", value=math.log1p(typical), bound=math.log1p(typical))
    return replace(record, returns=returns, objective=objective)


def test_a_proven_placement_has_two_sentences(record):
    assert status_text(record) == "94% · $48k · proven"
    assert answer(record) == (
        "94.4% of the road is seen. By the criterion, no placement of these candidates is better.",
        f"$48,000 for 3 sensors, about ${costs_of(record).total:,.0f} installed.",
    )


def test_the_possible_improvement_is_that_of_the_bound(record):
    one = within(record, 515.0)
    assert possible_improvement(one) == pytest.approx(0.03)
    assert status_text(one) == "94% · $48k · within 3.0%"
    assert "At most 3.0% better is possible" in answer(one)[0]
    cheapest = within(record, 450.0, sought="least price")
    assert possible_improvement(cheapest) == pytest.approx(0.1)
    assert "At most 10.0% cheaper is possible" in answer(cheapest)[0]
    unknown = replace(record, objective=replace(record.objective, bound=None, gap=None, status="feasible"))
    assert possible_improvement(unknown) is None
    assert status_text(unknown).endswith("not proven")
    moved = within(record, 515.0, status=MOVED)
    assert possible_improvement(moved) is None
    assert status_text(moved).endswith("not optimised")


@pytest.mark.parametrize(("least", "word"), [(0.95, "good"), (0.9, "fair"), (0.5, "poor")])
def test_an_answer_of_returns_begins_with_a_verdict(record, least, word):
    one = with_returns(record)
    judged = replace(one, returns=replace(one.returns, enough={"car": 0.991, "cyclist": least, "pedestrian": 0.96}))
    expected = (
        "A car in plain view returns 12 points or more at 99% of its places, "
        f"a cyclist 8 or more at {least:.0%}, a pedestrian 8 or more at 96%: {word}. 150 returns from a road user"
    )
    assert answer(judged)[0].startswith(expected)


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (lambda one: one, ""),
        (lambda one: within(one, 550.0), "raise the effort"),
        (lambda one: replace(within(one, 550.0), notes=(ACCEPTED_MESSAGE,)), "let the search run to its end"),
        (lambda one: with_returns(one, least=3.2), "(3.2) at Harbour Road"),
        (lambda one: with_returns(one, least=5.1), ""),
        (
            lambda one: replace(
                one, sensors=(one.sensors[0], replace(one.sensors[1], coverage_marginal=0.004), *one.sensors[2:])
            ),
            "Leave out S2: without it 0.4%",
        ),
    ],
)
def test_one_recommendation_at_most(record, change, named):
    sentence = recommendation(change(record))
    assert named in sentence
    assert bool(sentence) == bool(named)
    assert len(answer(change(record))) == 2 + bool(named)


def test_a_worse_result_is_called_worse(record):
    less = replace(record, coverage=replace(record.coverage, whole=0.9))
    assert change_text(less, record) == "Worse than the previous placement: 90.00% instead of 94.44%."
    assert change_text(record, less) == "Better than the previous placement: 94.44% instead of 90.00%."
    assert change_text(record, record) == ""
    cheaper = replace(less, price_usd=record.price_usd - 16_000.0)
    assert change_text(cheaper, record).endswith("90.00% instead of 94.44%, for $16,000 less.")
    assert change_text(record, cheaper).endswith("94.44% instead of 90.00%, for $16,000 more.")
    assert change_text(with_returns(record, typical=120.0), with_returns(record)).startswith("Worse")
