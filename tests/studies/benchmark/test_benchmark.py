"""The benchmark writes its page, charts and figures; what it compares is what it says."""

import importlib.util
import json
import math
import shutil
from functools import partial

from headless.studies.benchmark import command as benchmark
from headless.studies.benchmark.approximations import bounding_box, decimated, every_other_channel, thinner
from headless.studies.benchmark.baselines import BASELINES, can_run
from headless.studies.benchmark.fresh_process import in_fresh_process
from headless.studies.benchmark.growth import relaxation_growth, repeated
from headless.studies.benchmark.measurements import BenchmarkScope
from headless.studies.benchmark.placement import SolverRun, compare
from headless.studies.benchmark.report import bars
from headless.studies.benchmark.resource_usage import Expense, peak_memory
from headless.studies.benchmark.scans import ScanCost
from headless.studies.benchmark.street_visibility import street_problem
from headless.studies.benchmark.visibility import Cost

import bpy
import numpy as np
import pytest

from seip_addon.core.choosing.placement.reduced_problem import make_instance
from seip_addon.core.errors import SeipError
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.site.candidates import CandidateSettings
from seip_addon.core.site.scene_geometry import Mesh
from tests.builders.small_junction import box_triangles, make_example
from tests.builders.small_scene import save_small_scene

SMALL = BenchmarkScope(
    layout=CandidateSettings(sensors=("type1",), heights=(3.5,), spacing=24.0),
    street=(20, 200, 2),
    counts=(2, 3),
    largest=(16, 300, 2),
    places=1,
    multiples=(1, 2),
    copies=(1, 2),
    spacings=(8.0, 4.0),
    scanned_by="type1",
    frames=1,
    modelled="vlp16",
    placements=3,
    every_beam=1,
)


@pytest.fixture(scope="module")
def folder(small_scene, tmp_path_factory):
    pytest.importorskip("embreex", reason="embreex is not installed")
    folder = tmp_path_factory.mktemp("benchmark")
    work = ["--steps", "2", "--work", str(folder / "work")]
    benchmark.main([str(small_scene), "-o", str(folder), "--places", "1", "--time-limit", "5", *work], SMALL)
    return folder


