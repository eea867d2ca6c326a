"""Steps of people on foot: past one another, and not into anybody or anything."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dorothie_gym.compilation import compiled, inlined
from dorothie_gym.sim.state.codes import Kind, Walk
from dorothie_gym.sim.state.records import PedestrianRecord, SizedBody

if TYPE_CHECKING:
    from dorothie_gym.sim.state.world_arrays import WorldArrays


WALKING_SPEED = 1.3
"""[m/s], the usual design value for pedestrians (MUTCD takes 1.1)."""

KERB = 1.6
"""Distance from the lane's edge at which they walk [m]."""

FROM_ENDS = 4.0
"""How far from the ends of a lane they turn back [m]."""

FROM_JUNCTION = 12.0
"""How far from the ends of a lane they cross, so that they do not walk into a junction [m]."""

WALK_STEP = 2.0
"""Step in which a walkway is looked for [m]."""

SHORTEST_WALK = 8.0
"""Shortest walkway [m]."""

CROSSING_RATE = 1 / 45
"""How often a pedestrian wants to cross [1/s]."""

PERSONAL_SPACE = 0.7
"""How close to a vehicle they step [m]."""

PATIENCE = 2.0
"""How long they stand before a vehicle, a prop or somebody else that does not move before they turn back [s]."""

ELBOW_ROOM = 0.3
"""How close to a prop or to somebody else they step [m]."""

SAFE_TIME = 5.0
"""Time gap to vehicles that they want before stepping out [s]."""

SAFE_DISTANCE = 14.0
"""And distance [m]."""


# --- Steps of people on foot: past one another, and not into anybody or anything -------------------------------------

AHEAD = 1.0
"""People walk towards a place on their way this far ahead [m]."""

ARRIVED = 0.05
"""Who is this close to where it walks is there [m]."""

AVOIDING = 1.6
"""Within this distance people step out of each other's way [m] ..."""

BESIDE = 0.05
"""... to the right, unless the other one is further than this to the right of the middle of the way [m]."""

SPACE = 0.55
"""And never come closer than this, from middle to middle [m]."""

SIZE = 0.5
"""Length and width of somebody [m], `Pedestrian.LENGTH`."""

MARGIN = 0.4
"""Nobody steps aside beyond this distance from the edge of the way [m]: cars that turn cut corners."""

SIGHT = 4.0
"""Others who are further away are not looked at [m]."""

FORESIGHT = 0.3
"""Room that one looks ahead beyond a step for vehicles [m]."""

LEVEL = 2.5
"""Who is further above or below is on another way [m]."""

PLACE = 3.0
"""Who stays within this distance does not get on [m]."""


@inlined
def note_progress(walker: PedestrianRecord, time: float) -> None:
    """Counts for how long somebody has not got on [s]."""
    walker.staying += time
    dx, dy = walker.x - walker.left_x, walker.y - walker.left_y
    if dx * dx + dy * dy > PLACE * PLACE:
        walker.left_x, walker.left_y, walker.staying = walker.x, walker.y, 0.0


@compiled
def walk_towards(
    world: WorldArrays, p: int, x: float, y: float, cos: float, sin: float, lateral: float, half: float, time: float
) -> bool:
    """Sets direction and speed of a pedestrian so as to come towards a place, if others leave room.

    Args:
        world: arrays of the world.
        p: the pedestrian.
        x: place [m].
        y: place [m].
        cos: direction of the way on which it walks.
        sin: see there.
        lateral: how far to the right of the middle of that way it is [m].
        half: half the width of that way [m].
        time: until the next decision [s].

    Returns:
        Whether it walks on, or is there; else it stands.
    """
    walker = world.pedestrians[p]
    walker.speed = 0.0
    dx, dy = x - walker.x, y - walker.y
    distance = math.sqrt(dx * dx + dy * dy)
    if distance < ARRIVED:
        return True
    step = min(walker.pace * time, distance)
    dx, dy = _past_others(world, p, dx / distance, dy / distance, cos, sin, lateral)
    aside = lateral + (dy * cos - dx * sin) * step
    if abs(aside) > max(half - MARGIN, 0.0) and abs(aside) > abs(lateral):
        # along the edge of the way instead
        onward = 1.0 if dx * cos + dy * sin > 0.0 else -1.0
        dx, dy = onward * cos, onward * sin
    if _bumps(world, p, dx, dy, step, time):
        return False
    reach = walker.pace * time + FORESIGHT
    if _touches_vehicle(world, walker, walker.x + reach * dx, walker.y + reach * dy):
        return False
    walker.cos, walker.sin, walker.speed = dx, dy, step / time
    walker.heading = math.atan2(dy, dx)
    return True


