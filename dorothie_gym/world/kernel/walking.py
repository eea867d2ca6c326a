"""People on foot: they walk along pavements, and now and then over a crosswalk once vehicles can stop for them.

Everybody decides anew every `PACE` substeps, in turns, and walks straight on in between.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dorothie_gym.world.kernel.compiling import compiled, inlined
from dorothie_gym.world.kernel.randomness import draw
from dorothie_gym.world.kernel.records import NOBODY, Kind, Records, Walk
from dorothie_gym.world.pedestrians import PATIENCE, PERSONAL_SPACE

if TYPE_CHECKING:
    from dorothie_gym.world.kernel.town_arrays import TownArrays
    from dorothie_gym.world.kernel.world_arrays import WorldArrays

PACE = 5
"""Substeps between two decisions of a pedestrian."""

CROSSING_SHARE = 0.35
"""How often somebody who passes a crosswalk wants to cross."""

WAITING_PATIENCE = 45.0
"""Who has been waiting at a crosswalk for this long walks on [s]."""

ROOM = 1.0
"""Distance that is kept to who walks in front [m]."""

STOPS_BY = 2.5
"""Deceleration that is asked of vehicles which have to stop for somebody who steps out [m/s^2]."""

REACTION_ROOM = 8.0
"""Room beyond the braking distance that one wants before one steps out [m]."""

LEVEL = 2.5
"""Vehicles further above or below are on another road [m]."""


@inlined
def walk(town: TownArrays, world: WorldArrays, dt: float) -> None:
    """Moves all pedestrians on by `dt` [s], and counts who is on which crosswalk."""
    frame = world.clock[0].frame
    for p in range(len(world.pedestrians)):
        walker = world.pedestrians[p]
        if walker.state == Walk.EMPTY:
            continue
        if (frame + p) % PACE == 0:
            _decide(town, world, p, PACE * dt)
        if walker.speed > 0.0:
            step = walker.speed * dt
            walker.x += walker.cos * step
            walker.y += walker.sin * step
            walker.odometer += step
    for c in range(len(world.busy)):
        world.busy[c] = 0
    for p in range(len(world.pedestrians)):
        if world.pedestrians[p].state == Walk.CROSSING:
            world.busy[world.pedestrians[p].crossing] += 1


@compiled
def _decide(town: TownArrays, world: WorldArrays, p: int, time: float) -> None:
    """What a pedestrian does for some time [s]."""
    walker = world.pedestrians[p]
    if walker.state == Walk.WAITING:
        walker.waited += time
        if _is_clear(town, world, town.crossings[walker.crossing]):
            walker.state, walker.waited = Walk.CROSSING, 0.0
            crossing = town.crossings[walker.crossing]
            walker.station = 0.0 if walker.direction > 0.0 else crossing.length
        elif walker.waited > WAITING_PATIENCE:
            _stay(town, walker)
        return
    if walker.state == Walk.CROSSING:
        _cross(town, world, walker, time)
    else:
        _stroll(town, world, p, time)


@compiled
def _stroll(town: TownArrays, world: WorldArrays, p: int, time: float) -> None:
    """Walks along a pavement, and onto the next one or back at its end."""
    walker = world.pedestrians[p]
    way = town.walks[walker.walk]
    if _wants_to_cross(town, walker, way, walker.pace * time):
        return
    step = _free_way(world, p, walker.pace * time)
    walker.station += walker.direction * step
    if walker.station < 0.0 or walker.station > way.length:
        end = 0 if walker.station < 0.0 else 1
        if way.next_walk[end] >= 0:
            walker.walk, first = way.next_walk[end], way.next_end[end] == 0
            way = town.walks[walker.walk]
            walker.direction = 1.0 if first else -1.0
            walker.station, walker.segment = 0.0 if first else way.length, way.first
        else:
            walker.direction = -walker.direction
            walker.station = min(max(walker.station, 0.0), way.length)
    x, y = pavement(town, walker)
    _head_for(walker, x, y, time)


@compiled
def pavement(town: TownArrays, walker: Records) -> tuple[float, float]:
    """Where a pedestrian at a station of a pavement is: to the right of its middle [m]."""
    way, points = town.walks[walker.walk], town.walk_points
    k = min(max(walker.segment, way.first), way.last - 1)
    while k < way.last - 1 and points[k + 1, 2] <= walker.station:
        k += 1
    while k > way.first and points[k, 2] > walker.station:
        k -= 1
    walker.segment = k
    dx, dy = points[k + 1, 0] - points[k, 0], points[k + 1, 1] - points[k, 1]
    length = points[k + 1, 2] - points[k, 2]
    share = (walker.station - points[k, 2]) / length
    aside = walker.direction * walker.aside / length
    walker.height = points[k, 4] + share * (points[k + 1, 4] - points[k, 4])
    return points[k, 0] + share * dx - aside * dy, points[k, 1] + share * dy + aside * dx


@compiled
def _head_for(walker: Records, x: float, y: float, time: float) -> None:
    """Walks so as to be at a place after some time [s]."""
    dx, dy = x - walker.x, y - walker.y
    length = math.sqrt(dx * dx + dy * dy)
    # whoever turns a corner is not faster for it, and comes to its place a little later
    walker.speed = min(length / time, 1.5 * walker.pace)
    if length > 1e-6:
        walker.cos, walker.sin = dx / length, dy / length
        walker.heading = math.atan2(walker.sin, walker.cos)


@compiled
def _free_way(world: WorldArrays, p: int, step: float) -> float:
    """How far one may step without running into who walks in front [m]."""
    walker = world.pedestrians[p]
    for q in range(len(world.pedestrians)):
        other = world.pedestrians[q]
        if q == p or other.walk != walker.walk or other.state != Walk.WALKING or other.direction != walker.direction:
            continue
        gap = (other.station - walker.station) * walker.direction
        if (0.0 < gap or (gap == 0.0 and q > p)) and gap < ROOM + step:
            step = min(step, max(gap - ROOM, 0.0))
    return step


@compiled
def _wants_to_cross(town: TownArrays, walker: Records, way: Records, step: float) -> bool:
    """Whether one stops at a crosswalk that is passed with the next step, to wait there."""
    for m in range(way.mouth, way.mouth + way.mouths):
        mouth = town.mouths[m]
        left = (mouth.station - walker.station) * walker.direction
        if 0.0 <= left < step and draw(walker) < CROSSING_SHARE:
            walker.state, walker.crossing, walker.waited = Walk.WAITING, mouth.crossing, 0.0
            walker.direction = 1.0 if mouth.end == 0 else -1.0
            walker.mouth = mouth.end
            walker.speed = 0.0
            return True
    return False


@compiled
def _stay(town: TownArrays, walker: Records) -> None:
    """Walks on along the pavement where one has been waiting, or come to."""
    crossing = town.crossings[walker.crossing]
    walker.walk, walker.station = crossing.walk[walker.mouth], crossing.station[walker.mouth]
    walker.segment = town.walks[walker.walk].first
    walker.direction = 1.0 if draw(walker) < 0.5 else -1.0
    # beyond the mouth, lest one turns round at once
    walker.station += walker.direction * 1e-3
    walker.state, walker.crossing = Walk.WALKING, NOBODY


@compiled
def _cross(town: TownArrays, world: WorldArrays, walker: Records, time: float) -> None:
    """Walks over a crosswalk; back again if a vehicle does not leave the way."""
    crossing = town.crossings[walker.crossing]
    step = walker.pace * time
    ahead = walker.station + walker.direction * (step + 0.3)
    if _would_touch(world, walker, *_on(crossing, ahead)):
        walker.speed = 0.0
        walker.waited += time
        if walker.waited > PATIENCE:
            walker.direction, walker.waited = -walker.direction, 0.0
            walker.mouth = 1 - walker.mouth
        return
    walker.waited = 0.0
    walker.station += walker.direction * step
    if walker.station <= 0.0 or walker.station >= crossing.length:
        walker.mouth = 0 if walker.station <= 0.0 else 1
        _stay(town, walker)
        x, y = pavement(town, walker)
    else:
        x, y = _on(crossing, walker.station)
        walker.height = crossing.height
    _head_for(walker, x, y, time)


@compiled
def _on(crossing: Records, station: float) -> tuple[float, float]:
    return crossing.x[0] + station * crossing.cos, crossing.y[0] + station * crossing.sin


@compiled
def _would_touch(world: WorldArrays, walker: Records, x: float, y: float) -> bool:
    """Whether a step leads closer to a vehicle that is close: nobody walks into the side of a car."""
    for i in range(len(world.vehicles)):
        vehicle = world.vehicles[i]
        if abs(walker.x - vehicle.x) > 6.0 or abs(walker.y - vehicle.y) > 6.0 or vehicle.kind == Kind.EMPTY:
            continue
        if abs(vehicle.height - walker.height) > LEVEL:
            continue
        room = _room_beside(vehicle, x, y)
        if room < PERSONAL_SPACE and room < _room_beside(vehicle, walker.x, walker.y):
            return True
    return False


@compiled
def _room_beside(vehicle: Records, x: float, y: float) -> float:
    """How far outside of a vehicle's outline a place is, along its length or its width [m]; negative inside."""
    dx, dy = x - vehicle.x, y - vehicle.y
    along = abs(dx * vehicle.cos + dy * vehicle.sin) - 0.5 * vehicle.length
    return float(max(along, abs(dy * vehicle.cos - dx * vehicle.sin) - 0.5 * vehicle.width))


