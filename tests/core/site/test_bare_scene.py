"""A scene in which nothing can hide anything says so."""

import numpy as np
import pytest

from seip_addon.core.site.obstruction import NO_OBSTACLES_MESSAGE
from seip_addon.core.site.scene_geometry import Mesh, Pole
from seip_addon.core.workflows.survey import lay_out
from seip_addon.core.workflows.survey_settings import SurveySettings
from tests.builders.plain_street import PLAIN, block, street

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