@pytest.mark.slow
def test_the_page_shows_charts_that_are_there(folder):
    page = (folder / "benchmark.md").read_text(encoding="utf-8")
    for chart in ("visibility", "placement", "growth", "sensor_models"):
        assert f"(benchmark/{chart}.png)" in page
        assert (folder / "benchmark" / f"{chart}.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_the_figures_hold_every_way(folder):
    record = json.loads((folder / "benchmark" / "benchmark.json").read_text(encoding="utf-8"))
    assert {"full bvh", "lazy bvh", "full embree", "lazy embree"} <= set(record["visibility"])
    assert len(record["visibility"]) == 2 * (2 + len(record["harm"]) - 1)
    assert record["visibility"]["lazy embree"]["rays"] < record["visibility"]["full embree"]["rays"]
    assert record["harm"]["exact"]["wrong"] == 0 < record["harm"]["azimuth ÷ 8"]["wrong"]
    ways = {run["way"] for run in record["placement"]}
    assert ways == {way for way in BASELINES if can_run(way)}
    assert len(record["bars"]) == 9
    assert record["scans"]["cached embree"]["rays"] == record["scans"]["full bvh"]["rays"] == 4 * 60_000
    assert all(len(growth["seconds"]) == len(growth["size"]) for growth in record["growth"])

    assert "first linear relaxation" in {growth["what"] for growth in record["growth"]}


def test_the_first_relaxation_is_measured_against_the_entries_of_its_program():
    steps = [(10, 100, 2), (20, 200, 2)]
    found = relaxation_growth(steps)
    instances = [make_instance(street_problem(*step[:2], blocks=step[2], count=4))[0] for step in steps]
    entries = [np.count_nonzero(instance.visible) for instance in instances]
    assert list(found.size) == entries
    assert 0 < entries[0] < entries[1]
    assert all(seconds > 0 for seconds in found.seconds)


@pytest.mark.slow
def test_models_of_the_sensor_are_measured_alone(folder, small_scene, tmp_path):
    shutil.copytree(folder, tmp_path / "docs")
    before = json.loads((folder / "benchmark" / "benchmark.json").read_text(encoding="utf-8"))
    other = save_small_scene(tmp_path, title="Another junction")
    argv = [str(small_scene), "-o", str(tmp_path / "docs"), "--work", str(folder / "work"), "--steps", "2"]
    benchmark.main([*argv, "--sensor-models", "--site", str(other), "--time-limit", "5"], SMALL)
    after = json.loads((tmp_path / "docs" / "benchmark" / "benchmark.json").read_text(encoding="utf-8"))
    assert {name: part for name, part in after.items() if name != "sensor_models"} == {
        name: part for name, part in before.items() if name != "sensor_models"
    }
    assert [one["site"] for one in before["sensor_models"]["sites"]] == ["Small junction"]
    assert [one["site"] for one in after["sensor_models"]["sites"]] == ["Small junction", "Another junction"]
    assert (after["sensor_models"]["precision"] is None) == (importlib.util.find_spec("torch") is None)
    page = (tmp_path / "docs" / "benchmark.md").read_text(encoding="utf-8")
    assert "| Another junction | diverging beams |" in page
    with pytest.raises(SeipError, match="is not a benchmark"):
        benchmark.main([str(small_scene), "-o", str(tmp_path / "none"), "--sensor-models"], SMALL)


def test_every_way_to_place_keeps_to_the_rules_and_none_beats_a_bound():
    problem = street_problem(20, 300, blocks=2, count=3)
    ways = [way for way in BASELINES if can_run(way)]
    runs = {run.way: run for run in compare("streets", problem, ways, 20)}
    best = runs["ours"]
    assert best.proven
    for run in runs.values():
        assert run.objective <= best.objective + 1e-6 <= run.bound + 2e-6
    assert runs["PuLP + CBC"].objective == runs["PuLP + HiGHS"].objective == best.objective
    assert runs["lazy greedy"].objective == runs["greedy"].objective <= runs["local search"].objective


def run_of(instance, way, seconds, objective, bound):
    return SolverRun(instance, way, Expense(seconds, seconds), 100.0, objective, bound, min(bound, 1000.0), "")


def test_bars_are_met_by_what_meets_them_alone():
    costs = {
        "full bvh": Cost(Expense(100.0), 1, 1),
        "lazy bvh": Cost(Expense(5.0), 1, 1),
        "full embree": Cost(Expense(9.0), 1, 1),
        "lazy embree": Cost(Expense(1.0), 1, 1),
    }
    runs = [
        run_of("few", "PuLP + CBC", 30.0, 900.0, 900.0),
        run_of("few", "ours", 1.0, 900.0, 900.0),
        run_of("many", "ours", 59.0, 991.0, 1000.0),
        run_of("largest", "ours", 119.0, 984.0, 1000.0),
    ]
    scans = {
        "cached bvh": ScanCost(Expense(7.0), 10, 1_000_000, 1),
        "full bvh": ScanCost(Expense(100.0), 10, 1_000_000),
        "cached embree": ScanCost(Expense(5.0), 10, 1_000_000, 0),
    }
    held = bars(costs, runs, ("few", "many", "largest"), scans)
    assert [bar.met for bar in held] == [True, True, False, True, True, False, False, True, True]
    assert held[2].measured == "9×"
    runs[0] = run_of("few", "PuLP + CBC", 30.0, 901.0, math.inf)  # better than what was said to be proven
    scans["cached bvh"].differing = 2
    held = bars(costs, runs, ("few", "many", "largest"), scans)
    assert not held[3].met
    assert not held[8].met


def test_fewer_rays_are_those_that_were_asked_for():
    model = load_catalogue()["type2"]
    assert thinner(model, 4).azimuth_count == model.azimuth_count / 4
    half = every_other_channel(model)
    assert (half.channels, half.azimuth_count) == (model.channels / 2, model.azimuth_count)
    np.testing.assert_array_equal(half.elevations, model.elevations[::2])


def test_a_box_is_its_own_bounding_box():
    box = bounding_box(Mesh("box", box_triangles((-1, -2, 0), (3, 4, 5))))
    edges = box[:, 1:] - box[:, :1]
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) / 2
    assert area.sum() == pytest.approx(2 * (4 * 6 + 4 * 5 + 6 * 5))
    np.testing.assert_array_equal(box.min(axis=(0, 1)), (-1, -2, 0))
    np.testing.assert_array_equal(box.max(axis=(0, 1)), (3, 4, 5))


def test_decimation_leaves_fewer_faces_and_no_object_behind():
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    x, y = np.meshgrid(np.arange(8.0), np.arange(8.0), indexing="ij")
    corner = np.stack([x.ravel(), y.ravel(), np.sin(x.ravel())], axis=1)
    steps = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0]])
    simpler = decimated(Mesh("slope", corner[:, None] + steps))
    assert 0 < len(simpler) < len(corner)
    assert not bpy.data.objects
    assert not bpy.data.meshes


def test_a_repeated_site_is_the_site_beside_itself():
    site = make_example().site
    row = repeated(site, 3)
    pitch = np.ptp(site.triangles[:, :, 0])
    assert (len(row.targets), len(row.candidates)) == (3 * len(site.targets), 3 * len(site.candidates))
    last = row.triangles[-len(site.triangles) :] - (2 * pitch, 0, 0)
    np.testing.assert_allclose(last, site.triangles, atol=1e-9)
    feet = row.candidates.position[row.candidates.position_of]
    own = site.candidates.position[site.candidates.position_of]
    np.testing.assert_allclose(row.candidates.xyz - feet, np.tile(site.candidates.xyz - own, (3, 1)), atol=1e-9)


def test_expense_sums_and_memory_counts_what_was_in_use():
    expense = Expense()
    assert expense.time(lambda: "result") == "result"
    assert expense.cpu >= 0
    assert expense.wall > 0
    array, grown = in_fresh_process(partial(peak_memory, partial(np.ones, 40_000_000, dtype=np.int8)))
    assert array.all()
    assert grown is None or 35 < grown < 80
