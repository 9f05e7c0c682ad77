"""The result in the scene: sensors as empties, coverage as coloured squares on the road."""

from __future__ import annotations

import math
from collections.abc import Sequence

import bpy
import numpy as np

from ..core.arrays import Float, Integer
from ..core.pictures.palette import INK, SEEN_COLOURS, SEEN_TWICE, SEEN_WORDS
from ..core.results.deployment import Deployment, Sensor
from ..core.site import Site, Targets
from . import contract

MARK = "seip_result"
"""Custom property of every object made here, so that the next result replaces it and nothing else."""

LIFT = 0.08  # metres above the road, against flicker in a viewport that shows the whole site
BODY_RADIUS, BODY_HEIGHT = 0.12, 0.22  # metres; somewhat larger than life
POST_RADIUS, BRACKET_RADIUS = 0.06, 0.03  # metres
SIDES = 16
BODY_COLOUR = "#f2c230"
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
    """Remove the objects, meshes and materials of an earlier result."""
    for name in (contract.SENSORS, contract.COVERAGE):
        collection = contract.find(scene, name)
        if collection is not None:
            for thing in [thing for thing in collection.objects if MARK in thing]:
                _remove(thing)


def _remove(thing: bpy.types.Object) -> None:
    mesh = thing.data
    bpy.data.objects.remove(thing)
    if mesh is None or mesh.users:
        return
    materials = list(mesh.materials)
    bpy.data.meshes.remove(mesh)
    for material in materials:
        if MARK in material and not material.users:
            bpy.data.materials.remove(material)


def _write_sensors(collection: bpy.types.Collection, sensors: Sequence[Sensor]) -> None:
    materials = (_material("SEIP sensor", BODY_COLOUR), _material("SEIP post", INK))
    for sensor in sensors:
        empty = _empty(sensor)
        collection.objects.link(empty)
        body = bpy.data.objects.new(f"{sensor.label} body", _hardware(sensor, materials))
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
        "seip_label": sensor.label,
        "seip_sensor": sensor.model.key,
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


def _hardware(sensor: Sensor, materials: Sequence[bpy.types.Material]) -> bpy.types.Mesh:
    """Return the body and the post or bracket that carries it, in the axes of the sensor's empty."""
    foot = _turned(sensor.foot - sensor.xyz, -sensor.yaw)
    top = np.array((0.0, 0.0, -BODY_HEIGHT / 2))  # of the post; the optical centre is the body's middle
    pieces = [_cylinder(top, -top, BODY_RADIUS)]
    if not sensor.on_pole:
        pieces.append(_cylinder(foot, top, POST_RADIUS))
    elif math.hypot(*foot[:2]) > SAME_PLACE:
        pieces.append(_cylinder(np.array((foot[0], foot[1], top[2])), top, BRACKET_RADIUS))
    sizes = [len(vertices) for vertices, _ in pieces]
    starts = np.cumsum([0, *sizes[:-1]])
    mesh = bpy.data.meshes.new(f"{sensor.label} body")
    mesh.from_pydata(
        np.concatenate([vertices for vertices, _ in pieces]).tolist(),
        [],
        [
            [corner + int(start) for corner in face]
            for start, (_, faces) in zip(starts, pieces, strict=True)
            for face in faces
        ],
    )
    for material in materials:
        mesh.materials.append(material)
    counts = [len(faces) for _, faces in pieces]
    mesh.polygons.foreach_set("material_index", np.repeat(np.arange(len(pieces), dtype=np.int32), counts))
    return mesh


def _turned(vector: Float, angle: float) -> Float:
    cos, sin = math.cos(angle), math.sin(angle)
    return np.array((cos * vector[0] - sin * vector[1], sin * vector[0] + cos * vector[1], vector[2]))


def _cylinder(start: Float, end: Float, radius: float) -> tuple[Float, list[list[int]]]:
    """Return corners and faces of a cylinder between two points."""
    axis = (end - start) / np.linalg.norm(end - start)
    across = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    across /= np.linalg.norm(across)
    angle = 2.0 * np.pi * np.arange(SIDES)[:, None] / SIDES
    ring = radius * (np.cos(angle) * across + np.sin(angle) * np.cross(axis, across))
    after = (np.arange(SIDES) + 1) % SIDES
    sides = [[i, int(j), int(j) + SIDES, i + SIDES] for i, j in enumerate(after)]
    caps = [list(range(SIDES))[::-1], list(range(SIDES, 2 * SIDES))]
    return np.concatenate((start + ring, end + ring)), sides + caps


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
    mesh.from_pydata(_squares(targets).tolist(), [], np.arange(4 * len(targets)).reshape(-1, 4).tolist())
    classes = np.minimum(seen_by, SEEN_TWICE).astype(np.int32)
    mesh.attributes.new("seip_seen", "INT", "FACE").data.foreach_set("value", seen_by.astype(np.int32))
    palette = np.array([_linear(colour) for colour in SEEN_COLOURS], dtype=np.float32)
    colours = mesh.color_attributes.new("seip_colour", "FLOAT_COLOR", "CORNER")
    colours.data.foreach_set("color", np.repeat(palette[classes], 4, axis=0).ravel())
    mesh.color_attributes.active_color_name = colours.name
    for words, colour in zip(SEEN_WORDS, SEEN_COLOURS, strict=True):
        mesh.materials.append(_material(f"SEIP {words}", colour))
    mesh.polygons.foreach_set("material_index", classes)
    return mesh


def _squares(targets: Targets) -> Float:
    """Return the corners of a square round each target, (4 t, 3), draped over the slopes of the road.

    A corner that several squares share has the mean height of their targets.
    """
    half = targets.spacing / 2.0
    offsets = half * np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    corners = (targets.xyz[:, None, :2] + offsets).reshape(-1, 2)
    _, shared = np.unique(np.round(corners / half).astype(np.int64), axis=0, return_inverse=True)
    shared = shared.ravel()
    height = np.bincount(shared, np.repeat(targets.xyz[:, 2], 4)) / np.bincount(shared)
    return np.column_stack((corners, height[shared] + LIFT))


def _material(name: str, colour: str) -> bpy.types.Material:
    """Return a matt material that has its colour in the Solid viewport as well."""
    material = bpy.data.materials.new(name)
    material[MARK] = True
    material.diffuse_color = _linear(colour)
    material.roughness = 1.0
    if material.node_tree is None:
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    surface = tree.nodes.new("ShaderNodeBsdfDiffuse")
    surface.inputs["Color"].default_value = _linear(colour)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(surface.outputs["BSDF"], output.inputs["Surface"])
    return material


def _linear(colour: str) -> tuple[float, float, float, float]:
    """Return a web colour (sRGB) as Blender's linear RGBA (IEC 61966-2-1)."""
    srgb = [int(colour[at : at + 2], 16) / 255.0 for at in (1, 3, 5)]
    red, green, blue = (v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in srgb)
    return red, green, blue, 1.0
