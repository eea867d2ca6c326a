"""Lane index: for every lane the list of bodies on it, ordered by station and rebuilt in each substep.

A vehicle is in the list of the lane that is closest and, where that is another one, of the lane that it follows; while
it changes lanes, of that one as soon as highway-env counts it as on it. A vehicle that follows the closest lane,
but so far askew or aside that it blocks the lane beside, is in the list of that one. A prop is in
the lists of all lanes that it reaches into.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.sim.network.ahead import HORIZON, LANE_MARGIN
from dorothie_gym.sim.network.lane_lookup import project
from dorothie_gym.sim.state.codes import NOBODY, Kind
from dorothie_gym.sim.traffic.parameters import CAR_WIDTH
from dorothie_gym.support.compilation import compiled, inlined
from dorothie_gym.support.compilation.records import RecordArray

if TYPE_CHECKING:
    from dorothie_gym.sim.state.records import NodeRecord, VehicleRecord
    from dorothie_gym.sim.state.town_arrays import TownArrays
    from dorothie_gym.sim.state.world_arrays import WorldArrays

PASSING = 0.5 * CAR_WIDTH + 0.2
"""Distance to the centre of a lane within which a body obstructs cars on the lane [m]."""


@inlined
def rebuild(town: TownArrays, world: WorldArrays) -> None:
    """Makes the lists of all lanes."""
    nodes, heads, vehicles = world.nodes, world.heads, world.vehicles
    for n in range(len(nodes)):
        if nodes[n].lane >= 0:
            heads[nodes[n].lane] = NOBODY
            nodes[n].lane = NOBODY
    for i in range(len(vehicles)):
        vehicle = vehicles[i]
        if vehicle.kind == Kind.EMPTY:
            continue
        _list_vehicle(nodes, heads, vehicle, i, 2 * i, vehicle.lane, vehicle.own_station)
        if vehicle.lane == vehicle.plan[0]:
            _list_beside(town, nodes, heads, vehicle, i)
        elif _is_on_followed(town, vehicle):
            _list_vehicle(nodes, heads, vehicle, i, 2 * i + 1, vehicle.plan[0], vehicle.station)
    for p in range(len(world.props)):
        prop = world.props[p]
        if prop.present:
            for k in range(4):
                if prop.lane[k] >= 0:
                    node = nodes[2 * len(vehicles) + 4 * p + k]
                    node.station, node.lane, node.body = prop.station[k], prop.lane[k], len(vehicles) + p
                    node.half_length = 0.5 * max(prop.length, prop.width)
                    _insert(nodes, heads, 2 * len(vehicles) + 4 * p + k)


@inlined
def _is_on_followed(town: TownArrays, vehicle: VehicleRecord) -> bool:
    """Returns whether a vehicle is on the lane that it follows, which is not the closest one."""
    lane = town.lanes[vehicle.lane]
    beside = lane.left == vehicle.plan[0] or lane.right == vehicle.plan[0]
    if not beside and vehicle.kind != Kind.DRIVEN:  # which may turn round, across both
        return True  # one lane leads into the other, or they cross in a junction
    return bool(abs(vehicle.lateral) <= town.lanes[vehicle.plan[0]].half_width + LANE_MARGIN)


@inlined
def _list_beside(
    town: TownArrays, nodes: RecordArray[NodeRecord], heads: NDArray[np.int32], vehicle: VehicleRecord, body: int
) -> None:
    """Lists a vehicle on the lane beside that it blocks."""
    lane = town.lanes[vehicle.lane]
    if lane.left < 0 and lane.right < 0:
        return
    here, there = town.points[vehicle.segment], town.points[vehicle.segment + 1]
    across = abs(vehicle.sin * (there[0] - here[0]) - vehicle.cos * (there[1] - here[1]))
    apart = there[2] - here[2]
    free = lane.half_width - abs(vehicle.own_lateral) - 0.5 * vehicle.width
    if 0.5 * vehicle.length * across > free * apart:  # else it is within its lane, as nearly always
        _list_astride(town, nodes, heads, vehicle, body, across / apart)


@compiled
def _list_astride(
    town: TownArrays,
    nodes: RecordArray[NodeRecord],
    heads: NDArray[np.int32],
    vehicle: VehicleRecord,
    body: int,
    turned: float,
) -> None:
    """Does the work of `_list_beside`; `turned` is the sine of the vehicle's angle to its lane."""
    reach = 0.5 * (vehicle.width * math.sqrt(max(1.0 - turned * turned, 0.0)) + vehicle.length * turned)
    lane = town.lanes[vehicle.lane]
    for side in (lane.left, lane.right):
        if side < 0:
            continue
        station, lateral, _ = project(town, side, vehicle.x, vehicle.y)
        if abs(lateral) < reach + PASSING and 0.0 <= station <= town.lanes[side].length:
            _list_vehicle(nodes, heads, vehicle, body, 2 * body + 1, side, station)
            return


