"""Orders: a distance that is said again and again to a standing car, and orders withdrawn without a word of why."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.nlu import understand
from dorothie_gym.evaluation.analysis.truth_checks.talk_cases import Case, judged, plain_words
from dorothie_gym.ontology.dialogue_acts import ORDERING_MOVES, DialogueMove
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import ActionValue, GoalStatus, Slot
from dorothie_gym.session.recording.events import UtteranceRecord
from dorothie_gym.sim.config import FRAME_RATE

if TYPE_CHECKING:
    from dorothie_gym.session.recording.session import Session

FEW_METRES: Final = 8.0
"""Way of the car between orders to drive on a little within which they count as said to a standing car [m]."""

MOST_NUDGES: Final = 2
"""Largest number of such orders that are all alike."""

MOST_ALIKE: Final = 2
"""Largest number of successive orders in equal words."""

SAME_PLACE: Final = 40.0
"""Way of the car between orders that count as given at one place [m]."""

SECONDS: Final = 8.0
"""Time within which an order that contradicts another one needs a word of why [s]."""

_EXCUSES: Final = frozenset(
    {DialogueMove.CLARIFY, DialogueMove.REPLY_N, DialogueMove.EXPLAIN, DialogueMove.CONFUSE, DialogueMove.REPLY_U}
)
_WORDS_OF_WHY: Final = re.compile(r"\b(sorry|no|not|wait|wrong|actually|instead|rather|oops|mistake|mean|changed)\b")
_TAKING_UP: Final = frozenset({DialogueMove.ACKNOWLEDGE, DialogueMove.CONFIRM, DialogueMove.EXPLAIN})
_STEERING: Final = frozenset({ActionValue.J_TURN, ActionValue.U_TURN, ActionValue.LANE_FOLLOW})


class _Nudge(NamedTuple):
    """Order to drive on a little: what is said, the distance [m] or None, and the position of the car [m]."""

    said: UtteranceRecord
    distance: int | None
    x: float
    y: float


def nudges(session: Session) -> Iterator[Case]:
    """Yields the groups of equal orders to drive on a little; wrong are those of more than `MOST_NUDGES` orders.

    The car moves less than `FEW_METRES` within a group. Other utterances may come between the orders.
    """
    group: list[_Nudge] = []
    for said in session.utterances(Role.PARTICIPANT):
        nudge = _nudge(session, said)
        if nudge is None:
            continue
        if group and not _is_alike(group[-1], nudge):
            yield judged(len(group) <= MOST_NUDGES, *(other.said for other in group))
            group = []
        group.append(nudge)
    if group:
        yield judged(len(group) <= MOST_NUDGES, *(other.said for other in group))


def unchanged(session: Session) -> Iterator[Case]:
    """Yields the groups of orders in equal words at one place; wrong are those of more than `MOST_ALIKE` orders."""
    group: list[tuple[UtteranceRecord, float, float]] = []
    for said in session.utterances(Role.PARTICIPANT):
        if not any(move.act.move in ORDERING_MOVES and move.act.values(Slot.ACTION) for move in said.moves):
            continue
        x, y = _position(session, said.start)
        if group:
            last, former_x, former_y = group[-1]
            alike = plain_words(last.text) == plain_words(said.text)
            if not alike or math.hypot(x - former_x, y - former_y) > SAME_PLACE:
                yield judged(len(group) <= MOST_ALIKE, *(other for other, _, _ in group))
                group = []
        group.append((said, x, y))
    if group:
        yield judged(len(group) <= MOST_ALIKE, *(other for other, _, _ in group))


def _is_alike(first: _Nudge, second: _Nudge) -> bool:
    near = math.hypot(second.x - first.x, second.y - first.y) < FEW_METRES
    return near and first.distance == second.distance


def _nudge(session: Session, said: UtteranceRecord) -> _Nudge | None:
    for move in said.moves:
        if move.act.move is DialogueMove.EXPLAIN or ActionValue.LANE_FOLLOW not in move.act.slots:
            continue
        words = understand(move.span)
        if words.distance is not None or words.further:
            return _Nudge(said, words.distance, *_position(session, said.start))
    return None


def _position(session: Session, time: float) -> tuple[float, float]:
    rows = session.trajectory
    if not len(rows):
        return 0.0, 0.0
    row = rows[min(int(np.searchsorted(rows["frame"], round(time * FRAME_RATE))), len(rows) - 1)]
    return float(row["x"]), float(row["y"])


def reversals(session: Session) -> Iterator[Case]:
    """Yields pairs of successive orders within `SECONDS`; wrong are those that contradict each other for no reason.

    A correction, a refusal, a statement or a question of the other speaker between the two, or a word such as "sorry",
    "wait" or "instead" in the second, is a word of why.
    """
    former: UtteranceRecord | None = None
    excused = False
    for said in session.utterances():
        if said.speaker is not Role.PARTICIPANT:
            excused = excused or any(move.act.move not in _TAKING_UP for move in said.moves)
            continue
        if former is not None and (_way_of(said) is not None) and said.start - former.end <= SECONDS:
            turned = any(former.start <= row.frame / FRAME_RATE <= said.end for row in session.physical_actions)
            contradicts = _contradict(_way_of(former), _way_of(said)) and not turned
            yield judged(not contradicts or excused or _says_why(said), former, said)
        if _way_of(said) is not None:
            former, excused = said, False
        elif any(move.act.move in _EXCUSES or GoalStatus.COMPLETE in move.act.slots for move in said.moves):
            excused = True


def _says_why(said: UtteranceRecord) -> bool:
    if any(move.act.move in _EXCUSES for move in said.moves):
        return True
    return _WORDS_OF_WHY.search(said.text.lower()) is not None


def _way_of(said: UtteranceRecord) -> tuple[ActionValue, Direction | None] | None:
    """Returns the first way that an utterance orders: turn and side, U-turn, or straight on."""
    for move in said.moves:
        ways = [value for value in move.act.values(Slot.ACTION) if value in _STEERING]
        if move.act.move in ORDERING_MOVES and len(ways) == 1 and isinstance(ways[0], ActionValue):
            words = understand(move.span)
            if words.distance is not None or words.further:
                continue
            return ways[0], words.direction
    return None


def _contradict(
    first: tuple[ActionValue, Direction | None] | None, second: tuple[ActionValue, Direction | None] | None
) -> bool:
    """Returns whether two ways cannot both be meant: left and right, or a turn and turning round."""
    if first is None or second is None:
        return False
    sides = {way[1] for way in (first, second)} & {Direction.LEFT, Direction.RIGHT}
    other_side = first[0] is second[0] is ActionValue.J_TURN and len(sides) == 2
    return other_side or (first[0] is not second[0] and ActionValue.U_TURN in (first[0], second[0]))
