"""Steps of pedestrians: towards a place, past each other, clear of vehicles and props."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dorothie_gym.maps.model import LEVEL_HEIGHT
from dorothie_gym.sim.state.codes import Kind, Walk
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import compiled, inlined

if TYPE_CHECKING:
    from dorothie_gym.sim.state.records import PedestrianRecord, SizedBody
    from dorothie_gym.sim.state.world_arrays import WorldArrays


WALKING_SPEED = 1.3
"""[m/s], the usual design value for pedestrians (MUTCD takes 1.1)."""

KERB = 1.6
"""Distance from the lane's edge at which pedestrians walk [m]."""

FROM_ENDS = 4.0
"""Distance from the ends of a lane at which pedestrians turn back [m]."""

FROM_JUNCTION = 12.0
"""Minimum distance from the ends of a lane at which pedestrians stray, so that they stay out of junctions [m]."""

WALK_STEP = 2.0
"""Step in which a walkway is looked for [m]."""

SHORTEST_WALK = 8.0
"""Shortest walkway [m]."""

CROSSING_RATE = 1 / 45
"""Rate at which a pedestrian begins to stray [1/s]."""

PERSONAL_SPACE = 0.7
"""Minimum distance of a step to a vehicle [m]."""

OBSTACLE_PATIENCE = 2.0
"""Time for which a pedestrian waits before a static obstacle until it turns back [s]."""

ELBOW_ROOM = 0.3
"""Minimum distance of a step to a prop [m]."""

SAFE_TIME = 5.0
"""Time gap to vehicles before stepping out [s]."""

SAFE_DISTANCE = 14.0
"""Distance to vehicles before stepping out [m]."""


# --- Steps ------------------------------------------------------------------------------------------------------------

WALK_AHEAD = 1.0
"""Distance ahead on the footway of the place that a pedestrian walks towards [m]."""

ARRIVED = 0.05
"""Distance to that place at which it is reached [m]."""

AVOIDING = 1.6
"""Distance within which pedestrians step out of each other's way [m]."""

PASSING_OFFSET = 0.05
"""Offset to the side that pedestrians keep to, at which another one is passed on the other side [m]."""

SPACE = 0.55
"""Minimum distance between pedestrians, from centre to centre [m]."""

WALKER_RADIUS, WALKER_SIZE = 0.354, 0.5
"""Half the diagonal and the side of a pedestrian's outline [m], `Pedestrian.LENGTH`."""

EDGE_MARGIN = 0.4
"""Distance from the edge of the footway up to which pedestrians step aside [m]: turning cars cut corners."""

SIGHT = 4.0
"""Distance up to which other pedestrians matter [m]."""

FORESIGHT = 0.3
"""Room beyond a step that is checked for vehicles [m]."""

PLACE = 3.0
"""Distance within which a pedestrian makes no progress [m]."""


@inlined
def note_progress(walker: PedestrianRecord, time: float) -> None:
    """Counts the time without progress of a pedestrian [s]."""
    walker.staying += time
    dx, dy = walker.x - walker.left_x, walker.y - walker.left_y
    if dx * dx + dy * dy > PLACE * PLACE:
        walker.left_x, walker.left_y, walker.staying = walker.x, walker.y, 0.0


@compiled
def walk_towards(
    world: WorldArrays,
    p: int,
    sign: float,
    x: float,
    y: float,
    cos: float,
    sin: float,
    lateral: float,
    half: float,
    time: float,
) -> bool:
    """Sets direction and speed of a pedestrian towards a place, if others leave room.

    Args:
        world: arrays of the world.
        p: the pedestrian.
        sign: that of the town's `DrivingSide`, to which pedestrians keep too.
        x: place [m].
        y: place [m].
        cos: cosine of the direction of its footway.
        sin: its sine.
        lateral: offset to the right of the centre of that footway [m].
        half: half the width of that footway [m].
        time: until the next decision [s].

    Returns:
        Whether it walks on, or has arrived; else it stands.
    """
    walker = world.pedestrians[p]
    walker.speed = 0.0
    dx, dy = x - walker.x, y - walker.y
    distance = math.sqrt(dx * dx + dy * dy)
    if distance < ARRIVED:
        return True
    step = min(walker.pace * time, distance)
    dx, dy = _past_others(world, p, sign, dx / distance, dy / distance, cos, sin, lateral)
    aside = lateral + (dy * cos - dx * sin) * step
    if abs(aside) > max(half - EDGE_MARGIN, 0.0) and abs(aside) > abs(lateral):
        # along the edge of the footway instead
        onward = 1.0 if dx * cos + dy * sin > 0.0 else -1.0
        dx, dy = onward * cos, onward * sin
    if _bumps(world, p, dx, dy, step, time):
        return False
    reach = walker.pace * time + FORESIGHT
    if _touches_vehicle(world, walker, walker.x + reach * dx, walker.y + reach * dy):
        return False
    walker.cos, walker.sin, walker.speed = dx, dy, step / time
    walker.heading = pm.atan2(dy, dx)
    return True


