"""What the bridge reads is what the viewport shows, and reading changes nothing."""

import hashlib

import bpy
import numpy as np
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
    sheet(scene, "region", (contract.REGION,), 40, 5)
    sheet(scene, "road", (contract.ROADS,), 60, 7)
    return scene


def collection(scene, name):
    found = contract.find(scene, name)
    return found or contract.find_or_make(scene, name)


def sheet(scene, name, where, half_x, half_y, at=(0, 0, 0)):
    mesh = bpy.data.meshes.new(name)
    corners = [(-half_x, -half_y, 0), (half_x, -half_y, 0), (half_x, half_y, 0), (-half_x, half_y, 0)]
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    return put(scene, bpy.data.objects.new(name, mesh), where, at)


def put(scene, item, where, at=(0, 0, 0)):
    item.location = at
    for name in where:
        collection(scene, name).objects.link(item)
    return item


def occluders(scene):
    return {mesh.name: mesh.triangles for mesh in read_scene(scene).geometry.occluders}


def test_region_road_and_origin_arrive_in_metres(scene):
    scene["seip_origin"] = [5.4e6, 0.125, 3.0]
    geometry = read_scene(scene).geometry
    assert geometry.region.area == pytest.approx(800)
    assert geometry.roads[0].triangles.shape == (2, 3, 3)
    assert geometry.roads[0].triangles.dtype == np.float64
    assert geometry.origin.tolist() == [5.4e6, 0.125, 3.0]


def test_modifiers_count(scene):
    wall = sheet(scene, "wall", (contract.OCCLUDERS,), 1, 1, (0, 20, 0))
    array = wall.modifiers.new("row", "ARRAY")
    array.count = 3
    triangles = occluders(scene)["wall"]
    assert len(triangles) == 6
    assert triangles[..., 0].max() == pytest.approx(5)


def test_parents_count(scene):
    parent = put(scene, bpy.data.objects.new("parent", None), (), (100, 0, 0))
    scene.collection.objects.link(parent)
    wall = sheet(scene, "wall", (contract.OCCLUDERS,), 1, 1, (0, 20, 0))
    wall.parent = parent
    assert occluders(scene)["wall"][..., 0].mean() == pytest.approx(100, abs=1)


def test_collection_instances_count_by_the_instancers_collection(scene):
    asset = bpy.data.collections.new("tree asset")
    leaf = bpy.data.objects.new("leaf", sheet(scene, "leaf", (), 1, 1).data)
    asset.objects.link(leaf)
    for x in (5, 15):
        instancer = bpy.data.objects.new("tree", None)
        instancer.instance_type, instancer.instance_collection = "COLLECTION", asset
        put(scene, instancer, (contract.OCCLUDERS,), (x, 20, 3))
    found = occluders(scene)
    assert sorted(found) == ["tree 1", "tree.001 1"]
    assert found["tree 1"][..., 0].mean() == pytest.approx(5, abs=0.5)


