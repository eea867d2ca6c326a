"""Choice of the next subgoal, and remarks that announce, describe, change, drop or complete subgoals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.dialogue.intentions import CommunicativeFunction as Function
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.maps.routing import router
from dorothie_gym.ontology.slots import ActionValue, GoalStatus, LandmarkName, StreetName
from dorothie_gym.policies import act_builders
from dorothie_gym.policies.mood import Happening
from dorothie_gym.policies.observation_parser import COMMON
from dorothie_gym.policies.participant.messages import message_remark, seconds_to_take_in
from dorothie_gym.policies.participant.order_history import last_given
from dorothie_gym.policies.participant.stories import (
    as_afterthought,
    picks_up,
    purpose_of,
    purpose_of_target,
    story_remark,
)
from dorothie_gym.policies.participant.target_hints import corner_fact, famous_nearby, looks_remark
from dorothie_gym.policies.participant.trip_talk import recollection
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.route_progress import RouteProgress
from dorothie_gym.policies.speech import Remark, intend

if TYPE_CHECKING:
    from dorothie_gym.policies.observation_parser import SeenLandmark, SeenSubgoal
    from dorothie_gym.policies.participant.state import ParticipantState
    from dorothie_gym.policies.participant.view import ParticipantView

# --- changes of the tasks -------------------------------------------------------------------------------------------


def note_tasks(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    """Compares the subgoals with those of the last decision, and reports changes."""
    before, tasks = state.task, str(view.raw["tasks"])
    state.speech = state.speech.hold(view.time + seconds_to_take_in(view))
    state.task = state.task.with_subgoals(view.subgoals, tasks)
    if view.subgoals is before.subgoals and tasks == before.listed:
        return
    for old, new in zip(before.subgoals, view.subgoals, strict=False):
        if new.reached and not old.reached:
            state.feel(Happening.DONE, view.time)
            _report_done(state, view, new, rng)
        elif new.open and not old.live:
            _report_added(state, view, new, rng)
        elif old.open and not new.live:
            _report_dropped(state, view, old, rng)
        elif new.open and new.landmark != old.landmark:
            _report_changed(state, view, old, new, rng)
        elif (
            new.open
            and tasks != before.listed
            and _line_of(new, view.subgoals, tasks) != _line_of(old, before.subgoals, before.listed)
        ):
            _report_more(state, view, new, rng)
        if new.live is not old.live or (new.open and new.landmark != old.landmark):
            state.feel(Happening.CHANGED_TASK, view.time)


def _report_done(
    state: ParticipantState, view: ParticipantView, subgoal: SeenSubgoal, rng: np.random.Generator
) -> None:
    landmark = view.landmark(subgoal.landmark)
    named = landmark is not None and rng.random() < 0.4
    finished = act_builders.errand(None if landmark is None else landmark.name, GoalStatus.COMPLETE)
    wording = (
        _wording_of_meeting(view, subgoal) if landmark is not None and landmark.name is LandmarkName.PERSON else None
    )
    done = intend(Function.INFORM, finished, elided=() if named else ("place",), wording=wording)
    # leaves the car time to report its arrival first
    delay = float(rng.uniform(*state.config.report_delay))
    state.speech = state.speech.cleared().hold(view.time + delay).plan(done)
    if landmark is not None:
        state.trip = state.trip.after_stop(landmark)
    state.task = state.task.closed(subgoal.index)
    state.task = state.task.after_finishing(None if landmark is None else landmark.name, view.time)
    if subgoal.index == state.task.target:
        state.forget_target()
        same_breath = bool(rng.random() < state.style.hurries)
        next_at = -math.inf if same_breath else view.time + state.config.next_task_delay
        state.task = state.task.with_next_task(same_breath=same_breath, next_at=next_at)


def _wording_of_meeting(view: ParticipantView, subgoal: SeenSubgoal) -> Wording:
    """Returns the wording of the report that a person was picked up, or only met."""
    return Wording(topic="picked_up" if picks_up(purpose_of(view, subgoal.index)) else "met")


def _report_added(
    state: ParticipantState, view: ParticipantView, subgoal: SeenSubgoal, rng: np.random.Generator
) -> None:
    landmark = view.landmark(subgoal.landmark)
    if landmark is None:
        return
    if not state.task.announced and _is_nearest(state, view, subgoal, landmark):
        _go_now(state, view, subgoal, landmark, rng)
        return
    on_the_way = _is_on_the_way(state, view, subgoal, landmark) and rng.random() < state.config.goes_first
    if on_the_way or _has_to_wait(state, view, subgoal, landmark):
        _go_first(state, view, subgoal, landmark, rng)
        return
    later = act_builders.errand(landmark.name, GoalStatus.PENDING)
    state.task = state.task.after_mentioning(landmark.name)
    news = intend(Function.REQUEST, later, wording=Wording(topic="added"))
    progress = state.route.progress
    far = progress is not None and progress.left(view.station) > state.config.wait_distance
    if view.speed > 2.0 and far and state.speech.idle and rng.random() < state.style.waits:
        state.task = state.task.waiting_until(view.time + state.config.thinking_time)
        stop = intend(Function.REQUEST, act_builders.action(ActionValue.STOP), urgent=True)
        state.say(stop, news)
    else:
        state.say(news, *message_remark(state, view, landmark, rng))


def _is_nearest(state: ParticipantState, view: ParticipantView, subgoal: SeenSubgoal, landmark: SeenLandmark) -> bool:
    """Returns whether no other subgoal that may be done now is nearer than a new one."""
    if not subgoal.allowed:
        return False
    others = [view.landmark(item.landmark) for item in view.subgoals if item.open and item.allowed]
    lengths = [route_length(state, view, mark) for mark in others if mark is not None]
    return route_length(state, view, landmark) <= min(lengths, default=math.inf)


def _go_now(
    state: ParticipantState,
    view: ParticipantView,
    subgoal: SeenSubgoal,
    landmark: SeenLandmark,
    rng: np.random.Generator,
) -> None:
    """Announces a subgoal that was just added as the next target, rather than first for later and then for now."""
    state.forget_target()
    _aim_at(state, view, subgoal, landmark)
    state.task = state.task.after_announcement(view.time)
    street = None if view.unique(landmark) else landmark.street
    now = act_builders.errand(landmark.name, GoalStatus.ONGOING, street)
    state.say(
        intend(Function.REQUEST, now, wording=Wording(topic="added")), *message_remark(state, view, landmark, rng)
    )


def _has_to_wait(state: ParticipantState, view: ParticipantView, subgoal: SeenSubgoal, landmark: SeenLandmark) -> bool:
    """Returns whether the announced target now has to wait for the new subgoal."""
    task = state.task
    if task.target is None or task.goal is None or not task.announced or task.goal.name is landmark.name:
        return False
    return subgoal.allowed and not next(item.allowed for item in view.subgoals if item.index == task.target)


def _is_on_the_way(
    state: ParticipantState, view: ParticipantView, subgoal: SeenSubgoal, landmark: SeenLandmark
) -> bool:
    """Returns whether a new subgoal may be done now and is nearer than the announced target."""
    task, progress = state.task, state.route.progress
    if task.goal is None or progress is None or not task.announced or not subgoal.allowed:
        return False
    if task.goal.name is landmark.name or progress.left(view.station) < state.config.wait_distance:
        return False
    return route_length(state, view, landmark) < progress.left(view.station)


def route_length(state: ParticipantState, view: ParticipantView, landmark: SeenLandmark) -> float:
    """Returns the length of the route to a landmark [m]; infinity if there is none."""
    route = router(state.town).route(view.place, landmark.place, state.route.blocked)
    return route.length if route is not None else math.inf


def _go_first(
    state: ParticipantState,
    view: ParticipantView,
    subgoal: SeenSubgoal,
    landmark: SeenLandmark,
    rng: np.random.Generator,
) -> None:
    """Interrupts the target for a subgoal that was just added."""
    former = state.task.destination
    switch_target(state, view, subgoal, landmark)
    street = None if view.unique(landmark) else landmark.street
    now = act_builders.errand(landmark.name, GoalStatus.ONGOING, street)
    later = intend(Function.REQUEST, act_builders.errand(former.name, GoalStatus.PENDING), joined=True)
    put_off = () if former.name in COMMON else (later,)  # "that house" could be any
    state.say_only(
        intend(Function.REQUEST, now, wording=Wording(topic="added")),
        *message_remark(state, view, landmark, rng),
        *put_off,
    )


def switch_target(state: ParticipantState, view: ParticipantView, subgoal: SeenSubgoal, landmark: SeenLandmark) -> None:
    """Postpones the target in favour of another subgoal, which the car knows or is about to be told."""
    state.task = state.task.put_off_target()
    state.forget_target()
    _aim_at(state, view, subgoal, landmark)
    state.task = state.task.after_announcement(view.time)
    state.set_guiding(False)


def resume_after_wait(state: ParticipantState, view: ParticipantView) -> None:
    """Instructs a waiting car to start when its waiting time has ended."""
    if view.time < state.task.resume_at or not state.speech.idle:
        return
    given = last_given(state)
    told = given is not None and ActionValue.STOP in given.act.slots
    if told and not view.standing and view.time < state.task.resume_at + state.config.thinking_time:
        return  # it is about to stop
    state.task = state.task.waiting_until(math.inf)
    if view.standing:
        state.say(intend(Function.REQUEST, act_builders.action(ActionValue.START)))


def _report_dropped(
    state: ParticipantState, view: ParticipantView, subgoal: SeenSubgoal, rng: np.random.Generator
) -> None:
    landmark = view.landmark(subgoal.landmark)
    if landmark is None:
        return
    said = {value for item in state.speech.said for value in item.act.slots}
    said = said | state.task.mentioned
    known = subgoal.index == state.task.target or subgoal.index in state.task.put_off or landmark.name in said
    state.task = state.task.closed(subgoal.index)
    if subgoal.index == state.task.target:
        state.forget_target()
        state.task = state.task.with_same_breath(True)
        state.speech = state.speech.cleared()
    dropped = act_builders.errand(landmark.name, GoalStatus.ABANDONED)
    if known:
        function = Function.REQUEST if rng.random() < 0.8 else Function.INFORM
        news = intend(function, dropped)
    else:
        news = intend(Function.INFORM, dropped, wording=Wording(topic="one_less"))
    state.say(news, *message_remark(state, view, landmark, rng))


def _report_changed(
    state: ParticipantState, view: ParticipantView, old: SeenSubgoal, new: SeenSubgoal, rng: np.random.Generator
) -> None:
    former, landmark = view.landmark(old.landmark), view.landmark(new.landmark)
    if former is None or landmark is None:
        return
    task = state.task
    if new.index != task.target:
        busy = task.goal is not None and task.goal.name in (former.name, landmark.name)
        if busy or rng.random() >= state.config.announces_ahead:
            return  # the change is announced when the subgoal becomes the target
        if former.name is not landmark.name:  # a house that was not spoken of yet is named when it is due
            wording = Wording(topic="changed_later", dropped=former.name)
            dropped = act_builders.errand(former.name, GoalStatus.ABANDONED)
            instead = act_builders.errand(landmark.name, GoalStatus.PENDING)
            state.say(
                intend(Function.REQUEST, instead, dropped, wording=wording), *message_remark(state, view, landmark, rng)
            )
        return
    was_announced = task.announced
    state.forget_target()
    state.speech = state.speech.cleared()
    if not was_announced:
        return
    _aim_at(state, view, new, landmark)
    state.task = state.task.after_announcement(view.time)
    if former.name is landmark.name:
        _report_same_place(state, view, former, landmark, rng)
    else:
        dropped = act_builders.errand(former.name, GoalStatus.ABANDONED)
        instead = act_builders.errand(landmark.name, GoalStatus.ONGOING)
        change = intend(Function.REQUEST, instead, dropped, wording=Wording(dropped=former.name))
        state.say(change, *message_remark(state, view, landmark, rng))


def _line_of(subgoal: SeenSubgoal, subgoals: Sequence[SeenSubgoal], listed: str) -> str | None:
    """Returns the purpose of a subgoal in the list of errands; None if it is not on the list."""
    live = (each.index for each in subgoals if each.live)
    return dict(zip(live, listed.split("\n"), strict=False)).get(subgoal.index)


def _report_more(
    state: ParticipantState, view: ParticipantView, subgoal: SeenSubgoal, rng: np.random.Generator
) -> None:
    """States further tasks at the target, or, with some probability, at the place of a later errand."""
    if subgoal.index == state.task.target:
        state.say(*story_remark(state, view, rng))
        return
    landmark, purpose = view.landmark(subgoal.landmark), purpose_of(view, subgoal.index)
    if landmark is None or purpose is None or purpose.action is None or rng.random() >= state.config.announces_ahead:
        return
    more = Proposition.of(
        Predicate.PURPOSE,
        place=landmark.name,
        person=purpose.person,
        purpose=purpose.action,
        item=purpose.items[0] if purpose.items else None,
    )
    state.task = state.task.after_telling(more)
    later = intend(Function.REQUEST, act_builders.errand(landmark.name, GoalStatus.PENDING))
    state.say(later, intend(Function.INFORM, more, elided=("place",), wording=Wording(topic="purpose"), joined=True))


def _report_same_place(
    state: ParticipantState,
    view: ParticipantView,
    former: SeenLandmark,
    landmark: SeenLandmark,
    rng: np.random.Generator,
) -> None:
    """States further tasks at the target, or which of the places with its name is meant."""
    reason = story_remark(state, view, rng) if former.place == landmark.place else ()
    if reason:
        state.say(*reason)
        return
    elsewhere = act_builders.destination(landmark.name, landmark.street)
    wording = Wording(topic="moved") if former.place != landmark.place else None
    state.say(intend(Function.REQUEST, elsewhere, wording=wording), *message_remark(state, view, landmark, rng))


# --- target ---------------------------------------------------------------------------------------------------------


def choose_target(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    """Keeps an open target; otherwise chooses the nearest subgoal that may be done now."""
    if state.task.target is not None:
        current = view.subgoals[state.task.target]
        if current.open and current.allowed:
            return
        state.forget_target()
    found: list[tuple[float, int, SeenSubgoal, SeenLandmark]] = []
    for subgoal in view.subgoals:
        landmark = view.landmark(subgoal.landmark)
        if subgoal.open and subgoal.allowed and landmark is not None:
            found.append((route_length(state, view, landmark), subgoal.index, subgoal, landmark))
    if found:
        _, _, subgoal, landmark = min(found, key=lambda row: row[:2])
        _aim_at(state, view, subgoal, landmark)
        state.set_guiding(bool(rng.random() < state.style.guides))


def _aim_at(state: ParticipantState, view: ParticipantView, subgoal: SeenSubgoal, landmark: SeenLandmark) -> None:
    state.task = state.task.with_target(subgoal.index, landmark)
    blocked, manoeuvre_cost = state.route.blocked, state.config.manoeuvre_cost
    progress = RouteProgress.plan(state.town, view.place, landmark.place, blocked, manoeuvre_cost)
    state.route = state.route.with_progress(progress)


def announcement(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> Remark:
    """Returns the target as an instruction, with its street where that helps."""
    task, place = state.task, state.task.destination
    street = None
    if not view.unique(place) or rng.random() < state.style.names_street:
        street = act_builders.named(place.street)
    wording = pick_up_wording(state, view)
    if task.target in task.put_off:
        resumed = act_builders.errand(place.name, GoalStatus.ONGOING)
        return intend(Function.REQUEST, resumed, wording=wording or Wording(topic="resume"))
    goal = act_builders.destination(place.name, street)
    if wording is not None:
        return intend(Function.REQUEST, goal, wording=wording)
    more = sum(subgoal.open for subgoal in view.subgoals) > 2
    if street is None and more and rng.random() < 0.5:
        return intend(Function.REQUEST, goal, wording=Wording(topic="first"))
    if street is None and rng.random() < state.config.leaves_route:
        return intend(Function.REQUEST, goal, act_builders.action(ActionValue.UNKNOWN))
    return intend(Function.REQUEST, goal)


def pick_up_wording(state: ParticipantState, view: ParticipantView) -> Wording | None:
    """Returns the wording of a destination as "pick up Lin"; None where nobody is picked up there."""
    person = state.task.goal is not None and state.task.goal.name is LandmarkName.PERSON
    return Wording(topic="pick_up") if person and picks_up(purpose_of_target(state, view)) else None


def _say_announcement(
    state: ParticipantState, view: ParticipantView, same_breath: bool, rng: np.random.Generator
) -> None:
    """Names the target, possibly with a reason and a later task."""
    words = replace(announcement(state, view, rng), joined=same_breath)
    draw = rng.random()
    reason = story_remark(state, view, rng) if draw < 1.6 * state.style.reasons else ()
    if draw < state.style.reasons and reason:
        state.say(replace(reason[0], joined=same_breath), replace(words, joined=True))
    else:
        state.say(words, *(as_afterthought(item) for item in reason))
    if not reason:
        state.say(*recollection(state, view, rng))
    goal, target = state.task.goal, state.task.target
    later = [view.landmark(item.landmark) for item in view.subgoals if item.open and item.index != target]
    named = [mark for mark in later if mark is not None and goal is not None and mark.name not in (goal.name, *COMMON)]
    if named and rng.random() < 0.25:
        state.task = state.task.after_mentioning(named[0].name)
        state.say(intend(Function.INFORM, act_builders.errand(named[0].name, GoalStatus.PENDING), joined=True))
    elif rng.random() < state.style.aligns:
        state.say(intend(Function.FEEDBACK_ELICITATION, wording=Wording(topic="understood"), joined=True))
    elif goal is not None and rng.random() < state.style.verifies:
        known = Proposition.of(Predicate.KNOWS, place=goal.name)
        wording = Wording(topic="knows_it")
        state.say(intend(Function.PROPOSITIONAL_QUESTION, known, elided=("place",), wording=wording, joined=True))


def announce_target(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    """Announces the target when it is due, and reminds a car that does not answer."""
    same_breath = state.task.same_breath
    task = state.task = state.task.with_same_breath(False)
    if task.goal is None or not (state.speech.idle or same_breath):
        return
    if not task.announced and view.time >= task.next_at:
        state.task = task.after_announcement(view.time)
        _say_announcement(state, view, same_breath and not state.speech.idle, rng)
        return
    if not task.announced:
        return
    silence = view.time - max(task.announced_at, state.speech.last_end)
    unheard = state.conversation.heard_at < task.announced_at and silence > state.config.unanswered_after
    if view.standing and not state.guidance.guiding and unheard and state.guidance.repeats < 3:
        state.guidance = state.guidance.after_reminding()
        state.task = task.after_reminding(view.time)
        if state.guidance.repeats == 1:
            state.say(intend(Function.FEEDBACK_ELICITATION, wording=Wording(topic="hearing")))
        else:
            state.say(announcement(state, view, rng))


# --- description of the target --------------------------------------------------------------------------------------


def describe(
    state: ParticipantState,
    view: ParticipantView,
    function: Function,
    rng: np.random.Generator,
    *,
    asks_street: bool = False,
) -> None:
    """Describes the place of the target by street, a landmark nearby and an object; guidance follows now or later."""
    goal = state.task.destination
    no_street = goal.street is StreetName.UNKNOWN
    state.set_guiding(bool(no_street or state.task.described or rng.random() < state.style.leads))
    state.task = state.task.after_describing()
    looks = looks_remark(state, view, goal, rng) if rng.random() < state.config.describes_looks else ()
    looks = looks or recollection(state, view, rng)
    corner = corner_fact(state, view, goal)
    # the street need not be said again, unless it was asked for
    named = not asks_street and any(goal.street in item.act.slots for item in state.speech.said)
    if named and corner is not None and corner not in state.task.told:
        state.task = state.task.after_telling(corner)
        elided = () if goal.name is LandmarkName.PERSON else ("place",)
        state.say_first(intend(function, corner, elided=elided, wording=Wording(topic="located_cross")), *looks)
        return
    if goal.name is LandmarkName.PERSON and not no_street and not named:
        where = act_builders.located(goal.name, goal.street)
        state.say_first(intend(function, where, wording=Wording(topic="person_where")), *looks)
        return
    near = famous_nearby(goal, view, state.config.near_landmark)
    beside = None if near is None else Proposition.of(Predicate.NEAR, place=goal.name, landmark=near.name)
    on_street = None if no_street else act_builders.located(goal.name, goal.street)
    facts = [fact for fact in (on_street, beside) if fact is not None]
    if named and beside is None:
        state.set_guiding(True)
        known = Proposition.of(Predicate.KNOWS, place=goal.name)
        if known not in state.task.told:
            state.task = state.task.after_telling(known)
            state.say_first(intend(Function.INFORM, known, elided=("place",), wording=Wording(topic="guides")), *looks)
            return
        if function is Function.INFORM:
            state.say_first(*looks)  # that it will be guided was said before
            return
    if not facts:
        state.say_first(intend(Function.UNCERTAIN_ANSWER), *looks)
        return
    state.say_first(intend(function, *facts, elided=("place",), wording=Wording(topic="where")), *looks)
