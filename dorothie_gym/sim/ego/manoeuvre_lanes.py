"""Lanes of a manoeuvre, and the pieces of path along them (compiled).

The lanes of a plan are the first `PlanRecord.steps` rows of `WorldArrays.steps`; a search for a turn follows them.
Where the rows do not suffice, functions return False or -1 and set `PlanRecord.needed` to 0.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dorothie_gym.maps.lane_neighbours import opposite_gap
from dorothie_gym.maps.model import HEADING, HEIGHT, X, Y
from dorothie_gym.sim.ego.lane_ends import may_merge, opposite_end
from dorothie_gym.sim.ego.limits import LEAD, MIN_SWITCH, PLANNED_BRAKING, SWITCH_TIME
from dorothie_gym.sim.ego.path_builder import (
    PATH_SPACING,
    append,
    count_points,
    follow,
    keep,
    position_on,
    project_on,
    segment_at,
    switch,
    u_turn,
)
from dorothie_gym.sim.network.lane_lookup import project, value_near
from dorothie_gym.sim.network.network import ANOTHER_WAY
from dorothie_gym.sim.state.codes import NOBODY
from dorothie_gym.support.compilation import compiled

if TYPE_CHECKING:
    from dorothie_gym.sim.state.town_arrays import TownArrays
    from dorothie_gym.sim.state.world_arrays import WorldArrays

LEAST_PATH = 120.0
"""Minimum length of path ahead [m]."""

LAID = 180.0
"""Length of path that is laid ahead [m]: more than `LEAST_PATH`, so that it is rarely laid again."""

SWITCH_COST = 20.0
"""Misfit by which an exit of the car's lane is preferred to that of an adjacent lane [degrees]."""

SETTLE = 15.0
"""Way along a newly entered lane before it is changed, where there is room [m]."""

EXACT = 5.0
"""Difference in angle within which an exit counts as the requested one [degrees]."""

WAITING_ROOM = 4.5
"""Distance between the end of a lane switch and a lane's end at which the ego may have to wait [m]."""

MOST_CHANGES = 3
"""Maximum number of lane changes before a turn."""

MERGING, MERGING_TIMES = 60.0, 2.0
"""Distance before the end of a lane at which the ego leaves it by itself [m], and in lengths of the lane switch."""

WIDEST_GAP = 14.0
"""Distance beyond which no point of a lane is opposite [m]: more than the diagonal of `lane_neighbours`' limits."""

ALMOST = 1e-3
"""Shortest piece of path [m]."""


@compiled
def add_step(world: WorldArrays, lane: int, change: bool) -> bool:
    """Adds a lane to the plan; returns whether there was room."""
    plan = world.plan[0]
    if plan.steps == len(world.steps):
        plan.needed = 0
        return False
    step = world.steps[plan.steps]
    step.lane, step.before, step.changes, step.change = lane, plan.steps - 1, 0, change
    plan.steps += 1
    return True


@compiled
def begin_steps(world: WorldArrays, lane: int) -> bool:
    """Begins a plan with a lane; returns whether there was room."""
    world.plan[0].steps = 0
    return add_step(world, lane, False)


@compiled
def cross_junction(town: TownArrays, world: WorldArrays, lane: int) -> bool:
    """Begins a plan with a lane, and inside a junction with those up to the lane after it."""
    fits = begin_steps(world, lane)
    while fits and lane >= 0 and town.lanes[lane].junction >= 0:
        lane = town.ways[lane].onward
        fits = lane < 0 or add_step(world, lane, False)
    return fits


@compiled
def take_course(town: TownArrays, world: WorldArrays) -> bool:
    """Begins a plan with the lanes of the current path ahead of the ego."""
    plan, course, last = world.plan[0], world.course, NOBODY
    plan.steps, fits = 0, True
    for k in range(plan.at, plan.points):
        lane = course[k].lane
        if fits and (k == plan.at or lane != last):
            beside = k > plan.at and (town.lanes[last].left == lane or town.lanes[last].right == lane)
            fits, last = add_step(world, lane, beside), lane
    return fits


@compiled
def enter_exit(town: TownArrays, world: WorldArrays, number: int) -> bool:
    """Adds the connectors of an exit, a row of `TownArrays.exits`, and the lane beyond the junction."""
    way = town.exits[number]
    lane = way.connector
    fits = add_step(world, lane, False)
    while fits and lane != way.lane:
        lane = town.neighbours[town.lanes[lane].successor]
        fits = add_step(world, lane, False)
    return fits


