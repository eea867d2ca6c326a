"""The state of one world as the compiled loops read and write it."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.ontology import PropKind
from dorothie_gym.world.kernel.order import rebuild
from dorothie_gym.world.kernel.parameters import (
    CAR_LENGTH,
    CAR_WIDTH,
    CYCLIST_FROM_EDGE,
    CYCLIST_LENGTH,
    CYCLIST_SPEED,
    CYCLIST_WIDTH,
    EVENTS,
    FRAMES,
    POINTS,
)
from dorothie_gym.world.kernel.records import (
    CAR,
    CLOCK,
    EVENT,
    EYE,
    LAMP,
    NOBODY,
    NODE,
    PEDESTRIAN,
    POINT,
    PROP,
    SEEN,
    TRACE,
    VEHICLE,
    Kind,
    Records,
    Walk,
)
from dorothie_gym.world.kernel.towing import is_free, new_key, put_on_lane
from dorothie_gym.world.kernel.town_arrays import TownArrays
from dorothie_gym.world.kernel.walking import place_walker
from dorothie_gym.world.network.network import TownNetwork
from dorothie_gym.world.places import free_places
from dorothie_gym.world.town.model import Array

PROPS = 16
"""Most props in a world."""

CAR_KEY = 0
"""Key of the session's car."""

STACK = 32
"""Most lanes that a search along lanes keeps in mind."""

SPEEDS = 6.5, 10.0
"""Range of the speeds that drivers like [m/s]."""

PACES = 1.1, 1.5
"""Range of the speeds that pedestrians like [m/s] (MUTCD 2009 reckons with 3.5 ft/s = 1.1 m/s)."""

ASIDE = 0.25
"""How far to the right of a pavement's middle one walks, as a share of half its width: turning cars cut corners."""

TRIES = 40
"""Places that are drawn for each vehicle."""


class WorldArrays(NamedTuple):
    """A world in arrays; copying the arrays copies the world.

    Attributes:
        vehicles: `records.VEHICLE`.
        pedestrians: `records.PEDESTRIAN`.
        props: `records.PROP`.
        nodes: `records.NODE`: two for each vehicle and four for each prop, in the lists of the lanes.
        heads: int32 first node of each lane, or -1.
        order: int32 bodies (vehicles, pedestrians, props) as `collisions` sorts them, by `keys` [m].
        keys: see there.
        lamps: `records.LAMP`, one for each light programme.
        busy: int32 how many walk on each crosswalk.
        stack: int32 scratch of searches along lanes, with `starts` [m].
        starts: see there.
        clock: one `records.CLOCK`.
        car: one `records.CAR`: what drives the session's car, if vehicle 0 is of the kind `Kind.DRIVEN`.
        path: `records.POINT`: the way that it follows.
        eye: one `records.EYE`: how well it sees.
        seen: `records.SEEN`: what it sees, nearest first.
        trace: (f, 12) its way in the last call of `step`, see `records.TRACE`.
        events: `records.EVENT`: what happened to it then.
    """

    vehicles: Records
    pedestrians: Records
    props: Records
    nodes: Records
    heads: NDArray[np.int32]
    order: NDArray[np.int32]
    keys: Array
    lamps: Records
    busy: NDArray[np.int32]
    stack: NDArray[np.int32]
    starts: Array
    clock: Records
    car: Records
    path: Records
    eye: Records
    seen: Records
    trace: Array
    events: Records

    @property
    def nbytes(self) -> int:
        """Memory of all arrays [bytes]."""
        return sum(array.nbytes for array in self)

    def copy(self) -> WorldArrays:
        """The same world once more."""
        return WorldArrays(*(_same(array) for array in self))

    def tobytes(self) -> bytes:
        """The state byte by byte, to compare worlds."""
        return b"".join(array.tobytes() for array in self)


def _same(array: Any) -> Any:
    """A copy with all bytes, also those between the fields of records, which NumPy leaves out."""
    copied = np.frombuffer(bytearray(array.tobytes()), dtype=array.dtype)
    return copied.view(np.recarray) if isinstance(array, np.recarray) else copied


