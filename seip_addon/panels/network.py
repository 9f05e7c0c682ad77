"""Panel of a network: the selected junction and its site."""

from __future__ import annotations

import bpy

from ..core.counts import counted
from ..operators.network import SEIP_OT_open_junction, SEIP_OT_show_network, selected_junction, site_of
from ..operators.site import SEIP_OT_build_site
from ..scene import contract
from ..scene.network import junctions
from . import placement, site
from .run_button import draw_run, is_running
from .wrapped_text import draw_sentence


def draw(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw what is known of the selected junction, and the button that opens its site."""
    whole = context.scene
    sites = sum(one.seip.site.network == whole for one in bpy.data.scenes)
    text = f"{whole.name}: {counted(len(junctions(whole)), 'junction')}, {counted(sites, 'site')}"
    draw_sentence(layout, text, icon="WORLD")
    obj = selected_junction(context)
    if is_running(SEIP_OT_build_site.bl_idname):
        draw_run(layout, SEIP_OT_build_site.bl_idname)
    else:
        row = layout.row()
        row.active_default = obj is not None
        row.operator(SEIP_OT_open_junction.bl_idname, icon="ZOOM_SELECTED")
    if obj is None:
        draw_sentence(layout, "Click a junction in the view, then open its site.", icon="INFO")
        return
    draw_sentence(layout, obj[contract.JUNCTION], icon="DECORATE_DRIVER")
    scene = site_of(whole, obj)
    if scene is None:
        draw_sentence(layout, "It has no site yet: opening it builds one.")
    else:
        draw_sentence(layout, f"Site: {site.status(scene)}")
        draw_sentence(layout, f"Placement: {placement.status(scene)}")


def draw_back(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    """Draw the way back to the network of a site, if it is of one."""
    if scene.seip.site.network is not None:
        layout.operator(SEIP_OT_show_network.bl_idname, icon="LOOP_BACK")
