"""The tutorial of docs/tutorial.md and what surrounds it, played by mouse and keyboard: a test that makes its pictures.

.ci/window BLENDER OUT tests/window/tutorial.py

The batch command then has the same placement as OUT/placement.json on OUT/example.blend.
"""

from __future__ import annotations

import json
import re
import shutil
import sys
import time
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent))

import bpy
from bl_ext.user_default.seip.seip_addon.panel import layout, overlays, placement, preferences, scene_status
from bl_ext.user_default.seip.seip_addon.panel.session import SceneState, session
from driver import Steps, Window, play
from mathutils import Vector

SAID: list[str] = []
"""Sentences that the sidebar has drawn."""
FIRST_ANSWER = re.compile(r"Visibility: .*\b[\d.]+ returns")
"""Line below the bar while the grids are still computed: phase, share done and value of the early answer."""


def _heard(sentence: Callable[..., None]) -> Callable[..., None]:
    def draw_and_note(layout: object, text: str, **more: object) -> None:
        SAID.append(text)
        sentence(layout, text, **more)

    return draw_and_note


for module in (placement, layout):
    module.draw_sentence = _heard(module.draw_sentence)

OUT = Path(sys.argv[sys.argv.index("--") + 1]).resolve()
SCENES = Path("scenes").resolve()
FOLDER = OUT / "result"
RUN = "junction_traffic/run-1.npz"
"""Of the traffic beside the scene."""
SUMO = next(Path(".venv").glob("lib/python*/site-packages/sumo"), None)
"""Folder of SUMO in the environment of the checkout."""


def scenario(window: Window) -> Steps:
    """Play all parts in turn."""
    for part in (
        _load_example,
        _check,
        _choose,
        _place,
        _look,
        _undo_and_redo,
        _save_and_reopen,
        _change_the_scene,
        _move_by_hand,
        _report,
        _scan,
        _simulate,
        _import_map,
        _search,
    ):
        began = time.monotonic()
        yield from part(window)
        sys.stdout.write(f"passed: {part.__name__} ({time.monotonic() - began:.0f} s)\n")
        sys.stdout.flush()


def _load_example(window: Window) -> Steps:
    """Build the shipped junction in Blender as it starts, by one click that needs no scrolling, and save it."""
    for folder in (OUT / "visibility", FOLDER):
        shutil.rmtree(folder, ignore_errors=True)
    preferences.own().cache = str(OUT / "visibility")
    yield from window.press("ESC")
    yield from window.open_sidebar("SEIP")
    yield from window.picture("1-sidebar")
    yield from window.click_in_view("seip.load_example(")
    yield from window.until(lambda: session.running is None and session.of(_scene()).check, 120)
    yield 1.0
    assert not session.of(_scene()).check.found.problems
    assert not {"Cube", "Light"} & set(_scene().objects.keys())
    bpy.ops.wm.save_as_mainfile(filepath=str(OUT / "example.blend"), copy=True)  # for the batch command
    bpy.ops.wm.save_as_mainfile(filepath=str(OUT / "junction.blend"))
    (OUT / RUN).parent.mkdir(exist_ok=True)
    shutil.copy(SCENES / RUN, OUT / RUN)


def _check(window: Window) -> Steps:
    yield from window.open_section("site")
    yield from window.open_section("contents")
    yield from window.picture("2-check")
    bpy.context.window_manager.seip_sections.site = False


def _choose(window: Window) -> Steps:
    sections = bpy.context.window_manager.seip_sections
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
    yield from window.until(lambda: session.running is None or "left" in session.running.shown[1], 10)
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
    SAID.clear()
    yield from window.press("LEFTMOUSE", button)
    yield from window.until(_drawn, 60)
    yield from window.shot("5-searching")
    assert not _sensors(), "sensors were written before the search ended"
    yield from window.until(lambda: _scene().seip.result.record, 300)
    assert not _drawn(), "the best so far is still drawn"
    assert any(FIRST_ANSWER.match(sentence) for sentence in SAID), "no answer was shown before the search"
    assert len(_sensors()) == 2, _sensors()
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
    yield from window.until(lambda: not _sensors() and not _scene().seip.result.record, 5)
    yield from window.press("Z", ctrl=True, shift=True)
    yield from window.press("Z", ctrl=True, shift=True)
    yield from window.until(lambda: len(_sensors()) == 2 and _scene().seip.result.record, 5)


