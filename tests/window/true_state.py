"""Whether the sidebar tells the state as it is, played by mouse and keyboard.

.ci/window BLENDER OUT tests/window/true_state.py scenes/junction.blend
"""

from __future__ import annotations

import csv
import json
import shutil
import sys
import time
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent))

import bpy
from bl_ext.user_default.seip.seip_addon import preferences
from bl_ext.user_default.seip.seip_addon.core.choosing.placement.scenarios import DEFAULT_COUNTS
from bl_ext.user_default.seip.seip_addon.core.sensing.visibility import ray_casting
from bl_ext.user_default.seip.seip_addon.panels import detection, placement, results, site
from bl_ext.user_default.seip.seip_addon.session import session
from driver import Steps, Window, play
from mathutils import Vector

OUT = Path(sys.argv[sys.argv.index("--") + 1])
FOLDER, CACHE = OUT / "result", OUT / "visibility"
AT_MOST = 2.0
"""Seconds for which the window may not answer: it saves the scene, on a machine with work on all its cores."""


def scenario(window: Window) -> Steps:
    """Play each part on a copy of its own."""
    asked = sys.argv[sys.argv.index("--") + 2 :]
    parts = (
        _pose_errors_are_asked_for,
        _traffic_is_placed_on,
        _stopped_work_leaves_no_trace,
        _escape_is_for_the_animation,
        _changes_show_after_opening,
        _checks_grow_old,
        _poles_have_feet,
        _moved_sensors_stay,
        _exports_leave_the_window_alone,
        _detection_runs_in_another_python,
    )
    for part in parts:
        if asked and part.__name__ not in asked:
            continue
        yield from _begin(window)
        began = time.monotonic()
        yield from part(window)
        sys.stdout.write(f"passed: {part.__name__} ({time.monotonic() - began:.0f} s)\n")
        sys.stdout.flush()


def _begin(window: Window) -> Steps:
    copy = OUT / "copy.blend"
    shutil.copy(Path("scenes") / "junction.blend", copy)
    for folder in (FOLDER, CACHE):
        shutil.rmtree(folder, ignore_errors=True)
    preferences.own().cache = str(CACHE)
    yield from _open(window, copy)
    seip = _scene().seip
    seip.survey.heights, seip.survey.grid, seip.survey.spacing = "5", 2.0, 12.0
    seip.goal.count = 2
    seip.result.folder = str(FOLDER)
    for one in seip.survey.types:
        one.use = one.name in {"type1", "type2", "type3"}
    seip.sections.details = True
    yield from window.open_section("placement")


def _open(window: Window, path: Path) -> Steps:
    bpy.ops.wm.open_mainfile(filepath=str(path))
    yield 1.5
    yield from window.open_sidebar("SEIP")
    yield from window.press("NUMPAD_0")


def _press(window: Window, what: str, seconds: float = 200) -> Steps:
    """Press a button, and wait for its work."""
    yield from window.click(what)
    yield from window.until(lambda: session.running is None, seconds)
    yield 0.3


def _pose_errors_are_asked_for(window: Window) -> Steps:
    yield from window.open_section("objective")
    bpy.ops.seip.compute_visibility()
    rays = _counted_rays()
    yield from _press(window, "seip.solve_placement(")
    assert len(_sensors()) == 2
    nominal = sum(rays)  # from the chosen poses to the crossings: the grid is at hand
    assert not any("one of twenty" in note for note in _record()["notes"])
    _scene().seip.goal.scenarios, _scene().seip.goal.risk = "pose-errors", "none"
    yield 0.5
    yield from _press(window, "seip.solve_placement(")
    assert sum(rays) - nominal > 2 * nominal
    assert any("one of twenty" in note for note in _record()["notes"])


def _traffic_is_placed_on(window: Window) -> Steps:
    goal = _scene().seip.goal
    yield from window.open_section("objective")
    goal.scenarios, goal.risk, goal.runs = "traffic", "auto", str((Path("scenes") / "junction_traffic").resolve())
    DEFAULT_COUNTS["traffic"] = (4, 8)
    yield from window.picture("in-traffic")
    yield from _press(window, "seip.solve_placement(")
    assert any(note.startswith("this placement sees ") for note in _record()["notes"])
    assert (yield from _says(window, "This placement sees "))


