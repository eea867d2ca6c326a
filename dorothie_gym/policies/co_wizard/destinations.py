"""Destinations of the Co-Wizard: named, postponed, described, guessed, reached and given up."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.dialogue.intentions import CommunicativeFunction as Function
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.maps.routing import Place, router
from dorothie_gym.ontology.actions import MentalAction
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.slots import ActionValue, GoalStatus, LandmarkName, StreetName
from dorothie_gym.policies import act_builders
from dorothie_gym.policies.co_wizard.acknowledgement import plan_remark, sign_of_hearing
from dorothie_gym.policies.co_wizard.errand_memory import kept_for_later
from dorothie_gym.policies.observation_parser import (
    COMMON,
    SeenLandmark,
    landmarks_in_view,
    nearest_landmark,
    street_of,
)
from dorothie_gym.policies.route_progress import RouteProgress, default_lane_place, streets_named
from dorothie_gym.policies.speech import intend
from dorothie_gym.session.spaces.actions import LanePosition, Mental

if TYPE_CHECKING:
    from dorothie_gym.policies.co_wizard.state import CoWizardState
    from dorothie_gym.policies.co_wizard.view import CoWizardView


def known_landmark(
    state: CoWizardState, view: CoWizardView, name: LandmarkName, streets: Sequence[StreetName]
) -> SeenLandmark | None:
    """Returns the landmark with a name on the map, on one of the streets if any are named; None if there is none."""
    found = [mark for mark in view.landmarks if mark.name is name and mark.place not in state.beliefs.ruled_out]
    fitting = [mark for mark in found if mark.street in streets]
    if fitting:
        return fitting[0]
    # a unique name identifies the place even if the street was not understood
    return found[0] if found and (not streets or name not in COMMON) else None


def aim(state: CoWizardState, view: CoWizardView, mark: SeenLandmark) -> None:
    """Makes a place on the map the goal and plans the route."""
    goal = Mental(action=MentalAction.GOAL_UPDATE, goals=(mark.name,))
    beliefs = state.beliefs.with_known_goal(mark.name, mark.place).with_update(goal)
    state.beliefs = beliefs.with_status(mark.name, GoalStatus.ONGOING)
    state.dialogue = state.dialogue.with_orders_settled()
    state.intentions = state.intentions.for_new_goal()
    state.route = state.route.for_new_goal()
    plan_route(state, view)


def plan_route(state: CoWizardState, view: CoWizardView) -> None:
    """Plans a route to the goal, if its place is on the map."""
    place = state.beliefs.stop_place
    if place is None:
        state.route = state.route.with_progress(None)
        return
    progress = RouteProgress.plan(state.town, view.here, place, state.route.closed)
    state.route = state.route.with_progress(progress)
    note_plan(state)


def note_plan(state: CoWizardState) -> None:
    """Queues a plan update if the junctions of the route are not those of the last update."""
    progress = state.route.progress
    route = progress.route if progress is not None else None
    junctions = route.junctions(state.town) if route is not None else ()
    indices = state.town.junction_indices
    state.beliefs = state.beliefs.with_plan(tuple(indices[junction] for junction in junctions if junction in indices))


def set_goal(
    state: CoWizardState,
    view: CoWizardView,
    name: LandmarkName,
    streets: Sequence[StreetName],
    rng: np.random.Generator,
    dropped: LandmarkName | None = None,
    corrected: bool = False,
    sure: bool = True,
) -> None:
    """Adopts a destination that the participant named.

    Args:
        state: working copy of the state.
        view: observation.
        name: the place.
        streets: streets named with it.
        rng: random generator of the decision.
        dropped: place that is abandoned for it.
        corrected: whether the name corrects a misunderstanding.
        sure: whether the name was understood; otherwise it is checked.
    """
    mark = known_landmark(state, view, name, streets)
    if dropped is not None:
        state.beliefs = state.beliefs.with_status(dropped, GoalStatus.ABANDONED)
    if mark is None:
        _set_unknown_goal(state, name, streets, rng)
        if any(item.act.move is DialogueMove.QUERY_W for item in state.speech.queue):
            state.dialogue = state.dialogue.after_asking(view.time)
        return
    aim(state, view, mark)
    if dropped is not None:
        wording = Wording(topic="changed", dropped=dropped)
        state.say(intend(Function.ACCEPT, act_builders.destination(name), wording=wording))
        progress = state.route.progress
        if progress is not None and progress.turns_round_first(state.town, view.station):
            state.say(intend(Function.INFORM, act_builders.action(ActionValue.U_TURN), joined=True))
    elif corrected:
        state.say(intend(Function.ACCEPT, act_builders.destination(name), wording=Wording(topic="sorry")))
    elif not sure or (not streets and rng.random() < state.style.checks * (2.0 if name in COMMON else 0.6)):
        state.say(intend(Function.CHECK_QUESTION, act_builders.destination(name, mark.street)))
    else:
        street = mark.street if streets and rng.random() < state.style.echoes else None
        function = Function.ACCEPT if rng.random() < state.config.accepts_goals else Function.POSITIVE_FEEDBACK
        taken = intend(function, act_builders.destination(name, street), wording=Wording(topic="taken"))
        state.say(taken, *plan_remark(state, view, rng, joined=True))


def _set_unknown_goal(
    state: CoWizardState, name: LandmarkName, streets: Sequence[StreetName], rng: np.random.Generator
) -> None:
    """Adopts a destination that is not on the map and says so; the car then needs guidance."""
    again = state.beliefs.goal is name and not state.beliefs.exact
    where = act_builders.located(name, StreetName.QUERIED)
    state.dialogue = state.dialogue if again else state.dialogue.with_orders_settled()
    state.beliefs = state.beliefs.with_unknown_goal(name, streets).with_status(name, GoalStatus.UNKNOWN)
    state.route = state.route.with_progress(None)
    state.intentions = state.intentions.for_unknown_goal()
    if again:
        way = act_builders.action(ActionValue.QUERIED)
        asked = intend(Function.SET_QUESTION, way if state.beliefs.streets else where, elided=("street",))
        state.say(asked)
        return
    unknown = Proposition.of(Predicate.KNOWS, negated=True, place=name)
    unmarked = act_builders.errand(name, GoalStatus.UNKNOWN)
    no_map = intend(Function.INFORM, unknown, unmarked, wording=Wording(topic="no_map"))
    draw = rng.random()
    if draw < 0.25 and not streets:
        state.say(no_map, intend(Function.SET_QUESTION, where, joined=True))
    elif draw < 0.4 and not streets:
        state.say(no_map, intend(Function.SET_QUESTION, where, elided=("street",), joined=True))
    elif draw < 0.6:
        route = Proposition.of(Predicate.HAS_ROUTE, place=name)
        help_me = intend(Function.REQUEST, route, elided=("place",), wording=Wording(topic="help"), joined=True)
        state.say(no_map, help_me)
    else:
        state.say(no_map)


def adopt_unknown(state: CoWizardState, name: LandmarkName) -> None:
    """Adopts a destination that is not on the map, and says so."""
    state.beliefs = state.beliefs.with_unknown_goal(name).with_status(name, GoalStatus.UNKNOWN)
    state.route = state.route.with_progress(None)
    state.intentions = state.intentions.for_unknown_goal()
    unknown = Proposition.of(Predicate.KNOWS, negated=True, place=name)
    unmarked = act_builders.errand(name, GoalStatus.UNKNOWN)
    state.say(intend(Function.INFORM, unknown, unmarked, wording=Wording(topic="no_map")))


def postpone(state: CoWizardState, view: CoWizardView, name: LandmarkName, rng: np.random.Generator) -> None:
    """Records a place to visit later: acknowledges it, asks for the order, or offers to go there first."""
    state.beliefs = state.beliefs.with_status(name, GoalStatus.PENDING)
    mark, later = known_landmark(state, view, name, ()), act_builders.errand(name, GoalStatus.PENDING)
    goal, progress = state.beliefs.goal, state.route.progress
    if goal is None or goal is name or goal in state.speech.heard:  # the order is clear
        state.say(kept_for_later(state, name))
        return
    if mark is not None and progress is not None and rng.random() < state.style.offers:
        route = router(state.town).route(view.here, mark.place, state.route.blocked)
        if route is not None and route.length < progress.left(view.station):
            state.dialogue = state.dialogue.with_offer(name)
            state.say(
                intend(
                    Function.INFORM,
                    Proposition.of(Predicate.NEARER, place=name, landmark=goal),
                    elided=("landmark",),
                ),
                intend(Function.OFFER, act_builders.destination(name), wording=Wording(topic="first"), joined=True),
            )
            return
    if rng.random() < 0.5:
        order = Proposition.of(Predicate.ORDER, place=name, then=goal)
        state.say(intend(Function.SET_QUESTION, order, elided=("place",)))
    elif rng.random() < state.config.accepts_changes:
        state.say(kept_for_later(state, name))
    else:
        state.say(intend(Function.POSITIVE_FEEDBACK, later, elided=act_builders.arguments_of(later)))


def accept_offer(state: CoWizardState, view: CoWizardView) -> None:
    """Goes first to the place that was offered; the current goal becomes pending."""
    name = state.dialogue.offer
    state.dialogue = state.dialogue.with_offer(None)
    mark = known_landmark(state, view, name, ()) if name is not None else None
    if mark is None:
        return
    if state.beliefs.goal is not None:
        state.beliefs = state.beliefs.with_status(state.beliefs.goal, GoalStatus.PENDING)
    aim(state, view, mark)
    state.say(intend(Function.ACCEPT, act_builders.destination(mark.name), wording=Wording(topic="taken")))


def believed_destination(state: CoWizardState, view: CoWizardView) -> Proposition:
    """Returns the destination for a check; where the town has several of its kind, with the street of the place."""
    goal, place = state.beliefs.goal, state.beliefs.stop_place
    if goal not in COMMON or place is None:
        return act_builders.destination(goal)
    return act_builders.destination(goal, street_of(view.raw, state.town, place[0]))


def is_on_another_street(state: CoWizardState, view: CoWizardView, streets: Sequence[StreetName]) -> bool:
    """Returns whether the place of the destination, of which the town has several, is on none of the streets named."""
    believed = believed_destination(state, view).get("street")
    return believed is not None and bool(streets) and believed not in streets


def approach_stop(state: CoWizardState, view: CoWizardView, name: LandmarkName | None, distance: float) -> None:
    """Prepares a stop at a distance ahead, possibly at a named place, which the car approaches slowly.

    Args:
        state: working copy of the state.
        view: observation.
        name: place named with the instruction, or None.
        distance: stated distance [m].
    """
    if name is not None:
        mark = known_landmark(state, view, name, ())
        if mark is not None and mark.name not in COMMON:
            if state.beliefs.place != mark.place:
                aim(state, view, mark)
            state.say(intend(Function.POSITIVE_FEEDBACK, act_builders.destination(name)))
            return
    state.beliefs = state.beliefs.with_goal_ahead(name)
    state.intentions = state.intentions.creeping_up()
    state.route = state.route.with_progress(None)
    # nearer than said: spoken distances are rounded, and a slow car can be stopped at once
    guess = default_lane_place(state.town, view.here, max(distance - 12.0, 10.0))
    state.beliefs = state.beliefs.with_guess(state.beliefs.goal or LandmarkName.UNKNOWN, guess)


def hear_description(
    state: CoWizardState,
    view: CoWizardView,
    streets: Sequence[StreetName],
    landmarks: Sequence[LandmarkName],
    rng: np.random.Generator,
) -> None:
    """Processes a description of the goal's place: guesses the place if possible, and acknowledges the description."""
    goal = state.beliefs.goal
    if goal is not None and not state.beliefs.exact:
        state.beliefs = state.beliefs.with_description()
        place = _described_place(state, view, streets, landmarks)
        if place is not None and view.time - state.dialogue.steered_at > state.config.search_silence:
            where = LanePosition(lane=place[0], metres=round(place[1]))
            guess = Mental(action=MentalAction.KNOWLEDGE_UPDATE, landmark=goal, place=where)
            state.beliefs = state.beliefs.with_update(guess)
            progress = RouteProgress.plan(state.town, view.here, place, state.route.blocked)
            state.route = state.route.with_progress(progress)
            state.intentions = state.intentions.without_manoeuvres()
            note_plan(state)
        if not state.intentions.arrived:
            state.intentions = state.intentions.resumed()
    street = streets[0] if streets and rng.random() < state.style.echoes else None
    if street is None:
        asked = view.time - state.dialogue.asked_at < state.config.answer_time
        state.say(sign_of_hearing("answered" if asked else "told"))
    else:
        state.say(intend(Function.POSITIVE_FEEDBACK, act_builders.located(goal, street), elided=("place",)))


