"""Losses of dense detectors."""

import torch
from torch import Tensor
from torch.nn import functional


def heat_map_loss(logits: Tensor, heat: Tensor, counted: Tensor) -> Tensor:
    r"""Return the focal loss of a heat map whose peaks are 1, for each peak (Law and Deng 2018, α = 2, β = 4).

    .. math:: -\frac1N \sum_c \begin{cases} (1 - p_c)^2 \log p_c & h_c = 1 \\
              (1 - h_c)^4 p_c^2 \log(1 - p_c) & \text{otherwise} \end{cases}

    Parameters
    ----------
    logits, heat : Tensor of the same shape
        What was predicted, before the sigmoid, and what is true, 0 to 1.
    counted : bool Tensor that spreads to that shape
        Cells that take part.
    """
    peak = (heat == 1.0) & counted
    share = torch.sigmoid(logits)
    hit = (1 - share).square() * functional.softplus(-logits)
    false = (1 - heat).pow(4) * share.square() * functional.softplus(logits)
    whole = torch.where(peak, hit, false) * counted
    return whole.sum() / peak.sum().clamp(min=1)


def weighted_mean(values: Tensor, weight: Tensor) -> Tensor:
    """Return Σ weight · value / Σ weight; zero where nothing weighs."""
    return (values * weight).sum() / weight.sum().clamp(min=1e-6)
