"""The tutorial of docs/tutorial.md, played by mouse and keyboard: a test, and where its pictures come from.

.ci/window BLENDER OUT tests/window/tutorial.py scenes/junction.blend
"""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable, Generator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import bpy
from bl_ext.user_default.seip.seip_addon import preferences, scene_status
from bl_ext.user_default.seip.seip_addon.panels import run_button
from bl_ext.user_default.seip.seip_addon.session import SceneState, session
from driver import Steps, Window, play

TIMES: list[str] = []
"""What was drawn below bars."""


def _noted(times: Callable[..., str]) -> Callable[..., str]:
    def times_and_note(*given: float | None) -> str:
        TIMES.append(times(*given))
        return TIMES[-1]

    return times_and_note


run_button.times_text = _noted(run_button.times_text)

OUT = Path(sys.argv[sys.argv.index("--") + 1])
RUN = "junction_traffic/run-1.npz"
"""Of the traffic beside the scene."""
SUMO = next(Path(".venv").glob("lib/python*/site-packages/sumo"), None)
"""Folder of SUMO in the environment of the checkout."""


def scenario(window: Window) -> Steps:
    """Check, choose sensors, place, stop, place, look, undo, save, reopen, scan traffic, and simulate some."""
    yield from _begin(window)
    yield from _check(window)
    yield from _choose(window)
    yield from _place(window)
    yield from _look(window)
    yield from _undo_and_redo(window)
    yield from _save_and_reopen(window)
    yield from _scan(window)
    yield from _simulate(window)
    yield from _take_picture(window)


def _begin(window: Window) -> Steps:
    cache = OUT / "visibility"
    shutil.rmtree(cache, ignore_errors=True)
    preferences.own().cache = str(cache)
    copy = OUT / "junction.blend"
    shutil.copy(bpy.data.filepath, copy)
    shutil.copy(Path(bpy.data.filepath).with_suffix(".xodr"), OUT)  # traffic is simulated on it
    (OUT / RUN).parent.mkdir(exist_ok=True)
    shutil.copy(Path(bpy.data.filepath).parent / RUN, OUT / RUN)
    bpy.ops.wm.open_mainfile(filepath=str(copy))
    yield 1.5
    yield from window.open_sidebar("SEIP")
    yield from window.picture("1-sidebar")


def _check(window: Window) -> Steps:
    yield from window.click("seip.check_site(")
    yield from window.until(lambda: session.running is None, 60)
    yield from window.open_section("site")
    yield from window.open_section("contents")
    yield from window.picture("2-check")
    _scene().seip.sections.site = False


def _choose(window: Window) -> Steps:
    sections = _scene().seip.sections
    yield from window.open_section("sensors")
    yield from window.enter("seip.survey.heights", "8")
    yield from window.click("seip.choose_sensors(")
    yield 1.0
    yield from window.shot("3-table")
    yield from window.press("ESC")
    yield from window.open_section("beams")
    yield from window.click("seip.preview_beams(")
    yield from window.picture("4-beams")
    yield from window.click("seip.preview_beams(")
    sections.beams = sections.sensors = False


def _bar_moves(window: Window, button: tuple[int, int]) -> Generator[float, None, tuple[int, int]]:
    """See that a bar stands in place of a button, moves, and tells the time left; return where its Stop button is."""
    stop = yield from window.beside(button, "seip.stop(")
    before = window.filled(stop)
    yield from window.until(lambda: window.filled(stop) > before + 0.02, 60)
    yield from window.until(lambda: any("left" in words for words in TIMES), 10)
    assert session.running is not None, "the work ended before it could be stopped"
    return stop


def _place(window: Window) -> Steps:
    yield from window.enter("seip.goal.count", "2")
    button = yield from window.find("seip.solve_placement(")
    yield from window.press("LEFTMOUSE", button)
    yield from window.until(lambda: session.running is not None, 10)
    stop = yield from _bar_moves(window, button)
    yield from window.press("LEFTMOUSE", stop)
    yield from window.until(lambda: session.running is None, 0.5)
    yield 0.5  # until the sidebar is drawn again, with the button back in its place
    assert not _scene().seip.result.record
    assert _known() is None or _known().survey is None, "the run that was stopped went on"
    yield from window.press("LEFTMOUSE", button)
    yield from window.until(lambda: _scene().seip.result.record, 300)
    assert len(_empties()) == 2, _empties()
    (OUT / "placement.json").write_text(_scene().seip.result.record, encoding="utf-8")
    yield from window.picture("5-placement")


def _look(window: Window) -> Steps:
    yield from window.open_section("results")
    yield from window.open_section("view")
    yield from window.click("seip.colour_coverage(aspect='times'")
    yield from window.picture("6-coverage")
    yield from window.click("seip.look_from_sensor(")
    yield from window.picture("7-from-the-sensor")


