"""The section "Traffic Simulation": demand, map and folder of simulated runs of traffic."""

from __future__ import annotations

from pathlib import Path

import bpy

from .. import preferences
from ..operators.simulation import SEIP_OT_simulate_traffic, why_no_simulation
from . import sumo
from .run_button import draw_run
from .sections import Status
from .sidebar import draw_path, settings_column
from .wrapped_text import draw_sentence

USED = "Detection and placements in traffic use these runs."
CHANGED = "The settings have changed since: simulate again."


def status(scene: bpy.types.Scene) -> Status:
    """Return whether the settings have changed since the last simulation."""
    simulation = scene.seip.simulation
    return Status(bool(simulation.facts) and simulation.made_with != simulation.key())


def draw(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw how traffic is simulated, and what was simulated last."""
    scene = context.scene
    simulation = scene.seip.simulation
    sumo.draw_missing(layout)
    column = settings_column(layout)
    found = simulation.street_map()
    for name in ("flow", "pedestrians", "duration", "count"):
        column.prop(simulation, name)
    draw_path(layout, simulation, "map", placeholder="OpenDRIVE (.xodr)" if found is None else Path(found.name).name)
    draw_path(layout, simulation, "folder")
    reason = why_no_simulation(scene)
    if reason and preferences.sumo() is not None:  # else the sentence is there already
        draw_sentence(layout, reason, icon="INFO")
    draw_run(layout, SEIP_OT_simulate_traffic.bl_idname)
    if not simulation.facts:
        return
    draw_sentence(layout, f"{simulation.facts}. {USED}")
    if status(scene).changed:
        draw_sentence(layout, CHANGED, icon="ERROR")
