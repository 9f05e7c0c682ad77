"""LiDAR models: beams, price, returns and noise.

Visibility and scans share the law by which returns are detected. Noise and luck are for scans alone, and seeded.
"""

from .beams import BeamPattern, beam_directions
from .carla_dropoff import CarlaDropoff
from .catalogue import find_models, load_catalogue
from .model import LidarModel
from .noisy_returns import measured_returns, return_chance
from .range_equation import RangeEquation
from .rosette import Rosette
from .surface_patches import surface_deviation

__all__ = [
    "BeamPattern",
    "CarlaDropoff",
    "LidarModel",
    "RangeEquation",
    "Rosette",
    "beam_directions",
    "find_models",
    "load_catalogue",
    "measured_returns",
    "return_chance",
    "surface_deviation",
]
