"""Properties of the site: sources, weights and rules of objects."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
from bpy.props import CollectionProperty, EnumProperty, FloatProperty, StringProperty

from ..core.site.scene_geometry import DEFAULT_WEIGHT
from ..core.workflows.site_building import SiteRequest
from ..core.world.elevation.at_place import TerrainRequest
from ..core.world.openstreetmap.map_links import parsed_position
from ..core.world.openstreetmap.site import is_extract
from ..core.world.streetscape.description import DEFAULT_RADIUS
from ..core.world.streetscape.site_file import DESCRIPTION_SUFFIX
from ..preferences import overpass, sumo_folders
from ..scene import contract, roles
from .conversion import absolute, as_typed, complaint, of_setting, path_property

_FILE = {"subtype": "FILE_PATH", "options": {"PATH_SUPPORTS_BLEND_RELATIVE"}}
_CODE = {"min": 0, "max": 999_999}
ROLE_ITEMS = tuple((role.name, role.value.capitalize(), f"{roles.WORDS[role].capitalize()}") for role in roles.ROLES)
_POLE_RULES = ("", contract.MANDATORY, contract.FORBIDDEN)


class SEIP_PG_junction(bpy.types.PropertyGroup):
    """A junction of the chosen file, named as in the list."""

    id: StringProperty(name="Id", description="Junction id in the map, or latitude and longitude")


class SEIP_PG_site(bpy.types.PropertyGroup):
    """Sources of the site."""

    source: path_property("Map", "OpenDRIVE map, site description that names one, or extract of OpenStreetMap")
    new_site: StringProperty(
        name="New Site",
        description="Position of a place whose streets are downloaded from OpenStreetMap: latitude and longitude in "
        "degrees, or a link of OpenStreetMap, Google, Bing or Apple maps",
    )
    junctions: CollectionProperty(type=SEIP_PG_junction)
    junction: StringProperty(
        name="Junction",
        description="Junction in the middle of the site, by its streets: type to search. Empty for the middle "
        "of the map, or the description's own place",
    )
    position: StringProperty(
        name="Lat, Lon",
        description="Latitude and longitude in degrees, as maps in the browser give them: 52.47391, 13.44048. The "
        "junction nearest to it is in the middle of the site, or the place itself with a circle",
    )
    region_shape: EnumProperty(
        name="Region",
        description="Part of the road around the junction to cover",
        items=(
            ("APPROACHES", "Approaches", "The junction, and the streets that lead to it up to a distance along them"),
            ("CIRCLE", "Circle", "All road within a circle about the middle of the junction"),
        ),
    )
    radius: FloatProperty(
        name="Radius",
        description="Radius of the region of interest, or its length along the approaches of the junction",
        unit="LENGTH",
        default=DEFAULT_RADIUS,
        min=1.0,
        soft_max=500.0,
        step=1000,
    )
    osm: of_setting(SiteRequest, "osm", "Surroundings", **_FILE)
    terrain: of_setting(TerrainRequest, "path", "Terrain", **_FILE)
    terrain_epsg: of_setting(TerrainRequest, "epsg", "EPSG", default=0, **_CODE)
    role: EnumProperty(name="Role", description="Role of objects in the placement", items=ROLE_ITEMS)

    def is_described(self) -> bool:
        """Return whether a site description gives the place and its size."""
        return self.source.lower().endswith(DESCRIPTION_SUFFIX) and not self.junction

    def is_extract(self) -> bool:
        """Return whether the site comes from an extract of OpenStreetMap."""
        return is_extract(Path(self.source))

    def wrong_position(self, text: str) -> str:
        """Return what is wrong with a position, or ""."""
        return complaint(lambda: parsed_position(text))

    def has_place(self) -> bool:
        """Return whether enough is chosen to build a site: a map has a middle, an extract none."""
        return bool(self.source and (self.junction or self.position or not self.is_extract()))

    def place(self) -> str:
        """Return the chosen junction or place with its map, as one text."""
        return "|".join((self.source, self.junction or self.position))

    def follows_approaches(self) -> bool:
        """Return whether the region follows the approaches of a junction."""
        return (bool(self.junction) or self.is_extract()) and self.region_shape == "APPROACHES"

    def request(self) -> SiteRequest:
        """Return the request as the core takes it.

        Raises
        ------
        SeipError
            The position is invalid.
        """
        size = None if self.is_described() else as_typed(self.radius)
        radius, approaches = (None, size) if self.follows_approaches() else (size, None)
        more = self._sources()
        found = self.junctions.get(self.junction)
        chosen = self.junction if found is None else found.id
        if not self.is_extract():
            junction = (chosen,) if chosen else ()
            return SiteRequest(junction=junction, radius=radius, approaches=approaches, anywhere=True, **more)
        near = parsed_position(chosen or self.position)
        more |= {"sumo": sumo_folders(), "overpass": overpass()}
        return SiteRequest(near_latlon=near, radius=radius, approaches=approaches, **more)

    def _sources(self) -> dict[str, Any]:
        """Return the fields of the request that name further files."""
        terrain = TerrainRequest(absolute(self.terrain), self.terrain_epsg or None) if self.terrain else None
        osm = absolute(self.osm) if self.osm and not self.is_extract() else None
        return {"osm": osm, "terrain": terrain}


def _region_weight(obj: bpy.types.Object) -> float:
    value = obj.get(contract.WEIGHT, DEFAULT_WEIGHT)
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return float(value) if is_number else DEFAULT_WEIGHT  # the check says what is wrong with it


def _set_region_weight(obj: bpy.types.Object, value: float) -> None:
    obj[contract.WEIGHT] = as_typed(value)


def _pole_rule(obj: bpy.types.Object) -> int:
    return next((number for number, mark in enumerate(_POLE_RULES) if mark and obj.get(mark)), 0)


def _set_pole_rule(obj: bpy.types.Object, value: int) -> None:
    for number, mark in enumerate(_POLE_RULES[1:], start=1):
        if number == value:
            obj[mark] = True
        elif mark in obj:
            del obj[mark]


PROPERTIES = (
    (
        bpy.types.Object,
        "seip_region_weight",
        FloatProperty(
            name="Weight",
            description=f"Weight of each target in this region; other targets have 1 ({contract.WEIGHT})",
            get=_region_weight,
            set=_set_region_weight,
            min=0.001,
            soft_max=10.0,
            options=set(),
        ),
    ),
    (
        bpy.types.Object,
        "seip_pole_rule",
        EnumProperty(
            name="Rule",
            description=f"Rule for a sensor on this pole ({contract.FORBIDDEN}, {contract.MANDATORY})",
            items=(
                ("FREE", "Free", "A sensor is allowed"),
                ("MANDATORY", "Sensor", "A sensor is required"),
                ("FORBIDDEN", "No Sensor", "No sensor is allowed"),
            ),
            get=_pole_rule,
            set=_set_pole_rule,
            options=set(),
        ),
    ),
)
"""Properties of objects that edit custom properties of the contract."""
