"""Navigation actions of the ego: whether they are feasible, and the paths that they lead to (compiled)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dorothie_gym.maps.model import HEIGHT, LEVEL_HEIGHT, WIDTH
from dorothie_gym.sim.ego.lane_ends import may_enter, may_merge
from dorothie_gym.sim.ego.limits import (
    EGO_MOVING,
    HALF_LENGTH,
    LANDING,
    LEAD,
    MANOEUVRE_PROP_GAP,
    MIN_SWITCH,
    PLANNED_BRAKING,
    SWITCH_TIME,
    U_TURN_REACH,
    U_TURN_SPEED,
    has_room_to_switch,
    is_past_stopping,
    u_turn_braking,
)
from dorothie_gym.sim.ego.manoeuvre_lanes import (
    LEAST_PATH,
    add_step,
    begin_steps,
    cross_junction,
    find_oncoming,
    find_turn,
    grow,
    lay_head,
    lay_pieces,
    take_course,
)
from dorothie_gym.sim.ego.path_builder import (
    enter,
    finish,
    follow,
    height_at_point,
    place_of_ego,
    point_before,
    position_on,
    project_on,
    value_on,
)
from dorothie_gym.sim.state.codes import (
    J_TURN,
    LANE_FOLLOW,
    LANE_SWITCH,
    NOBODY,
    START,
    STOP,
    U_TURN,
    Feasible,
    Refusal,
)
from dorothie_gym.support.compilation import compiled, inlined

if TYPE_CHECKING:
    from dorothie_gym.sim.state.town_arrays import TownArrays
    from dorothie_gym.sim.state.world_arrays import WorldArrays

LEFT = 90
"""Angle of a lane switch to the left [degrees]."""

BEGIN = 0
"""Number of the request for a new path; the others are numbers of `PhysicalAction`."""

SENT_ON = 8.0
"""Way for which Start passes lights and stop signs with `AutomaticBraking.PERCEIVED` [m]: about one car's place."""

LAST_PIECE = 0.5
"""End of a lane that is laid where nothing else is left [m]."""

_has_room_to_switch, _is_past_stopping = inlined(has_room_to_switch), inlined(is_past_stopping)
_u_turn_braking = inlined(u_turn_braking)


# --- Place on the path ------------------------------------------------------------------------------------------------


@compiled
def find_place(town: TownArrays, world: WorldArrays) -> None:
    """Sets the fields of the plan that follow from the path and the ego's place on it."""
    plan, car, course = world.plan[0], world.car[0], world.course
    at = point_before(world, car.s)
    point = course[at]
    lane = town.lanes[point.lane]
    ahead = 0.0 if point.manoeuvre else car.s - point.s
    plan.at, plan.lane, plan.off_line = at, point.lane, point.manoeuvre
    plan.height = height_at_point(town, world, at)
    plan.station = min(point.station + ahead, lane.length)
    plan.turning, plan.turn_at = False, math.inf
    if plan.action == J_TURN:
        junction = town.lanes[plan.connector].junction
        plan.turning = lane.junction < 0 or lane.junction != junction
        if plan.turning:
            first = at
            while first < plan.points and course[first].lane != plan.connector:
                first += 1
            if first < plan.points:
                plan.turn_at = course[first].s
    plan.choice = NOBODY
    k = at
    while k < plan.points and not (town.ways[course[k].lane].chooses and town.lanes[course[k].lane].junction < 0):
        k += 1
    if k < plan.points:
        last = int(plan.points) - 1  # a path around a block may visit the lane twice
        while course[last].lane != course[k].lane:
            last -= 1
        plan.choice = course[k].lane
        plan.choice_at = course[last].s + (town.lanes[plan.choice].length - course[last].station)
    elif plan.open_end:  # close to the end of a lane that ends beside a junction
        merge = town.ways[course[plan.points - 1].lane].merge
        if merge >= 0 and town.ways[merge].chooses:
            plan.choice, plan.choice_at = merge, plan.length


@compiled
def note_place(town: TownArrays, world: WorldArrays) -> None:
    """Updates the plan after the ego has moved along its path."""
    plan = world.plan[0]
    if plan.action > 0 and world.car[0].s >= plan.end:
        plan.action = plan.angle = 0
    find_place(town, world)
    if plan.off_line and plan.action == 0:
        _note_merge(town, world)


