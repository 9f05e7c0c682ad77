"""From a map, or from objects of one's own, to a site that is sound: the operators do what the batch command does."""

from pathlib import Path

from headless import build_scene

import bpy
import numpy as np
import pytest

from seip_addon.core.output.results.answer import sentence
from seip_addon.core.site.installed_cost import load_installed_cost
from seip_addon.core.site.obstruction import NO_OBSTACLES_MESSAGE
from seip_addon.panel import placement
from seip_addon.panel.session import session
from seip_addon.scene import contract
from seip_addon.scene.read import read_scene
from tests.builders.drawn_layout import DrawnLayout

SCENES = Path(__file__).resolve().parents[2] / "scenes"
MAP = SCENES / "junction.xodr"


def choose(scene, path=MAP, radius=30.0):
    assert bpy.ops.seip.choose_map(filepath=str(path)) == {"FINISHED"}
    site = scene.seip.site
    site.radius = radius
    return site


def shapes(scene):
    return {obj.name: np.array(obj.matrix_world).tolist() for obj in scene.objects if obj.type == "MESH"}


def test_a_map_s_junctions_are_listed(scene):
    (junction,) = choose(scene).junctions
    assert junction.name == "100 · Central junction · East Street / North Street / West Street / South Street"
    assert junction.id == "100"
    assert scene.seip.site.radius == 30.0


def test_the_panel_builds_what_the_batch_command_builds(scene, tmp_path):
    site = choose(scene, radius=20.0)
    site.junction = site.junctions[0].name
    site.region_shape = "APPROACHES"
    assert bpy.ops.seip.build_site() == {"FINISHED"}
    by_panel = shapes(scene), read_scene(scene).geometry
    build_scene.main([str(MAP), "--junction", "100", "--approaches", "20", "-o", str(tmp_path / "site.blend")])
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "site.blend"))
    by_batch = shapes(bpy.context.scene), read_scene(bpy.context.scene).geometry
    assert by_panel[0] == by_batch[0]
    assert by_panel[1].region.equals(by_batch[1].region)
    assert by_panel[1].origin.tolist() == by_batch[1].origin.tolist()


def test_a_site_of_the_same_place_is_changed_and_one_of_another_place_is_a_scene_of_its_own(scene):
    site = choose(scene, radius=20.0)
    bpy.ops.seip.build_site()
    small = read_scene(scene).geometry.region.area
    bpy.ops.mesh.primitive_cube_add(location=(200.0, 0.0, 0.0))
    bpy.context.object.name = "Own kiosk"
    site.radius = 30.0
    assert bpy.ops.seip.build_site() == {"FINISHED"}
    assert bpy.context.scene == scene
    assert len(bpy.data.scenes) == 1
    assert "Own kiosk" in scene.objects
    assert [obj.name for obj in scene.objects if obj.type in {"CAMERA", "LIGHT"}] == ["Sun", "Overview"]
    assert read_scene(scene).geometry.region.area > 1.3 * small
    before = shapes(scene)
    site.junction = site.junctions[0].name
    bpy.ops.seip.build_site()
    assert len(bpy.data.scenes) == 2
    assert shapes(scene) == before
    other = next(each for each in bpy.data.scenes if each != scene)
    assert contract.find(other, contract.ROADS) != contract.find(scene, contract.ROADS)
    assert other.seip.site.source == scene.seip.site.source


def test_a_site_of_a_map_without_obstacles_says_so_where_sensors_are_placed(scene):
    choose(scene, radius=20.0)
    bpy.ops.seip.build_site()
    bpy.ops.seip.check_site()
    bare = sentence(NO_OBSTACLES_MESSAGE)
    layout = DrawnLayout()
    placement.draw(layout, bpy.context)
    assert bare in " ".join(layout.text.split())
    bpy.ops.mesh.primitive_cube_add(size=8.0, location=(6.0, 10.0, 4.0))
    contract.find(scene, contract.OCCLUDERS).objects.link(bpy.context.object)
    bpy.ops.seip.check_site()
    layout = DrawnLayout()
    placement.draw(layout, bpy.context)
    assert bare not in " ".join(layout.text.split())


def test_a_bad_map_is_one_sentence(scene, tmp_path):
    (tmp_path / "map.xodr").write_text("<x/>", encoding="utf-8")
    with pytest.raises(RuntimeError, match="is not OpenDRIVE"):
        bpy.ops.seip.choose_map(filepath=str(tmp_path / "map.xodr"))
    assert not scene.seip.site.source


def test_further_files_are_those_of_the_request(scene):
    site = choose(scene)
    site.terrain, site.osm = "/ground.tif", "/around.osm"
    request = site.request()
    assert request.terrain == MAP.joinpath("/ground.tif")
    assert request.osm == MAP.joinpath("/around.osm")
    site.terrain = site.osm = ""
    assert (site.request().terrain, site.request().osm) == (None, None)


def test_installed_costs_are_in_the_survey(junction, tmp_path):
    survey = junction.seip.survey
    assert survey.settings().installed_cost is None
    survey.installed = True
    assert survey.settings().installed_cost == load_installed_cost()
    (tmp_path / "mine.toml").write_text("new_post_usd = 9000\n", encoding="utf-8")
    survey.installed_cost = str(tmp_path / "mine.toml")
    assert survey.settings().installed_cost == load_installed_cost(tmp_path / "mine.toml")
    survey.installed_cost = str(tmp_path / "none.toml")
    with pytest.raises(RuntimeError, match="cannot read the installed costs"):
        bpy.ops.seip.solve_placement()


def test_roles_by_operator(scene):
    bpy.ops.mesh.primitive_plane_add()
    assert bpy.ops.seip.assign_role(role="ROADS") == {"FINISHED"}
    assert bpy.context.object in contract.find(scene, contract.ROADS).objects[:]
    assert bpy.ops.seip.assign_role(role="ROADS", remove=True) == {"FINISHED"}
    with pytest.raises(RuntimeError, match="nothing to take out"):
        bpy.ops.seip.assign_role(role="ROADS", remove=True)
    bpy.ops.object.select_all(action="DESELECT")
    with pytest.raises(RuntimeError, match="Select objects first"):
        bpy.ops.seip.assign_role(role="ROADS")


def test_the_weight_of_a_region_is_the_contract_s_own(scene):
    bpy.ops.mesh.primitive_plane_add()
    obj = bpy.context.object
    assert obj.seip_region_weight == 2.0
    assert not obj.keys()
    obj.seip_region_weight = 3.3
    assert obj[contract.WEIGHT] == 3.3
    obj[contract.WEIGHT] = "heavy"
    assert obj.seip_region_weight == 2.0


def test_the_check_lists_and_shows(junction):
    scene = junction
    pole = contract.find(scene, contract.POLES).objects[0]
    pole.location.z += 3.0
    assert bpy.ops.seip.check_site() == {"FINISHED"}
    found = session.of(scene).check.found
    assert found.counts.keys() >= {"Region", "Roads", "Poles", "Targets", "Positions", "Poses"}
    assert [one.severity for one in found.problems if one.obj == pole.name] == ["WARNING"]
    assert bpy.ops.seip.show_problem(object=pole.name) == {"FINISHED"}
    assert bpy.context.object == pole
    assert bpy.context.selected_objects == [pole]
    pole.hide_set(True)
    with pytest.raises(RuntimeError, match="is hidden"):
        bpy.ops.seip.show_problem(object=pole.name)