def empty_world(
    town: TownArrays, *, vehicles: int, pedestrians: int, props: int = PROPS, seed: int | np.random.SeedSequence = 0,
    driven: bool = False
) -> WorldArrays:
    """A world with room for some bodies and nobody in it.

    Args:
        town: arrays of the town.
        vehicles: most vehicles.
        pedestrians: most pedestrians.
        props: most props.
        seed: of all that is drawn at random in it.
        driven: whether vehicle 0 will be a car that follows a path, `Kind.DRIVEN`.
    """

    def records(count: int, kind: np.dtype[np.void]) -> Records:
        return np.zeros(count, dtype=kind).view(np.recarray)

    world = WorldArrays(
        records(vehicles, VEHICLE), records(pedestrians, PEDESTRIAN), records(props, PROP),
        records(2 * vehicles + 4 * props, NODE), np.full(len(town.lanes), NOBODY, dtype=np.int32),
        np.arange(vehicles + pedestrians + props, dtype=np.int32), np.zeros(vehicles + pedestrians + props),
        records(len(town.programmes), LAMP), np.zeros(len(town.crossings), dtype=np.int32),
        np.zeros(STACK, dtype=np.int32), np.zeros(STACK), records(1, CLOCK),
        records(1, CAR), records(POINTS if driven else 1, POINT), records(1, EYE),
        records(vehicles + pedestrians + props if driven else 1, SEEN),
        np.zeros((FRAMES if driven else 1, len(TRACE))), records(EVENTS if driven else 1, EVENT),
    )  # fmt: skip
    world.car.closed = NOBODY
    world.car.closed_at = -math.inf
    world.car.lateral_last = world.car.stop_at = world.car.roadblock = world.car.action_end = math.inf
    world.car.hold_speed = -1.0
    world.nodes.lane = world.nodes.next = world.nodes.before = NOBODY
    world.lamps.until = -math.inf
    world.props.lane = NOBODY
    world.vehicles.lane = world.vehicles.approach = world.vehicles.claim = world.vehicles.inside = NOBODY
    source = seed if isinstance(seed, np.random.SeedSequence) else np.random.SeedSequence(seed)
    seeds = source.generate_state(vehicles + pedestrians + 1).astype(np.int64) | 1
    world.vehicles.random, world.pedestrians.random = seeds[:vehicles], seeds[vehicles:-1]
    world.clock.random = seeds[-1:]
    return world


def add_vehicle(
    town: TownArrays, world: WorldArrays, lane: int, station: float, *, kind: Kind = Kind.CAR, desired: float
) -> int:
    """Puts a vehicle on a lane, in the first place that is empty.

    Args:
        town: arrays of the town.
        world: arrays of the world.
        lane: id of the lane.
        station: along it [m].
        kind: what it is.
        desired: speed that it likes [m/s].

    Returns:
        Its number.

    Raises:
        ValueError: the world has no room for another one.
    """
    empty = np.flatnonzero(world.vehicles.kind == Kind.EMPTY)
    if not len(empty):
        raise ValueError(f"the world has room for {len(world.vehicles)} vehicles, and all are there")
    number = int(empty[0])
    vehicle = world.vehicles[number]
    vehicle.kind, vehicle.key, vehicle.touched = kind, new_key(world), False
    vehicle.length, vehicle.width, vehicle.desired, vehicle.to_right = CAR_LENGTH, CAR_WIDTH, desired, 0.0
    if kind is Kind.CYCLIST:
        vehicle.length, vehicle.width = CYCLIST_LENGTH, CYCLIST_WIDTH
        vehicle.desired = min(desired, CYCLIST_SPEED)
        vehicle.to_right = max(float(town.lanes[lane].half_width) - CYCLIST_FROM_EDGE, 0.0)
    vehicle.radius = 0.5 * math.hypot(vehicle.length, vehicle.width)
    put_on_lane(town, vehicle, lane, float(station))
    rebuild(town, world)
    return number


def add_car(town: TownArrays, world: WorldArrays, lane: int, station: float) -> None:
    """Puts the session's car on a lane, as vehicle 0 of a world that was made for it (`driven`).

    Args:
        town: arrays of the town.
        world: arrays of the world, with nobody in it yet.
        lane: id of the lane.
        station: along it [m].
    """
    add_vehicle(town, world, lane, station, kind=Kind.DRIVEN, desired=0.0)
    world.vehicles[0].key = CAR_KEY


