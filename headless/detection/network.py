"""The PointPillars network: pillar features → pseudo-image → feature map at half its resolution.

A. H. Lang et al.: PointPillars: Fast Encoders for Object Detection from Point Clouds. CVPR 2019.
"""

from itertools import pairwise

import torch
from torch import Tensor, nn

from .pillars import POINT_FEATURES
from .settings import NetworkSettings

OUTPUT_STRIDE = 2  # pillars along a side of a cell of the feature map

NORMALISATION_EPSILON, NORMALISATION_MOMENTUM = 1e-3, 0.03
"""Constants of batch normalisation: as published, but with running means that keep up with a short training."""


class PillarEncoder(nn.Module):
    """Linear layer, batch normalisation and ReLU for each point, then the maximum over each pillar.

    Parameters
    ----------
    width : int
        Channels of a pillar.
    padded_to : int
        Points that each pillar with points is filled up to with zeros; 0 for none.
    """

    def __init__(self, width: int, padded_to: int = 0) -> None:
        super().__init__()
        self.padded_to = padded_to
        self.linear = nn.Linear(POINT_FEATURES, width, bias=False)
        self.normalisation = nn.BatchNorm1d(width, NORMALISATION_EPSILON, NORMALISATION_MOMENTUM)

    def forward(self, features: Tensor, pillar: Tensor, count: int) -> Tensor:
        """Return the channels of ``count`` pillars, zero where there is no point, (count, width) Tensor.

        Parameters
        ----------
        features : (m, 8) float32 Tensor
        pillar : (m,) int64 Tensor
            Number of each point's pillar.
        """
        empty = features.new_zeros((count, self.linear.out_features))
        if len(features) < 2:  # nothing to normalise over while training, and one point is no object
            return empty
        if self.padded_to:
            met, places = torch.unique_consecutive(pillar, return_counts=True)
            empty_places = met.repeat_interleave((self.padded_to - places).clamp(min=0))
            pillar = torch.cat((pillar, empty_places))
            features = torch.cat((features, features.new_zeros((len(empty_places), POINT_FEATURES))))
        points = torch.relu(self.normalisation(self.linear(features)))
        # After ReLU nothing is below the zero that empty pillars hold.
        return empty.scatter_reduce(0, pillar[:, None].expand_as(points), points, "amax")


class Backbone(nn.Module):
    """Three blocks, each at half the resolution of the one before, brought to that of the first and set side by side.

    Parameters
    ----------
    width : int
        Channels of the pillars and of the first block, doubled in each block after that.
    blocks : tuple of three int
        Convolutions of each block after the one that halves its resolution.
    """

    def __init__(self, width: int, blocks: tuple[int, int, int]) -> None:
        super().__init__()
        channels = [width, width, 2 * width, 4 * width]
        self.channels = 3 * width
        self.down = nn.ModuleList(
            nn.Sequential(convolution(before, after, 2), *(convolution(after, after) for _ in range(count)))
            for (before, after), count in zip(pairwise(channels), blocks, strict=True)
        )
        self.up = nn.ModuleList(_upsampling(after, width, 2**block) for block, after in enumerate(channels[1:]))

    def forward(self, picture: Tensor) -> Tensor:
        """Return (b, 3 · width, rows / 2, columns / 2) features of a picture (b, width, rows, columns)."""
        levels = []
        for down, up in zip(self.down, self.up, strict=True):
            picture = down(picture)
            levels.append(up(picture))
        return torch.cat(levels, dim=1)


class FeatureMap(nn.Module):
    """Encoder and backbone together."""

    def __init__(self, settings: NetworkSettings) -> None:
        super().__init__()
        self.encoder = PillarEncoder(settings.width, settings.most_points if settings.padded else 0)
        self.backbone = Backbone(settings.width, settings.blocks)

    @property
    def channels(self) -> int:
        """Number of channels of the feature map."""
        return self.backbone.channels

    def forward(self, features: Tensor, pillar: Tensor, shape: tuple[int, int, int]) -> Tensor:
        """Return the feature map of some clouds, (clouds, channels, rows / 2, columns / 2) Tensor.

        Parameters
        ----------
        features, pillar : Tensor
            As in `PillarEncoder.forward`; pillars count through all clouds.
        shape : tuple of int
            Clouds, rows, columns.
        """
        clouds, rows, columns = shape
        with torch.autocast(features.device.type, enabled=False):  # many numbers of 16 bits would not add up
            pillars = self.encoder(features, pillar, clouds * rows * columns)
        # The channels of a pillar stay side by side in memory, which is how convolutions on the CPU like them best.
        picture = pillars.view(clouds, rows, columns, -1).permute(0, 3, 1, 2)
        features_: Tensor = self.backbone(picture)
        return features_


def convolution(before: int, after: int, stride: int = 1) -> nn.Sequential:
    """Return a 3 × 3 convolution with batch normalisation and ReLU."""
    return nn.Sequential(
        nn.Conv2d(before, after, 3, stride, padding=1, bias=False),
        nn.BatchNorm2d(after, NORMALISATION_EPSILON, NORMALISATION_MOMENTUM),
        nn.ReLU(inplace=True),
    )


def _upsampling(before: int, after: int, factor: int) -> nn.Sequential:
    return nn.Sequential(
        nn.ConvTranspose2d(before, after, factor, factor, bias=False),
        nn.BatchNorm2d(after, NORMALISATION_EPSILON, NORMALISATION_MOMENTUM),
        nn.ReLU(inplace=True),
    )
