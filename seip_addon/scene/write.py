"""The result in the scene: sensors as empties, coverage as coloured squares on the road."""

from __future__ import annotations

import math
from collections.abc import Sequence

import bpy
import numpy as np

from ..core.arrays import Float, Integer
from ..core.deployment import Deployment, Sensor
from ..core.pictures.palette import SEEN_COLOURS, SEEN_TWICE, SEEN_WORDS
from ..core.site import Site, Targets
from ..core.streetscape.model import VEILS
from ..core.streetscape.street_furniture import Solid, join, prism, tube
from ..core.target_squares import target_squares
from . import contract
from .materials import linear, material
from .meshes import mesh_of

MARK = "seip_result"
"""Custom property of every object made here, so that the next result replaces it and nothing else."""

LIFT = max(height for height, _ in VEILS.values()) + 0.02
"""Metres of the coverage above the road: over the veils of areas, under the top of a kerb, which cuts it off."""
BODY_RADIUS, BODY_HEIGHT = 0.12, 0.22  # metres; somewhat larger than life
POST_RADIUS, BRACKET_RADIUS = 0.06, 0.03  # metres
BODY_SIDES = 16
SAME_PLACE = 0.01  # metres in plan, below which a sensor stands on its foot


def write_result(scene: bpy.types.Scene, site: Site, deployment: Deployment) -> None:
    """Put the chosen sensors and the coverage into the scene, in place of an earlier result.

    Sensors become empties in the collection ``SEIP Sensors``, each with a body
    and a post or bracket below it; coverage becomes the mesh in ``SEIP Coverage``.
    Nothing that was not written by this function is changed.

    Parameters
    ----------
    scene : bpy.types.Scene
    site : Site
        What the result was computed on.
    deployment : Deployment
        The chosen sensors and what they see.
    """
    clear_result(scene)
    _write_sensors(contract.find_or_make(scene, contract.SENSORS), deployment.sensors)
    _write_coverage(contract.find_or_make(scene, contract.COVERAGE), site.targets, deployment)


def clear_result(scene: bpy.types.Scene) -> None:
    """Remove the objects and meshes of an earlier result."""
    for name in (contract.SENSORS, contract.COVERAGE):
        collection = contract.find(scene, name)
        if collection is not None:
            for thing in [thing for thing in collection.objects if MARK in thing]:
                _remove(thing)


def _remove(thing: bpy.types.Object) -> None:
    mesh = thing.data
    bpy.data.objects.remove(thing)
    if mesh is not None and not mesh.users:
        bpy.data.meshes.remove(mesh)


def _write_sensors(collection: bpy.types.Collection, sensors: Sequence[Sensor]) -> None:
    for sensor in sensors:
        empty = _empty(sensor)
        collection.objects.link(empty)
        name = f"{sensor.label} body"
        body = bpy.data.objects.new(name, mesh_of(name, _hardware(sensor)))
        body[MARK] = True
        body.parent = empty
        collection.objects.link(body)


def _empty(sensor: Sensor) -> bpy.types.Object:
    empty = bpy.data.objects.new(f"{sensor.model.key} @ {sensor.height:.3g} m · {sensor.position_name}", None)
    empty.empty_display_type = "ARROWS"
    empty.empty_display_size = 0.8
    empty.show_name = True
    empty.show_in_front = True
    empty.location = sensor.xyz
    empty.rotation_euler = (0.0, 0.0, sensor.yaw)
    properties = {
        MARK: True,
        contract.LABEL: sensor.label,
        contract.SENSOR: sensor.model.key,
        "seip_sensor_name": sensor.model.name,
        "seip_position": sensor.position_name,
        "seip_on_pole": sensor.on_pole,
        "seip_height": sensor.height,
        "seip_yaw_deg": math.degrees(sensor.yaw),
        "seip_range": sensor.model.max_range,
        "seip_price": sensor.model.price,
        "seip_coverage": sensor.alone,
        "seip_coverage_added": sensor.added,
        "seip_coverage_marginal": sensor.marginal,
    }
    for name, value in properties.items():
        empty[name] = value
    return empty


def _hardware(sensor: Sensor) -> Solid:
    """Return the body and the post or bracket that carries it, in the axes of the sensor's empty."""
    angle = 2.0 * np.pi * np.arange(BODY_SIDES) / BODY_SIDES
    circle = BODY_RADIUS * np.column_stack((np.cos(angle), np.sin(angle)))
    body = prism(circle, -BODY_HEIGHT / 2, BODY_HEIGHT / 2, side="sensor")
    foot = _turned(sensor.foot - sensor.xyz, -sensor.yaw)
    top = np.array((0.0, 0.0, -BODY_HEIGHT / 2))  # of the post; the optical centre is the body's middle
    if not sensor.on_pole:
        return join(body, tube(foot, top, (POST_RADIUS, POST_RADIUS), "post"))
    if math.hypot(*foot[:2]) > SAME_PLACE:
        shaft = np.array((foot[0], foot[1], top[2]))
        return join(body, tube(shaft, top, (BRACKET_RADIUS, BRACKET_RADIUS), "post"))
    return body


def _turned(vector: Float, angle: float) -> Float:
    cos, sin = math.cos(angle), math.sin(angle)
    return np.array((cos * vector[0] - sin * vector[1], sin * vector[0] + cos * vector[1], vector[2]))


def _write_coverage(collection: bpy.types.Collection, targets: Targets, deployment: Deployment) -> None:
    thing = bpy.data.objects.new("Coverage", _coverage_mesh(targets, deployment.seen_by))
    thing[MARK] = True
    thing["seip_coverage"] = deployment.coverage
    thing["seip_seen_twice"] = deployment.seen_twice
    thing["seip_coverage_weighted"] = deployment.weighted
    if deployment.central is not None:
        thing["seip_coverage_central"] = deployment.central
    thing["seip_price"] = deployment.price
    thing["seip_spacing"] = targets.spacing
    collection.objects.link(thing)


def _coverage_mesh(targets: Targets, seen_by: Integer) -> bpy.types.Mesh:
    """Return one square per target, with how many sensors see it and the colour of that.

    The integers are the attribute ``seip_seen`` of the faces, in the order of
    the targets; ``seip_colour`` serves the viewport's Attribute colours, and a
    material for each class its Material colours and renders.
    """
    mesh = bpy.data.meshes.new("Coverage")
    corners = target_squares(targets).reshape(-1, 3) + np.array((0.0, 0.0, LIFT))
    mesh.from_pydata(corners.tolist(), [], np.arange(4 * len(targets)).reshape(-1, 4).tolist())
    classes = np.minimum(seen_by, SEEN_TWICE).astype(np.int32)
    mesh.attributes.new("seip_seen", "INT", "FACE").data.foreach_set("value", seen_by.astype(np.int32))
    palette = np.array([linear(colour) for colour in SEEN_COLOURS], dtype=np.float32)
    colours = mesh.color_attributes.new("seip_colour", "FLOAT_COLOR", "CORNER")
    colours.data.foreach_set("color", np.repeat(palette[classes], 4, axis=0).ravel())
    mesh.color_attributes.active_color_name = colours.name
    for words in SEEN_WORDS:
        mesh.materials.append(material(words))
    mesh.polygons.foreach_set("material_index", classes)
    return mesh
