"""Navigator of the Co-Wizard's prompt: the route over the map to the goal, and the step that is due on it.

Its output depends only on the observation and the map, which the Co-Wizard knows. The model decides which steps to
take.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from dorothie_gym.maps.routing import LaneEntry, Place
from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.policies.feasibility import slowing_distance
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.route_legs import SAME_WAY
from dorothie_gym.policies.route_progress import (
    RouteJunction,
    RouteProgress,
    default_lane_distance,
    lanes_beside,
    stopping_distance,
)
from dorothie_gym.policies.route_state import RouteState
from dorothie_gym.sim.state.codes import Motion
from dorothie_gym.support.portable_math import wrap_degrees

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.policies.co_wizard.view import CoWizardView

TURN_LEAD = 85.0
"""Distance to a junction below which its turn is due [m], as for the scripted Co-Wizard."""

STOP_SIGHT = 80.0
"""Distance along the lanes ahead within which the place to stop at is looked for [m]."""

STOP_MARGIN = 0.2
"""Distance by which a stop is due early rather than late [m]."""

PASSED = 2.0
"""Distance behind the car at which a place counts as passed and is no longer stopped at [m]."""

REPLAN_AFTER = 2
"""Decisions off the route after which another one is planned."""


@dataclass(frozen=True, kw_only=True)
class RouteStep:
    """Next step on the route.

    Attributes:
        action: the action.
        angle: turn angle, or 90 and -90 for a lane switch [degrees, positive left].
        distance: distance to where it takes place [m].
        due: whether it must be commanded now.
        place: lane, which distinguishes steps of one kind.
    """

    action: PhysicalAction
    angle: int = 0
    distance: float
    due: bool
    place: int

    @property
    def key(self) -> tuple[int, int, int]:
        """Identity of the step."""
        return int(self.action), self.angle, self.place


@dataclass(frozen=True, kw_only=True)
class Navigator:
    """Route to the place of the goal.

    Attributes:
        goal: lane and station of the goal [m]; None without one, or if its place is unknown.
        route: the route, and the places that it avoids.
        blocked_at: time at which a blocked road was last noted [s].
    """

    goal: Place | None = None
    route: RouteState = RouteState()
    blocked_at: float = -math.inf

    def to(self, town: Town, view: CoWizardView, goal: Place | None) -> Navigator:
        """Plans a route to another place, or gives the route up (None); roadblocks stay known."""
        if goal is None:
            return replace(self, goal=None, route=self.route.with_progress(None))
        route = self.route.for_new_goal()
        progress = RouteProgress.plan(town, view.here, goal, route.closed)
        return replace(self, goal=goal, route=route.with_progress(progress))

    def followed(self, town: Town, view: CoWizardView) -> Navigator:
        """Updates the progress with the place of the car, and plans another route if it has left the previous one."""
        navigator = self._past_roadblocks(town, view)
        route = navigator.route
        if route.progress is None or view.manoeuvring:
            return navigator
        former = route.progress
        before = former.left(view.station)
        left = former.followed(town, view.lane, view.station)
        route = route.with_progress(left)
        if left.astray >= REPLAN_AFTER:
            route = route.replanned(town, view.here)
            if route.has_missed(before, view.station):
                route = route.after_miss(town, view.here, left)
        return replace(navigator, route=route)

    def _past_roadblocks(self, town: Town, view: CoWizardView) -> Navigator:
        """Records an obstacle on the car's lane, and plans around it."""
        held_up = view.standing and view.motion is Motion.HAZARD and view.hazard is ObjectClass.STATIC
        if not held_up:
            return self
        ahead = float(view.raw["hazard_distance"][0])
        place = view.lane, min(view.station + ahead, town.lanes[view.lane].length)
        if self.route.knows_roadblock(place):
            return self
        route = self.route.with_roadblock(town, place)
        if route.progress is not None:
            route = route.replanned(town, view.here)
        return replace(self, route=route, blocked_at=view.time)

    @property
    def arrives(self) -> bool:
        """Returns whether there is a route."""
        return self.route.progress is not None and self.route.progress.route is not None

    def left(self, view: CoWizardView) -> float:
        """Returns the distance to the goal along the route [m]; infinite without a route."""
        return math.inf if self.route.progress is None else self.route.progress.left(view.station)

    def step(self, town: Town, view: CoWizardView, interval: float, delay: float) -> RouteStep | None:
        """Returns the next step; None without a route.

        Args:
            town: the map.
            view: observation.
            interval: time between decisions [s].
            delay: time that the answer of the model takes [s of the session].
        """
        stop = self._stop(town, view, interval, delay)
        if stop is not None:
            return stop
        progress = self.route.progress
        if progress is None or not self.arrives:
            return None
        crossing = progress.next_crossing(town, view.station)
        manoeuvre = progress.next_manoeuvre(view.station)
        if manoeuvre is not None and (crossing is None or manoeuvre[1] <= crossing.distance):
            entry, distance = manoeuvre
            if entry is LaneEntry.U_TURN:
                return self._u_turn(town, view, distance)
            if self._needs_switch(town, view, crossing):
                side = 90 if entry is LaneEntry.CHANGE_LEFT else -90
                return _switch(view, side, distance, due=not view.manoeuvring)
        if crossing is None:
            return RouteStep(
                action=PhysicalAction.STOP, distance=progress.left(view.station), due=False, place=view.lane
            )
        return self._turn(town, view, crossing)

    def _stop(self, town: Town, view: CoWizardView, interval: float, delay: float) -> RouteStep | None:
        """Returns the stop at the goal if it is ahead on the default lanes with no other step before it."""
        if self.goal is None or view.motion is Motion.STOPPED or view.manoeuvring:
            return None
        distance = default_lane_distance(town, view.here, self.goal, STOP_SIGHT)
        if distance is None or distance < -PASSED:
            return None
        left = distance - stopping_distance(view.speed) - view.speed * delay
        later = left - view.speed * interval
        return RouteStep(
            action=PhysicalAction.STOP,
            distance=distance,
            due=left + later <= 2.0 * STOP_MARGIN,
            place=self.goal[0],
        )

    def _u_turn(self, town: Town, view: CoWizardView, distance: float) -> RouteStep:
        progress = self.route.to_goal
        held_up = view.standing and view.motion is Motion.HAZARD and view.hazard is ObjectClass.STATIC
        due = not view.manoeuvring and (distance <= slowing_distance(view.speed) or held_up)
        if due and town.neighbour(view.lane, town.traffic.to_middle) is not None:
            return _switch(view, 90 * town.traffic.sign, 0.0, due=True)
        due = due and progress.turns_round_on(view.lane)
        return RouteStep(action=PhysicalAction.U_TURN, distance=max(distance, 0.0), due=due, place=view.lane)

    def _needs_switch(self, town: Town, view: CoWizardView, crossing: RouteJunction | None) -> bool:
        """Returns whether a lane change must be commanded; a turn from another lane includes its own lane change."""
        progress = self.route.to_goal
        if crossing is None or progress.changes_before(crossing) or view.choice is None:
            return True
        if progress.needs_switch(town, view.lane, view.station, crossing):
            return True
        return any(abs(wrap_degrees(way.angle - crossing.exit.angle)) <= SAME_WAY for way in view.choice.exits)

    def _turn(self, town: Town, view: CoWizardView, crossing: RouteJunction) -> RouteStep:
        choice, angle = view.choice, crossing.exit.angle
        here = choice is not None and (crossing.lane == choice.lane or crossing.lane in lanes_beside(town, choice.lane))
        prepared = view.manoeuvre is PhysicalAction.J_TURN and abs(view.angle - angle) < 1.0
        waiting = view.motion is Motion.WAITING
        due = here and not prepared and not view.manoeuvring and (crossing.distance <= TURN_LEAD or waiting)
        return RouteStep(
            action=PhysicalAction.J_TURN, angle=angle, distance=crossing.distance, due=due, place=crossing.lane
        )


def _switch(view: CoWizardView, side: int, distance: float, *, due: bool) -> RouteStep:
    return RouteStep(action=PhysicalAction.LANE_SWITCH, angle=side, distance=distance, due=due, place=view.lane)
