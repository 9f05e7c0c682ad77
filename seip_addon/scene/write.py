"""Results in the scene: sensors as empties, coverage as squares that can be coloured by several aspects."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import bpy
import numpy as np

from ..core.base.arrays import Float, Integer
from ..core.base.errors import SeipError
from ..core.choosing.placement.deployment import Deployment, Sensor
from ..core.geometry.solids import Solid, join, prism, tube
from ..core.output.pictures.palette import Aspect, Colouring, Legend, as_placed, colouring
from ..core.site.roles import AREA_OVERLAYS
from ..core.site.site import Site, Targets
from ..core.site.targets import target_squares
from . import contract
from .materials import linear, matt
from .meshes import mesh_of
from .pieces import attach_piece, rename_whole

SEEN_BY, TARGET_WEIGHT, RETURNS, COLOUR = "seip_seen", "seip_weight", "seip_returns", "seip_colour"
"""Attributes of the coverage mesh, all but the last of each target's square; returns only where they were maximised."""
CLASS_WORDS, CLASS_COLOURS, SHARES, ASPECT = "seip_classes", "seip_class_colours", "seip_shares", "seip_aspect"
TITLE = "seip_legend_title"
"""Custom properties of the coverage: what its colours mean; the aspect is empty where they are another's."""
LIFT = max(height for height, _ in AREA_OVERLAYS.values()) + 0.02
"""Metres of the coverage above the road: over the veils of areas, under the top of a kerb, which cuts it off."""
BODY_RADIUS, BODY_HEIGHT = 0.12, 0.22  # metres; somewhat larger than life
POST_RADIUS, BRACKET_RADIUS = 0.06, 0.03  # metres
BODY_SIDES = 16
OFF_AXIS_DISTANCE = 0.01  # metres in plan, below which a sensor stands on its foot


def write_result(scene: bpy.types.Scene, site: Site, deployment: Deployment) -> None:
    """Put the chosen sensors and the coverage into the scene, in place of an earlier result.

    Sensors become empties in the collection ``SEIP Sensors``, each with a body
    and a post or bracket below it; coverage becomes the mesh in ``SEIP Coverage``.
    Nothing that was not written by this function is changed.

    Parameters
    ----------
    site : Site
        What the result was computed on.
    deployment : Deployment
        The chosen sensors and what they see.
    """
    for name in (contract.SENSORS, contract.COVERAGE):
        contract.leave_shared(scene, name)
    aspect = _shown_aspect(scene)
    clear_result(scene)
    _write_sensors(contract.find_or_make(scene, contract.SENSORS), deployment.sensors)
    _write_coverage(contract.find_or_make(scene, contract.COVERAGE), site.targets, deployment, aspect)


def take_over(
    scene: bpy.types.Scene, site: Site, deployment: Deployment, empties: Mapping[str, bpy.types.Object]
) -> None:
    """Make sensors that were moved by hand the scene's result; their objects are neither moved nor removed.

    Parameters
    ----------
    site : Site
        What the result was computed on.
    deployment : Deployment
        The sensors and what they see.
    empties : mapping of str to Object
        Theirs, by their labels.
    """
    contract.leave_shared(scene, contract.COVERAGE)
    aspect = _shown_aspect(scene)
    old = coverage_of(scene)
    if old is not None:
        _remove(old)
    for sensor in deployment.sensors:
        if sensor.label in empties:  # nobody has deleted it meanwhile
            rename_whole(empties[sensor.label], _name(sensor))
            _describe(empties[sensor.label], sensor)
    _write_coverage(contract.find_or_make(scene, contract.COVERAGE), site.targets, deployment, aspect)


def clear_result(scene: bpy.types.Scene) -> None:
    """Remove the objects and meshes of an earlier result."""
    for name in (contract.SENSORS, contract.COVERAGE):
        collection = contract.find(scene, name)
        if collection is not None:
            for obj in [obj for obj in collection.objects if contract.WRITTEN in obj]:
                _remove(obj)


def _remove(obj: bpy.types.Object) -> None:
    mesh = obj.data
    bpy.data.objects.remove(obj)
    if mesh is not None and not mesh.users:
        bpy.data.meshes.remove(mesh)


def _write_sensors(collection: bpy.types.Collection, sensors: Sequence[Sensor]) -> None:
    for sensor in sensors:
        empty = _empty(sensor)
        collection.objects.link(empty)
        name = f"{sensor.label} body"
        body = bpy.data.objects.new(name, mesh_of(name, _hardware(sensor)))
        body[contract.WRITTEN] = True
        attach_piece(body, empty)
        collection.objects.link(body)


def _empty(sensor: Sensor) -> bpy.types.Object:
    empty = bpy.data.objects.new(_name(sensor), None)
    empty.empty_display_type = "ARROWS"
    empty.empty_display_size = 0.8
    empty.show_in_front = True
    empty.location = sensor.xyz
    empty.rotation_euler = (0.0, sensor.tilt, sensor.yaw)
    _describe(empty, sensor)
    return empty


