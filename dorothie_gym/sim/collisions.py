"""Collision detection: sort and sweep along one axis, then separating axes of the outlines.

The bodies stay sorted from substep to substep, so that sorting them again takes about one comparison for each (Cohen,
Lin, Manocha and Ponamgi 1995, "I-COLLIDE"). The axis is oblique to the usual streets, along which many bodies share a
coordinate.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from dorothie_gym.maps.model import LEVEL_HEIGHT
from dorothie_gym.sim.pedestrians.pacing import WALKER_RADIUS, WALKER_SIZE
from dorothie_gym.sim.state.codes import PEDESTRIAN_CLASS, STATIC, VEHICLES, EventCode, Kind, Walk
from dorothie_gym.sim.state.world_arrays import log
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import compiled, inlined

if TYPE_CHECKING:
    from highway_env.vehicle.objects import RoadObject

    from dorothie_gym.sim.state.records import PlacedBody, VehicleRecord
    from dorothie_gym.sim.state.world_arrays import WorldArrays


AXIS_X, AXIS_Y = 0.8, 0.6
"""Direction along which bodies are sorted."""

OWN_FAULT_SPEED = 0.5
"""Speed below which the ego is not at fault for a collision [m/s]."""


@compiled
def overlap(
    dx: float,
    dy: float,
    cos: float,
    sin: float,
    length: float,
    width: float,
    other_cos: float,
    other_sin: float,
    other_length: float,
    other_width: float,
) -> bool:
    """Returns whether two rectangles touch: no axis of either separates them (Gottschalk, Lin and Manocha 1996).

    Args:
        dx: offset of the centre of the second from that of the first along x [m].
        dy: the same along y [m].
        cos: cosine of the direction of the first.
        sin: its sine.
        length: length of the first along its direction [m].
        width: its width across that [m].
        other_cos: cosine of the direction of the second.
        other_sin: its sine.
        other_length: length of the second [m].
        other_width: width of the second [m].
    """
    parallel = abs(cos * other_cos + sin * other_sin)
    square = abs(cos * other_sin - sin * other_cos)
    a, b, c, d = 0.5 * length, 0.5 * width, 0.5 * other_length, 0.5 * other_width
    if abs(dx * cos + dy * sin) > a + c * parallel + d * square:
        return False
    if abs(dy * cos - dx * sin) > b + c * square + d * parallel:
        return False
    if abs(dx * other_cos + dy * other_sin) > c + a * parallel + b * square:
        return False
    return bool(abs(dy * other_cos - dx * other_sin) <= d + a * square + b * parallel)


@inlined
def collide(world: WorldArrays) -> None:
    """Marks all vehicles and pedestrians that touch another body as crashed."""
    vehicles, walkers = len(world.vehicles), len(world.pedestrians)
    keys, order = world.keys, world.order
    largest = _project_all(world)
    for k in range(1, len(order)):
        body = order[k]
        key = keys[body]
        at = k
        while at > 0 and (keys[order[at - 1]] > key or (keys[order[at - 1]] == key and order[at - 1] > body)):
            order[at] = order[at - 1]
            at -= 1
        order[at] = body
    for k in range(len(order)):
        one = order[k]
        if keys[one] == math.inf:
            break
        limit = keys[one] + _radius(world, one) + largest
        for m in range(k + 1, len(order)):
            other = order[m]
            if keys[other] > limit:
                break
            if one < vehicles or other < vehicles:
                _meet(world, min(one, other), max(one, other), vehicles, walkers)


@inlined
def _project_all(world: WorldArrays) -> float:
    """Writes down where all bodies are along the axis [m]; returns the largest half of a diagonal [m]."""
    keys, largest = world.keys, WALKER_RADIUS
    body = 0
    for i in range(len(world.vehicles)):
        vehicle = world.vehicles[i]
        keys[body] = math.inf
        if vehicle.kind != Kind.EMPTY:
            keys[body] = AXIS_X * vehicle.x + AXIS_Y * vehicle.y
            largest = max(largest, vehicle.radius)
        body += 1
    for p in range(len(world.pedestrians)):
        walker = world.pedestrians[p]
        keys[body] = math.inf if walker.state == Walk.EMPTY else AXIS_X * walker.x + AXIS_Y * walker.y
        body += 1
    for p in range(len(world.props)):
        prop = world.props[p]
        keys[body] = math.inf
        if prop.present:
            keys[body] = AXIS_X * prop.x + AXIS_Y * prop.y
            largest = max(largest, prop.radius)
        body += 1
    return largest


@inlined
def _radius(world: WorldArrays, body: int) -> float:
    if body < len(world.vehicles):
        return float(world.vehicles[body].radius)
    body -= len(world.vehicles)
    if body < len(world.pedestrians):
        return WALKER_RADIUS
    return float(world.props[body - len(world.pedestrians)].radius)


@compiled
def _meet(world: WorldArrays, one: int, other: int, vehicles: int, walkers: int) -> None:
    """Marks a vehicle and another body as crashed if they touch."""
    vehicle, clock = world.vehicles[one], world.clock[0]
    if vehicle.kind == Kind.DRIVEN:
        _touch_by_car(world, other, vehicles, walkers)
    elif other < vehicles:
        second = world.vehicles[other]
        if _touch(vehicle, second, second.radius, second.length, second.width):
            if not (vehicle.crashed and second.crashed):
                clock.collisions += 1
            vehicle.crashed = second.crashed = True
    elif other < vehicles + walkers:
        walker = world.pedestrians[other - vehicles]
        if not walker.crashed and _touch(vehicle, walker, WALKER_RADIUS, WALKER_SIZE, WALKER_SIZE):
            walker.crashed = True
            clock.run_over += 1
            if vehicle.kind == Kind.EGO:
                vehicle.crashed = True  # traffic drives on; only externally driven vehicles are marked
    else:
        prop = world.props[other - vehicles - walkers]
        if _touch(vehicle, prop, prop.radius, prop.length, prop.width):
            if not vehicle.crashed:
                clock.collisions += 1
            vehicle.crashed = True


@compiled
def _touch_by_car(world: WorldArrays, other: int, vehicles: int, walkers: int) -> None:
    """Logs each body that the ego touches once, and stops both; a prop is removed."""
    vehicle = world.vehicles[0]
    if other < vehicles:
        second = world.vehicles[other]
        if second.touched or not _touch(vehicle, second, second.radius, second.length, second.width):
            return
        second.touched = second.crashed = True
        second.speed = 0.0  # else it would continue through the car
        _book(world, VEHICLES, int(second.key), other, second.x, second.y)
    elif other < vehicles + walkers:
        walker = world.pedestrians[other - vehicles]
        if walker.crashed or not _touch(vehicle, walker, WALKER_RADIUS, WALKER_SIZE, WALKER_SIZE):
            return
        walker.crashed = True
        world.clock[0].run_over += 1
        _book(world, PEDESTRIAN_CLASS, int(walker.key), other - vehicles, walker.x, walker.y)
    else:
        prop = world.props[other - vehicles - walkers]
        if not _touch(vehicle, prop, prop.radius, prop.length, prop.width):
            return
        prop.present = False
        _book(world, STATIC, int(prop.key), other - vehicles - walkers, prop.x, prop.y)


@compiled
def _book(world: WorldArrays, kind: int, key: int, body: int, x: float, y: float) -> None:
    """Logs a collision: it is the ego's own fault if it drove towards the other body."""
    car, vehicle, clock = world.car[0], world.vehicles[0], world.clock[0]
    event = world.events[log(world, EventCode.COLLISION, kind, key, car.before)]
    event.frame, event.body = clock.frame + 1, body
    event.own = bool(
        car.before > OWN_FAULT_SPEED and (x - vehicle.x) * vehicle.cos + (y - vehicle.y) * vehicle.sin > 0.0
    )
    if event.own:
        car.collisions += 1
    vehicle.speed = 0.0
    car.stopped_until = clock.frame + 1 + car.collision_stop


