"""Targets lie on the road, on an even grid, at the road's height."""

import numpy as np
import pytest
import shapely

from seip_addon.core.base.errors import SeipError
from seip_addon.core.site.obstruction import NO_OBSTACLES_MESSAGE
from seip_addon.core.site.scene_geometry import Mesh, NamedArea, Pole
from seip_addon.core.site.targets import generate_targets
from seip_addon.core.workflows.survey import lay_out
from seip_addon.core.workflows.survey_settings import SurveySettings
from tests.builders.plain_street import PLAIN, block, street


def rectangle(low_x, low_y, high_x, high_y, slope=0.0):
    """Two triangles that rise with x."""
    corners = [(x, y, slope * x) for x, y in ((low_x, low_y), (high_x, low_y), (high_x, high_y), (low_x, high_y))]
    return np.array([[corners[0], corners[1], corners[2]], [corners[0], corners[2], corners[3]]], dtype=float)


def test_a_square_holds_a_centred_grid():
    targets = generate_targets(shapely.box(0, 0, 4, 2), rectangle(-10, -10, 10, 10), 1.0)
    assert len(targets) == 4 * 2
    assert targets.xyz.min(axis=0).tolist() == [0.5, 0.5, 0]
    assert targets.xyz.max(axis=0).tolist() == [3.5, 1.5, 0]


def test_targets_off_the_road_are_left_out():
    targets = generate_targets(shapely.box(0, 0, 10, 10), rectangle(0, 0, 5, 10), 1.0)
    assert targets.xyz[:, 0].max() <= 5
    assert len(targets) == 5 * 10


def test_weights_multiply_where_regions_overlap():
    regions = (NamedArea("a", shapely.box(-1, -1, 2, 9), 2.0), NamedArea("b", shapely.box(1, -1, 9, 9), 3.0))
    targets = generate_targets(shapely.box(0, 0, 4, 0.5), rectangle(-9, -9, 9, 9), 1.0, regions)
    assert targets.weight.tolist() == [2, 6, 3, 3]
    assert targets.central.all()


@pytest.mark.parametrize(
    ("region", "spacing", "sentence"),
    [
        (shapely.box(0, 0, 4, 4), float("nan"), "grid spacing must be"),
        (shapely.Polygon(), 1.0, "region of interest is empty"),
        (shapely.box(500, 500, 510, 510), 1.0, "no target"),
        (shapely.box(0, 0, 4000, 4000), 0.5, "choose a coarser one"),
    ],
)
def test_each_fault_has_its_sentence(region, spacing, sentence):
    with pytest.raises(SeipError, match=sentence):
        generate_targets(region, rectangle(-10, -10, 10, 10), spacing)


SETTINGS = SurveySettings(candidates=PLAIN)
POLE = Pole("mast", np.array((0.0, 9.0, 0.1)), 6.0)


@pytest.mark.parametrize(
    ("occluders", "bare"),
    [
        ((), True),
        ((Mesh("mast", block((-0.1, 8.9, 0.1), (5.0, 9.1, 6.0))),), True),
        ((Mesh("bollard", block((5, 8, 0), (5.2, 8.2, 1.4))),), True),
        ((Mesh("wall", block((5, 8, 0), (9, 9, 1.6))),), False),
    ],
)
def test_only_what_is_high_and_wide_hides_anything(occluders, bare):
    """The scene has one pole; its own mesh does not count."""
    layout = lay_out(street(poles=(POLE,), occluders=occluders), SETTINGS)
    assert layout.warnings.count(NO_OBSTACLES_MESSAGE) == bare
