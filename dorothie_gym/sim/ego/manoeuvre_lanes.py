"""Lanes of a manoeuvre, and the pieces of path along them (compiled).

The lanes of a plan are the first `PlanRecord.steps` rows of `WorldArrays.steps`. A search for a turn appends its search
tree after them. Where the rows do not suffice, functions return False or -1 and set `PlanRecord.needed` to 0.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dorothie_gym.sim.ego.limits import LEAD, MIN_SWITCH, PLANNED_BRAKING, SWITCH_TIME
from dorothie_gym.sim.ego.path_builder import follow, keep, switch, u_turn
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

ALMOST = 1e-3
"""Shortest piece of path [m]."""


# --- Lists of lanes ---------------------------------------------------------------------------------------------------


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
    lane, changes = town.lanes[step.lane], step.changes
    inner, outer = lane.inner, lane.outer
    if changes == MOST_CHANGES or not _has_room(town, world, row, station):
        return True
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
    plan, steps, ahead = world.plan[0], world.steps, 0.0
    for k in range(plan.steps):
        if not steps[k].change:
            ahead += town.lanes[steps[k].lane].length
    ahead -= station
    while ahead < LAID:
        on = town.ways[steps[plan.steps - 1].lane].onward
        if on < 0:
            return 1
        if not add_step(world, on, False):
            return -1
        ahead += town.lanes[on].length
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
    count, steps, at = int(world.plan[0].steps), world.steps, station
    for k in range(count):
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
        end = lane.length - (WAITING_ROOM if town.ways[beside].chooses else 0.0)
        room = max((end - at) / changes - LEAD, 2.0)
        distance = min(max(MIN_SWITCH, SWITCH_TIME * speed), room)
        spare = (lane.length - at) - changes * (distance + LEAD)
        if k == 0:  # begins late enough to stop before it if others are beside the ego
            most = max(end - at - changes * (distance + LEAD), 0.0)
            lead = LEAD + min(speed * speed / (2.0 * PLANNED_BRAKING), most)
        else:
            lead = min(max(spare, LEAD), SETTLE)
        begin = min(at + lead, lane.length - distance)
        if begin > at + ALMOST:
            follow(town, world, number, at, begin, write)
        at = switch(town, world, number, beside, max(begin, at), distance, write)


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
