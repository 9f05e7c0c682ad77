"""Runs of simulated traffic in a folder: all or none, never mixed with others, each that of the command."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import Progress, finish
from seip_addon.core.sensing.traffic.trajectories import Trajectories
from seip_addon.core.storage.json_dataclass import as_json
from seip_addon.core.workflows import traffic_simulation
from seip_addon.core.workflows.traffic_simulation import SIMULATION, SimulationSettings, simulate_runs
from seip_addon.core.world.traffic_simulation.demand import Demand
from seip_addon.core.world.traffic_simulation.simulation import SimulatedRun
from tests.builders.small_scene import make_run


@pytest.fixture
def stand_in(monkeypatch):
    """A stand-in for SUMO: the run of a seed is that of the builder, and a seed may fail."""
    asked = SimpleNamespace(scenarios=[], failing=None)

    def simulate_run(_map_path, scenario, warm_up, _geometry, _sumo):
        asked.scenarios.append((scenario, warm_up))
        yield Progress(0, 0, "simulating traffic")
        if scenario.seed == asked.failing:
            raise SeipError("sumo failed")
        return SimulatedRun(make_run(scenario.seed, 5.0), 30, ("a",), ("missing sizes",))

    monkeypatch.setattr(traffic_simulation, "simulate_run", simulate_run)
    return asked


def simulated(folder, count, settings=None):
    return finish(simulate_runs(folder / "map.xodr", settings or SimulationSettings(), count, None, folder / "runs"))


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_runs_have_the_seeds_from_1_and_the_settings_of_the_request(tmp_path, stand_in):
    settings = SimulationSettings(Demand(flow=450.0, pedestrians=10.0), duration=30.0, warm_up=7.0)
    done = simulated(tmp_path, 3, settings)
    assert [path.name for path in done.paths] == ["run-1.npz", "run-2.npz", "run-3.npz"]
    assert [scenario.seed for scenario, _ in stand_in.scenarios] == [1, 2, 3]
    assert all(scenario.demand == settings.demand for scenario, _ in stand_in.scenarios)
    assert {(scenario.duration, warm_up) for scenario, warm_up in stand_in.scenarios} == {(37.0, 7.0)}
    for seed, path in enumerate(done.paths, start=1):
        np.testing.assert_array_equal(Trajectories.load(path).position, make_run(seed, 5.0).position)
    assert done.messages == [f"run-{seed}.npz: missing sizes" for seed in (1, 2, 3)]
    users = sum(len(make_run(seed, 5.0)) for seed in (1, 2, 3))
    assert done.summary == f"3 runs, {users} road users (3 left out, having run into others)"
    record = json.loads((tmp_path / "runs" / SIMULATION).read_text(encoding="utf-8"))
    assert record["settings"] == as_json(settings)
    assert (record["map"], record["runs"]) == ("map.xodr", ["run-1.npz", "run-2.npz", "run-3.npz"])


@pytest.mark.parametrize("other", ["run-1.npz", "mine.npz"])
def test_a_folder_with_other_runs_is_left_as_it_is(tmp_path, stand_in, other):
    make_run(9, 5.0).save(tmp_path / "runs" / other)
    with pytest.raises(SeipError, match=rf"contains other runs of traffic \({other}\).*choose another one"):
        simulated(tmp_path, 2)
    assert names(tmp_path / "runs") == [other]
    assert not stand_in.scenarios


def test_a_run_that_fails_leaves_the_earlier_ones(tmp_path, stand_in):
    simulated(tmp_path, 2)
    before = {path.name: path.read_bytes() for path in (tmp_path / "runs").iterdir()}
    stand_in.failing = 3
    with pytest.raises(SeipError, match="sumo failed"):
        simulated(tmp_path, 4, SimulationSettings(Demand(flow=50.0)))
    assert {path.name: path.read_bytes() for path in (tmp_path / "runs").iterdir()} == before


def test_stopped_work_leaves_no_folder(tmp_path, stand_in):
    work = simulate_runs(tmp_path / "map.xodr", SimulationSettings(), 3, None, tmp_path / "runs")
    seen = [next(work) for _ in range(5)]
    assert [progress.what for progress in seen[::2]] == [f"simulating run {number} of 3" for number in (1, 2, 3)]
    assert [(progress.done, progress.total) for progress in seen] == [(0, 3), (0, 3), (1, 3), (1, 3), (2, 3)]
    work.close()
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize("content", ["[", '{"runs": 3}'])
def test_a_damaged_list_of_runs_is_named(tmp_path, stand_in, content):
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs" / SIMULATION).write_text(content, encoding="utf-8")
    with pytest.raises(SeipError, match=rf"{SIMULATION}.*choose another folder"):
        simulated(tmp_path, 1)
