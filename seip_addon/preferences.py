"""What a user sets once for all files."""

from __future__ import annotations

from pathlib import Path

import bpy

from .core.lidar import LidarModel, load_catalogue

ADDON_ID = (__package__ or "").removesuffix(".seip_addon")
"""The extension's key among Blender's add-ons: not that of the package in it."""


class SEIP_PG_catalogue_file(bpy.types.PropertyGroup):
    """A catalogue of the user's own."""

    path: bpy.props.StringProperty(
        name="Catalogue", subtype="FILE_PATH", description="A TOML file of LiDAR models, as docs/sensors.md describes"
    )


class SEIP_AP_preferences(bpy.types.AddonPreferences):
    """Preferences of the add-on."""

    bl_idname = ADDON_ID

    cache: bpy.props.StringProperty(
        name="Cache",
        subtype="DIR_PATH",
        description="Where visibility is kept from run to run; empty for the extension's own folder",
    )
    catalogues: bpy.props.CollectionProperty(type=SEIP_PG_catalogue_file)

    def draw(self, _context: bpy.types.Context) -> None:
        """Draw the preferences."""
        self.layout.prop(self, "cache")
        for file in self.catalogues:
            self.layout.prop(file, "path")


def cache_folder() -> Path:
    """Return the folder in which visibility is kept."""
    own = _preferences()
    if own is not None and own.cache:
        return Path(bpy.path.abspath(own.cache))
    if ADDON_ID.startswith("bl_ext."):
        return Path(bpy.utils.extension_path_user(ADDON_ID, path="visibility", create=True))
    return Path(bpy.utils.resource_path("USER")) / "seip" / "visibility"  # run from a checkout


def cores() -> int | None:
    """Return how many threads may work at once, or None where Blender's own number holds."""
    return getattr(_preferences(), "cores", 0) or None


def catalogue_files() -> tuple[Path, ...]:
    """Return the user's own catalogues."""
    own = _preferences()
    return () if own is None else tuple(Path(bpy.path.abspath(file.path)) for file in own.catalogues if file.path)


def catalogue() -> dict[str, LidarModel]:
    """Return all sensor types there are, the user's own included."""
    return load_catalogue(catalogue_files())


def _preferences() -> SEIP_AP_preferences | None:
    add_on = bpy.context.preferences.addons.get(ADDON_ID)
    return None if add_on is None else add_on.preferences


CLASSES = (SEIP_PG_catalogue_file, SEIP_AP_preferences)
