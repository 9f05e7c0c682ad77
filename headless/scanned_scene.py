"""The open scene with its sensors, as the commands that scan read them."""

import argparse
from dataclasses import replace

import bpy

from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.scans.sensor import MountedSensor
from seip_addon.core.sensing.weather import weather_of
from seip_addon.scene.read import SceneReading, read_scene
from seip_addon.scene.sensors import read_sensors


def read_scanned_scene(options: argparse.Namespace) -> tuple[SceneReading, list[MountedSensor]]:
    """Read the open scene and its sensors, with the catalogue and the weather of the options.

    Raises
    ------
    SeipError
        An option, the scene or a sensor is invalid, or there are no sensors.
    """
    weather = weather_of(options.weather)
    reading = read_scene(bpy.context.scene)
    sensors = [
        replace(sensor, model=weather.through(sensor.model))
        for sensor in read_sensors(bpy.context.scene, load_catalogue(options.catalogue))
    ]
    return replace(reading, geometry=weather.over(reading.geometry)), sensors
