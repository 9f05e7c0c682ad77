"""How processes of commands end: status, signals while they load, write, render or survey, scenes with drivers."""

import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy")

JUNCTION = Path(__file__).parents[2] / "scenes" / "junction.blend"
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


LOADING = """
import signal, sys
from headless.__main__ import main

class Signals:
    def find_spec(self, name, *_):
        if name == module:
            signal.raise_signal(number)

module, number = sys.argv[1], int(sys.argv[2])
del sys.argv[1:3]
if signal.getsignal(number) is signal.SIG_IGN:  # as in a shell's background job, whose processes inherit it
    signal.signal(number, signal.default_int_handler)
sys.meta_path.insert(0, Signals())
main()
"""


def run(*command, temporary=None):
    return subprocess.run(  # noqa: S603 -- our own commands
        [sys.executable, *map(str, command)],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
        env=os.environ | ({} if temporary is None else {"TMPDIR": str(temporary)}),
    )


@contextmanager
def started(temporary, *command):
    """Start a command in a group of its own; end the group in any case."""
    process = subprocess.Popen(  # noqa: S603 -- our own commands
        [sys.executable, "-m", "headless", *map(str, command)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env=os.environ | {"TMPDIR": str(temporary)},
        start_new_session=True,
    )
    try:
        yield process
    finally:
        if is_there(process.pid):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def is_there(group):
    """Return whether any process of a group has not ended."""
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


def wait_for(condition, seconds):
    for _ in range(int(seconds / 0.05)):
        if condition():
            return True
        time.sleep(0.05)
    return False


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


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("module", ["numpy", "bl_ui", "matplotlib", "headless.options"])
def test_signals_while_a_command_loads_end_it_without_traces(small_scene, tmp_path, module, number):
    done = run("-c", LOADING, module, int(number), "place", small_scene, "-o", tmp_path / "out", temporary=tmp_path)
    assert done.returncode == 128 + number
    assert not done.stderr
    assert not list(tmp_path.iterdir())


def test_too_little_memory_is_one_sentence():
    done = run("-c", "import numpy as np\nfrom headless import runtime\nruntime.run(lambda _: np.ones(1 << 50))")
    assert done.returncode == 1
    assert done.stderr.startswith("error: there is not enough memory: choose")
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_that_a_library_turns_into_errors_of_its_own_end_the_command(number):
    script = (
        "import signal\nfrom headless import runtime\ndef main(_):\n"
        f"    try:\n        signal.raise_signal({int(number)})\n"
        "    except BaseException:\n        raise ValueError('Invalid bounding box') from None\n"  # as Matplotlib does
        "runtime.run(main)"
    )
    done = run("-c", script)
    assert (done.returncode, done.stderr) == (128 + number, "stopped\n")


def test_commands_under_nohup_go_on_without_their_terminal():
    hang_up = "signal.raise_signal(signal.SIGHUP)"
    script = (
        "import signal\nsignal.signal(signal.SIGHUP, signal.SIG_IGN)\n"
        f"from headless import process_end, runtime\nprocess_end.end_on_signals()\n{hang_up}\n"
        f"runtime.run(lambda _: {hang_up})"
    )
    assert run("-c", script).returncode == 0


def test_termination_while_the_other_blender_renders_leaves_nothing(small_scene, tmp_path):
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    with started(temporary, "place", small_scene, *PLACE[:-1], "-o", tmp_path / "out") as command:
        assert wait_for(lambda: any(b"Sample" in log.read_bytes() for log in temporary.glob("seip-*/log")), 60)
        command.terminate()
        assert command.wait() == 143
        assert not is_there(command.pid)
    assert not list(temporary.iterdir())
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"visibility.npz"}


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_processes_of_a_network_end_with_it_in_the_midst_of_a_survey(tmp_path, number):
    pytest.importorskip("distributed", reason="Dask is not installed: make environment")
    table = tmp_path / "sites.csv"
    table.write_text(f"source,latitude,longitude,name,weight\n{JUNCTION},54.3,7.4,North,1\n", encoding="utf-8")
    goal = ["--budget", "60_000", "--grid", "0.3", "--spacing", "1", "--workers", "2", "-o", tmp_path / "out"]
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    with started(temporary, "network", table, *goal) as command:
        assert wait_for((tmp_path / "out" / "north" / "site.blend").is_file, 120)  # minutes before its end
        command.send_signal(number)
        command.wait()
        assert wait_for(lambda: not is_there(command.pid), 20.0)  # a survey takes minutes; how soon is for benchmarks
    if number != signal.SIGKILL:
        assert command.returncode == 128 + number
        assert not list(temporary.iterdir())
