"""Hazards of the ego: bodies on its path, pedestrians on crosswalks, junctions, traffic beside a manoeuvre."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dorothie_gym.maps.model import LEVEL_HEIGHT
from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.sim.ego.attention import is_noticed, passes_line
from dorothie_gym.sim.ego.limits import (
    BEGUN,
    EGO_STANDING,
    MANOEUVRE_PROP_GAP,
    PLANNED_BRAKING,
    U_TURN_REACH,
)
from dorothie_gym.sim.ego.obstacles import ROADBLOCK_GAP, STANDSTILL_GAP, bodies_ahead, offer
from dorothie_gym.sim.ego.path import point_at
from dorothie_gym.sim.network.lane_lookup import project, value_near
from dorothie_gym.sim.state.codes import PEDESTRIAN_CLASS, STATIC, U_TURN, VEHICLES, TrafficControl, Wait, Walk
from dorothie_gym.sim.traffic.junctions import announce, close, request
from dorothie_gym.sim.traffic.parameters import CRITICAL_GAP, HARDEST_BRAKING, STEP_AHEAD, STEP_PAST
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import compiled, inlined

if TYPE_CHECKING:
    from dorothie_gym.sim.state.records import SeenRecord
    from dorothie_gym.sim.state.town_arrays import TownArrays
    from dorothie_gym.sim.state.town_records import PassageRecord
    from dorothie_gym.sim.state.world_arrays import WorldArrays

TURN_ROUND_SPEED = 4.0
"""Minimum speed assumed for oncoming vehicles before a U-turn [m/s]."""

EGO_ASKING = 11.5
"""Distance before the start of braking at which the ego requests a junction [m]."""

UPSTREAM = 50.0
"""Distance before a lane's start within which oncoming vehicles are considered [m]."""

BEFORE_MANOEUVRE = 15.0
"""Distance before the start of braking for a lane switch or U-turn at which others are considered [m]."""

REACHED = 0.2
"""Overlap with the new lane at which a switching ego obstructs it [m]."""

BESIDE_EGO = 7.0
"""Distance ahead and behind at which vehicles count as beside the ego [m], as do vehicles up to one second behind."""

BEFORE_IT = 0.5
"""Distance before the start of a manoeuvre at which the ego waits [m]."""

SLOWEST_APPROACH = 1.0
"""Minimum speed assumed for the ego's approach [m/s]."""

IN_LINE, FACING_COSINE = 2.0, 0.5
"""Distance from a lane [m], and cosine of the heading to it, up to which a vehicle counts as driving along it."""

TRAFFIC_LIGHT, TRAFFIC_SIGN = int(ObjectClass.TRAFFIC_LIGHT.value), int(ObjectClass.TRAFFIC_SIGN.value)


@inlined
def look(town: TownArrays, world: WorldArrays, seen: int) -> None:
    """Finds the strictest limit of the ego's speed, requests junctions, and writes the limit to the record `car`.

    Args:
        town: arrays of the town.
        world: arrays of the world.
        seen: number of perceived bodies.
    """
    car = world.car[0]
    car.kind = 0
    best = bodies_ahead(town, world, seen)
    way, other, kind = _gap_to_others(town, world, seen, best <= 0.0)
    safe, best = best, _crosswalk(town, world, best)
    if best > 0.0 or safe <= 0.0:
        best = _junction(town, world, best)
    if way < math.inf:
        margin = ROADBLOCK_GAP if kind == STATIC else STANDSTILL_GAP
        offer(car, best, kind, way + (margin - BEFORE_IT), 0.0, other, False, False)


# --- Crosswalks and junctions -----------------------------------------------------------------------------------------


@compiled
def _crosswalk(town: TownArrays, world: WorldArrays, best: float) -> float:
    """Offers the next crosswalk on the path with visible pedestrians for which the ego can still stop."""
    car, vehicle, course = world.car[0], world.vehicles[0], world.course
    braking = vehicle.speed * vehicle.speed
    reach = braking / (2.0 * PLANNED_BRAKING) + EGO_ASKING + 0.5 * vehicle.length
    last = point_at(world, car.s + reach)
    for r in range(car.run, car.runs):
        k = max(int(car.run_first[r]), int(car.at))
        if k > last:
            break
        lane = town.lanes[car.run_lane[r]]
        if course[k].manoeuvre or lane.passages == 0:
            continue
        for p in range(lane.passage, lane.passage + lane.passages):
            passage = town.passages[p]
            if world.busy[passage.crossing] == 0:
                continue
            gap = course[k].s + passage.start - course[k].station - car.s - 0.5 * vehicle.length
            if gap < 0.0 or gap > reach or braking > 2.0 * HARDEST_BRAKING * max(gap, 0.1):
                continue
            walker = _walker_on(world, passage)
            if walker >= 0:
                return offer(car, best, PEDESTRIAN_CLASS, gap, 0.0, walker, False, True)
    return best


