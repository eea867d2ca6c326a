"""Pedestrians: along footways, round corners, over crosswalks, and across streets without a pavement.

A pedestrian walks towards a place a little ahead on its footway and decides again every `PACE` substeps, not all
pedestrians in the same substep; in between it walks straight on.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dorothie_gym.maps.model import LEVEL_HEIGHT
from dorothie_gym.sim.network.lane_lookup import project
from dorothie_gym.sim.pedestrians.pacing import (
    CROSSING_RATE,
    OBSTACLE_PATIENCE,
    SAFE_DISTANCE,
    SAFE_TIME,
    WALK_AHEAD,
    note_progress,
    walk_towards,
)
from dorothie_gym.sim.pedestrians.walkway_position import (
    SIDE_KEPT,
    closest_walk,
    enter_next,
    find_segment,
    locate,
    place_beside,
    side_kept,
)
from dorothie_gym.sim.randomness import draw
from dorothie_gym.sim.state.codes import NOBODY, Colour, Footway, Kind, Walk
from dorothie_gym.sim.traffic.junctions import light
from dorothie_gym.sim.traffic.parameters import ASKING, CRITICAL_GAP, TRAFFIC_STANDING
from dorothie_gym.sim.traffic.vehicle_models import brake_to
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import compiled, inlined

if TYPE_CHECKING:
    from dorothie_gym.sim.state.records import PedestrianRecord, VehicleRecord
    from dorothie_gym.sim.state.town_arrays import TownArrays
    from dorothie_gym.sim.state.town_records import CrossingRecord, WalkwayRecord
    from dorothie_gym.sim.state.world_arrays import WorldArrays


# --- Jaywalking -------------------------------------------------------------------------------------------------------
# Jaywalking: pedestrians beside streets without a pavement cross anywhere, away from junctions and close vehicles.

OVER, BACK, THERE = 0, 1, 2
"""Values of `mouth` while straying: walking over, walking back, waiting at a far kerb without a footway."""

FAR_KERB_WAIT = 5.0
"""Time at a far kerb without a footway before a pedestrian returns [s]."""

JOINED = 2.5
"""Distance to a footway at the far kerb within which a pedestrian walks on there [m]."""

CORRIDOR = 2.0
"""Half the width of the path across [m]."""

COMING, BEYOND = 5.0, 0.5
"""Way of a straying pedestrian, and distance from the lane at its end, within which vehicles stop for it [m]."""

GAP = 2.0
"""Room left before a straying pedestrian [m]."""


@inlined
def steps_out(town: TownArrays, world: WorldArrays, walker: PedestrianRecord, time: float) -> bool:
    """Makes a pedestrian beside a street cross it now and then; returns whether it begins to."""
    points = town.walk_points
    far = min(points[walker.segment, 5], points[walker.segment + 1, 5])
    if draw(walker) >= CROSSING_RATE * time or far <= 0.0 or not _is_clear(world, walker):
        return False
    walker.state, walker.mouth, walker.waited, walker.far = Walk.STRAYING, OVER, 0.0, far
    walker.speed = 0.0
    return True


@compiled
def _is_clear(world: WorldArrays, walker: PedestrianRecord) -> bool:
    """Returns whether no vehicle is close."""
    for i in range(len(world.vehicles)):
        vehicle = world.vehicles[i]
        if vehicle.kind == Kind.EMPTY or abs(vehicle.height - walker.height) > LEVEL_HEIGHT:
            continue
        dx, dy = vehicle.x - walker.x, vehicle.y - walker.y
        reach = SAFE_DISTANCE + SAFE_TIME * max(vehicle.speed, 0.0)
        if dx * dx + dy * dy < reach * reach:
            return False
    return True


@compiled
def stray(town: TownArrays, world: WorldArrays, p: int, time: float) -> None:
    """Walks straight over a road, or back; also back if an obstruction stays."""
    walker, points = world.pedestrians[p], town.walk_points
    k = walker.segment
    length = points[k + 1, 2] - points[k, 2]
    along = walker.station - points[k, 2]
    cos, sin = (points[k + 1, 0] - points[k, 0]) / length, (points[k + 1, 1] - points[k, 1]) / length
    home_x, home_y = points[k, 0] + along * cos, points[k, 1] + along * sin
    cos, sin = town.sign * sin, -town.sign * cos  # across the road
    dx, dy = walker.x - home_x, walker.y - home_y
    gone, aside = dx * cos + dy * sin, dy * cos - dx * sin
    if walker.mouth == THERE:
        walker.speed = 0.0
        walker.waited += time
        if walker.waited > FAR_KERB_WAIT and _is_clear(world, walker):
            walker.mouth, walker.waited = BACK, 0.0
        return
    if walker.mouth == OVER and gone >= walker.far:
        _arrive(town, walker)
        return
    if walker.mouth == BACK and gone <= 0.0:
        walker.state, walker.waited, walker.speed = Walk.WALKING, 0.0, 0.0
        return
    onward = 1.0 if walker.mouth == OVER else -1.0
    ahead = gone + onward * WALK_AHEAD
    x, y = home_x + ahead * cos, home_y + ahead * sin
    if walk_towards(world, p, town.sign, x, y, onward * cos, onward * sin, onward * aside, CORRIDOR, time):
        walker.waited = 0.0
        return
    walker.waited += time
    if walker.waited > OBSTACLE_PATIENCE:
        walker.mouth, walker.waited = BACK if walker.mouth == OVER else OVER, 0.0


@inlined
def _arrive(town: TownArrays, walker: PedestrianRecord) -> None:
    """Walks on at the other side of the road, or waits there for a while if there is no footway."""
    found, station, segment = closest_walk(town, Footway.STREET, walker.x, walker.y, JOINED)
    walker.waited, walker.speed = 0.0, 0.0
    if found < 0:
        walker.mouth = THERE
        return
    walker.walk, walker.station, walker.segment, walker.state = found, station, segment, Walk.WALKING
    walker.direction = 1.0 if draw(walker) < 0.5 else -1.0


@compiled
def give_way_to_strayers(town: TownArrays, world: WorldArrays, i: int) -> float:
    """Returns the acceleration that stops a vehicle before straying pedestrians [m/s^2]; inf for none."""
    vehicle = world.vehicles[i]
    found = math.inf
    reach = CRITICAL_GAP * vehicle.speed + ASKING + 0.5 * vehicle.length
    for p in range(len(world.pedestrians)):
        walker = world.pedestrians[p]
        if walker.state != Walk.STRAYING or walker.crashed or abs(walker.height - vehicle.height) > LEVEL_HEIGHT:
            continue
        dx, dy = walker.x - vehicle.x, walker.y - vehicle.y
        if dx * dx + dy * dy < reach * reach and dx * vehicle.cos + dy * vehicle.sin > 0.0:
            left = _way_to(town, vehicle, walker, reach)
            if left > 0.0:
                found = min(found, brake_to(vehicle.speed, left - GAP))
    return found


@inlined
def _way_to(town: TownArrays, vehicle: VehicleRecord, walker: PedestrianRecord, reach: float) -> float:
    """Returns the distance from a vehicle's front to a pedestrian in or about to enter its path [m]; inf for none."""
    begin = -vehicle.station
    for k in range(int(vehicle.planned)):
        if begin > reach:
            break
        lane = town.lanes[vehicle.plan[k]]
        station, lateral, _ = project(town, vehicle.plan[k], walker.x, walker.y)
        if 0.0 <= station <= lane.length and begin + station > 0.0:
            coming = COMING if walker.speed > 0.0 else 0.0
            _, later, _ = project(town, vehicle.plan[k], walker.x + coming * walker.cos, walker.y + coming * walker.sin)
            edge = lane.half_width + BEYOND
            if min(lateral, later) < edge and max(lateral, later) > -edge:
                return float(begin + station - 0.5 * vehicle.length)
        begin += lane.length
    return math.inf