@inlined
def _list_vehicle(
    nodes: RecordArray[NodeRecord],
    heads: NDArray[np.int32],
    vehicle: VehicleRecord,
    body: int,
    n: int,
    lane: int,
    station: float,
) -> None:
    node = nodes[n]
    node.station, node.lane, node.body = station, lane, body
    node.speed, node.cos, node.sin, node.half_length = vehicle.speed, vehicle.cos, vehicle.sin, 0.5 * vehicle.length
    _insert(nodes, heads, n)


@inlined
def _insert(nodes: RecordArray[NodeRecord], heads: NDArray[np.int32], n: int) -> None:
    node = nodes[n]
    before, after = NOBODY, heads[node.lane]
    while after >= 0 and nodes[after].station <= node.station:
        before, after = after, nodes[after].next
    node.before, node.next = before, after
    if before < 0:
        heads[node.lane] = n
    else:
        nodes[before].next = n
    if after >= 0:
        nodes[after].before = n


@inlined
def next_on_lane(nodes: RecordArray[NodeRecord], n: int, body: int) -> int:
    """Returns the first node along the lane, starting at `n`, that does not belong to a body, or -1."""
    while n >= 0 and nodes[n].body == body:
        n = nodes[n].next
    return n


@compiled
def around(
    town: TownArrays, world: WorldArrays, number: int, station: float, body: int
) -> tuple[int, float, int, float]:
    """Returns the next bodies ahead of and behind a place, along all lanes that follow and precede.

    Args:
        town: arrays of the town.
        world: arrays of the world.
        number: lane of the place.
        station: station of the place [m].
        body: a body that is left out.

    Returns:
        Nodes (-1 for none within `HORIZON`) and their distances [m]: ahead, then behind.
    """
    nodes = world.nodes
    front, rear = NOBODY, NOBODY
    n = world.heads[number]
    while n >= 0 and front < 0:
        if nodes[n].body != body:
            if nodes[n].station >= station:
                front = n
            else:
                rear = n
        n = nodes[n].next
    ahead, behind = math.inf, math.inf
    if front >= 0:
        ahead = nodes[front].station - station
    else:
        front, ahead = _beyond(town, world, number, station, body)
    if rear >= 0:
        behind = station - nodes[rear].station
    else:
        rear, behind = _before(town, world, number, station, body)
    return front, ahead, rear, behind


@compiled
def _beyond(town: TownArrays, world: WorldArrays, number: int, station: float, body: int) -> tuple[int, float]:
    """Returns the nearest body on the lanes that follow, and its distance from a place on a lane [m]."""
    lanes, nodes, stack, starts = town.lanes, world.nodes, world.stack, world.starts
    found, best = NOBODY, HORIZON
    stack[0], starts[0] = number, lanes[number].length - station
    size = 1
    while size > 0:
        size -= 1
        lane, start = lanes[stack[size]], starts[size]
        for k in range(lane.successor, lane.successor + lane.successors):
            following = town.neighbours[k]
            n = next_on_lane(nodes, world.heads[following], body)
            if n >= 0:
                if start + nodes[n].station < best:
                    found, best = n, start + nodes[n].station
            elif start + lanes[following].length < best and size < len(stack):
                stack[size], starts[size] = following, start + lanes[following].length
                size += 1
    return found, best if found >= 0 else math.inf


@compiled
def _before(town: TownArrays, world: WorldArrays, number: int, station: float, body: int) -> tuple[int, float]:
    """Returns the nearest body on the lanes that precede, and its distance from a place on a lane [m]."""
    lanes, nodes, stack, starts = town.lanes, world.nodes, world.stack, world.starts
    found, best = NOBODY, HORIZON
    stack[0], starts[0] = number, station
    size = 1
    while size > 0:
        size -= 1
        lane, start = lanes[stack[size]], starts[size]
        for k in range(lane.predecessor, lane.predecessor + lane.predecessors):
            before = town.neighbours[k]
            last, n = NOBODY, world.heads[before]
            while n >= 0:
                if nodes[n].body != body:
                    last = n
                n = nodes[n].next
            length = lanes[before].length
            if last >= 0:
                if start + length - nodes[last].station < best:
                    found, best = last, start + length - nodes[last].station
            elif start + length < best and size < len(stack):
                stack[size], starts[size] = before, start + length
                size += 1
    return found, best if found >= 0 else math.inf
