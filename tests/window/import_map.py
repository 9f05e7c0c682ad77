"""A map from File ▸ Import to the report, played by mouse and keyboard in Blender as it starts.

SEIP_UI_SCALE=2 .ci/window BLENDER OUT tests/window/import_map.py
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import bpy
from bl_ext.user_default.seip.seip_addon import preferences
from bl_ext.user_default.seip.seip_addon.session import session
from bl_ext.user_default.seip.seip_addon.viewport.free_frame import Box, free_frame, navigation_boxes
from bl_ext.user_default.seip.seip_addon.viewport.legend import placed_legend
from bl_ext.user_default.seip.seip_addon.viewport.overlays import legend_blocks
from driver import Steps, Window, play

OUT = Path(sys.argv[sys.argv.index("--") + 1])
MAP = (Path("scenes") / "corridor.xodr").resolve()


def scenario(window: Window) -> Steps:
    """Import a map, place sensors, write the report, and look at the legend beside the gizmos of navigation."""
    bpy.context.preferences.view.show_splash = False
    bpy.context.preferences.view.filebrowser_display_type = "SCREEN"
    preferences.own().cache = str(OUT / "visibility")
    yield from window.press("ESC")
    yield 1.0
    yield from _import(window)
    yield from _place(window)
    yield from _report(window)
    yield from _close_sidebar(window)


def _import(window: Window) -> Steps:
    yield from window.press("F3")
    yield 1.0
    yield from window.type("opendrive")
    yield 1.0
    yield from window.shot("1-search")
    yield from window.press("RET")
    yield from window.until(lambda: _browser(window) is not None, 10)
    yield 1.0
    browser = _browser(window)
    parameters = browser.spaces.active.params
    parameters.directory, parameters.filename = str(MAP.parent).encode(), MAP.name
    yield 1.0
    yield from window.shot("2-browser")
    with bpy.context.temp_override(window=window.window, area=browser):
        bpy.ops.file.execute("INVOKE_DEFAULT")
    yield from window.until(lambda: session.running is None and _scene().seip.site.source, 60)
    yield 1.5
    yield from window.shot("3-dialog")
    yield from window.press("RET")
    yield from window.until(lambda: session.running is None and _scene().seip.site.checked, 180)
    yield 1.0
    yield from window.picture("4-site")


def _place(window: Window) -> Steps:
    _scene().seip.survey.heights, _scene().seip.survey.grid, _scene().seip.survey.spacing = "8", 2.0, 12.0
    yield from window.enter("seip.goal.count", "2")
    yield from window.click("seip.solve_placement(")
    yield from window.until(lambda: session.running is None and _scene().seip.result.record, 400)
    yield from window.picture("5-placement")


def _report(window: Window) -> Steps:
    _scene().seip.result.folder, _scene().seip.result.render = str(OUT / "result"), False
    yield from window.open_section("export")
    yield from window.click("seip.write_report(")
    yield from window.until(lambda: session.running is None and (OUT / "result" / "report.pdf").exists(), 200)
    yield from window.find("seip.show_plan(")
    yield from window.picture("6-report")


def _close_sidebar(window: Window) -> Steps:
    window.area.spaces.active.show_region_ui = False
    yield 1.0
    yield from window.picture("7-without-sidebar")
    frame = free_frame(window.area, window.region("WINDOW"))
    scale = float(bpy.context.preferences.system.ui_scale)
    gizmos = navigation_boxes(window.area.spaces.active, frame, scale)
    legend, _ = placed_legend(legend_blocks(_scene()), frame, scale, gizmos)
    assert gizmos
    assert all(_are_apart(legend, gizmo) for gizmo in gizmos), (legend, gizmos)


def _are_apart(one: Box, other: Box) -> bool:
    return one[2] <= other[0] or other[2] <= one[0] or one[3] <= other[1] or other[3] <= one[1]


def _browser(window: Window) -> bpy.types.Area | None:
    return next((area for area in window.window.screen.areas if area.type == "FILE_BROWSER"), None)


def _scene() -> bpy.types.Scene:
    return bpy.context.window_manager.windows[0].scene


play(scenario, Window(OUT))