@compiled
def _note_merge(town: TownArrays, world: WorldArrays) -> None:
    """Makes the lane switch out of a lane that ends, which the ego has begun by itself, its present manoeuvre."""
    plan, course, k = world.plan[0], world.course, int(world.plan[0].at)
    while k + 1 < plan.points and course[k + 1].manoeuvre:
        k += 1
    left, right = town.lanes[plan.lane].left, town.lanes[plan.lane].right
    from_left = left >= 0 and town.ways[left].merge == plan.lane
    from_right = right >= 0 and town.ways[right].merge == plan.lane
    if course[k].s > world.car[0].s and (from_left or from_right):
        plan.action, plan.angle, plan.end = LANE_SWITCH, LEFT if from_right else -LEFT, course[k].s


@compiled
def is_committed(world: WorldArrays, speed: float) -> bool:
    """Returns whether the ego cannot stop any more before the junction of the planned turn, at a speed [m/s]."""
    plan = world.plan[0]
    return plan.turning and _is_past_stopping(speed, plan.turn_at - world.car[0].s - HALF_LENGTH)


# --- Feasibility ------------------------------------------------------------------------------------------------------


@compiled
def find_feasible(town: TownArrays, world: WorldArrays, speed: float) -> int:
    """Returns the flags of `codes.Feasible` at a speed [m/s]."""
    plan = world.plan[0]
    found = 0 if is_committed(world, speed) else Feasible.J_TURN
    if _is_busy(town, world):
        return found
    if found > 0 and (plan.held or plan.action > 0):
        found |= Feasible.LANE_FOLLOW
    if plan_switch(town, world, True, speed)[0] == Refusal.NONE:
        found |= Feasible.SWITCH_LEFT
    if plan_switch(town, world, False, speed)[0] == Refusal.NONE:
        found |= Feasible.SWITCH_RIGHT
    if plan_u_turn(town, world, speed)[0] == Refusal.NONE:
        found |= Feasible.U_TURN
    return found


@inlined
def _is_busy(town: TownArrays, world: WorldArrays) -> bool:
    """Returns whether the ego is off the centre lines or in a junction."""
    plan = world.plan[0]
    return plan.off_line or town.lanes[plan.lane].junction >= 0


@inlined
def _leads_nowhere(town: TownArrays, number: int, station: float) -> bool:
    """Returns whether a lane ends, and from a station [m] there is no room for a lane switch any more."""
    ways = town.ways[number]
    return bool(ways.exits == 0 and ways.merge < 0 and not _has_room_to_switch(town.lanes[number].length - station))


@compiled
def plan_switch(town: TownArrays, world: WorldArrays, left: bool, speed: float) -> tuple[int, int]:
    """Returns the answer to a request for a lane switch, and the lane to switch to."""
    plan = world.plan[0]
    lane = town.lanes[plan.lane]
    if _is_busy(town, world):
        return Refusal.IN_MANOEUVRE, -1
    target = lane.left if left else lane.right
    if target < 0:
        return Refusal.NO_LANE_LEFT if left else Refusal.NO_LANE_RIGHT, -1
    merges = target == town.ways[plan.lane].merge and may_merge(town, plan.lane, plan.station)
    enters = merges or may_enter(town, plan.lane, target, plan.station, speed)
    if not enters or not (merges or _has_room_to_switch(lane.length - plan.station)):
        return Refusal.NO_ROOM_LEFT if left else Refusal.NO_ROOM_RIGHT, -1
    if plan.props > 0:
        x, y = position_on(town.points, lane, plan.station)
        station, _ = project_on(town, target, x, y)
        way = LEAD + max(MIN_SWITCH, SWITCH_TIME * speed) + speed * speed / (2.0 * PLANNED_BRAKING)
        if _is_blocked(town, world, target, station - HALF_LENGTH, station + way + MANOEUVRE_PROP_GAP):
            return Refusal.PROP_LEFT if left else Refusal.PROP_RIGHT, -1
    return Refusal.NONE, target