@inlined
def _past_others(
    world: WorldArrays, p: int, sign: float, cos: float, sin: float, way_cos: float, way_sin: float, lateral: float
) -> tuple[float, float]:
    """Returns the direction that leads past obstructing pedestrians, on the side with more room.

    Oncoming pedestrians, which keep to their side, are passed on that side, slower ones on the other. The arguments are
    as in `walk_towards`; the first direction is the one to the place.
    """
    walker = world.pedestrians[p]
    x, y = cos, sin
    for q in range(len(world.pedestrians)):
        other = world.pedestrians[q]
        dx, dy = other.x - walker.x, other.y - walker.y
        if abs(dx) > AVOIDING or abs(dy) > AVOIDING or q == p or other.state == Walk.EMPTY:
            continue
        push = sign * _push(dx, dy, 0.0, cos, sin)
        if sign * (lateral + dy * way_cos - dx * way_sin) > PASSING_OFFSET:
            push = -push
        x, y = x - push * sin, y + push * cos
    for q in range(len(world.props)):
        prop = world.props[q]
        dx, dy = prop.x - walker.x, prop.y - walker.y
        if abs(dx) > SIGHT or abs(dy) > SIGHT or not prop.present:
            continue
        push = sign * _push(dx, dy, 0.5 * (max(prop.length, prop.width) - WALKER_SIZE), cos, sin)
        if sign * (lateral + dy * way_cos - dx * way_sin) > PASSING_OFFSET:
            push = -push
        x, y = x - push * sin, y + push * cos
    length = math.sqrt(x * x + y * y)  # at least 1: others are avoided sideways
    return x / length, y / length


@inlined
def _push(dx: float, dy: float, radius: float, cos: float, sin: float) -> float:
    """Returns the weight of stepping aside for an obstructing body, 0 to 1."""
    gap = math.sqrt(dx * dx + dy * dy) - radius
    if gap > AVOIDING or dx * cos + dy * sin < 0.0:
        return 0.0
    return (AVOIDING - gap) / AVOIDING


@inlined
def _bumps(world: WorldArrays, p: int, cos: float, sin: float, step: float, time: float) -> bool:
    """Returns whether a step leads too close to another pedestrian, at its present or next position, or to a prop."""
    walker = world.pedestrians[p]
    x, y = walker.x + step * cos, walker.y + step * sin
    for q in range(len(world.pedestrians)):
        other = world.pedestrians[q]
        dx, dy = other.x - walker.x, other.y - walker.y
        if abs(dx) > AVOIDING or abs(dy) > AVOIDING or q == p or other.state == Walk.EMPTY:
            continue
        if abs(other.height - walker.height) > LEVEL_HEIGHT:
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
    """Returns whether a step leads closer to a vehicle that is close."""
    for i in range(len(world.vehicles)):
        vehicle = world.vehicles[i]
        if abs(walker.x - vehicle.x) > 6.0 or abs(walker.y - vehicle.y) > 6.0 or vehicle.kind == Kind.EMPTY:
            continue
        if abs(vehicle.height - walker.height) > LEVEL_HEIGHT:
            continue
        room = _room_beside(vehicle, x, y)
        if room < PERSONAL_SPACE and room < _room_beside(vehicle, walker.x, walker.y):
            return True
    return False


@inlined
def _room_beside(body: SizedBody, x: float, y: float) -> float:
    """Returns the distance of a place from a body's outline, along its length or its width [m]; negative inside."""
    dx, dy = x - body.x, y - body.y
    along = abs(dx * body.cos + dy * body.sin) - 0.5 * body.length
    return float(max(along, abs(dy * body.cos - dx * body.sin) - 0.5 * body.width))
