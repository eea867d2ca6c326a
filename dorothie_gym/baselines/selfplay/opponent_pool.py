"""Opponent pool of past Ad-Wizard checkpoints, against overfitting to the present one."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from safetensors import SafetensorError
from safetensors.torch import load_file, save_file

from dorothie_gym.errors import ModelFileError

FILE: Final = "past.safetensors"

KEPT: Final = 5
"""Largest number of checkpoints; the latest are kept."""


class OpponentPool:
    """Weights of a network at the ends of the last stretches of training."""

    def __init__(self) -> None:
        self._weights: list[dict[str, torch.Tensor]] = []

    def __len__(self) -> int:
        return len(self._weights)

    def keep(self, model: Any) -> None:
        """Adds the present weights of a model."""
        now = {name: value.detach().clone() for name, value in model.policy.state_dict().items()}
        self._weights = [*self._weights, now][-KEPT:]

    def revive(self, model: Any, rng: np.random.Generator) -> None:
        """Loads a random member of the pool, which must not be empty, into a model."""
        model.policy.load_state_dict(self._weights[int(rng.integers(len(self._weights)))])

    def save(self, folder: Path) -> None:
        """Writes the pool into a folder."""
        flat: Mapping[str, torch.Tensor] = {
            f"{k}/{name}": value.contiguous()
            for k, weights in enumerate(self._weights)
            for name, value in weights.items()
        }
        save_file(dict(flat), folder / FILE)

    def load(self, folder: Path) -> None:
        """Reads a saved pool; raises `ModelFileError` if it cannot be read."""
        path = folder / FILE
        try:
            tensors = load_file(path)
        except (SafetensorError, OSError) as error:
            raise ModelFileError(f"{path}: cannot be read ({error})") from None
        self._weights = [{} for _ in {name.split("/", 1)[0] for name in tensors}]
        for name, value in tensors.items():
            number, key = name.split("/", 1)
            self._weights[int(number)][key] = value
