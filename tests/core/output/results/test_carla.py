import math
from dataclasses import replace

import numpy as np
import pytest

from seip_addon.core.geometry.orientation import orientations
from seip_addon.core.output.results.carla import carla_spawns
from seip_addon.core.sensing.lidar.catalogue import load_catalogue


def test_location_is_the_map_position_with_y_negated(example):
    for spawn, sensor in zip(
        carla_spawns(example.deployment, example.site.origin), example.deployment.sensors, strict=True
    ):
        there = spawn["transform"]["location"]
        x, y, z = sensor.xyz + example.site.origin
        assert (there["x"], there["y"], there["z"]) == pytest.approx((x, -y, z), abs=1e-6)


@pytest.mark.parametrize(
    ("yaw", "tilt", "roll"), [(0.0, 0.2, 0.0), (1.0, -0.4, 0.3), (-2.5, 1.3, 0.0), (4.0, 0.0, -1.2), (0.5, 0.1, 3.0)]
)
def test_a_turned_sensor_hangs_the_same_in_left_handed_axes(example, yaw, tilt, roll):
    sensor = replace(example.deployment.sensors[0], yaw=yaw, tilt=tilt, roll=roll)
    turn = carla_spawns(replace(example.deployment, sensors=(sensor,)), np.zeros(3))[0]["transform"]["rotation"]
    p, y, r = (math.radians(turn[name]) for name in ("pitch", "yaw", "roll"))
    # Unreal's forward vector: up where the pitch is positive; its y is our -y.
    forward = (math.cos(p) * math.cos(y), -math.cos(p) * math.sin(y), math.sin(p))
    assert forward == pytest.approx(tuple(sensor.orientation[:, 0]), abs=1e-7)
    # CARLA: right-handed roll, pitch and yaw are its own, its own negated, its own negated.
    assert orientations(np.array(-y), np.array(-p), np.array(r)) == pytest.approx(sensor.orientation, abs=1e-7)


def test_attributes_are_text_that_set_attribute_takes(example):
    sensor = replace(example.deployment.sensors[0], model=load_catalogue()["type2"])
    spawn = carla_spawns(replace(example.deployment, sensors=(sensor,)), np.zeros(3))[0]
    assert spawn["blueprint"] == "sensor.lidar.ray_cast"
    assert spawn["note"] == ""
    assert spawn["attributes"] == {
        "role_name": "S1",
        "channels": "32",
        "range": "200",
        "points_per_second": "1200000",
        "rotation_frequency": "5",
        "upper_fov": "15",
        "lower_fov": "-25",
        "horizontal_fov": "360",
        "atmosphere_attenuation_rate": "0.004",
        "noise_stddev": "0.03",
        "dropoff_general_rate": "0.35",
        "dropoff_intensity_limit": "0.8",
        "dropoff_zero_intensity": "0.4",
    }


def test_every_shipped_model_has_a_field_of_view_that_holds_its_beams(example):
    for model in load_catalogue().values():
        sensor = replace(example.deployment.sensors[0], model=model)
        attributes = carla_spawns(replace(example.deployment, sensors=(sensor,)), np.zeros(3))[0]["attributes"]
        low, high = float(attributes["lower_fov"]), float(attributes["upper_fov"])
        assert low < high
        assert np.all((np.degrees(model.elevations) > low - 1e-6) & (np.degrees(model.elevations) < high + 1e-6))
