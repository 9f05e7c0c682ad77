"""The chosen sensors as CARLA LiDAR actors: blueprint, transform and attributes.

CARLA stands on Unreal's left-handed axes. A town's world coordinates are those of its OpenDRIVE map with y negated, so
a yaw that is counter-clockwise here is clockwise there [1]_; its pitch turns the nose up where it is positive, so that
a tilt has the opposite sign, and a roll the same [3]_. ``sensor.lidar.ray_cast`` spreads its channels evenly from
``upper_fov`` to ``lower_fov``, both included, and ``points_per_second / rotation_frequency / channels`` steps over
``horizontal_fov``, half of it on each side of its x axis [2]_.

.. [1] CARLA documentation, "Coordinates and transformations".
.. [2] CARLA documentation, "Sensors reference", LIDAR sensor.
.. [3] CARLA documentation, class ``carla::geom::RightHandedRotation``.
"""

import math
import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...choosing.placement.deployment import Deployment, Sensor
from ...geometry.orientation import clockwise_degrees, tilt_degrees
from ...sensing.lidar.carla_dropoff import CarlaDropoff
from ...sensing.lidar.model import LidarModel
from ...sensing.lidar.range_equation import DROPOFF_REFLECTIVITY
from ...storage.files import save_json

BLUEPRINT = "sensor.lidar.ray_cast"
EVEN_WITHIN = math.radians(0.02)  # a hundredth is what data sheets print


def carla_spawns(deployment: Deployment, origin: NDArray[np.float64]) -> list[dict[str, Any]]:
    """Return one description of an actor for each sensor, in the axes of the CARLA town made from the map.

    ``origin`` (3,) has the map coordinates of the local origin. Each has a ``blueprint``, a ``transform`` in metres and
    degrees, and ``attributes`` as the text that ``ActorBlueprint.set_attribute`` takes; see docs/formats.md.
    """
    return [_spawn(sensor, origin) for sensor in deployment.sensors]


def save_carla_spawns(path: str | os.PathLike[str], deployment: Deployment, origin: NDArray[np.float64]) -> None:
    """Write `carla_spawns` as JSON."""
    save_json(path, carla_spawns(deployment, origin))


def _spawn(sensor: Sensor, origin: NDArray[np.float64]) -> dict[str, Any]:
    x, y, z = (round(float(value), 6) for value in sensor.xyz + origin)
    return {
        "id": sensor.label,
        "blueprint": BLUEPRINT,
        "transform": {
            "location": {"x": x, "y": -y + 0.0, "z": z},
            "rotation": {
                "pitch": -tilt_degrees(sensor.tilt) + 0.0,
                "yaw": clockwise_degrees(sensor.yaw),
                "roll": tilt_degrees(sensor.roll),
            },
        },
        "attributes": _attributes(sensor),
        "note": _note(sensor.model),
    }


def _attributes(sensor: Sensor) -> dict[str, str]:
    model = sensor.model
    low, high = model.elevations.min(), model.elevations.max()
    dropoff = model.law if isinstance(model.law, CarlaDropoff) else model.law.as_dropoff()
    values = {
        "role_name": sensor.label,
        "channels": model.channels,
        "range": model.max_range,
        "points_per_second": round(model.points_per_second),
        "rotation_frequency": model.rotation_rate,
        "upper_fov": math.degrees(high),
        "lower_fov": math.degrees(low),
        "horizontal_fov": math.degrees(model.field_of_view),
        "atmosphere_attenuation_rate": dropoff.attenuation,
        "noise_stddev": model.range_noise_std,
        "dropoff_general_rate": dropoff.general,
        "dropoff_intensity_limit": dropoff.intensity_limit,
        "dropoff_zero_intensity": dropoff.zero_intensity,
    }
    return {name: f"{value:.10g}" if isinstance(value, float) else str(value) for name, value in values.items()}


def _note(model: LidarModel) -> str:
    """Return what CARLA cannot express, or ""."""
    parts = []
    descending = np.sort(model.elevations)[::-1]
    off = np.abs(descending - np.linspace(descending[0], descending[-1], len(descending))).max()
    if off > EVEN_WITHIN:
        parts.append(
            f"spaces its {len(descending)} channels unevenly, where CARLA spreads them evenly over the same field "
            f"of view, so that its beams are up to {math.degrees(off):.1f} degrees off in elevation"
        )
    ahead = np.abs(model.azimuth_offsets).max()
    if ahead > 0.0:
        parts.append(
            f"fires channels up to {math.degrees(ahead):.2f} degrees of azimuth off the direction of its head, "
            "where CARLA fires all along it"
        )
    if not isinstance(model.law, CarlaDropoff):
        parts.append(
            f"detects a surface by its reflectivity and angle, where CARLA loses returns by range alone: the drop-"
            f"off is that of {DROPOFF_REFLECTIVITY:.0%} reflectivity"
        )
    if model.min_range > 0.0:
        parts.append(f"returns nothing nearer than {model.min_range:g} m, where CARLA does")
    return f"{model.name} {'; it '.join(parts)}" if parts else ""
