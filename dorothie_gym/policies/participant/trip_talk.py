"""Talk about the trip: what was passed or visited before, what is left to do, how it goes, and questions about it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from dorothie_gym.dialogue.intentions import CommunicativeFunction as Function
from dorothie_gym.dialogue.propositions import ASKED, Predicate, Proposition
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.ontology.slots import GoalStatus, LandmarkName
from dorothie_gym.policies.participant.target_hints import FAMOUS
from dorothie_gym.policies.participant.trip_memory import UNDER_WAY
from dorothie_gym.policies.speech import Remark, intend
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    from dorothie_gym.policies.participant.state import ParticipantState
    from dorothie_gym.policies.participant.view import ParticipantView

_LONG_WAIT: Final = 20.0  # standstill that is worth a remark when it ends [s]
_LATELY: Final = 15.0  # time after its end within which it is remarked on [s]
_STILL_THERE: Final = 60.0  # distance to the last stop up to which it is "here" [m]
_FORGOTTEN: Final = 45.0  # time after which a passenger asks what is left on the list [s]
_IN_SIGHT: Final = 40.0  # distance of a former stop that the car passes again [m]
_CALM: Final = 0.25  # stress up to which the trip goes well


def recollection(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> tuple[Remark, ...]:
    """Returns a remark on what happened earlier on this trip at the target, or close to it; nothing if nothing did."""
    goal = state.task.goal
    if goal is None or rng.random() > state.style.recalls:
        return ()
    person = goal.name is LandmarkName.PERSON  # who is no "it"
    elided = () if person else ("place",)
    if state.trip.has_passed(goal):
        passed = Proposition.of(Predicate.PASSED, place=goal.name)
        return _stated(state, passed, "passed_earlier", elided=elided)
    stop = state.trip.stop_near(goal)
    if stop is None or stop.name is goal.name:
        return ()
    near = Proposition.of(Predicate.NEAR, place=goal.name, landmark=stop.name)
    x, y = view.position
    if pm.hypot(stop.x - x, stop.y - y) < _STILL_THERE:
        return _stated(state, near, "near_here", elided=(*elided, "landmark"))
    if stop.name in FAMOUS and not person:
        return _stated(state, near, "near_stop", elided=elided)
    return _stated(state, near, "near_last", elided=(*elided, "landmark"))


def trip_remarks(state: ParticipantState, view: ParticipantView) -> list[tuple[Remark, ...]]:
    """Returns the possible statements about the trip that were not made before on the way to the target."""
    found: list[tuple[Proposition, str, tuple[str, ...]]] = []
    waited, ended = state.trip.waited
    if waited > _LONG_WAIT and view.time - ended < _LATELY:
        moves = Proposition.of(Predicate.STANDS, negated=True)
        found.append((Proposition.of(Predicate.FEELS, feeling="relieved", cause=moves), "feels_relieved", ("cause",)))
    target, stops = state.task.target, state.trip.stops
    if stops:
        later = sum(item.open and item.index != target for item in view.subgoals)
        left = Proposition.of(Predicate.TASK, status=GoalStatus.PENDING, count=later)
        if later < 2:
            found.append((left, "one_more" if later else "last_one", ()))
        done = Proposition.of(Predicate.TASK, place=stops[-1].name, status=GoalStatus.COMPLETE)
        if state.mood.stress < _CALM and not state.route.misses:
            found.append(
                (Proposition.of(Predicate.FEELS, feeling="pleased", cause=done), "feels_going_well", ("cause",))
            )
    x, y = view.position
    for stop in stops:
        beside = pm.hypot(stop.x - x, stop.y - y) < _IN_SIGHT
        if beside and stop.name in FAMOUS and view.unique(stop) and view.time - state.task.finished[1] > 2.0 * _LATELY:
            found.append((Proposition.of(Predicate.SEES, place=stop.name), "sees_again", ()))
    told = state.task.told
    return [
        (intend(Function.INFORM, content, elided=elided, wording=Wording(topic=topic)),)
        for content, topic, elided in found
        if content not in told
    ]


def trip_questions(state: ParticipantState, view: ParticipantView) -> list[tuple[Remark, ...]]:
    """Returns the possible questions about the trip."""
    asks, goal = Function.SET_QUESTION, state.task.destination
    found = [intend(asks, Proposition.of(Predicate.DRIVES_AT, speed=ASKED, limit=True), wording=Wording(topic="limit"))]
    distance = Proposition.of(Predicate.DISTANCE, place=goal.name, metres=ASKED)
    if view.time - max(state.conversation.how_far_at, state.task.announced_at) >= UNDER_WAY:
        found.append(intend(asks, distance, wording=Wording(topic="how_far")))
    named = state.task.mentioned | {goal.name}
    later = [view.landmark(item.landmark) for item in view.subgoals if item.open and item.index != state.task.target]
    known = [mark for mark in later if mark is not None and mark.name in named]
    if known and view.time - state.task.announced_at > _FORGOTTEN:
        listed = Proposition.of(Predicate.TASK, status=GoalStatus.QUERIED)
        found.append(intend(asks, listed, wording=Wording(topic="asks_list")))
    return [(item,) for item in found]


def note_told(state: ParticipantState, remarks: tuple[Remark, ...]) -> None:
    """Remembers that statements about the trip were made."""
    for item in remarks:
        for content in item.meaning:
            if not content.asks:
                state.task = state.task.after_telling(content)


def _stated(
    state: ParticipantState, content: Proposition, topic: str, *, elided: tuple[str, ...] = ("place",)
) -> tuple[Remark, ...]:
    """Returns a remark that goes on with the one before, and remembers it; nothing if it was made before."""
    if content in state.task.told:
        return ()
    state.task = state.task.after_telling(content)
    return (intend(Function.INFORM, content, elided=elided, wording=Wording(topic=topic), joined=True),)
