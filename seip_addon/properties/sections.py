"""Properties of the sidebar: which of its sections are open.

They belong to the window manager: undo changes only what belongs to the scene.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
from bpy.props import BoolProperty, IntProperty, PointerProperty

from ..state import scene_status

AUTOMATIC, CLOSED, OPEN = -1, 0, 1
"""States of a step: open while it is the current one, or as the user left it."""


def _step(name: str, title: str) -> Any:  # noqa: ANN401 -- what Blender makes of a property
    """Return the property of a step that is open while it is the current one, until a user opens or closes it."""
    stored = f"{name}_state"

    def is_open(own: SEIP_PG_sections) -> bool:
        state = getattr(own, stored)
        return bool(state == OPEN or (state == AUTOMATIC and scene_status.current_step(bpy.context.scene) == name))

    def set_open(own: SEIP_PG_sections, value: bool) -> None:  # noqa: FBT001 -- Blender's signature
        setattr(own, stored, OPEN if value else CLOSED)

    getter: Callable[[SEIP_PG_sections], bool] = is_open
    return BoolProperty(
        name=title, description="Show or hide this step", get=getter, set=set_open, options={"SKIP_SAVE"}
    )


def _section(title: str) -> Any:  # noqa: ANN401 -- as above
    return BoolProperty(name=title, description="Show or hide this section", default=False)


class SEIP_PG_sections(bpy.types.PropertyGroup):
    """Open and closed sections of the sidebar."""

    site_state: IntProperty(default=AUTOMATIC, options={"HIDDEN", "SKIP_SAVE"})
    sensors_state: IntProperty(default=AUTOMATIC, options={"HIDDEN", "SKIP_SAVE"})
    placement_state: IntProperty(default=AUTOMATIC, options={"HIDDEN", "SKIP_SAVE"})
    site: _step("site", "Site")
    sensors: _step("sensors", "Sensors")
    placement: _step("placement", "Placement")
    change_site: _section("Change Site")
    sources: _section("Surroundings and Terrain")
    roles: _section("Roles of Objects")
    contents: _section("Contents")
    about_sensor: _section("About the Sensor")
    beams: _section("Beam Preview")
    numbers: _section("Number of Sensors")
    details: _section("Details")
    objective: _section("Objective")
    rules: _section("Weights and Positions")
    candidates: _section("Positions, Weather, Price")
    search: _section("Search")
    results: _section("Results")
    view: _section("Coverage and Sight Lines")
    comparison: _section("Compare")
    traffic: _section("Traffic and Detection")
    simulation: _section("Traffic Simulation")
    scan: _section("Scan")
    dataset: _section("Dataset")
    detection: _section("Detection")
    verification: _section("Verification")
    export: _section("Export")

    def follow_steps(self) -> None:
        """Open the current step and close the others, now and from now on."""
        self.site_state = self.sensors_state = self.placement_state = AUTOMATIC


PROPERTIES = ((bpy.types.WindowManager, "seip_sections", PointerProperty(type=SEIP_PG_sections)),)


def forget() -> None:
    """Close all sections but the current step: another file is opened, which may bring its own state."""
    if isinstance(bpy.data, bpy.types.BlendData):  # Blender shows nobody the open file while it registers an add-on
        bpy.context.window_manager.property_unset("seip_sections")
