"""Classes of the detector, and settings of its network and its training."""

from dataclasses import dataclass

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.settings import setting

CLASS_CATEGORIES = {
    "car": ("car", "van"),
    "truck": ("truck", "bus"),
    "cycle": ("motorcycle", "bicycle"),
    "pedestrian": ("pedestrian",),
}
"""Classes of the detector and the categories of road users in each.

Cars and vans share a class, as do trucks and buses: they are hard to tell apart in sparse clouds, and their sizes are
regressed anyway.
"""

CLASSES = tuple(CLASS_CATEGORIES)
CLASS_OF = {category: number for number, group in enumerate(CLASS_CATEGORIES.values()) for category in group}
"""Index of the class of each category of road users."""

GRID_STRIDE = 8  # stride of the network's coarsest feature map in pillars; the sides of grids are multiples of it
BOTTOM, TOP = -1.0, 4.5  # metres above the road; points outside are not given to the network


def _is_integer(value: object, least: int, most: int) -> bool:
    return isinstance(value, int) and least <= value <= most


@dataclass(frozen=True)
class NetworkSettings:
    """Settings of the PointPillars network (Lang et al. 2019): pillars, widths and blocks.

    Parameters
    ----------
    pillar : float, metres
        Side of a pillar.
    most_points : int
        Maximum number of points per pillar; a random sample is kept of larger numbers.
    width : int
        Channels of the pillar features and of the first block, doubled in the second and in the third.
    blocks : tuple of three int
        Convolutions of each block after the one with stride 2.
    padded : bool
        Whether pillars are filled up with zero points that are not masked: an ablation.

    Examples
    --------
    >>> network = NetworkSettings(pillar=0.4)
    >>> round(network.pillar * GRID_STRIDE, 2)  # metres of road in a cell of the coarsest feature map
    3.2
    >>> [CLASSES[CLASS_OF[category]] for category in ("van", "bus", "bicycle")]
    ['car', 'truck', 'cycle']
    >>> NetworkSettings(pillar=5.0)
    Traceback (most recent call last):
    ...
    seip_addon.core.base.errors.SeipError: detector: a pillar must be 0.05 to 2 m wide
    """

    pillar: float = 0.32
    most_points: int = 16
    width: int = 40
    blocks: tuple[int, int, int] = (2, 3, 3)
    padded: bool = False

    def __post_init__(self) -> None:
        rules = {
            "a pillar must be 0.05 to 2 m wide": 0.05 <= self.pillar <= 2,
            "a pillar must keep 1 to 32 points": _is_integer(self.most_points, 1, 32),
            "the width must lie between 8 and 256 channels": _is_integer(self.width, 8, 256),
            "there must be three blocks of 0 to 20 convolutions": (
                len(self.blocks) == 3 and all(_is_integer(count, 0, 20) for count in self.blocks)
            ),
            "padded must be true or false": isinstance(self.padded, bool),
        }
        for rule, holds in rules.items():
            if not holds:
                raise SeipError(f"detector: {rule}")


@dataclass(frozen=True)
class TrainingSettings:
    """Settings of the training of a detector.

    Parameters
    ----------
    steps : int
        Maximum number of weight updates.
    batch : int
        Windows per step; each is drawn with its own sensor configuration, frame and position.
    window : float, metres
        Side of a window, which is cut out around a road user. Many small windows vary more than few large ones, and
        leave out empty parts of the region.
    learning_rate : float
        Maximum of the one-cycle schedule: warm-up over 30 % of the steps, then cosine annealing (Smith 2018).
    weight_decay : float
        Weight decay of AdamW.
    least_points : int
        Road users with fewer returns are ignored in loss and validation, neither required nor false positives.
    validate_every : int
        Steps between validations; each also stores a checkpoint.
    patience : int
        Validations without improvement before training stops.
    seed : int
        Seed of the initial weights and the order of samples.
    threads : int
        CPU threads of torch. Their number affects the order of sums, and so the exact result. One is nearly as fast as
        two with windows of the default size.
    """

    steps: int = setting(1800, "updates of the weights", minimum=1)
    batch: int = setting(16, "windows in a step", minimum=1)
    window: float = 25.6
    learning_rate: float = setting(6e-3, "maximum of the one-cycle schedule", minimum=1e-6, maximum=1.0, metavar="RATE")
    weight_decay: float = 0.01
    least_points: int = 3
    validate_every: int = 300
    patience: int = setting(3, "validations without improvement before training stops", minimum=1)
    seed: int = setting(1, "seed of the initial weights and the order of samples", minimum=0)
    threads: int = setting(1, "CPU threads of torch", minimum=1)
