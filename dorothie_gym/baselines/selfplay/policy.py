"""Policies of rollouts that play with networks trained by self-play."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch

from dorothie_gym.baselines.rl.checkpoint import Model, for_playing, read_description, read_settings, restore
from dorothie_gym.baselines.rl.settings import MAX_WIDTH, SelfPlaySettings, TrainingSettings
from dorothie_gym.baselines.selfplay.env import RoleLayout, make_interface, pad_masks, pad_vectors
from dorothie_gym.baselines.selfplay.learner import make_network, sample_actions
from dorothie_gym.baselines.selfplay.role_interface import AnyRoleInterface
from dorothie_gym.errors import ModelFileError, one_line
from dorothie_gym.maps.town import Town
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.policies.policy import Policy
from dorothie_gym.policies.policy_loader import DESCRIPTION
from dorothie_gym.spaces.actions import ActionDict
from dorothie_gym.spaces.limits import SpaceLimits
from dorothie_gym.spaces.observations import ObservationMapping


@dataclass(frozen=True, kw_only=True)
class LearnedPolicyState:
    """State of a role in a session.

    Attributes:
        interface: interface of the role in the town.
        memory: memory of the interface, of the type that it uses.
        seed: seed of the session's random draws.
        count: number of decisions.
    """

    interface: AnyRoleInterface
    memory: object
    seed: int
    count: int = 0


class LearnedPolicy(Policy[LearnedPolicyState]):
    """Plays a role with a trained network, whose input is computed as in training.

    The policy does not read the engine's mask: its own mask contains what the role can infer from its observation. The
    few actions that the environment refuses nevertheless have no effect.
    """

    def __init__(self, role: Role, limits: SpaceLimits, model: Model, padded: tuple[int, int] | None) -> None:
        """Prepares the policy.

        Args:
            role: the role.
            limits: sizes of the spaces.
            model: MaskablePPO.
            padded: lengths of the vector and of the mask of a network shared by all roles; None for an own network.
        """
        super().__init__(role, limits)
        self._model, self._padded = model, padded

    def initial_state(self, seed: int, town: Town) -> LearnedPolicyState:
        """Returns the state before the first observation."""
        interface = make_interface(self.role, town, self.limits)
        return LearnedPolicyState(interface=interface, memory=interface.initial_memory(), seed=seed)

    def step(
        self, observation: ObservationMapping, state: LearnedPolicyState
    ) -> tuple[ActionDict, LearnedPolicyState]:  # fmt: skip
        """Samples an action from the network."""
        interface = state.interface
        memory = interface.update(observation, state.memory)
        vectors, masks = interface.vector(observation, memory)[None], interface.mask(observation, memory)[None]
        if self._padded is not None:
            size, actions = self._padded
            vectors = pad_vectors(vectors, AGENT_ROLES.index(self.role), size)
            masks = pad_masks(masks, actions)
        rng = np.random.default_rng((state.seed, state.count))
        choice = int(sample_actions(self._model, vectors, masks, rng)[0])
        action, memory = interface.act(choice, observation, memory)
        return action.encode(self.limits), replace(state, memory=memory, count=state.count + 1)


def read_policy(path: Path, role: Role, limits: SpaceLimits) -> LearnedPolicy:
    """Reads the policy of a role.

    Args:
        path: folder of a role that `train-rl selfplay` has written, or `model.json` in it.
        role: the role to play.
        limits: sizes of the spaces.

    Raises:
        ModelFileError: the files are missing or damaged, of another role, or of another version.
    """
    folder = path.parent if path.is_file() else path
    page = read_description(folder)
    padded: tuple[int, int] | None = None
    try:
        learned, size, actions = Role(page["role"]), int(page["size"]), int(page["actions"])
        if page["padded"] is not None:
            padded = int(page["padded"][0]), int(page["padded"][1])
        settings: TrainingSettings = for_playing(read_settings(page, SelfPlaySettings, folder).learner())
    except ModelFileError:
        raise
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise ModelFileError(f"{folder / DESCRIPTION}: is no model of self-play ({one_line(repr(error))})") from None
    if learned is not role:
        raise ModelFileError(f"{folder}: plays {learned}, not {role}")
    layout, index = RoleLayout.of(limits), AGENT_ROLES.index(role)
    if (size, actions) != (layout.sizes[index], layout.actions[index]):
        raise ModelFileError(
            f"{folder / DESCRIPTION}: takes {size} numbers and has {actions} actions, {role} has "
            f"{layout.sizes[index]} and {layout.actions[index]}: the model is of another version of dorothie_gym"
        )
    if padded is not None and not (size <= padded[0] <= MAX_WIDTH and actions <= padded[1] <= MAX_WIDTH):
        raise ModelFileError(
            f"{folder / DESCRIPTION}: field 'padded' is {list(padded)}; it must be at least {[size, actions]}"
        )
    torch.set_num_threads(1)  # small networks: more threads only wait for each other
    model = make_network(settings, *(padded or (size, actions)))
    restore(model, folder)
    return LearnedPolicy(role, limits, model, padded)