def _undo_and_redo(window: Window) -> Steps:
    yield from window.press("Z", ctrl=True)
    yield from window.press("Z", ctrl=True)
    yield from window.until(lambda: not _empties() and not _scene().seip.result.record, 5)
    yield from window.press("Z", ctrl=True, shift=True)
    yield from window.press("Z", ctrl=True, shift=True)
    yield from window.until(lambda: len(_empties()) == 2 and _scene().seip.result.record, 5)


def _save_and_reopen(window: Window) -> Steps:
    yield from window.press("S", ctrl=True)
    yield from window.until(lambda: not bpy.data.is_dirty, 10)
    record = _scene().seip.result.record
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    yield 1.5
    yield from window.open_sidebar("SEIP")
    yield from window.press("NUMPAD_0")  # the camera's view
    assert _scene().seip.result.record == record
    yield from window.until(lambda: session.running is None and _known() is not None, 30)  # compared with the scene
    assert not scene_status.stale_placement(_scene())
    yield from window.open_section("results")
    yield from window.open_section("ranking")
    yield from window.click("seip.rank_candidates(")
    yield from window.until(lambda: len(_scene().seip.result.ranking), 60)
    yield from window.find("seip.rank_candidates(")
    yield from window.picture("8-ranking")


def _scan(window: Window) -> Steps:
    _scene().seip.traffic.file = f"//{RUN}"  # in place of the file browser
    yield from window.open_section("traffic")
    yield from window.open_section("scan")
    yield from window.click("seip.load_traffic(")
    yield from window.until(lambda: session.running is None and "SEIP Traffic" in bpy.data.collections, 60)
    _scene().frame_set(600)
    yield from window.click("seip.scan_frame(")
    yield from window.until(lambda: session.running is None, 60)
    yield 1.0
    yield from window.picture("9-scan")


def _simulate(window: Window) -> Steps:
    """Simulate traffic, stop that, simulate again, undo it and redo it; where SUMO is missing its button is there."""
    preferences.own().sumo = str(SUMO.resolve()) if SUMO is not None else ""
    _scene().seip.sections.scan = False
    yield from window.open_section("simulation")
    if preferences.sumo() is None:
        yield from window.find("seip.install_sumo(")
        sys.stdout.write("no traffic was simulated: SUMO is missing\n")
        return
    runs = OUT / "seip-traffic"
    shutil.rmtree(runs, ignore_errors=True)
    loaded = _scene().seip.traffic.file
    button = yield from window.find("seip.simulate_traffic(")
    yield from window.press("LEFTMOUSE", button)
    yield from window.until(lambda: session.running is not None, 10)
    stop = yield from window.beside(button, "seip.stop(")
    yield from window.until(lambda: window.filled(stop) > 0.1, 60)  # the first run is done
    yield from window.shot("10-simulating")
    assert session.running is not None, "the simulation ended before it could be stopped"
    yield from window.press("LEFTMOUSE", stop)
    yield from window.until(lambda: session.running is None, 0.5)
    yield from window.until(lambda: not runs.exists(), 5)  # SUMO's process has ended
    assert _scene().seip.traffic.file == loaded
    yield 0.5
    yield from window.press("LEFTMOUSE", button)
    yield from window.until((runs / "run-4.npz").exists, 300)
    yield from window.until(lambda: session.running is None, 10)
    assert _scene().seip.traffic.file == "//seip-traffic/run-1.npz", _scene().seip.traffic.file
    assert _scene().seip.detection.runs == _scene().seip.goal.runs == "//seip-traffic/"
    yield from window.press("Z", ctrl=True)
    yield from window.until(lambda: _scene().seip.traffic.file == loaded, 5)
    yield from window.press("Z", ctrl=True, shift=True)
    yield from window.until(lambda: _scene().seip.traffic.file != loaded, 5)
    _scene().frame_set(600)
    yield from window.click("seip.show_in_traffic(")
    yield 2.0
    yield from window.find("seip.simulate_traffic(")
    yield from window.picture("11-simulated")
    yield from window.click("seip.show_in_traffic(")


def _take_picture(window: Window) -> Steps:
    yield from window.open_section("export")
    yield from window.click("seip.save_picture(")
    yield from window.until((OUT / "placement.png").exists, 60)


def _scene() -> bpy.types.Scene:
    return bpy.context.window_manager.windows[0].scene


def _known() -> SceneState | None:
    return session.state_of(_scene())


def _empties() -> list[bpy.types.Object]:
    collection = bpy.data.collections.get("SEIP Sensors")
    return [obj for obj in collection.objects if obj.type == "EMPTY"] if collection else []


play(scenario, Window(OUT))
