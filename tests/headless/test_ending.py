"""How the process of a command ends: exit status, signals while Blender writes, scenes with Python drivers."""

import signal
import subprocess
import sys
import time

import pytest

pytest.importorskip("bpy")

PLACE = ["--count", "1", "--heights", "5.4", "--spacing", "12", "--grid", "6", "--sensor", "type1", "--no-render"]


def place(scene, out):
    return subprocess.Popen(  # noqa: S603 -- our own command
        [sys.executable, "-m", "headless.place", str(scene), *PLACE, "-o", str(out)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
@pytest.mark.parametrize("suffix", [".blend", ".glb"])
def test_signals_while_blender_writes_end_the_command(small_scene, tmp_path, number, status, suffix):
    out = tmp_path / "out"
    process = place(small_scene, out)
    while process.poll() is None and not [*out.glob(f"*{suffix}"), *out.glob(f".*{suffix}")]:
        time.sleep(0.002)
    process.send_signal(number)
    _, err = process.communicate(timeout=60)
    assert process.returncode == status
    assert "Traceback" not in err
    assert {path.name for path in out.iterdir()} <= {"visibility.npz"}


def test_commands_end_where_a_scene_has_python_drivers(small_scene, tmp_path):
    scene = tmp_path / "driven.blend"
    script = (
        "import bpy, os\n"
        f"bpy.ops.wm.open_mainfile(filepath={str(small_scene)!r})\n"
        "empty = bpy.data.objects.new('driven', None)\n"
        "bpy.context.scene.collection.objects.link(empty)\n"
        "empty.driver_add('location', 0).driver.expression = 'max(frame, len(\"a\"))'\n"
        f"bpy.ops.wm.save_as_mainfile(filepath={str(scene)!r})\n"
        "os._exit(0)\n"
    )
    subprocess.run([sys.executable, "-c", script], check=True, capture_output=True)  # noqa: S603 -- as above
    process = place(scene, tmp_path / "out")
    out, err = process.communicate(timeout=60)
    assert process.returncode == 0, err
    assert "written to" in out
    assert (tmp_path / "out" / "scene.glb").exists()
