"""Programs of SUMO: where they are found, and what happens when they fail or are stopped."""

import sys
import time
from pathlib import Path

import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.programs import sumo_programs
from seip_addon.core.programs.sumo_programs import Sumo, find_sumo, run, sumo_version
from tests.builders.sumo_wheel import write_programs

PYTHON = Path(sys.executable)
PROGRAMS = Sumo(PYTHON, PYTHON, None)


@pytest.mark.slow
def test_a_program_ends_with_the_run_that_started_it(tmp_path):
    mark = tmp_path / "mark"
    script = f"import pathlib, time\nmark = pathlib.Path({str(mark)!r})\nmark.touch()\ntime.sleep(2)\nmark.unlink()"
    steps = run(PROGRAMS, PYTHON, ["-c", script], "waiting")
    while not mark.exists():
        next(steps)
    steps.close()
    time.sleep(2.5)
    assert mark.exists()


def test_a_program_that_fails_is_named_with_its_reason():
    script = "import sys; sys.exit('Error: Nothing to do.')"
    with pytest.raises(SeipError, match="failed: Nothing to do; check the map"):
        finish(run(PROGRAMS, PYTHON, ["-c", script], "waiting"))


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
