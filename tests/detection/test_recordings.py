"""Recordings are made by sensors that hang as the placement has them."""

import math
from types import SimpleNamespace

from headless.studies.detection.sensor_configuration import SensorConfiguration

import numpy as np

from seip_addon.core.choosing.placement.deployment import Sensor
from seip_addon.core.geometry.orientation import orientation
from seip_addon.core.sensing.lidar.catalogue import load_catalogue


def test_a_tilted_sensor_records_tilted():
    turn = orientation(0.3, math.radians(20))
    where = {"position_name": "pole 1", "on_pole": True, "foot": np.zeros(3), "xyz": np.zeros(3), "height": 0.0}
    sensor = Sensor("S1", 0, load_catalogue()["type1"], **where, yaw=0.3, tilt=math.radians(20))
    deployment = SimpleNamespace(mounted=(sensor.mounted,))
    (mounted,) = SensorConfiguration("1 × type1", deployment, "type1", 1, "optimal", 0.0).sensors
    assert (mounted.orientation == turn).all()
