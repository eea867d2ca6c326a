"""Features of the pictures that drivers observe."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import torch
from gymnasium import spaces
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch import nn

from dorothie_gym.envs.navigation.dashboard import rows_of_dashboard

STREET: Final = 256
"""Number of features of the camera picture."""

DASHBOARD: Final = 64
"""Numbers that describe the dashboard."""


class PictureFeatures(BaseFeaturesExtractor):
    """Three convolutions of the whole picture, as Mnih et al. (2015) have them, and a linear layer for the dashboard.

    Icons and gauges of the dashboard always have the same pixels, so that a linear layer reads them. With half of the
    usual channels a step of learning takes a third of the time.
    """

    def __init__(self, observation_space: spaces.Box, channels: Sequence[int] = (32, 64, 64)) -> None:
        """Makes the layers.

        Args:
            observation_space: space of pictures (channels, h, w) in 0..255, which the policy scales to
                0..1.
            channels: channels of each convolution.
        """
        super().__init__(observation_space, STREET + DASHBOARD)
        first, second, third = channels
        convolutions = nn.Sequential(
            nn.Conv2d(observation_space.shape[0], first, 8, stride=4),
            nn.ReLU(),
            nn.Conv2d(first, second, 4, stride=2),
            nn.ReLU(),
            nn.Conv2d(second, third, 3),
            nn.ReLU(),
            nn.Flatten(),
        )
        with torch.no_grad():
            width = convolutions(torch.zeros(1, *observation_space.shape)).shape[1]
        self.street = nn.Sequential(convolutions, nn.Linear(width, STREET), nn.ReLU())
        channels_of_picture, height, columns = observation_space.shape
        self._rows = rows_of_dashboard(height)
        pixels = channels_of_picture * self._rows * columns
        self.dashboard = nn.Sequential(nn.Flatten(), nn.Linear(pixels, DASHBOARD), nn.ReLU())

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        """Returns features (batch, `STREET` + `DASHBOARD`) of pictures (batch, channels, h, w) in 0..1."""
        return torch.cat((self.street(observations), self.dashboard(observations[..., -self._rows :, :])), dim=1)
