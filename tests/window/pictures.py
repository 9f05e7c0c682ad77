"""What the viewport and the plan show: legend and labels clear of the toolbar, the plan as large as its window.

SEIP_UI_SCALE=2 .ci/window BLENDER OUT tests/window/pictures.py
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import bpy
from bl_ext.user_default.seip.seip_addon import preferences
from bl_ext.user_default.seip.seip_addon.session import session
from bl_ext.user_default.seip.seip_addon.viewport.free_frame import free_frame, navigation_boxes
from bl_ext.user_default.seip.seip_addon.viewport.legend import placed_legend
from bl_ext.user_default.seip.seip_addon.viewport.overlays import legend_blocks
from driver import Steps, Window, play

OUT = Path(sys.argv[sys.argv.index("--") + 1])
LEAST_SHARE = 0.6
"""Of a window's width or height that the plan in it takes."""


def scenario(window: Window) -> Steps:
    """Place sensors on the example, look at legend and labels, and show the exported plan."""
    bpy.context.preferences.view.show_splash = False
    preferences.own().cache = str(OUT / "visibility")
    yield from window.press("ESC")
    yield from window.open_sidebar("SEIP")
    yield from _work(window, "load_example", lambda: _scene().seip.site.checked)
    _scene().seip.goal.count = 3
    yield from _work(window, "solve_placement", lambda: _scene().seip.result.record)
    bpy.context.preferences.system.use_region_overlap = True
    yield 1.0
    yield from window.picture("1-legend")
    region = window.region("WINDOW")
    frame = free_frame(window.area, region)
    gizmos = navigation_boxes(window.area.spaces.active, frame, _ui_scale())
    (left, bottom, right, top), _ = placed_legend(legend_blocks(_scene()), frame, _ui_scale(), gizmos)
    assert frame[0] <= left < right <= frame[2], (left, right, frame)
    assert frame[1] <= bottom < top <= frame[3], (bottom, top, frame)
    window.area.spaces.active.show_region_ui = False
    yield from window.picture("2-without-sidebar")
    window.area.spaces.active.show_region_ui = True
    yield from _watch_traffic(window)
    yield from window.open_section("export")
    _scene().seip.result.folder, _scene().seip.result.render = str(OUT / "result"), False
    yield from _work(window, "export_result", (OUT / "result" / "plan.png").exists)
    main = window.area
    with bpy.context.temp_override(window=window.window, area=main, region=window.region("WINDOW")):
        bpy.ops.seip.show_plan()
    yield 2.0
    yield from window.shot("3-plan")
    other = next(one for one in bpy.context.window_manager.windows if one.screen.is_temporary)
    area = next(area for area in other.screen.areas if area.type == "IMAGE_EDITOR")
    region = next(region for region in area.regions if region.type == "WINDOW")
    shares = _shown(area.spaces.active.image, region)
    assert LEAST_SHARE <= max(shares) <= 1.0, shares


def _watch_traffic(window: Window) -> Steps:
    """See the coverage change with the frame, by the timer that Blender runs."""
    yield from _work(window, "load_traffic", lambda: session.traffic)
    yield from _work(window, "show_in_traffic", lambda: session.in_traffic)
    yield from window.open_section("traffic")
    shares = []
    for frame in (300, 600, 900):
        before = session.in_traffic.coverage
        _scene().frame_set(frame)
        yield from window.until(lambda before=before: session.in_traffic.coverage != before, 10)
        shares.append(session.in_traffic.coverage)
        sys.stdout.write(f"coverage at frame {frame}: {shares[-1]:.2%}\n")
    yield from window.picture("4-traffic")
    _scene().seip.sections.traffic, _scene().seip.sections.numbers = False, True
    yield from window.picture("5-numbers")
    _scene().seip.sections.numbers = False
    assert len(set(shares)) == len(shares), shares
    assert not session.in_traffic.problem, session.in_traffic.problem
    bpy.ops.seip.show_in_traffic()


def _shown(image: bpy.types.Image, region: bpy.types.Region) -> tuple[float, float]:
    """Return which shares of an editor's width and height an image takes."""
    low, high = region.view2d.view_to_region(0, 0, clip=False), region.view2d.view_to_region(1, 1, clip=False)
    assert image.size[0] > 0
    return (high[0] - low[0]) / region.width, (high[1] - low[1]) / region.height


def _work(window: Window, operator: str, done: object) -> Steps:
    with bpy.context.temp_override(window=window.window, area=window.area, region=window.region("WINDOW")):
        getattr(bpy.ops.seip, operator)("INVOKE_DEFAULT")
    yield from window.until(lambda: session.running is None and done(), 400)
    yield 1.0


def _ui_scale() -> float:
    return float(bpy.context.preferences.system.ui_scale)


def _scene() -> bpy.types.Scene:
    return bpy.context.window_manager.windows[0].scene


play(scenario, Window(OUT))
