"""Roles are links to the contract's collections and nothing else."""

import bpy
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.site.roles import Role
from seip_addon.scene import roles
from seip_addon.scene.read import read_scene


@pytest.fixture
def scene():
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    return bpy.context.scene


@pytest.fixture
def plate(scene):
    bpy.ops.mesh.primitive_plane_add(size=20)
    return bpy.context.object


@pytest.mark.parametrize("role", list(roles.ROLES))
def test_a_mesh_can_have_any_role_and_lose_it(scene, plate, role):
    assert roles.assign(scene, [plate], role) == 1
    assert roles.assign(scene, [plate], role) == 0
    assert roles.roles_of(scene, plate) == (role,)
    assert {c.name for c in plate.users_collection} == {scene.collection.name, roles.ROLES[role]}
    assert roles.take_out(scene, [plate], role) == 1
    assert roles.roles_of(scene, plate) == ()
    assert list(plate.users_collection) == [scene.collection]


def test_roles_add_up(scene, plate):
    roles.assign(scene, [plate], Role.GROUND)
    roles.assign(scene, [plate], Role.CANDIDATE_AREAS)
    assert set(roles.roles_of(scene, plate)) == {Role.GROUND, Role.CANDIDATE_AREAS}
    roles.take_out(scene, [plate], Role.GROUND)
    assert roles.roles_of(scene, plate) == (Role.CANDIDATE_AREAS,)


def test_a_light_is_nothing_and_an_empty_a_pole(scene):
    light = bpy.data.objects.new("light", bpy.data.lights.new("light", "POINT"))
    empty = bpy.data.objects.new("empty", None)
    for obj in (light, empty):
        scene.collection.objects.link(obj)
    with pytest.raises(SeipError, match="select meshes or empties"):
        roles.assign(scene, [light], Role.POLES)
    with pytest.raises(SeipError, match="instance a collection"):
        roles.assign(scene, [empty], Role.ROADS)
    assert roles.assign(scene, [light, empty], Role.POLES) == 1


def test_a_drawn_region_is_as_large_as_asked(scene, plate):
    roles.assign(scene, [plate], Role.ROADS)
    roles.add_area(scene, Role.REGION, (1.0, 2.0, 0.0), (20.0, 10.0))
    region = read_scene(scene).geometry.region
    assert region.area == pytest.approx(200.0)
    assert (region.centroid.x, region.centroid.y) == pytest.approx((1.0, 2.0), abs=1e-3)
