import numpy as np
import pytest

from seip_addon.core.output.pictures.palette import colouring

SEEN_BY = np.array([0, 1, 2, 3, 7, 0])
WEIGHT = np.array([1.0, 1.0, 2.0, 4.0, 2.0, 1.0])


@pytest.mark.parametrize(
    ("aspect", "words", "of"),
    [
        ("seen", ("not seen", "seen"), [0, 1, 1, 1, 1, 0]),
        ("times", ("not seen", "seen by one sensor", "seen by two or more"), [0, 1, 2, 2, 2, 0]),
        ("weights", ("weight 1", "weight 2", "weight 4"), [0, 0, 1, 2, 1, 0]),
    ],
)
def test_each_aspect_has_its_classes(aspect, words, of):
    found = colouring(aspect, SEEN_BY, WEIGHT)
    assert (found.words, found.of.tolist()) == (words, of)
    assert len(set(found.colours)) == len(words)
    assert found.shares == pytest.approx(np.bincount(of) / len(of))
