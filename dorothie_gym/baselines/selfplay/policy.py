"""What self-play has learned as a policy for rollouts."""

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
    """Where a role is in a session: at its seat, with what it remembers, after so many decisions."""

    seat: RoleInterface[Any]
    memory: Any
    seed: int
    count: int = 0


class LearnedPolicy(Policy[LearnedPolicyState]):
    """Plays a role as it was learned: what its network takes in follows from the observation as in training.

    Policies are not told `info["action_mask"]`: what it may do is what makes sense as far as the role can tell. The
    few actions that the car or the world refuse all the same do nothing.
    """

    def __init__(self, role: Role, limits: SpaceLimits, model: Any, padded: tuple[int, int] | None) -> None:
        """Takes a network.

        Args:
            role: whom it plays.
            limits: sizes of the spaces.
            model: MaskablePPO.
            padded: numbers and actions that the network has for all roles; None where it is the role's own.
        """
        super().__init__(role, limits)
        self._model, self._padded = model, padded

    def initial_state(self, seed: int, town: Town) -> LearnedPolicyState:
        """Takes the seat."""
        seat = make_interface(self.role, town, self.limits)
        return LearnedPolicyState(seat=seat, memory=seat.begin(), seed=seed)

    def step(self, observation: Mapping[str, Any], state: LearnedPolicyState) -> tuple[ActionDict, LearnedPolicyState]:
        """Draws an action from what the network takes for good."""
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
    """Reads what was learned for a role.

    Args:
        path: folder of a role that `train-rl selfplay` has written, or `model.json` in it.
        role: whom it is to play.
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
