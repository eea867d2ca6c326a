"""Next step on the route to the participant's target: a turn, a U-turn, a lane switch, or driving on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.maps.routing import LaneEntry
from dorothie_gym.ontology.slots import ActionValue
from dorothie_gym.policies.participant.standstill import is_blocked_ahead
from dorothie_gym.policies.participant.state import ParticipantState, StepKey
from dorothie_gym.policies.route_progress import RouteJunction, RouteProgress
from dorothie_gym.policies.turn_lanes import next_turn, turn_lanes

if TYPE_CHECKING:
    from dorothie_gym.policies.participant.view import ParticipantView


@dataclass(frozen=True, kw_only=True)
class RouteStep:
    """Next step on the route to the target.

    Attributes:
        key: identity.
        distance: distance to it [m].
        action: action that it requires of the car.
        direction: direction of a turn or lane switch; None for others.
        junction: junction of a turn; None for others.
    """

    key: StepKey
    distance: float
    action: ActionValue
    direction: Direction | None = None
    junction: RouteJunction | None = None


def is_last_stretch(state: ParticipantState, view: ParticipantView) -> bool:
    """Returns whether there is a route without any further junction or manoeuvre before the target."""
    progress = state.route.progress
    if progress is None or progress.route is None:
        return False
    ahead = progress.next_crossing(state.town, view.station), progress.next_manoeuvre(view.station)
    return ahead == (None, None)


def route_step(state: ParticipantState, view: ParticipantView) -> RouteStep | None:
    """Returns the next step on the route; None without a place to go to."""
    progress, town = state.route.progress, state.town
    if progress is None:
        return None
    crossing, manoeuvre = next_turn(progress, town, view.station), progress.next_manoeuvre(view.station)
    nearer = manoeuvre is not None and (crossing is None or manoeuvre[1] < crossing.distance)
    if nearer and manoeuvre is not None and manoeuvre[0] is LaneEntry.U_TURN:
        return RouteStep(key=("round", 0, 0), distance=manoeuvre[1], action=ActionValue.U_TURN)
    switch = nearer and (crossing is None or _needs_switch(progress, state, view, crossing))
    if crossing is not None and not switch:
        straight = crossing.direction is Direction.STRAIGHT
        return RouteStep(
            key=("turn", crossing.lane, crossing.exit.connector),
            distance=crossing.distance,
            action=ActionValue.LANE_FOLLOW if straight else ActionValue.J_TURN,
            direction=crossing.direction,
            junction=crossing,
        )
    if manoeuvre is not None and manoeuvre[0] is not LaneEntry.U_TURN:
        left = manoeuvre[0] is LaneEntry.CHANGE_LEFT
        return RouteStep(
            key=("lane", view.lane, int(left)),
            distance=manoeuvre[1],
            action=ActionValue.LANE_SWITCH,
            direction=Direction.LEFT if left else Direction.RIGHT,
        )
    left_over = progress.left(view.station)
    return RouteStep(key=("on", view.lane, 0), distance=left_over, action=ActionValue.LANE_FOLLOW)


def _needs_switch(
    progress: RouteProgress, state: ParticipantState, view: ParticipantView, crossing: RouteJunction
) -> bool:
    """Returns whether a lane change before a junction needs an instruction; "turn left" includes one to a turn lane."""
    if crossing.lane in turn_lanes(state.town):
        return crossing.direction is Direction.STRAIGHT or is_blocked_ahead(state, view)
    return progress.needs_switch(state.town, view.lane, view.station, crossing)
