"""Loops: orders that are repeated at one place, without a remark about it and another attempt."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.nlu import understand
from dorothie_gym.dialogue.propositions import Predicate
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import ActionValue, GoalStatus, Slot
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.support.portable_math import wrap_degrees

if TYPE_CHECKING:
    from dorothie_gym.session.recording.events import MoveRecord
    from dorothie_gym.session.recording.session import Session

SAME_ORDERS: Final = 3
"""Number of equal orders that make a loop."""

SAME_PLACE: Final = 40.0
"""Distance between equal orders at one place [m]."""

SAME_HEADING: Final = 45.0
"""Largest difference between headings of the car at one place that count as the same direction [degrees]."""

BACK_AND_FORTH: Final = 400.0
"""Distance between U-turns of one loop [m]: back and forth on a street."""

_ORDERS: Final = frozenset(
    {
        ActionValue.U_TURN,
        ActionValue.J_TURN,
        ActionValue.LANE_SWITCH,
        ActionValue.STOP,
        ActionValue.START,
        ActionValue.SPEED_CHANGE,
    }
)
_REMARKS: Final = frozenset({Predicate.PASSED, Predicate.TRIED})
_AGAIN: Final = re.compile(r"\b(again|twice|third time|(going|go) (back and forth|round in circles))\b", re.IGNORECASE)


class _Order(NamedTuple):
    """Order: speaker, content, position [m] and heading [degrees] of the car, and the number of the utterance."""

    speaker: Role
    act: DialogueAct
    direction: Direction | None
    x: float
    y: float
    heading: float
    utterance: int

    def repeats(self, other: _Order) -> bool:
        """Returns whether both are the same order at one place; turns of one description are different ones."""
        if self[:3] != other[:3] or self.utterance == other.utterance:
            return False
        distance = math.hypot(self.x - other.x, self.y - other.y)
        if ActionValue.U_TURN in self.act.slots:
            return distance <= BACK_AND_FORTH
        return distance <= SAME_PLACE and abs(wrap_degrees(self.heading - other.heading)) <= SAME_HEADING


def has_loop(session: Session) -> bool:
    """Returns whether a speaker gives an order `SAME_ORDERS` times at one place without a remark on it.

    Indirect orders count ("we should be turning left"). A remark about the repetition, or another errand, begins a new
    count. Where no place is recorded, all orders about one errand count as given at one place.
    """
    given: list[_Order] = []
    for move in session.moves():
        if _begins_anew(move):
            given.clear()
        if move.act.move is not DialogueMove.INSTRUCT or not _ORDERS & set(move.act.values(Slot.ACTION)):
            continue
        direction, place = understand(move.span).direction, _place(session, move.start)
        order = _Order(move.speaker, move.act, direction, *place, move.utterance)
        if len({other.utterance for other in given if order.repeats(other)}) + 1 >= SAME_ORDERS:
            return True
        given.append(order)
    return False


def _begins_anew(move: MoveRecord) -> bool:
    """Returns whether a move remarks on a repetition, or begins or ends an errand."""
    if any(said.predicate in _REMARKS for said in move.meaning):
        return True
    if not move.meaning and move.act.move is DialogueMove.EXPLAIN and _AGAIN.search(move.span):
        return True
    names_goal = move.act.move is DialogueMove.INSTRUCT and move.act.values(Slot.LANDMARK)
    return bool(names_goal and not move.act.values(Slot.ACTION)) or GoalStatus.COMPLETE in move.act.slots


def _place(session: Session, time: float) -> tuple[float, float, float]:
    """Returns position [m] and heading [degrees] of the car at a time [s]; zeros if there is no trajectory."""
    rows = session.trajectory
    if not len(rows):
        return 0.0, 0.0, 0.0
    row = rows[min(int(np.searchsorted(rows["frame"], round(time * FRAME_RATE))), len(rows) - 1)]
    return float(row["x"]), float(row["y"]), math.degrees(float(row["heading"]))
