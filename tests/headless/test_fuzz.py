"""Hostile files of each format give a result or one sentence: see `tests/fuzz.py`, which runs any number of them."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from tests.fuzz import FORMATS, case_of, fuzz, is_fault


@pytest.mark.parametrize(
    ("seed", "cases"),
    [
        pytest.param(1, 100, marks=pytest.mark.slow, id="many"),
        pytest.param(2, 300, marks=pytest.mark.long, id="most"),
    ],
)
@pytest.mark.parametrize("key", FORMATS)
def test_hostile_files_give_a_result_or_a_sentence(key, seed, cases):
    if key == "pt":
        pytest.importorskip("torch", reason="make detection installs it")
    count = round(cases * FORMATS[key].share)
    went = fuzz(key, seed=seed, count=count)
    assert len(went) == count
    assert [line for line in went if is_fault(key, line)] == []


def test_inputs_are_the_same_for_the_same_seed():
    sample = FORMATS["site"].samples(Path())
    one, other = (case_of("site", sample, 3, 5) for _ in range(2))
    assert one == other
    assert one != case_of("site", sample, 3, 6)