@compiled
def misfit_of(town: TownArrays, number: int, angle: int) -> int:
    """Returns the difference between the angle of an exit and another one [degrees]."""
    return abs((town.exits[number].angle - angle + 180) % 360 - 180)


@compiled
def find_oncoming(town: TownArrays, number: int, station: float) -> tuple[int, float]:
    """Returns the closest oncoming lane at a station of a lane, -1 for none, and the station on it [m]."""
    points, lane, ways = town.points, town.lanes[number], town.ways[number]
    found, at, least = -1, 0.0, math.inf
    if ways.oncomings == 0:
        return found, at
    here = segment_at(points, lane, station)
    x, y = value_near(points, lane, here, X, station), value_near(points, lane, here, Y, station)
    heading, height = value_near(points, lane, here, HEADING, station), value_near(points, lane, here, HEIGHT, station)
    for k in range(ways.oncoming, ways.oncoming + ways.oncomings):
        other = town.lane_lists[k]
        beside = town.lanes[other]
        if max(beside.left_edge - x, x - beside.right_edge, beside.low_edge - y, y - beside.high_edge) > WIDEST_GAP:
            continue
        there, _, segment = project(town, other, x, y)
        there = min(max(there, 0.0), beside.length)
        gap = opposite_gap(
            x,
            y,
            heading,
            height,
            value_near(points, beside, segment, X, there),
            value_near(points, beside, segment, Y, there),
            value_near(points, beside, segment, HEADING, there),
            value_near(points, beside, segment, HEIGHT, there),
            town.sign,
        )
        if gap < least:
            found, at, least = other, there, gap
    return found, at


# --- Search for a turn ------------------------------------------------------------------------------------------------


@compiled
def find_turn(town: TownArrays, world: WorldArrays, station: float, angle: int) -> int:
    """Adds to the plan the lanes to the exit closest to an angle, with lane changes if that exit is much closer.

    Args:
        town: arrays of the town.
        world: arrays of the world; the steps of the plan are taken in any case.
        station: position of the ego along the first of them [m].
        angle: degrees, positive left.

    Returns:
        Row of the exit in `TownArrays.exits`, -1 if there is none, and -2 if a list is too long.
    """
    plan, steps = world.plan[0], world.steps
    known = _keep_lane(town, world, angle)
    if known != -1:
        return known
    root = int(plan.steps) - 1
    best, best_row, best_exit = math.inf, -1, -1
    # successors come before adjacent lanes, so that lanes are changed as late as possible
    row, waiting = root, root + 1
    while row < plan.steps:
        lane, changes, follows = steps[row].lane, steps[row].changes, -1
        onward = town.ways[lane].onward
        if town.ways[lane].offers:
            number = _closest_exit(town, lane, angle)
            misfit = misfit_of(town, number, angle) + SWITCH_COST * changes if number >= 0 else math.inf
            if misfit < best:
                best, best_row, best_exit = misfit, row, number
        elif onward >= 0 and not _is_seen(world, root, onward):
            follows = int(plan.steps)
            if not _reach(world, onward, row, changes, False):
                return -2
        if not _reach_beside(town, world, root, row, station):
            return -2
        if follows >= 0:
            row = follows
            continue
        while waiting < plan.steps and not steps[waiting].change:
            waiting += 1
        row, waiting = waiting, waiting + 1
    if best_exit < 0:
        return -1
    if not _trace_back(world, root, best_row) or not enter_exit(town, world, best_exit):
        return -2
    return best_exit


@compiled
def _keep_lane(town: TownArrays, world: WorldArrays, angle: int) -> int:
    """Keeps a lane that leads to the requested exit until its end; lanes are changed later, if at all.

    Returns:
        Row of the exit if it is the only exit there and thus the requested turn, else -1; -2 if a list is
        too long.
    """
    own = town.ways[world.steps[world.plan[0].steps - 1].lane]
    for number in range(own.exit, own.exit + (0 if own.offers else own.exits)):
        if misfit_of(town, number, angle) <= EXACT:
            if not enter_exit(town, world, number):
                return -2
            way = town.exits[number]
            return number if way.junction >= 0 and abs(way.angle) > ANOTHER_WAY else -1
    return -1


@compiled
def _closest_exit(town: TownArrays, lane: int, angle: int) -> int:
    """Returns the row of the exit of a lane that is closest to an angle, the first of equals; -1 if there is none."""
    ways, found = town.ways[lane], -1
    for number in range(ways.exit, ways.exit + ways.exits):
        if found < 0 or misfit_of(town, number, angle) < misfit_of(town, found, angle):
            found = number
    return found


