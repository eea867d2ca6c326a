"""Situations that careful driving avoids, forced in the arrays of the world."""

from __future__ import annotations

from dorothie_gym.maps import Town
from dorothie_gym.sim.bodies import TrafficVehicle
from dorothie_gym.sim.state.codes import Kind
from dorothie_gym.sim.world import World
from tests.sim.network.towns import lane, town

TOO_LATE = 6.0
"""Distance from the middle to a line at which a vehicle at 12 m/s cannot stop before the line [m]."""


def blind(world: World) -> None:
    """Makes the ego blind: its list of perceived bodies has no room. No body may be added afterwards."""
    arrays = world.actors.arrays
    world.actors.arrays = arrays._replace(seen=arrays.seen[:0])


def park(world: World, station: float, *, lateral: float = 0.0, speed: float = 0.0) -> TrafficVehicle:
    """Adds a vehicle without a driver on the ego's lane: it keeps its speed [m/s] and direction."""
    lane = world.town.lanes[world.planner.lane]
    assert world.actors.add_vehicle(lane.id, station, distance=5.0)
    vehicle = world.actors.vehicles[-1]
    assert vehicle.kind is Kind.CAR
    vehicle.kind = Kind.EGO  # moved at its speed, neither faster nor slower
    vehicle.position, vehicle.speed = lane.position(station, lateral), speed
    vehicle.on_state_update()
    return vehicle


def swerve(world: World) -> None:
    """Puts the car at the right edge of its lane, so fast and so turned that it leaves it; it comes back by itself."""
    lane = world.town.lanes[world.planner.lane]
    world.car.position = lane.position(world.planner.station, 2.0)
    world.car.heading += 1.4
    world.car.speed = 12.0


def straight_street(length: float = 400.0) -> Town:
    """A street to the east with a lane each way, 0 and 1."""
    return town([lane(0, [(0, 2), (length, 2)]), lane(1, [(length, -2), (0, -2)], road=0, number=1)])
