"""Counted nouns, alone and in the messages that once said "1 outlines"."""

import re
from pathlib import Path

import pytest

import seip_addon.core
from seip_addon.core.counts import counted

CODE = Path(seip_addon.core.__file__).parents[2]


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


def test_no_module_forms_plurals_of_its_own():
    """A plural that is formed in place is one that the next message forgets."""
    own = re.compile(r"""['"]s['"] \* |['"]s['"] if |else ['"]s['"]""")
    modules = [*(CODE / "seip_addon").rglob("*.py"), *(CODE / "headless").rglob("*.py")]
    assert [
        f"{path.name}: {line.strip()}"
        for path in modules
        for line in path.read_text(encoding="utf-8").splitlines()
        if own.search(line) and path.name != "counts.py"
    ] == []