def _name(sensor: Sensor) -> str:
    return f"{sensor.model.key} @ {sensor.height:.3g} m{sensor.turned} · {sensor.position_name}"


def _describe(empty: bpy.types.Object, sensor: Sensor) -> None:
    """Write the sensor, its position and its coverage to the properties of an empty."""
    properties = {
        contract.WRITTEN: True,
        contract.LABEL: sensor.label,
        contract.SENSOR: sensor.model.key,
        "seip_sensor_name": sensor.model.name,
        contract.BEAMS: sensor.model.beams_key,
        contract.POSITION: sensor.position_name,
        "seip_on_pole": sensor.on_pole,
        "seip_height": sensor.height,
        "seip_yaw_deg": math.degrees(sensor.yaw),
        "seip_tilt_deg": math.degrees(sensor.tilt),
        "seip_range": sensor.model.max_range,
        "seip_price": sensor.price,
        "seip_coverage": sensor.alone,
        "seip_coverage_added": sensor.added,
        "seip_coverage_marginal": sensor.marginal,
    }
    for name, value in properties.items():
        empty[name] = value


def _hardware(sensor: Sensor) -> Solid:
    """Return the body and the post or bracket that carries it, in the axes of the sensor's empty."""
    angle = 2.0 * np.pi * np.arange(BODY_SIDES) / BODY_SIDES
    circle = BODY_RADIUS * np.column_stack((np.cos(angle), np.sin(angle)))
    body = prism(circle, -BODY_HEIGHT / 2, BODY_HEIGHT / 2, side="sensor")
    upright = sensor.orientation.T  # from the site's axes to the sensor's
    foot = upright @ (sensor.foot - sensor.xyz)
    top = np.array((0.0, 0.0, -BODY_HEIGHT / 2))  # of the post; the optical centre is the body's middle
    if not sensor.on_pole:
        return join(body, tube(foot, top, (POST_RADIUS, POST_RADIUS), "post"))
    aside = sensor.foot[:2] - sensor.xyz[:2]
    if math.hypot(*aside) > OFF_AXIS_DISTANCE:
        below = (sensor.orientation @ top)[2]
        shaft = upright @ np.array((*aside, below))  # on the pole's axis, as high as the underside of the body
        return join(body, tube(shaft, top, (BRACKET_RADIUS, BRACKET_RADIUS), "post"))
    return body


