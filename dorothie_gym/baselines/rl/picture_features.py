"""Convolutions for pictures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import torch
from gymnasium import spaces
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch import nn

FEATURES: Final = 256
"""Numbers that describe a picture."""


class PictureFeatures(BaseFeaturesExtractor):
    """Three convolutions and a linear layer, as Mnih et al. (2015) have them, of chosen widths.

    With half of their channels a step of learning takes a third of the time.
    """

    def __init__(self, observation_space: spaces.Box, channels: Sequence[int] = (32, 64, 64)) -> None:
        """Makes the layers.

        Args:
            observation_space: of pictures (channels, h, w) in 0..255, which the policy scales to 0..1.
            channels: of each convolution.
        """
        super().__init__(observation_space, FEATURES)
        first, second, third = channels
        convolutions = nn.Sequential(
            nn.Conv2d(observation_space.shape[0], first, 8, stride=4), nn.ReLU(),
            nn.Conv2d(first, second, 4, stride=2), nn.ReLU(),
            nn.Conv2d(second, third, 3), nn.ReLU(),
            nn.Flatten(),
        )  # fmt: skip
        with torch.no_grad():
            width = convolutions(torch.zeros(1, *observation_space.shape)).shape[1]
        self.layers = nn.Sequential(convolutions, nn.Linear(width, FEATURES), nn.ReLU())

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        """Returns features (batch, `FEATURES`) of pictures (batch, channels, h, w) in 0..1."""
        features: torch.Tensor = self.layers(observations)
        return features