@compiled
def plan_u_turn(town: TownArrays, world: WorldArrays, speed: float) -> tuple[int, int, float, float]:
    """Returns the answer to a request for a U-turn, lane and station where it ends, and station where it begins [m]."""
    plan = world.plan[0]
    lane, station = town.lanes[plan.lane], plan.station
    if _is_busy(town, world):
        return Refusal.IN_MANOEUVRE, -1, 0.0, 0.0
    if lane.inner >= 0 and not _leads_nowhere(town, plan.lane, station):
        return Refusal.NOT_LEFTMOST if town.sign > 0.0 else Refusal.NOT_RIGHTMOST, -1, 0.0, 0.0
    begin = station + LEAD * (speed > EGO_MOVING) + _u_turn_braking(speed, U_TURN_SPEED * U_TURN_SPEED)
    other, there = find_oncoming(town, plan.lane, min(begin, lane.length))
    if other >= 0:
        # just beyond a junction: begin later, so that the turn ends before the end of the oncoming lane
        short = LANDING - (town.lanes[other].length - there)
        if short > 0.0:
            begin += short
            other, there = find_oncoming(town, plan.lane, min(begin, lane.length))
    if other < 0:
        return Refusal.NO_ONCOMING, -1, 0.0, 0.0
    if speed > EGO_MOVING and begin - station + U_TURN_REACH > world.car[0].roadblock:
        return Refusal.PROP_AHEAD, -1, 0.0, 0.0
    if begin > lane.length + 0.5:
        return Refusal.NO_ROOM_TO_TURN, -1, 0.0, 0.0
    if _is_blocked(town, world, other, there - U_TURN_REACH, there + LANDING + MANOEUVRE_PROP_GAP):
        return Refusal.PROP_ONCOMING, -1, 0.0, 0.0
    return Refusal.NONE, other, there, min(begin, lane.length)


@compiled
def _is_blocked(town: TownArrays, world: WorldArrays, number: int, begin: float, end: float) -> bool:
    """Returns whether the ego sees a prop on a lane between two stations [m]."""
    points, lane = town.points, town.lanes[number]
    for k in range(world.plan[0].props):
        x, y, height = world.seen_props[k, 0], world.seen_props[k, 1], world.seen_props[k, 2]
        station, lateral = project_on(town, number, x, y)
        level = abs(value_on(points, lane, HEIGHT, station) - height) < LEVEL_HEIGHT
        if level and abs(lateral) < value_on(points, lane, WIDTH, station) / 2.0 and begin < station < end:
            return True
    return False


# --- Navigation actions -----------------------------------------------------------------------------------------------


@compiled
def request(
    town: TownArrays, world: WorldArrays, action: int, angle: int, speed: float, lane: int, station: float,
    offset: float,
) -> int:  # fmt: skip
    """Calls `command`, or `begin` for the action `BEGIN`: one entry from Python, which is compiled as a whole."""
    if action == BEGIN:
        return begin(town, world, lane, station, offset)
    return command(town, world, action, angle, speed)


@compiled
def begin(town: TownArrays, world: WorldArrays, lane: int, station: float, offset: float) -> int:
    """Lays a first path, or a new one for an ego that has left the current one, and drops the plan.

    Args:
        town: arrays of the town.
        world: arrays of the world.
        lane: lane of the ego.
        station: distance along it [m].
        offset: distance from it, positive right [m].

    Returns:
        `Refusal.NONE` or `Refusal.NO_SPACE`.
    """
    plan = world.plan[0]
    if not begin_steps(world, lane):
        return Refusal.NO_SPACE
    plan.lane, plan.station = lane, station
    return _replace(town, world, station, 0.0, 0, 0, -1, 0.0, 0, 0, -1, -1, True, offset)


@compiled
def extend(town: TownArrays, world: WorldArrays, speed: float) -> int:
    """Lengthens the path where only one exit leads on; called once per decision, with the speed [m/s]."""
    plan = world.plan[0]
    if plan.length - world.car[0].s >= LEAST_PATH or plan.open_end:
        return Refusal.NONE
    if not take_course(town, world):
        return Refusal.NO_SPACE
    return _lay_from_here(town, world, speed, plan.action, plan.angle, plan.connector, plan.exit)


