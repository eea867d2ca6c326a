"""From beliefs to one physical action a decision."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from dorothie_gym.maps.lane_neighbours import oncoming_lanes
from dorothie_gym.maps.model import Exit, LinkType, wrap_degrees
from dorothie_gym.maps.routing import Entry, Place
from dorothie_gym.maps.traffic_lights import LightColour
from dorothie_gym.ontology import LandmarkName, ObjectClass, PhysicalAction
from dorothie_gym.policies.co_wizard.state import CoWizardState, Wish
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.route_progress import (
    BRAKING,
    SAME_WAY,
    SWITCH_ROOM,
    U_TURN_SPEED_SQUARED,
    Choice,
    RouteJunction,
    find_exit,
    lanes_ahead,
    lanes_beside,
    light_ahead,
    stopping_distance,
    streets_named,
    way_ahead,
)
from dorothie_gym.spaces import Motion, Physical

DECISION = 0.5
"""Time between decisions [s]."""

TURN_LEAD = 85.0
"""A turn is commanded when the junction is this near [m]."""

PASSED = 2.0
"""A place that lies farther behind than this will not be stopped at any more [m]."""

PATIENCE = 2.0
"""A command that has shown no effect is given again after this time [s]."""


UNLESS_TOLD = 24.0
"""A car that is guided goes straight on where it has not been told otherwise until it is this near [m]."""

PAUSE_BEFORE = 8.0
"""A car that does not know the way stops this far before a junction [m]."""

GENTLE = 20
"""Speed at which the gentle come up to a place, and those who ease into turns [km/h]."""

EASE_WITHIN = 40.0
"""Who eases into turns slows down when the junction is this near [m]."""

GENTLE_WITHIN = 70.0
"""Who drives gently comes up slowly to a place on the map from here on, if no junction comes before it [m]."""


HELD_UP = 0.4
"""A hazard that stops the car for longer than this holds it up [s]."""

SIGHT = 80.0
"""So far a place is looked for along the lanes ahead [m]."""

REST = 4.0
"""So long it stands when it has stopped for good for something in the way [s]."""

LONGEST_RED = 45.0
"""Who has stopped for a red light goes on after this time at the latest [s]."""


def drive(mind: CoWizardState, view: CoWizardView) -> Physical | None:
    """Chooses the physical action of this decision; None leaves the car to what it is doing."""
    for consider in _CONCERNS:
        action = consider(mind, view)
        if action is not None:
            return action
    return None


def _stand(mind: CoWizardState, view: CoWizardView) -> Physical | None:
    if not mind.halted or view.motion is Motion.STOPPED or view.time - mind.stop_sent_at < PATIENCE:
        return None
    mind.stop_sent_at = view.time
    return Physical(action=PhysicalAction.STOP)


def _stop_at_place(mind: CoWizardState, view: CoWizardView) -> Physical | None:
    """Stops at a place on the lane that is close ahead: the goal, or a few metres further."""
    if mind.halted:
        return None
    target = mind.nudge or (mind.place if mind.exact else None)
    if target is None:
        return None
    distance = distance_ahead(mind, view, target)
    if mind.nudge is not None and (distance is None or distance < -PASSED):
        mind.nudge = None
        return None
    if distance is None or distance < -PASSED:
        return None
    left = distance - stopping_distance(view.speed)
    if left > view.speed * DECISION / 2 + 0.2:
        return None
    mind.halted, mind.nudge = True, None
    mind.arrived = mind.goal is not None
    mind.stop_sent_at = view.time
    return Physical(action=PhysicalAction.STOP)


def distance_ahead(mind: CoWizardState, view: CoWizardView, place: Place) -> float | None:
    """How far a place is along the lanes that the car takes by default [m]; None if it is not on them in `SIGHT`."""
    return way_ahead(mind.town, view.here, place, SIGHT)


def place_ahead(mind: CoWizardState, view: CoWizardView, distance: float) -> Place:
    """The place some way ahead by default; the end of the last lane if a junction comes before [m]."""
    left = view.station + distance
    lanes = lanes_ahead(mind.town, view.lane, view.station, distance)
    for lane in lanes[:-1]:
        if left <= mind.town.lanes[lane].length:
            return lane, left
        left -= mind.town.lanes[lane].length
    return lanes[-1], min(left, mind.town.lanes[lanes[-1]].length)


def _wish(mind: CoWizardState, view: CoWizardView) -> Physical | None:
    if mind.wish is None:
        return None
    if mind.wish is Wish.U_TURN:
        if view.manoeuvre is PhysicalAction.U_TURN:
            mind.wish = None
            return None
        return turn_round(mind, view)
    side = LinkType.LANE_CHANGE_LEFT if mind.wish is Wish.SWITCH_LEFT else LinkType.LANE_CHANGE_RIGHT
    return _switch(mind, view, side)


def turn_round(mind: CoWizardState, view: CoWizardView) -> Physical | None:
    """Turns round as soon as it can be done, moving to the leftmost lane before."""
    lane = mind.town.lanes[view.lane]
    if lane.in_junction or view.manoeuvring or view.time - mind.commanded_at < PATIENCE:
        return None
    if mind.town.neighbour(view.lane, LinkType.LANE_CHANGE_LEFT) is not None:
        return _switch(mind, view, LinkType.LANE_CHANGE_LEFT)
    begin = view.station + max(0.0, view.speed**2 - U_TURN_SPEED_SQUARED) / (2 * BRAKING) + (view.speed > 0.5)
    if oncoming_lanes(mind.town).at(view.lane, min(begin, lane.length)) is None:
        return None
    mind.commanded_at, mind.halted = view.time, False
    return Physical(action=PhysicalAction.U_TURN)


def _switch(mind: CoWizardState, view: CoWizardView, side: LinkType) -> Physical | None:
    lane = mind.town.lanes[view.lane]
    # one that is refused is given again at once: there is seldom much room
    ready = not view.manoeuvring and view.time - mind.commanded_at >= DECISION and not lane.in_junction
    possible = mind.town.neighbour(view.lane, side) is not None and lane.length - view.station > SWITCH_ROOM
    if not ready or not possible:
        return None
    if mind.wish is not Wish.U_TURN:
        mind.wish = None
    mind.commanded_at, mind.halted = view.time, False
    return Physical(action=PhysicalAction.LANE_SWITCH, angle=90 if side is LinkType.LANE_CHANGE_LEFT else -90)


def _manoeuvre(mind: CoWizardState, view: CoWizardView) -> Physical | None:
    """The lane change or U-turn that the own plan has next."""
    if mind.journey is None or mind.halted or mind.directive is not None or view.manoeuvring:
        return None
    manoeuvre = mind.journey.next_manoeuvre(view.station)
    if manoeuvre is None:
        return None
    entry, distance = manoeuvre
    crossing = mind.journey.next_crossing(mind.town, view.station)
    if crossing is not None and crossing.distance < distance:
        return None
    if entry is Entry.U_TURN:
        reach = max(view.speed**2 - U_TURN_SPEED_SQUARED, 0.0) / (2 * BRAKING)
        if not mind.journey.turns_round_on(view.lane):
            return None
        held_up = view.standing and view.motion is Motion.HAZARD and view.hazard is ObjectClass.STATIC
        # never before the planned place, lest the car come out behind its goal
        return turn_round(mind, view) if distance <= reach or held_up else None
    if not _needs_switch(mind, view, crossing):
        return None
    return _switch(mind, view, LinkType.LANE_CHANGE_LEFT if entry is Entry.CHANGE_LEFT else LinkType.LANE_CHANGE_RIGHT)


def _needs_switch(mind: CoWizardState, view: CoWizardView, crossing: RouteJunction | None) -> bool:
    """Whether a lane change has to be commanded: a turn that no exit of the own lane offers brings its own along."""
    assert mind.journey is not None
    if crossing is None or mind.journey.changes_before(crossing) or view.choice is None:
        return True
    if mind.journey.needs_switch(mind.town, view.lane, view.station, crossing):
        return True
    return any(abs(wrap_degrees(way.angle - crossing.exit.angle)) <= SAME_WAY for way in view.choice.exits)


def wanted_exit(mind: CoWizardState, view: CoWizardView) -> Exit | None:
    """The exit to take at the next junction with a choice: as asked for, else by the plan; None if neither tells."""
    choice = view.choice
    if choice is None:
        return None
    if mind.directive is not None:
        directive = mind.directive
        streets = streets_named(view.raw["street_names"], directive.street)
        way = find_exit(mind.town, choice, directive.direction, streets)
        if directive.skip > 0 or (way is None and directive.direction is None):
            straight = [option for option in choice.exits if option.type is LinkType.STRAIGHT]
            return straight[0] if straight else None
        return way
    if mind.wish is Wish.U_TURN:
        return None
    if mind.journey is None:
        return _straight_on(mind, choice)
    crossing = mind.journey.next_crossing(mind.town, view.station)
    if crossing is None or mind.journey.changes_before(crossing):
        return None
    if crossing.lane == choice.lane or crossing.lane in lanes_beside(mind.town, choice.lane):
        return crossing.exit
    return None


def _straight_on(mind: CoWizardState, choice: Choice) -> Exit | None:
    """The way on for a car that is being guided, has not asked, and has not been told otherwise in time."""
    guided = mind.goal is not None and not mind.pausing and not mind.creeping and mind.asked != choice.lane
    if not guided or choice.distance > UNLESS_TOLD:
        return None
    return next((way for way in choice.exits if way.type is LinkType.STRAIGHT), None)


def _turn(mind: CoWizardState, view: CoWizardView) -> Physical | None:
    if mind.halted or view.choice is None or mind.nudge is not None:
        return None
    way = wanted_exit(mind, view)
    if way is None or (view.choice.distance > TURN_LEAD and view.motion is not Motion.WAITING):
        return None
    set_already = view.manoeuvre is PhysicalAction.J_TURN and abs(view.angle - way.angle) < 1.0
    sent = (view.choice.lane, way.angle)
    again = mind.turn_sent != sent or view.time - mind.turn_sent_at > PATIENCE
    on_way = view.manoeuvre is PhysicalAction.J_TURN and mind.turn_sent == sent and view.motion is not Motion.WAITING
    if (set_already and view.motion is not Motion.STOPPED) or not again or on_way or view.manoeuvring:
        return None
    mind.turn_sent, mind.turn_sent_at = sent, view.time
    return Physical(action=PhysicalAction.J_TURN, angle=way.angle)


def rest(mind: CoWizardState, view: CoWizardView, rng: np.random.Generator) -> None:
    """Decides, once for each time that something holds up the car for long, whether to stop for good meanwhile."""
    if view.motion is not Motion.HAZARD or mind.standing_since is None:
        mind.rested = mind.rested and view.motion is Motion.STOPPED
        return
    if mind.rested or view.time - mind.standing_since < HELD_UP:
        return
    mind.rested = True
    if rng.random() < mind.style.careful:
        red = view.hazard is ObjectClass.TRAFFIC_LIGHT
        mind.rest_until, mind.rest_for = view.time + (LONGEST_RED if red else REST), view.hazard


def see_green(mind: CoWizardState, view: CoWizardView) -> None:
    """Ends the stop before a traffic light that is red no more."""
    if mind.rest_for is not ObjectClass.TRAFFIC_LIGHT or view.time >= mind.rest_until:
        return
    if light_ahead(mind.town, view.lane, view.station, view.time) in (None, LightColour.GREEN):
        mind.rest_until = view.time


def _rest(mind: CoWizardState, view: CoWizardView) -> Physical | None:
    """Stops for good while something is in the way that it has said to stop for."""
    if view.time >= mind.rest_until or mind.halted or view.motion is not Motion.HAZARD or view.manoeuvring:
        return None
    return Physical(action=PhysicalAction.STOP)


def _pause(mind: CoWizardState, view: CoWizardView) -> Physical | None:
    """Stops before a junction at which it has asked for the way, until it knows one."""
    knows = mind.journey is not None or mind.directive is not None or mind.wish is not None or mind.nudge is not None
    if knows or mind.creeping or view.choice is None:
        mind.pausing = False
    if not mind.pausing or mind.halted or view.motion is Motion.STOPPED or view.choice is None:
        return None
    if view.motion is Motion.WAITING and view.standing and view.time - mind.stop_sent_at > PATIENCE:
        mind.stop_sent_at = view.time
        return Physical(action=PhysicalAction.STOP)
    near = view.choice.distance - stopping_distance(view.speed) < PAUSE_BEFORE
    if not near or view.manoeuvring or view.time - mind.stop_sent_at < PATIENCE:
        return None
    mind.stop_sent_at = view.time
    return Physical(action=PhysicalAction.STOP)


def _go(mind: CoWizardState, view: CoWizardView) -> Physical | None:
    if mind.halted or mind.pausing or view.motion is not Motion.STOPPED or view.time < mind.rest_until:
        return None
    if mind.town.lanes[view.lane].in_junction or view.manoeuvre is not None:
        return Physical(action=PhysicalAction.START)
    return Physical(action=PhysicalAction.LANE_FOLLOW)


def _turns_soon(mind: CoWizardState, view: CoWizardView) -> bool:
    """Whether a turn to a side comes up that a driver of this style slows down for by himself."""
    if not mind.style.eases or view.choice is None or view.choice.distance > EASE_WITHIN:
        return False
    way = wanted_exit(mind, view)
    return way is not None and way.type in (LinkType.LEFT, LinkType.RIGHT)


def _close(mind: CoWizardState, view: CoWizardView) -> bool:
    """Whether the goal is so near that who drives gently, or has driven past it before, comes up to it slowly."""
    if mind.journey is None or not mind.exact:
        return False
    left = mind.journey.left(view.station)
    if mind.misses:
        return left < 2.0 * GENTLE_WITHIN
    return mind.style.gentle and left < GENTLE_WITHIN and mind.journey.next_crossing(mind.town, view.station) is None


def _comfort(mind: CoWizardState, view: CoWizardView) -> Physical | None:
    if mind.speed < mind.usual and view.time > mind.slow_until and not mind.creeping:
        mind.speed = mind.usual
    wanted = min(mind.speed, GENTLE) if _close(mind, view) or _turns_soon(mind, view) else mind.speed
    if abs(view.cruise - wanted) > 2.6:
        return Physical(action=PhysicalAction.SPEED_CHANGE, up=view.cruise < wanted)
    if mind.lights is not None and mind.lights is not view.lights:
        return Physical(action=PhysicalAction.LIGHT_CHANGE, up=mind.lights)
    return None


_CONCERNS: tuple[Callable[[CoWizardState, CoWizardView], Physical | None], ...] = (
    _stop_at_place,
    _stand,
    _wish,
    _manoeuvre,
    _rest,
    _go,
    _turn,
    _pause,
    _comfort,
)


def creep(mind: CoWizardState, view: CoWizardView) -> None:
    """Carries the guess of a place along that must be close, so that the car comes up to it slowly."""
    if not mind.creeping or mind.exact or mind.halted or view.manoeuvre is PhysicalAction.U_TURN:
        return
    landmark = mind.goal or LandmarkName.UNKNOWN
    distance = distance_ahead(mind, view, mind.place) if mind.place is not None else None
    if distance is None or distance < 6.0:
        mind.note_place(landmark, place_ahead(mind, view, 16.0))
