"""Selection of parametrised cases: a few in the quick suite, the others among the slow tests."""

from collections.abc import Iterable

import pytest


def few(cases: Iterable[object], number: int) -> list[object]:
    """Return cases of one parameter, of which all but the first ``number`` are marked slow."""
    return [case if index < number else pytest.param(case, marks=pytest.mark.slow) for index, case in enumerate(cases)]
