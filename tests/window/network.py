"""A whole extract in a window: a junction is clicked, its site built, and the network coloured on the way back.

.ci/window BLENDER OUT tests/window/network.py; needs SUMO: SEIP_SUMO, by default that of the environment
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import bpy
import numpy as np
from bl_ext.user_default.seip.seip_addon import preferences
from bl_ext.user_default.seip.seip_addon.core.output.pictures.palette import NO_SITE_COLOUR, SHARE_COLOURS, rgb
from bl_ext.user_default.seip.seip_addon.operators.site import has_site
from bl_ext.user_default.seip.seip_addon.scene.network import is_network, junctions
from bl_ext.user_default.seip.seip_addon.session import session
from bpy_extras.view3d_utils import location_3d_to_region_2d
from driver import Steps, Window, play

OUT = Path(sys.argv[sys.argv.index("--") + 1])
EXTRACT = (Path("scenes") / "town.osm").resolve()
ENVIRONMENT = Path(".venv").resolve()
NEARLY, BESIDE = 30, 12
"""Largest difference of a drawn colour, of 255; and pixels left of the origin, where the colour is looked at."""


def scenario(window: Window) -> Steps:
    """Import the extract, open the site of a junction, and go back."""
    bpy.context.preferences.view.show_splash = False
    preferences.own().sumo = os.environ.get("SEIP_SUMO") or str(
        next(ENVIRONMENT.glob("lib/python3*/site-packages/sumo"))
    )
    assert preferences.sumo() is not None, preferences.sumo_status()
    yield from window.press("ESC")
    yield from window.open_sidebar("SEIP")
    with bpy.context.temp_override(window=window.window, area=window.area, region=window.region("WINDOW")):
        bpy.ops.seip.import_network("INVOKE_DEFAULT", filepath=str(EXTRACT))
    yield from window.until(lambda: session.running is None and is_network(_scene()), 60)
    yield 1.0
    whole = _scene()
    yield from window.picture("1-network")
    _assert_colours(window, dict.fromkeys(junctions(whole), NO_SITE_COLOUR))
    one = junctions(whole)[2]
    yield from window.press("LEFTMOUSE", _pixel(window, one))
    yield 0.5
    assert bpy.context.view_layer.objects.active == one, "the click selected no junction"
    yield from window.picture("2-selected")
    yield from window.click("seip.open_junction(")
    yield from window.until(lambda: session.running is None and has_site(_scene()) and _scene().seip.site.checked, 120)
    yield 1.0
    assert _scene().seip.site.junction == one.name
    yield from window.picture("3-site")
    yield from window.click("seip.show_network(")
    yield 1.0
    assert _scene() == whole
    bpy.ops.object.select_all(action="DESELECT")
    yield from window.picture("4-back")
    _assert_colours(window, {obj: SHARE_COLOURS[0] if obj == one else NO_SITE_COLOUR for obj in junctions(whole)})


def _pixel(window: Window, obj: bpy.types.Object) -> tuple[int, int]:
    """Return where in the window a junction is drawn."""
    region = window.region("WINDOW")
    x, y = location_3d_to_region_2d(region, window.area.spaces.active.region_3d, obj.location)
    return round(region.x + x), round(region.y + y)


def _assert_colours(window: Window, colours: dict[bpy.types.Object, str]) -> None:
    """Assert that junctions are drawn in colours."""
    pixels = window.pixels().astype(int)
    for obj, colour in colours.items():
        x, y = _pixel(window, obj)
        x -= BESIDE
        drawn = pixels[len(pixels) - 1 - y, x]
        wanted = np.array([255 * part for part in rgb(colour)])
        assert np.abs(drawn - wanted).max() < NEARLY, f"{obj.name} at {x}, {y} is {drawn}, not {wanted}"


def _scene() -> bpy.types.Scene:
    return bpy.context.window_manager.windows[0].scene


play(scenario, Window(OUT))
