"""Checks of a passenger's talk: ways without metres, and questions that were not settled just before."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.evaluation.analysis.truth_checks.talk_cases import Case, judged
from dorothie_gym.ontology.dialogue_acts import ORDERING_MOVES, DialogueMove
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import ActionValue, GoalStatus, LandmarkName, Slot

if TYPE_CHECKING:
    from dorothie_gym.session.recording.events import MoveRecord, UtteranceRecord
    from dorothie_gym.session.recording.session import Session

STOPPED_WITHIN: Final = 90.0
"""Time after an order to stop within which the standstill is the participant's own doing [s]."""

TOLD_WITHIN: Final = 10.0
"""Time after a destination was named within which it need not be asked for [s]."""

_METRES: Final = re.compile(r"\bmet(?:er|re)s?\b", re.IGNORECASE)
_HOW_FAR: Final = frozenset({Predicate.CLOSE, Predicate.DISTANCE})
_LATER: Final = frozenset({GoalStatus.PENDING, GoalStatus.ABANDONED, GoalStatus.COMPLETE})


def ways_without_metres(session: Session) -> Iterator[Case]:
    """Yields what the participant says of the way still to go; wrong is what counts it in metres."""
    for move in session.moves(Role.PARTICIPANT):
        orders = move.act.move in ORDERING_MOVES and ActionValue.LANE_FOLLOW in move.act.slots
        states = move.act.move is DialogueMove.EXPLAIN and any(said.predicate in _HOW_FAR for said in move.meaning)
        if orders or states:
            yield Case(_METRES.search(move.span) is None, move.start, move.span)


def own_stops(session: Session) -> Iterator[Case]:
    """Yields the participant's questions why the car stands; wrong are those after its own order to stop."""
    ordered = -STOPPED_WITHIN
    for move in session.moves(Role.PARTICIPANT):
        if move.act.move in ORDERING_MOVES and move.act.values(Slot.ACTION):
            ordered = move.end if ActionValue.STOP in move.act.slots else -STOPPED_WITHIN
        if move.act.move is DialogueMove.QUERY_W and any(map(_asks_why_standing, move.meaning)):
            yield Case(move.start - ordered >= STOPPED_WITHIN, move.start, move.span)


def destinations_asked_for(session: Session) -> Iterator[Case]:
    """Yields the car's questions where to go; wrong are those after an utterance that the car heard and that said it.

    What was not understood, because words were misheard, may be asked for; so may what is being said at the same time.
    """
    told: UtteranceRecord | None = None
    for said in session.utterances():
        if said.speaker is Role.PARTICIPANT and any(map(_names_destination, said.moves)):
            told = said if all(move.recognised in (None, move.text) for move in said.moves) else None
        elif said.speaker is Role.CO_WIZARD and said.moves[-1].act.move is DialogueMove.QUERY_W:
            if LandmarkName.QUERIED in said.moves[-1].act.slots:
                late = told is not None and 0.0 <= said.start - told.end < TOLD_WITHIN
                yield judged(not late, *((told, said) if told is not None and late else (said,)))


def _names_destination(move: MoveRecord) -> bool:
    named = move.act.values(Slot.LANDMARK) and _LATER.isdisjoint(move.act.slots) and not move.act.values(Slot.ACTION)
    return move.act.move in ORDERING_MOVES and bool(named)


def _asks_why_standing(asked: Proposition) -> bool:
    effect = asked.get("effect") if asked.predicate is Predicate.BECAUSE else asked
    return isinstance(effect, Proposition) and effect.predicate is Predicate.STANDS