def _stopped_work_leaves_no_trace(window: Window) -> Steps:
    yield from _press(window, "seip.solve_placement(")
    before = _record()
    _scene().seip.goal.count = 3
    with bpy.context.temp_override(window=window.window, area=window.area, region=window.region("UI")):
        bpy.ops.seip.solve_placement("INVOKE_DEFAULT")
    work = session.running.work
    while not work.ended:  # the window stands still: it cannot look at the result before Stop
        time.sleep(0.05)
    bpy.ops.seip.stop()
    yield from window.until(lambda: session.running is None, 1)
    assert _record() == before
    yield from _export(window)
    _agree(before)


def _escape_is_for_the_animation(window: Window) -> Steps:
    _scene().seip.survey.heights, _scene().seip.survey.grid = "3:8:0.5", 0.5  # a minute and more
    yield from window.click("seip.solve_placement(")
    yield from window.until(lambda: session.running is not None, 10)
    work = session.running.work
    yield from window.press("SPACE")
    yield from window.until(lambda: window.window.screen.is_animation_playing, 5)
    for _ in range(2):
        yield from window.press("ESC")
        yield 0.5
    assert not window.window.screen.is_animation_playing
    assert not work.ended, "the work ended before Esc was pressed"
    assert session.running is not None, "Esc stopped the computation"
    bpy.ops.seip.stop()
    yield from window.until(lambda: session.running is None, 1)


def _changes_show_after_opening(window: Window) -> Steps:
    yield from _press(window, "seip.solve_placement(")
    assert (yield from _says(window, "Proven"))
    yield from _save_and_open(window)
    assert (yield from _says(window, "Proven")), "nothing has changed"
    building = bpy.data.objects["Building 1"]
    corners = [building.matrix_world @ Vector(corner) for corner in building.bound_box]
    building.location -= Vector((*(sum(corners, Vector()) / len(corners)).xy, 0.0))  # into the junction
    yield from _save_and_open(window)
    assert not (yield from _says(window, "Proven"))
    assert (yield from _says(window, "have changed since this placement"))
    yield from window.find("seip.solve_placement(")
    yield from window.picture("changed")
    yield from _press(window, "seip.solve_placement(")
    assert (yield from _says(window, "Proven"))
    bpy.data.objects.remove(_sensors()[1])
    assert not (yield from _says(window, "Proven"))
    assert (yield from _says(window, "By hand: S2 deleted"))


def _checks_grow_old(window: Window) -> Steps:
    yield from window.open_section("site")
    yield from _press(window, "seip.check_site(")
    yield from window.open_section("site")
    assert not (yield from _says(window, "since the check"))
    yield from window.open_section("sensors")
    yield from window.enter("seip.survey.heights", "8")
    assert (yield from _says(window, "The settings have changed since the check"))
    yield from window.find("seip.check_site(")
    yield from window.picture("old-check")


def _poles_have_feet(window: Window) -> Steps:
    bpy.ops.seip.compute_visibility()
    candidates = session.state_of(_scene()).layout.site.candidates
    foot = next(
        place for place, on_pole in zip(candidates.position.tolist(), candidates.on_pole, strict=True) if not on_pole
    )
    with bpy.context.temp_override(window=window.window, area=window.area, region=window.region("WINDOW")):
        bpy.ops.mesh.primitive_cylinder_add(radius=0.1, depth=6.0, location=(foot[0], foot[1], foot[2] + 3.0))
    _scene().seip.site.role = "POLES"
    yield from window.open_section("site")
    yield from window.open_section("roles")
    yield from window.click("seip.assign_role(")
    yield from _press(window, "seip.check_site(")
    assert any("'Cylinder' is not at the foot" in problem.text for problem in _scene().seip.site.problems)
    bpy.ops.seip.compute_visibility()
    candidates = session.state_of(_scene()).layout.site.candidates
    names = candidates.position_name[candidates.position_of].tolist()
    heights = {z for name, z in zip(names, candidates.xyz[:, 2].tolist(), strict=True) if name == "Cylinder"}
    assert {round(z - foot[2], 3) for z in heights} == {5.0}, heights


