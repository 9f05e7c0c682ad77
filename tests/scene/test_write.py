import hashlib
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import bpy
import matplotlib.pyplot as plt
import numpy as np
import pytest

from seip_addon.core.choosing.placement.deployment import deploy
from seip_addon.core.errors import SeipError
from seip_addon.core.output.pictures import labelled_view
from seip_addon.core.output.pictures.coverage_colours import Colouring, colouring, of_placement
from seip_addon.core.sensing.traffic.trajectories import RoadUser, Trajectories
from seip_addon.scene import contract
from seip_addon.scene.coverage_colours import colour_coverage, recolour, show_seen_by
from seip_addon.scene.materials import linear
from seip_addon.scene.render import rendered_pictures
from seip_addon.scene.traffic import animate
from seip_addon.scene.write import LIFT, clear_result, shown_legend, write_result
from tests.builders.scene_by_hand import make_scene
from tests.builders.small_junction import make_example


@pytest.fixture(scope="module")
def example():
    return make_example()


@pytest.fixture
def scene(example):
    return make_scene(example.geometry)


def empties(scene):
    objects = contract.find(scene, contract.SENSORS).objects
    return sorted((obj for obj in objects if obj.type == "EMPTY"), key=lambda obj: obj["seip_label"])


def coverage(scene):
    (obj,) = contract.find(scene, contract.COVERAGE).objects
    return obj


def fingerprint(objects):
    """Digest of all meshes, transforms, properties and settings that a user would miss."""
    state = hashlib.sha256()
    for obj in sorted(objects, key=lambda obj: obj.name):
        vertices = np.array([v.co for v in obj.data.vertices]) if obj.type == "MESH" else np.zeros(0)
        state.update(repr((obj.name, obj.type, [list(r) for r in obj.matrix_world], vertices.tolist())).encode())
        state.update(repr((sorted(obj.keys()), obj.hide_render, [c.name for c in obj.users_collection])).encode())
        state.update(repr([slot.material.name for slot in obj.material_slots]).encode())
    return state.hexdigest()


def settings_of(scene):
    render = scene.render
    kept = (render.engine, render.resolution_x, render.filepath, render.film_transparent, scene.camera, scene.world)
    return (*kept, scene.view_settings.view_transform, scene.cycles.samples, scene.frame_current)


def test_sensors_are_empties_with_their_pose_and_properties(example, scene):
    write_result(scene, example.site, example.deployment)
    bpy.context.view_layer.update()
    for empty, sensor in zip(empties(scene), example.deployment.sensors, strict=True):
        matrix = np.array(empty.matrix_world)
        assert np.allclose(matrix[:3, 3], sensor.xyz, atol=1e-4)
        assert np.allclose(matrix[:2, 0], (np.cos(sensor.yaw), np.sin(sensor.yaw)), atol=1e-6)
        assert empty["seip_sensor"] == sensor.model.key
        assert empty["seip_height"] == sensor.height
        assert empty["seip_position"] == sensor.position_name
        assert empty["seip_coverage"] == sensor.alone
        assert empty["seip_price"] == sensor.model.price
        assert empty["seip_range"] == sensor.model.max_range
        assert empty["seip_yaw_deg"] == pytest.approx(np.degrees(sensor.yaw))


def test_posts_stand_on_the_ground_and_brackets_reach_the_pole(example, scene):
    write_result(scene, example.site, example.deployment)
    bpy.context.view_layer.update()
    kinds = set()
    for empty, sensor in zip(empties(scene), example.deployment.sensors, strict=True):
        (body,) = empty.children
        corners = np.array([body.matrix_world @ v.co for v in body.data.vertices])
        kinds.add(sensor.on_pole)
        if sensor.on_pole:
            reach = np.hypot(*(corners[:, :2] - sensor.foot[:2]).T).min()
            assert reach < 0.05
            assert corners[:, 2].min() > sensor.xyz[2] - 0.3
        else:
            assert corners[:, 2].min() == pytest.approx(sensor.foot[2], abs=1e-4)
    assert kinds == {True, False}


