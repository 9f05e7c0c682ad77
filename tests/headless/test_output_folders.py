"""Folders of results: a command that ends in an error leaves none behind that it made and wrote nothing to."""

import runpy
import sys
from pathlib import Path

import pytest

pytest.importorskip("bpy")

from headless import runtime

JUNCTION = Path(__file__).resolve().parents[2] / "scenes" / "junction.blend"
NONE = "missing.blend"
COMMANDS = {
    "place": (),
    "study coverage": (),
    "simulate": ("--dataset", "data/set"),
    "study stability": ("--work", "work"),
    "study benchmark": ("--work", "work"),
}
TRAINERS = {
    "study detection": (),
    "detect": ("--traffic", "run.npz"),
    "study site-training": ("other.blend",),
}


def fails(monkeypatch, command, *arguments) -> str:
    """Run a command as from a shell, and return its exit status as text; it must be one of a failure."""
    command, *study = command.split()
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


@pytest.mark.parametrize("command", TRAINERS)
def test_a_missing_scene_leaves_no_folder_of_a_detector(command, tmp_path, monkeypatch, capsys):
    pytest.importorskip("torch", reason="torch is not installed")
    monkeypatch.chdir(tmp_path)
    assert fails(monkeypatch, command, NONE, *TRAINERS[command], "-o", "a/b") == "1"
    assert NONE in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_ctrl_c_leaves_no_folder(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)

    def stop(_scene):
        raise KeyboardInterrupt

    monkeypatch.setattr(runtime, "open_scene", stop)
    assert fails(monkeypatch, "place", NONE, "-o", "out") == "130"
    assert "no result written" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_what_cannot_be_had_on_a_scene_leaves_no_folder(tmp_path, monkeypatch, capsys):
    """The error comes after the scene is read and the site is laid out."""
    options = ["--grid", "8", "--spacing", "40", "--forbid", "nowhere"]
    assert fails(monkeypatch, "place", JUNCTION, "-o", tmp_path / "out", *options) == "1"
    assert "nowhere" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_was_there_stays_and_keeps_its_files(tmp_path, monkeypatch):
    (tmp_path / "empty").mkdir()
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine.txt").touch()
    for name in ("empty", "full", "full/new"):
        assert fails(monkeypatch, "place", tmp_path / NONE, "-o", tmp_path / name) == "1"
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["empty", "full", "mine.txt"]


def test_traffic_leaves_no_folder(tmp_path, monkeypatch, capsys):
    output = tmp_path / "new" / "run.npz"
    assert fails(monkeypatch, "traffic", JUNCTION, "--fcd", tmp_path / "missing.xml", "-o", output) == "1"
    assert "missing.xml" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("text", [None, "<OpenDRIVE/>"])
def test_build_scene_leaves_no_folder(text, tmp_path, monkeypatch, capsys):
    source = tmp_path / "map.xodr"
    if text is not None:
        source.write_text(text, encoding="utf-8")
    output = tmp_path / "new" / "site.blend"
    assert fails(monkeypatch, "build_scene", source, "--near", "0", "0", "-o", output) == "1"
    assert "map.xodr" in capsys.readouterr().err
    assert not output.parent.exists()


def test_report_makes_no_folder(tmp_path, monkeypatch, capsys):
    assert fails(monkeypatch, "report", tmp_path / "missing") == "1"
    assert "missing" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
