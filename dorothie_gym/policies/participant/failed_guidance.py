"""Guidance that has failed twice in the same way: a remark about it, and another attempt."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dorothie_gym.dialogue.intentions import CommunicativeFunction
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.maps.routing import LaneEntry
from dorothie_gym.ontology.dialogue_acts import DialogueMove, MoveGroup
from dorothie_gym.ontology.slots import ActionValue
from dorothie_gym.policies.participant.order_history import is_about_to_turn_round, rounds_told, times_told
from dorothie_gym.policies.participant.order_wording import of_place, order
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.route_progress import RouteProgress
from dorothie_gym.policies.route_state import section
from dorothie_gym.policies.speech import Remark, intend

if TYPE_CHECKING:
    from dorothie_gym.policies.participant.state import ParticipantState, StepKey
    from dorothie_gym.policies.participant.view import ParticipantView

IN_VAIN = 2
"""Number of failures after which something else is tried."""

SOON_AGAIN = 250.0
"""Way back to a place that was missed up to which the car is asked to drive slowly [m]."""

LARGER = 0.25
"""Growth of the detour that is accepted to avoid a manoeuvre, with each attempt."""

MOST_RETRIES = 12
"""Number of attempts up to which it grows."""

_ANSWERS = MoveGroup.REPLY.moves

REMARK_EXPIRES = 8.0
"""Time after which a remark about a failure is no longer said [s]."""


def remark_on_miss(state: ParticipantState, view: ParticipantView, *, passed: bool) -> None:
    """Remarks that the place was missed again, and guides round the block instead of turning round.

    Args:
        state: working copy of the state.
        view: observation.
        passed: whether the car has driven past the place; otherwise it has left the route shortly before it.
    """
    if passed:
        state.guidance = state.guidance.after_passing()
    passes, goal = state.guidance.passes, state.task.goal
    if state.route.misses < IN_VAIN or goal is None:
        if passed:
            just = _just_passed(state, view)
            slower = tuple(replace(item, joined=bool(just)) for item in _more_slowly(state, view))
            if just or slower:
                state.say_only(*just, *slower)
        return
    if passed and passes:
        missed = Proposition.of(Predicate.PASSED, place=goal.name, times=passes)
        topic = "passed_again" if passes >= IN_VAIN else "passed_just"
        elided, wording = ("place", "times"), Wording(topic=of_place(topic, goal.name))
        reason = intend(CommunicativeFunction.INFORM, missed, elided=elided, wording=wording, expires=_soon(view))
    else:
        here = section(state.town, view.lane)
        again = state.route.driven.count(here) >= IN_VAIN
        reason = been_here(view) if again else _in_vain(view, None, "tried")
    _try_another_way(state, view, reason)
    state.say(*(replace(slower, joined=True) for slower in _more_slowly(state, view)))


def _just_passed(state: ParticipantState, view: ParticipantView) -> tuple[Remark, ...]:
    """Returns the remark that the car has just driven past the place; nothing if it never came close."""
    if state.task.goal is None or not state.guidance.passes:
        return ()
    passed = Proposition.of(Predicate.PASSED, place=state.task.goal.name)
    wording = Wording(topic=of_place("passed_just", state.task.goal.name))
    return (intend(CommunicativeFunction.INFORM, passed, elided=("place",), wording=wording, expires=_soon(view)),)


def _more_slowly(state: ParticipantState, view: ParticipantView) -> tuple[Remark, ...]:
    """Returns the request to drive slowly, if the car soon comes to the place again that it has driven past."""
    if state.route.to_goal.left(view.station) > SOON_AGAIN or state.guidance.slowed_early:
        return ()
    state.guidance = state.guidance.after_slowing_early()
    wording = Wording(faster=False, speed=max(state.config.careful_speeds), topic="this_time")
    return (order(DialogueMove.INSTRUCT, ActionValue.SPEED_CHANGE, wording),)


def remark_on_wrong_turn(state: ParticipantState, view: ParticipantView, step: StepKey) -> bool:
    """Counts an announced turn that was not taken; returns whether the participant therefore tries another route."""
    state.guidance = state.guidance.after_wrong_turn(step)
    if state.guidance.wrong_turns.count(step) < IN_VAIN:
        return False
    state.guidance = replace(state.guidance, wrong_turns=())
    connector = step[2]
    closed = (connector, state.town.lanes[connector].length / 2)
    state.route = state.route.avoiding(state.town, view.place, closed)
    _try_another_way(state, view, _in_vain(view, ActionValue.J_TURN, "tried_turn"))
    return True


def stop_circling(state: ParticipantState, view: ParticipantView) -> None:
    """Chooses another route after U-turns or lane changes that brought no progress."""
    progress, guidance = state.route.to_goal, state.guidance
    if is_about_to_turn_round(state, view) or any(item.act.move in _ANSWERS for item in state.speech.queue):
        return  # questions of the car are answered first
    manoeuvre = progress.next_manoeuvre(view.station)
    if manoeuvre is None or state.motion.moved_at <= guidance.step_at:
        return  # a car that has not moved since the last order does not circle
    turns = manoeuvre[0] is LaneEntry.U_TURN
    turns_again = turns and rounds_told(state) >= (IN_VAIN if state.route.misses else IN_VAIN + 1)
    changes_again = not turns and times_told(state, ActionValue.LANE_SWITCH, view.lane) >= IN_VAIN
    if not turns_again and not changes_again:
        return
    state.guidance = guidance.without_circling(view.lane)
    if changes_again:
        closed = (view.lane, state.town.lanes[view.lane].length / 2)
        state.route = state.route.avoiding(state.town, view.place, closed)
        tried = _in_vain(view, ActionValue.LANE_SWITCH, "tried_lane")
    else:
        tried = _in_vain(view, ActionValue.U_TURN, "tried_u_turn")
    _try_another_way(state, view, tried)


def been_here(view: ParticipantView) -> Remark:
    """Returns the remark that the car comes along here again."""
    return _in_vain(view, None, "been_here")


def why_standing(state: ParticipantState, view: ParticipantView) -> Remark:
    """Returns the question why the car stands, instead of a third instruction to drive on."""
    stands = Proposition.of(Predicate.STANDS, action=ActionValue.STOP)
    state.conversation = state.conversation.after_asking_why(view.time)
    return intend(CommunicativeFunction.SET_QUESTION, stands)


def _in_vain(view: ParticipantView, action: ActionValue | None, topic: str) -> Remark:
    tried = Proposition.of(Predicate.TRIED, action=action, times=IN_VAIN)
    wording = Wording(topic=topic)
    return intend(CommunicativeFunction.INFORM, tried, elided=("action", "times"), wording=wording, expires=_soon(view))


def _try_another_way(state: ParticipantState, view: ParticipantView, reason: Remark) -> None:
    """Plans a route that avoids manoeuvres, each time at a larger detour, and says why."""
    progress = state.route.to_goal
    cost = state.config.way_round_cost * (1.0 + LARGER * min(state.guidance.retries, MOST_RETRIES))
    state.guidance = replace(state.guidance, retries=state.guidance.retries + 1)
    progress = RouteProgress.plan(state.town, view.place, progress.goal, state.route.closed, cost)
    state.route = state.route.with_progress(progress).sparing_worn(state.town, view.place)
    progress = state.route.to_goal
    state.guidance = replace(state.guidance, u_turns=0, step=None, best=progress.left(view.station))
    turns_round = progress.turns_round_first(state.town, view.station)
    another = Proposition.of(Predicate.WILL, action=ActionValue.U_TURN if turns_round else None)
    wording = Wording(topic="once_more" if turns_round else "another_way")
    way = intend(CommunicativeFunction.REQUEST, another, elided=("action",), wording=wording, joined=True)
    state.say_only(reason, way)


def _soon(view: ParticipantView) -> float:
    return view.time + REMARK_EXPIRES
