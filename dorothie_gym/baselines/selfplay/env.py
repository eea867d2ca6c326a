"""Sessions for self-play: all roles at once, with one row as observation and three numbers as action.

A `RoleLayout` describes the rows.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from dorothie_gym.baselines.selfplay.ad_wizard import AdWizardInterface
from dorothie_gym.baselines.selfplay.co_wizard import CoWizardInterface
from dorothie_gym.baselines.selfplay.participant import ParticipantInterface
from dorothie_gym.baselines.selfplay.role_interface import AnyRoleInterface, Mask
from dorothie_gym.engine.config import EnvConfig
from dorothie_gym.envs.duo_wizard_vector_env import DuoWizardVectorEnv, Stacked
from dorothie_gym.envs.navigation_config import TRAFFIC
from dorothie_gym.errors import SettingsError, StoryboardError
from dorothie_gym.maps.town import Town
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.policies.navigation.cost_to_go import CostToGo
from dorothie_gym.policies.navigation.observation_vector import Vector
from dorothie_gym.policies.policy import AnyPolicy, policy_seed
from dorothie_gym.policies.policy_loader import find_player, make_policy
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.sim.ego.planner import LocalPlanner
from dorothie_gym.spaces.actions import ActionDict, ActionMapping, StepInfo
from dorothie_gym.spaces.limits import SpaceLimits
from dorothie_gym.spaces.observations import Observation

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
    def observation_space(self) -> spaces.Space[Vector]:
        """Space of a row."""
        return spaces.Box(-1.0, 1.0, (self.width,), dtype=np.float32)

    @property
    def action_space(self) -> spaces.Space[NDArray[np.int64]]:
        """Space of the numbers of the roles' actions."""
        return spaces.MultiDiscrete(list(self.actions))

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


# --- Sessions ---------------------------------------------------------------------------------------------------------


class RolePlayers:
    """What the three roles of one session keep between decisions.

    Attributes:
        scripted: roles that the built-in policies play; a change takes effect at the next session.
        memories: memories of the roles, each of the type that its interface uses.
        policies: policies that play roles in this session.
        policy_states: their states.
        render_mode: None, which stable-baselines3 asks for.
    """

    render_mode = None

    def __init__(self, town: Town, scripted: Collection[Role]) -> None:
        self.scripted = scripted
        self.memories: list[Any] = []
        self.policies: Mapping[Role, AnyPolicy] = {}
        self.policy_states: dict[Role, object] = {}
        self._cost_to_go = CostToGo(town)
        self._distance = math.inf  # to the current subgoal [m]

    def set_target(self, planner: LocalPlanner) -> None:
        """Sets the participant's current subgoal as the target of the distance."""
        target = self.memories[_PARTICIPANT].target
        self._cost_to_go.aim(None if target is None else target.route.goal)
        self._distance = self._distance_left(planner)

    def approach(self, planner: LocalPlanner) -> float:
        """Returns by how much the distance to the previous decision's subgoal has decreased [m]."""
        left = self._distance_left(planner)
        return self._distance - left if math.isfinite(left) and math.isfinite(self._distance) else 0.0

    def _distance_left(self, planner: LocalPlanner) -> float:
        return self._cost_to_go.from_place(planner.lane, planner.station)


