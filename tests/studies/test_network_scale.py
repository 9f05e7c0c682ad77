"""Simulated schedules against cases that can be computed by hand."""

import json
import re

from headless.studies.network_scale import command
from headless.studies.network_scale.schedule import makespan, simulated_network

import numpy as np
import pytest

from seip_addon.core.errors import SeipError
from seip_addon.core.workflows.network_sites import table_places


def test_one_worker_takes_the_sum():
    assert makespan(np.array([3.0, 1.0, 2.0]), 1, 0.0) == 6.0
    assert makespan(np.array([3.0, 1.0, 2.0]), 1, 0.5) == 7.5


def test_free_workers_take_the_next_task():
    assert makespan(np.array([4.0, 1.0, 1.0, 1.0]), 2, 0.0) == 4.0
    assert makespan(np.array([1.0, 1.0, 1.0, 4.0]), 2, 0.0) == 5.0


def test_scheduler_limits_the_rate_of_tasks():
    assert makespan(np.ones(100), 1000, 0.1) == pytest.approx(11.0)


@pytest.mark.parametrize("seed", range(5))
def test_schedule_lies_between_its_bounds(seed):
    seconds = np.random.default_rng(seed).exponential(30.0, 200)
    for workers in (1, 2, 7, 40):
        time = makespan(seconds, workers, 0.0)
        assert max(seconds.max(), seconds.sum() / workers) <= time + 1e-9
        assert time <= seconds.sum() / workers + seconds.max() + 1e-9


def test_simulated_network_follows_from_its_seed():
    measured = np.array([20.0, 30.0, 50.0])
    assert simulated_network(measured, 1000, 4, 0.01, 3) == simulated_network(measured, 1000, 4, 0.01, 3)
    assert simulated_network(measured, 1000, 4, 0.01, 3) == pytest.approx(1000 * 33.3 / 4, rel=0.1)


def test_the_scheduler_is_measured_on_workers_without_bpy(tmp_path):
    for name, seconds in (("one", 20.0), ("two", 40.0)):
        (tmp_path / name).mkdir()
        usage = {"processor_s": seconds, "peak_memory_mb": 300.0}
        (tmp_path / name / "usage.json").write_text(json.dumps(usage), encoding="utf-8")
    command.main([str(tmp_path), "-o", str(tmp_path / "scale"), "--workers", "1"])
    figures = json.loads((tmp_path / "scale" / "scale.json").read_text(encoding="utf-8"))
    assert figures["processor_s"]["median"] == 30.0
    assert 0 < figures["overhead_s_per_task"] < 20.0


def test_a_random_network_is_a_table_of_separate_junctions(tmp_path):
    command.main(["--random", "5", "--seed", "3", "-o", str(tmp_path / "one")])
    command.main(["--random", "5", "--seed", "3", "-o", str(tmp_path / "two")])
    files = sorted(path.name for path in (tmp_path / "one").iterdir())
    assert files == [*(f"junction-{number:04d}.osm" for number in range(1, 6)), "sites.csv"]
    assert all((tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes() for name in files)
    places = table_places(tmp_path / "one" / "sites.csv", 40.0)
    assert [place.neighbours for place in places] == [()] * 5
    for place in places:
        xml = place.source.read_text(encoding="utf-8")
        for name, value in (("lat", place.latitude), ("lon", place.longitude)):
            degrees = np.array([float(one) for one in re.findall(rf'{name}="([\d.]+)"', xml)])
            assert degrees.min() < value < degrees.max()
            assert np.ptp(degrees) < 0.02


@pytest.mark.parametrize("options", [["-o", "out"], ["city", "--random", "5", "-o", "out"]])
def test_folders_and_a_random_network_exclude_each_other(options):
    with pytest.raises(SeipError, match="give --random N"):
        command.main(options)
