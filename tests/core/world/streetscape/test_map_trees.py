"""Trees of a map: a trunk's width is no crown's, and a tree without a type is no box."""

import numpy as np
import pytest

from seip_addon.core.base.progress import finish
from seip_addon.core.world.opendrive.read import read_map
from seip_addon.core.world.streetscape.description import SiteDescription
from tests.builders.map_models import site_model
from tests.builders.street_map import street_map

TREE = '<object id="1" type="{kind}" name="{name}" s="80" t="-12" zOffset="0" hdg="0" {size}/>'


def tree_of(tmp_path, size, kind="tree", name="Tree"):
    path = tmp_path / "street.xodr"
    path.write_text(street_map(furniture=TREE.format(kind=kind, name=name, size=size)), encoding="utf-8")
    model = finish(site_model(read_map(path), SiteDescription(near=(0.0, 0.0), radius=40.0)))
    return next(part for part in model.parts if part.name == name), model


@pytest.mark.parametrize(
    ("size", "crown"),
    [
        ('height="21" radius="0.125"', 0.6 * 21),
        ('height="21" length="0.4" width="0.4"', 0.6 * 21),
        ('height="12" radius="0.95"', 1.9),  # a cypress
        ('height="7" radius="1.96"', 3.92),
        ('height="9"', 0.6 * 9),
        ('length="4" width="2.5"', 4.0),  # of no height: 8 m
    ],
)
def test_the_crown_is_the_maps_unless_that_can_only_be_the_trunk(tmp_path, size, crown):
    tree, model = tree_of(tmp_path, size)
    assert 2 * np.abs(tree.solid.vertices[:, :2]).max() == pytest.approx(crown)
    assert any("the width of a trunk" in note for note in model.notes) == (crown == 0.6 * 21)
