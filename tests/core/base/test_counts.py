"""Counted nouns, alone and in the messages that once said "1 outlines"."""

import pytest

from seip_addon.core.base.counts import counted


@pytest.mark.parametrize(
    ("number", "words", "expected"),
    [
        (0, ("tree",), "0 trees"),
        (1, ("tree",), "1 tree"),
        (12_345, ("tree",), "12,345 trees"),
        (1, ("outline that crosses itself", "outlines that cross themselves"), "1 outline that crosses itself"),
        (2, ("outline that crosses itself", "outlines that cross themselves"), "2 outlines that cross themselves"),
    ],
)
def test_the_noun_follows_the_number(number, words, expected):
    assert counted(number, *words) == expected
