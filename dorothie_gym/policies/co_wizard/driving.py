"""Choice of the physical action: at most one per decision, from intentions, route and observation."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.maps.model import Exit, LinkType
from dorothie_gym.maps.routing import LaneEntry, Place
from dorothie_gym.maps.town import LightColour
from dorothie_gym.ontology.actions import LANE_SWITCH_LEFT, LANE_SWITCH_RIGHT, PhysicalAction
from dorothie_gym.ontology.slots import LandmarkName, ObjectClass
from dorothie_gym.policies.co_wizard.intentions import Wish
from dorothie_gym.policies.co_wizard.state import CoWizardState
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.feasibility import can_switch_lane, can_turn_round, slowing_distance, u_turn_start
from dorothie_gym.policies.route_legs import SAME_WAY
from dorothie_gym.policies.route_progress import (
    Choice,
    RouteJunction,
    default_lane_distance,
    default_lane_place,
    find_exit,
    lanes_beside,
    light_ahead,
    stopping_distance,
    streets_named,
)
from dorothie_gym.policies.scripted_agent_limits import reach_at, usual_cruise
from dorothie_gym.policies.turn_lanes import junction_meant
from dorothie_gym.session.spaces.actions import Physical
from dorothie_gym.sim.state.codes import Motion
from dorothie_gym.support.portable_math import wrap_degrees

if TYPE_CHECKING:
    from dorothie_gym.policies.co_wizard.state import CoWizardState
    from dorothie_gym.policies.co_wizard.view import CoWizardView

CRUISE_TOLERANCE = 2.6
"""Difference between actual and target cruise speed that is not corrected [km/h]; half a speed step of 5 km/h."""

STOP_MARGIN = 0.2
"""Distance by which Stop is commanded early rather than late [m]."""

AT_GOAL = 15.0
"""Distance to a goal within which a car that was sent on a little has arrived there [m]."""

JUNCTION_LENGTH = 25.0
"""Way through a junction in which the car does not stop on request [m]."""

STARTING = 3.0
"""Acceleration of a car that has just started [m/s^2]."""

CREEP_LEAD, CREEP_RENEW = 16.0, 6.0
"""The guessed place of a close goal is put so far ahead, and renewed when it is nearer than the second value [m]."""


def drive(state: CoWizardState, view: CoWizardView) -> Physical | None:
    """Chooses the physical action of this decision; None continues what the car is doing."""
    for consider in _CONCERNS if view.time >= state.commands.ready_at else _STOPS:
        action = consider(state, view)
        if action is not None:
            return action
    return None


def _stand(state: CoWizardState, view: CoWizardView) -> Physical | None:
    """Stops a car that is meant to stand."""
    if not state.intentions.halted or view.motion is Motion.STOPPED or _would_stop_in_junction(state, view):
        return None
    return _stop_unless_sent(state, view)


def _would_stop_in_junction(state: CoWizardState, view: CoWizardView) -> bool:
    """Returns whether a stop now would leave the car in a junction; a car that is guided to a place stops anyhow."""
    guided = state.beliefs.goal is not None and not state.beliefs.exact
    if guided or view.standing:
        return False
    if state.town.lanes[view.lane].in_junction:
        return True
    way, choice = stopping_distance(view.speed), view.choice
    crosses = choice is not None and view.manoeuvre is PhysicalAction.J_TURN
    return crosses and choice is not None and choice.distance < way < choice.distance + JUNCTION_LENGTH


def _stop_unless_sent(state: CoWizardState, view: CoWizardView) -> Physical | None:
    """Commands Stop, unless it was commanded a moment ago."""
    if view.time - state.commands.stop_sent_at < state.config.command_interval:
        return None
    state.commands = state.commands.after_stop(view.time)
    return Physical(action=PhysicalAction.STOP)


def _stop_at_place(state: CoWizardState, view: CoWizardView) -> Physical | None:
    """Stops at a place close ahead on the lane: the goal, or the end of a nudge."""
    if state.intentions.halted:
        return None
    nudge = state.intentions.nudge
    target = nudge or state.beliefs.stop_place
    if target is None:
        return None
    distance = distance_ahead(state, view, target)
    passed = distance is None or distance < -state.config.passed
    if passed and nudge is not None:
        state.intentions = state.intentions.without_nudge()
    if distance is None or passed:
        return None
    left = distance - stopping_distance(view.speed)
    later = left - _way_to_next_decision(state, view) if nudge is not None else left - view.speed * state.clock.interval
    if left + later > 2.0 * STOP_MARGIN:
        return None
    elsewhere = nudge is not None and state.beliefs.exact and not _is_at_goal(state, view)
    arrived = state.beliefs.goal is not None and not elsewhere
    state.intentions = state.intentions.stopped_at_place(arrived=arrived, sent_on=nudge is not None)
    state.commands = state.commands.after_stop(view.time)
    return Physical(action=PhysicalAction.STOP)


def _is_at_goal(state: CoWizardState, view: CoWizardView) -> bool:
    """Returns whether a goal on the map is close ahead or just behind."""
    place = state.beliefs.stop_place
    distance = None if place is None else distance_ahead(state, view, place)
    return distance is not None and abs(distance) < AT_GOAL


def _way_to_next_decision(state: CoWizardState, view: CoWizardView) -> float:
    """Returns by how much farther a car that is starting would stop if it were stopped one decision later [m]."""
    interval = state.clock.interval
    then = view.speed + STARTING * interval
    return (view.speed + then) / 2 * interval + stopping_distance(then) - stopping_distance(view.speed)


def distance_ahead(state: CoWizardState, view: CoWizardView, place: Place) -> float | None:
    """Returns the distance to a place along the default lanes [m]; None if it is not within sight on them."""
    return default_lane_distance(state.town, view.here, place, state.config.place_sight)


def _carry_out_wish(state: CoWizardState, view: CoWizardView) -> Physical | None:
    """Commands the manoeuvre that the participant requested as soon as it is feasible."""
    wish = state.intentions.wish
    if wish is None:
        return None
    if wish is Wish.U_TURN:
        if view.manoeuvre is PhysicalAction.U_TURN:
            state.intentions = state.intentions.without_wish()
            return None
        return _turn_round(state, view)
    if view.manoeuvre is PhysicalAction.LANE_SWITCH and state.intentions.wish_sent:
        state.intentions = state.intentions.without_wish()
        return None
    side = LinkType.LANE_CHANGE_LEFT if wish is Wish.SWITCH_LEFT else LinkType.LANE_CHANGE_RIGHT
    command = _switch(state, view, side)
    if command is not None:
        state.intentions = state.intentions.with_wish_sent()
    return command


def _turn_round(state: CoWizardState, view: CoWizardView) -> Physical | None:
    """Turns round, or first changes to the innermost lane, from which a U-turn begins."""
    lane = state.town.lanes[view.lane]
    waited = view.time - state.commands.manoeuvre_sent_at
    if lane.in_junction or view.manoeuvring or waited < state.config.command_interval:
        return None
    inwards = state.town.traffic.to_middle
    if state.town.neighbour(view.lane, inwards) is not None:
        if state.town.successors(view.lane) or can_switch_lane(state.town, view.lane, view.station, inwards):
            return _switch(state, view, inwards)
    if not can_turn_round(state.town, view.lane, u_turn_start(view.station, view.speed)):
        return None
    _note_manoeuvre(state, view)
    return Physical(action=PhysicalAction.U_TURN)


def _switch(state: CoWizardState, view: CoWizardView, side: LinkType) -> Physical | None:
    # a refused command is repeated at the next decision, because there is rarely much room
    waited = view.time - state.commands.manoeuvre_sent_at
    ready = not view.manoeuvring and waited >= state.clock.interval and not state.town.lanes[view.lane].in_junction
    if not ready or not can_switch_lane(state.town, view.lane, view.station, side):
        return None
    _note_manoeuvre(state, view)
    angle = LANE_SWITCH_LEFT if side is LinkType.LANE_CHANGE_LEFT else LANE_SWITCH_RIGHT
    return Physical(action=PhysicalAction.LANE_SWITCH, angle=int(angle))


def _note_manoeuvre(state: CoWizardState, view: CoWizardView) -> None:
    state.commands = state.commands.after_manoeuvre(view.time)
    state.intentions = state.intentions.resumed()


def _follow_route(state: CoWizardState, view: CoWizardView) -> Physical | None:
    """Commands the next lane change or U-turn of the route."""
    progress = state.route.progress
    if progress is None or state.intentions.halted or state.intentions.directive is not None or view.manoeuvring:
        return None
    manoeuvre = progress.next_manoeuvre(view.station)
    if manoeuvre is None:
        return None
    entry, distance = manoeuvre
    crossing = progress.next_crossing(state.town, view.station)
    if crossing is not None and crossing.distance < distance:
        return None
    if entry is LaneEntry.U_TURN:
        if not progress.turns_round_on(view.lane):
            return None
        held_up = view.standing and view.motion is Motion.HAZARD and view.hazard is ObjectClass.STATIC
        # never before the planned place, because the manoeuvre could otherwise end past its goal
        return _turn_round(state, view) if distance <= slowing_distance(view.speed) or held_up else None
    if not _needs_switch(state, view, crossing):
        return None
    side = LinkType.LANE_CHANGE_LEFT if entry is LaneEntry.CHANGE_LEFT else LinkType.LANE_CHANGE_RIGHT
    return _switch(state, view, side)


def _needs_switch(state: CoWizardState, view: CoWizardView, crossing: RouteJunction | None) -> bool:
    """Returns whether a lane change must be commanded; a turn from another lane includes its own lane change."""
    progress = state.route.to_goal
    if crossing is None or progress.changes_before(crossing) or view.choice is None:
        return True
    if progress.needs_switch(state.town, view.lane, view.station, crossing):
        return True
    return any(abs(wrap_degrees(way.angle - crossing.exit.angle)) <= SAME_WAY for way in view.choice.exits)


def junction_ahead(state: CoWizardState, view: CoWizardView) -> Choice | None:
    """Returns the next junction at which a turn can be meant: with a choice or, for an instructed turn, turn lanes."""
    directive = state.intentions.directive
    if directive is None or (view.choice is not None and directive.junction == view.choice.junction):
        return view.choice
    return junction_meant(state.town, view.here, view.choice)


def wanted_exit(state: CoWizardState, view: CoWizardView) -> Exit | None:
    """Returns the exit to take at the next junction with a choice: as instructed, else by the route, else None."""
    directive, choice = state.intentions.directive, junction_ahead(state, view)
    if choice is None:
        return None
    if directive is not None:
        streets = streets_named(view.raw["street_names"], directive.street)
        way = find_exit(state.town, choice, directive.direction, streets)
        if directive.skip > 0 or (way is None and directive.direction is None):
            straight = [option for option in choice.exits if option.type is LinkType.STRAIGHT]
            return straight[0] if straight else None
        return way
    if state.intentions.wish is Wish.U_TURN:
        return None
    progress = state.route.progress
    if progress is None:
        return _straight_on(state, choice)
    crossing = progress.next_crossing(state.town, view.station)
    if crossing is None or progress.changes_before(crossing):
        return None
    if crossing.lane == choice.lane or crossing.lane in lanes_beside(state.town, choice.lane):
        return crossing.exit
    return None


def _straight_on(state: CoWizardState, choice: Choice) -> Exit | None:
    """Returns the exit straight on for a guided car that has not asked and received no instruction in time."""
    intentions = state.intentions
    waits = intentions.pausing or intentions.creeping or state.dialogue.asked_lane == choice.lane
    if state.beliefs.goal is None or waits or choice.distance > state.config.straight_on_distance:
        return None
    return next((way for way in choice.exits if way.type is LinkType.STRAIGHT), None)


def _turn_lead(state: CoWizardState, view: CoWizardView) -> float:
    """Returns the distance to a junction at which a turn is commanded [m]."""
    return reach_at(state.config.turn_lead, view.speed, state.town)


def _turn(state: CoWizardState, view: CoWizardView) -> Physical | None:
    """Commands the turn at the next junction."""
    choice = junction_ahead(state, view)
    if state.intentions.halted or choice is None or state.intentions.nudge is not None:
        return None
    way = wanted_exit(state, view)
    if way is None or (choice.distance > _turn_lead(state, view) and view.motion is not Motion.WAITING):
        return None
    commands, turns = state.commands, view.manoeuvre is PhysicalAction.J_TURN
    set_already = turns and abs(view.angle - way.angle) < 1.0
    turn = (choice.lane, way.angle)
    again = commands.turn_sent != turn or view.time - commands.turn_sent_at > state.config.command_interval
    on_way = turns and commands.turn_sent == turn and view.motion is not Motion.WAITING
    if (set_already and view.motion is not Motion.STOPPED) or not again or on_way or view.manoeuvring:
        return None
    state.commands = commands.after_turn(turn, view.time)
    return Physical(action=PhysicalAction.J_TURN, angle=way.angle)


def rest(state: CoWizardState, view: CoWizardView, rng: np.random.Generator) -> None:
    """Decides, once for each hazard that holds up the car, whether to command a stop of limited duration."""
    commands, config = state.commands, state.config
    if view.motion is not Motion.HAZARD or state.standstill.since is None:
        state.commands = commands.with_rest_decided(commands.rest_decided and view.motion is Motion.STOPPED)
        return
    if commands.rest_decided or view.time - state.standstill.since < config.held_up_after:
        return
    state.commands = commands.with_rest_decided(True)
    if rng.random() < state.style.careful:
        red = view.hazard is ObjectClass.TRAFFIC_LIGHT
        until = view.time + (config.red_light_time if red else config.rest_time)
        state.commands = state.commands.resting(until, view.hazard)


def end_red_light_rest(state: CoWizardState, view: CoWizardView) -> None:
    """Ends the stop before a traffic light that is no longer red."""
    if state.commands.rest_for is not ObjectClass.TRAFFIC_LIGHT or view.time >= state.commands.rest_until:
        return
    if light_ahead(state.town, view.lane, view.station, view.time) in (None, LightColour.GREEN):
        state.commands = state.commands.rested(view.time)


def _rest(state: CoWizardState, view: CoWizardView) -> Physical | None:
    """Stops for the hazard for which this has been decided."""
    resting = view.time < state.commands.rest_until and view.motion is Motion.HAZARD
    if not resting or state.intentions.halted or view.manoeuvring:
        return None
    return Physical(action=PhysicalAction.STOP)


def _pause(state: CoWizardState, view: CoWizardView) -> Physical | None:
    """Stops before a junction after asking for the way, until the way is known."""
    intentions = state.intentions
    knows = (
        state.route.progress is not None
        or intentions.directive is not None
        or intentions.wish is not None
        or intentions.nudge is not None
    )
    if knows or intentions.creeping or view.choice is None:
        intentions = state.intentions = intentions.with_pause(False) if intentions.pausing else intentions
    if not intentions.pausing or intentions.halted or view.motion is Motion.STOPPED or view.choice is None:
        return None
    waited = view.time - state.commands.stop_sent_at
    if view.motion is Motion.WAITING and view.standing and waited > state.config.command_interval:
        return _stop_unless_sent(state, view)
    near = view.choice.distance - stopping_distance(view.speed) < state.config.pause_distance
    return None if not near or view.manoeuvring else _stop_unless_sent(state, view)


def _go(state: CoWizardState, view: CoWizardView) -> Physical | None:
    """Starts a car that stands without a reason."""
    intended = state.intentions.halted or state.intentions.pausing or view.time < state.commands.rest_until
    if intended or view.motion is not Motion.STOPPED:
        return None
    if state.town.lanes[view.lane].in_junction or view.manoeuvre is not None:
        return Physical(action=PhysicalAction.START)
    return Physical(action=PhysicalAction.LANE_FOLLOW)


def _turns_soon(state: CoWizardState, view: CoWizardView) -> bool:
    """Returns whether a turn is near for which this style slows down."""
    choice = junction_ahead(state, view)
    if not state.style.eases or choice is None or choice.distance > state.config.turn_ease_distance:
        return False
    way = wanted_exit(state, view)
    return way is not None and way.type in (LinkType.LEFT, LinkType.RIGHT)


def _goal_is_close(state: CoWizardState, view: CoWizardView) -> bool:
    """Returns whether the goal is so near that this style, or a car that has missed it before, approaches it slowly."""
    progress = state.route.progress
    if progress is None or not state.beliefs.exact:
        return False
    left = progress.left(view.station)
    if state.route.misses:
        return left < 2.0 * state.config.gentle_distance
    near = state.style.gentle and left < state.config.gentle_distance
    return near and progress.next_crossing(state.town, view.station) is None


def _set_speed_and_lights(state: CoWizardState, view: CoWizardView) -> Physical | None:
    """Adjusts cruise speed and headlights."""
    intentions = state.intentions
    if not state.town.lanes[view.lane].in_junction:
        if state.town.cruise is None and intentions.arrived:
            intentions = intentions.unhurried()
        intentions = state.intentions = intentions.on_lane(usual_cruise(state.town, view.lane, state.style.pace))
    if intentions.speed < intentions.usual and view.time > intentions.slow_until and not intentions.creeping:
        intentions = state.intentions = intentions.with_speed(intentions.usual)
    slowly = state.plan.stops_soon or _goal_is_close(state, view) or _turns_soon(state, view)
    wanted = min(intentions.speed, state.config.gentle_speed) if slowly else intentions.speed
    if abs(view.cruise - wanted) > CRUISE_TOLERANCE:
        return Physical(action=PhysicalAction.SPEED_CHANGE, up=view.cruise < wanted)
    if intentions.lights is not None and intentions.lights is not view.lights:
        return Physical(action=PhysicalAction.LIGHT_CHANGE, up=intentions.lights)
    return None


_STOPS = (_stop_at_place, _stand)
"""Reasons to stop, for which the Co-Wizard is always ready."""

_CONCERNS: tuple[Callable[[CoWizardState, CoWizardView], Physical | None], ...] = (
    *_STOPS,
    _carry_out_wish,
    _follow_route,
    _rest,
    _go,
    _turn,
    _pause,
    _set_speed_and_lights,
)
"""Reasons to act, the most important first."""


def creep(state: CoWizardState, view: CoWizardView) -> None:
    """Keeps the guessed place of a close goal ahead of the car, so that the car approaches slowly."""
    intentions, beliefs = state.intentions, state.beliefs
    if not intentions.creeping or beliefs.exact or intentions.halted or view.manoeuvre is PhysicalAction.U_TURN:
        return
    distance = distance_ahead(state, view, beliefs.place) if beliefs.place is not None else None
    if distance is None or distance < CREEP_RENEW:
        landmark = beliefs.goal or LandmarkName.UNKNOWN
        state.beliefs = beliefs.with_guess(landmark, default_lane_place(state.town, view.here, CREEP_LEAD))
