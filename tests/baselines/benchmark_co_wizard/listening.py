"""Co-Wizard whose observations and actions are encoded as those of a benchmark model."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from dorothie_gym.baselines.benchmark_co_wizard.history import History, HistoryTracker
from dorothie_gym.baselines.benchmark_co_wizard.policy import spans_of
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.evaluation.teacher_forced.features import HistorySizes
from dorothie_gym.maps import Town
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies import Policy, make_policy
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.recording import Session
from dorothie_gym.session.spaces import ActionDict, CoWizardAction, heard_acts
from tests.baselines.benchmark_co_wizard.whole_history import WholeHistory

EVERYTHING = HistorySizes(moves=1 << 20, utterances=1 << 20, actions=1 << 20, window=1 << 20)
"""Sizes with which the incremental history drops nothing."""


class Listening(Policy[Any]):
    """Plays as another policy does, and keeps histories of what it observes and does.

    Attributes:
        tracker: tracker of a history of which everything is kept.
        moments: histories after each decision with something new: with what a batch of the default sizes shows, and
            the reference, with everything.
    """

    def __init__(self, policy: Policy[Any]) -> None:
        super().__init__(policy.role, policy.limits)
        self._policy = policy
        self.moments: list[tuple[History, WholeHistory]] = []

    def initial_state(self, seed: int, town: Town) -> Any:
        self.town = town
        self._trackers: list[HistoryTracker] = []
        return self._policy.initial_state(seed, town)

    @property
    def tracker(self) -> HistoryTracker:
        return self._trackers[0]

    def step(self, observation: Mapping[str, Any], state: Any) -> tuple[ActionDict, Any]:
        action, state = self._policy.step(observation, state)
        view = CoWizardView.read(observation, self.town)
        heard = spans_of(str(observation["participant_text"]), heard_acts(observation, Role.PARTICIPANT))
        taken = CoWizardAction.decode(action, self.limits)
        known: Any = self._trackers or [
            HistoryTracker(history=History.begin(observation, self.town, EVERYTHING)),
            HistoryTracker(history=History.begin(observation, self.town, HistorySizes())),
            HistoryTracker(history=WholeHistory.begin(observation, self.town)),
        ]
        events = known[-1].history.events
        self._trackers = [
            tracker.observed(view, self.town, heard).acted(taken.speech, taken.physical, view, self.limits.spans)
            for tracker in known
        ]
        _, shown, whole = (tracker.history for tracker in self._trackers)
        if whole.events != events:
            self.moments.append((shown, whole))
        return action, state


class Played(NamedTuple):
    """A recorded session, and the histories of its Co-Wizard."""

    session: Session
    listener: Listening
    env: DuoWizardEnv


def play(folder: Path, *, town: str, seed: int, seconds: float) -> Played:
    """Plays a session of the scripted three, in which every word is recognised."""
    env = DuoWizardEnv(town, config=EnvConfig(max_seconds=seconds, word_error_rate=0.0))
    policies = {role: make_policy("scripted", role, env.limits) for role in AGENT_ROLES}
    policies[Role.CO_WIZARD] = listener = Listening(policies[Role.CO_WIZARD])
    play_session(env, policies, seed=seed, folder=folder)
    return Played(Session.load(folder), listener, env)
