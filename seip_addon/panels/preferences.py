"""The add-on's preferences: their properties, and how they are drawn."""

import bpy

from .. import preferences
from ..core.sensing.visibility.ray_casting import MAX_THREADS
from ..core.workflows.detection import INSTALL
from ..core.world.openstreetmap.overpass import OVERPASS
from . import sumo


class SEIP_PG_catalogue_file(bpy.types.PropertyGroup):
    """A catalogue of the user's own."""

    path: bpy.props.StringProperty(
        name="Catalogue", subtype="FILE_PATH", description="A TOML file of LiDAR models, as docs/sensors.md describes"
    )


class SEIP_AP_preferences(bpy.types.AddonPreferences):
    """Preferences of the add-on."""

    bl_idname = preferences.ADDON_ID

    cores: bpy.props.IntProperty(
        name="Cores",
        description="Processor cores that compute visibility at once; more than four rarely help",
        default=MAX_THREADS,
        min=1,
        max=MAX_THREADS,
    )
    cache: bpy.props.StringProperty(
        name="Cache",
        subtype="DIR_PATH",
        description="Folder for stored visibility grids; empty for the extension's own folder",
    )
    python: bpy.props.StringProperty(
        name="Python with PyTorch",
        subtype="FILE_PATH",
        description=f"Python for Detect, .venv/bin/python of a checkout or one of your own: {INSTALL}",
    )
    sumo: bpy.props.StringProperty(
        name="SUMO",
        subtype="DIR_PATH",
        description="Folder of Eclipse SUMO, which lays out the streets of an extract of OpenStreetMap and simulates "
        "traffic: the one with bin and data in it. Empty for the SUMO that was installed here, on the PATH or in "
        "SUMO_HOME",
    )
    overpass: bpy.props.StringProperty(
        name="Overpass",
        description="Address of the Overpass server that extracts of OpenStreetMap are downloaded from",
        default=OVERPASS,
    )
    catalogues: bpy.props.CollectionProperty(type=SEIP_PG_catalogue_file)

    def draw(self, _context: bpy.types.Context) -> None:
        """Draw the preferences."""
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "cores")
        layout.prop(self, "cache")
        row = layout.row()
        row.label(text=f"Stored visibility: {preferences.kept_visibility().megabytes():,.1f} MB")
        row.operator("seip.empty_cache", icon="TRASH")
        layout.prop(self, "python")
        layout.prop(self, "sumo")
        sumo.draw_status(layout)
        layout.prop(self, "overpass")
        layout.label(text="Catalogues of sensor types")
        for number, file in enumerate(self.catalogues):
            row = layout.row(align=True)
            row.prop(file, "path", text="")
            row.operator("seip.remove_catalogue", text="", icon="X").index = number
        layout.operator("seip.add_catalogue", icon="ADD")
