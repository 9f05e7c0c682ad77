from dataclasses import replace

import numpy as np
import pytest

from seip_addon.core.choosing.placement.deployment import Deployment
from seip_addon.core.output.pictures.coverage_colours import as_placed, colouring, of_placement
from seip_addon.core.output.pictures.palette import WEIGHT_COLOURS

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


def test_a_placements_pictures_know_three_classes():
    assert as_placed(SEEN_BY).of.tolist() == [0, 1, 2, 2, 2, 0]


def test_many_weights_share_classes_in_their_order():
    weight = np.linspace(1, 9, 23)
    found = colouring("weights", np.zeros(23, dtype=int), weight)
    assert len(found.words) == len(WEIGHT_COLOURS)
    assert (np.diff(found.of) >= 0).all()
    assert found.words[0].startswith("weight 1 to ")


def test_one_weight_is_one_class():
    assert colouring("weights", np.zeros(3, dtype=int), np.ones(3)).words == ("weight 1",)


def test_a_placement_by_returns_is_coloured_by_those_from_a_pedestrian():
    rows = np.zeros((0, 6), dtype=bool)
    by_coverage = Deployment((), np.array([0, 1, 2, 3, 0, 1]), 0.6, 0.3, None, 0.6, 0.0, rows)
    assert of_placement(by_coverage).of.tolist() == [0, 1, 2, 2, 0, 1]
    shown = of_placement(replace(by_coverage, pedestrian_returns=np.array([0.0, 0.99, 1.0, 5.0, 19.9, 20.0])))
    assert shown.words == ("below 1", "1 to 5", "5 to 20", "20 or more")
    assert shown.of.tolist() == [0, 0, 1, 2, 2, 3]
