"""LiDAR models: beams, price, returns and noise.

Visibility uses the beam pattern and the range alone. Noise, intensity and
drop-off are for scans of traffic, and seeded by the generator that is passed in.
"""

from .beams import BeamPattern, beam_directions
from .catalogue import find_models, load_catalogue
from .model import LidarModel
from .noisy_returns import measured_returns, return_chance, return_intensity

__all__ = [
    "BeamPattern",
    "LidarModel",
    "beam_directions",
    "find_models",
    "load_catalogue",
    "measured_returns",
    "return_chance",
    "return_intensity",
]