@compiled
def _is_clear(town: TownArrays, world: WorldArrays, crossing: Records) -> bool:
    """Whether all vehicles that come to a crosswalk can stop before it with ease, and none stands on it."""
    x = 0.5 * (crossing.x[0] + crossing.x[1])
    y = 0.5 * (crossing.y[0] + crossing.y[1])
    half = 0.5 * crossing.length
    for i in range(len(world.vehicles)):
        vehicle = world.vehicles[i]
        if vehicle.kind == Kind.EMPTY or abs(vehicle.height - crossing.height) > LEVEL:
            continue
        dx, dy = x - vehicle.x, y - vehicle.y
        reach = half + REACTION_ROOM + vehicle.speed * vehicle.speed / (2.0 * STOPS_BY)
        if abs(dx) > reach or abs(dy) > reach:
            continue
        along = abs(dx * crossing.cos + dy * crossing.sin)
        across = abs(dy * crossing.cos - dx * crossing.sin)
        if along < half + 1.0 and across < 1.5 + 0.5 * vehicle.length:
            return False  # on it
        if vehicle.speed > 1.0 and dx * vehicle.cos + dy * vehicle.sin > 0.0 and dx * dx + dy * dy < reach * reach:
            return False
    return True


@compiled
def place_walker(town: TownArrays, walker: Records) -> None:
    """Puts a pedestrian where its pavement and station say."""
    walker.state, walker.crossing, walker.crashed = Walk.WALKING, NOBODY, False
    walker.segment = town.walks[walker.walk].first
    walker.x, walker.y = pavement(town, walker)
    points = town.walk_points
    heading = points[walker.segment, 3] if walker.direction > 0.0 else points[walker.segment, 3] + math.pi
    walker.heading, walker.cos, walker.sin = heading, math.cos(heading), math.sin(heading)
    walker.speed = 0.0
