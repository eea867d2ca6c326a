"""Sense of what is said: the same twice, questions about one's own orders, and orders to drive on a little."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

import numpy as np

from dorothie_gym.dialogue.nlu import understand
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.evaluation.analysis.truth_checks.talk_cases import Case, judged
from dorothie_gym.ontology.dialogue_acts import ORDERING_MOVES, SIGNS_OF_HEARING, DialogueMove
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import ActionValue, Slot
from dorothie_gym.session.recording.events import EventType, UtteranceRecord
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.support.portable_math import wrap_degrees

if TYPE_CHECKING:
    from dorothie_gym.dialogue.direction import Direction
    from dorothie_gym.session.recording.events import MoveRecord
    from dorothie_gym.session.recording.session import Session

AT_ONCE: Final = 8.0
"""Time after the car has taken up an order within which the same order is a needless repetition [s]."""

OBEYED: Final = 40.0
"""Time after an order within which what the car does may follow from it [s]."""

AGAIN: Final = 60.0
"""Time between two remarks on the same crowd within which the second is no news [s]."""

MOST_CREEPING: Final = 1
"""Largest number of orders to drive on a little before an arrival."""

SETTLING: Final = 5.0
"""Time after an order in which the car may still finish the turn before [s]."""

TURNED: Final = 40.0
"""Change of the heading of a car that turns [degrees]."""

_WAYS: Final = frozenset({ActionValue.J_TURN, ActionValue.U_TURN})


def signs(session: Session) -> Iterator[Case]:
    """Yields the Co-Wizard's utterances with a plain "okay" or "will do"; wrong are those with two of them."""
    for said in session.utterances(Role.CO_WIZARD):
        plain = sum(move.act.move in SIGNS_OF_HEARING and not move.act.slots for move in said.moves)
        if plain:
            yield judged(plain == 1, said)


def orders_after_confirmation(session: Session) -> Iterator[Case]:
    """Yields pairs of orders to turn between which the car takes up the first; wrong are equal ones at once.

    The car has not turned between the two.
    """
    former: UtteranceRecord | None = None
    taken: UtteranceRecord | None = None
    for said in session.utterances():
        if said.speaker is Role.CO_WIZARD:
            takes_up = said.moves[0].act.move in SIGNS_OF_HEARING
            taken = said if former is not None and takes_up and said.start - former.end < AT_ONCE else None
        elif _ways(said):
            if former is not None and taken is not None and not _has_turned(session, former.start, said.end + SETTLING):
                again = said.start - taken.end < AT_ONCE and _ways(said)[0] in _ways(former)
                yield judged(not again, former, taken, said)
            former, taken = said, None


def own_doing(session: Session) -> Iterator[Case]:
    """Yields the participant's questions why the car turns round; wrong are those after its own order to do so."""
    ordered = -np.inf
    for move in session.moves(Role.PARTICIPANT):
        if move.act.move in ORDERING_MOVES and ActionValue.U_TURN in move.act.slots:
            ordered = move.end
        if move.act.move is DialogueMove.QUERY_W and any(map(_asks_why_turning, move.meaning)):
            yield Case(move.start - ordered > OBEYED, move.start, move.span)


def arrivals_without_creeping(session: Session) -> Iterator[Case]:
    """Yields the arrivals to which the car was stopped by the participant.

    Wrong are those before which it was told more than `MOST_CREEPING` times to drive on a little.
    """
    moves = list(session.moves(Role.PARTICIPANT))
    times = [event.time for event in session.of_type(EventType.SUBGOAL) if event.data.get("cause") == "arrival"]
    for begin, end in itertools.pairwise([0.0, *times]):
        errand = [move for move in moves if begin < move.end <= end]
        if any(move.act.move in ORDERING_MOVES and ActionValue.STOP in move.act.slots for move in errand):
            creeps = [move for move in errand if _creeps(move)]
            yield Case(len(creeps) <= MOST_CREEPING, end, " / ".join(move.span for move in creeps))


def crowds(session: Session) -> Iterator[Case]:
    """Yields the remarks on many cars or people; wrong are those that repeat one of the last `AGAIN` seconds."""
    last: dict[object, float] = {}
    for move in session.moves():
        for said in move.meaning if move.act.move is DialogueMove.EXPLAIN else ():
            if said.predicate is Predicate.CROWDED:
                kind = said.get("object")
                yield Case(move.start - last.get(kind, -np.inf) > AGAIN, move.start, move.span)
                last[kind] = move.start


def _ways(said: UtteranceRecord) -> list[tuple[ActionValue, Direction | None]]:
    """Returns the turns that an utterance orders, in order."""
    found = []
    for move in said.moves:
        ways = [value for value in move.act.values(Slot.ACTION) if isinstance(value, ActionValue) and value in _WAYS]
        if move.act.move in ORDERING_MOVES and ways:
            found.append((ways[0], understand(move.span).direction))
    return found


def _has_turned(session: Session, begin: float, end: float) -> bool:
    rows = session.trajectory
    between = rows[(rows["frame"] >= begin * FRAME_RATE) & (rows["frame"] <= end * FRAME_RATE)]
    if not len(between):
        return False
    heading = np.degrees(between["heading"].astype(float))
    return bool((np.abs(wrap_degrees(heading - heading[0])) > TURNED).any())


def _asks_why_turning(asked: Proposition) -> bool:
    effect = asked.get("effect")
    return isinstance(effect, Proposition) and effect.get("action") is ActionValue.U_TURN


def _creeps(move: MoveRecord) -> bool:
    if move.act.move not in ORDERING_MOVES or ActionValue.LANE_FOLLOW not in move.act.slots:
        return False
    words = understand(move.span)
    return words.further or (words.distance is not None and words.distance <= 20)
