"""Sober materials for a street, its traffic and its sensors: one colour each, for renders and for the viewport.

`tests/scene/test_read.py` shows its use.
"""

from __future__ import annotations

import bpy
import numpy as np

from ..core.base.errors import SeipError
from ..core.output.pictures.palette import (
    FORBIDDEN_VEIL,
    INK,
    MANDATORY_VEIL,
    REGION_VEIL,
    SENSOR_BODY,
    WEIGHTED_VEIL,
    rgb,
)
from ..core.site.scene_geometry import DEFAULT_REFLECTIVITY
from . import contract

PREFIX = "SEIP "
VIEWPORT_GAMMA = 0.65  # the viewport's studio light is dimmer than the sun

COLOURS = {
    "asphalt": (0.085, 0.087, 0.090),
    "asphalt shoulder": (0.125, 0.125, 0.125),
    "asphalt parking": (0.155, 0.150, 0.145),
    "asphalt cycle": (0.230, 0.090, 0.070),
    "median": (0.300, 0.310, 0.270),
    "pavement": (0.420, 0.410, 0.390),
    "kerb": (0.560, 0.550, 0.530),
    "verge": (0.250, 0.300, 0.180),
    "marking": (0.850, 0.850, 0.840),
    "wall": (0.480, 0.460, 0.430),
    "facade brick": (0.420, 0.235, 0.180),
    "facade plaster": (0.680, 0.640, 0.570),
    "facade sand": (0.590, 0.500, 0.370),
    "facade grey": (0.500, 0.505, 0.510),
    "roof": (0.240, 0.235, 0.235),
    "glass": (0.070, 0.105, 0.135),
    "steel": (0.270, 0.285, 0.295),
    "luminaire": (0.780, 0.780, 0.740),
    "signal housing": (0.030, 0.030, 0.030),
    "red lamp": (0.750, 0.040, 0.030),
    "amber lamp": (0.300, 0.170, 0.020),
    "green lamp": (0.020, 0.190, 0.090),
    "tyre": (0.022, 0.022, 0.023),
    "trim": (0.030, 0.031, 0.033),
    "rim": (0.420, 0.425, 0.430),
    "frame": (0.060, 0.110, 0.140),
    "headlamp": (0.860, 0.870, 0.860),
    "tail lamp": (0.480, 0.020, 0.015),
    "cargo box": (0.700, 0.695, 0.670),
    "skin": (0.560, 0.330, 0.230),
    "hair": (0.070, 0.045, 0.030),
    "trousers": (0.045, 0.055, 0.085),
    "bark": (0.160, 0.110, 0.075),
    "leaves": (0.105, 0.210, 0.065),
    "candidate veil": (0.650, 0.650, 0.600),
}
"""Linear RGB of each material that `core.world.streetscape.street_furniture` and `core.sensing.traffic.bodies` name."""

PAINT_COLOURS = {
    "black": (0.020, 0.021, 0.024),
    "blue": (0.035, 0.085, 0.200),
    "green": (0.045, 0.110, 0.080),
    "red": (0.260, 0.030, 0.027),
    "grey": (0.150, 0.155, 0.165),
    "silver": (0.450, 0.460, 0.470),
    "white": (0.700, 0.700, 0.685),
}
COLOURS |= {f"{what} {name}": colour for what in ("paint", "cloth") for name, colour in PAINT_COLOURS.items()}
"""The names of colours are those of `core.sensing.traffic.bodies`, on vehicles and on people."""

REFLECTIVITY = {
    "asphalt": 0.17,
    "asphalt shoulder": 0.17,
    "asphalt parking": 0.20,
    "asphalt cycle": 0.25,
    "median": 0.30,
    "pavement": 0.35,
    "kerb": 0.40,
    "verge": 0.45,
    "marking": 0.60,
    "wall": 0.40,
    "facade brick": 0.40,
    "facade plaster": 0.60,
    "facade sand": 0.50,
    "facade grey": 0.40,
    "roof": 0.25,
    "glass": 0.05,
    "steel": 0.40,
    "luminaire": 0.50,
    "signal housing": 0.08,
    "bark": 0.30,
    "leaves": 0.45,
}
"""Share of near infrared (905 nm) that each material scatters back, assumed; plants are bright there. Those not named
have the default."""
_OWN = {PREFIX + name: share for name, share in REFLECTIVITY.items()}

