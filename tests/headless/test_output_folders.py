"""Folders of results: a command that ends in an error leaves none behind that it made and wrote nothing to."""

import os
import runpy
import sys

import pytest

pytest.importorskip("bpy")

from headless import runtime

from seip_addon.core.storage.files import locked

NONE = "missing.blend"
COMMANDS = {
    "place": (),
    "simulate": ("--dataset", "data/set"),
    "study stability": ("--work", "work"),
}


def fails(monkeypatch, command, *arguments) -> str:
    """Run a command as from a shell, and return its exit status as text; it must be one of a failure."""
    command, *study = command.replace("-", "_").split()
    monkeypatch.setattr(sys, "argv", [f"{command}.py", *study, *map(str, arguments)])
    monkeypatch.setattr(runtime.signal, "signal", lambda *_: None)  # those of the tests stay
    monkeypatch.delitem(sys.modules, f"headless.{command}", raising=False)  # other tests may have imported it
    with pytest.raises(SystemExit) as end:
        runpy.run_module(f"headless.{command}", run_name="__main__")
    return str(end.value.code)


@pytest.mark.parametrize("command", COMMANDS)
def test_a_missing_scene_leaves_no_folder(command, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert fails(monkeypatch, command, NONE, "-o", "a/b", *COMMANDS[command]) == "1"
    assert NONE in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "command",
    [
        ("build-scene", "map.xodr", "-o", "a.blend"),
        ("traffic", NONE, "--simulate", "map.xodr", "-o", "a.blend"),
        ("traffic", NONE, "--simulate", "map.xodr", "-o", "a.npz", "--animate", "a.blend"),
    ],
)
def test_a_file_that_another_command_writes_is_refused(command, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    with locked(tmp_path / "a.blend", folder=False):
        assert fails(monkeypatch, *command) == "1"
    assert "another run is writing to a.blend" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_ctrl_c_leaves_no_folder(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)

    def stop(_scene):
        raise KeyboardInterrupt

    monkeypatch.setattr(runtime, "open_scene", stop)
    assert fails(monkeypatch, "place", NONE, "-o", "out") == "130"
    assert "no result written" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_was_there_stays_and_keeps_its_files(tmp_path, monkeypatch):
    (tmp_path / "empty").mkdir()
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine.txt").touch()
    for name in ("empty", "full", "full/new"):
        assert fails(monkeypatch, "place", tmp_path / NONE, "-o", tmp_path / name) == "1"
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["empty", "full", "mine.txt"]


@pytest.mark.skipif(os.sep == "\\", reason="a backslash is a separator there")
def test_a_folder_whose_name_blender_cannot_read_is_refused(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert fails(monkeypatch, "place", NONE, "-o", "back\\slash/out") == "1"
    assert "has a backslash in its path" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