def _described_place(
    state: CoWizardState, view: CoWizardView, streets: Sequence[StreetName], landmarks: Sequence[LandmarkName]
) -> Place | None:
    """Returns where to search for a place: at the landmark close to it, else where its street is reached first."""
    near = next((mark for name in landmarks if (mark := known_landmark(state, view, name, ())) is not None), None)
    if near is not None:
        return near.place
    named = frozenset(index for street in streets for index in streets_named(view.raw["street_names"], street))
    lanes = [lane for lane in state.town.lanes if lane.street in named and not lane.in_junction]
    found: list[tuple[float, int]] = []
    for lane in lanes[: state.config.street_lanes]:
        route = router(state.town).route(view.here, (lane.id, lane.length / 2), state.route.blocked)
        if route is not None:
            found.append((route.length, lane.id))
    if not found:
        return None
    _, nearest = min(found)
    return nearest, state.town.lanes[nearest].length / 2


def seek_street(state: CoWizardState, view: CoWizardView, street: StreetName) -> bool:
    """Plans a route to the nearest part of a street; returns whether there is one."""
    place = _described_place(state, view, (street,), ())
    if place is None:
        return False
    state.route = state.route.with_progress(RouteProgress.plan(state.town, view.here, place, state.route.closed))
    note_plan(state)
    return True


