"""A Co-Wizard whose observations and actions are followed as the learned one follows its own."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from dorothie_gym.baselines.acting.following import Following
from dorothie_gym.baselines.acting.history import KEPT, History
from dorothie_gym.baselines.acting.segments import spans_of
from dorothie_gym.engine.config import EnvConfig
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.maps import Town
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies import Policy, make_policy
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.recording import Session
from dorothie_gym.rollout import play_session
from dorothie_gym.spaces import ActionDict, CoWizardAction, heard_acts


class Listening(Policy[Any]):
    """Plays as another policy does.

    Attributes:
        following: what has happened so far, all of it.
        moments: after each decision with something new: what a policy that plays has then, and all that there is.
    """

    def __init__(self, policy: Policy[Any]) -> None:
        super().__init__(policy.role, policy.limits)
        self._policy = policy
        self.moments: list[tuple[History, History]] = []

    def initial_state(self, seed: int, town: Town) -> Any:
        self.town = town
        self.following: Following | None = None
        self._live: Following | None = None
        return self._policy.initial_state(seed, town)

    def step(self, observation: Mapping[str, Any], state: Any) -> tuple[ActionDict, Any]:
        action, state = self._policy.step(observation, state)
        view = CoWizardView.read(observation, self.town)
        heard = spans_of(str(observation["participant_text"]), heard_acts(observation, Role.PARTICIPANT))
        taken = CoWizardAction.decode(action, self.limits)

        def follow(before: Following | None, kept: float) -> Following:
            known = before or Following(history=History.begin(observation, self.town, kept))
            return known.observed(view, self.town, heard).acted(taken.speech, taken.physical, view, self.limits.spans)

        before = self.following.history.events if self.following else ()
        self.following, self._live = follow(self.following, float("inf")), follow(self._live, KEPT)
        if self.following.history.events != before:
            self.moments.append((self._live.history, self.following.history))
        return action, state


class Played(NamedTuple):
    """A session that was recorded, and what its Co-Wizard had of it."""

    session: Session
    listener: Listening
    env: DuoWizardEnv


def play(folder: Path, *, town: str, seed: int, seconds: float) -> Played:
    """Plays a session of the scripted three."""
    env = DuoWizardEnv(town, config=EnvConfig(max_seconds=seconds))
    policies = {role: make_policy("scripted", role, env.limits) for role in AGENT_ROLES}
    policies[Role.CO_WIZARD] = listener = Listening(policies[Role.CO_WIZARD])
    play_session(env, policies, seed=seed, folder=folder)
    return Played(Session.load(folder), listener, env)