def add_pedestrian(town: TownArrays, world: WorldArrays, walk: int, station: float, *, pace: float) -> int:
    """Puts a pedestrian on a pavement, in the first place that is empty.

    Args:
        town: arrays of the town.
        world: arrays of the world.
        walk: number of the pavement, its id in the town.
        station: along it [m].
        pace: speed that it likes [m/s].

    Returns:
        Its number.

    Raises:
        ValueError: the world has no room for another one, or there is no such pavement.
    """
    empty = np.flatnonzero(world.pedestrians.state == Walk.EMPTY)
    if not len(empty):
        raise ValueError(f"the world has room for {len(world.pedestrians)} pedestrians, and all are there")
    if not 0 <= walk < len(town.walks) or town.walks[walk].length <= 0.0:
        raise ValueError(f"there is no pavement {walk} in this town")
    number = int(empty[0])
    walker = world.pedestrians[number]
    walker.walk, walker.station, walker.pace, walker.key = walk, station, pace, new_key(world)
    walker.direction = 1.0 if walker.random & 2 else -1.0
    walker.aside = ASIDE * float(town.walks[walk].half_width)
    place_walker(town, walker)
    return number


def add_prop(
    network: TownNetwork, town: TownArrays, world: WorldArrays, kind: PropKind, lane: int, station: float
) -> int:
    """Puts a prop on a lane, where it stands across it.

    Args:
        network: of the town.
        town: its arrays.
        world: arrays of the world.
        kind: what it is.
        lane: id of the lane.
        station: along it [m].

    Returns:
        Its number.

    Raises:
        ValueError: the world has no room for another one.
    """
    empty = np.flatnonzero(~world.props.present)
    if not len(empty):
        raise ValueError(f"the world has room for {len(world.props)} props, and all are there")
    number = int(empty[0])
    prop, town_lane = world.props[number], network.town.lanes[lane]
    prop.x, prop.y = town_lane.position(station)
    prop.heading, prop.height = town_lane.heading_at(station), town_lane.height_at(station)
    prop.cos, prop.sin = math.cos(prop.heading), math.sin(prop.heading)
    prop.length, prop.width = kind.length, kind.width
    prop.radius = 0.5 * math.hypot(kind.length, kind.width)
    prop.lane, prop.present, prop.key = NOBODY, True, new_key(world)
    for k, (reached, at) in enumerate(_reached(network, prop)[:4]):
        prop.lane[k], prop.station[k] = reached, at
    rebuild(town, world)
    return number


def remove_prop(town: TownArrays, world: WorldArrays, number: int) -> None:
    """Takes a prop away."""
    world.props[number].present = False
    rebuild(town, world)


def _reached(network: TownNetwork, prop: Records) -> list[tuple[int, float]]:
    """Lanes on which a vehicle would touch a prop, the closest first, and where [m]."""
    found = []
    for lane in network.town.lanes:
        station, lateral = network.lane_of(lane.id).local_coordinates(np.array([prop.x, prop.y]))
        half = 0.5 * max(prop.width, prop.length) + 0.5 * CAR_WIDTH
        if abs(lateral) < half and 0.0 <= station <= lane.length and abs(lane.height_at(station) - prop.height) < 2.0:
            found.append((abs(lateral), lane.id, station))
    return [(lane, station) for _, lane, station in sorted(found)]


def populate(
    network: TownNetwork, town: TownArrays, world: WorldArrays, *, seed: int, vehicles: int, pedestrians: int,
    cyclists: float = 0.1,
) -> None:  # fmt: skip
    """Brings traffic and pedestrians to random places, as many as fit.

    Args:
        network: of the town.
        town: its arrays.
        world: arrays of the world.
        seed: of the places and of what everybody likes.
        vehicles: how many, cyclists included.
        pedestrians: how many; none in a town without pavements.
        cyclists: share of the vehicles.
    """
    rng = np.random.default_rng(seed)
    count = 0
    for lane, station in free_places(network.town, rng, TRIES * vehicles):
        if count == vehicles:
            break
        x, y = network.town.lanes[lane].position(station)
        if is_free(world, float(x), float(y), NOBODY):
            kind = Kind.CYCLIST if rng.random() < cyclists else Kind.CAR
            add_vehicle(town, world, lane, station, kind=kind, desired=float(rng.uniform(*SPEEDS)))
            count += 1
    lengths = town.walks.length
    if pedestrians and lengths.sum() > 0.0:
        for walk in rng.choice(len(lengths), size=pedestrians, p=lengths / lengths.sum()):
            station = float(rng.uniform(0.0, lengths[walk]))
            add_pedestrian(town, world, int(walk), station, pace=float(rng.uniform(*PACES)))