def accept_street(state: CoWizardState, view: CoWizardView) -> None:
    """Drives to the street that was offered."""
    street = state.dialogue.offered_street
    state.dialogue = state.dialogue.with_offered_street(None)
    if street is not None and seek_street(state, view, street):
        state.intentions = state.intentions.without_manoeuvres().started()
        state.say(intend(Function.ACCEPT, act_builders.action(None, street=street), wording=Wording(topic="taken")))


def search_on(state: CoWizardState, view: CoWizardView) -> None:
    """Ends the way to a street, or to the guess of a place, when the car has arrived there.

    From then on the car needs guidance, unless it knows its destination.
    """
    progress = state.route.progress
    if progress is None or progress.left(view.station) >= state.config.search_radius:
        return
    if not state.beliefs.exact:
        state.route = state.route.with_progress(None)
    elif progress.goal != state.beliefs.place:
        plan_route(state, view)


def recognise_goal(state: CoWizardState, view: CoWizardView) -> None:
    """Adopts the place of a goal that is not on the map when the camera shows it nearby, and no other of its name.

    Of places that a town may have several of, only one on a street that the participant has named counts, if any was.
    """
    goal, shown = state.beliefs.goal, landmarks_in_view(view.raw, view.landmarks)
    if goal is None or state.beliefs.exact or state.intentions.arrived or not shown:
        return
    known = [mark for mark in view.landmarks if mark.name is goal and mark.place not in state.beliefs.ruled_out]
    if goal in COMMON and state.beliefs.streets:
        known = [mark for mark in known if mark.street in state.beliefs.streets]
    if len(known) == 1 and nearest_landmark(view.raw, known, *view.position) is not None:
        aim(state, view, known[0])


