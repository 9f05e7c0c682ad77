"""The command ``seip`` and the package that pip installs."""

import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

from headless.__main__ import VERBS
from headless.study import STUDIES

import pytest

ROOT = Path(__file__).resolve().parents[2]
OF_A_CHECKOUT = {"build_extension", "lock_wheels", "set_up"}
OF_OTHER_COMMANDS = {"finalists"}
"""Modules that a command starts in processes of their own."""


def project():
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def seip(*arguments):
    command = [sys.executable, "-m", "headless", *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)  # noqa: S603


def test_every_command_is_a_verb():
    files = {path.stem for path in (ROOT / "headless").glob("*.py") if "runtime.run(" in path.read_text("utf-8")}
    assert {verb.replace("-", "_") for verb in VERBS} == files - OF_A_CHECKOUT - OF_OTHER_COMMANDS - {"runtime"}


def test_there_are_eleven_verbs_at_most():
    assert len(VERBS) <= 11


def test_every_study_has_a_name_and_a_description():
    folders = {path.parent.name for path in (ROOT / "headless" / "studies").glob("*/command.py")}
    assert {name.replace("-", "_") for name in STUDIES} == folders
    readme = (ROOT / "headless" / "studies" / "README.md").read_text(encoding="utf-8")
    assert all(f"`{name}`" in readme for name in STUDIES)


def test_help_fits_a_screen():
    for arguments, names in (([], VERBS), (["study", "--help"], STUDIES)):
        shown = seip(*arguments)
        assert shown.returncode == 0
        lines = shown.stdout[shown.stdout.index("usage:") :].splitlines()  # bpy 5.2 writes its own log before them
        assert all(any(line.startswith(f"  {name} ") for line in lines) for name in names)
        assert len(lines) <= 24
        assert max(map(len, lines)) <= 80


def test_another_verb_has_its_sentence():
    shown = seip("palce")
    assert (shown.returncode, shown.stderr) == (
        1,
        "error: there is no command 'palce': seip --help lists the commands\n",
    )


def test_a_verb_runs_its_command_and_keeps_its_exit_status(tmp_path):
    shown = seip("place", str(tmp_path / "nothing.blend"), "-o", str(tmp_path / "out"))
    assert shown.returncode == 1
    assert shown.stderr.startswith("error: ")
    assert "nothing.blend" in shown.stderr


def test_what_pip_installs_is_what_is_pinned():
    """The dependencies of the package are among the pins, and none of what the code imports lacks."""
    written = project()
    pinned = {pin for group in written["dependency-groups"].values() for pin in group if isinstance(pin, str)}
    extras = written["project"]["optional-dependencies"]
    asked = {*written["project"]["dependencies"], *(pin for pins in extras.values() for pin in pins)}
    assert asked <= pinned
    assert {"bpy", "numpy", "PuLP", "shapely"} <= {pin.partition("=")[0] for pin in asked}
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))
    assert written["project"]["version"] == manifest["version"]


@pytest.mark.slow
def test_the_wheel_holds_the_program_and_its_data(tmp_path):
    for part in ("seip_addon", "headless", "pyproject.toml"):
        (tmp_path / part).symlink_to(ROOT / part)  # the build writes into none of them, but beside them
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", str(tmp_path / "out"), "."]
    subprocess.run(command, cwd=tmp_path, check=True)  # noqa: S603
    (wheel,) = (tmp_path / "out").glob("*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    assert "seip_addon/core/sensing/lidar/catalogue.toml" in names
    assert "seip_addon/core/sensing/traffic/body_meshes/pedestrian.obj" in names
    assert "headless/__main__.py" in names
    assert not [name for name in names if name.startswith(("tests", "scenes"))]
