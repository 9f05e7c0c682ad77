"""Sensors read back from the scene, where a result or a hand put them."""

import math
from dataclasses import replace

import bpy
import numpy as np
import pytest
from mathutils import Vector

from seip_addon.core.base.errors import SeipError
from seip_addon.core.geometry.orientation import orientation, rotated
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.site.scene_geometry import DEFAULT_REFLECTIVITY
from seip_addon.scene import contract
from seip_addon.scene.materials import REFLECTIVITY, material
from seip_addon.scene.read import read_scene
from seip_addon.scene.sensors import changed_beams, labelled_sensors, read_sensors
from seip_addon.scene.write import write_result
from tests.builders.scene_by_hand import make_scene
from tests.oracles.full_scan import beam_directions

CATALOGUE = load_catalogue()


@pytest.fixture
def scene(example):
    scene = make_scene(example.geometry)
    write_result(scene, example.site, example.deployment)
    return scene


def empties(scene):
    return [obj for obj in contract.find(scene, contract.SENSORS).objects if obj.type == "EMPTY"]


@pytest.fixture
def tilted(example):
    """A deployment that looks about itself, nose down by different angles."""
    sensors = tuple(
        replace(sensor, yaw=0.7 * number - 1.0, tilt=math.radians(8 + 9 * number))
        for number, sensor in enumerate(example.deployment.sensors)
    )
    return replace(example.deployment, sensors=sensors)


def test_tilted_sensors_are_read_as_they_were_written_and_their_rays_go_where_the_empties_point(scene, example, tilted):
    write_result(scene, example.site, tilted)
    for read, written in zip(read_sensors(scene, CATALOGUE), tilted.sensors, strict=True):
        np.testing.assert_allclose(read.orientation, written.orientation, atol=1e-6)
        obj = next(obj for obj in empties(scene) if obj["seip_label"] == written.label)
        assert obj["seip_tilt_deg"] == pytest.approx(math.degrees(written.tilt))
        assert obj.name.startswith(f"{written.model.key} @ {written.height:.3g} m, tilted ")
        rays = beam_directions(written.model).reshape(-1, 3)[::997]
        pointed = np.array([obj.matrix_world.to_3x3() @ Vector(ray) for ray in rays])
        np.testing.assert_allclose(rotated(rays, written.orientation), pointed, atol=1e-6)
        ahead = read.orientation[:, 0]
        assert -math.degrees(math.asin(ahead[2])) == pytest.approx(math.degrees(written.tilt), abs=1e-4)


def test_a_tilted_sensor_that_a_hand_moves_keeps_its_tilt(scene, example, tilted):
    write_result(scene, example.site, tilted)
    obj = empties(scene)[0]
    obj.location.x += 3.0
    obj.rotation_euler.z += 0.5
    read = next(sensor for sensor in read_sensors(scene, CATALOGUE) if sensor.label == obj["seip_label"])
    written = next(sensor for sensor in tilted.sensors if sensor.label == obj["seip_label"])
    np.testing.assert_allclose(read.orientation, orientation(written.yaw + 0.5, written.tilt), atol=1e-6)
    np.testing.assert_allclose(read.xyz, written.xyz + np.array((3.0, 0.0, 0.0)), atol=1e-5)


def test_sensors_whose_type_has_other_beams_now_are_named(scene):
    sensors = read_sensors(scene, CATALOGUE)
    assert changed_beams(scene, sensors) == ()
    first = sensors[0]
    turned = replace(first.model, azimuth_offsets=first.model.azimuth_offsets + 0.01)
    (warning,) = changed_beams(scene, [replace(first, model=turned), *sensors[1:]])
    assert warning.startswith(f"{first.label} was placed with other beams than {turned.key} has now")
    del labelled_sensors(scene)[first.label]["seip_beams"]  # as scenes of before have it
    assert changed_beams(scene, [replace(first, model=turned)]) == ()


def test_what_a_hand_has_done_counts(scene):
    obj = empties(scene)[0]
    parent = bpy.data.objects.new("mast", None)
    scene.collection.objects.link(parent)
    parent.location = (1.0, 2.0, 3.0)
    parent.rotation_euler = (0.0, 0.0, math.pi / 2)
    obj.parent = parent
    obj.location = (10.0, 0.0, 1.0)
    obj.rotation_euler = (0.0, math.radians(20), 0.0)
    obj.scale = (2.0, 0.5, 3.0)
    sensor = next(s for s in read_sensors(scene, CATALOGUE) if s.label == obj["seip_label"])
    np.testing.assert_allclose(sensor.xyz, (1.0, 12.0, 4.0), atol=1e-5)
    np.testing.assert_allclose(
        sensor.orientation[:, 0], (0.0, math.cos(math.radians(20)), -math.sin(math.radians(20))), atol=1e-6
    )


@pytest.mark.parametrize("key", [None, "type9"])
def test_a_type_that_nobody_knows_has_its_sentence(scene, key):
    obj = empties(scene)[0]
    if key is None:
        del obj["seip_sensor"]
    else:
        obj["seip_sensor"] = key
    with pytest.raises(SeipError, match="type9" if key == "type9" else "names no LiDAR"):
        read_sensors(scene, CATALOGUE)


def test_surfaces_reflect_as_their_materials_say(example):
    scene = make_scene(example.geometry)
    road = contract.find(scene, contract.ROADS).objects[0]
    building, tree = (contract.find(scene, contract.OCCLUDERS).objects[number] for number in (0, 5))
    road.data.materials.clear()
    road.data.materials.append(material("asphalt"))
    mirror = bpy.data.materials.new("mirror")
    mirror["seip_reflectivity"] = 0.01
    building.data.materials.append(mirror)
    building.data.polygons.foreach_set("material_index", [0, 1] * (len(building.data.polygons) // 2))
    geometry = read_scene(scene).geometry
    meshes = {mesh.name: mesh for mesh in (*geometry.roads, *geometry.occluders)}
    assert set(meshes[road.name].reflectivity) == {REFLECTIVITY["asphalt"]}
    assert set(meshes[tree.name].reflectivity) == {DEFAULT_REFLECTIVITY}
    assert sorted(meshes[building.name].reflectivity) == [0.01] * 6 + [DEFAULT_REFLECTIVITY] * 6
    assert all(len(mesh.reflectivity) == len(mesh.triangles) for mesh in meshes.values())


@pytest.mark.parametrize("share", [1.5, "bright"])
def test_a_reflectivity_that_is_none_has_its_sentence(example, share):
    scene = make_scene(example.geometry)
    contract.find(scene, contract.ROADS).objects[0].data.materials[0]["seip_reflectivity"] = share
    with pytest.raises(SeipError, match="seip_reflectivity of material"):
        read_scene(scene)