# --- Crosswalks -------------------------------------------------------------------------------------------------------

EXPECTED_REACTION = 1.0
"""Reaction time of drivers assumed by pedestrians [s]."""

EXPECTED_BRAKING = 3.0
"""Deceleration of vehicles assumed by pedestrians [m/s^2]."""

ROOM = 4.0
"""Distance from the front to the crosswalk's centre line at which vehicles are expected to stop [m]."""

VEHICLES_SIGHT = 60.0
"""Distance up to which pedestrians look for vehicles [m]."""

CROSSING_SHARE = 0.35
"""Probability of crossing for a pedestrian that passes a crosswalk."""

GIVES_UP = 40.0
"""Wait at a crosswalk after which a pedestrian walks on [s]."""

CROSSING_PAUSE = 5.0
"""Time after leaving a crosswalk without crossing again [s]."""

PLACES, PLACES_APART = 3, 0.7
"""Number of adjacent waiting places, and the distance between them [m]."""

FROM_KERB = 0.9
"""Distance of those places from the kerb [m]."""

FROM_PAINT = 2.0
"""Largest distance of those places beside the centre of the paint [m]."""

READY = 1.0
"""Distance to its place from which a waiting pedestrian steps onto the crosswalk [m]."""

HALF_DEPTH = 1.5
"""Half the extent of a crosswalk along the road [m]."""

