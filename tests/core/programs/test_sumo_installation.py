"""SUMO is installed by pip, whole or not at all, and found afterwards."""

import sys

import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.programs.sumo_installation import SUMO_VERSION, install_sumo, installed_sumo
from seip_addon.core.programs.sumo_programs import find_sumo, sumo_version
from tests.builders.sumo_wheel import write_wheel

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
