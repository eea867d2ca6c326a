"""All substeps of a decision in one call."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dorothie_gym.world.compiling import compiled, inlined
from dorothie_gym.world.kernel.collisions import collide
from dorothie_gym.world.kernel.driving import drive
from dorothie_gym.world.kernel.lanes import closest_lane, value_near
from dorothie_gym.world.kernel.motion import move, slip_of
from dorothie_gym.world.kernel.order import rebuild
from dorothie_gym.world.kernel.parameters import STUCK_SPEED
from dorothie_gym.world.kernel.plan import locate
from dorothie_gym.world.kernel.records import Kind, Records, Wait
from dorothie_gym.world.kernel.towing import tow
from dorothie_gym.world.kernel.walking import walk

if TYPE_CHECKING:
    from dorothie_gym.world.kernel.town_arrays import TownArrays
    from dorothie_gym.world.kernel.world_arrays import WorldArrays


@compiled
def step(
    town: TownArrays, world: WorldArrays, substeps: int, dt: float, acceleration: float = 0.0, steering: float = 0.0
) -> None:
    """Lets a world go on.

    As on a highway-env road, everybody decides on what is there at the beginning of a substep, then everybody moves.

    Args:
        town: arrays of the town.
        world: arrays of the world, changed in place.
        substeps: how many.
        dt: time of each [s].
        acceleration: of vehicles of the kind `Kind.EGO` [m/s^2].
        steering: angle of their front wheels, positive to the right [rad].
    """
    vehicles, clock = world.vehicles, world.clock[0]
    for _ in range(substeps):
        for i in range(len(vehicles)):
            vehicle = vehicles[i]
            if vehicle.kind == Kind.EGO:
                vehicle.acceleration, vehicle.slip = acceleration, slip_of(steering)
            elif vehicle.kind != Kind.EMPTY:
                drive(town, world, i)
        walk(town, world, dt)
        for i in range(len(vehicles)):
            if vehicles[i].kind != Kind.EMPTY:
                _go_on(town, vehicles[i], dt)
        collide(world)
        tow(town, world, dt)
        rebuild(town, world)
        clock.time += dt
        clock.frame += 1


@inlined
def _go_on(town: TownArrays, vehicle: Records, dt: float) -> None:
    """Moves a vehicle and finds out where it is."""
    vehicle.timer += dt
    if vehicle.speed < STUCK_SPEED:
        vehicle.standing += dt if vehicle.wait != Wait.LIGHT else 0.0
    else:
        vehicle.standing = 0.0
    if vehicle.speed == 0.0 and vehicle.acceleration <= 0.0:
        return  # it stands, and stays where it was found
    move(vehicle, dt)
    find(town, vehicle)


@inlined
def find(town: TownArrays, vehicle: Records) -> None:
    """Finds the closest lane of a vehicle, and its place on the lane that it follows."""
    lane, station, lateral, segment = closest_lane(
        town, vehicle.x, vehicle.y, vehicle.heading, vehicle.cos, vehicle.sin, vehicle.height, vehicle.lane
    )
    vehicle.lane, vehicle.own_station, vehicle.own_lateral = lane, station, lateral
    if vehicle.kind == Kind.EGO:
        vehicle.plan[0], vehicle.planned = lane, 1
        vehicle.inside = lane if town.lanes[lane].junction >= 0 else -1
    if lane == vehicle.plan[0]:
        vehicle.station, vehicle.lateral, vehicle.segment = station, lateral, segment
    else:
        locate(town, vehicle)
    if not town.flat:
        vehicle.height = value_near(town.points, town.lanes[lane], segment, 4, station)