class SelfPlaySessions:
    """Sessions of which all three roles are played by numbers of actions, in one batch.

    Observations are rows of a `RoleLayout`. An action holds one number per role, see `RoleInterface`. Participant and
    Co-Wizard receive the mean of their rewards in `DuoWizardEnv`, the Ad-Wizard its own; each metre by which the route
    to the current subgoal gets shorter adds `progress` for the team and subtracts it for the Ad-Wizard.

    Attributes:
        duo: the environments inside.
        layout: layout of the rows.
        interfaces: interfaces of the roles, in the order of `AGENT_ROLES`.
        players: what the roles of each session keep.
        rows: present observations (n, width).
    """

    def __init__(
        self,
        count: int,
        town: str = "brookside",
        storyboard: str | None = None,
        traffic: str = "light",
        max_seconds: float = 600.0,
        progress: float = 0.02,
        participant: str | None = None,
        co_wizard: str | None = None,
        scripted: Collection[Role] = (),
        threads: int | None = None,
    ) -> None:
        """Prepares sessions.

        Args:
            count: number of sessions.
            town: name of a town, or path of a file.
            storyboard: name of a template, or path of a file; None draws one each reset.
            traffic: "none", "light", "medium" or "heavy".
            max_seconds: length of a session [s].
            progress: reward per metre; a potential difference, which does not change the optimal policies.
            participant: name or path of the policy that plays the participant; None for numbers of actions.
            co_wizard: the same for the Co-Wizard.
            scripted: roles that the built-in policies play; actions for roles that a policy plays are ignored.
            threads: number of threads; None for one per processor.

        Raises:
            SettingsError: an argument is invalid.
        """
        if traffic not in TRAFFIC:
            raise SettingsError(f"traffic is {traffic!r}; it must be one of {', '.join(TRAFFIC)}")
        vehicles, pedestrians = TRAFFIC[traffic]
        try:
            config = EnvConfig(max_seconds=max_seconds, world=WorldConfig(vehicles=vehicles, pedestrians=pedestrians))
            self._progress = float(progress)
            self.duo = DuoWizardVectorEnv(
                count, town, storyboard, config=config, threads=threads, autoreset_mode=AutoresetMode.DISABLED
            )
        except (TypeError, ValueError, OSError, StoryboardError) as error:
            raise SettingsError(f"selfplay: {error}") from error
        limits, self.town = self.duo.limits, self.duo.towns[0]
        self._policies = {role: make_policy("scripted", role, limits) for role in AGENT_ROLES}
        self._partners = _partners({Role.PARTICIPANT: participant, Role.CO_WIZARD: co_wizard}, limits)
        self.interfaces = [make_interface(role, self.town, limits) for role in AGENT_ROLES]
        self.layout = RoleLayout.of(limits)
        self.players = [RolePlayers(self.town, scripted) for _ in range(count)]
        self.rows: Vector = np.zeros((count, self.layout.width), dtype=np.float32)
        self._seen: dict[str, list[Observation]] = {str(role): [{}] * count for role in AGENT_ROLES}
        self._masks: dict[str, list[ActionMapping]] = {str(role): [{}] * count for role in AGENT_ROLES}

    def observation(self, role: Role, number: int) -> Observation:
        """Returns the present observation of a role in a session."""
        return self._seen[role][number]

    def begin(self, seeds: Mapping[int, int | None]) -> None:
        """Begins sessions, see `DuoWizardVectorEnv.reset`.

        Args:
            seeds: seed by number of the session; None takes the next of its series.
        """
        mask = np.zeros(len(self.players), dtype=np.bool_)
        mask[list(seeds)] = True
        every = [seeds.get(number) for number in range(len(self.players))]
        observations, infos = self.duo.reset(every, {"reset_mask": mask})
        for number in seeds:
            player, scenario = self.players[number], self.duo.engines[number].scenario
            player.memories = [interface.initial_memory() for interface in self.interfaces]
            player.policies = {**{role: self._policies[role] for role in player.scripted}, **self._partners}
            player.policy_states = {
                role: policy.initial_state(policy_seed(scenario.seed, role), self.town)
                for role, policy in player.policies.items()
            }
        self._look(sorted(seeds), observations, infos)

    def step(
        self, actions: NDArray[np.int64]
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], NDArray[np.bool_]]:
        """Plays a decision of all roles in all sessions; those that are over are to begin anew before the next.

        Args:
            actions: numbers of the actions (n, 3).

        Returns:
            Rewards of the roles (n, 3); whether sessions were terminated, were truncated, and succeeded (n,).

        Raises:
            ValueError: a number is not an action of its role.
        """
        for k, role in enumerate(AGENT_ROLES):
            wrong = actions[(actions[:, k] < 0) | (actions[:, k] >= self.layout.actions[k]), k]
            if wrong.size:
                raise ValueError(f"action of {role} is {wrong[0]}; it must be in 0..{self.layout.actions[k] - 1}")
        chosen = [self._act(number, own.tolist()) for number, own in enumerate(actions)]
        observations, rewards, terminations, truncations, infos = self.duo.step(chosen)
        terminated, truncated = terminations[Role.CO_WIZARD], truncations[Role.CO_WIZARD]
        sums = np.zeros((len(self.players), len(AGENT_ROLES)))
        successes = np.zeros(len(self.players), dtype=np.bool_)
        for number, player in enumerate(self.players):
            shaping = self._progress * player.approach(self._planner(number))
            team = (rewards[Role.PARTICIPANT][number] + rewards[Role.CO_WIZARD][number]) / 2.0 + shaping
            sums[number] = team, team, rewards[Role.AD_WIZARD][number] - shaping
            successes[number] = self.duo.engines[number].session.success
        self._look(range(len(self.players)), observations, infos)
        return sums, terminated, truncated, successes & (terminated | truncated)

    def close(self) -> None:
        """Closes the environments inside."""
        self.duo.close()

    def _planner(self, number: int) -> LocalPlanner:
        return self.duo.engines[number].session.world.planner

    def _act(self, number: int, choices: Sequence[int]) -> dict[str, ActionDict]:
        """Returns the actions of a session's roles."""
        player, actions = self.players[number], {}
        for k, (role, choice) in enumerate(zip(AGENT_ROLES, choices, strict=True)):
            seen = self._seen[role][number]
            policy = player.policies.get(role)
            if policy is not None:
                given = {**seen, "action_mask": self._masks[role][number]} if policy.reads_mask else seen
                actions[str(role)], player.policy_states[role] = policy.step(given, player.policy_states[role])
                continue
            own, player.memories[k] = self.interfaces[k].act(choice, seen, player.memories[k])
            actions[str(role)] = own.encode(self.duo.limits)
        return actions

    def _look(self, numbers: Sequence[int], observations: Mapping[str, Stacked], infos: Mapping[str, StepInfo]) -> None:
        """Updates memories, rows and targets of some sessions with their observations."""
        vectors, masks = [], []
        for k, (role, interface) in enumerate(zip(AGENT_ROLES, self.interfaces, strict=True)):
            stacked, allowed = observations[role], infos[role]["action_mask"]
            own, memories = [], []
            for number in numbers:
                seen = {name: values[number] for name, values in stacked.items()}
                memory = self.players[number].memories[k] = interface.update(seen, self.players[number].memories[k])
                permitted = {name: None if mask is None else mask[number] for name, mask in allowed.items()}
                own.append(interface.mask(seen, memory) & interface.permitted(seen, memory, permitted))
                memories.append(memory)
                self._seen[role][number], self._masks[role][number] = seen, permitted
            masks.append(own)
            chosen = {name: stacked[name][numbers] for name in (*interface.fields, "pose")}
            vectors.append(interface.vectors(chosen, [self._seen[role][number] for number in numbers], memories))
        self.rows[numbers] = np.concatenate([*vectors, *masks], axis=1)
        for number in numbers:
            self.players[number].set_target(self._planner(number))


