"""Scans that placements share: the frames are those of each placement alone."""

import threading
from dataclasses import fields

from headless.detection.detector_evaluation import side_by_side

import pytest

from seip_addon.core.base.progress import Progress, finish

pytest.importorskip("torch", reason="torch is not installed: make detection")

from headless import survey
from headless.detection.recordings import MountedSensors, Simulator, sampled_runs
from headless.detection.shared_scans import SharedScans, detect_with_all
from headless.options import new_parser

import numpy as np

from seip_addon.core.choosing.placement.deployment import sensor_at
from seip_addon.core.sensing.scans.frame import Labels
from seip_addon.core.sensing.scans.sensor import MountedSensor
from seip_addon.core.sensing.scans.simulation import ScanSettings


@pytest.fixture(scope="module")
def surveyed(small_scene, tmp_path_factory):
    parser = new_parser("survey", "")
    survey.add_options(parser)
    folder = str(tmp_path_factory.mktemp("survey"))
    coarse = ["--heights", "5.4", "--grid", "8", "--spacing", "20", "--sensor", "vlp16"]
    return survey.survey(parser.parse_args([str(small_scene), "-o", folder, *coarse]), lambda _: None)[0]


@pytest.mark.parametrize("rolling", [False, True])
def test_frames_are_bit_for_bit_those_of_each_placement_alone(surveyed, small_scene, rolling):
    """Also where a pose is another sensor of a placement, and in the second of two runs."""
    sensors = [sensor_at(surveyed.site, surveyed.models, "S", pose) for pose in (0, 3, 5)]
    mounted = [MountedSensor(one.label, one.model, one.xyz, one.orientation) for one in sensors]
    chosen = [(0,), (1, 0), (2, 1)]
    placements = [MountedSensors(str(own), tuple(mounted[number] for number in own)) for own in chosen]
    runs = sampled_runs(survey.runs_beside(small_scene)[:2], surveyed.geometry.origin, 3.0)
    simulator = Simulator(surveyed.geometry, ScanSettings(seed=3, rolling_shutter=rolling))
    shared = SharedScans(simulator, placements)
    for run in runs:
        finish(shared.cast(run))
        found = list(shared.frames(run, range(len(run.times)), range(3)))
        assert [number for number, _ in found] == [0, 1, 2] * len(run.times)
        for place, (number, frame) in enumerate(found):
            alone = simulator.frame(placements[number], run, place // 3)
            for name in ("points", "sensor", "delay", "intensity", "instance", "foreground"):
                np.testing.assert_array_equal(getattr(frame, name), getattr(alone, name))
            for part in fields(Labels):
                np.testing.assert_array_equal(getattr(frame.labels, part.name), getattr(alone.labels, part.name))


def test_runs_that_have_no_such_frames_are_left_out(surveyed, small_scene, tmp_path):
    runs = sampled_runs(survey.runs_beside(small_scene)[:2], surveyed.geometry.origin, 3.0)
    shared = SharedScans(Simulator(surveyed.geometry, ScanSettings()), [MountedSensors("none", ())] * 2)
    assert finish(detect_with_all(shared, runs, None, tmp_path, instants=slice(len(runs[0].times), None))) == [[], []]


def counting(steps, name, seen=None):
    for done in range(steps):
        if seen is not None:
            seen.append(name)
        yield Progress(done, steps, name)
    return name


def endless(stopped):
    pause = threading.Event()
    try:
        while not pause.wait(0.001):
            yield Progress(0, 1, "endless")
    finally:
        stopped.set()


def test_results_come_in_the_order_of_the_works():
    works = [counting(30 - 10 * number, str(number)) for number in range(3)]
    assert finish(side_by_side(works, 2)) == ["0", "1", "2"]


def test_a_work_that_fails_stops_the_others():
    stopped = threading.Event()

    def failing():
        yield Progress(0, 1, "fail")
        raise ValueError("broken")

    with pytest.raises(ValueError, match="broken"):
        finish(side_by_side([endless(stopped), failing()], 2))
    assert stopped.wait(10)


def test_stopping_stops_all():
    stopped = [threading.Event(), threading.Event()]
    steps = side_by_side([endless(one) for one in stopped], 2)
    next(steps)
    steps.close()
    assert all(one.wait(10) for one in stopped)
