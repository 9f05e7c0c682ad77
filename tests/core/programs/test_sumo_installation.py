"""SUMO is installed by pip, whole or not at all, and found afterwards."""

import sys
import time
from pathlib import Path

import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.programs import sumo_programs
from seip_addon.core.programs.sumo_installation import SUMO_VERSION, install_sumo, installed_sumo
from seip_addon.core.programs.sumo_programs import Sumo, find_sumo, run, sumo_version
from tests.builders.sumo_wheel import write_programs, write_wheel

PIP = (sys.executable, "-m", "pip")


@pytest.fixture
def index(tmp_path, monkeypatch):
    """A folder of wheels, which pip takes instead of the internet."""
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", str(tmp_path / "index"))
    (tmp_path / "index").mkdir()
    return tmp_path / "index"


def files(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


def test_what_pip_installs_is_found_and_starts(index, tmp_path):
    write_wheel(index)
    own = tmp_path / "own"
    installed = finish(install_sumo(PIP, own))
    assert installed == find_sumo([installed_sumo(own)])
    assert installed.netconvert.is_relative_to(own)
    assert installed.home is not None
    assert installed.home.is_relative_to(own)
    assert sumo_version(installed) == SUMO_VERSION
    assert [path.name for path in own.iterdir()] == [SUMO_VERSION]


def test_an_earlier_version_is_replaced(index, tmp_path):
    own = tmp_path / "own"
    write_wheel(index)
    for left in ("1.0.0", SUMO_VERSION):
        (own / left).mkdir(parents=True)
        (own / left / "stale").touch()
    finish(install_sumo(PIP, own))
    assert [path.name for path in own.iterdir()] == [SUMO_VERSION]
    assert not (own / SUMO_VERSION / "stale").exists()


@pytest.mark.parametrize("wrong", ["no wheel", "no pip", "does not start"])
def test_a_failed_installation_leaves_the_folder_as_it_was(index, tmp_path, wrong):
    own = tmp_path / "own"
    (own / "1.0.0").mkdir(parents=True)
    (own / "1.0.0" / "here").touch()
    before = files(own)
    pip, reason = (
        PIP,
        r"SUMO could not be installed \(No matching distribution .*\): check the connection .* preferences",
    )
    if wrong == "no pip":
        pip, reason = (str(tmp_path / "no python"),), "cannot be started .* preferences"
    elif wrong == "does not start":
        write_wheel(index, script="echo 'no library' >&2; exit 1")
        reason = r"SUMO does not start from .* \(no library\): install it again"
    with pytest.raises(SeipError, match=reason):
        finish(install_sumo(pip, own))
    assert files(own) == before


def test_a_stopped_installation_leaves_the_folder_as_it_was(index, tmp_path):
    write_wheel(index)
    own = tmp_path / "own"
    own.mkdir()
    steps = install_sumo(PIP, own)
    next(steps)
    steps.close()
    assert files(own) == []


PYTHON = Path(sys.executable)
PROGRAMS = Sumo(PYTHON, PYTHON, None)


@pytest.mark.slow
def test_a_program_ends_with_the_run_that_started_it(tmp_path):
    mark = tmp_path / "mark"
    script = f"import pathlib, time\nmark = pathlib.Path({str(mark)!r})\nmark.touch()\ntime.sleep(2)\nmark.unlink()"
    steps = run(PROGRAMS, PYTHON, ["-c", script], "waiting", tmp_path)
    while not mark.exists():
        next(steps)
    steps.close()
    time.sleep(2.5)
    assert mark.exists()


def test_a_program_that_fails_is_named_with_its_reason(tmp_path):
    script = "import sys; sys.exit('Error: Nothing to do.')"
    with pytest.raises(SeipError, match="failed: Nothing to do; check the map"):
        finish(run(PROGRAMS, PYTHON, ["-c", script], "waiting", tmp_path))
    assert not list(tmp_path.iterdir())


@pytest.fixture
def nowhere(monkeypatch):
    """A machine without SUMO."""
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("SUMO_HOME", raising=False)
    monkeypatch.setattr(sumo_programs.importlib.util, "find_spec", lambda _name: None)


@pytest.mark.usefixtures("nowhere")
@pytest.mark.parametrize("named", [".", "bin", "installed"])
def test_sumo_is_found_in_a_named_folder_its_bin_or_where_pip_installed_it(tmp_path, named):
    home = tmp_path / "installed" / "sumo" if named == "installed" else tmp_path
    write_programs(home)
    found = find_sumo([tmp_path / "not there", tmp_path / named])
    assert (found.sumo, found.netconvert) == (home / "bin" / "sumo", home / "bin" / "netconvert")
    assert found.home == home
    with pytest.raises(SeipError, match="SUMO is not installed"):
        find_sumo([tmp_path / "not there"])


@pytest.mark.parametrize("script", ["echo 'libGL.so.1 is missing' >&2; exit 127", "echo nonsense"])
def test_a_sumo_that_does_not_start_is_named(tmp_path, script):
    write_programs(tmp_path, script=script)
    with pytest.raises(
        SeipError, match=r"SUMO does not start from .*bin( \(libGL.so.1 is missing\))?: install it again"
    ):
        sumo_version(find_sumo([tmp_path]))
