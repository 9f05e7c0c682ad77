"""A scene in which nothing can hide anything says so."""

from dataclasses import replace

import numpy as np
import pytest

from seip_addon.core.progress import finish
from seip_addon.core.site.obstruction import NO_OBSTACLES_MESSAGE
from seip_addon.core.site.scene_geometry import Mesh, Pole
from seip_addon.core.workflows.survey import lay_out
from seip_addon.core.workflows.survey_settings import SurveySettings
from seip_addon.core.world.opendrive.read import read_map
from seip_addon.core.world.streetscape.description import SiteDescription, Trees
from seip_addon.core.world.streetscape.model import site_model
from tests.builders.plain_street import PLAIN, block, street
from tests.builders.street_map import street_map

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


def test_a_bare_map_says_so_once_when_it_is_built(tmp_path):
    path = tmp_path / "street.xodr"
    path.write_text(street_map(), encoding="utf-8")
    here = SiteDescription(near=(0.0, 0.0), radius=30.0)
    tree = Trees(np.array([[-20.0, 9.0]]), 8.0, 5.0)
    assert finish(site_model(read_map(path), here)).warnings == (NO_OBSTACLES_MESSAGE,)
    assert finish(site_model(read_map(path), replace(here, trees=(tree,)))).warnings == ()
