"""Coverage of a placement under pose errors."""

import math

from headless.studies.stability.robustness_rows import pose_rows

import pytest

from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement.deployment import deploy
from seip_addon.core.choosing.robustness.pose_study import pose_study
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.scenarios.pose_errors import ERROR_KINDS, PoseErrors
from seip_addon.core.sensing.visibility.grid import compute_visibility
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.sensing.visibility.surroundings import Surroundings
from tests.builders.synthetic_junction import junction_site
from tests.engines import ANY

MODELS = load_catalogue()


@pytest.mark.slow
def test_a_study_says_who_is_to_blame():
    site = junction_site(positions=16, sensors=("type1",), heights=(5.4,), spacing=3.0)
    around = Surroundings(site, MODELS, VisibilitySettings(delta=2.0), engine=ANY)
    grid = finish(compute_visibility(site, MODELS, around.sight, ANY))
    deployment = deploy(site, MODELS, grid.rows([0, 5]), [0, 5])
    study = finish(pose_study(around, deployment, PoseErrors(tilt=math.radians(8)), seed=0, draws=(40, 10)))
    assert set(study.by_kind) == set(ERROR_KINDS)
    assert study.together.shape == (40,)
    losses = dict(zip(study.labels, study.loss_by_sensor(), strict=True))
    assert study.worst_sensor()[0] == max(losses, key=lambda label: losses[label].value)
    assert study.warnings()
    assert len(pose_rows(study)) == 3
