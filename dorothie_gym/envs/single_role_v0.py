"""`Participant-v0`, `CoWizard-v0` and `AdWizard-v0`: one role for the agent, policies for the other two."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import deepcopy
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

from dorothie_gym.envs.session_view import METADATA, SessionView, metadata_at
from dorothie_gym.evaluation.tier_settings import tier_settings
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.policies.casting import partners_of
from dorothie_gym.policies.decision_random import policy_seed
from dorothie_gym.policies.policy import AnyPolicy, checked_decision, policy_inputs
from dorothie_gym.session.scenario import ResetOptions, check_options, scenario_option
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.spaces.actions import ActionDict, ActionMapping, StepInfo, action_space, noop
from dorothie_gym.session.spaces.observations import Observation
from dorothie_gym.support.copying import Restorable, Unchanged, taken
from dorothie_gym.support.time_limit import TimeLimitedEnv, decisions_in

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.config import EnvConfig
    from dorothie_gym.tasks.storyboard import StoryboardTemplate


class SingleRole(Restorable, TimeLimitedEnv[Observation, ActionDict]):
    """One of the three roles for the agent; policies play the other two.

    ## Description
    The session of `DuoWizardEnv` from the view of one role. The policies of the other two act on their own
    observations only. `engine` is the `SessionEngine` that runs the session.

    ## Agents
    One: the agent plays `role`.

    ## Observation Space
    The `Dict` of the role, see `dorothie_gym.session.spaces.observation_space`.

    ## Action Space
    The `Dict` of the role, see `ParticipantAction`, `CoWizardAction` and `AdWizardAction` in
    `dorothie_gym.session.spaces`.
    `info["action_mask"]` has the same fields: `action_space.sample(mask=info["action_mask"])`. An action that cannot be
    carried out is refused and reported in `info["refused"]`; a malformed one raises `ValueError` with the field.
    `dorothie_gym.flatten` makes both spaces flat.

    ## Rewards
    The weighted sum of the role's terms in `info["reward_terms"]` (see `RewardWeights`). The Ad-Wizard gets the shared
    terms with the opposite sign.

    ## Episode End
    Terminates when the destination is reached; truncates after `config.max_seconds` or `max_cycles` decisions.
    `info["is_success"]` states at the end whether every live subgoal was reached without a collision caused by the ego,
    and is False before.

    ## Arguments
    - `role`: role of the agent, `"participant"`, `"co_wizard"` or `"ad_wizard"`.
    - `town`, `storyboard`, `config`, `render_mode`, `max_cycles`, `render_view`: as in `DuoWizardEnv`.
    - `view`: picture of `render()`: `"role"` (what the role observes) or `"session"` (the whole session).
    - `partners`: policy of each other role: `"scripted"` (default), `"silent"`, `"random"`, a class as
      `"module:Class"`, or a `Policy`.
    - `tier`: name of a `Tier`, which gives town, settings and partners that are not given themselves.

    `reset(seed=...)` plays the session that `DuoWizardEnv` has for this seed; the seeds of the partners follow from it.
    `reset(options={"scenario": Scenario})` plays a given scenario.

    ## Version History
    - v0: first version.
    """

    metadata = METADATA
    MUTABLE_ATTRIBUTES: ClassVar[Sequence[str]] = ("_np_random", "_np_random_seed")

    def __init__(
        self,
        role: Role | str,
        town: str | Path | Town | None = None,
        storyboard: str | Path | StoryboardTemplate | None = None,
        config: EnvConfig | Mapping[str, object] | None = None,
        partners: Mapping[str, str | AnyPolicy] | None = None,
        render_mode: str | None = None,
        max_cycles: int | None = None,
        view: str = "role",
        render_view: str = "map",
        tier: str | None = None,
    ) -> None:
        if role not in AGENT_ROLES:
            raise ValueError(f"role is {str(role)!r}; it must be one of {', '.join(AGENT_ROLES)}")
        self.role = Role(role)
        usual = tier_settings(tier, self.role)
        self.engine = SessionEngine(
            usual.town if town is None else town,
            storyboard,
            config=usual.config if config is None else config,
            max_cycles=max_cycles,
        )
        rate = self.engine.config.decision_frequency
        self.metadata = metadata_at(rate)
        self.render_mode = render_mode
        self._view = SessionView.of_role(self.role, view, render_mode, rate, render_view)
        limits = self.engine.limits
        self.observation_space = deepcopy(self.engine.observation_space(self.role))
        self.action_space = deepcopy(action_space(self.role, limits))
        self.partners = partners_of(self.role, {**usual.partners, **(partners or {})}, limits)
        self._observing = (self.role, *(role for role, policy in self.partners.items() if policy.observes))
        self._states: dict[Role, object] = {}

    @property
    def decision_limit(self) -> int:
        """Decisions until truncation."""
        config = self.engine.config
        return self.engine.max_cycles or decisions_in(config.max_seconds, config.decision_frequency)

    @property
    def noop_action(self) -> ActionDict:
        """The action without effect."""
        return noop(self.role, self.engine.limits)

    def reset(self, *, seed: int | None = None, options: ResetOptions | None = None) -> tuple[Observation, StepInfo]:
        """Begins a session.

        Args:
            seed: seed of the session; without one it is drawn.
            options: `scenario` plays a given `Scenario`; other options cause a warning.
        """
        super().reset(seed=seed)
        check_options(options, "scenario")
        session = seed if seed is not None else int(self.np_random.integers(2**31))
        observations = self.engine.reset(session, scenario=scenario_option(options))
        scenario = self.engine.scenario
        self._states = {
            role: policy.initial_state(policy_seed(scenario.seed, role), self.engine.town)
            for role, policy in self.partners.items()
        }
        observation = observations.of(self._observing)[self.role]
        self._view.begin(self.engine.session)
        self._show(observation)
        return observation, {**self.engine.info(self.role), "is_success": False}

    def step(self, action: ActionMapping) -> tuple[Observation, float, bool, bool, StepInfo]:
        """Plays one decision of all roles.

        Raises:
            ValueError: the action is malformed; the message names the field.
            gymnasium.error.ResetNeeded: no session is in progress.
        """
        if not self._states or self.engine.over:
            raise ResetNeeded("no session is being played: call reset() first")
        inputs, actions = policy_inputs(self.engine, self.partners), {str(self.role): action}
        for role, policy in self.partners.items():
            decision = policy.step(inputs[role], self._states[role])
            actions[role], self._states[role] = checked_decision(role, decision)
        outcome = self.engine.step(actions)
        terms = outcome.reward_terms[self.role]
        info = self.engine.info(self.role, terms)
        info["is_success"] = self.engine.over and self.engine.session.success
        reward = float(sum(terms.values()))
        observation = self.engine.observations.of((self.role,) if self.engine.over else self._observing)[self.role]
        self._show(observation)
        return observation, reward, outcome.terminated, outcome.truncated, info

    def render(self) -> NDArray[np.uint8] | None:
        """Draws the role's observation, or the session (see `view`), as `DuoWizardEnv.render`."""
        return self._view.render(self.engine.session)

    def _show(self, observation: Observation) -> None:
        self._view.note(observation)
        if self.render_mode == "human":
            self.render()

    def close(self) -> None:
        """Closes the window, if there is one."""
        self._view.close()

    def mutable_values(self) -> dict[str, object]:
        """Returns the changing values of the environment, its engine and its partners."""
        states = {role: Unchanged(state) for role, state in self._states.items()}
        return {
            **super().mutable_values(),
            "engine": self.engine.mutable_values(),
            "partners": states,
            "view": self._view.notes,
        }

    def apply_values(self, values: dict[str, object]) -> None:
        """Applies the values of the environment, its engine and its partners."""
        engine, states = taken(values, "engine", dict), taken(values, "partners", dict)
        notes = taken(values, "view", tuple)
        super().apply_values(values)
        self.engine.apply_values(engine)
        self._states = {role: state.value for role, state in states.items()}
        if self._states:
            self._view.apply_values(notes, self.engine.session)

    def compatibility(self) -> dict[str, object]:
        """Returns role and partners, and the values of the engine that must be equal."""
        partners = {str(role): type(policy).__name__ for role, policy in self.partners.items()}
        return {
            **self.engine.compatibility(),
            **super().compatibility(),
            "the role": self.role,
            "the partners": partners,
        }
