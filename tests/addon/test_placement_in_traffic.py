"""Placement for the road in traffic from the panel: the command's answer, and a sentence for what cannot be used."""

import re
import shutil
from types import SimpleNamespace
from unittest.mock import patch

from headless import place

import bpy
import pytest

from seip_addon.core.choosing.placement.scenarios import DEFAULT_COUNTS
from seip_addon.core.output.results.placement_record import comparable, load_placement, parsed_record
from seip_addon.panel.placement import SEIP_OT_solve_placement
from seip_addon.panel.session import session
from tests.builders.small_scene import make_run

OPTIONS = [
    *("--sensor", "vlp16", "--heights", "5.4", "--grid", "8", "--spacing", "25", "--count", "2"),
    *("--traffic", "--no-render"),
]


@pytest.fixture
def coarse(junction):
    """The small junction with coarser settings, to place on its traffic."""
    survey, goal = junction.seip.survey, junction.seip.goal
    survey.heights, survey.grid, survey.spacing = "5.4", 8.0, 25.0
    for one in survey.types:
        one.use = one.name == "vlp16"
    goal.scenarios = "traffic"
    with patch.dict(DEFAULT_COUNTS, traffic=(2, 8)):
        yield junction


def test_evaluate_only_states_what_traffic_leaves_of_the_placement_for_the_empty_road(coarse, tmp_path, small_scene):
    coarse.seip.goal.scenarios = "nominal"
    assert bpy.ops.seip.solve_placement() == {"FINISHED"}
    empty = parsed_record(coarse.seip.result.record)
    coarse.seip.goal.scenarios, coarse.seip.goal.risk = "traffic", "none"
    assert bpy.ops.seip.solve_placement() == {"FINISHED"}
    panel = parsed_record(coarse.seip.result.record)
    assert [sensor.pose for sensor in panel.sensors] == [sensor.pose for sensor in empty.sensors]
    (note,) = set(panel.notes) - set(empty.notes)
    found = re.fullmatch(
        r"in traffic \(\d+ road users at a time\) .* sees ([\d.]+)% .*, ([\d.]+)% when it is empty", note
    )
    assert 0 < float(found[1]) <= 100
    assert float(found[2]) == pytest.approx(100 * empty.coverage.whole, abs=0.01)
    place.main([str(small_scene), *OPTIONS, "--risk", "none", "-o", str(tmp_path)])
    assert comparable(panel) == comparable(load_placement(tmp_path / "placement.json"))


def test_runs_are_read_in_work_that_can_be_stopped(coarse):
    work = next(SEIP_OT_solve_placement.job(SimpleNamespace(), coarse))
    assert any(progress.what == "reading runs of traffic" for progress in work)
    work.close()
    assert session.of(coarse).state is None
    assert not coarse.seip.result.record


def copies(folder):
    for number in (1, 2):
        make_run(1, 30.0).save(folder / f"run-{number}.npz")


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (shutil.rmtree, r"there is no run of traffic \(\.npz\) in .*runs: choose another folder, or make two or more"),
        (copies, r"run-1\.npz and .*run-2\.npz are nearly the same traffic"),
    ],
)
def test_runs_that_are_of_no_use_are_refused_before_any_ray_is_cast(coarse, tmp_path, wrong, words):
    folder = tmp_path / "runs"
    folder.mkdir()
    wrong(folder)
    coarse.seip.traffic.runs = str(folder)
    with pytest.raises(RuntimeError, match=words):
        bpy.ops.seip.solve_placement()
    assert not coarse.seip.result.record
    assert not (tmp_path / "cache").exists()