def coverage_of(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """Return the mesh that shows the coverage, None where no result has been written."""
    collection = contract.find(scene, contract.COVERAGE)
    own = [] if collection is None else [obj for obj in collection.objects if contract.WRITTEN in obj]
    return own[0] if own else None


def aspects_of(obj: bpy.types.Object) -> tuple[Aspect, ...]:
    """Return the aspects that a coverage mesh can show, first the one that a new placement is coloured by."""
    others: tuple[Aspect, ...] = ("times", "seen", "weights")
    return ("returns", *others) if RETURNS in obj.data.attributes else others


def shown_legend(scene: bpy.types.Scene) -> Legend | None:
    """Return what the colours of a scene's coverage mean, None where there is none."""
    obj = coverage_of(scene)
    if obj is None or CLASS_WORDS not in obj:
        return None
    shares = np.array(obj[SHARES], dtype=np.float64)
    return Legend(obj.get(TITLE, "Road surface"), tuple(obj[CLASS_WORDS]), tuple(obj[CLASS_COLOURS]), shares)


def paint(obj: bpy.types.Object, colours: Colouring) -> None:
    """Colour squares: ``seip_colour`` serves the viewport's Attribute colours, materials serve all others.

    The words and the shares of the classes stay with the object, for the legend.
    """
    mesh = obj.data
    palette = np.array([linear(colour) for colour in colours.colours], dtype=np.float32)
    attribute = mesh.color_attributes.get(COLOUR) or mesh.color_attributes.new(COLOUR, "FLOAT_COLOR", "CORNER")
    attribute.data.foreach_set("color", np.repeat(palette[colours.of], 4, axis=0).ravel())
    mesh.color_attributes.active_color_name = COLOUR
    mesh.materials.clear()
    for words, colour in zip(colours.words, colours.colours, strict=True):
        mesh.materials.append(matt(words, colour))
    mesh.polygons.foreach_set("material_index", colours.of.astype(np.int32))
    mesh.update()
    obj[CLASS_WORDS], obj[CLASS_COLOURS] = list(colours.words), list(colours.colours)
    obj[SHARES], obj[TITLE] = colours.shares.tolist(), colours.title
    obj[ASPECT] = ""


def recolour(scene: bpy.types.Scene, colours: Colouring) -> None:
    """Colour the squares of the coverage by classes of one's own.

    Parameters
    ----------
    colours : Colouring
        Of the targets that the coverage was written for, in their order.

    Raises
    ------
    SeipError
        There is no coverage, or it is of other targets.
    """
    obj = _shown_coverage(scene)
    if len(obj.data.polygons) != len(colours.of):
        raise SeipError(f"scene {scene.name!r} shows the coverage of other targets: place sensors again")
    paint(obj, colours)


def show_seen_by(scene: bpy.types.Scene, seen_by: Integer, returns: Float | None = None) -> None:
    """Show how many sensors see each target, under the aspect that is shown.

    Parameters
    ----------
    seen_by : (t,) int64
        How many sensors see each target, in the order of those that the coverage was written for.
    returns : (t,) float64, optional
        Expected returns from a pedestrian near each target, if they have changed.

    Raises
    ------
    SeipError
        There is no coverage, or it is of other targets.
    """
    obj = _shown_coverage(scene)
    aspect = obj.get(ASPECT) or aspects_of(obj)[0]  # nothing is compared any longer
    recolour(scene, as_placed(seen_by))
    obj.data.attributes[SEEN_BY].data.foreach_set("value", seen_by.astype(np.int32))
    if returns is not None and RETURNS in obj.data.attributes:
        obj.data.attributes[RETURNS].data.foreach_set("value", returns.astype(np.float32))
    colour_coverage(scene, aspect)


def colour_coverage(scene: bpy.types.Scene, aspect: Aspect) -> None:
    """Colour the coverage by one aspect, from what the mesh itself knows of its targets.

    Raises
    ------
    SeipError
        There is no coverage, or it has no returns to show.
    """
    obj = _shown_coverage(scene)
    attributes = obj.data.attributes
    seen_by = np.empty(len(obj.data.polygons), dtype=np.int32)
    weight = np.ones(len(seen_by), dtype=np.float32)  # a mesh of an earlier version has none
    attributes[SEEN_BY].data.foreach_get("value", seen_by)
    if TARGET_WEIGHT in attributes:
        attributes[TARGET_WEIGHT].data.foreach_get("value", weight)
    returns = None
    if RETURNS in attributes:
        returns = np.empty(len(seen_by), dtype=np.float32)
        attributes[RETURNS].data.foreach_get("value", returns)
    paint(obj, colouring(aspect, seen_by.astype(np.int64), weight.astype(np.float64), returns))
    obj[ASPECT] = aspect


def _shown_coverage(scene: bpy.types.Scene) -> bpy.types.Object:
    obj = coverage_of(scene)
    if obj is None:
        raise SeipError(f"scene {scene.name!r} shows no coverage: place sensors first")
    return obj


def _shown_aspect(scene: bpy.types.Scene) -> str:
    """Return the aspect that a user has chosen for the coverage, or "" while it is that of a new placement."""
    obj = coverage_of(scene)
    aspect = "" if obj is None else str(obj.get(ASPECT, ""))
    return "" if obj is None or aspect == aspects_of(obj)[0] else aspect


def _write_coverage(collection: bpy.types.Collection, targets: Targets, deployment: Deployment, aspect: str) -> None:
    obj = bpy.data.objects.new("Coverage", _coverage_mesh(targets, deployment))
    obj[contract.WRITTEN] = True
    possible = aspects_of(obj)
    shown = next((one for one in possible if one == aspect), possible[0])
    paint(obj, colouring(shown, deployment.seen_by, targets.weight, deployment.pedestrian_returns))
    obj[ASPECT] = shown
    obj["seip_coverage"] = deployment.coverage
    obj["seip_seen_twice"] = deployment.seen_twice
    obj["seip_coverage_weighted"] = deployment.weighted
    if deployment.central is not None:
        obj["seip_coverage_central"] = deployment.central
    obj["seip_price"] = deployment.price
    obj["seip_spacing"] = targets.spacing
    collection.objects.link(obj)


def _coverage_mesh(targets: Targets, deployment: Deployment) -> bpy.types.Mesh:
    """Return one square per target, in their order, with what is known of it."""
    seen_by, returns = deployment.seen_by, deployment.pedestrian_returns
    mesh = bpy.data.meshes.new("Coverage")
    corners = target_squares(targets).reshape(-1, 3) + np.array((0.0, 0.0, LIFT))
    mesh.from_pydata(corners.tolist(), [], np.arange(4 * len(targets)).reshape(-1, 4).tolist())
    mesh.attributes.new(SEEN_BY, "INT", "FACE").data.foreach_set("value", seen_by.astype(np.int32))
    mesh.attributes.new(TARGET_WEIGHT, "FLOAT", "FACE").data.foreach_set("value", targets.weight.astype(np.float32))
    if returns is not None:
        mesh.attributes.new(RETURNS, "FLOAT", "FACE").data.foreach_set("value", returns.astype(np.float32))
    return mesh