CROSSED = 0.1
"""Distance to the end of a crosswalk at which a pedestrian has crossed [m]."""


@inlined
def comes_to_crosswalk(town: TownArrays, walker: PedestrianRecord, way: WalkwayRecord, time: float) -> bool:
    """Makes a pedestrian stop at a crosswalk that it passes within some time [s]; returns whether it stops."""
    step = walker.pace * time
    for m in range(way.mouth, way.mouth + way.mouths):
        mouth = town.mouths[m]
        left = (mouth.station - walker.station) * walker.direction
        if 0.0 <= left < step and draw(walker) < CROSSING_SHARE:
            walker.state, walker.crossing, walker.mouth = Walk.WAITING, mouth.crossing, mouth.end
            walker.direction = 1.0 if mouth.end == 0 else -1.0
            walker.waited, walker.speed = 0.0, 0.0
            return True
    return False


@inlined
def wait(town: TownArrays, world: WorldArrays, p: int, time: float) -> None:
    """Waits at the kerb until the crosswalk may be entered, or walks on after too long a wait.

    The place is where the pavement ends, also beside the paint, if not too far from it: beyond, turning cars cut
    the corner.
    """
    walker = world.pedestrians[p]
    crossing = town.crossings[walker.crossing]
    walker.waited += time
    cos, sin = walker.direction * crossing.cos, walker.direction * crossing.sin
    inward = max(town.walks[walker.walk].half_width - FROM_KERB, 0.0)
    beside = (p % PLACES - (PLACES - 1) // 2) * PLACES_APART
    x, y, _, _ = place_beside(town, walker, crossing.station[walker.mouth], 0.0)
    aside = (y - crossing.y[0]) * crossing.cos - (x - crossing.x[0]) * crossing.sin
    far = aside - min(max(aside, -FROM_PAINT), FROM_PAINT)
    x += far * crossing.sin + inward * cos - beside * sin
    y += -far * crossing.cos + inward * sin + beside * cos
    walk_towards(world, p, town.sign, x, y, cos, sin, 0.0, math.inf, time)
    if abs(walker.x - x) > READY or abs(walker.y - y) > READY:
        ready = False
    else:
        ready = _may_step(town, world, crossing, (FROM_PAINT + crossing.length + WALK_AHEAD) / walker.pace)
    if ready:
        walker.state, walker.waited, walker.speed = Walk.CROSSING, 0.0, 0.0
        _advance(crossing, walker)
    elif walker.waited > GIVES_UP:
        _leave(town, walker)


@inlined
def cross(town: TownArrays, world: WorldArrays, p: int, time: float) -> None:
    """Walks over a crosswalk, and back if a vehicle keeps obstructing it."""
    walker = world.pedestrians[p]
    crossing = town.crossings[walker.crossing]
    lateral = _advance(crossing, walker)
    if crossing.length - walker.station < CROSSED if walker.direction > 0.0 else walker.station < CROSSED:
        walker.mouth = 1 if walker.direction > 0.0 else 0
        _leave(town, walker)
        return
    cos, sin = walker.direction * crossing.cos, walker.direction * crossing.sin
    ahead = walker.station + walker.direction * WALK_AHEAD
    aside = town.sign * SIDE_KEPT
    x = crossing.x[0] + ahead * crossing.cos - aside * sin
    y = crossing.y[0] + ahead * crossing.sin + aside * cos
    if walk_towards(world, p, town.sign, x, y, cos, sin, walker.direction * lateral, HALF_DEPTH, time):
        walker.waited = 0.0
        return
    walker.waited += time
    if walker.waited > OBSTACLE_PATIENCE:
        walker.direction, walker.waited = -walker.direction, 0.0


@inlined
def _advance(crossing: CrossingRecord, walker: PedestrianRecord) -> float:
    """Updates the place of a pedestrian along a crosswalk; returns its offset to the right of the line [m]."""
    dx, dy = walker.x - crossing.x[0], walker.y - crossing.y[0]
    walker.station = dx * crossing.cos + dy * crossing.sin
    walker.height = crossing.height
    return float(dy * crossing.cos - dx * crossing.sin)


@inlined
def _leave(town: TownArrays, walker: PedestrianRecord) -> None:
    """Walks on along the pavement at the end of a crosswalk."""
    crossing = town.crossings[walker.crossing]
    walker.walk, walker.station = crossing.walk[walker.mouth], crossing.station[walker.mouth]
    find_segment(town, walker)
    walker.direction = 1.0 if draw(walker) < 0.5 else -1.0
    walker.state, walker.crossing, walker.waited, walker.speed = Walk.WALKING, NOBODY, -CROSSING_PAUSE, 0.0


@compiled
def _may_step(town: TownArrays, world: WorldArrays, crossing: CrossingRecord, time: float) -> bool:
    """Returns whether a pedestrian may step onto a crosswalk that takes some time to cross [s].

    All lights before it must be red until the pedestrian is across, and no vehicle may stand on it or come towards it
    too fast to stop with ease.
    """
    now = world.clock[0].time
    for k in range(crossing.light, crossing.light + crossing.lights):
        lane = town.neighbours[k]
        for share in range(3):
            if light(town, world, lane, now + 0.5 * share * time) != Colour.RED:
                return False
    for i in range(len(world.vehicles)):
        vehicle = world.vehicles[i]
        if vehicle.kind != Kind.EMPTY and _is_danger(vehicle, crossing):
            return False
    return True


@inlined
def _is_danger(vehicle: VehicleRecord, crossing: CrossingRecord) -> bool:
    """Returns whether a vehicle is on a crosswalk, or comes towards it too fast to stop with ease."""
    dx, dy = vehicle.x - crossing.x[0], vehicle.y - crossing.y[0]
    along = min(max(dx * crossing.cos + dy * crossing.sin, 0.0), crossing.length)
    dx, dy = crossing.x[0] + along * crossing.cos - vehicle.x, crossing.y[0] + along * crossing.sin - vehicle.y
    away = dx * dx + dy * dy
    if away > VEHICLES_SIGHT * VEHICLES_SIGHT or abs(vehicle.height - crossing.height) > LEVEL_HEIGHT:
        return False
    front = math.sqrt(away) - 0.5 * vehicle.length
    if front < HALF_DEPTH:
        return True
    if vehicle.speed < TRAFFIC_STANDING or (dx * vehicle.cos + dy * vehicle.sin < 0.0 and front > ROOM):
        return False  # the vehicle waits before the crosswalk, or has passed
    return bool(
        front < ROOM + EXPECTED_REACTION * vehicle.speed + vehicle.speed * vehicle.speed / (2.0 * EXPECTED_BRAKING)
    )


# --- Walking ----------------------------------------------------------------------------------------------------------

PACE = 5
"""Substeps between two decisions of a pedestrian."""

BLOCKED = 3.0
"""Time without a step after which a pedestrian turns round [s]."""

CORNER_REACH = 0.5
"""Distance before the end of a footway at which a pedestrian turns the corner [m]."""


@inlined
def walk(town: TownArrays, world: WorldArrays, dt: float) -> None:
    """Moves all pedestrians on by `dt` [s], and counts those on each crosswalk and those that stray."""
    clock, busy = world.clock[0], world.busy
    clock.straying = 0
    for c in range(len(busy)):
        busy[c] = 0
    for p in range(len(world.pedestrians)):
        walker = world.pedestrians[p]
        if walker.state == Walk.EMPTY:
            continue
        if not walker.crashed:
            if (clock.frame + p) % PACE == 0:
                _decide(town, world, p, PACE * dt)
            if walker.speed > 0.0:
                step = walker.speed * dt
                walker.x += walker.cos * step
                walker.y += walker.sin * step
                walker.odometer += step
        if walker.state == Walk.CROSSING:
            busy[walker.crossing] += 1
        elif walker.state == Walk.STRAYING:
            clock.straying += 1


@compiled
def _decide(town: TownArrays, world: WorldArrays, p: int, time: float) -> None:
    """Decides on the steps of a pedestrian for some time [s]."""
    walker = world.pedestrians[p]
    note_progress(walker, time)
    if walker.state == Walk.WALKING:
        _stroll(town, world, p, time)
    elif walker.state == Walk.WAITING:
        wait(town, world, p, time)
    elif walker.state == Walk.CROSSING:
        cross(town, world, p, time)
    else:
        stray(town, world, p, time)


@inlined
def _stroll(town: TownArrays, world: WorldArrays, p: int, time: float) -> None:
    """Walks along a footway, and onto the next one or back at its end."""
    walker = world.pedestrians[p]
    lateral = locate(town, walker)
    way = town.walks[walker.walk]
    if walker.station > way.length - CORNER_REACH if walker.direction > 0.0 else walker.station < CORNER_REACH:
        enter_next(town, walker)
        lateral = locate(town, walker)
        way = town.walks[walker.walk]
    if way.kind == Footway.STREET:
        if steps_out(town, world, walker, time):
            return
    elif walker.waited >= 0.0 and comes_to_crosswalk(town, walker, way, time):
        return
    x, y, cos, sin = place_beside(town, walker, walker.station + walker.direction * WALK_AHEAD, side_kept(town, way))
    if walk_towards(world, p, town.sign, x, y, cos, sin, walker.direction * lateral, way.half_width, time):
        walker.waited = min(walker.waited + time, 0.0)
        return
    walker.waited += time
    if walker.waited > BLOCKED:
        walker.direction, walker.waited = -walker.direction, 0.0


@compiled
def place_walker(town: TownArrays, walker: PedestrianRecord) -> None:
    """Places a pedestrian at its station on its footway and resets all but its random numbers."""
    walker.state, walker.crossing, walker.crashed, walker.mouth = Walk.WALKING, NOBODY, False, 0
    walker.waited, walker.staying, walker.crash_age, walker.far = 0.0, 0.0, 0.0, 0.0
    way = town.walks[walker.walk]
    find_segment(town, walker)
    walker.x, walker.y, walker.cos, walker.sin = place_beside(town, walker, walker.station, side_kept(town, way))
    locate(town, walker)
    walker.heading = pm.atan2(walker.sin, walker.cos)
    walker.left_x, walker.left_y = walker.x, walker.y
    walker.speed = 0.0
