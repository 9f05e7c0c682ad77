"""An extract of OpenStreetMap played in a window: a junction is picked on the map, and all say that SUMO is missing.

.ci/window BLENDER OUT tests/window/openstreetmap.py; SEIP_EXTRACT names an extract
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import bpy
import numpy as np
from bl_ext.user_default.seip.seip_addon import preferences
from bl_ext.user_default.seip.seip_addon.core.output.pictures.palette import MAP_GROUND, rgb
from bl_ext.user_default.seip.seip_addon.session import session
from bl_ext.user_default.seip.seip_addon.viewport.free_frame import free_frame
from bl_ext.user_default.seip.seip_addon.viewport.street_map import DOT_RADII, HOVERED, STEP, StreetMap
from driver import Steps, Window, play

OUT = Path(sys.argv[sys.argv.index("--") + 1])
EXTRACT = Path(os.environ.get("SEIP_EXTRACT", Path("scenes") / "harbour.osm")).resolve()
GROUND = np.array([round(255 * part) for part in rgb(MAP_GROUND)])
LIGHT, DARK, NEARLY, MOSTLY = 200, 90, 12, 0.7
"""Of pixels: least of a dot, most of the ground, difference of two equal ones, their share where there is a map."""
NOTCHES, EDGE = 4, 60
"""Of the wheel, and pixels from the edge of the map to the row that is looked at."""


def scenario(window: Window) -> Steps:
    """Choose an extract and a junction on its map, and look at all places that state that SUMO is missing."""
    bpy.context.preferences.view.show_splash = False
    yield from window.press("ESC")
    yield from window.open_sidebar("SEIP")
    assert preferences.sumo() is None, preferences.sumo_status()
    with bpy.context.temp_override(window=window.window, area=window.area, region=window.region("WINDOW")):
        bpy.ops.seip.choose_map("INVOKE_DEFAULT", filepath=str(EXTRACT))  # as a dropped file is
    yield from window.until(lambda: session.running is None and _site().source, 60)
    yield 1.0
    yield from _pick(window)
    yield from window.shot("4-dialog")
    yield from window.press("ESC")
    yield 1.0
    yield from window.picture("5-sidebar")
    assert not bpy.ops.seip.build_site.poll()
    bpy.context.preferences.system.use_online_access = True
    yield from window.open_section("sources")
    _site().buildings = _site().terrain = _site().meshes = "//town"
    yield 1.0
    yield from window.picture("6-sources")
    assert bpy.ops.seip.install_sumo.poll()
    window.area.type = "PREFERENCES"
    bpy.context.preferences.active_section = "ADDONS"
    bpy.context.window_manager.addon_search = "SEIP"
    bpy.ops.preferences.addon_expand(module=preferences.ADDON_ID)
    yield 2.0
    yield from window.shot("7-preferences")


def _pick(window: Window) -> Steps:
    """Zoom and pan the map, leave it, and pick a junction on it."""
    region, expected = window.region("WINDOW"), _expected(window)
    _assert_drawn(window, expected)
    yield from window.shot("1-map")
    one = int(expected.shown()[-1])
    x, y = _pixel(window, expected, one)
    yield from _move(window, (x, y))
    for _ in range(NOTCHES):
        yield from window.press("WHEELUPMOUSE", (x, y))
    expected.view = expected.view.zoomed(STEP**NOTCHES, (x - region.x, y - region.y))
    _assert_drawn(window, expected, hovered=one)
    yield from window.shot("2-zoomed")
    window.event("MIDDLEMOUSE", "PRESS", (x, y))
    yield 0.1
    for part in range(1, 11):
        yield from _move(window, (x + 3 * part, y + 2 * part))
    window.event("MIDDLEMOUSE", "RELEASE", (x + 30, y + 20))
    yield from _move(window, (x + 30, y + 20))
    expected.view = expected.view.panned(30, 20)
    _assert_drawn(window, expected, hovered=one)
    yield from window.press("ESC", (x + 30, y + 20))
    yield 1.0
    assert not _is_map(window), "the map is still drawn after Esc"
    assert not _site().junction
    assert window.area.spaces.active.show_gizmo
    yield from _choose(window)
    yield from window.press("RET", (x, y))
    yield 1.0
    yield from window.shot("3-list")
    assert not _is_map(window), "the map is still drawn under the dialog"
    yield from window.press("ESC")
    yield 0.5
    yield from _choose(window)
    expected = _expected(window)
    one = int(expected.shown()[0])
    yield from window.press("LEFTMOUSE", _pixel(window, expected, one))
    yield 1.0
    assert _site().junction == session.places.places[one].name, _site().junction


def _expected(window: Window) -> StreetMap:
    """Return the map as it is first shown."""
    return StreetMap(session.places, free_frame(window.area, window.region("WINDOW")), _scale())


def _choose(window: Window) -> Steps:
    """Choose the extract, as a dropped file is, and wait for its map."""
    before = session.places
    with bpy.context.temp_override(window=window.window, area=window.area, region=window.region("WINDOW")):
        bpy.ops.seip.choose_map("INVOKE_DEFAULT", filepath=str(EXTRACT))
    yield from window.until(lambda: session.running is None and session.places is not before, 60)
    yield 1.5
    assert _is_map(window), "no map is drawn"


def _move(window: Window, at: tuple[int, int]) -> Steps:
    window.event("MOUSEMOVE", "NOTHING", at)
    yield 0.2


def _pixel(window: Window, expected: StreetMap, junction: int) -> tuple[int, int]:
    """Return where in the window a junction is drawn."""
    region = window.region("WINDOW")
    x, y = expected.view.to_pixels(session.places.plan.junctions)[junction].tolist()
    return round(region.x + x), round(region.y + y)


def _assert_drawn(window: Window, expected: StreetMap, hovered: int | None = None) -> None:
    """Assert that each junction on show is a light dot, and the hovered one a dot within a ring."""
    pixels = window.pixels().astype(int)
    region = window.region("WINDOW")
    left, bottom, right, top = expected.view.frame  # without help and credit
    for number in expected.shown().tolist():
        x, y = _pixel(window, expected, number)
        assert left <= x - region.x <= right, "a junction is drawn outside the map"
        assert bottom <= y - region.y <= top, "a junction is drawn outside the map"
        light = pixels[len(pixels) - 1 - y, x].min()
        assert light > LIGHT or number == hovered, f"junction {number} is not drawn at {x}, {y}"
    if hovered is not None:
        x, y = _pixel(window, expected, hovered)
        radius = HOVERED * DOT_RADII[int(session.places.plan.importance[hovered])] * _scale()
        column = pixels[:, x]
        inside, ring = (len(pixels) - 1 - round(y - part) for part in (0.75 * radius, radius + _scale()))
        assert column[inside].max() < DARK < LIGHT < column[ring].min(), "the junction under the mouse has no ring"


def _is_map(window: Window) -> bool:
    """Return whether the lower middle of the viewport is the ground of the map, or a street on it."""
    region = window.region("WINDOW")
    left, bottom, right, _ = free_frame(window.area, region)
    pixels = window.pixels().astype(int)
    low = len(pixels) - 1 - round(region.y + bottom) - 3
    row = pixels[low, round(region.x + left) + EDGE : round(region.x + (left + right) / 2)]
    return bool((np.abs(row - GROUND).max(axis=1) < NEARLY).mean() > MOSTLY)


def _scale() -> float:
    return float(bpy.context.preferences.system.ui_scale)


def _site() -> bpy.types.PropertyGroup:
    return bpy.context.window_manager.windows[0].scene.seip.site


play(scenario, Window(OUT))