VEIL_OPACITY = 0.25
"""Opacity of areas that mark something in the viewport and are not rendered."""

ROUGHNESS = {"glass": 0.15, "steel": 0.4, "rim": 0.35, "headlamp": 0.2, "tail lamp": 0.3}
ROUGHNESS |= {f"paint {name}": 0.35 for name in PAINT_COLOURS}

RESULT_COLOURS = {"sensor": SENSOR_BODY, "post": INK}
"""Web colour of the materials of sensors: matt, and the same in the viewport and in renders."""
AREA_COLOURS = {
    "region veil": REGION_VEIL,
    "weighted veil": WEIGHTED_VEIL,
    "forbidden veil": FORBIDDEN_VEIL,
    "mandatory veil": MANDATORY_VEIL,
}
"""Web colour of areas that mean something."""


def material(name: str) -> bpy.types.Material:
    """Return the material of that name, made where the file has none yet."""
    existing = bpy.data.materials.get(PREFIX + name)
    if existing is not None:
        return existing
    if name in RESULT_COLOURS:
        return matt(name, RESULT_COLOURS[name])
    colour = linear(AREA_COLOURS[name])[:3] if name in AREA_COLOURS else COLOURS[name]
    opacity = VEIL_OPACITY if name.endswith("veil") else 1.0
    shown = (*(value**VIEWPORT_GAMMA for value in colour), opacity)
    return _made(name, (*colour, 1.0), shown, roughness=ROUGHNESS.get(name, 0.9), specular=0.5)


def matt(name: str, web_colour: str) -> bpy.types.Material:
    """Return a matt material of that name and colour, the same in the viewport and in the legends of pictures.

    One material serves each name and colour: a name with another colour gets a material with the number that Blender
    adds.
    """
    colour = linear(web_colour)
    for existing in bpy.data.materials:
        if contract.NUMBER.sub("", existing.name) == PREFIX + name and np.allclose(existing.diffuse_color, colour):
            return existing
    return _made(name, colour, colour, roughness=1.0, specular=0.0)


def reflectivity(of: bpy.types.Material | None) -> float:
    """Return a material's ``seip_reflectivity``, else that of the material of this add-on that it is, else the default.

    Raises
    ------
    SeipError
        The property is no number from 0 to 1.
    """
    if of is None:
        return DEFAULT_REFLECTIVITY
    given = of.get(contract.REFLECTIVITY)
    if given is None:
        name = contract.NUMBER.sub("", of.name)
        return _OWN.get(name, DEFAULT_REFLECTIVITY)
    if isinstance(given, bool) or not isinstance(given, int | float) or not 0 <= given <= 1:
        raise SeipError(
            f"property {contract.REFLECTIVITY} of material {of.name!r} must be a number from 0 to 1, not {given!r}"
        )
    return float(given)


def linear(colour: str) -> tuple[float, float, float, float]:
    """Return a web colour (sRGB) as Blender's linear RGBA (IEC 61966-2-1)."""
    red, green, blue = (v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in rgb(colour))
    return red, green, blue, 1.0


def nodes_of(owner: bpy.types.Material | bpy.types.World) -> bpy.types.Nodes:
    """Return the shader nodes of a material or world, the default ones where it had none."""
    if owner.node_tree is None:  # from Blender 5.0 on nodes are always there
        owner.use_nodes = True
    return owner.node_tree.nodes


def _made(
    name: str, colour: tuple[float, ...], shown: tuple[float, ...], *, roughness: float, specular: float
) -> bpy.types.Material:
    """Return a new material with its colour in renders and the one that the viewport shows."""
    made = bpy.data.materials.new(PREFIX + name)
    made.diffuse_color = shown
    made.roughness = roughness
    surface = next(node for node in nodes_of(made) if node.type == "BSDF_PRINCIPLED")
    surface.inputs["Base Color"].default_value = colour
    surface.inputs["Roughness"].default_value = roughness
    surface.inputs["Specular IOR Level"].default_value = specular
    return made
