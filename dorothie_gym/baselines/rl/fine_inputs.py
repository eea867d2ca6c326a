"""Inputs of networks in two scales."""

from __future__ import annotations

from typing import Final

import torch
from gymnasium import spaces
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor

GAIN: Final = 10.0
"""Factor of the fine scale."""


class FineInputs(BaseFeaturesExtractor):
    """Gives a network each input as it is, and a second time ten times as large and clipped to -1..1.

    Observations have one unit for their whole range, such as 25 m/s for speeds. A car that stands and one that rolls at
    1 m/s differ by 0.04 there, which a network of two layers is slow to learn to distinguish.
    """

    def __init__(self, observation_space: spaces.Space[object]) -> None:
        """Prepares the inputs for observations in a `Box` of shape (n,)."""
        super().__init__(observation_space, features_dim=2 * spaces.flatdim(observation_space))

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        """Returns the inputs of the network (batch, 2 n) for observations (batch, n)."""
        return torch.cat((observations, (GAIN * observations).clamp(-1.0, 1.0)), dim=-1)
