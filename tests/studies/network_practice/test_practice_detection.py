"""Average precision of practices over the sites of a network."""

import shutil
from dataclasses import replace
from pathlib import Path

from headless.studies.network_practice import detection
from headless.studies.network_practice.detection import compare_precision, detect_at_site

import numpy as np
import pytest

from seip_addon.core.errors import SeipError
from seip_addon.core.progress import finish
from tests.builders.labelled_frames import box, detected, frame, truth
from tests.builders.random_site import random_problem
from tests.sumo_here import needs_sumo

SCENES = Path(__file__).parents[3] / "scenes"
SITES = [f"site {number}" for number in range(6)]


def results(missed):
    """Frames of six sites, one car at each; ``worse`` misses it at the sites named."""
    there = truth([box(0)])
    seen, nothing = detected([box(0)], [0.9]), detected([], [])
    return {
        "best": [frame(there, seen, run=site) for site in SITES],
        "worse": [frame(there, nothing if site in missed else seen, run=site) for site in SITES],
    }


def test_unseen_road_users_of_sites_lower_the_average_precision():
    found = compare_precision(results(SITES[:2]), "best")
    assert list(found["best"]) == ["vehicles"]  # there is no pedestrian to find
    worse = found["worse"]["vehicles"]
    assert worse.road_users == 6
    assert worse.value.value == pytest.approx(4 / 6)
    assert worse.gain.value == pytest.approx(2 / 6)
    assert found["best"]["vehicles"].gain.value == found["best"]["vehicles"].gain.high == 0.0


def test_interval_of_the_gain_is_the_jackknife_over_sites():
    gain = compare_precision(results(SITES[:2]), "best")["worse"]["vehicles"].gain
    left_out = np.array([1 / 5, 1 / 5, 2 / 5, 2 / 5, 2 / 5, 2 / 5])
    reach = 2.5706 * np.sqrt(5 / 6 * ((left_out - left_out.mean()) ** 2).sum())  # Student's quantile for 5 degrees
    assert gain.high - gain.value == gain.value - gain.low == pytest.approx(reach, rel=1e-4)


@pytest.fixture
def junction(tmp_path):
    """Folder of a site with the shipped junction, and a problem with two OS1-128 above the corners."""
    folder = tmp_path / "site"
    folder.mkdir()
    for suffix in ("blend", "xodr"):
        shutil.copy(SCENES / f"junction.{suffix}", folder / f"site.{suffix}")
    problem = random_problem(1, "returns")
    xyz = problem.xyz.copy()
    xyz[:2] = (12.0, 12.0, 6.0), (-12.0, -12.0, 6.0)
    return folder, replace(problem, xyz=xyz)


@needs_sumo
@pytest.mark.slow
def test_detection_at_a_site_with_a_sensor_and_without(tmp_path, junction, monkeypatch):
    folder, problem = junction
    monkeypatch.setattr(detection, "FRAMES", 3)
    chosen = {"two": (0, 1), "none": (), "again": (0, 1)}
    found = finish(detect_at_site(folder, problem, chosen, 1, tmp_path / "out"))
    assert found["two"] == found["again"]
    assert {one.run for one in found["two"]} == {"site"}
    for seen, unseen in zip(found["two"], found["none"], strict=True):
        assert len(seen.detected) > 0 == len(unseen.detected)
        assert np.array_equal(seen.truth.boxes, unseen.truth.boxes)
    precision = compare_precision(found, "two")
    assert precision["two"]["vehicles"].value.value > 0.4
    assert precision["none"]["vehicles"].value.value == 0.0

    stored = sorted((tmp_path / "out" / detection.DETECTIONS).iterdir())
    assert len(stored) == 1
    before = stored[0].stat().st_mtime_ns
    again = finish(detect_at_site(folder, problem, chosen, 1, tmp_path / "out"))
    assert stored[0].stat().st_mtime_ns == before
    assert [len(one.detected) for one in again["two"]] == [len(one.detected) for one in found["two"]]


def test_sites_without_a_map_are_refused(tmp_path, junction):
    folder, problem = junction
    (folder / "site.xodr").unlink()
    with pytest.raises(SeipError, match="no map to simulate traffic on"):
        finish(detect_at_site(folder, problem, {"one": (0,)}, 1, tmp_path / "out"))


@needs_sumo
@pytest.mark.slow
def test_sensors_that_look_one_way_are_refused(tmp_path, junction, monkeypatch):
    folder, problem = junction
    monkeypatch.setattr(detection, "FRAMES", 1)
    narrow = replace(problem, labels=np.array(["at128", *problem.labels[1:]]))
    with pytest.raises(SeipError, match="at128 is not all-round"):
        finish(detect_at_site(folder, narrow, {"one": (0,)}, 1, tmp_path / "out"))
