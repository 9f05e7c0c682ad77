"""The command `seip network` on small scenes: result, resumption, changed and failing sites, and faulty requests."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

from headless import network

import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.output.network.network_record import NetworkRecord
from seip_addon.core.programs import sumo_programs
from seip_addon.core.storage.json_dataclass import from_json
from tests.builders.small_scene import save_small_scene

JUNCTION = Path(__file__).parents[2] / "scenes" / "junction.blend"
TYPES = ("--sensor", "type1", "type2", "--heights", "4", "--grid", "4", "--spacing", "25")


def run(table, output, *more):
    network.main([str(table), "-o", str(output), "--workers", "1", *TYPES, *more])
    record = from_json(NetworkRecord, json.loads((output / "network.json").read_text(encoding="utf-8")))
    assert isinstance(record, NetworkRecord)
    return record


def content(folder):
    """Return the files of a network whose bytes follow from its inputs."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.name in {"network.json", "network.geojson", "sites.csv", "searches.json", "problem.npz", "map.png"}
    }


@pytest.fixture
def table(tmp_path):
    for name in ("north", "south"):
        (tmp_path / name).mkdir()
        save_small_scene(tmp_path / name, title=f"{name.title()} junction").rename(tmp_path / f"{name}.blend")
    (tmp_path / "broken.blend").write_bytes(b"BLENDER nothing")
    path = tmp_path / "sites.csv"
    path.write_text(
        "source,latitude,longitude,name,weight\nnorth.blend,54.32,7.4,North,1\nsouth.blend,54.3,7.4,South,3\n"
        "broken.blend,54.28,7.4,Broken,1\n",
        encoding="utf-8",
    )
    return path


@pytest.mark.slow
def test_budget_goes_to_the_heavier_site_and_an_interrupted_run_resumes_beside_a_site_that_fails(
    table, tmp_path, capsys
):
    output, goal = tmp_path / "city", ("--budget", "20_000", "--gap", "0")
    more = tmp_path / "more.csv"
    rows = "".join(f"{JUNCTION},{54 + number / 100:.2f},7.4,Further {number},1\n" for number in range(12))
    sites = table.read_text(encoding="utf-8").replace("broken.blend,54.28,7.4,Broken,1\n", rows)
    more.write_text(sites, encoding="utf-8")
    command = [sys.executable, "-m", "headless.network", str(more), "-o", str(output), "--workers", "1", *TYPES, *goal]
    started = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True)  # noqa: S603
    while not list(output.glob("*/problem.npz")):
        assert started.poll() is None
        time.sleep(0.01)
    os.killpg(started.pid, signal.SIGINT)  # as a terminal does
    _, said = started.communicate(timeout=60)
    assert started.returncode == 130
    assert "Traceback" not in said
    assert "are kept in" in said
    assert len(list(output.glob("*/problem.npz"))) < 14
    for further in output.glob("further*"):
        shutil.rmtree(further)
    kept = {path: path.stat().st_mtime_ns for path in output.glob("*/problem.npz")}
    assert kept
    first = run(table, output, *goal)
    assert kept == {path: path.stat().st_mtime_ns for path in kept}
    assert first.bound == pytest.approx(first.value)
    assert first.price_usd <= 20_000
    north, south, broken = first.sites
    assert south.value > north.value
    assert south.status == "equipped"
    record = json.loads((output / "south" / "placement.json").read_text(encoding="utf-8"))
    assert record["coverage"]["whole"] == pytest.approx(south.coverage, abs=1e-6)
    assert broken.status == "failed"
    assert "broken" in broken.message
    assert "Broken failed" in capsys.readouterr().out
    before = content(output)
    assert run(table, tmp_path / "again", *goal) == first
    assert content(tmp_path / "again") == before
    stamps = {name: (output / name / "problem.npz").stat().st_mtime_ns for name in ("north", "south")}
    shutil.copy(tmp_path / "south.blend", tmp_path / "north.blend")
    run(table, output, *goal)
    assert (output / "north" / "problem.npz").stat().st_mtime_ns != stamps["north"]
    assert (output / "south" / "problem.npz").stat().st_mtime_ns == stamps["south"]


@pytest.mark.parametrize(
    ("options", "fault"),
    [
        (("--budget", "1000", "--junctions", "signals"), "choose junctions of an extract"),
        (("--budget", "1000", "--sensor", "os1_129"), "os1_129"),
    ],
)
def test_faulty_requests_are_refused_before_anything_is_built(tmp_path, options, fault):
    (tmp_path / "a.blend").write_bytes(b"")
    table = tmp_path / "sites.csv"
    table.write_text("source,latitude,longitude\na.blend,54,7\n", encoding="utf-8")
    with pytest.raises(SeipError, match=fault):
        network.main([str(table), "-o", str(tmp_path / "city"), *options])


def test_an_extract_without_sumo_is_refused_before_anything_is_built(tmp_path, monkeypatch):
    town, output = JUNCTION.with_name("town.osm"), tmp_path / "town"
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("SUMO_HOME", raising=False)
    monkeypatch.setattr(sumo_programs.importlib.util, "find_spec", lambda _: None)
    monkeypatch.setattr(network, "run_network", lambda *_: pytest.fail("it began to build sites"))
    with pytest.raises(SeipError, match="SUMO is not installed"):
        network.main([str(town), "--junctions", "all", "--budget", "150_000", "-o", str(output), "--workers", "1"])
    assert not list(output.iterdir())