def test_coverage_has_one_square_per_target_with_how_often_it_is_seen(example, scene):
    write_result(scene, example.site, example.deployment)
    mesh = coverage(scene).data
    assert len(mesh.polygons) == len(example.site.targets)
    seen = np.empty(len(mesh.polygons), np.int32)
    mesh.attributes["seip_seen"].data.foreach_get("value", seen)
    assert np.array_equal(seen, example.deployment.seen_by)
    middles = np.array([polygon.center for polygon in mesh.polygons])
    assert np.allclose(middles, example.site.targets.xyz + np.array((0, 0, LIFT)), atol=1e-4)
    classes = np.array([polygon.material_index for polygon in mesh.polygons])
    assert np.array_equal(classes, np.minimum(seen, 2))
    assert mesh.color_attributes.active_color_name == "seip_colour"
    assert all(polygon.normal.z > 0.99 for polygon in mesh.polygons)
    colours = {tuple(material.diffuse_color) for material in mesh.materials}
    assert len(colours) == 3


def test_squares_follow_a_slope(example, scene):
    targets = example.site.targets
    slope = targets.xyz.copy()
    slope[:, 2] = 0.1 * slope[:, 0]
    site = type(example.site)(**{**vars(example.site), "targets": type(targets)(**{**vars(targets), "xyz": slope})})
    write_result(scene, site, example.deployment)
    corners = np.array([v.co for v in coverage(scene).data.vertices])
    inner = np.abs(corners[:, 0]) < 50
    assert np.allclose(corners[inner, 2], 0.1 * corners[inner, 0] + LIFT, atol=0.11)
    assert np.median(np.abs(corners[inner, 2] - 0.1 * corners[inner, 0] - LIFT)) < 1e-4


def test_the_users_objects_are_left_alone(example, scene):
    extra = bpy.data.objects.new("a note of mine", None)
    contract.find_or_make(scene, contract.SENSORS).objects.link(extra)
    users = list(scene.objects)
    before = fingerprint(users)
    write_result(scene, example.site, example.deployment)
    write_result(scene, example.site, example.deployment)
    assert fingerprint(users) == before


def test_a_second_result_replaces_the_first(example, scene):
    def counts():
        return [len(data) for data in (bpy.data.objects, bpy.data.meshes, bpy.data.materials, bpy.data.collections)]

    write_result(scene, example.site, example.deployment)
    first, names = counts(), sorted(obj.name for obj in bpy.data.objects)
    write_result(scene, example.site, example.deployment)
    assert counts() == first
    assert sorted(obj.name for obj in bpy.data.objects) == names
    write_result(scene, example.site, deploy(example.site, example.models, example.visible[[5]], [5]))
    assert len(empties(scene)) == 1
    clear_result(scene)
    assert not contract.find(scene, contract.SENSORS).objects


def test_the_result_survives_saving_and_opening(example, scene, tmp_path):
    write_result(scene, example.site, example.deployment)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "placed.blend"), check_existing=False)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "placed.blend"))
    scene = bpy.context.scene
    assert [empty["seip_label"] for empty in empties(scene)] == ["S1", "S2", "S3"]
    assert coverage(scene)["seip_coverage"] == example.deployment.coverage
    assert len(coverage(scene).data.attributes["seip_seen"].data) == len(example.site.targets)


def save_rendered_view(path, scene, site, deployment):
    """Render and label the view as `write_result_folder` does."""
    with TemporaryDirectory() as folder:
        taken = rendered_pictures(scene, site, deployment, Path(folder))
        labelled_view.save_labelled_view(path, taken.view, site, deployment, shown_legend(scene), taken.sight)


def test_the_rendered_view_changes_nothing_in_the_file(example, scene, tmp_path, capfd, monkeypatch):
    monkeypatch.setattr("seip_addon.scene.render.SAMPLES", 1)
    monkeypatch.setattr("seip_addon.scene.render.WIDTH", 480)
    monkeypatch.setattr("seip_addon.scene.render.HEIGHT", 270)
    monkeypatch.setattr("seip_addon.scene.render.TILE", (64, 48))
    write_result(scene, example.site, example.deployment)
    bpy.context.view_layer.update()
    everything = [bpy.data.objects, bpy.data.meshes, bpy.data.scenes, bpy.data.worlds, bpy.data.cameras]
    everything += [bpy.data.lights, bpy.data.images, bpy.data.collections]
    counts, users, kept = [len(data) for data in everything], fingerprint(scene.objects), settings_of(scene)
    for name in ("a.png", "b.png"):
        save_rendered_view(tmp_path / name, scene, example.site, example.deployment)
    assert [len(data) for data in everything] == counts
    assert fingerprint(scene.objects) == users
    assert settings_of(scene) == kept
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.png", "b.png"]
    assert "Fra:" not in capfd.readouterr().out


