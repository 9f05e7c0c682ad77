"""What is saved opens again, and looks right at once."""

import re
import signal
import subprocess
import sys
from pathlib import Path

import bpy
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.scene.blend_file import new_file, open_blend, save_blend
from seip_addon.scene.interrupts import held_signals

ROOT = Path(__file__).resolve().parents[2]


def test_scripts_in_a_file_do_not_run(tmp_path):
    """A text that Blender would register as a module, where files are trusted."""
    new_file()
    mark = tmp_path / "mark"
    text = bpy.data.texts.new("hostile.py")
    text.write(f"open({str(mark)!r}, 'w').close()\n")
    text.use_module = True
    save_blend(tmp_path / "site.blend")
    trusts = bpy.context.preferences.filepaths
    trusts.use_scripts_auto_execute, before = True, trusts.use_scripts_auto_execute
    try:
        open_blend(tmp_path / "site.blend")
    finally:
        trusts.use_scripts_auto_execute = before
    assert "hostile.py" in bpy.data.texts
    assert not mark.exists()


def test_a_disk_without_room_has_its_sentence_and_keeps_what_was_there(tmp_path):
    """A limit on the size of files stands for a full disk."""
    script = (
        "import resource, sys; from pathlib import Path\n"
        "import headless.runtime, bpy\n"
        "from seip_addon.core.base.errors import SeipError\n"
        "from seip_addon.scene.blend_file import new_file, save_blend\n"
        "new_file()\n"
        "mesh = bpy.data.meshes.new('much'); mesh.vertices.add(200_000)\n"
        "mesh.vertices.foreach_set('co', [i * .7919 % 1 for i in range(600_000)])\n"
        "bpy.context.scene.collection.objects.link(bpy.data.objects.new('much', mesh))\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, 50_000))\n"
        "try:\n    save_blend(Path(sys.argv[1]))\n"
        "except SeipError as error:\n    print(error)\n"
    )
    path = tmp_path / "site.blend"
    path.write_bytes(b"before")
    command = [sys.executable, "-c", script, str(path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=60, check=False)  # noqa: S603  # ours
    assert done.returncode == 0, done.stderr
    told = rf"^cannot write {re.escape(str(path))} (\(.+\)|to its end); make room there"
    assert re.search(told, done.stdout, re.MULTILINE)
    assert [entry.name for entry in tmp_path.iterdir()] == ["site.blend"]
    assert path.read_bytes() == b"before"


@pytest.mark.parametrize("content", [None, b"no blend"])
def test_what_is_no_blend_is_refused_by_name(tmp_path, content):
    path = tmp_path / "site.blend"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(SeipError, match=r"site\.blend"):
        open_blend(path)


@pytest.mark.parametrize("kind", ["scenes", "objects"])
def test_a_damaged_name_is_refused(tmp_path, kind):
    new_file()
    mesh = bpy.data.meshes.new("XXmeshesXX")
    thing = bpy.data.objects.new("XXobjectsXX", mesh)
    mesh.materials.append(bpy.data.materials.new("XXmaterialsXX"))
    collection = bpy.data.collections.new("XXcollectionsXX")
    collection.objects.link(thing)
    bpy.context.scene.collection.children.link(collection)
    bpy.context.scene.name = "XXscenesXX"
    path = tmp_path / "damaged.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True, compress=False)
    name = f"XX{kind}XX".encode()
    path.write_bytes(path.read_bytes().replace(name, b"\xd0" * len(name)))
    with pytest.raises(SeipError, match=f"damaged: among its {kind} is a name that is not UTF-8"):
        open_blend(path)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_are_delivered_when_the_block_ends(number):
    reached = []

    def held():
        with held_signals():
            signal.raise_signal(number)
            reached.append("the end")

    def stop(_number, _frame):
        raise SystemExit

    before = signal.signal(number, stop)
    try:
        with pytest.raises(SystemExit):
            held()
        assert signal.getsignal(number) is stop
    finally:
        signal.signal(number, before)
    assert reached
