"""Layers of the learned roles: hidden layers, and the scores of options of which one is chosen."""

from __future__ import annotations

import torch
from torch import Tensor, nn


def hidden_layers(inputs: int, width: int, dropout: float = 0.0) -> nn.Sequential:
    """Returns two hidden layers (b, inputs) -> (b, width).

    Args:
        inputs: length of the input.
        width: number of units of a layer.
        dropout: share of the units that are left out in training.
    """

    def activation() -> nn.Sequential:
        return nn.Sequential(nn.ReLU(), nn.Dropout(dropout))

    return nn.Sequential(nn.Linear(inputs, width), activation(), nn.Linear(width, width), activation())


def option_scorer(inputs: int, width: int) -> nn.Sequential:
    """Returns the layers that score one option, (..., inputs) -> (..., 1)."""
    return nn.Sequential(nn.Linear(inputs, width), nn.ReLU(), nn.Linear(width, 1))


def option_scores(scorer: nn.Module, hidden: Tensor, options: Tensor, count: Tensor) -> Tensor:
    """Returns the score of each option (b, k), almost minus infinity for those that are only filled in.

    Args:
        scorer: `option_scorer`.
        hidden: hidden layer (b, h).
        options: vectors of the options (b, k, n).
        count: number of options (b,).
    """
    number = options.shape[1]
    repeated = hidden[:, None, :].expand(-1, number, -1)
    scores: Tensor = scorer(torch.cat([repeated, options], dim=2)).squeeze(2)
    missing = torch.arange(number)[None, :] >= count[:, None]
    return scores.masked_fill(missing, -1e9)
