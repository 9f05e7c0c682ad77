import bpy
import numpy as np
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.sensing.traffic.bodies import fitted_body
from seip_addon.core.sensing.traffic.trajectories import CATEGORIES, RoadUser, Trajectories
from seip_addon.scene import contract
from seip_addon.scene.traffic import animate, clear_traffic, read_traffic

ORIGIN = np.array((500_000.0, 5_700_000.0, 50.0))
SIZES = {
    "car": (4.5, 1.8, 1.5),
    "van": (5.9, 2.0, 2.6),
    "truck": (9.5, 2.5, 3.6),
    "bus": (12.0, 2.5, 3.2),
    "motorcycle": (2.2, 0.9, 1.5),
    "bicycle": (1.75, 0.65, 1.75),
    "pedestrian": (0.6, 0.55, 1.78),
}


@pytest.fixture
def scene():
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    scene[contract.ORIGIN] = ORIGIN.tolist()
    return scene


def traffic(seed=0, users=6, samples=30, step=0.2, start=0.0):
    """Road users that wander and turn, some later than others, on roads that rise and fall."""
    rng = np.random.default_rng(seed)
    first = np.arange(users + 1) * samples
    begin = start + rng.integers(0, 10, users) * step
    count = users * samples
    names = [CATEGORIES[number % len(CATEGORIES)] for number in range(users)]
    return Trajectories(
        users=tuple(RoadUser(f"u{number}", name, *SIZES[name], 0.3) for number, name in enumerate(names)),
        origin=ORIGIN.copy(),
        first=first,
        time=np.round(begin[:, None] + np.arange(samples) * step, 6).ravel(),
        position=np.cumsum(rng.normal(0, 7.0 * step, (count, 3)), axis=0),
        yaw=np.cumsum(rng.uniform(-7.0, 7.0, count)) * step + 20.0,
        pitch=rng.uniform(-0.2, 0.2, count),
        speed=rng.uniform(0, 15, count),
    )


def shown(scene, obj):
    """An object as the viewport shows it at the scene's frame, or None."""
    instances = scene.view_layers[0].depsgraph.object_instances
    return next((np.array(i.matrix_world) for i in instances if i.object.original == obj), None)


def check_frames(scene, trajectories, objects, frames, atol=2e-4):
    rate = scene.render.fps / scene.render.fps_base
    for frame in frames:
        scene.frame_set(frame)
        truth = trajectories.at(frame / rate)
        there = dict(zip(truth.user.tolist(), range(len(truth)), strict=True))
        for number, obj in enumerate(objects):
            matrix = shown(scene, obj)
            assert (matrix is not None) == (number in there)
            assert obj.hide_render == (number not in there)
            if matrix is not None:
                index = there[number]
                yaw, pitch = truth.yaw[index], truth.pitch[index]
                nose = (np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), np.sin(pitch))
                assert np.allclose(matrix[:3, 3], truth.position[index], atol=atol)
                assert np.allclose(matrix[:3, 0], nose, atol=atol)
                assert np.allclose(matrix[:3, 1], (-np.sin(yaw), np.cos(yaw), 0.0), atol=atol)  # no roll


@pytest.mark.parametrize(("fps", "base"), [(24, 1.0), (30, 1.001)])
def test_objects_are_where_the_trajectories_are_at_every_frame(scene, fps, base):
    scene.render.fps, scene.render.fps_base = fps, base
    trajectories = traffic()
    objects = animate(scene, trajectories)
    assert (scene.render.fps, scene.render.fps_base) == (fps, pytest.approx(base))
    last = trajectories.span[1] * fps / base
    assert scene.frame_start <= trajectories.span[0] * fps / base
    assert last - 1e-3 <= scene.frame_end < last + 1
    forth = list(range(scene.frame_end + 3))
    check_frames(scene, trajectories, objects, [*forth, *np.random.default_rng(0).permutation(forth).tolist()])


def test_objects_have_bodies_names_and_properties(scene):
    trajectories = traffic(users=7)
    objects = animate(scene, trajectories)
    assert [obj.name for obj in objects] == [user.name for user in trajectories.users]
    assert set(contract.find(scene, contract.TRAFFIC).objects) == set(objects)
    for obj, user in zip(objects, trajectories.users, strict=True):
        body = fitted_body(user)
        assert len(obj.data.polygons) == len(body)
        assert np.allclose(np.array(obj.dimensions), SIZES[user.category], atol=1e-5)
        faces = [[tuple(obj.data.vertices[v].co) for v in face.vertices] for face in obj.data.polygons]
        assert np.allclose(faces, body.triangles, atol=1e-5)
        slots = [obj.data.materials[face.material_index].name for face in obj.data.polygons]
        assert slots == [f"SEIP {name}" for name in body.material.tolist()]
        assert obj["seip_category"] == user.category
        assert obj["seip_paint"] == user.paint


def contents():
    kinds = ("objects", "meshes", "actions", "materials", "collections", "cameras", "lights", "worlds", "images")
    return {kind: sorted(data.name for data in getattr(bpy.data, kind)) for kind in kinds}


