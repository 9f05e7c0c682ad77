"""Runs on disk: whole frames, the same whether stopped or not, and nothing else's."""

import json
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.sensing.scans.run_folder import (
    Run,
    frame_path,
    load_frames,
    load_manifest,
    write_run,
)
from seip_addon.core.sensing.scans.simulation import ScanSettings, prepare
from tests.builders.traffic_by_hand import box_body, ground, make_sensor, make_static, parked
from tests.engines import ANY, needs_any

pytestmark = needs_any


def make_run(**changes):
    cars = parked((10.0, 2.0, 0.0, 0.3, 0.0), (-8.0, 5.0, 0.0, 1.0, 0.0))
    run = Run(
        static=make_static(ground()),
        origin=np.array([5e5, 4e6, 100.0]),
        sensors=(make_sensor(), make_sensor((15.0, 15.0, 5.0), label="S2")),
        trajectories=cars,
        bodies=tuple(box_body(user) for user in cars.users),
        times=np.arange(4) / 10,
        settings=ScanSettings(seed=3, engine=ANY),
        versions={"seip": "0.1.0"},
    )
    return replace(run, **changes)


def steps(folder, run):
    simulation = finish(prepare(run.static, run.sensors, run.trajectories, run.bodies, run.settings))
    return write_run(folder, run, simulation)


def contents(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def test_a_run_says_what_it_is_made_of_and_reads_back(tmp_path):
    record = finish(steps(tmp_path / "run", make_run()))
    assert record == load_manifest(tmp_path / "run")
    assert (record["complete"], record["seeds"]) == (True, {"returns": 3})
    assert [sensor["label"] for sensor in record["sensors"]] == ["S1", "S2"]
    assert record["origin_m"] == [5e5, 4e6, 100.0]
    frames = dict(load_frames(tmp_path / "run"))
    assert list(frames) == ["000000", "000001", "000002", "000003"]
    for entry in record["frames"]:
        frame = frames[entry["name"]]
        assert (entry["time_s"], entry["points"], entry["road_users"]) == (frame.time, len(frame), 2)
        assert set(frame.sensor.tolist()) == {0, 1}


def test_the_same_run_is_the_same_bytes_stopped_or_not(tmp_path):
    finish(steps(tmp_path / "one", make_run()))
    stopped = steps(tmp_path / "two", make_run())
    list(islice(stopped, 3))
    stopped.close()
    assert len(list((tmp_path / "two" / "frames").iterdir())) == 2
    with pytest.raises(SeipError, match="stopped half-way"):
        next(load_frames(tmp_path / "two"))
    before = frame_path(tmp_path / "two", 0).stat().st_mtime_ns
    finish(steps(tmp_path / "two", make_run()))
    assert contents(tmp_path / "one") == contents(tmp_path / "two")
    assert frame_path(tmp_path / "two", 0).stat().st_mtime_ns == before


@pytest.mark.parametrize(
    "changes",
    [
        {"settings": ScanSettings(seed=4, engine=ANY)},
        {"times": np.arange(5) / 10},
        {"static": make_static(ground(59.0))},
        {"static": make_static(ground(), reflectivity=0.4)},
        {"trajectories": parked((10.0, 2.0, 0.0, 0.3, 0.0), (-8.0, 5.0, 0.0, 1.1, 0.0))},
        {"sensors": (make_sensor(max_range=50.0), make_sensor((15.0, 15.0, 5.0), label="S2"))},
        {"versions": {"seip": "0.2.0"}},
    ],
    ids=["seed", "times", "scene", "reflectivity", "traffic", "sensor", "version"],
)
def test_a_folder_of_other_settings_is_left_alone(tmp_path, changes):
    finish(steps(tmp_path, make_run()))
    before = contents(tmp_path)
    with pytest.raises(SeipError, match="different scene, traffic or settings"):
        finish(steps(tmp_path, make_run(**changes)))
    assert contents(tmp_path) == before


@pytest.mark.parametrize(
    ("key", "wrong"),
    [("complete", 5), ("frames", ["000000"])],
)
def test_a_manifest_with_a_wrong_value_is_refused(tmp_path, key, wrong):
    finish(steps(tmp_path, make_run()))
    path = tmp_path / "manifest.json"
    record = json.loads(path.read_text(encoding="utf-8"))
    path.write_text(json.dumps(record | {key: wrong}), encoding="utf-8")
    with pytest.raises(SeipError, match=r"manifest\.json is damaged: delete the folder and simulate again"):
        list(load_frames(tmp_path))


def test_a_manifest_of_another_version_has_its_sentence(tmp_path):
    (tmp_path / "manifest.json").write_text(json.dumps({"schema": "seip-run/9", "key": "", "frames": []}))
    with pytest.raises(SeipError, match="written by another version"):
        load_manifest(tmp_path)