def test_the_rendered_view_shows_traffic_where_it_is_now(example, scene, tmp_path, monkeypatch):
    pictures = []
    monkeypatch.setattr("seip_addon.scene.render.SAMPLES", 1)
    monkeypatch.setattr("seip_addon.scene.render.WIDTH", 160)
    monkeypatch.setattr("seip_addon.scene.render.HEIGHT", 90)
    monkeypatch.setattr("seip_addon.scene.render.TILE", (64, 48))
    monkeypatch.setattr(
        "seip_addon.core.output.pictures.labelled_view.save_labelled_view",
        lambda *given: pictures.append(plt.imread(given[1])),
    )
    write_result(scene, example.site, example.deployment)
    for begin, end in ((-24.0, 24.0), (6.0, 6.0), (-24.0, -24.0)):  # driving, and parked where it is now and where not
        truck = RoadUser("truck", "truck", 16.5, 2.55, 4.0)
        way, still = np.array(((begin, 0.0, 0.0), (end, 0.0, 0.0))), np.zeros(2)
        times = np.array((0.0, 2.0))
        origin = example.geometry.origin
        animate(scene, Trajectories((truck,), origin, np.array((0, 2)), times, way, still, still, still))
        scene.frame_set(30)
        save_rendered_view(tmp_path / "view.png", scene, example.site, example.deployment)
    driving, here, elsewhere = pictures
    assert np.array_equal(driving, here)
    assert not np.array_equal(driving, elsewhere)


def test_a_sensor_behind_a_building_is_marked_as_hidden(example, scene, tmp_path, monkeypatch):
    seen = {}
    monkeypatch.setattr("seip_addon.scene.render.SAMPLES", 1)
    monkeypatch.setattr("seip_addon.scene.render.WIDTH", 64)
    monkeypatch.setattr("seip_addon.scene.render.HEIGHT", 36)
    monkeypatch.setattr("seip_addon.scene.render.TILE", (64, 48))
    monkeypatch.setattr(
        "seip_addon.core.output.pictures.labelled_view.save_labelled_view", lambda *given: seen.update(sight=given[-1])
    )
    names = example.site.candidates.position_name[example.site.candidates.position_of].tolist()
    position = example.site.candidates.position
    clear = int(np.argmin(np.hypot(*(position[:, :2] - (47.0, 9.0)).T)))  # open to the south
    shaded = int(np.argmin(np.hypot(*(position[:, :2] - (-13.0, -9.0)).T)))  # north of a building
    poses = [names.index(example.site.candidates.position_name[place]) for place in (clear, shaded)]
    deployment = deploy(example.site, example.models, example.visible[poses], poses)
    write_result(scene, example.site, deployment)
    save_rendered_view(tmp_path / "view.png", scene, example.site, deployment)
    hidden = dict(zip([sensor.pose for sensor in deployment.sensors], seen["sight"].hidden.tolist(), strict=True))
    assert hidden == {poses[0]: False, poses[1]: True}


def test_each_sensor_has_a_close_up_that_shows_it(example, scene, tmp_path, monkeypatch):
    monkeypatch.setattr("seip_addon.scene.render.SAMPLES", 1)
    monkeypatch.setattr("seip_addon.scene.render.WIDTH", 64)
    monkeypatch.setattr("seip_addon.scene.render.HEIGHT", 36)
    monkeypatch.setattr("seip_addon.scene.render.TILE", (64, 48))
    write_result(scene, example.site, example.deployment)
    kept, objects = settings_of(scene), len(bpy.data.objects)
    taken = rendered_pictures(scene, example.site, example.deployment, tmp_path)
    assert [picture.size for picture in taken.close_ups] == [(64, 48)] * 3
    assert list(taken.places) == ["S1", "S2", "S3"]
    assert all(0.05 < share < 0.95 for place in taken.places.values() for share in place)
    assert len({picture.tobytes() for picture in taken.close_ups}) == 3
    assert (settings_of(scene), len(bpy.data.objects)) == (kept, objects)


