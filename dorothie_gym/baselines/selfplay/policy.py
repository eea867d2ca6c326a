"""Self-play models as policies for rollouts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch

from dorothie_gym.baselines.rl.checkpoint import DESCRIPTION, read_description, restore
from dorothie_gym.baselines.rl.settings import TrainingSettings
from dorothie_gym.baselines.selfplay.learner import draw, make_network
from dorothie_gym.baselines.selfplay.role_interface import RoleInterface
from dorothie_gym.baselines.selfplay.role_layout import RoleLayout, make_interface, pad_masks, pad_vectors
from dorothie_gym.baselines.selfplay.settings import SelfPlaySettings
from dorothie_gym.errors import ModelFileError
from dorothie_gym.maps import Town
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies import Policy
from dorothie_gym.spaces import ActionDict, SpaceLimits


@dataclass(frozen=True, kw_only=True)
class LearnedPolicyState:
    """State of a role in a session: its interface, its memory, and the number of decisions."""

    seat: RoleInterface[Any]
    memory: Any
    seed: int
    count: int = 0


class LearnedPolicy(Policy[LearnedPolicyState]):
    """Plays a role with a trained network, whose input is computed as in training.

    The policy does not read the engine's mask: its own mask contains what the role can infer from its observation. The
    few actions that the environment refuses nevertheless have no effect.
    """

    def __init__(self, role: Role, limits: SpaceLimits, model: Any, padded: tuple[int, int] | None) -> None:
        """Prepares the policy.

        Args:
            role: the role.
            limits: sizes of the spaces.
            model: MaskablePPO.
            padded: sizes of the vector and of the mask of a network shared by all roles; None for an own network.
        """
        super().__init__(role, limits)
        self._model, self._padded = model, padded

    def initial_state(self, seed: int, town: Town) -> LearnedPolicyState:
        """Returns the state before the first observation."""
        seat = make_interface(self.role, town, self.limits)
        return LearnedPolicyState(seat=seat, memory=seat.begin(), seed=seed)

    def step(self, observation: Mapping[str, Any], state: LearnedPolicyState) -> tuple[ActionDict, LearnedPolicyState]:
        """Samples an action from the network."""
        seat = state.seat
        memory = seat.notice(observation, state.memory)
        vectors, masks = seat.vector(observation, memory)[None], seat.mask(observation, memory)[None]
        if self._padded is not None:
            size, actions = self._padded
            vectors = pad_vectors(vectors, AGENT_ROLES.index(self.role), size)
            masks = pad_masks(masks, actions)
        rng = np.random.default_rng((state.seed, state.count))
        action, memory = seat.act(int(draw(self._model, vectors, masks, rng)[0]), observation, memory)
        return action.encode(self.limits), replace(state, memory=memory, count=state.count + 1)


def read_policy(path: Path, role: Role, limits: SpaceLimits) -> LearnedPolicy:
    """Reads the policy of a role.

    Args:
        path: folder of a role that `train-rl selfplay` has written, or `model.json` in it.
        role: the role to play.
        limits: sizes of the spaces.

    Raises:
        ValueError: the files are missing or damaged, of another role, or of another version.
    """
    folder = path.parent if path.is_file() else path
    found = read_description(folder)
    padded: tuple[int, int] | None = None
    try:
        learned, size, actions = Role(found["role"]), int(found["size"]), int(found["actions"])
        if found["padded"] is not None:
            padded = int(found["padded"][0]), int(found["padded"][1])
        settings: TrainingSettings = SelfPlaySettings(**found["settings"]).learner()
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise ModelFileError(f"{folder / DESCRIPTION}: is no model of self-play ({error!r})") from None
    if learned is not role:
        raise ModelFileError(f"{folder}: plays {learned}, not {role}")
    table, place = RoleLayout.of(limits), AGENT_ROLES.index(role)
    if (size, actions) != (table.sizes[place], table.actions[place]):
        raise ModelFileError(
            f"{folder / DESCRIPTION}: takes in {size} numbers and has {actions} actions, {role} has "
            f"{table.sizes[place]} and {table.actions[place]}: the model is of another version of dorothie_gym"
        )
    torch.set_num_threads(1)  # small networks: more threads only wait for one another
    model = make_network(settings, *(padded or (size, actions)))
    restore(model, folder)
    return LearnedPolicy(role, limits, model, padded)
