"""A session as talk: turns with their acts, and what happened in the world between them."""

from __future__ import annotations

import bisect
import math
import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

from dorothie_gym.ontology import (
    ActionValue,
    DialogueAct,
    DialogueMove,
    ExceptionKind,
    GoalStatus,
    LandmarkName,
    MentalAction,
    ObjectClass,
    PhysicalAction,
    Role,
    Slot,
    SlotValue,
    StreetName,
)
from dorothie_gym.sessions.events import Event, EventType
from dorothie_gym.sessions.records import UtteranceRecord
from dorothie_gym.sessions.session import Session
from dorothie_gym.sessions.statistics.handling import time_met
from dorothie_gym.sessions.statistics.units import Units, goals_of
from dorothie_gym.world.config import FRAME_RATE

ANSWER = 15.0
"""Within this time of a turn's end its answer begins [s]: an exchange's patience, and the answer's own time."""

_LONGEST = 60.0
"""No utterance is longer than this [s]: turns that began earlier are over."""

_UNKNOWN = (ActionValue.UNKNOWN, StreetName.UNKNOWN, LandmarkName.UNKNOWN, GoalStatus.UNKNOWN)
_QUERIED = (
    ActionValue.QUERIED, StreetName.QUERIED, LandmarkName.QUERIED, GoalStatus.QUERIED, ObjectClass.QUERIED,
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Turn:
    """An utterance.

    Attributes:
        number: its place in the talk.
        speaker: who spoke.
        text: its words.
        recognised: what a recogniser heard, None where there was none.
        acts: its acts, in order.
        exchanges: number of the exchange of each act.
        start, end: when it was said [s].
    """

    number: int
    speaker: Role
    text: str
    recognised: str | None
    acts: tuple[DialogueAct, ...]
    exchanges: tuple[int | None, ...]
    start: float
    end: float

    def does(self, *moves: DialogueMove) -> bool:
        """Whether one of its acts is one of the moves."""
        return any(act.move in moves for act in self.acts)

    def doing(self, *moves: DialogueMove) -> Iterator[DialogueAct]:
        """Yields its acts that are one of the moves."""
        return (act for act in self.acts if act.move in moves)

    def names(self, slot: Slot) -> frozenset[SlotValue]:
        """The values of a slot in all its acts, those that are unknown or asked for left out."""
        return frozenset(value for act in self.acts for value in named(act, slot))

    def mentions(self, *values: SlotValue) -> bool:
        """Whether one of its acts carries one of the values."""
        return any(value in act.slots for act in self.acts for value in values)

    def says(self, pattern: re.Pattern[str]) -> bool:
        """Whether its words contain the pattern."""
        return pattern.search(self.text.casefold().replace("’", "'")) is not None


class Talk:
    """The turns of participant and Co-Wizard in a session, and what happened.

    Attributes:
        session: the session.
        units: its exchanges and transactions.
        turns: utterances in the order in which they began.
        goals: landmarks of the subgoals.
    """

    def __init__(self, session: Session, units: Units | None = None) -> None:
        """Reads a session.

        Args:
            session: any.
            units: of the session, if they are known already.
        """
        self.session = session
        self.units = Units(session) if units is None else units
        ordered = sorted(self.units.utterances, key=lambda utterance: (utterance.start, utterance.end))
        self.turns = tuple(self._turn(k, utterance) for k, utterance in enumerate(ordered))
        self.goals = frozenset(goals_of(session)) | {
            landmark for landmark in map(_landmark, session.of_type(EventType.SUBGOAL, EventType.EXCEPTION)) if landmark
        }

    def by(self, speaker: Role, *moves: DialogueMove) -> Iterator[Turn]:
        """Yields the turns of a speaker that do one of the moves; all of them if none is given."""
        return (turn for turn in self.turns if turn.speaker is speaker and (not moves or turn.does(*moves)))

    def answers(self, turn: Turn, *moves: DialogueMove, within: float = ANSWER) -> Iterator[Turn]:
        """Yields the other speaker's turns that begin during a turn or soon after it and do one of the moves."""
        for other in self.later(turn, within=within):
            if other.speaker is not turn.speaker and (not moves or other.does(*moves)):
                yield other

    def answered(self, turn: Turn, *moves: DialogueMove, within: float = ANSWER) -> bool:
        """Whether there is such an answer."""
        return any(True for _ in self.answers(turn, *moves, within=within))

    def later(self, turn: Turn, *, within: float) -> Iterator[Turn]:
        """Yields the turns after a turn that begin at most `within` seconds after its end."""
        for k in range(turn.number + 1, len(self.turns)):
            other = self.turns[k]
            if other.start - turn.end > within:
                return
            yield other

    def before(self, turn: Turn, *, within: float) -> Iterator[Turn]:
        """Yields the turns before a turn that ended at most `within` seconds before its start, latest first."""
        for k in range(turn.number - 1, -1, -1):
            other = self.turns[k]
            if turn.start - other.start > within + _LONGEST:
                return
            if turn.start - other.end <= within:
                yield other

    # --- what happened ----------------------------------------------------------------------------------------------

    def exceptions(self, *kinds: ExceptionKind) -> Iterator[Event]:
        """Yields the exceptions of the kinds."""
        names = {kind.name for kind in kinds}
        return (e for e in self.session.of_type(EventType.EXCEPTION) if str(e.data.get("kind")).upper() in names)

    def did(self, *actions: PhysicalAction, since: float = 0.0, until: float = math.inf) -> bool:
        """Whether the Co-Wizard did one of the actions in a stretch of time [s]."""
        return any(_falls(self._action_times.get(action, ()), since, until) for action in actions)

    def believed(self, *actions: MentalAction, since: float = 0.0, until: float = math.inf) -> bool:
        """Whether the Co-Wizard did one of the mental actions in a stretch of time [s]."""
        return any(_falls(self._belief_times.get(action.label, ()), since, until) for action in actions)

    def happened(self, *types: EventType) -> bool:
        """Whether there is an event of one of the types."""
        return bool(self.session.of_type(*types))

    @cached_property
    def met_roadblock(self) -> float | None:
        """When the car first was near something that the Ad-Wizard had put on the road [s]; None if never."""
        props = self.exceptions(ExceptionKind.PLACE_PROP, ExceptionKind.MOVE_PROP)
        met = min((time_met(self.session, event) for event in props), default=math.inf)
        return met if math.isfinite(met) else None

    @cached_property
    def _action_times(self) -> dict[PhysicalAction, list[float]]:
        times: dict[PhysicalAction, list[float]] = {}
        for action in self.session.physical_actions:
            if action.source is Role.CO_WIZARD:
                times.setdefault(action.action, []).append(action.frame / FRAME_RATE)
        return times

    @cached_property
    def _belief_times(self) -> dict[str, list[float]]:
        times: dict[str, list[float]] = {}
        for event in self.session.of_type(EventType.BELIEF_UPDATE):
            times.setdefault(str(event.data.get("action")), []).append(event.time)
        return times

    @cached_property
    def hidden_goals(self) -> frozenset[str]:
        """Labels of the subgoals' landmarks that the Co-Wizard does not have on its map."""
        rows = self.session.header.landmarks
        goals = {subgoal["landmark"] for subgoal in self.session.header.subgoals}
        return frozenset(rows[k]["name"] for k in goals if 0 <= k < len(rows) and rows[k]["hidden"])

    def _turn(self, number: int, utterance: UtteranceRecord) -> Turn:
        return Turn(
            number=number,
            speaker=utterance.speaker,
            text=utterance.text,
            recognised=utterance.moves[0].recognised,
            acts=tuple(move.act for move in utterance.moves),
            exchanges=tuple(self.units.exchange_of(move) for move in utterance.moves),
            start=utterance.start,
            end=utterance.end,
        )


def named(act: DialogueAct, slot: Slot) -> frozenset[SlotValue]:
    """Returns the values of a slot in an act, those that are unknown or asked for left out."""
    return frozenset(value for value in act.values(slot) if value not in _UNKNOWN and value not in _QUERIED)


def asks_for(act: DialogueAct, *slots: Slot) -> bool:
    """Whether an act leaves a value of one of the slots open, as a question does."""
    return any(value in _QUERIED and value.slot in slots for value in act.slots)


def _falls(times: Sequence[float], since: float, until: float) -> bool:
    """Whether one of the times, which rise, lies in a stretch."""
    k = bisect.bisect_left(times, since)
    return k < len(times) and times[k] <= until


def labels(values: Collection[SlotValue]) -> frozenset[str]:
    """Returns the labels of values."""
    return frozenset(value.label for value in values)


def _landmark(event: Event) -> LandmarkName | None:
    label = event.data.get("landmark")
    return next((name for name in LandmarkName if name.label == label), None)
