"""A system that lacks something is told what, and how to get it, before anything is downloaded."""

import os
import re
import subprocess
import sys
import tomllib
import zipfile
from importlib import metadata
from pathlib import Path

from headless import set_up, system_libraries

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[2]
GROUPS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["dependency-groups"]
PINS = [Requirement(pin) for name in ("extension", "blender", "test", "cluster", "lint") for pin in GROUPS[name]]
PINS_HERE = {canonicalize_name(pin.name): pin for pin in PINS if pin.marker is None or pin.marker.evaluate()}


@pytest.fixture
def complete_system(monkeypatch):
    monkeypatch.setattr(set_up, "missing_libraries", dict)
    monkeypatch.setattr(set_up.importlib.util, "find_spec", lambda _name: object())


@pytest.mark.usefixtures("complete_system")
@pytest.mark.parametrize("version", [(3, 10, 0), (3, 14, 0)])
def test_other_pythons_are_refused_in_one_sentence(monkeypatch, version):
    monkeypatch.setattr(sys, "version_info", version)
    complaint = set_up.what_is_missing()
    assert f"Python {version[0]}.{version[1]}," in complaint
    assert "make PYTHON=python3.13" in complaint
    assert "\n" not in complaint


def test_all_that_is_missing_comes_in_one_line(monkeypatch):
    monkeypatch.setattr(system_libraries, "_loads", lambda library: library not in {"libXi.so.6", "libEGL.so.1"})
    monkeypatch.setattr(set_up.importlib.util, "find_spec", lambda _name: None)
    assert set_up.what_is_missing() == (
        "this system lacks the module ensurepip, libEGL.so.1, libXi.so.6; "
        "install with: apt-get install --no-install-recommends python3-venv libegl1 libxi6"
    )
    monkeypatch.setattr(system_libraries, "_loads", lambda library: library != "libatomic.so.1")
    assert "libatomic.so.1; " in set_up.what_is_missing(sumo=True)


@pytest.mark.usefixtures("complete_system")
def test_a_finished_environment_is_left_alone(monkeypatch, tmp_path):
    installed = []
    monkeypatch.setattr(set_up, "install", installed.append)
    (tmp_path / "bin").mkdir()
    (tmp_path / "set-up").write_text("another Python's")
    assert set_up.main([str(tmp_path)]) is None
    assert set_up.main([str(tmp_path)]) is None
    assert installed == [tmp_path]


@pytest.mark.usefixtures("complete_system")
def test_a_folder_that_is_no_environment_is_never_cleared(tmp_path):
    treasure = tmp_path / "treasure.txt"
    treasure.write_text("mine")
    with pytest.raises(SystemExit, match="not a virtual environment"):
        set_up.main([str(tmp_path)])
    assert treasure.read_text() == "mine"


def test_the_environment_gets_the_command_seip(tmp_path):
    """It works from any folder, also where the path of the environment has a space."""
    python = tmp_path / "an environment" / "bin" / "python"
    python.parent.mkdir(parents=True)
    python.symlink_to(sys.executable)
    set_up.write_command(tmp_path / "an environment")
    command = [str(python.with_name("seip")), "--help"]
    shown = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)  # noqa: S603
    assert "build-scene" in shown.stdout


def test_every_pin_is_exact_and_stands_once():
    names = [canonicalize_name(pin.name) for pin in PINS if pin.name not in {"bpy", "numpy"}]
    assert len(names) == len(set(names))
    assert all(str(pin.specifier).startswith("==") for pin in PINS)
    assert "*" not in "".join(str(pin.specifier) for pin in PINS)


def test_what_the_pinned_packages_need_is_pinned_too():
    unpinned = {
        (name, need.name)
        for name in PINS_HERE
        for need in map(Requirement, metadata.requires(name) or [])
        if need.marker is None or need.marker.evaluate({"extra": ""})
        if canonicalize_name(need.name) not in PINS_HERE
    }
    assert not unpinned


def test_every_package_that_is_installed_has_its_digest():
    for group in ("installer", "development", "traffic", "detection", "second-opinion"):
        pins = [pin for pin in set_up.requirements(group) if pin.split("==")[0] not in set_up.UNLOCKED]
        lines = set_up.locked(pins)
        assert len(lines) == len(pins)
        for line in lines:
            assert re.search(r" --hash=sha256:[0-9a-f]{64}( |$)", line), line


def test_pip_refuses_another_package_of_the_same_name_and_version(tmp_path, monkeypatch):
    """A forged wheel, offered before all others."""
    name = "zict-3.0.0-py2.py3-none-any.whl"
    with zipfile.ZipFile(tmp_path / name, "w") as archive:
        archive.writestr("zict/__init__.py", "forged = True\n")
        archive.writestr("zict-3.0.0.dist-info/METADATA", "Metadata-Version: 2.1\nName: zict\nVersion: 3.0.0\n")
        archive.writestr("zict-3.0.0.dist-info/WHEEL", "Wheel-Version: 1.0\nTag: py3-none-any\n")
        archive.writestr("zict-3.0.0.dist-info/RECORD", "")
    (tmp_path / "requirements.txt").write_text("\n".join(set_up.locked(["zict==3.0.0"])))
    command = [sys.executable, "-m", "pip", "install", "--no-index", f"--find-links={tmp_path}", "--require-hashes"]
    environment = {key: value for key, value in os.environ.items() if not key.startswith("PIP_")}
    done = subprocess.run(  # noqa: S603  # pip, with our own file
        [*command, "--target", str(tmp_path / "there"), "-r", str(tmp_path / "requirements.txt")],
        env={**environment, "PIP_CONFIG_FILE": os.devnull},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode != 0
    assert "DO NOT MATCH THE HASHES" in done.stderr or "No matching distribution" in done.stderr
    assert not (tmp_path / "there" / "zict").exists()


def test_make_knows_every_target_of_its_help():
    text = subprocess.run(["make", "help"], cwd=ROOT, capture_output=True, text=True, check=True).stdout  # noqa: S607
    targets = [line.split()[1] for line in text.splitlines() if line.startswith("make ") and "=" not in line.split()[1]]
    assert {"demo", "test", "lint", "scenes", "study", "extension", "clean"} <= set(targets)
    for target in targets:
        subprocess.run(["make", "-n", target], cwd=ROOT, capture_output=True, check=True)  # noqa: S603, S607