def _moved_sensors_stay(window: Window) -> Steps:
    yield from _press(window, "seip.solve_placement(")
    before = _record()
    _scene().seip.result.active_sensor = 0  # selects it
    yield from window.type("gz-2")
    yield from window.press("RET")
    there = _places()
    assert abs(there["S1"][2] - before["sensors"][0]["local_m"][2] + 2.0) < 1e-4
    assert not (yield from _says(window, "Proven"))
    assert (yield from _says(window, "By hand: S1 moved"))
    yield from window.find("seip.solve_placement(")
    yield from window.picture("moved")
    yield from _press(window, "seip.evaluate_sensors(")
    assert _places() == there
    assert (yield from _says(window, "Moved by hand"))
    assert not (yield from _says(window, "Proven"))
    yield from _export(window)
    assert _places() == there
    assert _record()["objective"]["status"] == "moved by hand"
    _agree(_record())


def _exports_leave_the_window_alone(window: Window) -> Steps:
    yield from _press(window, "seip.solve_placement(")
    _scene().seip.result.render = True
    gaps = _Gaps()
    yield from _export(window)
    gaps.end()
    assert (FOLDER / "view.png").is_file()
    sys.stdout.write(f"the window was away for {gaps.longest:.2f} s at most\n")
    assert gaps.longest < AT_MOST, f"the window did not answer for {gaps.longest:.1f} s"
    layout = [(area.type, area.width, area.height) for area in window.window.screen.areas]
    yield from window.click("seip.show_plan(")
    yield 1.0
    _, opened = bpy.context.window_manager.windows
    (editor,) = opened.screen.areas
    assert Path(bpy.path.abspath(editor.spaces.active.image.filepath)) == FOLDER / "plan.png"
    yield from window.shot("plan")
    with bpy.context.temp_override(window=opened):
        bpy.ops.wm.window_close()
    yield 1.0
    assert [(area.type, area.width, area.height) for area in window.window.screen.areas] == layout
    before = {path.name: path.read_bytes() for path in FOLDER.iterdir()}
    yield from window.click("seip.export_result(")
    yield from window.until(lambda: session.running.work.progress.what == "rendering", 60)
    yield from window.until(lambda: session.running.work.progress.done > 0, 60)
    yield from window.picture("export")
    bpy.ops.seip.stop()
    yield from window.until(lambda: session.running is None, 1)
    yield 2.0
    assert {path.name: path.read_bytes() for path in FOLDER.iterdir()} == before, "a stopped export left something"


DETECT = """
import json, pathlib, sys, time
output = pathlib.Path(sys.argv[sys.argv.index("-o") + 1])
for done in range(30):
    print(f"detect in run-1:  {done / 30:.0%}|##   | {done}/30 [00:02<00:06]", file=sys.stderr, flush=True)
    time.sleep(0.3)
output.mkdir()
figure = {"average_precision": 0.7125, "interval": [0.66, 0.775], "road_users": 1234}
rules = ("bev_0.7", "car_van_0.7", "truck_bus_0.7", "motorcycle_bicycle_0.5", "pedestrian_0.5")
warnings = ["the detector was trained on clouds of type1, not of type2"]
record = {"schema": "seip-detection/1", "average_precision": dict.fromkeys(rules, figure), "warnings": warnings}
(output / "errors.png").write_bytes(b"picture")
(output / "detection.json").write_text(json.dumps(record))
"""
"""What stands in for the command: there is no PyTorch in every Python."""


