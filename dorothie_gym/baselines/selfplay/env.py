"""`DuoWizardEnv` for self-play: what is at all three seats in one row, and a number for each role as the action."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from dorothie_gym.baselines.selfplay.role_layout import RoleLayout, make_interface
from dorothie_gym.engine.config import EnvConfig
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.envs.navigation_config import TRAFFIC
from dorothie_gym.errors import SettingsError, StoryboardError
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies import make_policy
from dorothie_gym.policies.navigation.cost_to_go import CostToGo
from dorothie_gym.policies.policy import policy_seed
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.spaces import ActionDict

_PARTICIPANT = AGENT_ROLES.index(Role.PARTICIPANT)


class SelfPlayEnv(gym.Env[NDArray[np.float32], NDArray[np.int64]]):
    """All three roles of a session at once.

    Observations are rows of a `RoleLayout`: three vectors and three masks. Actions are three numbers, see the seats.
    Participant and Co-Wizard get the mean of their rewards, the Ad-Wizard its own; both as `DuoWizardEnv` has them,
    and for each metre by which the way to the present errand has got shorter `progress` more, the Ad-Wizard less.
    `info["rewards"]` has the three rewards; the reward itself is the team's.

    Args:
        town: name of a town, or path of a file.
        storyboard: name of a template, or path of a file; None draws one each reset.
        traffic: "none", "light", "medium" or "heavy".
        max_seconds: of a session [s].
        progress: see above; a difference of potentials, which leaves the best policies as they are.
        scripted: roles that the built-in policies play; what is chosen for them counts for nothing. It may be set
            anew, for the sessions that begin then.

    Raises:
        SettingsError: an argument cannot be used.
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
        self._seats = [make_interface(role, self.duo.town, limits) for role in AGENT_ROLES]
        self.table = RoleLayout.of(limits)
        self.observation_space = spaces.Box(-1.0, 1.0, (self.table.width,), dtype=np.float32)
        self.action_space = spaces.MultiDiscrete(list(self.table.actions))
        self._way_left = CostToGo(self.duo.town)
        self._memories: list[Any] = []
        self._seen: Mapping[str, Any] = {}
        self._plans: dict[Role, Any] = {}
        self._left = math.inf

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begins a session, see `DuoWizardEnv.reset`."""
        super().reset(seed=seed)
        self._seen, infos = self.duo.reset(seed=seed, options=options)
        self._memories = [seat.begin() for seat in self._seats]
        self._plans = {
            role: self._policies[role].initial_state(policy_seed(self.duo.scenario.seed, role), self.duo.town)
            for role in self.scripted
        }
        row = self._row(infos)
        self._aim()
        return row, {}

    def step(
        self, action: NDArray[np.int64]
    ) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:  # fmt: skip
        """Plays a decision of all roles; raises `ValueError` where a number is no action of its role."""
        actions: dict[str, ActionDict] = {}
        for k, role in enumerate(AGENT_ROLES):
            if not 0 <= int(action[k]) < self.table.actions[k]:
                raise ValueError(f"action of {role} is {action[k]}; it must be in 0..{self.table.actions[k] - 1}")
            seen = self._seen[role]
            if role in self._plans:
                actions[role], self._plans[role] = self._policies[role].step(seen, self._plans[role])
                continue
            done, self._memories[k] = self._seats[k].act(int(action[k]), seen, self._memories[k])
            actions[role] = done.encode(self.duo.limits)
        self._seen, rewards, terminations, truncations, infos = self.duo.step(actions)
        nearer = self._nearer()
        team = (rewards[Role.PARTICIPANT] + rewards[Role.CO_WIZARD]) / 2.0 + self._progress * nearer
        against = rewards[Role.AD_WIZARD] - self._progress * nearer
        row = self._row(infos)
        self._aim()
        info: dict[str, Any] = {"rewards": np.array([team, team, against], dtype=np.float32)}
        terminated, truncated = terminations[Role.CO_WIZARD], truncations[Role.CO_WIZARD]
        if terminated or truncated:
            info["is_success"] = bool(self.duo.summary()["success"])
        return row, team, terminated, truncated, info

    def close(self) -> None:
        """Closes the environment inside."""
        self.duo.close()

    def _row(self, infos: Mapping[str, Mapping[str, Any]]) -> NDArray[np.float32]:
        """Returns the row of the three roles' vectors and masks."""
        vectors, masks = [], []
        for k, (role, seat) in enumerate(zip(AGENT_ROLES, self._seats, strict=True)):
            seen = self._seen[role]
            memory = self._memories[k] = seat.notice(seen, self._memories[k])
            vectors.append(seat.vector(seen, memory))
            masks.append(seat.mask(seen, memory) & seat.allowed(seen, infos[role]["action_mask"]))
        return np.concatenate([*vectors, *masks]).astype(np.float32)

    def _aim(self) -> None:
        """Measures the remaining way to the participant's current subgoal."""
        errand = self._memories[_PARTICIPANT].errand
        self._way_left.aim(None if errand is None else errand.journey.goal)
        self._left = self._measured()

    def _nearer(self) -> float:
        """Returns by how much the way to the last decision's subgoal has become shorter [m]."""
        left = self._measured()
        return self._left - left if math.isfinite(left) and math.isfinite(self._left) else 0.0

    def _measured(self) -> float:
        planner = self.duo.session.world.planner
        return self._way_left.from_place(planner.lane, planner.station)
