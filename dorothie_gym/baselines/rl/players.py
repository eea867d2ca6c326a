"""Models of `train-rl` as policies of rollouts."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import torch
from numpy.typing import NDArray

from dorothie_gym.baselines.rl.checkpoint import Model, load_model
from dorothie_gym.baselines.rl.environments import ROLE_ENVIRONMENTS, squashed
from dorothie_gym.baselines.rl.evaluation import greedy_policy
from dorothie_gym.baselines.rl.settings import NAVIGATION, TrainingSettings
from dorothie_gym.errors import SettingsError
from dorothie_gym.ontology.roles import Role
from dorothie_gym.policies.navigation.navigation_policy import NavigationPolicy
from dorothie_gym.policies.navigation.observation_fields import MAX_SECONDS, Vector
from dorothie_gym.policies.policy import AnyPolicy, Policy
from dorothie_gym.session.spaces.actions import ActionDict, action_space, noop
from dorothie_gym.session.spaces.flat import FlatActions, FlatObservations
from dorothie_gym.session.spaces.observations import ObservationMapping, observation_space

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.spaces.fields import SpaceLimits


def make_player(path: Path, role: Role, limits: SpaceLimits) -> AnyPolicy:
    """Returns a policy that plays a role greedily by a model.

    Args:
        path: folder of the model, or a file in it.
        role: the role to play.
        limits: sizes of the spaces.

    Raises:
        ModelFileError: the files are missing or damaged.
        SettingsError: the model was trained in an environment of another role, or with other spaces.
    """
    torch.set_num_threads(1)  # small networks: more threads only wait for each other
    model, settings = load_model(path)
    if settings.env == NAVIGATION and role is Role.CO_WIZARD:
        return _driver(path, model, settings, limits)
    if ROLE_ENVIRONMENTS.get(settings.env) is not role:
        own = [name for name, each in ROLE_ENVIRONMENTS.items() if each is role]
        fit = " or ".join([*([NAVIGATION] if role is Role.CO_WIZARD else []), *own])
        raise SettingsError(f"{path}: was trained in {settings.env}; only models trained in {fit} can play the {role}")
    policy = FlatPolicy(role, limits, model, masked=settings.masked)
    if not policy.fits():
        raise SettingsError(
            f"{path}: its observation or its actions have other sizes than those of the {role} in this town; it was "
            "trained with other settings, or by another version of dorothie_gym"
        )
    return policy


# --- Models of a role's environment ----------------------------------------------------------------------------------


class FlatPolicy(Policy[None]):
    """Plays a role by a model of the role's flat spaces, see `environments.make_env`."""

    reads_mask = True

    def __init__(self, role: Role, limits: SpaceLimits, model: Model, *, masked: bool) -> None:
        """Prepares the policy.

        Args:
            role: the role.
            limits: sizes of the spaces.
            model: the model.
            masked: whether it respects action masks.
        """
        super().__init__(role, limits)
        self._model, self._act = model, greedy_policy(model, masked=masked)
        self._observations = FlatObservations(observation_space(role, limits))
        self._actions = FlatActions(action_space(role, limits), rest=noop(role, limits))

    def fits(self) -> bool:
        """Returns whether the spaces of the model have the sizes of those of the role."""
        model = self._model
        return model.observation_space.shape == self._observations.low.shape and np.array_equal(
            getattr(model.action_space, "nvec", ()), self._actions.nvec
        )

    def initial_state(self, seed: int, town: Town) -> None:
        """Returns nothing: the policy has no memory and no random numbers."""

    def step(self, observation: ObservationMapping, state: None) -> tuple[ActionDict, None]:
        """Chooses the most likely action."""
        seen = {name: value for name, value in observation.items() if name != "action_mask"}
        vector, mask = squashed(self._observations.vector(seen)), self._actions.mask(observation["action_mask"])
        (chosen,) = self._act(vector[None], mask[None])
        return self._actions.fields(np.asarray(chosen, dtype=np.int64)), None


# --- Models of `Navigation-v0` ---------------------------------------------------------------------------------------


def _driver(path: Path, model: Model, settings: TrainingSettings, limits: SpaceLimits) -> NavigationPolicy:
    """Returns a Co-Wizard that drives by a model; raises `SettingsError` for one that observes pictures."""
    if settings.sees:
        raise SettingsError(
            f"{path}: was trained on pictures, which the co_wizard of a rollout does not get; train with "
            "--observation vector to play it"
        )
    seconds = settings.env_settings.get("max_seconds", MAX_SECONDS)
    return NavigationPolicy(GreedyDriver(model, masked=settings.masked), limits, max_seconds=seconds)


class GreedyDriver:
    """Greedy policy of a model for single observations of `Navigation-v0`."""

    def __init__(self, model: Model, *, masked: bool) -> None:
        self._model, self._masked = model, masked

    def __call__(self, observation: Vector, mask: NDArray[np.bool_]) -> int:
        """Returns an action of `Navigation-v0`; masked algorithms respect the mask (18,)."""
        keywords = {"action_masks": mask} if self._masked else {}
        return int(self._model.predict(observation, deterministic=True, **keywords)[0])
