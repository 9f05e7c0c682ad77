"""Grids of random scenes are the full scan's bit for bit, and what float64 says wherever float32 cannot decide."""

from __future__ import annotations

from collections import Counter

import pytest

from seip_addon.core.sensing.visibility.settings import Engine
from tests.engines import each_engine
from tests.oracles.visibility_search import FAULTS, assess, draw_case, search, sentence

QUICK = 12
MANY, MOST = 25, 375


def no_fault(total: Counter[str]) -> None:
    assert not any(total[fault] for fault in FAULTS), sentence(total)
    assert total["seen"] > 0.02 * total["entries"]
    assert total["undecided"] < 0.01 * total["entries"]


@pytest.mark.parametrize("first", [42, 51])  # faults that there were showed in scenes 42, 43, 51 and 52
@each_engine
def test_grids_of_random_scenes(engine: Engine, first: int) -> None:
    no_fault(search([engine], 2, first_seed=first))


@pytest.mark.parametrize(
    ("first", "number"),
    [
        pytest.param(100_000, MANY, marks=pytest.mark.slow, id="many"),
        pytest.param(100_000 + MANY, MOST, marks=pytest.mark.long, id="most"),
    ],
)
@each_engine
def test_grids_of_many_random_scenes(engine: Engine, first: int, number: int) -> None:
    no_fault(search([engine], number, first_seed=first))


@pytest.mark.slow
def test_the_arithmetic_decides_nearly_all_by_itself() -> None:
    """The reference is no echo of what it evaluates: it says seen and unseen of what shares no code with it."""
    verdicts = [assess(draw_case(seed)) for seed in range(QUICK)]
    undecided = sum(int(verdict.undecided.sum()) for verdict in verdicts)
    assert undecided < 0.01 * sum(verdict.seen.size for verdict in verdicts)
    assert all(not (verdict.seen & verdict.undecided).any() for verdict in verdicts)
