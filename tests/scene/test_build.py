"""The scene that is built keeps the scene contract and says the same as the model."""

import bpy
import numpy as np
import pytest
import shapely

from seip_addon.core.base.progress import finish
from seip_addon.core.geometry.geo_reference import GeoReference
from seip_addon.core.geometry.solids import block
from seip_addon.core.site.roles import Role
from seip_addon.core.site.scene_geometry import ASSUMED, NamedArea
from seip_addon.core.world.streetscape.model import SiteModel
from seip_addon.core.world.streetscape.parts import Part
from seip_addon.core.world.streetscape.street_furniture import tree
from seip_addon.scene import contract
from seip_addon.scene.blend_file import new_file
from seip_addon.scene.build import COLLECTIONS, build_scene
from seip_addon.scene.pieces import loose_pieces
from seip_addon.scene.read import read_scene

SQUARE = np.array([[0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0]], dtype=float)
ORIGIN = np.array([5_412_345.0, -4_987_654.0, 312.0])


@pytest.fixture
def model():
    slab = block(SQUARE, np.full(4, 0.1), side="asphalt")
    parts = (
        Part("Road", slab, (Role.ROADS,)),
        Part("Pavement", slab, (Role.GROUND, Role.CANDIDATE_AREAS)),
        Part("Region", slab, (Role.REGION,)),
        Part("Middle", slab, (Role.WEIGHTED_REGIONS,), weight=3.0),
        Part("Tree 1", tree(8, 5, 0), (Role.OCCLUDERS,), (3.0, 4.0, 0.5), 0.7),
        Part("Tree 2", tree(8, 5, 0), (Role.OCCLUDERS,), (6.0, 4.0, 0.5), 0.9),
        Part("House", slab, (Role.OCCLUDERS,), (20.0, 5.0, 1.0), 0.4),
        Part("Panes", slab, (Role.DRESSING,), (20.5, 5.0, 1.0), 0.4, of="House"),
        Part("Signal pole 1", slab, (Role.POLES,), (11.0, 5.0, 0.0), source=ASSUMED),
        Part("Driveway", slab, (Role.FORBIDDEN_AREAS,), keep_off="driveways"),
    )
    return SiteModel(
        "A crossing with quite a long name, längs der Straße " * 3,
        ORIGIN,
        "EPSG:32632",
        np.arange(4.0),
        parts,
        shapely.box(0, 0, 10, 10),
        (),
        places=(NamedArea("Mill Lane", shapely.box(0, 0, 5, 5)),),
    )


def built(model):
    scene = new_file()
    finish(build_scene(scene, model, "map.xodr"))
    return scene


def test_a_scene_beside_others_leaves_them_alone(model):
    first = built(model)
    note = bpy.data.objects.new("a note of mine", None)
    first.collection.objects.link(note)
    before = sorted(obj.name for obj in first.objects)
    second = bpy.data.scenes.new("second")
    finish(build_scene(second, model, "map.xodr"))
    assert sorted(obj.name for obj in first.objects) == before
    assert not set(first.objects) & set(second.objects)
    assert len(second.objects) == len(before) - 1
    assert [len(read_scene(scene).geometry.roads) for scene in (first, second)] == [1, 1]


def test_each_part_is_in_the_collections_of_its_roles(model):
    scene = built(model)
    for part in model.parts:
        homes = {collection.name for collection in bpy.data.objects[part.name].users_collection}
        assert homes == {COLLECTIONS[role] for role in part.roles}
    assert {COLLECTIONS[role] for role in Role} <= {child.name for child in scene.collection.children}


def test_shapes_arrive_as_they_are(model):
    built(model)
    bpy.context.view_layer.update()
    for part in model.parts:
        obj = bpy.data.objects[part.name]
        vertices = np.array([vertex.co for vertex in obj.data.vertices])
        np.testing.assert_allclose(vertices, part.solid.vertices, atol=1e-5)
        assert [tuple(face.vertices) for face in obj.data.polygons] == list(part.solid.faces)
        assert tuple(obj.matrix_world.translation) == pytest.approx(part.foot)
        assert obj.rotation_euler.z == pytest.approx(part.yaw)
        used = [obj.data.materials[face.material_index].name for face in obj.data.polygons]
        assert used == [f"SEIP {name}" for name in part.solid.materials]


def test_the_scene_knows_where_it_is(model):
    scene = built(model)
    assert list(scene[contract.ORIGIN]) == ORIGIN.tolist()
    assert scene[contract.TITLE] == model.name
    assert scene[contract.MAP] == "map.xodr"
    assert list(scene[contract.HEADER_OFFSET]) == [0, 1, 2, 3]
    assert read_scene(scene).geometry.geo_reference == GeoReference("EPSG:32632", (0.0, 1.0, 2.0, 3.0))
    assert [place.name for place in read_scene(scene).geometry.places] == ["Mill Lane"]
    assert bpy.data.objects["Middle"][contract.WEIGHT] == 3.0
    assert (scene.unit_settings.system, scene.unit_settings.scale_length) == ("METRIC", 1.0)


def test_windows_are_loose_once_their_building_is_gone_and_not_when_they_are_taken_off(model):
    scene = built(model)
    house, panes = scene.objects["House"], scene.objects["Panes"]
    assert loose_pieces(scene.objects) == []
    panes.parent = None
    assert loose_pieces(scene.objects) == []
    panes.parent = house
    bpy.data.objects.remove(house)
    assert loose_pieces(scene.objects) == [panes]


def test_weights_and_what_keeps_new_posts_off_are_read_as_they_were_built(model):
    geometry = read_scene(built(model)).geometry
    assert [(area.name, area.rule) for area in geometry.keep_off_areas] == [("Driveway", "driveways")]
    assert geometry.forbidden_areas == ()
    assert [(area.name, area.weight) for area in geometry.weighted_regions] == [("Middle", 3.0)]
