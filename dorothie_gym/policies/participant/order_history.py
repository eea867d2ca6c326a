"""History of the orders that the participant has said about the present subgoal, with the places where it said them.

Orders that are only planned do not count: they may be replaced before they are said.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Final, NamedTuple

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.propositions import Predicate
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.ontology.slots import ActionValue, Slot
from dorothie_gym.policies.policy import replace
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    from dorothie_gym.policies.participant.state import ParticipantState
    from dorothie_gym.policies.participant.view import ParticipantView
    from dorothie_gym.policies.speech import Remark

SAME_PLACE: Final = 45.0
"""Distance between orders that are given at one place [m]."""

BACK_AND_FORTH: Final = 420.0
"""The same for U-turns, which lead back and forth on a street [m]."""

SAME_HEADING: Final = 50.0
"""Largest difference between the headings of the car at one place [degrees]."""

TURNED: Final = 40.0
"""Change of the heading of a car that turns [degrees]."""

ONE_BREATH: Final = 15.0
"""Time within which equal orders that are joined belong to one description of the way [s]."""

LATELY: Final = 60.0
"""Time for which an order counts that is given again [s]."""

OBEYED: Final = 40.0
"""Time after an order to turn round within which the car obeys it [s]."""

ROUND_TIME: Final = 7.0
"""Time that a car is given to begin a U-turn, before it is guided in another way [s]."""

_GIVING: Final = frozenset({DialogueMove.INSTRUCT, DialogueMove.REPLY_W})
_OWNING_UP: Final = frozenset({Predicate.TRIED, Predicate.PASSED})


class GivenOrder(NamedTuple):
    """Order that was said.

    Attributes:
        act: move and slots.
        direction: side; None for orders without one.
        lane: lane of the car.
        x: position of the car [m].
        y: position of the car [m].
        heading: heading of the car [degrees].
        time: time at which it was said [s].
    """

    act: DialogueAct
    direction: Direction | None
    lane: int
    x: float
    y: float
    heading: float
    time: float


def note_said(state: ParticipantState, view: ParticipantView, said: Remark) -> None:
    """Records an order that is being said; a remark that the same was tried before begins a new count.

    Args:
        state: working copy of the state.
        view: observation.
        said: the remark.
    """
    guidance = state.guidance
    if guidance.planned_nudge is not None and said.act == guidance.planned_nudge:
        left = state.route.to_goal.left(view.station) if state.route.progress is not None else guidance.nudged_from
        little = said.wording.distance is not None or said.wording.topic == "further"
        counted = guidance.after_nudging(view.time, left)
        state.guidance = replace(counted, planned_nudge=None, sent_straight_on=not little)
    if any(meant.predicate in _OWNING_UP and meant.get("times") for meant in said.meaning):
        state.guidance = replace(state.guidance, given=())
    elif said.act.move in _GIVING and said.act.values(Slot.ACTION):
        order = _given_now(view, said)
        again = said.joined and any(_is_equal(order, former) for former in _latest(state, view))
        if not again:  # the second of two left turns in one description is another turn
            state.guidance = replace(state.guidance, given=(*state.guidance.given, order))


def drop_repetition(state: ParticipantState, said: Remark) -> None:
    """Drops a queued utterance that gives the order which is being said: an answer may have come before it.

    Args:
        state: working copy of the state.
        said: the remark; steps that follow in the same breath are kept.
    """
    if said.act.move not in _GIVING or not said.act.values(Slot.ACTION):
        return
    begun = len(list(itertools.takewhile(lambda item: item.joined, state.speech.queue)))
    kept, breath = [*state.speech.queue[:begun]], [*state.speech.queue[:0]]
    for item in (*state.speech.queue[begun:], None):
        if item is None or not item.joined:
            kept += [] if any(_orders_alike(said, other) for other in breath) else breath
            breath = []
        if item is not None:
            breath.append(item)
    if len(kept) < len(state.speech.queue):
        state.speech = state.speech.cleared().plan(*kept)


def _orders_alike(said: Remark, other: Remark) -> bool:
    alike = said.act.slots == other.act.slots and said.wording.direction is other.wording.direction
    return alike and other.act.move in _GIVING


def times_given(state: ParticipantState, view: ParticipantView, order: Remark) -> int:
    """Returns how often an order was given lately, at the place where the car is, without being obeyed by a turn."""
    now = _given_now(view, order)
    lately = [former for former in state.guidance.given if view.time - former.time < LATELY]
    return sum(
        _is_equal(now, former) and _is_here(now, former) and not has_turned_since(view, former) for former in lately
    )


def last_given(state: ParticipantState) -> GivenOrder | None:
    """Returns the last order; None if there is none, or if something was said about it since."""
    return state.guidance.given[-1] if state.guidance.given else None


def has_turned_since(view: ParticipantView, order: GivenOrder) -> bool:
    """Returns whether the car has turned since an order was given."""
    return abs(pm.wrap_degrees(view.heading - order.heading)) > TURNED


def times_told(state: ParticipantState, action: ActionValue, lane: int | None = None) -> int:
    """Returns how often an action was ordered, in any words; on one lane, if that is given."""
    return sum(action in order.act.slots and lane in (None, order.lane) for order in state.guidance.given)


def is_about_to_turn_round(state: ParticipantState, view: ParticipantView) -> bool:
    """Returns whether the car was just told to turn round, and has not done so yet."""
    last = last_given(state)
    if last is None or ActionValue.U_TURN not in last.act.slots or not state.guidance.guiding:
        return False
    return view.time - last.time < ROUND_TIME and not has_turned_since(view, last)


def turned_round_lately(state: ParticipantState, view: ParticipantView) -> bool:
    """Returns whether the car was told to turn round a moment ago, so that it does what it was told."""
    return any(
        ActionValue.U_TURN in order.act.slots and view.time - order.time < OBEYED for order in state.guidance.given
    )


def rounds_told(state: ParticipantState) -> int:
    """Returns how often the car was told to turn round; a repetition before it has turned does not count."""
    headings: list[float] = []
    for order in state.guidance.given:
        turns = ActionValue.U_TURN in order.act.slots
        if turns and not (headings and abs(pm.wrap_degrees(order.heading - headings[-1])) <= TURNED):
            headings.append(order.heading)
    return len(headings)


def _given_now(view: ParticipantView, order: Remark) -> GivenOrder:
    x, y = view.position
    return GivenOrder(order.act, order.wording.direction, view.lane, x, y, view.heading, view.time)


def _latest(state: ParticipantState, view: ParticipantView) -> tuple[GivenOrder, ...]:
    return tuple(order for order in state.guidance.given if view.time - order.time < ONE_BREATH)


def _is_equal(order: GivenOrder, former: GivenOrder) -> bool:
    return order.act == former.act and order.direction is former.direction


def _is_here(order: GivenOrder, former: GivenOrder) -> bool:
    distance = pm.hypot(order.x - former.x, order.y - former.y)
    if ActionValue.U_TURN in order.act.slots:
        return distance <= BACK_AND_FORTH
    return distance <= SAME_PLACE and abs(pm.wrap_degrees(order.heading - former.heading)) <= SAME_HEADING
