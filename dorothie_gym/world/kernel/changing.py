"""Changing lanes: highway-env's MOBIL (Kesting, Treiber and Helbing 2007) without politeness, as there.

Cyclists overtake nobody and move over to the right. Beyond stock's rules, nobody begins a change in a junction, after
having been let into one, or too near to the end of the lane to complete it; and a lane that ends is left, not entered.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from dorothie_gym.world.compiling import compiled, inlined
from dorothie_gym.world.kernel.following import following_acceleration, free_acceleration, wanted_gap
from dorothie_gym.world.kernel.lanes import project
from dorothie_gym.world.kernel.order import around
from dorothie_gym.world.kernel.parameters import (
    CAR_LENGTH,
    CHANGE_TIME,
    CYCLIST_BEFORE,
    CYCLIST_BEHIND,
    LANE_CHANGE_BRAKING,
    LANE_CHANGE_DELAY,
    LANE_CHANGE_GAIN,
)
from dorothie_gym.world.kernel.plan import take
from dorothie_gym.world.kernel.records import Kind, Records

if TYPE_CHECKING:
    from dorothie_gym.world.kernel.town_arrays import TownArrays
    from dorothie_gym.world.kernel.world_arrays import WorldArrays

GIVING_UP = 1.0
"""Who changes lanes and has to stand for this long before it is over there gives it up [s]: by now others may come."""


@inlined
def change_lanes(town: TownArrays, world: WorldArrays, i: int) -> None:
    """Thinks of changing lanes, once in `LANE_CHANGE_DELAY`, or gives up a change that is under way."""
    vehicle = world.vehicles[i]
    if vehicle.lane != vehicle.plan[0]:
        lane = town.lanes[vehicle.lane]
        if lane.left == vehicle.plan[0] or lane.right == vehicle.plan[0]:
            held_up = vehicle.standing > GIVING_UP and lane.successors > 0
            if held_up or _is_taken(world, i):
                take(town, vehicle, int(vehicle.lane))
        return
    if vehicle.timer <= LANE_CHANGE_DELAY:
        return
    vehicle.timer = 0.0
    lane = town.lanes[vehicle.lane]
    left = lane.length - vehicle.station
    if lane.junction >= 0 or vehicle.claim >= 0 or vehicle.inside >= 0 or abs(vehicle.speed) < 1.0:
        return
    if lane.successors > 0 and left < CAR_LENGTH + CHANGE_TIME * vehicle.speed:
        return
    if vehicle.kind == Kind.CYCLIST and lane.successors > 0:
        _move_over(town, world, i, lane)
        return
    if lane.left >= 0:
        _consider(town, world, i, lane, int(lane.left))
    if lane.right >= 0:
        _consider(town, world, i, lane, int(lane.right))


@compiled
def _consider(town: TownArrays, world: WorldArrays, i: int, lane: Records, side: int) -> None:
    vehicle = world.vehicles[i]
    beside = town.lanes[side]
    if beside.successors == 0 and lane.successors > 0:
        return
    station, lateral, _ = project(town, side, vehicle.x, vehicle.y)
    if abs(lateral) > 4.0 * beside.half_width or station < 0.0 or station >= beside.length + CAR_LENGTH:
        return
    if mobil(town, world, i, side, station, lane.successors == 0):
        take(town, vehicle, side)


@compiled
def _move_over(town: TownArrays, world: WorldArrays, i: int, lane: Records) -> None:
    """A cyclist changes to the lane to the right, if there is one where it may ride and room on it, and to no other."""
    vehicle = world.vehicles[i]
    if lane.right < 0 or not town.lanes[lane.right].cycling or town.lanes[lane.right].successors == 0:
        return
    station, _, _ = project(town, lane.right, vehicle.x, vehicle.y)
    _, ahead, _, behind = around(town, world, lane.right, station, i)
    if ahead > CYCLIST_BEFORE and behind > CYCLIST_BEHIND:
        take(town, vehicle, int(lane.right))


@compiled
def mobil(town: TownArrays, world: WorldArrays, i: int, side: int, station: float, must: bool) -> bool:
    """Whether to change to a lane beside: it brings more acceleration and makes nobody brake hard.

    Args:
        town: arrays of the town.
        world: arrays of the world.
        i: the vehicle.
        side: lane beside.
        station: where the vehicle is along that lane [m].
        must: whether it has to leave its lane, whatever that brings.
    """
    vehicle = world.vehicles[i]
    front, ahead, rear, behind = around(town, world, side, station, i)
    if rear >= 0 and world.nodes[rear].body < len(world.vehicles):
        follower = world.vehicles[world.nodes[rear].body]
        along = vehicle.speed * (vehicle.cos * follower.cos + vehicle.sin * follower.sin)
        imposed = free_acceleration(follower.speed, follower.desired, town.lanes[follower.lane].limit)
        imposed -= following_acceleration(follower.speed, along, behind, 0.5 * (vehicle.length + follower.length))
        if imposed < -LANE_CHANGE_BRAKING:
            return False
    there = -_held_up(world, vehicle, front, ahead)
    if must:
        return there > -LANE_CHANGE_BRAKING
    front, ahead, _, _ = around(town, world, vehicle.lane, vehicle.own_station, i)
    return there + _held_up(world, vehicle, front, ahead) >= LANE_CHANGE_GAIN


@compiled
def _held_up(world: WorldArrays, vehicle: Records, front: int, gap: float) -> float:
    """What a body in front takes off the acceleration [m/s^2]."""
    if front < 0:
        return 0.0
    node = world.nodes[front]
    along = node.speed * (vehicle.cos * node.cos + vehicle.sin * node.sin)
    return following_acceleration(vehicle.speed, along, gap, 0.5 * vehicle.length + node.half_length)


@compiled
def _is_taken(world: WorldArrays, i: int) -> bool:
    """Whether somebody close in front changes into the same lane."""
    vehicle = world.vehicles[i]
    for j in range(len(world.vehicles)):
        other = world.vehicles[j]
        if j == i or other.kind == Kind.EMPTY or other.plan[0] != vehicle.plan[0] or other.lane == other.plan[0]:
            continue
        gap = other.station - vehicle.station
        along = other.speed * (vehicle.cos * other.cos + vehicle.sin * other.sin)
        if 0.0 < gap < wanted_gap(vehicle.speed, along, 0.5 * (vehicle.length + other.length)):
            return True
    return False