@compiled
def command(town: TownArrays, world: WorldArrays, action: int, angle: int, speed: float) -> int:
    """Applies a navigation action.

    Args:
        town: arrays of the town.
        world: arrays of the world.
        action: number of a `PhysicalAction`.
        angle: degrees, positive left; for JTurn and LaneSwitch.
        speed: speed of the ego [m/s].

    Returns:
        A `Refusal`: the action was carried out, or nothing has changed.
    """
    plan = world.plan[0]
    if action == STOP or action == START:
        if plan.held == (action == STOP):
            return Refusal.STOPPED if plan.held else Refusal.NOT_STOPPED
        plan.held = action == STOP
        if action == START and world.car[0].attentive:
            world.car[0].sent = SENT_ON
        return Refusal.NONE
    answer = _change_path(town, world, action, angle, speed)
    if answer == Refusal.NONE:
        plan.held = False
    return answer


@compiled
def _change_path(town: TownArrays, world: WorldArrays, action: int, angle: int, speed: float) -> int:
    if action == LANE_FOLLOW:
        return _follow_lane(town, world, speed)
    if action == LANE_SWITCH:
        return _switch_lane(town, world, angle, speed)
    if action == U_TURN:
        return _turn_round(town, world, speed)
    if action == J_TURN:
        return _turn(town, world, angle, speed)
    return Refusal.NO_NAVIGATION


@compiled
def _follow_lane(town: TownArrays, world: WorldArrays, speed: float) -> int:
    plan = world.plan[0]
    if _is_busy(town, world):
        return Refusal.NONE if plan.held else Refusal.IN_MANOEUVRE
    if plan.action == 0 and not plan.held:
        return Refusal.FOLLOWING
    if is_committed(world, speed):
        return Refusal.COMMITTED
    if not begin_steps(world, plan.lane):
        return Refusal.NO_SPACE
    return _replace(town, world, plan.station, 0.0, 0, 0, -1, 0.0, 0, 0, -1, -1, False, 0.0)


@compiled
def _switch_lane(town: TownArrays, world: WorldArrays, angle: int, speed: float) -> int:
    if angle == 0:
        return Refusal.NO_SIDE
    answer, target = plan_switch(town, world, angle > 0, speed)
    if answer != Refusal.NONE:
        return answer
    plan = world.plan[0]
    if not (begin_steps(world, plan.lane) and add_step(world, target, True)):
        return Refusal.NO_SPACE
    side = LEFT if angle > 0 else -LEFT
    return _replace(town, world, plan.station, speed, 0, 0, -1, 0.0, LANE_SWITCH, side, -1, -1, False, 0.0)


@compiled
def _turn_round(town: TownArrays, world: WorldArrays, speed: float) -> int:
    answer, oncoming, station, start = plan_u_turn(town, world, speed)
    if answer != Refusal.NONE:
        return answer
    if not begin_steps(world, oncoming):
        return Refusal.NO_SPACE
    landing = min(station + 0.5, town.lanes[oncoming].length)
    return _replace(town, world, landing, 0.0, 0, 0, oncoming, start, U_TURN, 0, -1, -1, False, 0.0)


@compiled
def _turn(town: TownArrays, world: WorldArrays, angle: int, speed: float) -> int:
    plan = world.plan[0]
    _, _, free = _under_way(world)  # after the end of a manoeuvre in progress, lanes may be changed again
    if not cross_junction(town, world, plan.lane):
        return Refusal.NO_SPACE
    number = find_turn(town, world, free, angle)
    if number < 0:
        return Refusal.NO_CHOICE if number == -1 else Refusal.NO_SPACE
    way = town.exits[number]
    if plan.action == J_TURN and plan.connector == way.connector and plan.exit == way.lane and not plan.held:
        return Refusal.SAME_TURN
    if is_committed(world, speed):
        return Refusal.TURN_TOO_CLOSE
    return _lay_from_here(town, world, speed, J_TURN, way.angle, way.connector, way.lane)


# --- Laying the path --------------------------------------------------------------------------------------------------


