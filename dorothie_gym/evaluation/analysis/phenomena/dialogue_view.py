"""Session as dialogue turns with their acts, and as events between them; base of the phenomenon queries."""

from __future__ import annotations

import bisect
import math
import re
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, TypeAlias

from dorothie_gym.evaluation.analysis.exception_attribution import time_met
from dorothie_gym.evaluation.analysis.units import Units, goals_of
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import (
    ActionValue,
    GoalStatus,
    LandmarkName,
    ObjectClass,
    Slot,
    SlotValue,
    StreetName,
)
from dorothie_gym.ontology.world_exceptions import ExceptionKind
from dorothie_gym.session.recording.events import Event, EventType, UtteranceRecord
from dorothie_gym.sim.config import FRAME_RATE

if TYPE_CHECKING:
    from dorothie_gym.ontology.actions import MentalAction, PhysicalAction
    from dorothie_gym.session.recording.session import Session

ANSWER_WINDOW = 15.0
"""Time after a turn within which its answer begins [s]: patience of an exchange, and duration of the answer."""

_MAX_UTTERANCE_SECONDS = 60.0
"""Longest utterance [s]: turns that began earlier have ended."""

_UNKNOWN = (ActionValue.UNKNOWN, StreetName.UNKNOWN, LandmarkName.UNKNOWN, GoalStatus.UNKNOWN)
_QUERIED = (ActionValue.QUERIED, StreetName.QUERIED, LandmarkName.QUERIED, GoalStatus.QUERIED, ObjectClass.QUERIED)


@dataclass(frozen=True, kw_only=True)
class Turn:
    """Dialogue turn: one utterance.

    Attributes:
        number: its number in the dialogue.
        speaker: role that spoke.
        text: its words.
        recognised: words that a recogniser returned; None without a recogniser.
        acts: its acts, in order.
        spans: the words of each act.
        exchanges: number of the exchange of each act.
        start, end: start and end [s].
    """

    number: int
    speaker: Role
    text: str
    recognised: str | None
    acts: tuple[DialogueAct, ...]
    spans: tuple[str, ...]
    exchanges: tuple[int | None, ...]
    start: float
    end: float

    def does(self, *moves: DialogueMove) -> bool:
        """Returns whether one of its acts has one of the moves."""
        return any(act.move in moves for act in self.acts)

    def doing(self, *moves: DialogueMove) -> Iterator[DialogueAct]:
        """Yields its acts with one of the moves."""
        return (act for act in self.acts if act.move in moves)

    def names(self, slot: Slot) -> frozenset[SlotValue]:
        """Returns the values of a slot in all its acts, without unknown and queried ones."""
        return frozenset(value for act in self.acts for value in named(act, slot))

    def mentions(self, *values: SlotValue) -> bool:
        """Returns whether one of its acts has one of the values."""
        return any(value in act.slots for act in self.acts for value in values)

    def says(self, pattern: re.Pattern[str], *moves: DialogueMove) -> bool:
        """Returns whether the words of one of its acts (with one of the moves, if given) match the pattern.

        Irrelevant acts do not count.
        """
        return any(
            pattern.search(span.casefold().replace("’", "'"))
            for act, span in zip(self.acts, self.spans, strict=True)
            if act.move is not DialogueMove.IRRELEVANT and (not moves or act.move in moves)
        )


