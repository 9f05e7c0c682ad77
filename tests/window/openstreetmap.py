"""An extract of OpenStreetMap where SUMO is missing, played in a window: what dialog, sidebar and preferences say.

.ci/window BLENDER OUT tests/window/openstreetmap.py
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import bpy
from bl_ext.user_default.seip.seip_addon import preferences
from bl_ext.user_default.seip.seip_addon.session import session
from driver import Steps, Window, play

OUT = Path(sys.argv[sys.argv.index("--") + 1])
EXTRACT = (Path("scenes") / "harbour.osm").resolve()


def scenario(window: Window) -> Steps:
    """Choose an extract, and look at all places that state that SUMO is missing."""
    bpy.context.preferences.view.show_splash = False
    yield from window.press("ESC")
    yield from window.open_sidebar("SEIP")
    assert preferences.sumo() is None, preferences.sumo_status()
    with bpy.context.temp_override(window=window.window, area=window.area, region=window.region("WINDOW")):
        bpy.ops.seip.choose_map("INVOKE_DEFAULT", filepath=str(EXTRACT))  # as a dropped file is
    yield from window.until(lambda: session.running is None and _site().source, 60)
    yield 1.0
    yield from window.shot("1-dialog")
    _site().junction = _site().junctions[0].name
    yield 1.0
    yield from window.press("ESC")
    yield 1.0
    yield from window.picture("2-sidebar")
    assert not bpy.ops.seip.build_site.poll()
    bpy.context.preferences.system.use_online_access = True
    yield from window.open_section("sources")
    _site().buildings = _site().terrain = _site().meshes = "//town"
    yield 1.0
    yield from window.picture("3-sources")
    assert bpy.ops.seip.install_sumo.poll()
    window.area.type = "PREFERENCES"
    bpy.context.preferences.active_section = "ADDONS"
    bpy.context.window_manager.addon_search = "SEIP"
    bpy.ops.preferences.addon_expand(module=preferences.ADDON_ID)
    yield 2.0
    yield from window.shot("4-preferences")


def _site() -> bpy.types.PropertyGroup:
    return bpy.context.window_manager.windows[0].scene.seip.site


play(scenario, Window(OUT))
