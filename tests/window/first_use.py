"""First use, played by mouse and keyboard: from Blender as it starts to a placement, without scrolling.

SEIP_SIZE=1280x800 .ci/window BLENDER OUT tests/window/first_use.py
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import bpy
from bl_ext.user_default.seip.seip_addon import preferences
from bl_ext.user_default.seip.seip_addon.session import session
from driver import Steps, Window, play

OUT = Path(sys.argv[sys.argv.index("--") + 1])
MOST_CLICKS = 6
STEPS = ("site", "sensors", "placement")


def scenario(window: Window) -> Steps:
    """Load the example and place sensors, with every button in view, then look at the table of sensors."""
    bpy.context.preferences.view.show_splash = False
    preferences.own().cache = str(OUT / "visibility")
    yield from window.press("ESC")
    yield from window.open_sidebar("SEIP")
    yield from window.picture("1-start")
    clicks = 0
    began = time.monotonic()
    for name, button, done in (
        ("2-site", "seip.load_example(", lambda: _scene().seip.site.checked),
        ("3-placement", "seip.solve_placement(", lambda: _scene().seip.result.record),
    ):
        yield from window.click_in_view(button)
        clicks += 1
        yield 1.0
        yield from window.picture(f"{name}-running")
        yield from window.until(lambda done=done: session.running is None and done(), 400)
        yield 1.0
        yield from window.picture(name)
    assert clicks <= MOST_CLICKS
    sys.stdout.write(f"from Load Example to a placement: {clicks} clicks, {time.monotonic() - began:.0f} s\n")
    assert not _scene().seip.site.problems, [one.text for one in _scene().seip.site.problems]
    sections = _scene().seip.sections
    assert [getattr(sections, step) for step in STEPS] == [False, False, True]
    sections.details = True
    yield from window.picture("4-details")
    sections.details = False
    sections.sensors = True
    yield from window.picture("5-sensors")
    yield from window.click_in_view("seip.choose_sensors(")
    yield 1.0
    yield from window.shot("6-table")
    yield from window.press("ESC")
    sections.sensors = False
    yield from _place_fewer(window)


def _place_fewer(window: Window) -> Steps:
    """Choose a smaller number among the answers, place again, and look at the sensors and the export."""
    scene = _scene()
    sections = scene.seip.sections
    sections.numbers = True
    yield from window.picture("7-numbers")
    yield from window.click_in_view("seip.choose_number(count=3")
    yield 1.0
    assert scene.seip.goal.count == 3
    yield from window.picture("8-other-goal")
    yield from window.click_in_view("seip.solve_placement(")
    yield 1.0
    yield from window.until(lambda: session.running is None and len(scene.seip.result.sensors) == 3, 400)
    assert "less" in scene.seip.result.change
    yield from window.picture("9-fewer")
    sections.placement = False
    sections.results = True
    sections.view = True
    yield from window.picture("10-results")
    sections.results = False
    sections.export = True
    yield from window.picture("11-export")


def _scene() -> bpy.types.Scene:
    return bpy.context.window_manager.windows[0].scene


play(scenario, Window(OUT))
