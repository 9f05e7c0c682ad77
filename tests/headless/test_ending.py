"""How the process of a command ends: exit status, signals while Blender writes, scenes with Python drivers."""

import signal
import subprocess
import sys

import pytest

bpy = pytest.importorskip("bpy")

PLACE = ["--count", "1", "--heights", "5.4", "--spacing", "12", "--grid", "6", "--sensor", "type1", "--no-render"]


SIGNALLED = """
import signal, sys
import bpy
import io_scene_gltf2
from headless import place, runtime

suffix, number = sys.argv[1], int(sys.argv[2])

def send(*_):
    signal.raise_signal(number)

def export(self, context):
    send()
    return written(self, context)

if suffix == ".blend":
    bpy.app.handlers.save_pre.append(bpy.app.handlers.persistent(send))
else:
    written, io_scene_gltf2.ExportGLTF2.execute = io_scene_gltf2.ExportGLTF2.execute, export
del sys.argv[1:3]
runtime.run(place.main)
"""


def run(*command):
    return subprocess.run(  # noqa: S603 -- our own commands
        [sys.executable, *map(str, command)], capture_output=True, text=True, timeout=120, check=False
    )


@pytest.mark.parametrize(
    ("number", "status", "suffix"), [(signal.SIGINT, 130, ".blend"), (signal.SIGTERM, 143, ".glb")]
)
def test_signals_while_blender_writes_end_the_command(small_scene, tmp_path, number, status, suffix):
    out = tmp_path / "out"
    done = run("-c", SIGNALLED, suffix, int(number), small_scene, *PLACE, "-o", out)
    assert done.returncode == status, done.stderr
    assert "Traceback" not in done.stderr
    assert {path.name for path in out.iterdir()} == {"visibility.npz"}


def test_commands_end_where_a_scene_has_python_drivers(small_scene, tmp_path):
    scene = tmp_path / "driven.blend"
    bpy.ops.wm.open_mainfile(filepath=str(small_scene))
    empty = bpy.data.objects.new("driven", None)
    bpy.context.scene.collection.objects.link(empty)
    empty.driver_add("location", 0).driver.expression = "max(frame, len('a'))"
    bpy.ops.wm.save_as_mainfile(filepath=str(scene))
    done = run("-m", "headless.place", scene, *PLACE, "-o", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert "written to" in done.stdout
    assert (tmp_path / "out" / "scene.glb").exists()
