"""What a placement sees where assumed heights are other."""

from dataclasses import replace

import numpy as np
import pytest
import shapely

from seip_addon.core.choosing.placement.objective import Objective
from seip_addon.core.choosing.robustness.assumed_heights import CHANGES, coverage_by_heights, height_notes, with_heights
from seip_addon.core.progress import finish
from seip_addon.core.site.candidates import CandidateSettings
from seip_addon.core.site.scene_geometry import ASSUMED, Mesh, SceneGeometry
from seip_addon.core.workflows.placing import place
from seip_addon.core.workflows.survey import lay_out, see, surroundings
from seip_addon.core.workflows.survey_settings import SurveySettings
from tests.builders.plain_street import block, sheet

WALL = block((-12.0, -1.0, 0.0), (12.0, -0.8, 2.0))  # between the sensors' pavement and half of the road


def geometry(**of_wall):
    return SceneGeometry(
        name="Walled street",
        origin=np.zeros(3),
        roads=(Mesh("road", sheet(-20, -7, 20, 7)),),
        ground=(Mesh("pavement", sheet(-20, 7, 20, 10, 0.1)),),
        occluders=(Mesh("wall 1", WALL, **of_wall), Mesh("wall 2", block((-20.0, 11.0, 0.0), (20.0, 11.2, 4.0)))),
        region=shapely.box(-20, -7, 20, 7),
        candidate_areas=shapely.box(-2, 7, 2, 10),
    )


def survey(scene, tmp_path):
    settings = SurveySettings(candidates=CandidateSettings(sensors=("type2",), heights=(5.4,), spacing=2.0))
    return finish(see(lay_out(scene, settings), tmp_path / "visibility.npz"))


def test_only_what_is_assumed_is_scaled_and_keeps_its_foot():
    raised = replace(geometry(height_assumed=True).occluders[0], triangles=WALL + np.array([0, 0, 5.0]))
    scene = replace(geometry(), occluders=(raised, geometry().occluders[1]))
    one, other = with_heights(scene, 1.3).occluders
    heights = one.triangles[..., 2]
    assert (heights.min(), heights.max()) == (pytest.approx(5.0), pytest.approx(5.0 + 1.3 * 2))
    assert one.triangles[..., :2].tolist() == WALL[..., :2].tolist()
    assert other.triangles is scene.occluders[1].triangles


def test_coverage_is_what_a_survey_of_the_changed_scene_finds(tmp_path):
    scene = geometry(height_assumed=True)
    surveyed = survey(scene, tmp_path)
    solution = finish(place(surveyed, Objective(count=1)))
    found = coverage_by_heights(surroundings(surveyed), scene, solution.deployment.sensors)
    pose = solution.deployment.sensors[0].pose
    for factor in CHANGES:
        changed = survey(with_heights(scene, factor), tmp_path / f"{factor}")
        assert found[factor] == changed.grid.visible[pose].mean()
    assert found[0.7] > solution.deployment.coverage + 0.02
    assert solution.deployment.coverage >= found[1.3]
    (note,) = [note for note in solution.placement.notes if "partly assumed" in note]
    assert f"30 % lower coverage is {found[0.7]:.1%}, 30 % higher {found[1.3]:.1%}" in note


def test_nothing_is_said_where_no_height_is_assumed_or_nothing_changes(tmp_path):
    scene = geometry()
    surveyed = survey(scene, tmp_path)
    solution = finish(place(surveyed, Objective(count=1)))
    sensors, coverage = solution.deployment.sensors, solution.deployment.coverage
    assert coverage_by_heights(surroundings(surveyed), scene, sensors) == {}
    behind = replace(scene, occluders=(scene.occluders[0], replace(scene.occluders[1], height_assumed=True)))
    assert coverage_by_heights(surroundings(surveyed), behind, sensors) == dict.fromkeys(CHANGES, coverage)
    assert height_notes(surroundings(surveyed), behind, sensors, coverage) == ()


def test_sources_are_counted_by_kind_without_numbers():
    scene = geometry(source="extract", height_assumed=True)
    post = Mesh("Assumed signal pole 3", WALL, source=ASSUMED)
    scene = replace(scene, occluders=(*scene.occluders, post, replace(post, name="Assumed signal pole 12")))
    rows = {row.kind: (row.source, row.count, row.assumed) for row in scene.sources()}
    assert rows == {"wall": ("extract", 1, 1), "Assumed signal pole": ("assumed", 2, 2)}
