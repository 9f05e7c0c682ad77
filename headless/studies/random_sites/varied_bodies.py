"""Bodies drawn at random for the road users of a run: sizes as real ones have them, roof and bonnet lines."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from seip_addon.core.sensing.traffic.trajectories import CATEGORIES, Trajectories

CORRELATION = 0.5  # correlation of any two dimensions of one kind of road user
REACH = 2.0  # largest distance of a drawn dimension from the mean, in standard deviations
SHAPES: Mapping[str, tuple[float, float, float, float]] = dict.fromkeys(CATEGORIES, (0.10, 0.06, 0.10, 0.06)) | {
    "car": (0.24, 0.10, 0.14, 0.08),
    "van": (0.20, 0.10, 0.12, 0.08),
}
"""Largest absolute value of each number of a shape; it moves the foot of a car's windscreen by up to 0.2 m."""
_STREAM = 0x626F6479  # keeps these draws apart from others of the same seed


@dataclass(frozen=True)
class BodyKind:
    """A kind of road user: its share within its category, and mean and standard deviation of its dimensions.

    Parameters
    ----------
    length, width, height : (mean, standard deviation), metres
        Normal distribution of each dimension, cut off `REACH` standard deviations from the mean.
    """

    share: float
    length: tuple[float, float]
    width: tuple[float, float]
    height: tuple[float, float]


KINDS: Mapping[str, Mapping[str, BodyKind]] = {
    "car": {
        "city car": BodyKind(0.10, (3.68, 0.04), (1.66, 0.03), (1.50, 0.03)),
        "supermini": BodyKind(0.22, (4.03, 0.07), (1.74, 0.03), (1.46, 0.04)),
        "compact": BodyKind(0.20, (4.32, 0.08), (1.80, 0.03), (1.47, 0.03)),
        "saloon or estate": BodyKind(0.18, (4.78, 0.12), (1.85, 0.03), (1.46, 0.03)),
        "small SUV": BodyKind(0.17, (4.32, 0.11), (1.82, 0.03), (1.61, 0.04)),
        "large SUV": BodyKind(0.08, (4.85, 0.15), (1.94, 0.04), (1.73, 0.05)),
        "people carrier": BodyKind(0.05, (4.60, 0.20), (1.84, 0.04), (1.68, 0.06)),
    },
    "van": {
        "small van": BodyKind(0.35, (4.52, 0.14), (1.85, 0.03), (1.85, 0.03)),
        "medium van": BodyKind(0.25, (5.20, 0.16), (1.96, 0.04), (1.98, 0.05)),
        "large van": BodyKind(0.28, (5.95, 0.20), (2.04, 0.03), (2.60, 0.08)),
        "long van": BodyKind(0.12, (6.90, 0.20), (2.05, 0.03), (2.77, 0.08)),
    },
    "truck": {
        "light truck": BodyKind(0.30, (6.60, 0.45), (2.25, 0.08), (2.90, 0.22)),
        "medium truck": BodyKind(0.40, (8.00, 0.45), (2.48, 0.04), (3.45, 0.15)),
        "large truck": BodyKind(0.30, (9.90, 0.60), (2.54, 0.01), (3.75, 0.10)),
    },
    "bus": {
        "minibus": BodyKind(0.15, (7.60, 0.30), (2.25, 0.08), (2.85, 0.08)),
        "midibus": BodyKind(0.25, (9.60, 0.50), (2.44, 0.03), (3.00, 0.08)),
        "city bus": BodyKind(0.45, (12.05, 0.12), (2.54, 0.01), (3.15, 0.12)),
        "coach": BodyKind(0.15, (12.80, 0.45), (2.54, 0.01), (3.65, 0.12)),
    },
    "motorcycle": {
        "scooter": BodyKind(0.50, (1.93, 0.08), (0.74, 0.03), (1.66, 0.05)),
        "motorcycle": BodyKind(0.50, (2.15, 0.08), (0.84, 0.04), (1.61, 0.06)),
    },
    "bicycle": {
        "bicycle": BodyKind(0.80, (1.80, 0.06), (0.62, 0.03), (1.75, 0.07)),
        "cargo bicycle": BodyKind(0.20, (2.45, 0.12), (0.70, 0.04), (1.75, 0.07)),
    },
    "pedestrian": {
        "adult": BodyKind(0.88, (0.48, 0.07), (0.56, 0.04), (1.71, 0.09)),
        "child": BodyKind(0.12, (0.36, 0.04), (0.44, 0.03), (1.32, 0.09)),
    },
}
"""Dimensions of vehicles and pedestrians in European cities, riders included, from published data of common models.

Articulated vehicles are left out: their bodies bend, and those here do not.
"""


def shaped(trajectories: Trajectories, seed: int) -> Trajectories:
    """Give each road user a shape of its own, without changing its size."""
    random = np.random.default_rng([seed, _STREAM, 1])
    return replace(
        trajectories,
        users=tuple(replace(user, shape=draw_shape(user.category, random)) for user in trajectories.users),
    )


def draw_size(category: str, random: np.random.Generator) -> tuple[float, float, float]:
    """Return a length, width and height of a category, metres to the centimetre."""
    kinds = list(KINDS[category].values())
    shares = np.array([kind.share for kind in kinds])
    kind = kinds[int(random.choice(len(kinds), p=shares / shares.sum()))]
    means, deviations = np.array([kind.length, kind.width, kind.height]).T
    while True:
        common, own = random.standard_normal(), random.standard_normal(3)
        scores = np.sqrt(CORRELATION) * common + np.sqrt(1.0 - CORRELATION) * own
        if np.abs(scores).max() <= REACH:
            length, width, height = (means + deviations * scores).round(2).tolist()
            return length, width, height


def draw_shape(category: str, random: np.random.Generator) -> tuple[float, float, float, float]:
    """Return a shape of a category: uniform within its `SHAPES`."""
    shift, spread, rise, stretch = (random.uniform(-1.0, 1.0, 4) * SHAPES[category]).round(4).tolist()
    return shift, spread, rise, stretch