def _detection_runs_in_another_python(window: Window) -> Steps:
    yield from _press(window, "seip.solve_placement(")
    asked, runs = _scene().seip.detection, (Path("scenes") / "junction_traffic").resolve()
    _scene().seip.traffic.file, asked.runs = str(runs / "run-1.npz"), str(runs)
    asked.folder = str(OUT / "detection")
    shutil.rmtree(OUT / "detection", ignore_errors=True)
    yield from window.open_section("traffic")
    yield from window.open_section("detection")
    assert (yield from _says(window, "needs a Python with PyTorch"))
    yield from window.picture("no-torch")
    package, python = OUT / "project" / "headless", OUT / "project" / ".venv" / "bin" / "python"
    for folder in (package, python.parent):
        folder.mkdir(parents=True, exist_ok=True)
    (package / "__init__.py").touch()
    (package / "__main__.py").write_text(DETECT, encoding="utf-8")
    python.unlink(missing_ok=True)
    python.symlink_to(sys.executable)
    preferences.own().python = str(python)
    yield from window.click("seip.detect(")
    yield from window.until(lambda: session.running.work.progress.done > 5, 30)
    yield from window.picture("detecting")
    bpy.ops.seip.stop()
    yield from window.until(lambda: session.running is None, 1)
    yield from window.until(lambda: not (OUT / "detection").exists(), 2)
    yield from _press(window, "seip.detect(")
    assert {path.name for path in (OUT / "detection").iterdir()} == {"detection.json", "errors.png"}
    assert (yield from _says(window, "trained on clouds"))
    yield from window.find("wm.path_open(")
    yield from window.picture("detected")
    preferences.own().python = ""


class _Gaps:
    """The longest time for which the window did nothing else."""

    def __init__(self) -> None:
        self.longest = 0.0
        self._last = time.monotonic()
        self._over = False
        bpy.app.timers.register(self._look)

    def _look(self) -> float | None:
        now = time.monotonic()
        self.longest, self._last = max(self.longest, now - self._last), now
        return None if self._over else 0.05

    def end(self) -> None:
        self._over = True


def _export(window: Window) -> Steps:
    yield from window.open_section("export")
    yield from _press(window, "seip.export_result(")


def _agree(record: dict[str, Any]) -> None:
    """See that all files of an export tell of one placement."""
    written = json.loads((FOLDER / "placement.json").read_text(encoding="utf-8"))
    assert written["sensors"] == record["sensors"]
    rows = list(csv.DictReader((FOLDER / "candidates.csv").read_text(encoding="utf-8").splitlines()))
    poses = {row["chosen"]: row["pose"] for row in rows if row["chosen"]}
    assert poses == {line["id"]: "" if line["pose"] is None else str(line["pose"]) for line in record["sensors"]}
    spawned = json.loads((FOLDER / "carla_spawn.json").read_text(encoding="utf-8"))
    assert [one["id"] for one in spawned] == [line["id"] for line in record["sensors"]]


def _save_and_open(window: Window) -> Steps:
    file = Path(bpy.data.filepath)
    before = file.stat().st_mtime_ns
    yield from window.press("S", ctrl=True)
    yield from window.until(lambda: file.stat().st_mtime_ns > before and not bpy.data.is_dirty, 10)
    yield from _open(window, file)
    yield from window.until(lambda: session.running is None, 30)
    yield 1.0


_said: list[str] = []


def _says(window: Window, words: str) -> Generator[float, None, bool]:
    """Tell whether the sidebar, drawn again, says something."""
    window.area.tag_redraw()
    yield 0.3
    _said.clear()
    window.area.tag_redraw()
    yield 0.7
    return any(words in sentence for sentence in _said)


def _listen() -> None:
    for module in (placement, results, site, detection):

        def drawn(layout: Any, text: str, *, then: Callable[..., None] = module.draw_sentence, **more: object) -> None:
            _said.append(text)
            then(layout, text, **more)

        module.draw_sentence = drawn


def _counted_rays() -> list[int]:
    counts: list[int] = []
    for caster in (ray_casting.BvhRayCaster, ray_casting.EmbreeRayCaster):

        def cast(
            self: Any, origin: Any, directions: Any, reach: float, *, then: Callable[..., Any] = caster.cast
        ) -> Any:
            counts.append(len(directions))
            return then(self, origin, directions, reach)

        caster.cast = cast
    return counts


def _scene() -> bpy.types.Scene:
    return bpy.context.window_manager.windows[0].scene


def _record() -> dict[str, Any]:
    return dict(json.loads(_scene().seip.result.record))


def _sensors() -> list[bpy.types.Object]:
    objects = [obj for obj in bpy.data.collections["SEIP Sensors"].objects if obj.type == "EMPTY"]
    return sorted(objects, key=lambda obj: str(obj["seip_label"]))


def _places() -> dict[str, tuple[float, ...]]:
    return {obj["seip_label"]: tuple(obj.matrix_world.translation) for obj in _sensors()}


_listen()
play(scenario, Window(OUT))
