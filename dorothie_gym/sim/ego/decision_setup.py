"""Preparation of the substeps of a decision, and the ego's view after them (compiled).

The path is lengthened, and the stretch of it around the ego is written for the motion control, with goals, cruise speed
and manoeuvre.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dorothie_gym.sim.ego.limits import KMH, cruise_by_limit
from dorothie_gym.sim.ego.manoeuvres import extend
from dorothie_gym.sim.ego.path import find_sweeps
from dorothie_gym.sim.ego.path_builder import find_end, point_before, position_on, project_on
from dorothie_gym.sim.sensing.perception import see
from dorothie_gym.sim.state.codes import STATIC, Refusal
from dorothie_gym.sim.traffic.parameters import CAR_LENGTH, CAR_WIDTH
from dorothie_gym.support.compilation import compiled, inlined

if TYPE_CHECKING:
    from dorothie_gym.sim.state.town_arrays import TownArrays
    from dorothie_gym.sim.state.world_arrays import WorldArrays

PATH_BEHIND, PATH_AHEAD = 12.0, 150.0
"""Minimum stretch of path behind and ahead of the ego that is written for the motion control [m]."""

_cruise_by_limit = inlined(cruise_by_limit)

PASSED = 1.0
"""Distance at which a place on the path or beyond the end of a lane is left out [m]."""


@compiled
def prepare(town: TownArrays, world: WorldArrays) -> int:
    """Prepares the substeps of a decision; returns `Refusal.NONE` or `Refusal.NO_SPACE`."""
    plan, car = world.plan[0], world.car[0]
    answer = extend(town, world, world.vehicles[0].speed)
    if answer != Refusal.NONE:
        return answer
    if plan.written != plan.version:
        find_goals(town, world)
        car.stop_at = find_end(world)
        plan.written = plan.version
        write_window(world)
    elif plan.written_until < min(car.s + PATH_AHEAD, plan.length):
        write_window(world)
    lane = town.lanes[plan.lane]
    if plan.follows and lane.junction < 0:
        plan.cruise = _cruise_by_limit(lane.limit)
    car.action, car.action_end, car.cruise, car.held = plan.action, plan.end, plan.cruise * KMH, plan.held
    car.manual = plan.manual
    if plan.manual:
        car.throttle, car.steer, car.brake = plan.throttle, plan.steer, plan.brake
    return Refusal.NONE


@compiled
def write_window(world: WorldArrays) -> None:
    """Writes the stretch of the path around the ego for the motion control, and the lanes along it."""
    plan, car, course = world.plan[0], world.car[0], world.course
    first = point_before(world, car.s - PATH_BEHIND)
    end = min(int(plan.points), first + len(world.sweeps))
    car.runs = 0
    for k in range(first, end):
        if (k == first or course[k].lane != course[k - 1].lane) and car.runs < len(car.run_lane):
            car.run_lane[car.runs], car.run_first[car.runs] = course[k].lane, k
            car.runs += 1
    find_sweeps(course, world.sweeps, first, end, CAR_LENGTH, CAR_WIDTH)
    car.run, car.first, car.points, car.at = -1, first, end, point_before(world, car.s)
    plan.written_until = course[end - 1].s


# --- Goals ------------------------------------------------------------------------------------------------------------


@compiled
def find_goals(town: TownArrays, world: WorldArrays) -> None:
    """Finds the places of the goals along the path, those on lanes beside it included, nearest first."""
    plan, car = world.plan[0], world.car[0]
    car.goals = 0
    for g in range(plan.goals):
        goal = world.goals[g]
        x, y = position_on(town.points, town.lanes[goal.lane], goal.station)
        ways = town.ways[goal.lane]
        for k in range(ways.beside, ways.beside + ways.besides):
            lane, station = town.lane_lists[k], goal.station
            if lane != goal.lane:
                station, _ = project_on(town, lane, x, y)
            place = place_on_path(world, lane, station)
            if car.s - PASSED <= place < math.inf:
                insert(world, place)


@compiled
def insert(world: WorldArrays, place: float) -> None:
    """Inserts a place into the sorted list of goals along the path; if the list is full, the farthest is dropped."""
    car = world.car[0]
    k = int(car.goals)
    if k < len(car.goal):
        car.goals += 1
    elif place >= car.goal[k - 1]:
        return
    else:
        k -= 1
    while k > 0 and car.goal[k - 1] > place:
        car.goal[k] = car.goal[k - 1]
        k -= 1
    car.goal[k] = place


@compiled
def place_on_path(world: WorldArrays, lane: int, station: float) -> float:
    """Returns the distance along the path of a place on one of its lanes [m]; infinite if the path does not reach it.

    Of several the first; manoeuvres between lanes do not count.
    """
    course, first, last = world.course, -1, -1
    for k in range(world.plan[0].points):
        if course[k].lane == lane and not course[k].manoeuvre:
            first, last = k if first < 0 else first, k
    if first < 0 or not course[first].station - PASSED <= station <= course[last].station + PASSED:
        return math.inf
    if station <= course[first].station:
        return course[first].s
    here = first
    for k in range(first + 1, last + 1):
        if course[k].lane != lane or course[k].manoeuvre:
            continue
        one, other = course[here], course[k]
        if one.station <= station < other.station:
            slope = (other.s - one.s) / (other.station - one.station)
            return one.s if station == one.station else slope * (station - one.station) + one.s
        here = k
    return course[last].s


# --- Perception -------------------------------------------------------------------------------------------------------


@compiled
def note_props(world: WorldArrays, frame: int) -> None:
    """Records the props that the ego sees, for the feasibility of manoeuvres."""
    car, plan, seen_props = world.vehicles[0], world.plan[0], world.seen_props
    count = see(world.vehicles, world.pedestrians, world.props, world.seen, world.eye[0], car.x, car.y, frame, 0)
    plan.props = 0
    for k in range(count):
        body = world.seen[k]
        if body.kind == STATIC:
            row = int(plan.props)
            seen_props[row, 0], seen_props[row, 1], seen_props[row, 2] = body.x, body.y, body.height
            plan.props += 1
