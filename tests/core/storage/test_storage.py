"""One run at a time in a folder, and nothing left there by runs that ended otherwise than they should."""

import csv
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.site.installed_cost import load_installed_cost
from seip_addon.core.storage.csv_table import save_csv
from seip_addon.core.storage.files import locked, save_json, whole_file
from seip_addon.core.world.streetscape.site_file import read_site_description

ROOT = Path(__file__).resolve().parents[3]
HOLD = "import sys, time; from pathlib import Path; from seip_addon.core.storage.files import *; "
LOCK = HOLD + "path = Path(sys.argv[1]); part = locked(path, folder=path.is_dir()); part.__enter__(); "
LOCK += "print('held', flush=True); time.sleep(60)"
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


@pytest.mark.parametrize("name", [".", "site.blend"])
def test_what_another_run_writes_to_is_refused_until_that_ends_however_it_ends(tmp_path, other, name):
    path, folder = tmp_path / name, name == "."
    process, said = other(LOCK, path)
    assert said == "held"
    with (
        pytest.raises(SeipError, match=r"another run is writing to .*: wait until it has ended"),
        locked(path, folder=folder),
    ):
        pass
    with locked(tmp_path / "other.blend", folder=False):
        pass
    process.send_signal(signal.SIGKILL)
    process.wait()
    with locked(path, folder=folder):
        pass
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
    with pytest.raises(ZeroDivisionError), locked(path.parent, folder=True), whole_file(path):
        raise ZeroDivisionError
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "a").mkdir()
    with pytest.raises(ZeroDivisionError), whole_file(path):
        raise ZeroDivisionError
    assert [one.name for one in tmp_path.rglob("*")] == ["a"]
    save_json(path, 1)
    assert path.exists()


@pytest.mark.parametrize(
    "name",
    [
        '=HYPERLINK("http://example.com","post")',
        "+1+cmd|' /C calc'!A0",
        "  =1",
        "\N{FULLWIDTH EQUALS SIGN}1",
    ],
)
def test_a_formula_is_written_as_text(tmp_path, name):
    save_csv(tmp_path / "a.csv", ["name"], [[name]])
    with (tmp_path / "a.csv").open(newline="", encoding="utf-8") as file:
        assert list(csv.reader(file)) == [["name"], [f"'{name}"]]


def test_a_carriage_return_begins_no_row(tmp_path):
    save_csv(tmp_path / "a.csv", ["name", "x"], [["post\r=1+1", 2]])
    with (tmp_path / "a.csv").open(newline="", encoding="utf-8") as file:
        assert list(csv.reader(file)) == [["name", "x"], ["post =1+1", "2"]]


@pytest.mark.parametrize("value", ["-3.500", "-10 -5 0", "signal pole 1", -3.5])
def test_numbers_and_ordinary_names_stay_as_they_are(tmp_path, value):
    save_csv(tmp_path / "a.csv", ["value", "x"], [[value, 1]])
    assert (tmp_path / "a.csv").read_text(encoding="utf-8") == f"value,x\n{value},1\n"


READERS = {
    "LiDAR catalogue": lambda path: load_catalogue((path,)),
    "installed costs": load_installed_cost,
    "site description": read_site_description,
}


@pytest.mark.parametrize("what", READERS)
def test_text_of_another_encoding_and_folders_are_refused(tmp_path, what):
    file = tmp_path / "own.toml"
    file.write_bytes("backhaul_usd = 1".encode("utf-16"))
    with pytest.raises(SeipError, match=rf"cannot read the {what} .*own\.toml: it is not UTF-8 text; name a TOML file"):
        READERS[what](file)
    with pytest.raises(SeipError, match=rf"cannot read the {what} .*: Is a directory"):
        READERS[what](tmp_path)
