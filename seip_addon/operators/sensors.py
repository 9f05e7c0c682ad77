"""Operators on sensor types: catalogues, presets, beam previews."""

from __future__ import annotations

from pathlib import Path

import bpy
from bl_operators.presets import AddPresetBase

from .. import preferences
from ..core.base.counts import counted
from ..core.base.errors import SeipError
from ..core.sensing.lidar.catalogue import load_catalogue
from ..state import sensor_types
from ..state.session import session
from ..viewport import beam_preview, overlays
from .base import Outcome, ShortWork


def _no_preferences(_scene: bpy.types.Scene) -> str:
    return "Install the add-on as an extension: only then it has preferences" if preferences.own() is None else ""


class SEIP_OT_add_catalogue(ShortWork, bpy.types.Operator):
    """Add a catalogue of your own, which docs/sensors.md describes"""

    obstacles = (_no_preferences,)

    filepath: bpy.props.StringProperty(
        name="File", description="Catalogue file", subtype="FILE_PATH", options={"PATH_SUPPORTS_BLEND_RELATIVE"}
    )
    filter_glob: bpy.props.StringProperty(default="*.toml;*.json;*.xml;*.yaml;*.yml;*.csv", options={"HIDDEN"})

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> Outcome:
        """Open the file browser."""
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def act(self, context: bpy.types.Context) -> None:
        """Read it, and keep its name."""
        path = Path(bpy.path.abspath(self.filepath))
        shipped = load_catalogue()
        models = load_catalogue([path])
        if path in preferences.catalogue_files():
            raise SeipError(f"{path.name} is a catalogue already: nothing was added")
        preferences.own().catalogues.add().path = str(path)
        context.preferences.is_dirty = True
        sensor_types.refresh()
        changed = sum(1 for key, model in models.items() if key not in shipped or model.source != shipped[key].source)
        self.report({"INFO"}, f"{path.name}: {changed} sensor types added or replaced")


class SEIP_OT_remove_catalogue(ShortWork, bpy.types.Operator):
    """Remove a catalogue of your own from the list; the file stays"""

    obstacles = (_no_preferences,)

    index: bpy.props.IntProperty(name="Number", description="Index of the catalogue, from 0", min=0)

    def act(self, context: bpy.types.Context) -> None:
        """Forget it."""
        files = preferences.own().catalogues
        if self.index >= len(files):
            raise SeipError(f"there is no catalogue {self.index}: there are {len(files)}, counted from 0")
        files.remove(self.index)
        context.preferences.is_dirty = True
        sensor_types.refresh()


class SEIP_OT_empty_cache(ShortWork, bpy.types.Operator):
    """Delete all stored visibility grids; they are computed again when needed"""

    obstacles = (
        lambda _: "Wait for the work under way" if session.running else "",
        lambda _: "" if preferences.kept_visibility().megabytes() else "The cache is empty",
    )

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Outcome:
        """Ask first."""
        outcome: Outcome = context.window_manager.invoke_confirm(self, event)
        return outcome

    def act(self, _context: bpy.types.Context) -> None:
        """Delete it."""
        count = preferences.kept_visibility().empty()
        self.report({"INFO"}, f"{counted(count, 'file')} deleted")


class SEIP_OT_preview_beams(ShortWork, bpy.types.Operator):
    """Show or hide the beams of the selected sensor, or else of the sensor shown in the sidebar at the 3D cursor: rings on a flat road and the edges of the vertical field of view"""  # noqa: E501  # a tooltip is one line

    def act(self, context: bpy.types.Context) -> None:
        """Show or hide them."""
        if overlays.find(context.scene, beam_preview.NAME):
            overlays.hide(context.scene, beam_preview.NAME)
        else:
            overlays.show(context.scene, beam_preview.NAME, beam_preview.beam_overlay())


class SEIP_MT_survey_presets(bpy.types.Menu):
    """Presets of the survey."""

    bl_label = "Survey Presets"
    preset_subdir = "seip/survey"
    preset_operator = "script.execute_preset"
    draw = bpy.types.Menu.draw_preset


class SEIP_OT_add_survey_preset(AddPresetBase, bpy.types.Operator):
    """Save types, heights and all other survey settings under a name, or remove the preset shown"""

    bl_idname = "seip.add_survey_preset"
    bl_label = "Add Survey Preset"
    preset_menu = "SEIP_MT_survey_presets"
    preset_subdir = "seip/survey"
    preset_defines = ("survey = bpy.context.scene.seip.survey",)
    preset_values = ("survey",)