@compiled
def _walker_on(world: WorldArrays, passage: PassageRecord) -> int:
    """Returns the key of a visible pedestrian that is about to pass a lane, or has just passed it; or -1."""
    vehicle, sight = world.vehicles[0], world.eye[0].sight
    for p in range(len(world.pedestrians)):
        walker = world.pedestrians[p]
        if walker.state == Walk.CROSSING and walker.crossing == passage.crossing:
            left = (passage.across - walker.station) * walker.direction
            dx, dy = walker.x - vehicle.x, walker.y - vehicle.y
            if -STEP_PAST < left < STEP_AHEAD and dx * dx + dy * dy < sight * sight and is_noticed(world, walker):
                return int(walker.key)
    return -1


@compiled
def _junction(town: TownArrays, world: WorldArrays, best: float) -> float:
    """Offers the line before a junction that the ego may not enter yet."""
    car, vehicle, course = world.car[0], world.vehicles[0], world.course
    if car.held and vehicle.speed < EGO_STANDING:
        return best  # requests only what it uses
    asking = vehicle.speed * vehicle.speed / (2.0 * PLANNED_BRAKING) + EGO_ASKING
    half = 0.5 * vehicle.length
    last = point_at(world, car.s + max(asking, CRITICAL_GAP * vehicle.speed) + half)
    for r in range(car.run + 1, car.runs):
        k = int(car.run_first[r])
        if k > last:
            break
        connector, lane = int(car.run_lane[r]), int(car.run_lane[r - 1])
        if town.lanes[connector].junction < 0:
            continue
        line = course[k].s - course[k].station - car.s - half
        if line < -half:
            break  # over the line already
        announce(vehicle, lane, connector, line, world.clock[0].time)
        if line > asking:
            break
        wait = request(town, world, 0, r - int(car.run))
        if wait == Wait.NOT or (0.0 < car.sent >= line and passes_line(world, wait)):
            break
        return offer(car, best, _holder(town, wait, lane), line, 0.0, -2, False, True)
    return best


@compiled
def _holder(town: TownArrays, wait: int, lane: int) -> int:
    """Returns the `ObjectClass` that holds the ego before a junction, as a driver would name it."""
    if wait == Wait.LIGHT:
        return TRAFFIC_LIGHT
    control = town.lanes[lane].control
    if (
        (control == TrafficControl.STOP or control == TrafficControl.YIELD)
        and wait != Wait.NO_ROOM
        and wait != Wait.CLOSED
    ):
        return TRAFFIC_SIGN
    return VEHICLES


# --- Manoeuvres -------------------------------------------------------------------------------------------------------


@compiled
def _gap_to_others(town: TownArrays, world: WorldArrays, seen: int, blocked: bool) -> tuple[float, int, int]:
    """Returns the distance to the start of a lane switch or U-turn [m] while a body obstructs it.

    Args:
        town: arrays of the town.
        world: arrays of the world.
        seen: number of perceived bodies.
        blocked: whether the ego stands behind a body: it may be waiting for the junction, which stays open then.

    Returns:
        The distance (infinite if the manoeuvre may begin), and key and class of the obstructing body.
    """
    car, vehicle, course = world.car[0], world.vehicles[0], world.course
    turning = car.action == U_TURN
    start = int(car.at)
    if course[start].manoeuvre and (car.s > BEGUN or vehicle.speed > EGO_STANDING):
        if not turning:
            way, other = _gap_beside(town, world, seen, int(course[start].lane))
            return way, other, VEHICLES
        if not blocked:
            _close_junctions(town, world, start)
        return math.inf, 0, VEHICLES
    reach = BEFORE_MANOEUVRE + vehicle.speed * vehicle.speed / (2.0 * PLANNED_BRAKING)
    while start < car.points and not course[start].manoeuvre and course[start].s - car.s <= reach:
        start += 1
    if start >= car.points or not course[start].manoeuvre or course[start].s - car.s > reach:
        return math.inf, 0, VEHICLES
    ahead = course[start].s - car.s
    target = int(course[start].lane)
    meeting, _, _ = project(town, target, course[start].x, course[start].y)
    lanes = _find_upstream(town, world, target)
    for n in range(seen):
        body = world.seen[n]
        if body.kind == STATIC and not turning and _leads_to(town, world, start, meeting, body):
            return max(ahead, 0.0), int(body.key), STATIC
        if body.kind != VEHICLES:
            continue
        station = _place_towards(town, world, lanes, body)
        if turning:  # a vehicle that stands now may arrive before the U-turn ends
            behind = 8.0 + 5.0 * max(body.speed, TURN_ROUND_SPEED)
        else:
            behind = 8.0 + 3.0 * max(body.speed - vehicle.speed, 0.0)
            station += body.speed * ahead / max(vehicle.speed, SLOWEST_APPROACH)  # its position when the car arrives
        if -behind < station - meeting < 9.0:
            return max(ahead, 0.0), int(body.key), VEHICLES
    # requested last: vehicles that wait before the junction go first
    if turning and not blocked and not _close_junctions(town, world, start):
        return max(ahead, 0.0), -2, VEHICLES
    return math.inf, 0, VEHICLES


