"""Obstacles of the ego: bodies on its path, and bodies about to enter it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from dorothie_gym.maps.model import LEVEL_HEIGHT
from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.sim.ego.path import WIDEST_SWEEP, point_at
from dorothie_gym.sim.ego.path_builder import PATH_SPACING, height_at_point
from dorothie_gym.sim.state.codes import STATIC
from dorothie_gym.support.compilation import compiled, inlined

if TYPE_CHECKING:
    from dorothie_gym.sim.state.records import EgoRecord, SeenRecord
    from dorothie_gym.sim.state.town_arrays import TownArrays
    from dorothie_gym.sim.state.world_arrays import WorldArrays


LOOKAHEAD = 45.0
"""Distance up to which the path is checked [m]."""

SIDE_MARGIN = 0.35
"""Room kept beside the ego [m]."""

CROSSING = 0.35
"""Sine of the minimum angle to the path at which a moving body counts as crossing it."""

BRAKE_DELAY = 0.4
"""Time until the brakes act [s]."""

STANDSTILL_GAP = 2.5
"""Gap left to a standing body [m]."""

ROADBLOCK_GAP = 12.5
"""Gap left to a prop [m]: room for a U-turn (`limits.U_TURN_REACH` from the ego's centre)."""

EGO_LINE_GAP = 1.5
"""Gap left to the line before a junction [m]."""

TIGHT_GAP = 1.0
"""Gap left to a standing body during a U-turn or lane switch [m]."""

HARD_BRAKING = 4.0
"""Deceleration assumed for the safe speed [m/s^2]."""


@dataclass(frozen=True, kw_only=True)
class PerceivedBody:
    """A perceived body.

    Attributes:
        key: identifies the body, the same over time.
        kind: its object class.
        x, y: position of its centre [m].
        heading: [rad].
        length: [m].
        width: [m].
        speed: along its heading [m/s].
        height: height of the road it is on [m].
    """

    key: int
    kind: ObjectClass
    x: float
    y: float
    heading: float
    length: float
    width: float
    speed: float
    height: float


@dataclass(frozen=True, kw_only=True)
class Hazard:
    """Cause of a hazard stop: its class, and the gap from the ego's nose to it [m]."""

    kind: ObjectClass
    gap: float


# --- Bodies on the path -----------------------------------------------------------------------------------------------

INSTANTS, INSTANT = 4, 0.5
"""Number of times at which moving bodies are checked against the path, now the first, and their distance [s]."""

MOVING = 0.2
"""Speed below which a body counts as standing [m/s]."""

SLOW_BODY = 0.5
"""Speed of a body below which the ego may pass close to it in a manoeuvre [m/s]."""

SHORTEST_STOP = 0.05
"""Minimum stopping distance assumed by the braking controller [m]."""


@inlined
def room(kind: int, gap: float, speed: float, tight: bool, line: bool) -> float:
    """Returns the distance to the place where the ego stops for a body or line [m]."""
    if line:
        margin = EGO_LINE_GAP
    elif tight and speed < SLOW_BODY:
        margin = TIGHT_GAP
    else:
        margin = ROADBLOCK_GAP if kind == STATIC else STANDSTILL_GAP
    return max(gap - margin, 0.0)


@inlined
def safe_speed(speed: float, left: float, friction: float) -> float:
    """Returns the speed from which the ego can still stop.

    Args:
        speed: speed of the body ahead, along the path [m/s].
        left: room to it [m].
        friction: share of the dry road's grip.
    """
    slack = HARD_BRAKING * friction * BRAKE_DELAY
    return -slack + math.sqrt(slack * slack + speed * speed + 2.0 * HARD_BRAKING * friction * left)


@inlined
def offer(car: EgoRecord, best: float, kind: int, gap: float, speed: float, key: int, tight: bool, line: bool) -> float:
    """Records a body or line as the ego's limit if it allows less speed than `best` [m/s]; returns the lower speed."""
    safe = safe_speed(speed, room(kind, gap, speed, tight, line), 1.0)
    if safe >= best:
        return best
    car.kind, car.gap, car.ahead_speed, car.other, car.tight, car.line = kind, gap, speed, key, tight, line
    return safe


@inlined
def bodies_ahead(town: TownArrays, world: WorldArrays, seen: int) -> float:
    """Finds the body on or about to enter the path that allows the lowest speed; records the distance of a roadblock.

    Args:
        town: arrays of the town.
        world: arrays of the world.
        seen: number of perceived bodies.

    Returns:
        The speed that it allows [m/s], infinite if there is none.
    """
    car, vehicle = world.car[0], world.vehicles[0]
    tight = bool(world.course[car.at].manoeuvre)
    speed = vehicle.speed
    reach = max(LOOKAHEAD, speed * BRAKE_DELAY + speed * speed / (2.0 * HARD_BRAKING) + ROADBLOCK_GAP)
    last, near = point_at(world, car.s + reach), point_at(world, car.s + LOOKAHEAD)
    car.roadblock = math.inf
    best = math.inf
    if last - car.at < 1:
        return best
    far = world.course[last].s - car.s + vehicle.length
    for n in range(seen):
        body = world.seen[n]
        if math.sqrt(body.distance2) > far + 2.0 * abs(body.speed) + body.length:
            continue
        k, gap, along = _meet(town, world, body, last)
        if k < 0:
            continue
        if body.kind == STATIC and k <= near:
            car.roadblock = min(car.roadblock, gap + 0.5 * vehicle.length)
        best = offer(car, best, int(body.kind), gap, along, int(body.key), tight, False)
    return best


@compiled
def _meet(town: TownArrays, world: WorldArrays, body: SeenRecord, last: int) -> tuple[int, float, float]:
    """Returns the first place of the path where the ego would touch a body, now or on the body's course.

    Skips points that are closer to each other than to the body.

    Returns:
        Number of the point (-1 for none), gap from the ego's nose [m], and the body's speed along the path [m/s].
    """
    car, vehicle, course = world.car[0], world.vehicles[0], world.course
    radius = 0.5 * math.sqrt(body.length * body.length + body.width * body.width)
    side = radius + WIDEST_SWEEP + SIDE_MARGIN
    reach = math.sqrt(side * side + (radius + PATH_SPACING) * (radius + PATH_SPACING))
    for instant in range(INSTANTS if body.speed > MOVING else 1):
        way = instant * INSTANT * body.speed
        x, y = body.x + way * body.cos, body.y + way * body.sin
        k = int(car.at)
        while k <= last:
            point = course[k]
            dx, dy = x - point.x, y - point.y
            away = math.sqrt(dx * dx + dy * dy) - reach
            if away > PATH_SPACING:
                k = _skip(world, k, last, away)
                continue
            sweep = world.sweeps[k - car.first]
            parallel = abs(body.cos * sweep.cos + body.sin * sweep.sin)
            square = abs(body.sin * sweep.cos - body.cos * sweep.sin)
            half_width = 0.5 * (body.width * parallel + body.length * square) + SIDE_MARGIN
            half_length = 0.5 * (body.length * parallel + body.width * square)
            along = dx * sweep.cos + dy * sweep.sin
            across = dy * sweep.cos - dx * sweep.sin
            swept = half_width + (sweep.right if across > 0.0 else sweep.left)
            touches = abs(across) <= swept and abs(along) <= half_length + PATH_SPACING
            # bodies that move along the path are checked where they are now
            touches = touches and abs(height_at_point(town, world, k) - body.height) <= LEVEL_HEIGHT
            if touches and (instant == 0 or square >= CROSSING):
                gap = point.s - car.s + along - half_length - 0.5 * vehicle.length
                forward = body.speed * (body.cos * sweep.cos + body.sin * sweep.sin)
                return k, gap, max(forward, 0.0) if instant == 0 else 0.0
            k += 1
    return -1, 0.0, 0.0


@inlined
def _skip(world: WorldArrays, k: int, last: int, away: float) -> int:
    """Returns the next point of the path that is at least `away` [m] further along it."""
    course = world.course
    target = course[k].s + away
    step = int(away / PATH_SPACING)
    while k + step <= last and step > 1 and course[k + step].s > target:
        step -= 1
    return k + max(step, 1)
