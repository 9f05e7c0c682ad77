"""Corrections of a scene: what is added, removed and moved, and what is left alone with a sentence."""

from dataclasses import replace

import bpy
import numpy as np
import pytest

from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.recordings.comparison import Change, RayComparison
from seip_addon.core.sensing.recordings.verification import CoverageSteps, Verification
from seip_addon.core.sensing.scans.sensor import MountedSensor
from seip_addon.core.site.scene_geometry import SceneGeometry
from seip_addon.core.workflows.verifying import box_triangles
from seip_addon.scene import contract
from seip_addon.scene.corrections import correct_scene
from seip_addon.scene.read import read_scene
from seip_addon.scene.sensors import read_sensors

BOX = np.array([3.0, -20.0, 1.5, 2.0, 1.0, 3.0, 0.4])
NONE = np.zeros(0, dtype=np.int64)


def cube(name, at, size=1.0, collection=contract.OCCLUDERS):
    """Add a cube by its middle."""
    mesh = bpy.data.meshes.new(name)
    corners = box_triangles(np.array([0.0, 0.0, 0.0, size, size, size, 0.0])).reshape(-1, 3)
    mesh.from_pydata(corners.tolist(), [], np.arange(len(corners)).reshape(-1, 3).tolist())
    obj = bpy.data.objects.new(name, mesh)
    obj.location = at
    if collection:
        contract.find_or_make(bpy.context.scene, collection).objects.link(obj)
    return obj


@pytest.fixture
def scene():
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    for name in (contract.REGION, contract.ROADS):
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata([(-10, -10, 0), (10, -10, 0), (10, 10, 0), (-10, 10, 0)], [], [(0, 1, 2, 3)])
        obj = bpy.data.objects.new(name, mesh)
        contract.find_or_make(bpy.context.scene, name).objects.link(obj)
    cube("Wall", (20, 0, 0.5))
    return bpy.context.scene


def verified(scene, gone=(), new=(), comparisons=(), keep=None):
    """Return a verification in which meshes are gone, except triangles that ``keep`` (of their middles) selects."""
    geometry: SceneGeometry = read_scene(scene).geometry
    occluders, changes = [], []
    for mesh in geometry.occluders:
        stays = np.full(len(mesh.triangles), mesh.name not in gone)
        if mesh.name in gone:
            changes.append(Change("gone", mesh.name, BOX, 50, np.arange(len(mesh.triangles))))
            stays |= keep(mesh.triangles.mean(axis=1)) if keep else False
        if stays.any():
            occluders.append(replace(mesh, triangles=mesh.triangles[stays], reflectivity=None))
    changes += [Change("new", name, box, 50, NONE) for name, box in new]
    return Verification(
        sensors=(),
        comparisons=tuple(comparisons),
        changes=tuple(changes),
        costs=(0.0,) * len(changes),
        coverage=CoverageSteps(0.5, 0.5, 0.5, 0.5, 0.5),
        corrected=replace(geometry, occluders=tuple(occluders)),
    )


def solids(scene):
    """Return the occluders of a scene, by name: rounded corners in order."""
    return {
        mesh.name: sorted(map(tuple, np.round(mesh.triangles, 4).reshape(-1, 9).tolist()))
        for mesh in read_scene(scene).geometry.occluders
    }


def test_a_second_correction_changes_nothing(scene):
    cube("Tower", (0, 20, 0.5))
    found = verified(scene, gone={"Tower"}, new=[("Found 1", BOX)])
    correct_scene(scene, found)
    once = solids(scene)
    assert set(once) == {"Wall", "Found 1"}
    assert not correct_scene(scene, found)
    assert solids(scene) == once
    assert len([obj for obj in bpy.data.objects if obj.name.startswith("Found")]) == 1


def _instance(scene, *objects):
    content = bpy.data.collections.new("Content")
    for obj in objects:
        content.objects.link(obj)
    instance = bpy.data.objects.new("Instance", None)
    instance.instance_type, instance.instance_collection = "COLLECTION", content
    instance.location = (0, 20, 0.5)
    contract.find_or_make(scene, contract.OCCLUDERS).objects.link(instance)
    return instance


def test_a_whole_instance_is_removed_and_its_collection_stays(scene):
    _instance(scene, cube("Inner", (0, 0, 0), collection=""))
    assert "Instance 1" in solids(scene)
    assert not correct_scene(scene, verified(scene, gone={"Instance 1"}))
    assert set(solids(scene)) == {"Wall"}
    assert "Inner" in bpy.data.collections["Content"].objects


def test_a_part_of_an_instance_stays_with_a_sentence(scene):
    _instance(scene, cube("A", (0, 0, 0), collection=""), cube("B", (5, 0, 0), collection=""))
    before = solids(scene)
    (sentence,) = correct_scene(scene, verified(scene, gone={"Instance 1"}))
    assert "a part of 'Instance' is no longer there" in sentence
    assert solids(scene) == before


def test_an_object_of_which_a_part_is_gone_stays_with_a_sentence(scene):
    cube("Row", (0, 20, 0.5))
    before = solids(scene)
    (sentence,) = correct_scene(scene, verified(scene, gone={"Row"}, keep=lambda middle: middle[:, 0] > 0))
    assert "a part of 'Row' is no longer there" in sentence
    assert solids(scene) == before


@pytest.mark.parametrize("mode", ["ZYX", "QUATERNION"])
def test_sensors_are_moved_whatever_their_parents_and_rotation_modes(scene, mode):
    model = load_catalogue()["type1"]
    mast = bpy.data.objects.new("Mast", None)
    mast.location, mast.rotation_euler = (1, 2, 3), (0.1, 0.2, 0.3)
    empty = bpy.data.objects.new("S1", None)
    empty["seip_sensor"], empty["seip_label"] = "type1", "S1"
    empty.rotation_mode, empty.parent = mode, mast
    scene.collection.objects.link(mast)
    contract.find_or_make(scene, contract.SENSORS).objects.link(empty)
    turn, _ = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))
    turn *= np.linalg.det(turn)
    sensor = MountedSensor("S1", model, np.array([4.0, 5.0, 6.0]), turn)
    compared = RayComparison(sensor, *(None for _ in range(7)))
    assert not correct_scene(scene, verified(scene, comparisons=[compared]))
    (read,) = read_sensors(scene, load_catalogue())
    assert np.allclose(read.xyz, sensor.xyz, atol=1e-5)
    assert np.allclose(read.orientation, turn, atol=1e-5)
    other = replace(compared, sensor=replace(sensor, label="S7"))
    assert "S7 is no longer in the scene" in correct_scene(scene, verified(scene, comparisons=[other]))[0]