def _partners(names: Mapping[Role, str | None], limits: SpaceLimits) -> dict[Role, AnyPolicy]:
    """Returns the policies that play roles in all sessions; raises `SettingsError` if one cannot be found or read."""
    try:
        return {role: find_player(name, role).make(role, limits) for role, name in names.items() if name is not None}
    except ValueError as error:
        raise SettingsError(f"selfplay: {error}") from error


# --- Environment ------------------------------------------------------------------------------------------------------


class SelfPlayEnv(gym.Env[Vector, NDArray[np.int64]]):
    """All three roles of a session as one environment: `SelfPlaySessions` with one session.

    `info["rewards"]` holds the three rewards; the returned reward is that of the team.

    Args:
        town, storyboard, traffic, max_seconds, progress, participant, co_wizard, scripted: see `SelfPlaySessions`.

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
        participant: str | None = None,
        co_wizard: str | None = None,
        scripted: Collection[Role] = (),
    ) -> None:
        self.sessions = SelfPlaySessions(
            1, town, storyboard, traffic, max_seconds, progress, participant, co_wizard, scripted, threads=1
        )
        self.layout = self.sessions.layout
        self.observation_space = self.layout.observation_space
        self.action_space = self.layout.action_space

    def reset(self, *, seed: int | None = None, options: Mapping[str, object] | None = None) -> tuple[Vector, StepInfo]:
        """Begins a session, see `DuoWizardEnv.reset`."""
        super().reset(seed=seed)
        self.sessions.begin({0: seed})
        return self.sessions.rows[0].copy(), {}

    def step(self, action: NDArray[np.int64]) -> tuple[Vector, float, bool, bool, StepInfo]:
        """Plays a decision of all roles; raises `ValueError` if a number is not an action of its role."""
        rewards, terminated, truncated, successes = self.sessions.step(np.asarray(action)[None])
        info: StepInfo = {"rewards": rewards[0].astype(np.float32)}
        if terminated[0] or truncated[0]:
            info["is_success"] = bool(successes[0])
        return self.sessions.rows[0].copy(), float(rewards[0, 0]), bool(terminated[0]), bool(truncated[0]), info

    def close(self) -> None:
        """Closes the environment inside."""
        self.sessions.close()