def test_geometry_nodes_instances_count(scene):
    host = sheet(scene, "host", (contract.OCCLUDERS,), 10, 10, (0, 40, 0))
    tree = bpy.data.node_groups.new("scatter", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    nodes = {kind: tree.nodes.new(kind) for kind in ("NodeGroupInput", "NodeGroupOutput")}
    instance = tree.nodes.new("GeometryNodeInstanceOnPoints")
    cube = tree.nodes.new("GeometryNodeMeshCube")
    tree.links.new(nodes["NodeGroupInput"].outputs[0], instance.inputs["Points"])
    tree.links.new(cube.outputs["Mesh"], instance.inputs["Instance"])
    tree.links.new(instance.outputs["Instances"], nodes["NodeGroupOutput"].inputs[0])
    host.modifiers.new("scatter", "NODES").node_group = tree
    found = occluders(scene)
    assert sum(len(triangles) for triangles in found.values()) == 4 * 12
    everything = np.concatenate(list(found.values()))
    assert everything[..., 0].min() == pytest.approx(-10.5)
    assert everything[..., 1].max() == pytest.approx(50.5)


def test_linked_collections_count(scene, tmp_path):
    library = tmp_path / "library.blend"
    sheet(scene, "linked wall", (contract.OCCLUDERS,), 1, 1, (0, 30, 0))
    bpy.data.libraries.write(str(library), {contract.find(scene, contract.OCCLUDERS)}, fake_user=True)
    bpy.data.objects.remove(bpy.data.objects["linked wall"])
    bpy.data.collections.remove(contract.find(scene, contract.OCCLUDERS))
    sheet(scene, "own wall", (contract.OCCLUDERS,), 1, 1, (0, 20, 0))
    with bpy.data.libraries.load(str(library), link=True) as (_source, target):
        target.collections = [contract.OCCLUDERS]
    scene.collection.children.link(target.collections[0])
    assert sorted(occluders(scene)) == ["linked wall", "own wall"]


def test_poles_stand_at_their_origins_and_their_faces_occlude(scene):
    post = sheet(scene, "post", (contract.POLES,), 0.1, 0.1, (3, 9, 0.1))
    post["seip_mandatory"] = True
    put(scene, bpy.data.objects.new("mark", None), (contract.POLES,), (8, 9, 0.1))
    geometry = read_scene(scene).geometry
    poles = {pole.name: pole for pole in geometry.poles}
    np.testing.assert_allclose(poles["post"].base, (3, 9, 0.1), atol=1e-6)
    assert poles["post"].mandatory
    assert not poles["mark"].mandatory
    assert [mesh.name for mesh in geometry.occluders] == ["post"]


def cylinder(scene, location, depth, rotation=(0, 0, 0)):
    """Blender's own, whose origin is in its middle."""
    bpy.ops.mesh.primitive_cylinder_add(radius=0.1, depth=depth, location=location, rotation=rotation)
    return put(scene, bpy.context.object, (contract.POLES,), location)


def test_the_foot_of_a_pole_is_its_lowest_point_where_its_origin_is_in_its_middle(scene):
    cylinder(scene, (3, 9, 3.1), 6.0)
    reading = read_scene(scene)
    (pole,) = reading.geometry.poles
    np.testing.assert_allclose(pole.base, (3, 9, 0.1), atol=1e-6)
    assert pole.height == pytest.approx(6.0)
    assert [sentence for sentence in reading.warnings if "'Cylinder' is not at the foot" in sentence]


def box(scene, name, where, low, high, at=(0, 0, 0)):
    mesh = bpy.data.meshes.new(name)
    corners = [(x, y, z) for z in (low[2], high[2]) for x, y in ((low[0], low[1]), (high[0], low[1]), high[:2])]
    mesh.from_pydata(corners, [], [(0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)])
    return put(scene, bpy.data.objects.new(name, mesh), where, at)


def test_a_pole_is_as_high_as_its_shaft(scene):
    post = box(scene, "post", (contract.POLES,), (-0.1, -0.1, -0.2), (0.1, 0.1, 6), (3, 9, 0.5))
    arm = box(scene, "arm", (), (1, -0.1, 6), (4, 0.1, 7.5))
    both = bpy.data.meshes.new("both")
    vertices = [tuple(v.co) for obj in (post, arm) for v in obj.data.vertices]
    faces = [tuple(i + 6 * n for i in face.vertices) for n, obj in enumerate((post, arm)) for face in obj.data.polygons]
    both.from_pydata(vertices, [], faces)
    post.data = both
    put(scene, bpy.data.objects.new("mark", None), (contract.POLES,), (8, 9, 0.1))
    heights = {pole.name: pole.height for pole in read_scene(scene).geometry.poles}
    assert heights["post"] == pytest.approx(6.0)
    assert heights["mark"] is None


def test_hidden_objects_do_not_count_and_are_reported(scene):
    sheet(scene, "ghost", (contract.OCCLUDERS,), 1, 1, (0, 20, 0)).hide_set(True)
    reading = read_scene(scene)
    assert reading.geometry.occluders == ()
    assert reading.warnings == ("1 hidden object in 'SEIP Occluders' did not count: show them if they should",)


def test_reading_changes_nothing(scene):
    sheet(scene, "wall", (contract.OCCLUDERS,), 1, 1, (0, 20, 0)).modifiers.new("row", "ARRAY")

    def state():
        text = []
        for item in bpy.data.objects:
            text.append(f"{item.name} {item.matrix_world} {[m.name for m in item.modifiers]} {item.hide_get()}")
            text.extend(str(tuple(vertex.co)) for vertex in item.data.vertices)
        text.append(f"{len(bpy.data.meshes)} {len(bpy.data.objects)} {len(bpy.data.collections)}")
        return hashlib.sha256("".join(text).encode()).hexdigest()

    bpy.context.view_layer.update()
    before = state()
    read_scene(scene)
    assert state() == before


@pytest.mark.parametrize(
    ("spoil", "sentence"),
    [
        (lambda s: bpy.data.objects.remove(bpy.data.objects["region"]), "has no region of interest"),
        (lambda s: bpy.data.objects.remove(bpy.data.objects["road"]), "has no road"),
        (lambda s: put(s, bpy.data.objects.new("bare", None), (contract.OCCLUDERS,)), "'bare' .* has no mesh"),
        (
            lambda s: setattr(sheet(s, "n", (contract.OCCLUDERS,), 1, 1).data.vertices[0], "co", (np.nan, 0, 0)),
            "'n' has a",
        ),
        (lambda s: s.__setitem__("seip_origin", [1.0, 2.0]), "seip_origin"),
        (lambda s: s.__setitem__("seip_places", '[["a", "POLYGON"]]'), "seip_places"),
        (
            lambda s: sheet(s, "w", (contract.WEIGHTED_REGIONS,), 1, 1).__setitem__("seip_weight", "high"),
            "seip_weight of object 'w' must be a number",
        ),
    ],
)
def test_each_fault_has_its_sentence(scene, spoil, sentence):
    spoil(scene)
    with pytest.raises(SeipError, match=sentence):
        read_scene(scene)


def test_a_missing_library_is_named(scene, tmp_path):
    library = tmp_path / "library.blend"
    sheet(scene, "linked wall", (contract.OCCLUDERS,), 1, 1, (0, 30, 0))
    bpy.data.libraries.write(str(library), {contract.find(scene, contract.OCCLUDERS)}, fake_user=True)
    bpy.data.objects.remove(bpy.data.objects["linked wall"])
    bpy.data.collections.remove(contract.find(scene, contract.OCCLUDERS))
    with bpy.data.libraries.load(str(library), link=True) as (_source, target):
        target.collections = [contract.OCCLUDERS]
    scene.collection.children.link(target.collections[0])
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "site.blend"))
    library.unlink()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "site.blend"))
    with pytest.raises(SeipError, match=r"is linked from .*library\.blend, which is not there"):
        read_scene(bpy.context.scene)


