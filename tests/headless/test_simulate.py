"""The command from a placed scene and traffic to frames, a picture and datasets."""

import json
import math
import subprocess
import sys
from pathlib import Path

from headless import simulate

import bpy
import numpy as np
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.sensing.scans.run_folder import load_frames
from seip_addon.core.sensing.traffic.trajectories import RoadUser, Trajectories
from seip_addon.scene import contract
from seip_addon.scene.blend_file import save_blend
from seip_addon.scene.traffic import animate
from seip_addon.scene.write import write_result
from tests.builders.scene_by_hand import make_scene
from tests.builders.small_junction import ORIGIN, make_example

ROOT = Path(__file__).resolve().parents[2]
QUICK = ["--duration", "0.4"]


def make_traffic(origin=ORIGIN) -> Trajectories:
    """Return a car that drives along +x and a truck that stands, in coordinates of the map."""
    times = np.arange(6) / 5
    drive = np.column_stack([-30 + 10 * times, np.full(6, -3.5), np.zeros(6)])
    stand = np.tile([20.0, 3.5, 0.0], (6, 1))
    return Trajectories(
        users=(RoadUser("car", "car", 4.5, 1.8, 1.5), RoadUser("truck", "truck", 9.0, 2.5, 3.5)),
        origin=np.zeros(3),
        first=np.array([0, 6, 12]),
        time=np.tile(times, 2),
        position=np.concatenate([drive, stand]) + origin,
        yaw=np.repeat([0.0, math.pi], 6),
        pitch=np.zeros(12),
        speed=np.repeat([10.0, 0.0], 6),
        source="by hand",
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("simulate")
    example = make_example()
    scene = make_scene(example.geometry)
    write_result(scene, example.site, example.deployment)
    save_blend(folder / "placed.blend")
    make_traffic().save(folder / "traffic.npz")
    return folder


@pytest.fixture(scope="module")
def run(folder):
    simulate.main([*arguments(folder, "run"), "--format", "pcd", "--split", "val"])
    return folder / "run"


def arguments(folder, name, *more):
    return [
        str(folder / "placed.blend"),
        "--traffic",
        str(folder / "traffic.npz"),
        "-o",
        str(folder / name),
        *QUICK,
        *more,
    ]


def contents(folder) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def test_a_run_has_frames_a_manifest_a_picture_and_a_dataset(run):
    record = json.loads((run / "manifest.json").read_text(encoding="utf-8"))
    assert [frame["time_s"] for frame in record["frames"]] == [0.0, 0.2, 0.4]
    assert record["trajectories"] == {"source": "by hand", "road_users": 2}
    assert {"seip", "python", "numpy", "blender"} <= set(record["versions"])
    assert (run / "frame.png").read_bytes().startswith(b"\x89PNG")
    assert list((run / "pcd").rglob("*.pcd"))
    frames = [frame for _, frame in load_frames(run)]
    assert [frame.labels.centre[0, 0] for frame in frames] == pytest.approx([-30, -28, -26], abs=1e-6)
    for frame in frames:
        assert frame.labels.category.tolist() == ["car", "truck"]
        assert frame.labels.inside.all()
        on_truck = frame.points[frame.instance == 1]
        assert len(on_truck) == frame.labels.points[1].sum() > 20
        assert (np.abs(on_truck - frame.labels.centre[1]) < frame.labels.size[1] / 2 + 0.3).all()


@pytest.mark.slow
def test_the_same_run_in_another_process_is_the_same_bytes(folder, run):
    command = [
        sys.executable,
        "-m",
        "headless.simulate",
        *arguments(folder, "again", "--format", "pcd", "--split", "val"),
    ]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True, stdin=subprocess.DEVNULL, timeout=120)  # noqa: S603  # our own module
    one, other = contents(run), contents(folder / "again")
    assert {name for name in one if name.startswith("frames/")} == {f"frames/00000{n}.npz" for n in range(3)}
    for name in ("manifest.json", "frame.png", *(name for name in one if name.startswith("frames/"))):
        assert one[name] == other[name], name


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (["--traffic", "no-such.npz"], "no-such.npz"),
        (["--start", "9"], "lasts from 0 s to 1 s"),
        (["--seed", "-3"], "--seed must be at least 0"),
        (["--rate", "50"], "rotates 5 times a second"),
    ],
)
def test_each_mistake_has_its_sentence(folder, change, words):
    with pytest.raises(SeipError, match=words):
        simulate.main(arguments(folder, "wrong", *change))


def test_a_scene_without_sensors_or_traffic_has_its_sentence(folder):
    bpy.ops.wm.open_mainfile(filepath=str(folder / "placed.blend"))
    for obj in list(contract.find(bpy.context.scene, contract.SENSORS).objects):
        bpy.data.objects.remove(obj)
    save_blend(folder / "bare.blend")
    with pytest.raises(SeipError, match="no sensors"):
        simulate.main(
            [str(folder / "bare.blend"), "--traffic", str(folder / "traffic.npz"), "-o", str(folder / "wrong")]
        )
    with pytest.raises(SeipError, match="no traffic"):
        simulate.main([str(folder / "placed.blend"), "-o", str(folder / "wrong")])


@pytest.mark.slow
def test_traffic_that_is_animated_in_the_scene_is_simulated(folder):
    bpy.ops.wm.open_mainfile(filepath=str(folder / "placed.blend"))
    animate(bpy.context.scene, make_traffic().moved_to(ORIGIN))
    save_blend(folder / "animated.blend")
    simulate.main([str(folder / "animated.blend"), "-o", str(folder / "animated"), *QUICK])
    frames = [frame for _, frame in load_frames(folder / "animated")]
    moved = [frame.labels.centre[frame.labels.category == "car"][0, 0] for frame in frames]
    assert np.diff(moved) == pytest.approx([2.0, 2.0], abs=0.01)
