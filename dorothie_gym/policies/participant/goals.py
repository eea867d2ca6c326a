"""Choice of the next task, and remarks about tasks: announced, changed, dropped, done, described."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from dorothie_gym.dialogue import Wording
from dorothie_gym.maps.routing import router
from dorothie_gym.ontology import (
    ActionValue,
    DialogueMove,
    GoalStatus,
    LandmarkName,
    ObjectClass,
    SlotValue,
    StreetName,
)
from dorothie_gym.policies.observation_parser import SeenLandmark, SeenSubgoal
from dorothie_gym.policies.participant.state import ParticipantState
from dorothie_gym.policies.participant.view import ParticipantView
from dorothie_gym.policies.route_progress import RouteProgress
from dorothie_gym.policies.speech import Remark, remark

ROOM_TO_WAIT = 80.0
"""A car that is nearer to its goal than this is not told to wait when something new comes up [m]."""

THINKING = 9.0
"""So long it waits then [s]."""

BREATHER = (0.5, 2.5)
"""Who has arrived says so after a time in this range [s]."""

PAUSE = 9.0
"""Who does not go on at once names the next task after this time [s]."""

GOES_FIRST = 0.6
"""Chance that a new task on the way to another one is done before it."""

TELLS_AHEAD = 0.8
"""Chance that the car is told at once that a later task has changed."""

ANYHOW = 0.06
"""Chance that it is left to the car, in so many words, how it gets to a place."""

UNANSWERED = 8.0
"""After this time without a word from the car it is asked whether it has understood [s]."""


def note_tasks(mind: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    """Compares the tasks with those seen last and says what is new."""
    before, mind.subgoals = mind.subgoals, view.subgoals
    for old, new in zip(before, view.subgoals, strict=False):
        if new.reached and not old.reached:
            _done(mind, view, new, rng)
        elif new.open and not old.live:
            _added(mind, view, new, rng)
        elif old.open and not new.live:
            _dropped(mind, view, old, rng)
        elif new.open and new.landmark != old.landmark:
            _changed(mind, view, old, new, rng)


def _done(mind: ParticipantState, view: ParticipantView, subgoal: SeenSubgoal, rng: np.random.Generator) -> None:
    landmark = view.landmark(subgoal.landmark)
    named = landmark is not None and rng.random() < 0.4
    values: tuple[SlotValue, ...] = (landmark.name,) if landmark is not None and named else ()
    done = remark(DialogueMove.EXPLAIN, *values, GoalStatus.COMPLETE)
    # the car is left time to say that it has arrived
    mind.voice = mind.voice.cleared().hold(view.time + float(rng.uniform(*BREATHER))).plan(done)
    mind.put_off -= {subgoal.index}
    if subgoal.index == mind.target:
        forget_target(mind)
        mind.goes_on = bool(rng.random() < mind.style.hurries)
        mind.next_at = -math.inf if mind.goes_on else view.time + PAUSE


def _added(mind: ParticipantState, view: ParticipantView, subgoal: SeenSubgoal, rng: np.random.Generator) -> None:
    landmark = view.landmark(subgoal.landmark)
    if landmark is None:
        return
    on_the_way = _is_on_the_way(mind, view, subgoal, landmark) and rng.random() < GOES_FIRST
    if on_the_way or _has_to_wait(mind, view, subgoal, landmark):
        _go_first(mind, view, subgoal, landmark)
        return
    news = remark(DialogueMove.INSTRUCT, landmark.name, GoalStatus.PENDING, wording=Wording(topic="added"))
    far = mind.journey is not None and mind.journey.left(view.station) > ROOM_TO_WAIT
    if view.speed > 2.0 and far and mind.voice.idle and rng.random() < mind.style.waits:
        mind.go_at = view.time + THINKING
        stop = remark(DialogueMove.INSTRUCT, ActionValue.STOP, urgent=True)
        mind.voice = mind.voice.plan(stop, replace(news, joined=True))
    else:
        mind.voice = mind.voice.plan(news)


def _has_to_wait(mind: ParticipantState, view: ParticipantView, subgoal: SeenSubgoal, landmark: SeenLandmark) -> bool:
    """Whether the task under way, which the car knows of, now has to wait for the new one."""
    if mind.target is None or mind.goal is None or not mind.told or mind.goal.name is landmark.name:
        return False
    return subgoal.allowed and not next(task.allowed for task in view.subgoals if task.index == mind.target)


def _is_on_the_way(mind: ParticipantState, view: ParticipantView, subgoal: SeenSubgoal, landmark: SeenLandmark) -> bool:
    """Whether a new task may be done now, and is nearer than the one under way, which the car knows of."""
    if mind.goal is None or mind.journey is None or not mind.told or not subgoal.allowed:
        return False
    if mind.goal.name is landmark.name or mind.journey.left(view.station) < ROOM_TO_WAIT:
        return False
    return route_length(mind, view, landmark) < mind.journey.left(view.station)


def route_length(mind: ParticipantState, view: ParticipantView, landmark: SeenLandmark) -> float:
    """How far it is to a landmark from here [m]; infinity where there is no way."""
    route = router(mind.town).route(view.place, landmark.place, mind.blocked)
    return route.length if route is not None else math.inf


def _go_first(mind: ParticipantState, view: ParticipantView, subgoal: SeenSubgoal, landmark: SeenLandmark) -> None:
    """Interrupts the task under way for one that has just come up."""
    former = mind.goal
    assert former is not None
    switch_target(mind, view, subgoal, landmark)
    first: list[SlotValue] = [landmark.name, GoalStatus.ONGOING]
    if not view.unique(landmark):
        first.append(landmark.street)
    mind.voice = mind.voice.cleared().plan(
        remark(DialogueMove.INSTRUCT, *first, wording=Wording(topic="added")),
        remark(DialogueMove.INSTRUCT, former.name, GoalStatus.PENDING, joined=True),
    )


def switch_target(mind: ParticipantState, view: ParticipantView, subgoal: SeenSubgoal, landmark: SeenLandmark) -> None:
    """Puts the task under way off for another one, of which the car knows."""
    if mind.target is not None:
        mind.put_off |= {mind.target}
    forget_target(mind)
    _aim_at(mind, view, subgoal, landmark)
    mind.told, mind.told_at, mind.guiding = True, view.time, False


def go_on(mind: ParticipantState, view: ParticipantView) -> None:
    """Tells the car to go on that has been told to wait."""
    if view.time < mind.go_at or not mind.voice.idle:
        return
    mind.go_at = math.inf
    if view.standing:
        mind.voice = mind.voice.plan(remark(DialogueMove.INSTRUCT, ActionValue.START))


def _dropped(mind: ParticipantState, view: ParticipantView, subgoal: SeenSubgoal, rng: np.random.Generator) -> None:
    landmark = view.landmark(subgoal.landmark)
    if landmark is None:
        return
    mind.put_off -= {subgoal.index}
    if subgoal.index == mind.target:
        forget_target(mind)
        mind.goes_on = True
        mind.voice = mind.voice.cleared()
    move = DialogueMove.INSTRUCT if rng.random() < 0.8 else DialogueMove.EXPLAIN
    mind.voice = mind.voice.plan(remark(move, landmark.name, GoalStatus.ABANDONED))


def _changed(
    mind: ParticipantState, view: ParticipantView, old: SeenSubgoal, new: SeenSubgoal, rng: np.random.Generator
) -> None:
    former, landmark = view.landmark(old.landmark), view.landmark(new.landmark)
    if former is None or landmark is None:
        return
    if new.index != mind.target:
        busy = mind.goal is not None and mind.goal.name in (former.name, landmark.name)
        if former.name is not landmark.name and not busy and rng.random() < TELLS_AHEAD:
            values = (former.name, landmark.name, GoalStatus.ABANDONED, GoalStatus.PENDING)
            mind.voice = mind.voice.plan(
                remark(DialogueMove.INSTRUCT, *values, wording=Wording(topic="changed_later", dropped=former.name))
            )
        return  # else the car is told of it when its turn has come
    told = mind.told
    forget_target(mind)
    mind.voice = mind.voice.cleared()
    if told and former.name is not landmark.name:
        _aim_at(mind, view, new, landmark)
        mind.told, mind.told_at, mind.guiding = True, view.time, False
        mind.voice = mind.voice.plan(
            remark(
                DialogueMove.INSTRUCT,
                former.name,
                landmark.name,
                GoalStatus.ABANDONED,
                GoalStatus.ONGOING,
                wording=Wording(dropped=former.name),
                urgent=True,
            )
        )


def forget_target(mind: ParticipantState) -> None:
    """Leaves the present target."""
    mind.target, mind.goal, mind.journey = None, None, None
    mind.told, mind.described, mind.guiding, mind.best = False, False, False, math.inf
    mind.guided, mind.repeats, mind.rounds, mind.changes = None, 0, 0, ()
    mind.announced, mind.stop_text = False, ""
    mind.misses, mind.eased, mind.avoided = 0, False, ()
    mind.stopped_at = mind.nudged_at = -math.inf


def choose_target(mind: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    """Takes the nearest task that counts now, if there is none in hand."""
    if mind.target is not None:
        current = view.subgoals[mind.target]
        if current.open and current.allowed:
            return
        forget_target(mind)
    found: list[tuple[float, int, SeenSubgoal, SeenLandmark]] = []
    for subgoal in view.subgoals:
        landmark = view.landmark(subgoal.landmark)
        if subgoal.open and subgoal.allowed and landmark is not None:
            found.append((route_length(mind, view, landmark), subgoal.index, subgoal, landmark))
    if found:
        _, _, subgoal, landmark = min(found, key=lambda row: row[:2])
        _aim_at(mind, view, subgoal, landmark)
        mind.guiding = bool(rng.random() < mind.style.guides)


def _aim_at(mind: ParticipantState, view: ParticipantView, subgoal: SeenSubgoal, landmark: SeenLandmark) -> None:
    mind.target, mind.goal = subgoal.index, landmark
    mind.journey = RouteProgress.plan(mind.town, view.place, landmark.place, mind.blocked)


def announcement(mind: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> Remark:
    """The target as an instruction, with its street where that helps."""
    assert mind.goal is not None
    values: list[SlotValue] = [mind.goal.name]
    if not view.unique(mind.goal) or rng.random() < mind.style.names_street:
        values.append(mind.goal.street)
    if mind.target in mind.put_off:
        return remark(DialogueMove.INSTRUCT, mind.goal.name, GoalStatus.ONGOING, wording=Wording(topic="resume"))
    more = sum(subgoal.open for subgoal in view.subgoals) > 2
    topic = "first" if more and len(values) == 1 and rng.random() < 0.5 else None
    if topic is None and len(values) == 1 and rng.random() < ANYHOW:
        values.append(ActionValue.UNKNOWN)
    return remark(DialogueMove.INSTRUCT, *values, wording=Wording(topic=topic))


def reason_topic(mind: ParticipantState) -> str | None:
    """What a reason to go to the target is about: an errand in a shop, or whom one visits."""
    if mind.goal is None:
        return None
    return "visit" if mind.goal.name in (LandmarkName.HOUSE, LandmarkName.PERSON) else "errand"


def _announce(mind: ParticipantState, view: ParticipantView, goes_on: bool, rng: np.random.Generator) -> None:
    """Names the target, perhaps with a reason for it, and what is to be done later."""
    words = replace(announcement(mind, view, rng), joined=goes_on)
    draw = rng.random()
    if draw < mind.style.reasons:
        reason = remark(DialogueMove.EXPLAIN, joined=goes_on, wording=Wording(topic=reason_topic(mind)))
        mind.voice = mind.voice.plan(reason, replace(words, joined=True))
    elif draw < 1.6 * mind.style.reasons:
        reason = remark(DialogueMove.EXPLAIN, joined=True, wording=Wording(topic=reason_topic(mind)))
        mind.voice = mind.voice.plan(words, reason)
    else:
        mind.voice = mind.voice.plan(words)
    later = [view.landmark(item.landmark) for item in view.subgoals if item.open and item.index != mind.target]
    named = [mark for mark in later if mark is not None and mind.goal is not None and mark.name is not mind.goal.name]
    if named and rng.random() < 0.25:
        also = remark(DialogueMove.EXPLAIN, named[0].name, GoalStatus.PENDING, joined=True)
        mind.voice = mind.voice.plan(also)
    elif rng.random() < mind.style.aligns:
        mind.voice = mind.voice.plan(remark(DialogueMove.ALIGN, joined=True))


def tell_target(mind: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    """Tells the car of the target when its turn has come, and again if it does not answer."""
    goes_on, mind.goes_on = mind.goes_on, False
    if mind.goal is None or not (mind.voice.idle or goes_on):
        return
    if not mind.told and view.time >= mind.next_at:
        mind.told, mind.told_at = True, view.time
        if not mind.guiding or rng.random() < mind.style.names_goal:
            _announce(mind, view, goes_on and not mind.voice.idle, rng)
        return
    if not mind.told:
        return
    waiting = max(mind.told_at, mind.voice.last_end)
    unheard = mind.heard_at < mind.told_at and view.time - waiting > UNANSWERED
    if view.standing and not mind.guiding and unheard and mind.repeats < 3:
        mind.repeats += 1
        mind.told_at = view.time
        if mind.repeats == 1:
            mind.voice = mind.voice.plan(remark(DialogueMove.ALIGN))
        else:
            mind.voice = mind.voice.plan(announcement(mind, view, rng))


GUIDES_AT_ONCE = 0.12
"""Chance that the way to a place that the car does not know is told from where it has been described."""

TELLS_LOOKS = 0.5
"""Chance that a place is described by what stands there, too."""

_FAMOUS = frozenset(LandmarkName) - {
    LandmarkName.HOUSE,
    LandmarkName.PERSON,
    LandmarkName.UNKNOWN,
    LandmarkName.QUERIED,
}

_FEATURES = (
    ObjectClass.BUILDING, ObjectClass.FENCE, ObjectClass.WALL, ObjectClass.POLE, ObjectClass.VEGETATION,
    ObjectClass.TRAFFIC_SIGN, ObjectClass.SIDE_WALK, ObjectClass.TERRAIN, ObjectClass.GROUND, ObjectClass.WATER,
    ObjectClass.BRIDGE, ObjectClass.GUARD_RAIL, ObjectClass.RAIL_TRACK, ObjectClass.OTHER, ObjectClass.ROAD_LINE,
)  # fmt: skip
"""What stands by houses and people."""


def describe(mind: ParticipantState, view: ParticipantView, move: DialogueMove, rng: np.random.Generator) -> None:
    """Says where the target is; at once, or when the car is close to it, the way is told turn by turn."""
    assert mind.goal is not None
    mind.guiding = bool(mind.goal.street is StreetName.UNKNOWN or mind.described or rng.random() < GUIDES_AT_ONCE)
    mind.described = True
    values: list[SlotValue] = [mind.goal.street] if mind.goal.street is not StreetName.UNKNOWN else []
    near = _near(mind.goal, view)
    if near is not None:
        values.append(near.name)
    looks = (_looks(mind.goal),) if rng.random() < TELLS_LOOKS else ()
    mind.voice = mind.voice.plan_first(remark(move, *values, wording=Wording(topic="where")), *looks)


def _looks(goal: SeenLandmark) -> Remark:
    """By what a place is known when one is there: the same for the same place."""
    thing = _FEATURES[int(abs(goal.x) * 7.0 + abs(goal.y) * 3.0) % len(_FEATURES)]
    return remark(DialogueMove.EXPLAIN, thing, wording=Wording(topic="looks"), joined=True)


def _near(goal: SeenLandmark, view: ParticipantView) -> SeenLandmark | None:
    """A well-known place close to the target."""
    found = [
        (abs(other.x - goal.x) + abs(other.y - goal.y), other.row, other)
        for other in view.landmarks
        if other.name in _FAMOUS and other.name is not goal.name
    ]
    return min(found)[2] if found and min(found)[0] < 90.0 else None