def abandon(state: CoWizardState, name: LandmarkName | None) -> None:
    """Gives up a task; if it is the current one, or none is named, the car waits for the next."""
    if name is not None:
        state.beliefs = state.beliefs.with_status(name, GoalStatus.ABANDONED)
    if name is None or name is state.beliefs.goal:
        state.leave_goal()


def complete(state: CoWizardState, name: LandmarkName | None) -> None:
    """Finishes a task and keeps the car stationary."""
    done = name if name is not None else state.beliefs.goal
    if done is not None:
        state.beliefs = state.beliefs.with_status(done, GoalStatus.COMPLETE)
    if done in COMMON and state.beliefs.exact:
        state.beliefs = state.beliefs.with_place_ruled_out()
    state.leave_goal()
    state.intentions = state.intentions.halting().with_speed(state.intentions.usual)
    state.speech = state.speech.cleared()


def doubt(state: CoWizardState) -> None:
    """Drops the assumed place of the goal; the car then needs guidance."""
    if state.beliefs.exact and state.beliefs.place is not None:
        if state.beliefs.goal in COMMON:
            state.beliefs = state.beliefs.with_place_ruled_out()
        state.beliefs = state.beliefs.without_place()
        state.route = state.route.with_progress(None)
    state.intentions = state.intentions.departed()
