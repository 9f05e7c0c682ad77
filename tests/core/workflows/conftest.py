"""A survey of the small junction that the tests of workflows share."""

import pytest

from seip_addon.core.base.progress import finish
from seip_addon.core.site.candidates import CandidateSettings
from seip_addon.core.workflows.survey import lay_out, see
from seip_addon.core.workflows.survey_settings import SurveySettings
from tests.builders.small_junction import make_geometry

SETTINGS = SurveySettings(
    candidates=CandidateSettings(sensors=("type1", "type2"), heights=(4.0, 6.0), spacing=25.0), grid_spacing=4.0
)


@pytest.fixture(scope="session")
def small_layout():
    return lay_out(make_geometry(50.0), SETTINGS, ("read with care",))


@pytest.fixture(scope="session")
def small_survey(small_layout, tmp_path_factory):
    return finish(see(small_layout, tmp_path_factory.mktemp("survey") / "visibility.npz"))