def _save_and_reopen(window: Window) -> Steps:
    record = _record()
    yield from window.open_section("details")
    assert (yield from _says(window, "Proven"))
    yield from _reopen(window)
    assert _record() == record
    assert not scene_status.stale_placement(_scene())
    assert (yield from _says(window, "Proven"))


def _change_the_scene(window: Window) -> Steps:
    """See that a placement is compared with its scene when the file is opened."""
    building = _scene().objects["Building 1"]
    before = building.location.copy()
    corners = [building.matrix_world @ Vector(corner) for corner in building.bound_box]
    building.location -= Vector((*(sum(corners, Vector()) / len(corners)).xy, 0.0))  # into the junction
    yield from _reopen(window)
    assert not (yield from _says(window, "Proven"))
    assert (yield from _says(window, "have changed since this placement"))
    _scene().objects["Building 1"].location = before
    yield from _reopen(window)
    assert (yield from _says(window, "Proven"))


def _move_by_hand(window: Window) -> Steps:
    """Move a sensor by the keyboard, and evaluate the sensors where they are."""
    before = _record()
    _scene().seip.result.active_sensor = 0  # selects it
    yield from window.type("gz-2")
    yield from window.press("RET")
    there = _places()
    assert abs(there["S1"][2] - before["sensors"][0]["local_m"][2] + 2.0) < 1e-4
    assert not (yield from _says(window, "Proven"))
    assert (yield from _says(window, "By hand: S1 moved"))
    yield from window.click("seip.evaluate_sensors(")
    yield from window.until(lambda: session.running is None and _record() != before, 200)
    assert _places() == there
    assert (yield from _says(window, "Evaluated at the sensors' current poses"))
    assert not (yield from _says(window, "Proven"))


def _report(window: Window) -> Steps:
    """Export with a report, and see that all files tell of one placement."""
    _scene().seip.result.folder = str(FOLDER)
    bpy.context.window_manager.seip_sections.placement = False
    yield from window.open_section("export")
    yield from window.click("seip.export_result(")
    yield from window.until(lambda: session.running is None and (FOLDER / "report.pdf").exists(), 200)
    record = _record()
    written = json.loads((FOLDER / "placement.json").read_text(encoding="utf-8"))
    assert written["sensors"] == record["sensors"]
    yield from window.picture("8-report")
    bpy.context.window_manager.seip_sections.export = False


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
    bpy.context.window_manager.seip_sections.scan = False
    yield from window.open_section("simulation")
    if preferences.sumo() is None:
        yield from window.find("seip.install_sumo(")
        sys.stdout.write("no traffic was simulated: SUMO is missing\n")
        return
    runs = OUT / "seip-traffic"
    shutil.rmtree(runs, ignore_errors=True)
    loaded = _scene().seip.traffic.file
    _scene().seip.simulation.duration = 900.0  # long enough to be stopped
    button = yield from window.find("seip.simulate_traffic(")
    yield from window.press("LEFTMOUSE", button)
    yield from window.until(lambda: session.running is not None, 10)
    stop = yield from window.beside(button, "seip.stop(")
    yield from window.shot("10-simulating")
    assert session.running is not None, "the simulation ended before it could be stopped"
    yield from window.press("LEFTMOUSE", stop)
    yield from window.until(lambda: session.running is None, 0.5)
    yield from window.until(lambda: not runs.exists(), 5)  # SUMO's process has ended
    assert _scene().seip.traffic.file == loaded
    _scene().seip.simulation.duration = 120.0
    yield 0.5
    yield from window.press("LEFTMOUSE", button)
    yield from window.until((runs / "run-4.npz").exists, 300)
    yield from window.until(lambda: session.running is None, 10)
    assert _scene().seip.traffic.file == "//seip-traffic/run-1.npz", _scene().seip.traffic.file
    assert _scene().seip.traffic.runs == "//seip-traffic/"
    yield from window.press("Z", ctrl=True)
    yield from window.until(lambda: _scene().seip.traffic.file == loaded, 5)
    yield from window.press("Z", ctrl=True, shift=True)
    yield from window.until(lambda: _scene().seip.traffic.file != loaded, 5)
    _scene().frame_set(600)
    yield from window.find("seip.simulate_traffic(")
    yield from window.picture("11-simulated")