@compiled
def _leads_to(town: TownArrays, world: WorldArrays, start: int, meeting: float, prop: SeenRecord) -> bool:
    """Returns whether a lane switch would lead the ego too close to a prop on the new lane to leave that lane again.

    Args:
        town: arrays of the town.
        world: arrays of the world.
        start: first point of the switch on the path.
        meeting: station of that point on the new lane [m].
        prop: a perceived prop.
    """
    car, vehicle, course = world.car[0], world.vehicles[0], world.course
    target, end = int(course[start].lane), start
    while end + 1 < car.points and course[end].manoeuvre:
        end += 1
    station, lateral, segment = project(town, target, prop.x, prop.y)
    until = (
        course[end].s - course[start].s + vehicle.speed * vehicle.speed / (2.0 * PLANNED_BRAKING) + MANOEUVRE_PROP_GAP
    )
    if abs(lateral) > town.lanes[target].half_width or not -0.5 * vehicle.length < station - meeting < until:
        return False
    height = value_near(town.points, town.lanes[target], segment, 4, station)
    return bool(abs(height - prop.height) <= LEVEL_HEIGHT)


@compiled
def _gap_beside(town: TownArrays, world: WorldArrays, seen: int, target: int) -> tuple[float, int]:
    """Checks for vehicles beside the ego in a lane switch, as long as the ego does not obstruct the target lane yet.

    Returns:
        0 if there is one, else infinite, and its key.
    """
    vehicle, half_width = world.vehicles[0], town.lanes[target].half_width
    own, lateral, _ = project(town, target, vehicle.x, vehicle.y)
    if abs(lateral) < half_width + 0.5 * vehicle.width - REACHED:
        return math.inf, 0
    for n in range(seen):
        body = world.seen[n]
        if body.kind != VEHICLES or body.distance2 > BESIDE_EGO * BESIDE_EGO * 4.0:
            continue
        station, lateral, _ = project(town, target, body.x, body.y)
        if abs(lateral) < half_width and abs(station - own) < BESIDE_EGO + max(body.speed - vehicle.speed, 0.0):
            return 0.0, int(body.key)
    return math.inf, 0


@compiled
def _close_junctions(town: TownArrays, world: WorldArrays, start: int) -> bool:
    """Closes the junctions that a U-turn from a point reaches into; returns whether they are empty."""
    x, y, free = world.course[start].x, world.course[start].y, True
    for j in range(len(town.junctions)):
        dx, dy = town.junctions[j, 0] - x, town.junctions[j, 1] - y
        reach = town.junctions[j, 2] + U_TURN_REACH
        if dx * dx + dy * dy < reach * reach and not close(town, world, j):
            free = False
    return free


@compiled
def _find_upstream(town: TownArrays, world: WorldArrays, target: int) -> int:
    """Writes a lane, and those that lead to it within reach of a U-turn, into the scratch arrays.

    `stack` holds the lanes, `starts` where they start, measured along the first one [m]; returns their number.
    """
    stack, starts = world.stack, world.starts
    stack[0], starts[0] = target, 0.0
    count, k = 1, 0
    while k < count:
        lane, offset = town.lanes[stack[k]], starts[k]
        if offset > -UPSTREAM:
            for p in range(lane.predecessor, lane.predecessor + lane.predecessors):
                before = town.neighbours[p]
                known = False
                for m in range(count):
                    known = known or stack[m] == before
                if not known and count < len(stack):
                    stack[count], starts[count] = before, offset - town.lanes[before].length
                    count += 1
        k += 1
    return count


@compiled
def _place_towards(town: TownArrays, world: WorldArrays, lanes: int, body: SeenRecord) -> float:
    """Returns the station of a body on the lane of `_find_upstream`, negative before it [m]; inf if it is not there."""
    other = world.vehicles[body.body]
    for k in range(lanes):
        number = world.stack[k]
        lane = town.lanes[number]
        station, lateral, segment = project(town, number, body.x, body.y)
        if abs(lateral) > IN_LINE:
            continue
        if abs(value_near(town.points, lane, segment, 4, station) - body.height) > LEVEL_HEIGHT:
            continue
        heading = value_near(town.points, lane, segment, 3, station)
        if pm.cos(heading - body.heading) < FACING_COSINE:
            continue
        if lane.junction < 0 or other.claim == number or other.inside == number:
            return float(station + world.starts[k])
    return math.inf
