"""Scans of traffic: the points that all sensors measure at one instant, and the boxes of that instant."""

from .frame import Frame, Labels
from .sensor import MountedSensor, level_orientation
from .simulation import ScanSettings, Simulation, frame_times, prepare
from .static_scene import StaticScene, static_scene

__all__ = [
    "Frame",
    "Labels",
    "MountedSensor",
    "ScanSettings",
    "Simulation",
    "StaticScene",
    "frame_times",
    "level_orientation",
    "prepare",
    "static_scene",
]
