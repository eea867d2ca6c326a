"""Route of a vehicle: its planned lanes, drawn from the vehicle's own random numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dorothie_gym.sim.network.ahead import HORIZON
from dorothie_gym.sim.network.lane_lookup import project
from dorothie_gym.sim.randomness import choose
from dorothie_gym.sim.state.body_records import VehicleRecord
from dorothie_gym.sim.state.codes import Kind
from dorothie_gym.sim.state.town_records import LaneRecord
from dorothie_gym.sim.traffic.parameters import AFTER_END, CYCLIST_FROM_EDGE, PLANNED
from dorothie_gym.support.compilation import compiled, inlined

if TYPE_CHECKING:
    from dorothie_gym.sim.state.town_arrays import TownArrays


@inlined
def follow_road(town: TownArrays, vehicle: VehicleRecord) -> None:
    """Moves on to the next planned lane at the end of the present one, and extends the plan."""
    while vehicle.planned > 1 and vehicle.station > town.lanes[vehicle.plan[0]].length - AFTER_END:
        for k in range(1, vehicle.planned):
            vehicle.plan[k - 1] = vehicle.plan[k]
        vehicle.planned -= 1
        keep_side(vehicle, town.lanes[vehicle.plan[0]])
        locate(town, vehicle)
        extend(town, vehicle)


@inlined
def keep_side(vehicle: VehicleRecord, lane: LaneRecord) -> None:
    """Sets the offset in a lane: cyclists keep to the right edge, cars to the middle."""
    if vehicle.kind == Kind.CYCLIST:
        vehicle.to_right = max(lane.half_width - CYCLIST_FROM_EDGE, 0.0)


@inlined
def locate(town: TownArrays, vehicle: VehicleRecord) -> None:
    """Finds the place of a vehicle on the lane that it follows."""
    vehicle.station, vehicle.lateral, vehicle.segment = project(town, vehicle.plan[0], vehicle.x, vehicle.y)


@compiled
def take(town: TownArrays, vehicle: VehicleRecord, lane: int) -> None:
    """Makes a vehicle follow a lane, and extends the plan."""
    vehicle.plan[0], vehicle.planned = lane, 1
    keep_side(vehicle, town.lanes[lane])
    locate(town, vehicle)
    extend(town, vehicle)


@compiled
def extend(town: TownArrays, vehicle: VehicleRecord) -> None:
    """Draws lanes until the plan reaches `HORIZON` beyond the lane that the vehicle follows."""
    ahead = 0.0
    for k in range(1, vehicle.planned):
        ahead += town.lanes[vehicle.plan[k]].length
    while ahead < HORIZON and vehicle.planned < PLANNED:
        last = town.lanes[vehicle.plan[vehicle.planned - 1]]
        if last.successors == 0:
            return
        lane = town.neighbours[last.successor]
        if last.successors > 1:
            lane = _drawn(town, vehicle, last)
        vehicle.plan[vehicle.planned] = lane
        vehicle.planned += 1
        ahead += town.lanes[lane].length


@compiled
def _drawn(town: TownArrays, vehicle: VehicleRecord, last: LaneRecord) -> int:
    """Draws one of the successors of a lane; for cyclists one on which they may ride, if there is any."""
    streets = 0
    if vehicle.kind == Kind.CYCLIST:
        for k in range(last.successor, last.successor + last.successors):
            streets += town.lanes[town.neighbours[k]].cycling
    if streets == 0:
        return int(town.neighbours[last.successor + choose(vehicle, last.successors)])
    left = choose(vehicle, streets)
    for k in range(last.successor, last.successor + last.successors):
        if town.lanes[town.neighbours[k]].cycling:
            if left == 0:
                return int(town.neighbours[k])
            left -= 1
    return int(town.neighbours[last.successor])
