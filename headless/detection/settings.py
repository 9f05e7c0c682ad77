"""Settings of the detector and of its training, with measured defaults."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from seip_addon.core.errors import SeipError
from seip_addon.core.settings import setting

Head = Literal["centre", "anchor"]

CLASS_CATEGORIES = {
    "car": ("car", "van"),
    "truck": ("truck", "bus"),
    "cycle": ("motorcycle", "bicycle"),
    "pedestrian": ("pedestrian",),
}
"""Classes of the detector and the categories of road users in each.

A van is a high car and a bus a truck with windows: in sparse clouds they look
alike, one class for both spends no detection on their difference, and their
sizes are regressed anyway.
"""

CLASSES = tuple(CLASS_CATEGORIES)
CLASS_OF = {category: number for number, group in enumerate(CLASS_CATEGORIES.values()) for category in group}
"""Number of the class of each category of road users."""

GRID_STRIDE = 8
"""Pillars along a side of the coarsest cell of the network: grids have a multiple of it."""


GROUND_ABOVE_BOTTOM = 1.0
"""Metres from the bottom of a detector's extent to the lowest road."""

HEADROOM = 4.5
"""Metres from the highest road to the top of a detector's extent."""


def _require(checks: dict[str, bool]) -> None:
    for sentence, holds in checks.items():
        if not holds:
            raise SeipError(f"detector: {sentence}")


def _whole(value: object, least: int, most: int) -> bool:
    return isinstance(value, int) and least <= value <= most


@dataclass(frozen=True)
class NetworkSettings:
    """Settings of the network: pillars, widths, blocks and head.

    Parameters
    ----------
    pillar : float, metres
        Side of a pillar.
    most_points : int
        Points that a pillar keeps, chosen at random.
    width : int
        Channels of the pillars and of the first block; the second has twice, the third four times as many.
    blocks : tuple of three int
        Convolutions of each block after the one that halves its resolution.
    head : str
        ``centre``: a heat map of centres for each class and one box in each cell (Yin, Zhou, Krähenbühl 2021).
        ``anchor``: boxes of given sizes at 0 and 90 degrees in each cell (Lang et al. 2019).
    padded : bool
        Whether the empty places of pillars count as points of nothing but zeros, as where padding is not masked:
        to see what harm that does.
    """

    pillar: float = setting(0.4, "side of a pillar in metres", unit="m", minimum=0.05, maximum=2.0, metavar="M")
    most_points: int = setting(16, "that a pillar keeps", minimum=1, maximum=32, option="points")
    width: int = setting(32, "channels of the first block", minimum=8, maximum=256)
    blocks: tuple[int, int, int] = setting((2, 3, 3), "convolutions in each", minimum=0, maximum=20, metavar="N")
    head: Head = setting("centre", "centres, or anchors as published")
    padded: bool = False

    def __post_init__(self) -> None:
        checks = {
            "a pillar must be 0.05 to 2 m wide": 0.05 <= self.pillar <= 2,
            "a pillar must keep 1 to 32 points": _whole(self.most_points, 1, 32),
            "the width must lie between 8 and 256 channels": _whole(self.width, 8, 256),
            "there must be three blocks of 0 to 20 convolutions": (
                len(self.blocks) == 3 and all(_whole(count, 0, 20) for count in self.blocks)
            ),
            "the head must be centre or anchor": self.head in {"centre", "anchor"},
            "padded must be true or false": isinstance(self.padded, bool),
        }
        _require(checks)


PUBLISHED_NETWORK = NetworkSettings(pillar=0.24, most_points=32, width=64, blocks=(3, 5, 5), head="anchor")
"""The network of the study: 0.24 m pillars of 32 points, blocks of 3, 5, 5 at 64, 128, 256 channels, anchors."""


@dataclass(frozen=True)
class TrainingSettings:
    """Settings of the training of a detector.

    Parameters
    ----------
    steps : int
        Updates of the weights at most.
    batch : int
        Windows in each step, each from a configuration, a frame and a place of its own.
    window : float, metres
        Side of a window. Training on windows about road users wastes no time on the empty parts of the extent, and
        many small ones are more different from each other than few large ones.
    learning_rate : float
        Largest of the cycle: one warm-up over 30 % of the steps, then a cosine to nothing (Smith 2018).
    least_points : int
        A road user with fewer returns is neither asked for nor held against the network.
    validate_every : int
        Steps from one validation to the next; the state is stored with each.
    patience : int
        Validations without improvement after which training stops.
    threads : int
        Of torch on the CPU. Sums depend on how they are split: the same number gives the same bytes. One is nearly
        as quick as two on windows of this size, and far quicker where other work wants the second core.
    """

    steps: int = setting(1800, "updates of the weights", minimum=1)
    batch: int = setting(16, "windows in a step", minimum=1)
    window: float = 25.6
    learning_rate: float = 6e-3
    weight_decay: float = 0.01
    least_points: int = 3
    validate_every: int = 300
    patience: int = 3
    seed: int = setting(1, "of weights and order", minimum=0)
    threads: int = setting(1, "of torch on the CPU", minimum=1)

    def __post_init__(self) -> None:
        checks = {
            "training must have 1 step or more": self.steps >= 1,
            "a batch must have 1 window or more": self.batch >= 1,
            "a window must be 5 m wide or more": self.window >= 5,
            "the learning rate must be positive": self.learning_rate > 0,
            "the weight decay must be 0 or more": self.weight_decay >= 0,
            "the fewest points must be 0 or more": self.least_points >= 0,
            "validation must come every step or more rarely": self.validate_every >= 1,
            "the patience must be 1 validation or more": self.patience >= 1,
            "the seed must be 0 or more": self.seed >= 0,
            "torch needs 1 thread or more": self.threads >= 1,
        }
        _require(checks)