class DialogueView:
    """Turns of participant and Co-Wizard in a session, and its events.

    Attributes:
        session: the session.
        units: its exchanges and transactions.
        turns: utterances in the order of their starts.
        goals: landmarks of the subgoals.
    """

    def __init__(self, session: Session, units: Units | None = None) -> None:
        """Gathers the turns of a session.

        Args:
            session: a session of any layout.
            units: units of the session, if already known.
        """
        self.session = session
        self.units = Units(session) if units is None else units
        ordered = sorted(self.units.utterances, key=lambda utterance: (utterance.start, utterance.end))
        self.turns = tuple(self._turn(k, utterance) for k, utterance in enumerate(ordered))
        self.goals = frozenset(goals_of(session)) | {
            landmark for landmark in map(_landmark, session.of_type(EventType.SUBGOAL, EventType.EXCEPTION)) if landmark
        }

    def by(self, speaker: Role, *moves: DialogueMove) -> Iterator[Turn]:
        """Yields the turns of a speaker with one of the moves, or all of them if none is given."""
        return (turn for turn in self.turns if turn.speaker is speaker and (not moves or turn.does(*moves)))

    def answers(self, turn: Turn, *moves: DialogueMove, within: float = ANSWER_WINDOW) -> Iterator[Turn]:
        """Yields the other speaker's turns that begin during or soon after a turn and have one of the moves."""
        for other in self.later(turn, within=within):
            if other.speaker is not turn.speaker and (not moves or other.does(*moves)):
                yield other

    def answered(self, turn: Turn, *moves: DialogueMove, within: float = ANSWER_WINDOW) -> bool:
        """Returns whether there is such an answer."""
        return any(True for _ in self.answers(turn, *moves, within=within))

    def replies(self, turn: Turn, *moves: DialogueMove, within: float = ANSWER_WINDOW) -> Iterator[Turn]:
        """Yields the answers with one of the moves within an exchange of the turn.

        If the exchange is unknown, any answer counts.
        """
        own = set(turn.exchanges)
        for other in self.answers(turn, *moves, within=within):
            placed = zip(other.acts, other.exchanges, strict=True)
            if None in own or any(act.move in moves and (k is None or k in own) for act, k in placed):
                yield other

    def replied(self, turn: Turn, *moves: DialogueMove, within: float = ANSWER_WINDOW) -> bool:
        """Returns whether there is such a reply."""
        return any(True for _ in self.replies(turn, *moves, within=within))

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
            if turn.start - other.start > within + _MAX_UTTERANCE_SECONDS:
                return
            if turn.start - other.end <= within:
                yield other

    # --- Events -----------------------------------------------------------------------------------------------------

    def exceptions(self, *kinds: ExceptionKind) -> Iterator[Event]:
        """Yields the exceptions of the kinds."""
        names = {kind.name for kind in kinds}
        return (e for e in self.session.of_type(EventType.EXCEPTION) if str(e.data.get("kind")).upper() in names)

    def did(self, *actions: PhysicalAction, since: float = 0.0, until: float = math.inf) -> bool:
        """Returns whether the Co-Wizard did one of the actions in a stretch of time [s]."""
        return any(_falls(self._action_times.get(action, ()), since, until) for action in actions)

    def switched(self, action: PhysicalAction, up: bool, *, since: float, until: float) -> bool:
        """Returns whether the Co-Wizard did an action up (or on), or down (or off), in a stretch of time [s]."""
        done = (each for each in self.session.physical_actions if each.source is Role.CO_WIZARD)
        return any(
            each.action is action and each.up is up and since <= each.frame / FRAME_RATE <= until for each in done
        )

    def believed(self, *actions: MentalAction, since: float = 0.0, until: float = math.inf) -> bool:
        """Returns whether the Co-Wizard did one of the mental actions in a stretch of time [s]."""
        return any(_falls(self._belief_times.get(action.label, ()), since, until) for action in actions)

    def happened(self, *types: EventType) -> bool:
        """Returns whether there is an event of one of the types."""
        return bool(self.session.of_type(*types))

    @cached_property
    def met_roadblocks(self) -> tuple[float, ...]:
        """Times at which the car came near the objects that the Ad-Wizard put on the road [s]."""
        props = self.exceptions(ExceptionKind.PLACE_PROP, ExceptionKind.MOVE_PROP)
        return tuple(met for met in (time_met(self.session, event) for event in props) if math.isfinite(met))

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
        """Labels of the subgoals' landmarks that are not on the Co-Wizard's map."""
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
            spans=tuple(move.span for move in utterance.moves),
            exchanges=tuple(self.units.exchange_of(move) for move in utterance.moves),
            start=utterance.start,
            end=utterance.end,
        )


def named(act: DialogueAct, slot: Slot) -> frozenset[SlotValue]:
    """Returns the values of a slot in an act, without unknown and queried ones."""
    return frozenset(value for value in act.values(slot) if value not in _UNKNOWN and value not in _QUERIED)


def asks_for(act: DialogueAct, *slots: Slot) -> bool:
    """Returns whether an act leaves a value of one of the slots open, as a question does."""
    return any(value in _QUERIED and value.slot in slots for value in act.slots)


def _falls(times: Sequence[float], since: float, until: float) -> bool:
    """Returns whether one of the ascending times is within an interval."""
    k = bisect.bisect_left(times, since)
    return k < len(times) and times[k] <= until


def labels(values: Collection[SlotValue]) -> frozenset[str]:
    """Returns the labels of values."""
    return frozenset(value.label for value in values)


def _landmark(event: Event) -> LandmarkName | None:
    label = event.data.get("landmark")
    return next((name for name in LandmarkName if name.label == label), None)


# --- Phenomena -------------------------------------------------------------------------------------------------------

HUMAN, CAR = Role.PARTICIPANT, Role.CO_WIZARD


@dataclass(frozen=True)
class Occurrence:
    """Occurrence of a phenomenon: its first turn, and its form."""

    turn: Turn
    form: str


Query: TypeAlias = Callable[[DialogueView], Iterator[Occurrence]]


@dataclass(frozen=True, kw_only=True)
class Phenomenon:
    """Phenomenon of dialogue between people and cars (spec of the dialogue).

    Attributes:
        number: 1 to 24, as in the spec.
        title: a few words.
        cause: its necessary condition, in words.
        has_cause: returns whether the condition holds, from acts, texts and events.
        find: yields its occurrences, each with its form.
        forms: the forms that `find` distinguishes.
    """

    number: int
    title: str
    cause: str
    has_cause: Callable[[DialogueView], bool]
    find: Query
    forms: tuple[str, ...]


def both_speak(talk: DialogueView) -> bool:
    """Returns whether both sides speak."""
    return {HUMAN, CAR} <= {turn.speaker for turn in talk.turns}