@pytest.fixture
def paved(scene):
    sheet(scene, "pavement", (contract.CANDIDATE_AREAS, contract.GROUND), 60, 2, (0, 10, 0))
    return scene


def cube(name, at, side):
    bpy.ops.mesh.primitive_cube_add(size=side, location=at)
    bpy.context.object.name = name
    return bpy.context.object


def lay_out(geometry):
    return make_site(geometry, CandidateSettings(), 2.0), ()


def problems(scene):
    return [(p.severity, p.obj, p.text) for p in finish(check_site(contents_of(scene), lay_out)).problems]


def only(scene):
    (problem,) = problems(scene)
    return problem


def test_a_sound_scene_has_no_problem_and_is_laid_out(paved):
    checked = finish(check_site(contents_of(paved), lay_out))
    assert checked.problems == ()
    site = make_site(read_scene(paved).geometry, CandidateSettings(), 2.0)
    assert checked.counts["Targets"].startswith(f"{len(site.targets):,},")
    assert checked.counts["Poses"] == f"{len(site.candidates):,}"


def test_all_faults_are_listed_where_reading_stops_at_the_first(paved):
    broken = sheet(paved, "broken", (contract.OCCLUDERS,), 1, 1, (0, 20, 0))
    broken.data.vertices[0].co.x = float("nan")
    sheet(paved, "flat", (contract.OCCLUDERS,), 0, 0, (0, 20, 0))
    put(paved, bpy.data.objects.new("bare", bpy.data.meshes.new("bare")), (contract.GROUND,))
    weighted = sheet(paved, "weighted", (contract.WEIGHTED_REGIONS,), 3, 3)
    weighted["seip_weight"] = "heavy"
    found = problems(paved)
    assert {(severity, obj) for severity, obj, _ in found} == {
        ("ERROR", name) for name in ("broken", "flat", "bare", "weighted")
    }
    with pytest.raises(SeipError):
        read_scene(paved)


def test_a_large_object_without_a_role(paved):
    house = cube("house", (0, 30, 5), 10)
    cube("far away", (0, 900, 5), 10)
    cube("small", (0, 20, 0), 1)
    assert only(paved)[:2] == ("WARNING", "house")
    contract.find_or_make(paved, contract.OCCLUDERS).objects.link(house)
    assert problems(paved) == []
