"""Adding, moving and removing bodies of a world; initial traffic and pedestrians."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.errors import TownError
from dorothie_gym.maps.lane_neighbours import outermost
from dorothie_gym.sim.pedestrians.pacing import KERB, WALKING_SPEED
from dorothie_gym.sim.pedestrians.walking import place_walker
from dorothie_gym.sim.pedestrians.walkway_position import closest_walk, place_beside
from dorothie_gym.sim.randomness import POOL, seed_of
from dorothie_gym.sim.state.codes import NOBODY, Footway, Kind, Walk
from dorothie_gym.sim.state.records import PedestrianRecord, PropRecord
from dorothie_gym.sim.state.town_arrays import TownArrays, town_arrays
from dorothie_gym.sim.state.world_arrays import CAR_KEY, WorldArrays
from dorothie_gym.sim.traffic.lane_index import rebuild
from dorothie_gym.sim.traffic.parameters import (
    CAR_LENGTH,
    CAR_WIDTH,
    CLEAR_OF_CAR,
    CLEAR_OF_WALKER,
    CYCLIST_LENGTH,
    CYCLIST_SHARE,
    CYCLIST_SPEEDS,
    CYCLIST_WIDTH,
    VEHICLE_SPEEDS,
)
from dorothie_gym.sim.traffic.respawn import SHORTEST, is_clear_of_people, is_free, new_key, put_on_lane
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import compiled, direct
from dorothie_gym.support.compilation.records import RecordArray, empty_records, plain

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array, Lane
    from dorothie_gym.maps.town import Town
    from dorothie_gym.ontology.world_exceptions import PropKind
    from dorothie_gym.sim.network.network import TownNetwork

STREET_WAY_REACH = 1.0
"""Distance to the footway beside a street within which a pedestrian is placed on it [m]."""

PROP_LEVEL = 2.0
"""Difference of height up to which a prop is on a lane [m]."""


def add_vehicle(
    town: TownArrays, world: WorldArrays, lane: int, station: float, *, kind: Kind = Kind.CAR, desired: float
) -> int:
    """Adds a vehicle on a lane, in the first free row.

    Args:
        town: arrays of the town.
        world: arrays of the world.
        lane: id of the lane.
        station: along it [m].
        kind: kind of vehicle.
        desired: desired speed [m/s].

    Returns:
        Its number.

    Raises:
        ValueError: the world has no room for another one.
    """
    empty = np.flatnonzero(plain(world.vehicles)["kind"] == Kind.EMPTY)
    if not len(empty):
        raise ValueError(f"the world has room for {len(world.vehicles)} vehicles, and all are there")
    number = int(empty[0])
    _place_vehicle(
        town, world, number, int(kind), int(lane), float(station), float(desired), np.zeros(POOL, dtype=np.int64)
    )
    return number


_CAR_RADIUS = 0.5 * pm.hypot(CAR_LENGTH, CAR_WIDTH)
_CYCLIST_RADIUS = 0.5 * pm.hypot(CYCLIST_LENGTH, CYCLIST_WIDTH)


@compiled
def _put_vehicle(
    town: TownArrays,
    world: WorldArrays,
    number: int,
    kind: int,
    lane: int,
    station: float,
    desired: float,
    pool: NDArray[np.int64],
) -> None:
    """Places a new vehicle in a free row; see `add_vehicle`, and for `pool` `randomness.seed_of`."""
    vehicle = world.vehicles[number]
    vehicle.kind, vehicle.key, vehicle.touched, vehicle.odometer = kind, new_key(world), False, 0.0
    vehicle.random = seed_of(world.clock[0].random, vehicle.key, pool) | 1
    vehicle.length, vehicle.width, vehicle.desired, vehicle.to_right = CAR_LENGTH, CAR_WIDTH, desired, 0.0
    vehicle.radius = _CAR_RADIUS
    if kind == Kind.CYCLIST:
        vehicle.length, vehicle.width, vehicle.radius = CYCLIST_LENGTH, CYCLIST_WIDTH, _CYCLIST_RADIUS
        vehicle.desired = min(max(desired, CYCLIST_SPEEDS[0]), CYCLIST_SPEEDS[1])
    put_on_lane(town, vehicle, lane, station)
    rebuild(town, world)


_place_vehicle = direct(_put_vehicle)


def add_car(town: TownArrays, world: WorldArrays, lane: int, station: float) -> None:
    """Adds the ego on a lane, as vehicle 0 of a world that was made for it (`driven`).

    Args:
        town: arrays of the town.
        world: arrays of the world, still empty.
        lane: id of the lane.
        station: along it [m].
    """
    add_vehicle(town, world, lane, station, kind=Kind.DRIVEN, desired=0.0)
    plain(world.vehicles)["key"][0] = CAR_KEY


def remove_vehicle(town: TownArrays, world: WorldArrays, number: int) -> None:
    """Removes a vehicle; the others keep their rows."""
    world.vehicles[number].kind = Kind.EMPTY
    rebuild(town, world)


def add_pedestrian(town: TownArrays, world: WorldArrays, walk: int, station: float, *, pace: float) -> int:
    """Adds a pedestrian on a footway, in the first free row.

    Args:
        town: arrays of the town.
        world: arrays of the world.
        walk: number of the footway; a pavement has its id in the town.
        station: along it [m].
        pace: desired speed [m/s].

    Returns:
        Its number.

    Raises:
        ValueError: the world has no room for another one, or there is no such footway.
    """
    empty = np.flatnonzero(world.pedestrians["state"] == Walk.EMPTY)
    if not len(empty):
        raise ValueError(f"the world has room for {len(world.pedestrians)} pedestrians, and all are there")
    if not 0 <= walk < len(town.walks) or town.walks[walk].length <= 0.0:
        raise ValueError(f"there is no footway {walk} in this town")
    number = int(empty[0])
    _put_pedestrian(town, world, number, walk, station, pace, np.zeros(POOL, dtype=np.int64))
    return number


@compiled
def _put_pedestrian(
    town: TownArrays, world: WorldArrays, number: int, walk: int, station: float, pace: float, pool: NDArray[np.int64]
) -> None:
    """Places a new pedestrian in a free row; see `add_pedestrian`, and for `pool` `randomness.seed_of`."""
    walker = world.pedestrians[number]
    walker.key, walker.odometer = new_key(world), 0.0
    walker.random = seed_of(world.clock[0].random, walker.key, pool) | 1
    walker.walk, walker.station, walker.pace = walk, station, pace
    walker.direction = 1.0 if walker.random & 2 else -1.0
    place_walker(town, walker)


def add_street_walker(
    network: TownNetwork, town: TownArrays, world: WorldArrays, lane: int, station: float
) -> int | None:
    """Adds a pedestrian beside a lane, or at the kerb of those beside it.

    Such pedestrians stay at their street, and cross it anywhere but near junctions.

    Args:
        network: network of the town.
        town: its arrays.
        world: arrays of the world.
        lane: id of the lane.
        station: along it [m].

    Returns:
        Its row; None if there is no footway, if a pedestrian or the ego is there already, or if all rows are taken.
    """
    beside = network.town.lanes[outermost(network.town, lane)]
    station = min(station, beside.length)
    x, y = (float(value) for value in kerb(network.town, beside, station))
    walk, at, _ = closest_walk(town, Footway.STREET, x, y, STREET_WAY_REACH)
    if walk < 0 or town.walks[walk].lane != beside.id or not is_clear_of_people(world, x, y, NOBODY, CLEAR_OF_WALKER):
        return None
    if (world.pedestrians["state"] != Walk.EMPTY).all():
        return None
    return add_pedestrian(town, world, walk, at, pace=WALKING_SPEED)


def kerb(town: Town, lane: Lane, station: float) -> Array:
    """Returns the place of a pedestrian beside a lane (2,) [m]; the lane is the outermost one of its direction."""
    return lane.position(station, town.traffic.sign * (lane.width_at(station) / 2 + KERB))


def remove_pedestrian(world: WorldArrays, number: int) -> None:
    """Removes a pedestrian; the others keep their rows."""
    walker = world.pedestrians[number]
    walker.state, walker.crashed, walker.crash_age, walker.speed = Walk.EMPTY, False, 0.0, 0.0


def add_prop(
    network: TownNetwork, town: TownArrays, world: WorldArrays, kind: PropKind, lane: int, station: float
) -> int:
    """Adds a prop on a lane, across it.

    Args:
        network: network of the town.
        town: its arrays.
        world: arrays of the world.
        kind: kind of the prop.
        lane: id of the lane.
        station: along it [m].

    Returns:
        Its number.

    Raises:
        ValueError: the world has no room for another one.
    """
    empty = np.flatnonzero(~world.props["present"])
    if not len(empty):
        raise ValueError(f"the world has room for {len(world.props)} props, and all are there")
    number = int(empty[0])
    prop = world.props[number]
    prop.length, prop.width = kind.length, kind.width
    prop.radius = 0.5 * pm.hypot(kind.length, kind.width)
    prop.present, prop.key = True, new_key(world)
    move_prop(network, town, world, number, lane, station)
    return number


def move_prop(
    network: TownNetwork, town: TownArrays, world: WorldArrays, number: int, lane: int, station: float
) -> None:
    """Moves a prop to another place, across a lane; it keeps its key.

    Args:
        network: network of the town.
        town: its arrays.
        world: arrays of the world.
        number: number of the prop.
        lane: id of the lane.
        station: along it [m].
    """
    prop, town_lane = world.props[number], network.town.lanes[lane]
    prop.x, prop.y = town_lane.position(station)
    prop.heading, prop.height = town_lane.heading_at(station), town_lane.height_at(station)
    prop.cos, prop.sin = pm.cos(prop.heading), pm.sin(prop.heading)
    prop.lane[:] = NOBODY
    prop.lane[0], prop.station[0] = lane, station
    others = [place for place in _reached(network, town, prop) if place[0] != lane]
    for k, (reached, at) in enumerate(others[: len(prop.lane) - 1], start=1):
        prop.lane[k], prop.station[k] = reached, at
    rebuild(town, world)


def remove_prop(town: TownArrays, world: WorldArrays, number: int) -> None:
    """Removes a prop."""
    world.props[number].present = False
    rebuild(town, world)


def _reached(network: TownNetwork, town: TownArrays, prop: PropRecord) -> list[tuple[int, float]]:
    """Returns the lanes on which a vehicle would touch a prop, the closest first, and the stations [m]."""
    found = []
    half = 0.5 * max(prop.width, prop.length) + 0.5 * CAR_WIDTH
    lanes = town.lanes
    near = (lanes["left_edge"] < prop.x + half) & (lanes["right_edge"] > prop.x - half)
    near &= (lanes["low_edge"] < prop.y + half) & (lanes["high_edge"] > prop.y - half)
    for number in np.flatnonzero(near):
        lane = network.town.lanes[number]
        station, lateral = network.lane_of(lane.id).local_coordinates(np.array([prop.x, prop.y]))
        level = abs(lane.height_at(station) - prop.height) < PROP_LEVEL
        if abs(lateral) < half and 0.0 <= station <= lane.length and level:
            found.append((abs(lateral), lane.id, station))
    return [(lane, station) for _, lane, station in sorted(found)]


# --- Spawning places --------------------------------------------------------------------------------------------------


def free_places(town: Town, rng: np.random.Generator, count: int) -> list[tuple[int, float]]:
    """Draws places on lanes outside junctions evenly along the road, candidates for spawning."""
    lanes, stations = _draw_places(town, rng, count)
    return list(zip(lanes.tolist(), stations.tolist(), strict=True))


def _draw_places(town: Town, rng: np.random.Generator, count: int) -> tuple[NDArray[np.int64], Array]:
    """As `free_places`: lanes (n,) and stations (n,) [m]."""
    lanes, lengths, ends = _open_lanes(town)
    chosen = ends.searchsorted(rng.random(count), side="right")  # as `rng.choice` with these weights
    shares = rng.uniform(size=count)
    return lanes[chosen], 5.0 + shares * (lengths[chosen] - 10.0)


@lru_cache(maxsize=16)
def _open_lanes(town: Town) -> tuple[NDArray[np.int64], Array, Array]:
    """Returns ids and lengths [m] of the lanes on which vehicles appear, and their shares of the road, cumulated."""
    lanes = [lane for lane in town.lanes if not lane.in_junction and lane.length > SHORTEST]
    if not lanes:
        longest = max((lane.length for lane in town.lanes if not lane.in_junction), default=0.0)
        reason = f"no lane is longer than {SHORTEST:g} m, the longest has {longest:.0f} m; use a larger map"
        raise TownError(town.name, "town", reason)
    lengths = np.array([lane.length for lane in lanes])
    return np.array([lane.id for lane in lanes]), lengths, _cumulated(lengths)


def _cumulated(weights: Array) -> Array:
    """Returns the distribution function of weights, exactly that of `numpy.random.Generator.choice`."""
    ends: Array = (weights / weights.sum()).cumsum()
    ends /= ends[-1]
    return ends


# --- Initial population -----------------------------------------------------------------------------------------------

PACES = 1.1, 1.6
"""Range of the desired speeds of pedestrians [m/s] (Knoblauch et al. 1996 measured 1.2 to 1.5 at crosswalks)."""

TRIES = 40
"""Places drawn for each vehicle and each pedestrian."""


def populate(
    network: TownNetwork,
    town: TownArrays,
    world: WorldArrays,
    *,
    seed: int,
    vehicles: int,
    pedestrians: int,
    cyclists: float = CYCLIST_SHARE,
) -> None:
    """Adds traffic and pedestrians at random places, as many as fit, none of them close to the ego.

    Args:
        network: network of the town.
        town: its arrays.
        world: arrays of the world; the ego, if there is one, is the first of its vehicles.
        seed: seed of the places and the desired speeds.
        vehicles: number of vehicles, cyclists included.
        pedestrians: number of pedestrians; on pavements, or in a town without them beside the streets.
        cyclists: share of the vehicles; they ride at the kerb of slow roads.
    """
    rng = np.random.default_rng(seed)
    _add_traffic(network, town, world, rng, vehicles, cyclists)
    _add_people(network, town, world, rng, pedestrians)


def _add_traffic(
    network: TownNetwork, town: TownArrays, world: WorldArrays, rng: np.random.Generator, vehicles: int, cyclists: float
) -> None:
    room = min(vehicles, int((plain(world.vehicles)["kind"] == Kind.EMPTY).sum()))
    rideable = _rideable(network)
    cycles = rng.random(room) < cyclists * rideable.any()
    lanes, stations = _draw_places(network.town, rng, TRIES * vehicles)
    shares = rng.random(room)
    count = _fill_lanes(town, world, lanes, stations, rideable, cycles, shares, np.zeros(POOL, dtype=np.int64))
    if count < room:  # those that draw after them have the numbers of the vehicles for which there was no place
        assert isinstance(rng.bit_generator, np.random.PCG64)
        rng.bit_generator.advance(count - room)


@lru_cache(maxsize=16)
def _rideable(network: TownNetwork) -> NDArray[np.bool_]:
    """Returns the lanes on which cyclists may begin (lanes,)."""
    lanes = plain(town_arrays(network).lanes)
    rideable: NDArray[np.bool_] = lanes["cycling"] & (lanes["outer"] < 0) & (lanes["junction"] < 0)
    return rideable


@direct
@compiled
def _fill_lanes(
    town: TownArrays,
    world: WorldArrays,
    lanes: NDArray[np.int64],
    stations: Array,
    rideable: NDArray[np.bool_],
    cycles: NDArray[np.bool_],
    shares: Array,
    pool: NDArray[np.int64],
) -> int:
    """Adds vehicles at the first free places among the given ones; returns their number.

    Args:
        town: arrays of the town.
        world: arrays of the world.
        lanes: (n,) of the places.
        stations: (n,) [m].
        rideable: (lanes,) on which cyclists may begin.
        cycles: (room,) whether each new vehicle is a cyclist.
        shares: (room,) in [0, 1): its desired speed, as a share of the range.
        pool: see `randomness.seed_of`.
    """
    count, row = 0, 0
    for k in range(len(lanes)):
        if count == len(cycles):
            break
        if cycles[count] and not rideable[lanes[k]]:
            continue
        if is_free(town, world, lanes[k], stations[k], NOBODY, CLEAR_OF_CAR):
            while world.vehicles[row].kind != Kind.EMPTY:
                row += 1
            low, high = CYCLIST_SPEEDS if cycles[count] else VEHICLE_SPEEDS
            kind, desired = Kind.CYCLIST if cycles[count] else Kind.CAR, low + (high - low) * shares[count]
            _put_vehicle(town, world, row, kind, lanes[k], stations[k], desired, pool)
            count += 1
    return count


def _add_people(
    network: TownNetwork, town: TownArrays, world: WorldArrays, rng: np.random.Generator, pedestrians: int
) -> None:
    ends = _footways(network)
    room = min(pedestrians, int((plain(world.pedestrians)["state"] == Walk.EMPTY).sum()))
    if room == 0 or not len(ends):
        return
    walks = ends.searchsorted(rng.random(TRIES * room), side="right")  # as `rng.choice` with these weights
    place = empty_records(PedestrianRecord, 1)
    _fill_footways(town, world, walks, rng.random(len(walks) + room), room, place, np.zeros(POOL, dtype=np.int64))


@lru_cache(maxsize=16)
def _footways(network: TownNetwork) -> Array:
    """Returns the shares of the footways on which pedestrians begin, cumulated; (0,) if there are none."""
    walks = plain(town_arrays(network).walks)
    for kind in (Footway.PAVEMENT, Footway.STREET):
        lengths = np.where(walks["kind"] == kind, walks["length"], 0.0)
        if lengths.any():
            return _cumulated(lengths)
    return np.zeros(0)


@direct
@compiled
def _fill_footways(
    town: TownArrays,
    world: WorldArrays,
    walks: NDArray[np.int64],
    shares: Array,
    room: int,
    place: RecordArray[PedestrianRecord],
    pool: NDArray[np.int64],
) -> None:
    """Adds pedestrians at free places.

    Args:
        town: arrays of the town.
        world: arrays of the world.
        walks: (n,) footways that are tried.
        shares: (n + room,) in [0, 1): of the footway's length; after each free place, of the range of the speeds.
        room: maximum number of pedestrians.
        place: (1,) scratch.
        pool: see `randomness.seed_of`.
    """
    count, row, k = 0, 0, 0
    walker = place[0]
    walker.direction = 1.0
    for walk in walks:
        if count == room:
            return
        walker.walk, walker.station = walk, town.walks[walk].length * shares[k]
        k += 1
        x, y, _, _ = place_beside(town, walker, walker.station, 0.0)
        if is_clear_of_people(world, x, y, NOBODY, CLEAR_OF_WALKER):
            while world.pedestrians[row].state != Walk.EMPTY:
                row += 1
            pace = PACES[0] + (PACES[1] - PACES[0]) * shares[k]
            k += 1
            _put_pedestrian(town, world, row, walk, walker.station, pace, pool)
            count += 1