def _import_map(window: Window) -> Steps:
    """Import a map, as a dropped file is, through its map and the sidebar, into a scene of its own."""
    before = set(bpy.data.scenes)
    with bpy.context.temp_override(window=window.window, area=window.area, region=window.region("WINDOW")):
        bpy.ops.seip.choose_map("INVOKE_DEFAULT", filepath=str(SCENES / "corridor.xodr"))
    yield from window.until(lambda: session.running is None and "corridor" in _scene().seip.site.source, 60)
    yield 1.0
    yield from window.shot("12-map")
    yield from window.press("RET")  # from the map to the list of names
    yield 1.0
    yield from window.shot("12-place")
    yield from window.click("seip.build_site(")
    yield from window.until(lambda: session.running is None and set(bpy.data.scenes) - before, 120)
    yield from window.until(lambda: session.running is None and session.of(_scene()).check, 60)
    assert _scene() not in before


def _search(window: Window) -> Steps:
    """Find an operator by its name."""
    before = set(bpy.data.scenes)
    yield from window.press("F3")
    yield 1.0
    yield from window.type("load example")
    yield 1.0
    yield from window.shot("13-search")
    yield from window.press("RET")
    yield from window.until(lambda: session.running is None and set(bpy.data.scenes) - before, 120)


def _reopen(window: Window) -> Steps:
    """Save the file by the keyboard, open it again, and wait until it is compared with its scene."""
    file = Path(bpy.data.filepath)
    before = file.stat().st_mtime_ns
    yield from window.press("S", ctrl=True)
    yield from window.until(lambda: file.stat().st_mtime_ns > before and not bpy.data.is_dirty, 10)
    bpy.ops.wm.open_mainfile(filepath=str(file))
    yield 1.5
    yield from window.open_sidebar("SEIP")
    yield from window.press("NUMPAD_0")  # the camera's view
    yield from window.until(lambda: session.running is None and _known() is not None, 30)
    bpy.context.window_manager.seip_sections.details = True
    yield from window.open_section("placement")


def _says(window: Window, words: str) -> Generator[float, None, bool]:
    """Tell whether the sidebar, drawn again, says something."""
    window.area.tag_redraw()
    yield 0.3
    SAID.clear()
    window.area.tag_redraw()
    yield 0.7
    return any(words in sentence for sentence in SAID)


def _scene() -> bpy.types.Scene:
    return bpy.context.window_manager.windows[0].scene


def _record() -> dict[str, Any]:
    return dict(json.loads(_scene().seip.result.record))


def _known() -> SceneState | None:
    return session.of(_scene()).state


def _drawn() -> bool:
    """Tell whether the best placement so far is drawn in the view."""
    return overlays.find(_scene(), placement.SEARCH) is not None


def _sensors() -> list[bpy.types.Object]:
    collection = bpy.data.collections.get("SEIP Sensors")
    return [obj for obj in collection.objects if obj.type == "EMPTY"] if collection else []


def _places() -> dict[str, tuple[float, ...]]:
    return {obj["seip_label"]: tuple(obj.matrix_world.translation) for obj in _sensors()}


play(scenario, Window(OUT))
