"""The command `seip network` on small scenes: result, resumption, changed and failing sites, and faulty requests."""

import json
import shutil
from pathlib import Path

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
def test_phases_keep_earlier_sensors_and_installed_ones_cost_nothing(table, tmp_path):
    both = run(table, tmp_path / "both", "--budget", "20_000", "20_000", "--gap", "0")
    first = run(table, tmp_path / "first", "--budget", "20_000", "--gap", "0")
    assert {sensor.phase for site in both.sites for sensor in site.sensors} == {1, 2}
    for one, other in zip(first.sites, both.sites, strict=True):
        kept = [sensor for sensor in other.sensors if sensor.phase == 1]
        assert [(sensor.position, sensor.sensor) for sensor in one.sensors] == [
            (sensor.position, sensor.sensor) for sensor in kept
        ]
    later = run(table, tmp_path / "later", "--budget", "20_000", "--gap", "0", "--installed", str(tmp_path / "first"))
    assert later.value == pytest.approx(both.value)
    assert later.price_usd == pytest.approx(both.price_usd - first.price_usd)
    assert {sensor.phase for site in later.sites for sensor in site.sensors} == {0, 1}


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
        (("--budget", "1000", "--minimum", "2", "--sensor", "type1"), "share of the road"),
        (("--budget", "1000", "--installed", "nowhere"), "nowhere"),
        (("--budget", "1000", "--sensor", "os1_129"), "os1_129"),
    ],
)
def test_faulty_requests_are_refused_before_anything_is_built(tmp_path, options, fault):
    (tmp_path / "a.blend").write_bytes(b"")
    table = tmp_path / "sites.csv"
    table.write_text("source,latitude,longitude\na.blend,54,7\n", encoding="utf-8")
    with pytest.raises(SeipError, match=fault):
        network.main([str(table), "-o", str(tmp_path / "city"), *options])


def test_an_area_off_the_earth_is_refused(tmp_path):
    area = tmp_path / "area.geojson"
    area.write_text('{"type": "Polygon", "coordinates": [[[0, 0], [1e21, 0], [1e21, 50], [0, 0]]]}', encoding="utf-8")
    extract = Path(__file__).resolve().parents[2] / "scenes" / "harbour.osm"
    with pytest.raises(SeipError, match=r"area\.geojson: a longitude is 1e\+21"):
        network.main([str(extract), "--within", str(area), "--budget", "1000", "-o", str(tmp_path / "city")])