def test_a_second_call_replaces_the_first_and_clearing_leaves_nothing(scene):
    before = contents()
    animate(scene, traffic())
    first = contents()
    animate(scene, traffic())
    assert contents() == first
    animate(scene, traffic(users=2))
    assert len(contract.find(scene, contract.TRAFFIC).objects) == 2
    clear_traffic(scene)
    assert contents() == before
    clear_traffic(scene)


def animated_cube(scene, name="mine", size=(4.0, 2.0, 1.5), origin_up=0.75, **properties):
    """A user's own vehicle: a box around its origin that drives along a curve of keyframes."""
    x, y, z = np.array(size) / 2
    corners = [(sx * x, sy * y, sz * z) for sx in (-1, 1) for sy in (-1, 1) for sz in (-1, 1)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], faces)
    obj = bpy.data.objects.new(name, mesh)
    for frame, place, yaw in ((1, 0.0, 0.0), (11, 20.0, 0.4), (21, 30.0, 3.5)):
        obj.location, obj.rotation_euler = (place, -place / 2, origin_up), (0.0, 0.0, yaw)
        obj.keyframe_insert("location", frame=frame)
        obj.keyframe_insert("rotation_euler", frame=frame)
    for key, value in properties.items():
        obj[key] = value
    contract.find_or_make(scene, contract.TRAFFIC).objects.link(obj)
    return obj


def test_what_is_read_is_what_was_written(scene):
    scene.render.fps = 25
    trajectories = traffic(users=7, start=4.0)
    animate(scene, trajectories)
    read = finish(read_traffic(scene))
    assert [user.name for user in read.users] == [user.name for user in trajectories.users]
    for ours, theirs in zip(trajectories.users, read.users, strict=True):
        assert theirs == ours
    assert np.array_equal(read.origin, ORIGIN)
    for frame in range(scene.frame_start, scene.frame_end + 1, 5):  # every fifth is a sample
        ours, theirs = trajectories.at(round(frame * 0.04, 9)), read.at(frame / 25)
        assert ours.user.tolist() == theirs.user.tolist()
        assert np.allclose(ours.position, theirs.position, atol=2e-4)
        assert np.allclose(np.exp(1j * ours.yaw), np.exp(1j * theirs.yaw), atol=1e-4)
        assert np.allclose(ours.pitch, theirs.pitch, atol=1e-4)
    assert all(np.abs(np.diff(read.yaw[a:b])).max() <= np.pi for a, b in zip(read.first, read.first[1:], strict=False))


def test_children_instances_and_scale_make_the_box(scene):
    collection = contract.find_or_make(scene, contract.TRAFFIC)
    bed = animated_cube(scene, "bed", (6.0, 2.0, 1.0))
    cab = animated_cube(scene, "cab", (2.0, 2.0, 2.0))
    for part, place in ((bed, (-1.0, 0.0, 0.5)), (cab, (3.0, 0.0, 1.0))):
        part.animation_data_clear()
        part.location, part.rotation_euler = place, (0.0, 0.0, 0.0)
    rig = bpy.data.objects.new("rig", None)
    rig["seip_category"] = "truck"
    collection.objects.link(rig)
    bed.parent = cab.parent = rig
    rig.location, rig.scale = (10.0, 20.0, 1.0), (2.0, 2.0, 2.0)
    fleet = bpy.data.collections.new("fleet")
    fleet.objects.link(bpy.data.objects.new("copy", bed.data))
    instance = bpy.data.objects.new("instance", None)
    instance.instance_type, instance.instance_collection = "COLLECTION", fleet
    instance["seip_category"] = "bus"
    collection.objects.link(instance)
    scene.frame_start, scene.frame_end = 1, 2
    by_instance, by_rig = finish(read_traffic(scene)).users
    assert (by_instance.category, by_instance.length, by_instance.width, by_instance.height) == ("bus", 6.0, 2.0, 1.0)
    assert (by_rig.category, by_rig.length, by_rig.width, by_rig.height) == ("truck", 16.0, 4.0, 4.0)
    read = finish(read_traffic(scene))
    assert read.position[read.first[1]].tolist() == pytest.approx([10.0, 20.0, 1.0])


@pytest.mark.parametrize(
    ("prepare", "sentence"),
    [
        (lambda scene: None, "has no traffic: name a file of trajectories, or put animated vehicles"),
        (animated_cube, "object 'mine' in 'SEIP Traffic' has no custom property 'seip_category': set it to one of car"),
        (lambda scene: animated_cube(scene, seip_category="tank"), "has 'tank' as its custom property"),
        (
            lambda scene: setattr(animated_cube(scene, seip_category="car"), "hide_viewport", True),
            "no object in 'SEIP Traffic' is shown at any frame from 1 to 250",
        ),
    ],
)
def test_what_cannot_be_read_is_one_sentence(scene, prepare, sentence):
    prepare(scene)
    with pytest.raises(SeipError, match=sentence):
        finish(read_traffic(scene))
