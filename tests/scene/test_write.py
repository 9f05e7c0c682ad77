import hashlib
from pathlib import Path
from tempfile import TemporaryDirectory

import bpy
import numpy as np
import pytest

from seip_addon.core.choosing.placement.deployment import deploy
from seip_addon.core.output.pictures import labelled_view
from seip_addon.core.output.pictures.palette import colouring
from seip_addon.core.output.pictures.viewpoint import Sight
from seip_addon.scene import contract
from seip_addon.scene.materials import linear
from seip_addon.scene.render import shot_of, take
from seip_addon.scene.write import LIFT, clear_result, colour_coverage, shown_legend, write_result
from tests.builders.scene_by_hand import make_scene


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


def save_rendered_view(path, scene, site, deployment):
    """Render and label the view as `write_result_folder` does."""
    with TemporaryDirectory() as folder:
        shot, raw = shot_of(site, deployment), Path(folder) / "raw.png"
        number, hidden = take(shot, scene, raw)
        view = shot.viewpoints[number]
        sight = Sight(view.project(shot.sensors), hidden, view.project(site.targets.xyz))
        labelled_view.save_labelled_view(path, raw, site, deployment, shown_legend(scene), sight)


def test_the_rendered_view_changes_nothing_in_the_file(example, scene, tmp_path, monkeypatch):
    monkeypatch.setattr("seip_addon.scene.render.SAMPLES", 1)
    monkeypatch.setattr("seip_addon.scene.render.WIDTH", 480)
    monkeypatch.setattr("seip_addon.scene.render.HEIGHT", 270)
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


def colours_of(obj):
    """Return the colour of each square by its material, and that of its first corner by the attribute."""
    mesh = obj.data
    material = np.array([mesh.materials[face.material_index].diffuse_color for face in mesh.polygons])
    corner = np.empty(len(mesh.loops) * 4, dtype=np.float32)
    mesh.color_attributes["seip_colour"].data.foreach_get("color", corner)
    return material, corner.reshape(-1, 4, 4)[:, 0]


def test_coverage_is_recoloured_from_the_mesh_alone(example, scene):
    write_result(scene, example.site, example.deployment)
    for aspect in ("seen", "times", "weights"):
        colour_coverage(scene, aspect)
        obj = coverage(scene)
        expected = colouring(aspect, example.deployment.seen_by, example.site.targets.weight)
        wanted = np.array([linear(colour) for colour in expected.colours])[expected.of]
        for shown in colours_of(obj):
            assert np.allclose(shown, wanted, atol=1e-6)
        assert list(obj["seip_classes"]) == list(expected.words)
        assert np.allclose(obj["seip_shares"], expected.shares)
        assert obj["seip_aspect"] == aspect


def test_the_view_is_from_a_side_without_towers(example, scene, tmp_path, monkeypatch):
    monkeypatch.setattr("seip_addon.scene.render.WIDTH", 48)
    monkeypatch.setattr("seip_addon.scene.render.HEIGHT", 27)
    shot = shot_of(example.site, example.deployment)
    middle = example.site.targets.xyz.mean(axis=0)
    nearest = shot.viewpoints[0].place - middle
    towards = nearest[:2] / np.hypot(*nearest[:2])
    # A wall beside the road that the nearest viewpoint would look at from behind.
    reach = np.abs((example.site.targets.xyz - middle)[:, :2] @ towards).max() + 5.0
    along = 200.0 * np.array((-towards[1], towards[0]))
    foot = middle[:2] + reach * towards
    corners = [(*(foot + side * along), z) for side, z in ((-1, -5.0), (1, -5.0), (1, 150.0), (-1, 150.0))]
    mesh = bpy.data.meshes.new("Tower")
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    open_air, _ = take(shot, scene, tmp_path / "open.png")
    scene.collection.objects.link(bpy.data.objects.new("Tower", mesh))
    bpy.context.view_layer.update()
    walled, _ = take(shot, scene, tmp_path / "walled.png")
    assert open_air == 0
    assert (shot.viewpoints[walled].place - middle)[:2] @ towards < 0.0
