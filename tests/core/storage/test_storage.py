"""One run at a time in a folder, and nothing left there by runs that ended otherwise than they should."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.storage.files import locked_folder, save_json, whole_file

ROOT = Path(__file__).resolve().parents[3]
HOLD = "import sys, time; from pathlib import Path; from seip_addon.core.storage.files import *; "
LOCK = HOLD + "part = locked_folder(Path(sys.argv[1])); part.__enter__(); print('held', flush=True); time.sleep(60)"
WRITE = HOLD + "part = whole_file(Path(sys.argv[1]) / 'a.json'); print(part.__enter__(), flush=True); time.sleep(60)"


@pytest.fixture
def other():
    """Start another process that works in a folder until it is killed."""
    started = []

    def start(script, folder):
        command = [sys.executable, "-c", script, str(folder)]
        process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True)  # noqa: S603  # our own script
        started.append(process)
        return process, process.stdout.readline().strip()

    yield start
    for process in started:
        process.kill()
        process.wait()
        process.stdout.close()


def test_a_folder_that_another_run_writes_to_is_refused_until_that_ends_however_it_ends(tmp_path, other):
    process, said = other(LOCK, tmp_path)
    assert said == "held"
    with (
        pytest.raises(SeipError, match=r"another run is writing to .*: wait until it has ended"),
        locked_folder(tmp_path),
    ):
        pass
    process.send_signal(signal.SIGKILL)
    process.wait()
    with locked_folder(tmp_path):
        assert list(tmp_path.iterdir()) == []


def test_the_next_run_removes_what_a_killed_one_left_and_nothing_else(tmp_path, other):
    folder = tmp_path / "results"
    process, dead = other(WRITE, folder)
    living = Path(other(WRITE, folder)[1])
    process.send_signal(signal.SIGKILL)
    process.wait()
    for name in (".hidden", ".seip-lock", ".seip-", ".seip-x-1.json", f"seip-{process.pid}-1.json"):
        (folder / name).touch()
    mine = {path.name for path in folder.iterdir()} - {Path(dead).name}
    assert Path(dead).exists()
    save_json(folder / "b.json", {})
    assert {path.name for path in folder.iterdir()} == mine | {"b.json"}
    assert living.exists()


def test_a_folder_that_is_made_for_a_file_goes_with_it(tmp_path):
    path = tmp_path / "a" / "b" / "file.json"
    with pytest.raises(ZeroDivisionError), locked_folder(path.parent), whole_file(path):
        raise ZeroDivisionError
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "a").mkdir()
    with pytest.raises(ZeroDivisionError), whole_file(path):
        raise ZeroDivisionError
    assert [one.name for one in tmp_path.rglob("*")] == ["a"]
    save_json(path, 1)
    assert path.exists()