def colours_of(obj):
    """Return the colour of each square by its material, and that of its first corner by the attribute."""
    mesh = obj.data
    material = np.array([mesh.materials[face.material_index].diffuse_color for face in mesh.polygons])
    corner = np.empty(len(mesh.loops) * 4, dtype=np.float32)
    mesh.color_attributes["seip_colour"].data.foreach_get("color", corner)
    return material, corner.reshape(-1, 4, 4)[:, 0]


@pytest.mark.parametrize("aspect", ["seen", "times", "weights"])
def test_coverage_is_recoloured_from_the_mesh_alone(example, scene, aspect):
    write_result(scene, example.site, example.deployment)
    colour_coverage(scene, aspect)
    obj = coverage(scene)
    expected = colouring(aspect, example.deployment.seen_by, example.site.targets.weight)
    wanted = np.array([linear(colour) for colour in expected.colours])[expected.of]
    for shown in colours_of(obj):
        assert np.allclose(shown, wanted, atol=1e-6)
    assert list(obj["seip_classes"]) == list(expected.words)
    assert np.allclose(obj["seip_shares"], expected.shares)
    assert obj["seip_aspect"] == aspect


def test_a_placement_by_returns_is_shown_by_those_first(example, scene):
    returns = np.linspace(0.0, 40.0, len(example.site.targets))
    by_returns = replace(example.deployment, pedestrian_returns=returns)
    write_result(scene, example.site, by_returns)
    obj, shown = coverage(scene), of_placement(by_returns)
    assert (obj["seip_aspect"], shown_legend(scene).title) == ("returns", "Returns from a pedestrian on the road")
    assert np.allclose(colours_of(obj)[0], np.array([linear(colour) for colour in shown.colours])[shown.of])
    show_seen_by(scene, example.deployment.seen_by)
    assert obj["seip_aspect"] == "returns"
    show_seen_by(scene, example.deployment.seen_by, moved=True)  # their returns are not known
    assert obj["seip_aspect"] == "times"
    colour_coverage(scene, "returns")
    assert list(obj["seip_classes"]) == list(shown.words)
    write_result(scene, example.site, example.deployment)
    assert coverage(scene)["seip_aspect"] == "times"
    with pytest.raises(SeipError, match="was not chosen for returns from road users"):
        colour_coverage(scene, "returns")


def test_the_rendered_view_explains_the_colours_that_are_shown(example, scene, tmp_path, monkeypatch):
    legends = []
    monkeypatch.setattr("seip_addon.scene.render.WIDTH", 64)
    monkeypatch.setattr("seip_addon.scene.render.HEIGHT", 36)
    monkeypatch.setattr("seip_addon.scene.render.TILE", (64, 48))
    monkeypatch.setattr(
        "seip_addon.core.output.pictures.labelled_view.save_labelled_view", lambda *given: legends.append(given[-2])
    )
    returns = np.full(len(example.site.targets), 7.0)
    for deployment in (example.deployment, replace(example.deployment, pedestrian_returns=returns)):
        write_result(scene, example.site, deployment)
        save_rendered_view(tmp_path / "view.png", scene, example.site, deployment)
        shown = of_placement(deployment)
        assert (legends[-1].words, legends[-1].colours) == (shown.words, shown.colours)
        assert legends[-1].shares == pytest.approx(shown.shares)


def test_one_name_in_two_colours_is_two_materials(example, scene):
    write_result(scene, example.site, example.deployment)
    half = np.arange(len(example.site.targets)) % 2
    recolour(scene, Colouring(("not seen", "else"), ("#000000", "#ffffff"), half))
    assert np.allclose(colours_of(coverage(scene))[0][half == 0], (0, 0, 0, 1))
    colour_coverage(scene, "seen")
    colour_coverage(scene, "times")
    assert len([one for one in bpy.data.materials if one.name.startswith("SEIP not seen")]) == 2


def test_colours_of_other_targets_have_their_sentence(example, scene):
    with pytest.raises(SeipError, match="shows no coverage"):
        colour_coverage(scene, "seen")
    write_result(scene, example.site, example.deployment)
    with pytest.raises(SeipError, match="other targets"):
        recolour(scene, Colouring(("all",), ("#000000",), np.zeros(3, dtype=np.int64)))
