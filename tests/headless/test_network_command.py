"""The command `seip network` on small scenes: result, resumption, changed and failing sites, and faulty requests."""

import json
import shutil

from headless import network

import pytest

from seip_addon.core.errors import SeipError
from seip_addon.core.output.network.network_record import load_network
from tests.builders.small_scene import save_small_scene

TYPES = ("--sensor", "type1", "type2", "--heights", "4", "--grid", "4", "--spacing", "25")


def run(table, output, *more):
    network.main([str(table), "-o", str(output), "--workers", "1", *TYPES, *more])
    return load_network(output / "network.json")


def content(folder):
    """Return the files of a network whose bytes follow from its inputs."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.name in {"network.json", "network.geojson", "sites.csv", "searches.json", "problem.npz", "network.html"}
    }


@pytest.fixture
def table(tmp_path):
    for name in ("north", "south"):
        (tmp_path / name).mkdir()
        save_small_scene(tmp_path / name, title=f"{name.title()} junction").rename(tmp_path / f"{name}.blend")
    path = tmp_path / "sites.csv"
    path.write_text(
        "source,latitude,longitude,name,weight\nnorth.blend,54.32,7.4,North,1\nsouth.blend,54.3,7.4,South,3\n",
        encoding="utf-8",
    )
    return path


@pytest.mark.slow
def test_budget_goes_to_the_heavier_site_first_and_the_run_resumes(table, tmp_path):
    output = tmp_path / "city"
    first = run(table, output, "--budget", "20_000", "--gap", "0")
    assert first.bound == pytest.approx(first.value)
    assert first.price_usd <= 20_000
    north, south = first.sites
    assert south.value > north.value
    assert south.status == "equipped"
    assert (output / "south" / "placement.json").is_file()
    record = json.loads((output / "south" / "placement.json").read_text(encoding="utf-8"))
    assert record["coverage"]["whole"] == pytest.approx(south.coverage, abs=1e-6)
    before = content(output)
    stamp = (output / "south" / "problem.npz").stat().st_mtime_ns
    run(table, output, "--budget", "20_000", "--gap", "0")
    assert content(output) == before
    assert (output / "south" / "problem.npz").stat().st_mtime_ns == stamp
    fresh = run(table, tmp_path / "again", "--budget", "20_000", "--gap", "0")
    assert fresh == first
    assert content(tmp_path / "again") == before


@pytest.mark.slow
def test_a_site_that_fails_is_reported_and_only_changed_sites_are_surveyed_again(table, tmp_path, capsys):
    output = tmp_path / "city"
    (tmp_path / "broken.blend").write_bytes(b"BLENDER nothing")
    lines = table.read_text(encoding="utf-8")
    table.write_text(f"{lines}broken.blend,54.28,7.4,Broken,1\n", encoding="utf-8")
    record = run(table, output, "--coverage", "0.4")
    assert [site.status for site in record.sites] == ["equipped", "equipped", "failed"]
    assert "broken" in record.sites[2].message
    assert all(site.coverage >= 0.4 for site in record.sites[:2])
    assert "Broken failed" in capsys.readouterr().out
    stamps = {name: (output / name / "problem.npz").stat().st_mtime_ns for name in ("north", "south")}
    shutil.copy(tmp_path / "south.blend", tmp_path / "north.blend")
    run(table, output, "--coverage", "0.4")
    assert (output / "north" / "problem.npz").stat().st_mtime_ns != stamps["north"]
    assert (output / "south" / "problem.npz").stat().st_mtime_ns == stamps["south"]


@pytest.mark.parametrize(
    ("options", "fault"),
    [
        ((), "give either --budget"),
        (("--budget", "1000", "--coverage", "0.5"), "give either --budget"),
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