@inlined
def _touch(vehicle: VehicleRecord, other: PlacedBody, radius: float, length: float, width: float) -> bool:
    dx, dy = other.x - vehicle.x, other.y - vehicle.y
    reach = vehicle.radius + radius
    if dx * dx + dy * dy > reach * reach or abs(other.height - vehicle.height) > LEVEL_HEIGHT:
        return False
    return overlap(dx, dy, vehicle.cos, vehicle.sin, vehicle.length, vehicle.width, other.cos, other.sin, length, width)


# --- Oriented boxes ---------------------------------------------------------------------------------------------------


class OrientedBox(NamedTuple):
    """Outline of a body on the ground: its centre [m], heading [rad], length along it and width across it [m]."""

    x: float
    y: float
    heading: float
    length: float
    width: float

    @classmethod
    def of(cls, thing: RoadObject) -> OrientedBox:
        """Returns the outline of a highway-env object."""
        x, y = thing.position
        return cls(float(x), float(y), float(thing.heading), float(thing.LENGTH), float(thing.WIDTH))


def boxes_touch(one: OrientedBox, other: OrientedBox) -> bool:
    """Returns whether two boxes have a point in common (separating axes: Gottschalk et al. 1996, in the plane).

    Boxes are convex: they are apart if and only if they are so along one of the four directions of their sides.
    """
    dx, dy = other.x - one.x, other.y - one.y
    turn = other.heading - one.heading
    parallel, square = abs(pm.cos(turn)), abs(pm.sin(turn))
    for box, foe in ((one, other), (other, one)):
        c, s = pm.cos(box.heading), pm.sin(box.heading)
        along, across = abs(dx * c + dy * s), abs(dy * c - dx * s)
        if along > (box.length + foe.length * parallel + foe.width * square) / 2:
            return False
        if across > (box.width + foe.length * square + foe.width * parallel) / 2:
            return False
    return True
