"""Situations into which nobody gets by driving with care, brought about in the arrays of the world."""

from __future__ import annotations

from dorothie_gym.maps import Town
from dorothie_gym.sim.bodies import TrafficVehicle
from dorothie_gym.sim.state.codes import Kind
from dorothie_gym.sim.world import World
from tests.sim.network.towns import lane, town

TOO_LATE = 6.0
"""Who comes at 12 m/s, its middle this far before a line, cannot stop before it [m]."""


def blind(world: World) -> None:
    """From now on the car sees nobody and nothing: what it sees is listed where there is no room. None may be added."""
    arrays = world.actors.arrays
    world.actors.arrays = arrays._replace(seen=arrays.seen[:0])


def park(world: World, station: float, *, lateral: float = 0.0, speed: float = 0.0) -> TrafficVehicle:
    """Puts a vehicle on the car's lane in which nobody sits: it keeps its speed [m/s] and direction."""
    lane = world.town.lanes[world.planner.lane]
    assert world.actors.add_vehicle(lane.id, station, distance=5.0)
    vehicle = world.actors.vehicles[-1]
    assert vehicle.kind is Kind.CAR
    vehicle.kind = Kind.EGO  # whom the world lets roll as it is told: neither faster nor slower
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