@compiled
def _reach_beside(town: TownArrays, world: WorldArrays, root: int, row: int, station: float) -> bool:
    """Adds the lanes next to a row of the search that have room for a switch; returns whether the list had room."""
    step = world.steps[row]
    lane, changes, way_out = town.lanes[step.lane], step.changes, town.ways[step.lane].merge
    inner, outer = lane.inner, lane.outer
    if way_out >= 0 and not _is_seen(world, root, way_out) and not _reach(world, way_out, row, changes, True):
        return False
    if changes == MOST_CHANGES or not _has_room(town, world, row, station):
        return True
    # lanes that end lead nowhere
    if inner >= 0 and town.ways[inner].merge >= 0:
        inner = -1
    if outer >= 0 and town.ways[outer].merge >= 0:
        outer = -1
    if inner >= 0 and not _is_seen(world, root, inner) and not _reach(world, inner, row, changes + 1, True):
        return False
    if outer >= 0 and not _is_seen(world, root, outer):
        return _reach(world, outer, row, changes + 1, True)
    return True


@compiled
def _is_seen(world: WorldArrays, root: int, lane: int) -> bool:
    for row in range(root, world.plan[0].steps):
        if world.steps[row].lane == lane:
            return True
    return False


@compiled
def _reach(world: WorldArrays, lane: int, before: int, changes: int, change: bool) -> bool:
    """Adds a lane that the search has reached from another row."""
    if not add_step(world, lane, change):
        return False
    step = world.steps[world.plan[0].steps - 1]
    step.before, step.changes = before, changes
    return True


@compiled
def _has_room(town: TownArrays, world: WorldArrays, row: int, station: float) -> bool:
    """Returns whether there is room for one more lane change after those that lead to a row of the search."""
    steps = world.steps
    lane, changes = town.lanes[steps[row].lane], 1
    while steps[row].change:
        row, changes = steps[row].before, changes + 1
    # where the adjacent lanes begin
    start = station if steps[row].before < 0 else 0.0
    return lane.length - start >= changes * (MIN_SWITCH + LEAD) and lane.junction < 0


@compiled
def _trace_back(world: WorldArrays, root: int, row: int) -> bool:
    """Makes the lanes that lead to a row of the search the steps after its root; the other rows are dropped."""
    plan, steps = world.plan[0], world.steps
    count, at = 0, row
    while at != root:
        at, count = steps[at].before, count + 1
    if plan.steps + count > len(steps):
        plan.needed = 0
        return False
    spare, at = int(plan.steps), row
    for k in range(spare + count - 1, spare - 1, -1):
        steps[k].lane, steps[k].change = steps[at].lane, steps[at].change
        at = steps[at].before
    for k in range(count):
        target, source = steps[root + 1 + k], steps[spare + k]
        target.lane, target.change = source.lane, source.change
    plan.steps = root + 1 + count
    return True


# --- Pieces of path ---------------------------------------------------------------------------------------------------


@compiled
def grow(town: TownArrays, world: WorldArrays, station: float) -> int:
    """Adds the lanes that follow until the path is long enough.

    Args:
        town: arrays of the town.
        world: arrays of the world.
        station: start of the path on the first lane [m].

    Returns:
        0, 1 if the path ends where a turn must be chosen or at the end of the map, and -1 if there is no room.
    """
    plan, steps, ways, ahead = world.plan[0], world.steps, town.ways, 0.0
    for k in range(plan.steps):
        if not steps[k].change:
            ahead += town.lanes[steps[k].lane].length
    ahead -= station
    while ahead < LAID:
        last = int(steps[plan.steps - 1].lane)
        on = int(ways[last].onward)
        beside = on < 0 and may_merge(town, last, station if plan.steps == 1 else 0.0)
        if on < 0 and not beside:
            return 1
        following = int(ways[last].merge) if beside else on
        if not add_step(world, following, beside):
            return -1
        ahead += town.lanes[following].length
        if beside:
            ahead -= opposite_end(town, last, following)
    return 0


