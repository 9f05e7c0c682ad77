"""What the add-on says where something is not as it should be: one sentence, and no traceback."""

import json
import re
import time
from unittest.mock import MagicMock

import bpy
import pytest

from seip_addon.core.base.acceptance import Acceptance
from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import Pace, Progress
from seip_addon.core.choosing.placement.search_limits import SolverLimits
from seip_addon.core.output.results.answer import sentence
from seip_addon.core.output.results.placement_record import parsed_record
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.visibility.grid import compute_visibility
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.panel import placement as placement_panel
from seip_addon.panel import preferences, scene_status, work
from seip_addon.panel.layout import draw_run
from seip_addon.panel.session import RunningWork, session
from tests.builders.drawn_layout import DrawnLayout
from tests.builders.synthetic_junction import junction_site


@pytest.fixture
def linked(add_on, small_scene):
    with bpy.data.libraries.load(str(small_scene), link=True) as (theirs, ours):
        ours.scenes = theirs.scenes
    own = bpy.context.scene
    bpy.context.window.scene = next(scene for scene in bpy.data.scenes if scene.library is not None)
    yield bpy.context.scene
    bpy.context.window.scene = own


def test_a_linked_scene_is_not_written_into(linked):
    for button in ("solve_placement", "add_area", "assign_role", "load_traffic"):
        with pytest.raises(RuntimeError, match="linked from another file"):
            getattr(bpy.ops.seip, button)()


def test_a_damaged_record_is_not_shown_and_has_its_sentence(placed):
    whole = placed.seip.result.record
    for change, words in (
        (lambda record: record.clear(), "has the schema None"),
        (lambda record: record["sensors"][0].pop("pose"), r"sensors\[0\]\.pose is missing"),
        (lambda record: record["settings"]["goal"].update(budget=-1.0), "the budget must be .*; place the sensors"),
    ):
        record = json.loads(whole)
        change(record)
        placed.seip.result.record = json.dumps(record)
        assert re.search(words, scene_status.no_placement(placed))
        for button in (bpy.ops.seip.follow_sensors, bpy.ops.seip.evaluate_sensors, bpy.ops.seip.keep_placement):
            assert not button.poll()
    bpy.ops.seip.solve_placement()
    assert not scene_status.no_placement(placed)


def test_the_panel_says_what_the_record_holds(placed, monkeypatch):
    record = json.loads(placed.seip.result.record)
    said = []
    monkeypatch.setattr(placement_panel, "draw_sentence", lambda _, text, **__: said.append(text))
    placement_panel.draw(DrawnLayout(), bpy.context)
    share = f"{record['coverage']['whole']:.1%}"
    assert said[0] == f"{share} of the road is seen. By the criterion, no placement of these candidates is better."
    notes = {sentence(note) for note in record["notes"]}
    assert not notes & set(said)
    bpy.context.window_manager.seip_sections.details = True
    placement_panel.draw(DrawnLayout(), bpy.context)
    assert notes < set(said)
    assert "Proven by the criterion: the best placement among these candidates." in said
    figures = placement_panel.figures(parsed_record(placed.seip.result.record))
    assert dict(figures["Seen"])["Road"] == f"{record['coverage']['whole']:.2%}"
    assert dict(figures["Price"])["Total"] == f"${record['price_usd']:,.0f}"


def test_a_cache_that_cannot_be_written_is_named_before_anything_is_cast(junction, tmp_path, monkeypatch):
    file = tmp_path / "file"
    file.touch()
    monkeypatch.setattr(preferences, "cache_folder", lambda: file)
    with pytest.raises(RuntimeError, match=r"cannot write to .*file.* as Cache in the add-on's preferences"):
        bpy.ops.seip.solve_placement()


def endless():
    while True:
        yield Progress(0, 0, "endless")


def test_work_under_way_ends_with_the_add_on(add_on):
    running = session.running = RunningWork("seip.check_site", endless())
    running.timer = bpy.context.window_manager.event_timer_add(1.0, window=bpy.context.window)
    work.forget()
    assert session.running is None
    assert running.timer is None
    assert running.join(5.0)


def test_the_best_so_far_can_be_used_while_a_search_runs_and_only_then(placed, monkeypatch):
    assert not bpy.ops.seip.accept.poll()
    acceptance = Acceptance()
    monkeypatch.setattr(session, "running", RunningWork("seip.solve_placement", MagicMock(), acceptance=acceptance))
    assert not bpy.ops.seip.accept.poll()  # rays are still cast
    SolverLimits(acceptance=acceptance).work()
    assert bpy.ops.seip.accept() == {"FINISHED"}
    assert acceptance.accepted


def test_progress_in_the_sidebar_names_phase_value_gap_and_time(add_on, monkeypatch):
    acceptance = Acceptance()
    acceptance.searching = True
    running = RunningWork("seip.solve_placement", MagicMock(), acceptance=acceptance)
    running.shown = (Progress(0, 0, "improving the placement", best="71% of the road", gap=0.052), "8 s elapsed")
    monkeypatch.setattr(session, "running", running)
    layout = DrawnLayout()
    draw_run(layout, "seip.solve_placement")
    assert layout.bars == [(0.0, "8 s elapsed")]
    assert layout.text == "Improving the placement: 71% of the road, gap at most 5.2%"
    assert [name for name, _ in layout.operators] == ["seip.accept", "seip.stop"]


SITE = junction_site(positions=80, heights=[4.0, 6.0, 8.0], spacing=1.0)
MODELS = load_catalogue()


def test_an_error_comes_back():
    def failing():
        yield Progress(0, 1, "fail")
        raise SeipError("no")

    work = RunningWork("", failing())
    with pytest.raises(SeipError, match="no"):
        work.result()


def test_the_pace_tells_how_long_it_takes_still():
    pace = Pace()
    pace.note(Progress(0, 0, "set up"), 0.0)
    assert pace.seconds_left is None
    pace.note(Progress(10, 100, "rays"), 50.0)
    assert pace.seconds_left is None
    pace.note(Progress(40, 100, "rays"), 56.0)
    assert pace.seconds_left == pytest.approx(12.0)


@pytest.mark.parametrize("engine", ["bvh", "auto"])
def test_stopped_visibility_ends_soon(engine):
    if engine == "bvh":
        pytest.importorskip("bpy")
    work = RunningWork("", compute_visibility(SITE, MODELS, VisibilitySettings(), engine))
    while not work.progress.total:
        time.sleep(0.01)
    time.sleep(0.2)
    work.stop()
    began = time.perf_counter()
    assert work.join(5.0)
    assert time.perf_counter() - began < 0.5