@inlined
def _past_others(
    world: WorldArrays, p: int, cos: float, sin: float, way_cos: float, way_sin: float, lateral: float
) -> tuple[float, float]:
    """Direction that leads past those who are in the way, on the side of the way on which there is more room.

    So those who come towards one, who keep to their right, are passed on the right, and those who are slower on the
    left. The arguments are as of `walk_towards`, the first direction is the one to the place.
    """
    walker = world.pedestrians[p]
    x, y = cos, sin
    for q in range(len(world.pedestrians)):
        other = world.pedestrians[q]
        dx, dy = other.x - walker.x, other.y - walker.y
        if abs(dx) > AVOIDING or abs(dy) > AVOIDING or q == p or other.state == Walk.EMPTY:
            continue
        push = _push(dx, dy, 0.0, cos, sin)
        if lateral + dy * way_cos - dx * way_sin > BESIDE:
            push = -push
        x, y = x - push * sin, y + push * cos
    for q in range(len(world.props)):
        prop = world.props[q]
        dx, dy = prop.x - walker.x, prop.y - walker.y
        if abs(dx) > SIGHT or abs(dy) > SIGHT or not prop.present:
            continue
        push = _push(dx, dy, 0.5 * (max(prop.length, prop.width) - SIZE), cos, sin)
        if lateral + dy * way_cos - dx * way_sin > BESIDE:
            push = -push
        x, y = x - push * sin, y + push * cos
    length = math.sqrt(x * x + y * y)  # at least 1: whoever is avoided is avoided sideways
    return x / length, y / length


@inlined
def _push(dx: float, dy: float, radius: float, cos: float, sin: float) -> float:
    """How much something in the way makes one step aside, 0 to 1."""
    gap = math.sqrt(dx * dx + dy * dy) - radius
    if gap > AVOIDING or dx * cos + dy * sin < 0.0:
        return 0.0
    return (AVOIDING - gap) / AVOIDING


@inlined
def _bumps(world: WorldArrays, p: int, cos: float, sin: float, step: float, time: float) -> bool:
    """Whether a step leads closer to somebody, where it is or goes, or to a prop, than one comes."""
    walker = world.pedestrians[p]
    x, y = walker.x + step * cos, walker.y + step * sin
    for q in range(len(world.pedestrians)):
        other = world.pedestrians[q]
        dx, dy = other.x - walker.x, other.y - walker.y
        if abs(dx) > AVOIDING or abs(dy) > AVOIDING or q == p or other.state == Walk.EMPTY:
            continue
        if abs(other.height - walker.height) > LEVEL:
            continue
        now = dx * dx + dy * dy
        ahead = 0.0 if other.crashed else other.speed * time
        for reach in (0.0, ahead):
            gone_x, gone_y = other.x + reach * other.cos - x, other.y + reach * other.sin - y
            then = gone_x * gone_x + gone_y * gone_y
            if then < SPACE * SPACE and then < now:
                return True
    for q in range(len(world.props)):
        prop = world.props[q]
        if not prop.present or abs(prop.x - x) > SIGHT or abs(prop.y - y) > SIGHT:
            continue
        room = _room_beside(prop, x, y)
        if room < ELBOW_ROOM and room < _room_beside(prop, walker.x, walker.y):
            return True
    return False


@inlined
def _touches_vehicle(world: WorldArrays, walker: PedestrianRecord, x: float, y: float) -> bool:
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


@inlined
def _room_beside(body: SizedBody, x: float, y: float) -> float:
    """How far outside of a body's outline a place is, along its length or its width [m]; negative inside."""
    dx, dy = x - body.x, y - body.y
    along = abs(dx * body.cos + dy * body.sin) - 0.5 * body.length
    return float(max(along, abs(dy * body.cos - dx * body.sin) - 0.5 * body.width))
