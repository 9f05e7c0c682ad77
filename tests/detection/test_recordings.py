"""Recordings are made by sensors that hang as the placement has them."""

import math
from types import SimpleNamespace

from headless.studies.detection.sensor_configuration import SensorConfiguration

import numpy as np

from seip_addon.core.geometry.orientation import orientation
from seip_addon.core.sensing.lidar.catalogue import load_catalogue


def test_a_tilted_sensor_records_tilted():
    turn = orientation(0.3, math.radians(20))
    sensor = SimpleNamespace(label="S1", model=load_catalogue()["type1"], xyz=np.zeros(3), orientation=turn)
    deployment = SimpleNamespace(sensors=(sensor,))
    (mounted,) = SensorConfiguration("1 × type1", deployment, "type1", 1, "optimal", 0.0).sensors
    assert (mounted.orientation == turn).all()
