"""Hostile files of each format give a result or one sentence: see `tests/fuzz.py`, which runs any number of them."""

from pathlib import Path

import pytest

from tests.fuzz import FORMATS, fuzz, input_of, is_fault


@pytest.mark.parametrize(
    ("seed", "count"),
    [
        pytest.param(1, 40, marks=pytest.mark.slow, id="many"),
        pytest.param(2, 400, marks=pytest.mark.long, id="most"),
    ],
)
@pytest.mark.parametrize("key", FORMATS)
def test_hostile_files_give_a_result_or_a_sentence(key, seed, count):
    went = fuzz(key, seed=seed, count=count)
    assert len(went) == count
    assert [line for line in went if is_fault(key, line)] == []


def test_inputs_are_the_same_for_the_same_seed():
    sample = FORMATS["site"].samples(Path())
    one, other = (input_of("site", sample, 3, 5) for _ in range(2))
    assert one == other
    assert one != input_of("site", sample, 3, 6)
