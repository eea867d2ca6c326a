"""Event log of the ego: trajectory, poses and events in arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dorothie_gym.compilation import compiled, inlined
from dorothie_gym.sim.state.codes import U_TURN

if TYPE_CHECKING:
    from dorothie_gym.sim.state.world_arrays import WorldArrays


@inlined
def trace(world: WorldArrays) -> None:
    """Logs the ego's state after a substep, see `records.TRACE` and `records.POSE`."""
    car, vehicle = world.car[0], world.vehicles[0]
    rows, k = world.trace, int(car.frames)
    car.frames += 1
    rows[k, 0], rows[k, 1], rows[k, 2] = world.clock[0].frame, vehicle.x, vehicle.y
    rows[k, 3], rows[k, 4] = vehicle.heading, vehicle.speed
    rows[k, 5], rows[k, 6], rows[k, 7], rows[k, 8] = car.throttle, car.steer, car.brake, car.run_lane[car.run]
    rows[k, 9] = car.offset
    note_pose(world, k + 1)


@inlined
def note_pose(world: WorldArrays, k: int) -> None:
    """Logs the pose of the ego in a row of its poses."""
    car, vehicle, rows = world.car[0], world.vehicles[0], world.poses
    rows[k, 0], rows[k, 1], rows[k, 2], rows[k, 3] = vehicle.x, vehicle.y, vehicle.heading, vehicle.speed
    rows[k, 4], rows[k, 5] = vehicle.height, 1.0 if car.action == U_TURN and world.path[car.at].manoeuvre else 0.0


@compiled
def log(world: WorldArrays, code: int, kind: int, key: int, value: float) -> int:
    """Logs an event of the ego; returns its row in `events`."""
    car, vehicle = world.car[0], world.vehicles[0]
    if car.events == len(world.events):
        raise ValueError("more happened to the car in one call than can be taken down")
    event = world.events[car.events]
    car.events += 1
    event.frame, event.code, event.kind, event.key, event.value = world.clock[0].frame, code, kind, key, value
    event.x, event.y, event.own, event.body = vehicle.x, vehicle.y, False, -1
    event.lane, event.station = vehicle.plan[0], vehicle.station
    return int(car.events) - 1
