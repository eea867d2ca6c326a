"""`DuoWizardEnv` for self-play: one environment for all roles, with one row as observation and three numbers as action.

A `RoleLayout` describes the rows.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from dorothie_gym.baselines.selfplay.ad_wizard import AdWizardInterface
from dorothie_gym.baselines.selfplay.co_wizard import CoWizardInterface
from dorothie_gym.baselines.selfplay.participant import ParticipantInterface
from dorothie_gym.baselines.selfplay.role_interface import AnyRoleInterface, Mask
from dorothie_gym.engine.config import EnvConfig
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.envs.navigation_config import TRAFFIC
from dorothie_gym.errors import SettingsError, StoryboardError
from dorothie_gym.maps import Town
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies import make_policy
from dorothie_gym.policies.navigation.cost_to_go import CostToGo
from dorothie_gym.policies.navigation.observation_vector import Vector
from dorothie_gym.policies.policy import policy_seed
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.spaces import ActionDict, Observation, SpaceLimits, StepInfo

_PARTICIPANT = AGENT_ROLES.index(Role.PARTICIPANT)

_INTERFACES: dict[Role, type[AnyRoleInterface]] = {
    interface.role: interface for interface in (ParticipantInterface, CoWizardInterface, AdWizardInterface)
}


def make_interface(role: Role, town: Town, limits: SpaceLimits) -> AnyRoleInterface:
    """Returns the interface of a role."""
    return _INTERFACES[role](town, limits)


# --- Rows -------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class RoleLayout:
    """Layout of the rows: the input vectors of the three roles in the order of `AGENT_ROLES`, then their masks.

    A network that all roles share takes padded vectors and masks: vectors are filled with zeros to the longest and
    followed by the one-hot role; masks are filled with actions that are not permitted.

    Attributes:
        sizes: lengths of the vectors.
        actions: numbers of actions, which are the lengths of the masks.
    """

    sizes: tuple[int, ...]
    actions: tuple[int, ...]

    @classmethod
    def of(cls, limits: SpaceLimits) -> RoleLayout:
        """Returns the layout for sizes of spaces."""
        interfaces = [_INTERFACES[role] for role in AGENT_ROLES]
        return cls(
            tuple(interface.size_for(limits) for interface in interfaces),
            tuple(interface.actions for interface in interfaces),
        )

    @property
    def width(self) -> int:
        """Length of a row."""
        return sum(self.sizes) + sum(self.actions)

    @property
    def padded_size(self) -> int:
        """Length of a padded vector."""
        return max(self.sizes) + len(self.sizes)

    @property
    def padded_actions(self) -> int:
        """Length of a padded mask."""
        return max(self.actions)

    def vectors(self, rows: Vector, role: int, *, padded: bool) -> Vector:
        """Returns the vectors of a role, given by its index in `AGENT_ROLES`, in rows (n, width)."""
        begin = sum(self.sizes[:role])
        own = rows[:, begin : begin + self.sizes[role]]
        if not padded:
            return own
        return pad_vectors(own, role, self.padded_size)

    def masks(self, rows: Vector, role: int, *, padded: bool) -> Mask:
        """Returns the masks of a role in rows (n, width)."""
        begin = sum(self.sizes) + sum(self.actions[:role])
        own = rows[:, begin : begin + self.actions[role]] > 0.0
        return pad_masks(own, self.padded_actions) if padded else own


def pad_vectors(vectors: Vector, role: int, size: int) -> Vector:
    """Returns vectors (n, m) of a role padded to (n, size); the last numbers encode the role."""
    padded = np.zeros((len(vectors), size), dtype=np.float32)
    padded[:, : vectors.shape[1]] = vectors
    padded[:, size - len(AGENT_ROLES) + role] = 1.0
    return padded


def pad_masks(masks: Mask, actions: int) -> Mask:
    """Returns masks (n, m) padded to (n, actions)."""
    padded = np.zeros((len(masks), actions), dtype=np.bool_)
    padded[:, : masks.shape[1]] = masks
    return padded


# --- Environment ------------------------------------------------------------------------------------------------------


class SelfPlayEnv(gym.Env[Vector, NDArray[np.int64]]):
    """All three roles of a session as one environment.

    Observations are rows of a `RoleLayout`. An action holds one number per role, see `RoleInterface`. Participant and
    Co-Wizard receive the mean of their rewards in `DuoWizardEnv`, the Ad-Wizard its own; each metre by which the route
    to the current subgoal gets shorter adds `progress` for the team and subtracts it for the Ad-Wizard.
    `info["rewards"]` holds the three rewards; the returned reward is that of the team.

    Args:
        town: name of a town, or path of a file.
        storyboard: name of a template, or path of a file; None draws one each reset.
        traffic: "none", "light", "medium" or "heavy".
        max_seconds: length of a session [s].
        progress: reward per metre; a potential difference, which does not change the optimal policies.
        scripted: roles that the built-in policies play; actions for these roles are ignored. A change takes effect at
            the next reset.

    Raises:
        SettingsError: an argument is invalid.
    """

    def __init__(
        self,
        town: str = "brookside",
        storyboard: str | None = None,
        traffic: str = "light",
        max_seconds: float = 600.0,
        progress: float = 0.02,
        scripted: Collection[Role] = (),
    ) -> None:
        if traffic not in TRAFFIC:
            raise SettingsError(f"traffic is {traffic!r}; it must be one of {', '.join(TRAFFIC)}")
        vehicles, pedestrians = TRAFFIC[traffic]
        try:
            config = EnvConfig(max_seconds=max_seconds, world=WorldConfig(vehicles=vehicles, pedestrians=pedestrians))
            self._progress = float(progress)
            self.duo = DuoWizardEnv(town, storyboard, config=config)
        except (TypeError, ValueError, OSError, StoryboardError) as error:
            raise SettingsError(f"selfplay: {error}") from error
        limits = self.duo.limits
        self.scripted = scripted
        self._policies = {role: make_policy("scripted", role, limits) for role in AGENT_ROLES}
        self._interfaces = [make_interface(role, self.duo.town, limits) for role in AGENT_ROLES]
        self.layout = RoleLayout.of(limits)
        self.observation_space = spaces.Box(-1.0, 1.0, (self.layout.width,), dtype=np.float32)
        self.action_space = spaces.MultiDiscrete(list(self.layout.actions))
        self._cost_to_go = CostToGo(self.duo.town)
        self._memories: list[Any] = []  # by role, of the type that its interface uses
        self._observations: Mapping[str, Observation] = {}
        self._policy_states: dict[Role, object] = {}
        self._distance = math.inf  # to the current subgoal [m]

    def reset(self, *, seed: int | None = None, options: Mapping[str, object] | None = None) -> tuple[Vector, StepInfo]:
        """Begins a session, see `DuoWizardEnv.reset`."""
        super().reset(seed=seed)
        self._observations, infos = self.duo.reset(seed=seed, options=options)
        self._memories = [interface.initial_memory() for interface in self._interfaces]
        self._policy_states = {
            role: self._policies[role].initial_state(policy_seed(self.duo.scenario.seed, role), self.duo.town)
            for role in self.scripted
        }
        row = self._row(infos)
        self._set_target()
        return row, {}

    def step(self, action: NDArray[np.int64]) -> tuple[Vector, float, bool, bool, StepInfo]:
        """Plays a decision of all roles; raises `ValueError` if a number is not an action of its role."""
        actions: dict[str, ActionDict] = {}
        for k, role in enumerate(AGENT_ROLES):
            if not 0 <= int(action[k]) < self.layout.actions[k]:
                raise ValueError(f"action of {role} is {action[k]}; it must be in 0..{self.layout.actions[k] - 1}")
            observation = self._observations[role]
            if role in self._policy_states:
                policy = self._policies[role]
                actions[role], self._policy_states[role] = policy.step(observation, self._policy_states[role])
                continue
            own, self._memories[k] = self._interfaces[k].act(int(action[k]), observation, self._memories[k])
            actions[role] = own.encode(self.duo.limits)
        self._observations, rewards, terminations, truncations, infos = self.duo.step(actions)
        shaping = self._progress * self._approach()
        team = (rewards[Role.PARTICIPANT] + rewards[Role.CO_WIZARD]) / 2.0 + shaping
        opponent = rewards[Role.AD_WIZARD] - shaping
        row = self._row(infos)
        self._set_target()
        info: StepInfo = {"rewards": np.array([team, team, opponent], dtype=np.float32)}
        terminated, truncated = terminations[Role.CO_WIZARD], truncations[Role.CO_WIZARD]
        if terminated or truncated:
            info["is_success"] = bool(self.duo.summary()["success"])
        return row, team, terminated, truncated, info

    def close(self) -> None:
        """Closes the environment inside."""
        self.duo.close()

    def _row(self, infos: Mapping[str, StepInfo]) -> Vector:
        """Returns the row of the three roles' vectors and masks."""
        vectors, masks = [], []
        for k, (role, interface) in enumerate(zip(AGENT_ROLES, self._interfaces, strict=True)):
            observation = self._observations[role]
            memory = self._memories[k] = interface.update(observation, self._memories[k])
            vectors.append(interface.vector(observation, memory))
            permitted = interface.permitted(observation, infos[role]["action_mask"])
            masks.append(interface.mask(observation, memory) & permitted)
        return np.concatenate([*vectors, *masks]).astype(np.float32)

    def _set_target(self) -> None:
        """Sets the participant's current subgoal as the target of the distance."""
        target = self._memories[_PARTICIPANT].target
        self._cost_to_go.aim(None if target is None else target.route.goal)
        self._distance = self._distance_left()

    def _approach(self) -> float:
        """Returns by how much the distance to the previous decision's subgoal has decreased [m]."""
        left = self._distance_left()
        return self._distance - left if math.isfinite(left) and math.isfinite(self._distance) else 0.0

    def _distance_left(self) -> float:
        planner = self.duo.session.world.planner
        return self._cost_to_go.from_place(planner.lane, planner.station)
