"""Models of `train-rl` as Co-Wizards."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.baselines.rl.settings import NAVIGATION
from dorothie_gym.baselines.rl.weights import load_model
from dorothie_gym.errors import SettingsError
from dorothie_gym.policies.navigation import NavigationPolicy
from dorothie_gym.policies.navigation.observation_vector import MAX_SECONDS, Vector
from dorothie_gym.spaces import SpaceLimits


def make_player(path: Path, limits: SpaceLimits) -> NavigationPolicy:
    """A Co-Wizard who drives as a model does when it does not explore.

    Args:
        path: folder of the model, or a file in it.
        limits: sizes of the spaces.

    Raises:
        ModelFileError: the files are missing or damaged.
        SettingsError: the model did not learn in `Navigation-v0`.
    """
    model, settings = load_model(path)
    if settings.env != NAVIGATION:
        raise SettingsError(f"{path}: learned in {settings.env}; only drivers of {NAVIGATION} can play the co_wizard")
    seconds = settings.env_settings.get("max_seconds", MAX_SECONDS)
    return NavigationPolicy(Chooser(model, masked=settings.masked), limits, max_seconds=seconds)


class Chooser:
    """Chooses what a model finds best."""

    def __init__(self, model: Any, *, masked: bool) -> None:
        self._model, self._masked = model, masked

    def __call__(self, observation: Vector, mask: NDArray[np.bool_]) -> int:
        """One of the actions of `Navigation-v0`; masked algorithms keep to the mask (18,)."""
        more = {"action_masks": mask} if self._masked else {}
        return int(self._model.predict(observation, deterministic=True, **more)[0])