@compiled
def lay_pieces(town: TownArrays, world: WorldArrays, station: float, speed: float, write: bool) -> None:
    """Lays the pieces of path along the steps of the plan; none at the very end of a lane.

    Args:
        town: arrays of the town.
        world: arrays of the world.
        station: start of the path on the first lane [m].
        speed: speed of the ego [m/s], which the length of lane switches depends on.
        write: whether the points are written or only counted.
    """
    count, steps, at, k = int(world.plan[0].steps), world.steps, station, -1
    while k + 1 < count:
        k += 1
        number = steps[k].lane
        lane = town.lanes[number]
        changes = 0
        while k + 1 + changes < count and steps[k + 1 + changes].change:
            changes += 1
        if changes == 0:
            if at < lane.length - ALMOST:
                follow(town, world, number, at, lane.length, write)
            at = 0.0
            continue
        beside = steps[k + 1].lane
        ends = town.ways[number].merge >= 0
        end = min(town.ways[number].end, lane.length - (WAITING_ROOM if town.ways[beside].chooses else 0.0))
        room = max((end - at) / changes - LEAD, MIN_SWITCH if ends else 2.0)
        distance = min(max(MIN_SWITCH, SWITCH_TIME * speed), room)
        if ends and at + changes * distance > lane.length:
            if k == 0 and lane.length - at > ALMOST:  # the ego is still on its lane
                straight = min(LEAD, lane.length - at)
                follow(town, world, number, at, at + straight, write)
                at += straight
            k, at = merge(town, world, k, k + changes, at, changes * distance, write)
            continue
        spare = (lane.length - at) - changes * (distance + LEAD)
        if k == 0:  # begins late enough to stop before it if others are beside the ego
            most = max(end - at - changes * (distance + LEAD), 0.0)
            lead = LEAD + min(speed * speed / (2.0 * PLANNED_BRAKING), most)
        else:
            lead = min(max(spare, LEAD), SETTLE)
        begin = at + lead
        if ends and not world.plan[0].early:  # not long before the end, so that places on the lane can be reached
            begin = max(begin, end - changes * max(MERGING_TIMES * distance, MERGING))
        begin = min(begin, (max(end, at + distance) if ends else lane.length) - distance)
        if begin > at + ALMOST:
            follow(town, world, number, at, begin, write)
        at = switch(town, world, number, beside, max(begin, at), distance, write)


@compiled
def merge(
    town: TownArrays, world: WorldArrays, first: int, step: int, start: float, distance: float, write: bool
) -> tuple[int, float]:
    """Lays the way out of a lane close to its end: along a lane beside it and those that follow, drawing near to them.

    The distance from these lanes falls as in `switch`.

    Args:
        town: arrays of the town.
        world: arrays of the world.
        first: step of the plan on the lane that ends.
        step: step on the lane beside it.
        start: distance along the first lane at which it begins [m].
        distance: its length [m].
        write: whether the points are written or only counted.

    Returns:
        The step before the one on which it ends, if that is another one than `step`, and the station there [m].
    """
    points, steps, last = town.points, world.steps, int(world.plan[0].steps) - 1
    x, y = position_on(points, town.lanes[steps[first].lane], start)
    begin, _ = project_on(town, steps[step].lane, x, y)
    along_x, along_y = position_on(points, town.lanes[steps[step].lane], begin)
    aside_x, aside_y = x - along_x, y - along_y
    count = max(3, math.ceil(distance / PATH_SPACING) + 1)
    limit, station = town.lanes[steps[first].lane].limit, begin
    writes = count_points(world, count, write)
    for k in range(count):
        t = k / (count - 1)
        station = begin + t * distance
        while station > town.lanes[steps[step].lane].length and step < last and not steps[step + 1].change:
            length = town.lanes[steps[step].lane].length
            begin, station, step = begin - length, station - length, step + 1
        number = int(steps[step].lane)
        if writes and station <= town.lanes[number].length:
            weight = 1.0 - t * t * t * (10.0 - 15.0 * t + 6.0 * (t * t))
            x, y = position_on(points, town.lanes[number], station)
            append(
                world,
                x + weight * aside_x,
                y + weight * aside_y,
                station,
                min(limit, town.lanes[number].limit),
                number,
                True,
            )
    return step - 1, min(station, town.lanes[steps[step].lane].length)


@compiled
def lay_head(
    town: TownArrays, world: WorldArrays, first: int, end: int, oncoming: int, begin: float, write: bool
) -> None:
    """Lays the path before the steps of the plan: the rest of the manoeuvre in progress, or a U-turn.

    Args:
        town: arrays of the town.
        world: arrays of the world; lane and station of the ego are those on the current path.
        first: first point of the current path that is kept.
        end: the point after the last one that is kept.
        oncoming: lane on which a U-turn ends, or -1.
        begin: distance along the ego's lane at which the U-turn begins [m].
        write: whether the points are written or only counted.
    """
    lane, station = world.plan[0].lane, world.plan[0].station
    if end > first:
        keep(town, world, first, end, write)
    if oncoming >= 0:
        if begin > station + ALMOST:
            follow(town, world, lane, station, begin, write)
        u_turn(town, world, lane, oncoming, begin, write)
