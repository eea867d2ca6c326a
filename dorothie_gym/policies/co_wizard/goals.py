"""What the Co-Wizard believes about places to go to: named, given up, guessed, reached."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dorothie_gym.dialogue import Wording
from dorothie_gym.maps.routing import Place, router
from dorothie_gym.ontology import (
    ActionValue,
    DialogueMove,
    GoalStatus,
    LandmarkName,
    MentalAction,
    SlotValue,
    StreetName,
)
from dorothie_gym.policies.co_wizard.acknowledgement import musing
from dorothie_gym.policies.co_wizard.driving import place_ahead
from dorothie_gym.policies.co_wizard.state import CoWizardState
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.observation_parser import SeenLandmark
from dorothie_gym.policies.route_progress import RouteProgress, streets_named
from dorothie_gym.policies.speech import remark
from dorothie_gym.spaces import LanePosition, Mental

MOST_LANES = 40
"""So many lanes of a street are looked at for the one that is reached first."""

CONFIRMS_CHANGES = 0.8
"""Chance that a change of the tasks is confirmed, not only acknowledged."""

STEERED = 15.0
"""Who has been told the way no longer ago than this does not look for the place by itself [s]."""

LOOKED = 8.0
"""A place that has been guessed is given up when the car is this close to the guess [m]."""

_COMMON = (LandmarkName.HOUSE, LandmarkName.PERSON)


def known(
    mind: CoWizardState, view: CoWizardView, name: LandmarkName, streets: Sequence[StreetName]
) -> SeenLandmark | None:
    """The landmark of that name on the map, on one of the streets if any is named; None if there is none."""
    found = [mark for mark in view.landmarks if mark.name is name and mark.place not in mind.not_there]
    fitting = [mark for mark in found if mark.street in streets]
    if fitting:
        return fitting[0]
    # a place that only one can be is that one even if its street was not understood
    return found[0] if found and (not streets or name not in _COMMON) else None


def aim(mind: CoWizardState, view: CoWizardView, mark: SeenLandmark) -> None:
    """Makes a place on the map the goal and plans the way."""
    mind.goal, mind.place, mind.exact = mark.name, mark.place, True
    mind.directive, mind.wish, mind.nudge = None, None, None
    mind.misses, mind.avoided = 0, ()
    mind.halted = mind.arrived = mind.creeping = False
    mind.note(Mental(action=MentalAction.GOAL_UPDATE, goals=(mark.name,)))
    mind.note_status(mark.name, GoalStatus.ONGOING)
    plan_way(mind, view)


def plan_way(mind: CoWizardState, view: CoWizardView) -> None:
    """Plans a way to the goal, if its place is on the map."""
    if mind.place is None or not mind.exact:
        mind.journey = None
        return
    mind.journey = RouteProgress.plan(mind.town, view.here, mind.place, mind.blocked + mind.avoided)
    note_plan(mind)


def note_plan(mind: CoWizardState) -> None:
    """Notes the junctions of the plan if they are not those noted last."""
    route = mind.journey.route if mind.journey is not None else None
    junctions = route.junctions(mind.town) if route is not None else ()
    indices = {junction.id: index for index, junction in enumerate(mind.town.junctions)}
    plan = tuple(indices[junction] for junction in junctions if junction in indices)
    if plan != mind.plan and plan:
        mind.plan = plan
        mind.note(Mental(action=MentalAction.PLAN_UPDATE, plan=plan))


def hear_goal(
    mind: CoWizardState,
    view: CoWizardView,
    name: LandmarkName,
    streets: Sequence[StreetName],
    rng: np.random.Generator,
    dropped: LandmarkName | None = None,
    corrected: bool = False,
    sure: bool = True,
) -> None:
    """Takes up a place that it is told to go to.

    Args:
        mind: of the Co-Wizard.
        view: what it sees.
        name: the place.
        streets: streets named with it.
        rng: for the words.
        dropped: a place that is given up for it.
        corrected: whether it had taken another place for it.
        sure: whether it has understood the name; else it asks whether that was meant.
    """
    mark = known(mind, view, name, streets)
    if dropped is not None:
        mind.note_status(dropped, GoalStatus.ABANDONED)
    if mark is None:
        _unknown(mind, view, name, streets, rng)
        return
    aim(mind, view, mark)
    if dropped is not None:
        wording = Wording(topic="changed", dropped=dropped)
        mind.voice = mind.voice.plan(remark(DialogueMove.CONFIRM, name, wording=wording))
        if mind.journey is not None and mind.journey.turns_round_first(mind.town, view.station):
            mind.voice = mind.voice.plan(remark(DialogueMove.EXPLAIN, ActionValue.U_TURN, joined=True))
    elif corrected:
        mind.voice = mind.voice.plan(remark(DialogueMove.CONFIRM, name, wording=Wording(topic="sorry")))
    elif not sure or not streets and rng.random() < mind.style.checks * (2.0 if name in _COMMON else 0.6):
        mind.voice = mind.voice.plan(remark(DialogueMove.CHECK, name, mark.street))
    else:
        values: list[SlotValue] = [name]
        if streets and rng.random() < mind.style.echoes:
            values.append(mark.street)
        move = DialogueMove.CONFIRM if rng.random() < 0.4 else DialogueMove.ACKNOWLEDGE
        words = remark(move, *values, wording=Wording(topic="taken"))
        mind.voice = mind.voice.plan(words, *musing(mind, rng, joined=True))


def _unknown(
    mind: CoWizardState, view: CoWizardView, name: LandmarkName, streets: Sequence[StreetName], rng: np.random.Generator
) -> None:
    """The place is not on the map: says so, and goes where it is told to."""
    again = mind.goal is name and not mind.exact
    mind.described = again and mind.described
    mind.goal, mind.place, mind.exact, mind.journey = name, None, False, None
    mind.creeping, mind.arrived, mind.plan = False, False, ()
    mind.note_status(name, GoalStatus.UNKNOWN)
    if again:
        mind.voice = mind.voice.plan(remark(DialogueMove.QUERY_W, name))
        return
    no_map = remark(DialogueMove.EXPLAIN, name, GoalStatus.UNKNOWN, wording=Wording(topic="no_map"))
    draw = rng.random()
    if draw < 0.25 and not streets:
        which = remark(DialogueMove.QUERY_W, name, StreetName.QUERIED, joined=True)
        mind.voice = mind.voice.plan(no_map, which)
    elif draw < 0.4:
        mind.voice = mind.voice.plan(no_map, remark(DialogueMove.QUERY_W, name, joined=True))
    elif draw < 0.6:
        mind.voice = mind.voice.plan(no_map, remark(DialogueMove.INSTRUCT, joined=True, wording=Wording(topic="help")))
    else:
        mind.voice = mind.voice.plan(no_map)


def hear_later(mind: CoWizardState, view: CoWizardView, name: LandmarkName, rng: np.random.Generator) -> None:
    """A place is to be gone to later: remembers it, asks when, or proposes to go there first if that is nearer."""
    mind.note_status(name, GoalStatus.PENDING)
    mark = known(mind, view, name, ())
    if mind.goal is None or mind.goal is name:
        mind.voice = mind.voice.plan(remark(DialogueMove.ACKNOWLEDGE, name, GoalStatus.PENDING))
        return
    if mark is not None and mind.journey is not None and rng.random() < mind.style.offers:
        route = router(mind.town).route(view.here, mark.place, mind.blocked)
        if route is not None and route.length < mind.journey.left(view.station):
            mind.offer = name
            mind.voice = mind.voice.plan(
                remark(DialogueMove.EXPLAIN, name, wording=Wording(topic="nearer")),
                remark(DialogueMove.QUERY_YN, name, wording=Wording(topic="first"), joined=True),
            )
            return
    if rng.random() < 0.5:
        mind.voice = mind.voice.plan(remark(DialogueMove.QUERY_W, mind.goal, wording=Wording(topic="order")))
    else:
        move = DialogueMove.CONFIRM if rng.random() < CONFIRMS_CHANGES else DialogueMove.ACKNOWLEDGE
        mind.voice = mind.voice.plan(remark(move, name, GoalStatus.PENDING))


def accept_offer(mind: CoWizardState, view: CoWizardView, rng: np.random.Generator) -> None:
    """Goes first to the place that it has proposed; the one under way is for later."""
    name, mind.offer = mind.offer, None
    mark = known(mind, view, name, ()) if name is not None else None
    if mark is None:
        return
    if mind.goal is not None:
        mind.note_status(mind.goal, GoalStatus.PENDING)
    aim(mind, view, mark)
    mind.voice = mind.voice.plan(remark(DialogueMove.CONFIRM, mark.name, wording=Wording(topic="taken")))


def hear_stop_ahead(mind: CoWizardState, view: CoWizardView, name: LandmarkName | None, distance: float) -> None:
    """It is told to stop some way ahead, perhaps by a place: comes up to it slowly."""
    if name is not None:
        mark = known(mind, view, name, ())
        if mark is not None and mark.name not in _COMMON:
            if mind.place != mark.place:
                aim(mind, view, mark)
            mind.voice = mind.voice.plan(remark(DialogueMove.ACKNOWLEDGE, name))
            return
        mind.goal = name
    mind.exact, mind.creeping, mind.halted, mind.arrived = False, True, False, False
    mind.journey, mind.directive = None, None
    # nearer than told: what is told is rounded, and a slow car can be stopped at the word
    mind.note_place(mind.goal or LandmarkName.UNKNOWN, place_ahead(mind, view, max(distance - 12.0, 10.0)))


def hear_description(
    mind: CoWizardState, view: CoWizardView, streets: Sequence[StreetName], landmarks: Sequence[LandmarkName],
    rng: np.random.Generator,
) -> None:  # fmt: skip
    """It is told where a place is: notes a guess if a place close to it is on the map, and says that it has heard."""
    if mind.goal is not None and not mind.exact:
        mind.described = True
        place = _described(mind, view, streets, landmarks)
        if place is not None and view.time - mind.steered_at > STEERED:
            guess = Mental(action=MentalAction.KNOWLEDGE_UPDATE, landmark=mind.goal, place=_map_place(*place))
            mind.note(guess)
            mind.journey = RouteProgress.plan(mind.town, view.here, place, mind.blocked)
            mind.directive = mind.wish = None
            note_plan(mind)
    if mind.goal is not None and not mind.exact and not mind.arrived:
        mind.halted = False  # it goes where it is told to
    values: tuple[SlotValue, ...] = tuple(streets[:1]) if rng.random() < mind.style.echoes else ()
    mind.voice = mind.voice.plan(remark(DialogueMove.ACKNOWLEDGE, *values))
    if rng.random() < mind.style.reassures:
        mind.voice = mind.voice.plan(remark(DialogueMove.ALIGN, joined=True))


def _described(
    mind: CoWizardState, view: CoWizardView, streets: Sequence[StreetName], landmarks: Sequence[LandmarkName]
) -> Place | None:
    """Where to look for a place: by the landmark it is close to, else where its street is reached first."""
    near = next((mark for name in landmarks if (mark := known(mind, view, name, ())) is not None), None)
    if near is not None:
        return near.place
    named = frozenset(index for street in streets for index in streets_named(view.raw["street_names"], street))
    lanes = [lane for lane in mind.town.lanes if lane.street in named and not lane.in_junction]
    found: list[tuple[float, int]] = []
    for lane in lanes[:MOST_LANES]:
        route = router(mind.town).route(view.here, (lane.id, lane.length / 2), mind.blocked)
        if route is not None:
            found.append((route.length, lane.id))
    if not found:
        return None
    _, nearest = min(found)
    return nearest, mind.town.lanes[nearest].length / 2


def search_on(mind: CoWizardState, view: CoWizardView) -> None:
    """Gives the guess of a place up when it has come there: from now on it has to be guided."""
    if mind.journey is not None and not mind.exact and mind.journey.left(view.station) < LOOKED:
        mind.journey = None


def _map_place(lane: int, station: float) -> LanePosition:
    return LanePosition(lane=lane, metres=round(station))


def give_up(mind: CoWizardState, name: LandmarkName | None) -> None:
    """A task is off; if it was the one under way, the car waits to be told what comes next."""
    if name is not None:
        mind.note_status(name, GoalStatus.ABANDONED)
    if name is None or name is mind.goal:
        leave_goal(mind)


def complete(mind: CoWizardState, name: LandmarkName | None) -> None:
    """A task is done."""
    done = name if name is not None else mind.goal
    if done is not None:
        mind.note_status(done, GoalStatus.COMPLETE)
    if done in _COMMON and mind.place is not None and mind.exact:
        mind.not_there = (*mind.not_there, mind.place)
    leave_goal(mind)
    mind.halted, mind.speed = True, mind.usual
    mind.voice = mind.voice.cleared()


def doubt(mind: CoWizardState) -> None:
    """The place it took for the goal is not the one meant: it has to be guided."""
    if mind.exact and mind.place is not None:
        if mind.goal in _COMMON:
            mind.not_there = (*mind.not_there, mind.place)
        mind.place, mind.exact, mind.journey, mind.plan = None, False, None, ()
    mind.arrived = False


def leave_goal(mind: CoWizardState) -> None:
    """There is no goal any more."""
    mind.goal, mind.place, mind.exact, mind.journey = None, None, False, None
    mind.directive, mind.nudge, mind.wish = None, None, None
    mind.creeping, mind.arrived, mind.plan = False, False, ()
