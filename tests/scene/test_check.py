"""The check goes on where a survey's reading stops, and names each culprit."""

import bpy
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.site.candidates import CandidateSettings
from seip_addon.core.site.check import check_site
from seip_addon.core.site.site import make_site
from seip_addon.scene import contract
from seip_addon.scene.check import contents_of
from seip_addon.scene.read import read_scene


@pytest.fixture
def scene():
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    sheet(scene, "region", contract.REGION, 40, 5)
    sheet(scene, "road", contract.ROADS, 60, 7)
    sheet(scene, "pavement", contract.CANDIDATE_AREAS, 60, 2, (0, 10, 0))
    contract.find_or_make(scene, contract.GROUND).objects.link(bpy.data.objects["pavement"])
    return scene


def sheet(scene, name, where, half_x, half_y, at=(0, 0, 0)):
    mesh = bpy.data.meshes.new(name)
    corners = [(-half_x, -half_y, 0), (half_x, -half_y, 0), (half_x, half_y, 0), (-half_x, half_y, 0)]
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    return put(scene, bpy.data.objects.new(name, mesh), where, at)


def put(scene, obj, where, at=(0, 0, 0)):
    obj.location = at
    collection = scene.collection if where is None else contract.find_or_make(scene, where)
    collection.objects.link(obj)
    return obj


def cube(scene, name, where, at, side):
    bpy.ops.mesh.primitive_cube_add(size=side, location=at)
    obj = bpy.context.object
    obj.name = name
    scene.collection.objects.unlink(obj)
    return put(scene, obj, where, at)


def lay_out(geometry):
    return make_site(geometry, CandidateSettings(), 2.0), ()


def problems(scene):
    return [(p.severity, p.obj, p.text) for p in finish(check_site(contents_of(scene), lay_out)).problems]


def only(scene):
    (problem,) = problems(scene)
    return problem


def test_a_sound_scene_has_no_problem_and_is_laid_out(scene):
    checked = finish(check_site(contents_of(scene), lay_out))
    assert checked.problems == ()
    site = make_site(read_scene(scene).geometry, CandidateSettings(), 2.0)
    assert checked.counts["Targets"].startswith(f"{len(site.targets):,},")
    assert checked.counts["Poses"] == f"{len(site.candidates):,}"


def test_all_faults_are_listed_where_reading_stops_at_the_first(scene):
    broken = sheet(scene, "broken", contract.OCCLUDERS, 1, 1, (0, 20, 0))
    broken.data.vertices[0].co.x = float("nan")
    sheet(scene, "flat", contract.OCCLUDERS, 0, 0, (0, 20, 0))
    put(scene, bpy.data.objects.new("bare", bpy.data.meshes.new("bare")), contract.GROUND)
    weighted = sheet(scene, "weighted", contract.WEIGHTED_REGIONS, 3, 3)
    weighted["seip_weight"] = "heavy"
    found = problems(scene)
    assert {(severity, obj) for severity, obj, _ in found} == {
        ("ERROR", name) for name in ("broken", "flat", "bare", "weighted")
    }
    with pytest.raises(SeipError):
        read_scene(scene)


def test_a_large_object_without_a_role(scene):
    house = cube(scene, "house", None, (0, 30, 5), 10)
    cube(scene, "far away", None, (0, 900, 5), 10)
    cube(scene, "small", None, (0, 20, 0), 1)
    assert only(scene)[:2] == ("WARNING", "house")
    contract.find_or_make(scene, contract.OCCLUDERS).objects.link(house)
    assert problems(scene) == []
