"""Steps of the plan carried out in order, each at its point of the road: updates of every decision."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Final, TypeAlias

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.intentions import CommunicativeFunction as Function
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.dialogue.routes import MAX_STEPS, Anaphor, ConditionRelation, PlanStep, StepAction, StepChange
from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.slots import ActionValue, GoalStatus, LandmarkName, StreetName
from dorothie_gym.policies import act_builders
from dorothie_gym.policies.co_wizard.destinations import adopt_unknown, aim, known_landmark, plan_route, seek_street
from dorothie_gym.policies.co_wizard.instructed_actions import asked_speed
from dorothie_gym.policies.co_wizard.intentions import Directive, Wish
from dorothie_gym.policies.co_wizard.plan_memory import NO_JUNCTION, STEERING, StepStage
from dorothie_gym.policies.co_wizard.plan_objections import object_to
from dorothie_gym.policies.co_wizard.plan_points import Objection, find_point, road_of
from dorothie_gym.policies.co_wizard.state import CoWizardState
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.observation_parser import SeenLandmark
from dorothie_gym.policies.road_ahead import RoadAhead, turned
from dorothie_gym.policies.route_progress import Choice, default_lane_distance, find_exit, streets_named
from dorothie_gym.policies.speech import intend
from dorothie_gym.policies.turn_lanes import junction_meant
from dorothie_gym.support.portable_math import wrap_degrees

TURNED_WITHIN: Final = 45.0
"""Difference between the direction after a junction and that of the exit up to which the exit was taken [degrees]."""

MOST_MISSED: Final = 2
"""Number of missed turns after which a plan is given up."""

REACHED: Final = 5.0
"""Distance at which a place on the road counts as reached [m]."""

SIGHT_OF_OBJECTS: Final = 40.0
"""Distance within which an object brings a step about that is due at its sight [m]."""

_Carry: TypeAlias = Callable[[CoWizardState, CoWizardView, PlanStep], bool]
"""Carries out a step as far as this is due; returns whether the step is over."""

_WHILE_HALTED: Final = frozenset({StepAction.GO, StepAction.WAIT, StepAction.LIGHTS, StepAction.AVOID})

_EARLY: Final[Mapping[StepAction, float]] = MappingProxyType({StepAction.U_TURN: 25.0, StepAction.SPEED: 8.0})
"""Distance to its place at which a step begins [m]."""

_SLOWS_BEFORE: Final = 60.0  # distance to a junction "before" which the car is to be slower [m]


def keep_plan(state: CoWizardState, view: CoWizardView) -> None:
    """Carries out the steps that are due, and sets the turn at the next junction."""
    if state.plan.start is None:
        state.plan = state.plan.with_start(view.here)
    for _ in range(MAX_STEPS):
        step = state.plan.present
        if step is None or _is_interrupted(state, step) or not _CARRY[step.action](state, view, step):
            break
        state.plan = state.plan.advanced()
    _steer(state, view)


def _is_interrupted(state: CoWizardState, step: PlanStep) -> bool:
    """Returns whether the car stands on request, so that the next step waits until it is sent on."""
    intentions = state.intentions
    if (
        not intentions.halted
        or state.plan.stage in (StepStage.BEGUN, StepStage.UNDER_WAY)
        or step.action in _WHILE_HALTED
    ):
        return False
    errand_over = step.action is StepAction.VISIT and state.beliefs.goal is None
    return not errand_over


def _is_foreign(state: CoWizardState) -> bool:
    """Returns whether a turn that was asked for apart from the plan comes first."""
    directive = state.intentions.directive
    return directive is not None and directive != state.plan.issued


# --- at junctions -----------------------------------------------------------------------------------------------------


def _steer(state: CoWizardState, view: CoWizardView) -> None:
    """Sets the turn at the next junction that the present step asks for."""
    step, intentions = state.plan.present, state.intentions
    if step is None or intentions.wish is Wish.U_TURN or _is_foreign(state):
        return
    choice = junction_meant(state.town, view.here, view.choice)
    if choice is None or intentions.nudge is not None or state.town.lanes[view.lane].in_junction:
        return
    wanted = _wanted(state, view, step, choice)
    if wanted != intentions.directive:
        state.intentions = intentions.directed(wanted)
    state.plan = state.plan.issuing(wanted)
    if wanted is not None and _is_due_at(state, choice):
        way = find_exit(state.town, choice, wanted.direction, _named(view, wanted.street))
        if way is not None:
            plan = state.plan.approaching(choice.lane, way.angle)
            state.plan = plan.staged(StepStage.BEGUN, view.time)


def _is_due_at(state: CoWizardState, choice: Choice) -> bool:
    due = state.plan.due
    return due is not None and due.junction == choice.junction


def _wanted(state: CoWizardState, view: CoWizardView, step: PlanStep, choice: Choice) -> Directive | None:
    """Returns the turn at the next junction; None leaves it to the route, or to a question."""
    street = StreetName.UNKNOWN if step.place is None or step.place.street is None else step.place.street
    if step.action is StepAction.FOLLOW and find_exit(state.town, choice, None, _named(view, street)) is not None:
        return Directive(direction=None, street=street, junction=choice.junction)
    if step.action is StepAction.TURN and _is_due_at(state, choice):
        onto = _street_of(step)
        return Directive(direction=step.direction or _either(state, choice), street=onto, junction=choice.junction)
    if state.route.progress is not None and (step.action not in STEERING or step.action is StepAction.FOLLOW):
        return None
    if find_exit(state.town, choice, Direction.STRAIGHT) is None:
        return None
    return Directive(direction=Direction.STRAIGHT, junction=choice.junction)


def _street_of(step: PlanStep) -> StreetName:
    """Returns the street onto which a turn leads; UNKNOWN where it is not named."""
    at = step.condition is not None and step.condition.relation is ConditionRelation.AT
    place = step.condition.place if step.condition is not None and at else None
    if place is None or place.street is None or place.landmark is not None:
        return StreetName.UNKNOWN
    return place.street


def _either(state: CoWizardState, choice: Choice) -> Direction:
    """Returns the side to which a junction has an exit, for a turn whose direction was not said."""
    right = find_exit(state.town, choice, Direction.RIGHT)
    return Direction.RIGHT if right is not None else Direction.LEFT


def _named(view: CoWizardView, street: StreetName) -> frozenset[int]:
    return frozenset() if street is StreetName.UNKNOWN else streets_named(view.raw["street_names"], street)


def _find(state: CoWizardState, view: CoWizardView, step: PlanStep) -> RoadAhead | None:
    """Looks for the point of a step; returns the road on which it lies, or None where it has to wait or is dropped."""
    if _is_foreign(state) or state.town.lanes[view.lane].in_junction or view.manoeuvring:
        return None
    road, due = road_of(state, view, step), state.plan.due
    if due is not None and due.junction != NO_JUNCTION:
        if any(crossing.junction == due.junction for crossing in road.crossings):
            return road
    elif due is not None and (due.place is None or road.distance_of(due.place) is not None):
        return road
    found = find_point(state, view, road, step)
    if isinstance(found, Objection):
        if step.action is StepAction.FOLLOW and found.street is not None and seek_street(state, view, found.street):
            return None
        state.plan = state.plan.dropped()
        state.intentions = state.intentions.directed(None)
        object_to(state, view, found, step)
        return None
    state.plan = state.plan.at(found.due)
    return road


def _carry_turn(state: CoWizardState, view: CoWizardView, step: PlanStep) -> bool:
    if state.plan.stage is StepStage.WAITING:
        _find(state, view, step)
        return False
    if not _has_passed(state, view):
        return False
    if abs(wrap_degrees(turned(state.town, state.plan.approach, view.here) - state.plan.angle)) <= TURNED_WITHIN:
        return True
    state.plan = state.plan.after_miss()
    missed = Proposition.of(Predicate.POSSIBLE, action=ActionValue.J_TURN, direction=step.direction, negated=True)
    wording = Wording(topic="missed_turn", direction=step.direction)
    state.say(intend(Function.INFORM, missed, wording=wording))
    if state.plan.missed >= MOST_MISSED:
        state.plan = state.plan.dropped()
        way = act_builders.action(ActionValue.QUERIED)
        state.say(intend(Function.SET_QUESTION, way, wording=Wording(topic="another_way"), joined=True))
    return False


def _has_passed(state: CoWizardState, view: CoWizardView) -> bool:
    """Returns whether the car has left the junction at which the present step was due."""
    choice = junction_meant(state.town, view.here, view.choice)
    ahead = choice is not None and _is_due_at(state, choice)
    return not (ahead or view.manoeuvring or state.town.lanes[view.lane].in_junction)


def _carry_straight(state: CoWizardState, view: CoWizardView, step: PlanStep) -> bool:
    if state.plan.stage is StepStage.BEGUN and state.plan.due is not None and state.plan.due.passed:
        return _has_passed(state, view)
    road = _find(state, view, step)
    due = state.plan.due
    if road is None or due is None:
        return False
    if due.place is not None:
        distance = road.distance_of(due.place)
        reached = distance is None or distance <= REACHED
        if reached and len(state.plan.steps) == 1:
            _announce_place(state, step)
        return reached
    if due.junction == NO_JUNCTION:
        return True
    choice = junction_meant(state.town, view.here, view.choice)
    return not due.passed and choice is not None and choice.junction == due.junction


_BEHIND: Final = frozenset({ConditionRelation.PAST, ConditionRelation.AFTER})
"""Conditions of steps that end behind a place, which is none of the stops."""


def _announce_place(state: CoWizardState, step: PlanStep) -> None:
    """Reports that the car has come to the place up to which it was to go straight on."""
    until = step.condition
    if until is not None and until.relation not in _BEHIND and until.place.landmark is not None:
        there = Proposition.of(Predicate.SEES, place=until.place.landmark)
        state.say(intend(Function.INFORM, there, wording=Wording(topic="reached"), urgent=True))


def _carry_follow(state: CoWizardState, view: CoWizardView, step: PlanStep) -> bool:
    if step.place is None or step.place.street is None:
        return True
    on_it = state.town.lanes[view.lane].street in _named(view, step.place.street)
    plan = state.plan
    if plan.stage is StepStage.UNDER_WAY:
        return not on_it and not state.town.lanes[view.lane].in_junction
    if on_it:
        plan_route(state, view)  # to the destination, if that is on the map: the way so far ends at the street
        state.plan = plan.staged(StepStage.UNDER_WAY, view.time)
        return len(plan.steps) > 1 or state.beliefs.exact
    if state.route.progress is None or state.beliefs.exact:
        _find(state, view, step)
    return False


# --- at places --------------------------------------------------------------------------------------------------------


def _is_due(state: CoWizardState, view: CoWizardView, step: PlanStep) -> bool:
    """Returns whether a step that is carried out at a place is due."""
    if step.condition is None and step.distance is None:
        return True
    road = _find(state, view, step)
    due = state.plan.due
    if road is None or due is None:
        return False
    if due.object is not None:
        return any(thing.kind is due.object and thing.distance < SIGHT_OF_OBJECTS for thing in view.objects)
    distance = None if due.place is None else road.distance_of(due.place)
    before = step.condition is not None and step.condition.relation is ConditionRelation.BEFORE
    early = _SLOWS_BEFORE if before and step.action is StepAction.SPEED else _EARLY.get(step.action, REACHED)
    return distance is None or distance <= early


def _carry_stop(state: CoWizardState, view: CoWizardView, step: PlanStep) -> bool:
    plan, intentions = state.plan, state.intentions
    if plan.stage is StepStage.BEGUN:
        if intentions.nudge is None and not intentions.halted:  # the place was passed
            _stop_now(state, view)
        if view.standing and intentions.halted:
            state.plan = plan.with_stop(view.here)
            return True
        return False
    if step.condition is None and step.distance is None:
        _stop_now(state, view)
        return False
    road = _find(state, view, step)
    place = None if state.plan.due is None else state.plan.due.place
    if place is None and road is not None and _is_due(state, view, step):
        _stop_now(state, view)
    if place is None or road is None:
        return False
    distance = road.distance_of(place)
    if distance is not None and distance > 0.0:
        if distance <= state.config.gentle_distance:
            state.plan = state.plan.staged(StepStage.UNDER_WAY, view.time)
        if default_lane_distance(state.town, view.here, place, state.config.place_sight) is None:
            return False
        state.intentions = intentions.nudged(place).directed(None)
    else:
        _stop_now(state, view)
    state.plan = state.plan.staged(StepStage.BEGUN, view.time)
    return False


def _stop_now(state: CoWizardState, view: CoWizardView) -> None:
    state.dialogue = state.dialogue.after_stop_instruction(view.time)
    state.intentions = state.intentions.stopped()
    state.plan = state.plan.staged(StepStage.BEGUN, view.time)


def _carry_wait(state: CoWizardState, view: CoWizardView, step: PlanStep) -> bool:
    if state.plan.stage is StepStage.BEGUN:
        return not state.intentions.halted
    if state.intentions.halted or _is_due(state, view, step):
        _stop_now(state, view)
    return False


def _carry_go(state: CoWizardState, view: CoWizardView, step: PlanStep) -> bool:
    """Drives on; behind a stop of the same plan, after a pause unless an order comes before."""
    if not state.intentions.halted:
        return True
    if state.plan.stage is StepStage.WAITING:
        state.plan = state.plan.staged(StepStage.BEGUN, view.time)
    if view.time - state.plan.since < state.config.pause_time:
        return False
    state.intentions = state.intentions.started()
    return True


def _carry_speed(state: CoWizardState, view: CoWizardView, step: PlanStep) -> bool:
    if not _is_due(state, view, step):
        return False
    faster = None if step.change is None else step.change is StepChange.FASTER
    speed = asked_speed(state, view, step.speed, faster)
    until = view.time + state.config.slow_time
    state.intentions = state.intentions.with_asked_speed(speed, state.config.open_road_speed, until)
    return True


def _carry_lights(state: CoWizardState, view: CoWizardView, step: PlanStep) -> bool:
    if not _is_due(state, view, step):
        return False
    state.intentions = state.intentions.with_lights(step.change is not StepChange.OFF)
    return True


def _carry_lane(state: CoWizardState, view: CoWizardView, step: PlanStep) -> bool:
    if state.plan.stage is StepStage.BEGUN:
        return state.intentions.wish is None and not view.manoeuvring
    if _is_due(state, view, step):
        wish = Wish.switch(step.direction, state.town.traffic)
        state.intentions = state.intentions.switching(wish, view.time + state.config.wish_time)
        state.plan = state.plan.staged(StepStage.BEGUN, view.time)
    return False


def _carry_u_turn(state: CoWizardState, view: CoWizardView, step: PlanStep) -> bool:
    stage, turns = state.plan.stage, view.manoeuvre is PhysicalAction.U_TURN
    if stage is StepStage.UNDER_WAY:
        return not turns
    if stage is StepStage.BEGUN:
        if turns:
            state.plan = state.plan.staged(StepStage.UNDER_WAY, view.time)
        elif state.intentions.wish is not Wish.U_TURN:
            state.plan = state.plan.dropped()  # it was given up
        return False
    if _is_due(state, view, step):
        until = view.time + state.config.wish_time
        state.intentions = state.intentions.turning_round(until, creeping=False)
        state.dialogue = state.dialogue.after_u_turn_instruction(view.time)
        state.plan = state.plan.staged(StepStage.BEGUN, view.time)
    return False


def _carry_visit(state: CoWizardState, view: CoWizardView, step: PlanStep) -> bool:
    name = LandmarkName.UNKNOWN if step.place is None else step.place.landmark or LandmarkName.UNKNOWN
    if state.plan.stage is StepStage.BEGUN:
        return state.intentions.arrived or state.beliefs.goal is not name
    mark = known_landmark(state, view, name, _streets(step)) or _remembered(state, step)
    if mark is None and name is LandmarkName.UNKNOWN:
        return True
    if mark is None and state.beliefs.goal is not name:
        adopt_unknown(state, name)
    elif mark is not None and (state.beliefs.goal is not name or not state.beliefs.exact):
        postponed = (name, GoalStatus.PENDING) in state.beliefs.statuses
        aim(state, view, mark)
        if postponed:
            state.say(intend(Function.INFORM, act_builders.destination(name), wording=Wording(topic="next_errand")))
    state.plan = state.plan.staged(StepStage.BEGUN, view.time)
    return False


def _remembered(state: CoWizardState, step: PlanStep) -> SeenLandmark | None:
    """Returns the place of the drive so far that a step refers to: where it began, or the last stop."""
    reference = None if step.place is None else step.place.reference
    place = {Anaphor.START: state.plan.start, Anaphor.LAST_STOP: state.plan.stops}.get(reference or Anaphor.HERE)
    if place is None:
        return None
    x, y = (float(value) for value in state.town.lanes[place[0]].position(place[1]))
    return SeenLandmark(
        row=-1, name=LandmarkName.UNKNOWN, x=x, y=y, lane=place[0], station=place[1], street=StreetName.UNKNOWN
    )


def _streets(step: PlanStep) -> tuple[StreetName, ...]:
    return () if step.place is None or step.place.street is None else (step.place.street,)


def _carry_avoid(state: CoWizardState, view: CoWizardView, step: PlanStep) -> bool:
    if step.place is not None and step.place.street is not None:
        named = _named(view, step.place.street)
        state.route = state.route.keeping_off(state.town, named, view.lane)
        if state.beliefs.exact:
            plan_route(state, view)
            _report_only_way(state, step.place.street, named)
    return True


def _report_only_way(state: CoWizardState, street: StreetName, named: frozenset[int]) -> None:
    """Says that the route has to take a street that the car was to keep off."""
    lanes, progress = state.town.lanes, state.route.progress
    legs = () if progress is None else progress.legs[1:]
    if any(lanes[leg.lane].street in named and not lanes[leg.lane].in_junction for leg in legs):
        only = Proposition.of(Predicate.WILL, street=street)
        state.say(intend(Function.INFORM, only, wording=Wording(topic="only_way")))


_CARRY: Final[Mapping[StepAction, _Carry]] = MappingProxyType(
    {
        StepAction.TURN: _carry_turn,
        StepAction.STRAIGHT: _carry_straight,
        StepAction.LANE: _carry_lane,
        StepAction.U_TURN: _carry_u_turn,
        StepAction.STOP: _carry_stop,
        StepAction.GO: _carry_go,
        StepAction.FOLLOW: _carry_follow,
        StepAction.AVOID: _carry_avoid,
        StepAction.SPEED: _carry_speed,
        StepAction.LIGHTS: _carry_lights,
        StepAction.VISIT: _carry_visit,
        StepAction.WAIT: _carry_wait,
    }
)
