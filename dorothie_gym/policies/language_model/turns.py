"""Turns of a role that is played by text: when an answer is requested, and what it does.

`LanguageModelPolicy` asks a model for each answer; a session of `dorothie_gym.agents` hands the page out and waits for
the answer. Both go through the same turns, so that equal answers give equal sessions.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from dorothie_gym.ontology.roles import Role
from dorothie_gym.policies.language_model.ad_wizard import AdWizardInterface
from dorothie_gym.policies.language_model.co_wizard import CoWizardInterface
from dorothie_gym.policies.language_model.config import QUIET_TIME, check_quiet_time
from dorothie_gym.policies.language_model.participant import ParticipantInterface
from dorothie_gym.policies.language_model.role_interface import Memory, RoleInterface
from dorothie_gym.policies.observation_parser import scalar, titles_of
from dorothie_gym.policies.policy import replace

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.policies.language_model.answer_schema import AnswerSchema
    from dorothie_gym.session.spaces.actions import ActionDict
    from dorothie_gym.session.spaces.fields import SpaceLimits
    from dorothie_gym.session.spaces.observations import ObservationMapping

_INTERFACES: Final[Mapping[Role, type[RoleInterface[Any]]]] = {
    Role.PARTICIPANT: ParticipantInterface,
    Role.CO_WIZARD: CoWizardInterface,
    Role.AD_WIZARD: AdWizardInterface,
}


@dataclass(frozen=True, kw_only=True)
class PendingAnswer:
    """Answer that takes effect at a time [s]."""

    ready_at: float
    answer: Mapping[str, str]


@dataclass(frozen=True, kw_only=True)
class TurnState:
    """State of the turns of a role.

    Attributes:
        memory: memory of the role.
        events: events since the last turn, in words.
        asked_at: time of the last turn [s]; None before the first.
        delay: simulated time that the last answer took [s].
        busy_until: time until which no further answer is requested [s].
        pending: answer that has not taken effect yet.
        chosen: action of the last answer.
        expired: number of chosen actions that were no longer possible when they were due.
    """

    memory: Memory
    events: tuple[str, ...] = ()
    asked_at: float | None = None
    delay: float = 0.0
    busy_until: float = 0.0
    pending: PendingAnswer | None = None
    chosen: str = ""
    expired: int = 0


class RoleTurns:
    """Turns of one role; without state, like a policy.

    In each decision, callers `attend` to the observation. If a turn is due (`is_due`), they show the `page`, and then
    report the answer (`answered`). `act` returns the action of the decision in any case.

    Args:
        role: the role.
        limits: sizes of the spaces.
        quiet_time: longest time between two turns [s]; an answer may request a shorter one.

    Raises:
        ValueError: the time is out of its range.
    """

    def __init__(self, role: Role, limits: SpaceLimits, quiet_time: float = QUIET_TIME) -> None:
        check_quiet_time(quiet_time)
        self._interface = _INTERFACES[role](limits)
        self._quiet_time = quiet_time

    @property
    def system(self) -> str:
        """System prompt of the role."""
        return self._interface.system

    def begin(self, town: Town) -> TurnState:
        """Returns the state before the first decision."""
        return TurnState(memory=self._interface.begin(town))

    def attend(self, observation: ObservationMapping, state: TurnState) -> TurnState:
        """Processes an observation, and an answer that takes effect now."""
        memory, events = self._interface.attend(observation, state.memory, state.delay)
        state = replace(state, memory=memory, events=(*state.events, *events))
        if state.pending is not None and scalar(observation, "time") >= state.pending.ready_at:
            state = self._accept(observation, replace(state, pending=None), state.pending.answer)
        return state

    def is_due(self, observation: ObservationMapping, state: TurnState) -> bool:
        """Returns whether an answer is to be requested now: after an event, or after the longest time."""
        now = scalar(observation, "time")
        if state.pending is not None or now < state.busy_until:
            return False
        if state.events or state.asked_at is None:
            return True
        return now >= min(state.asked_at + self._interface.patience * self._quiet_time, state.memory.again_at)

    def page(self, observation: ObservationMapping, state: TurnState) -> tuple[str, AnswerSchema]:
        """Returns the page of a turn, and the schema of its answer.

        Both have the names that the map has for its streets; answers are read with those of the session.
        """
        beginning = "The session begins." if state.asked_at is None else "Nothing new."
        text, schema = self._interface.prompt(observation, state.memory, state.events or (beginning,))
        titles = titles_of(observation, state.memory.town)
        return titles.shown(text), schema.titled(titles)

    def answered(
        self,
        observation: ObservationMapping,
        state: TurnState,
        answer: Mapping[str, str] | None,
        charged: float = 0.0,
    ) -> TurnState:
        """Ends a turn.

        Args:
            observation: observation of the turn.
            state: state of the turn.
            answer: value of each field, as the schema reads it; None for silence.
            charged: simulated time that the answer takes [s]; it takes effect afterwards.
        """
        now = scalar(observation, "time")
        memory = replace(state.memory, again_at=math.inf)
        state = replace(state, memory=memory, events=(), asked_at=now, delay=charged, busy_until=now + charged)
        if answer is None:
            return state
        if charged:
            return replace(state, pending=PendingAnswer(ready_at=now + charged, answer=answer))
        return self._accept(observation, state, answer)

    def act(self, observation: ObservationMapping, state: TurnState) -> tuple[ActionDict, TurnState]:
        """Returns the action of the decision."""
        action, memory, expired = self._interface.act(observation, state.memory)
        return action, _with_expired(replace(state, memory=memory), expired)

    def _accept(self, observation: ObservationMapping, state: TurnState, answer: Mapping[str, str]) -> TurnState:
        memory, expired = self._interface.accept(observation, state.memory, answer)
        chosen = answer.get(self._interface.action_field, "")
        return _with_expired(replace(state, memory=memory, chosen=chosen), expired)


def _with_expired(state: TurnState, expired: int) -> TurnState:
    """Counts actions that were no longer possible; the next page tells of them."""
    if not expired:
        return state
    told = f'What you chose, "{state.chosen}", was no longer possible, and has not been done.'
    return replace(state, events=(*state.events, told), expired=state.expired + expired)
