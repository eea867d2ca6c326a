"""One role of `DuoWizardEnv` as a Gymnasium environment; policies play the other two."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

from dorothie_gym.engine.config import EnvConfig
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.maps import Town
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies import Policy, make_policy
from dorothie_gym.policies.policy import policy_seed
from dorothie_gym.spaces import ActionDict, Observation, noop
from dorothie_gym.tasks import StoryboardTemplate


class SingleRole(gym.Env[Observation, ActionDict]):
    """One of the three roles, alone with two policies.

    ## Description
    The session of `DuoWizardEnv`, seen and played by one role. The other two are played by policies, which act on
    their own observations only.

    ## Observation Space
    The `Dict` of the role, see `dorothie_gym.spaces.observation_space`.

    ## Action Space
    The `Dict` of the role, see `ParticipantAction`, `CoWizardAction` and `AdWizardAction` in `dorothie_gym.spaces`.
    `info["action_mask"]` mirrors it: `action_space.sample(mask=info["action_mask"])`. An illegal action is refused and
    told in `info["refused"]`; a malformed one raises `ValueError` naming the field. `dorothie_gym.flatten` makes both
    spaces flat.

    ## Rewards
    The weighted sum of the role's terms, which are in `info["reward_terms"]` (see `RewardWeights`).

    ## Episode End
    Terminates when the destination is reached, truncates after `config.max_seconds` or `max_cycles` decisions;
    then `info["is_success"]` tells whether all went well.

    ## Arguments
    - `role`: who is played, `"participant"`, `"co_wizard"` or `"ad_wizard"`.
    - `town`, `storyboard`, `config`, `render_mode`, `max_cycles`: as of `DuoWizardEnv`.
    - `partners`: who plays the others, by role: `"scripted"` (default), `"silent"`, `"random"`, or a `Policy`.

    `reset(seed=...)` plays the session that `DuoWizardEnv` has for this seed; the partners' seeds follow from it.
    `reset(options={"scenario": Scenario})` plays a given scenario.

    ## Version History
    - v0: first version.
    """

    metadata: ClassVar[dict[str, Any]] = {  # type: ignore[misc]
        "render_modes": list(DuoWizardEnv.metadata["render_modes"]),
        "render_fps": DuoWizardEnv.metadata["render_fps"],
    }

    def __init__(
        self,
        role: Role | str,
        town: str | Path | Town = "brookside",
        storyboard: str | Path | StoryboardTemplate | None = None,
        config: EnvConfig | None = None,
        partners: Mapping[str, str | Policy[Any]] | None = None,
        render_mode: str | None = None,
        max_cycles: int | None = None,
    ) -> None:
        if role not in AGENT_ROLES:
            raise ValueError(f"role is {str(role)!r}; it must be one of {', '.join(AGENT_ROLES)}")
        self.role = Role(role)
        self.duo = DuoWizardEnv(town, storyboard, config=config, render_mode=render_mode, max_cycles=max_cycles)
        self.render_mode = render_mode
        self.observation_space = self.duo.observation_space(self.role)
        self.action_space = self.duo.action_space(self.role)
        self.partners = self._cast(partners or {})
        self._states: dict[Role, Any] = {}
        self._observations: dict[str, Observation] = {}

    @property
    def noop_action(self) -> ActionDict:
        """The action that does nothing."""
        return noop(self.role, self.duo.limits)

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begins a session.

        Args:
            seed: of the session; without one it is drawn.
            options: as of `DuoWizardEnv.reset`.
        """
        super().reset(seed=seed)
        session = seed if seed is not None else int(self.np_random.integers(2**31))
        self._observations, infos = self.duo.reset(seed=session, options=options)
        self._states = {
            role: policy.initial_state(policy_seed(self.duo.scenario.seed, role), self.duo.town)
            for role, policy in self.partners.items()
        }
        return self._observations[self.role], infos[self.role]

    def step(self, action: Mapping[str, Any]) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Plays one decision of all roles.

        Raises:
            ValueError: the action is malformed; the message names the field.
            gymnasium.error.ResetNeeded: no session is being played.
        """
        if not self.duo.agents:
            raise ResetNeeded("no session is being played: call reset() first")
        actions: dict[str, Mapping[str, Any]] = {self.role: action}
        for role, policy in self.partners.items():
            actions[role], self._states[role] = policy.step(self._observations[role], self._states[role])
        self._observations, rewards, terminations, truncations, infos = self.duo.step(actions)
        terminated, truncated, info = terminations[self.role], truncations[self.role], infos[self.role]
        if terminated or truncated:
            info["is_success"] = bool(self.duo.summary()["success"])
        return self._observations[self.role], rewards[self.role], terminated, truncated, info

    def render(self) -> NDArray[np.uint8] | None:
        """Draws the aerial view, see `DuoWizardEnv.render`."""
        return self.duo.render()

    def close(self) -> None:
        """Closes the window, if there is one."""
        self.duo.close()

    def _cast(self, wanted: Mapping[str, str | Policy[Any]]) -> dict[Role, Policy[Any]]:
        others = [role for role in AGENT_ROLES if role is not self.role]
        for name in wanted:
            if name not in others:
                raise ValueError(f"partners has {str(name)!r}; the others are {' and '.join(others)}")
        cast: dict[Role, Policy[Any]] = {}
        for role in others:
            policy = wanted.get(role, "scripted")
            cast[role] = make_policy(policy, role, self.duo.limits) if isinstance(policy, str) else policy
            if cast[role].role is not role:
                raise ValueError(f"partners has a policy of {cast[role].role} for {role}")
            if cast[role].limits != self.duo.limits:
                raise ValueError(f"the policy of {role} has other SpaceLimits than the town's: {self.duo.limits}")
        return cast
