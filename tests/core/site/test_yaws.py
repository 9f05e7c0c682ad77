"""Sensors that look one way get several yaws, those that look all round keep their poses to the byte."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement.objective import Objective
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.visibility.grid import compute_visibility
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.sensing.visibility.sight_lines import pose_at
from seip_addon.core.site.candidates import CandidateSettings
from seip_addon.core.site.scene_geometry import Mesh, NamedArea
from seip_addon.core.site.site import make_site
from seip_addon.core.workflows.placing import optimise
from tests.builders.plain_street import PLAIN, block, street
from tests.engines import ANY, needs_any

ROUND = load_catalogue()["type1"]


def looking(degrees, key="one-way", **changes):
    return replace(ROUND, key=key, field_of_view=math.radians(degrees), **changes)


def site_of(settings, *models, spacing=4.0, **changes):
    return make_site(
        street(**changes), settings, spacing, fields_of_view={model.key: model.field_of_view for model in models}
    )


BOTH = replace(PLAIN, sensors=("type1", "one-way"), spacing=12.0)


def test_yaws_are_spread_evenly_and_the_first_looks_to_the_region():
    poses = site_of(replace(BOTH, sensors=("one-way",), yaws=5), looking(359)).candidates
    assert len(poses) == 5 * 2 * len(poses.position)
    degrees = np.degrees(poses.yaw).reshape(-1, 5)
    assert degrees[:, 0][np.abs(poses.position[poses.position_of[::5], 0]) < 30] == pytest.approx(-90, abs=1e-4)
    assert (degrees - degrees[:, :1]) % 360 == pytest.approx(np.tile(72.0 * np.arange(5), (len(degrees), 1)), abs=1e-3)
    assert not poses.tilt.any()


@pytest.mark.parametrize("yaws", [0, 361])
def test_a_wrong_number_of_yaws_has_its_sentence(yaws):
    with pytest.raises(SeipError, match=f"1 to 360 yaws, not {yaws}"):
        CandidateSettings(yaws=yaws)


@needs_any
def test_a_placement_of_two_sensors_that_look_one_way_is_the_best_of_all():
    """Against the union of what every two poses at different positions see; one at a position is all there may be."""
    settings = replace(BOTH, sensors=("one-way",), heights=(5.0,), spacing=20.0, yaws=6, tilts=(0.0, 0.15))
    wall = Mesh("wall", block((-2.0, -2.0, 0.0), (2.0, 2.0, 4.0)))
    model = looking(70, points_per_second=30_000.0)
    site = site_of(
        settings, model, occluders=(wall,), mandatory_areas=(NamedArea("west", shapely.box(-40, 7, -20, 10)),)
    )
    models = {model.key: model}
    visible = finish(compute_visibility(site, models, VisibilitySettings(), ANY)).visible
    solution = finish(optimise(site, visible, models, Objective(count=2)))
    poses = site.candidates
    assert len(np.unique(poses.yaw)) > 4
    best = max(
        (visible[a] | visible[b]).sum()
        for a, b in itertools.combinations(range(len(poses)), 2)
        if poses.position_of[a] != poses.position_of[b]
        and poses.mandatory[:, poses.position_of[[a, b]]].any(axis=1).all()
    )
    assert solution.placement.status == "optimal"
    assert solution.deployment.coverage == best / len(site.targets)
    for sensor in solution.deployment.sensors:
        assert sensor.yaw == poses.yaw[sensor.pose]
        assert sensor.turned.endswith(f", yaw {math.degrees(sensor.yaw) % 360:.3g}°")
        assert pose_at(poses, model.key, sensor.xyz, sensor.orientation) == sensor.pose
