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


def focal_loss(logits: Tensor, positive: Tensor, counted: Tensor, alpha: float = 0.25, gamma: float = 2.0) -> Tensor:
    """Return the focal loss for each positive (Lin et al. 2017).

    Parameters
    ----------
    logits : Tensor
        Before the sigmoid.
    positive, counted : bool Tensor of the same shape
        What is true, and what takes part.
    """
    share = torch.sigmoid(logits)
    hit = alpha * (1 - share).pow(gamma) * functional.softplus(-logits)
    false = (1 - alpha) * share.pow(gamma) * functional.softplus(logits)
    return (torch.where(positive, hit, false) * counted).sum() / (positive & counted).sum().clamp(min=1)


def weighted_mean(values: Tensor, weight: Tensor) -> Tensor:
    """Return Σ weight · value / Σ weight; zero where nothing weighs."""
    return (values * weight).sum() / weight.sum().clamp(min=1e-6)