@compiled
def _under_way(world: WorldArrays) -> tuple[int, int, float]:
    """Returns the points that remain of a lane switch or U-turn in progress, and the station where it ends [m]."""
    plan, course = world.plan[0], world.course
    first = int(plan.at)
    end = first
    while end < plan.points and course[end].manoeuvre:
        end += 1
    if end - first < 2:
        return 0, 0, plan.station
    # just after a U-turn, the lane continues at the same station; else the path would turn back
    landing = end if end < plan.points and course[end].lane == plan.lane else end - 1
    return first, end, course[landing].station


@compiled
def _lay_from_here(
    town: TownArrays, world: WorldArrays, speed: float, action: int, angle: int, connector: int, way_out: int
) -> int:
    """Replaces the path ahead of the ego; the rest of a lane switch or U-turn in progress is kept."""
    first, end, station = _under_way(world)
    return _replace(town, world, station, speed, first, end, -1, 0.0, action, angle, connector, way_out, False, 0.0)


@compiled
def _replace(
    town: TownArrays, world: WorldArrays, station: float, speed: float, first: int, end: int, oncoming: int,
    start: float, action: int, angle: int, connector: int, way_out: int, fresh: bool, offset: float,
) -> int:  # fmt: skip
    """Replaces path and plan.

    Args:
        town: arrays of the town.
        world: arrays of the world, with the first steps of the plan.
        station: start of the path on the first of them [m].
        speed: speed of the ego [m/s], which the length of lane switches depends on.
        first: first point of the current path that is kept, see `lay_head`.
        end: the point after the last one.
        oncoming: lane on which a U-turn ends, or -1.
        start: distance along the ego's lane at which the U-turn begins [m].
        action: manoeuvre of the new plan: number of a `PhysicalAction`, or 0.
        angle: angle of the manoeuvre [degrees].
        connector: connector of a turn, or -1.
        way_out: lane after that connector, or -1.
        fresh: whether the ego is at the start of the new path instead of on the current one.
        offset: distance of the ego from the new path then, positive right [m].

    Returns:
        `Refusal.NONE`, or `Refusal.NO_SPACE`; then nothing has changed.
    """
    plan, car, course = world.plan[0], world.car[0], world.course
    plan.early = action == LANE_SWITCH
    open_end = grow(town, world, station)
    x, y = (0.0, 0.0) if fresh else place_of_ego(world)
    laid = -1 if open_end < 0 else _lay(town, world, station, speed, first, end, oncoming, start, open_end > 0)
    if laid < 0:
        return Refusal.NO_SPACE
    plan.action, plan.angle, plan.connector, plan.exit = action, angle, connector, way_out
    if fresh:
        car.s, car.offset = 0.0 if laid > 0 else plan.length, offset
    else:
        enter(world, x, y)
    if action == J_TURN:
        plan.end, k = math.inf, 0
        while k < plan.points and course[k].lane != way_out:
            k += 1
        if k < plan.points:
            plan.end = course[k].s
    elif action > 0:
        k = int(plan.points) - 1
        while k >= 0 and not course[k].manoeuvre:
            k -= 1
        if k >= 0:
            plan.end = course[k].s
    find_place(town, world)
    return Refusal.NONE


@compiled
def _lay(
    town: TownArrays, world: WorldArrays, station: float, speed: float, first: int, end: int, oncoming: int,
    start: float, open_end: bool,
) -> int:  # fmt: skip
    """Lays a new path; its points are counted before. Arguments as those of `_replace`.

    Returns:
        1, 0 at the very end of a lane, where its last half metre is laid, and -1 if there is no room.
    """
    plan = world.plan[0]
    plan.needed = 2  # points of the last piece of a lane
    for write in (False, True):
        lay_head(town, world, first, end, oncoming, start, write)
        lay_pieces(town, world, station, speed, write)
        if plan.needed > len(world.course):
            return -1
        if not write:
            plan.points = 0
    whole = 1
    if plan.points < 2:
        whole, plan.points, length = 0, 0, town.lanes[plan.lane].length
        follow(town, world, plan.lane, length - LAST_PIECE, length, True)
    plan.open_end = open_end
    finish(world)
    return whole
