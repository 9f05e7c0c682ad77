"""The front door, played by mouse and keyboard in Blender as it starts: a dropped map, its dialog, and the search.

.ci/window BLENDER OUT tests/window/front_door.py
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import bpy
from bl_ext.user_default.seip.seip_addon.session import session
from driver import Steps, Window, play

OUT = Path(sys.argv[sys.argv.index("--") + 1])
MAP = (Path("scenes") / "corridor.xodr").resolve()


def scenario(window: Window) -> Steps:
    """Import a map through the dialog, then find the example by its name."""
    bpy.context.preferences.view.show_splash = False
    yield from window.press("ESC")
    yield 1.0
    yield from _import(window)
    yield from _search(window)


def _import(window: Window) -> Steps:
    with bpy.context.temp_override(window=window.window, area=window.area, region=window.region("WINDOW")):
        bpy.ops.seip.choose_map("INVOKE_DEFAULT", filepath=str(MAP))  # as a dropped file is
    yield from window.until(lambda: session.running is None and _scene().seip.site.source, 60)
    yield 1.0
    yield from window.shot("dialog")
    yield from window.press("RET")
    yield from window.until(lambda: session.running is not None or "SEIP Region" in bpy.data.collections, 10)
    yield from window.until(lambda: session.running is None and "SEIP Region" in bpy.data.collections, 120)
    assert not {"Cube", "Light", "Camera"} & set(_scene().objects.keys())
    yield 2.0
    assert window.region("UI").active_panel_category == "SEIP"
    yield from window.picture("imported")


def _search(window: Window) -> Steps:
    before = len(bpy.data.scenes)
    yield from window.press("F3")
    yield 1.0
    yield from window.type("load example")
    yield 1.0
    yield from window.shot("search")
    yield from window.press("RET")
    yield from window.until(lambda: session.running is None and len(bpy.data.scenes) > before, 120)
    yield 2.0
    yield from window.picture("example")


def _scene() -> bpy.types.Scene:
    return bpy.context.window_manager.windows[0].scene


play(scenario, Window(OUT))
