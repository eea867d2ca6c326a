"""Perception of bodies by the ego: misses beyond the range of sight, and errors of place.

All random values are hashes of the seed, the body and the time: they do not depend on the number or order of calls.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.sim.pedestrians.pacing import WALKER_SIZE
from dorothie_gym.sim.sensing.visibility import (
    CLEAR_SIGHT,
    HEAD_LIGHTS,
    SHORTEST_SIGHT,
    Visibility,
    gain,
    sight_in,
    signal,
)
from dorothie_gym.sim.state.codes import PEDESTRIAN_CLASS, STATIC, VEHICLES, Group, Kind, Walk
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import compiled, inlined
from dorothie_gym.support.compilation.records import RecordArray
from dorothie_gym.support.copying import CachedViews

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.sim.state.records import (
        EyeRecord,
        PedestrianRecord,
        PlacedBody,
        PropRecord,
        SeenRecord,
        VehicleRecord,
    )
    from dorothie_gym.sim.state.world_arrays import WorldArrays


GLANCE = FRAME_RATE // 2
"""Time for which errors and misses stay the same [frames]."""

RANGE_SCALE = 900.0
"""A camera's error of range is distance^2 / RANGE_SCALE: 5 % at 45 m, 10 % at 90 m (Stein, Mano and Shashua, IEEE
Intelligent Vehicles Symposium 2003) [m]."""

BEARING_ERROR = math.radians(0.25)
"""Error of bearing in poor sight [rad]: at 38 m, the sight at night with lights on, twice that is less than the room
that the ego leaves beside others (`obstacles.SIDE_MARGIN`)."""

MOST_ERROR = 1.0
"""Bound of the loss that scales errors: poor sight at most adds the camera's own error once more."""

MOST_SIGMAS = 2.0
"""Bound of the errors in standard deviations."""

_FAR = CLEAR_SIGHT * CLEAR_SIGHT
_RADAR = SHORTEST_SIGHT * SHORTEST_SIGHT

# splitmix64 (Steele, Lea and Flood, OOPSLA 2014) in signed numbers: numba makes floats of mixtures with unsigned ones
_GOLDEN = 0x9E3779B97F4A7C15 - (1 << 64)
_MIX_A = 0xBF58476D1CE4E5B9 - (1 << 64)
_MIX_B = 0x94D049BB133111EB - (1 << 64)
_LOW_63 = (1 << 63) - 1
_UNIT = 2.0**-53


@compiled
def see(
    vehicles: RecordArray[VehicleRecord],
    pedestrians: RecordArray[PedestrianRecord],
    props: RecordArray[PropRecord],
    seen: RecordArray[SeenRecord],
    eye: EyeRecord,
    x: float,
    y: float,
    frame: int,
    skip: int,
) -> int:
    """Looks at all bodies within `visibility.CLEAR_SIGHT`.

    Bodies within the range of sight are always perceived, those beyond it now and then. A clear noon has no errors.

    Args:
        vehicles: (n,) vehicles.
        pedestrians: (m,) pedestrians.
        props: (k,) props.
        seen: filled with the perceived bodies, nearest first, by key where that is equal; if it is too short the
            farthest are left out.
        eye: the visibility.
        x: position of the observer [m].
        y: [m].
        frame: current frame.
        skip: row of the observer among the vehicles, -1 if it is not one of them.

    Returns:
        Number of perceived bodies.
    """
    count = 0
    for i in range(len(vehicles)):
        vehicle = vehicles[i]
        if i != skip and vehicle.kind != Kind.EMPTY and _is_near(vehicle, x, y):
            count = _look_at(seen, count, eye, vehicle, x, y, frame, i, Group.VEHICLES)
    for i in range(len(pedestrians)):
        walker = pedestrians[i]
        if walker.state != Walk.EMPTY and _is_near(walker, x, y):
            count = _look_at(seen, count, eye, walker, x, y, frame, i, Group.PEDESTRIANS)
    for i in range(len(props)):
        prop = props[i]
        if prop.present and _is_near(prop, x, y):
            count = _look_at(seen, count, eye, prop, x, y, frame, i, Group.PROPS)
    for k in range(count):
        _describe(seen[k], vehicles, pedestrians, props)
    return count


@compiled
def look_around(world: WorldArrays, frame: int, table: Array) -> int:
    """Looks at all bodies from the ego and writes the perceived ones into a table.

    Args:
        world: arrays of the world.
        frame: current frame.
        table: (n, 9) columns `perception.BODY`, written; as long as `world.seen`.

    Returns:
        Number of rows written.
    """
    car = world.vehicles[0]
    count = see(world.vehicles, world.pedestrians, world.props, world.seen, world.eye[0], car.x, car.y, frame, 0)
    for k in range(count):
        body = world.seen[k]
        table[k, 0], table[k, 1], table[k, 2], table[k, 3] = body.key, body.kind, body.x, body.y
        table[k, 4], table[k, 5], table[k, 6] = body.heading, body.length, body.width
        table[k, 7], table[k, 8] = body.speed, body.height
    return count


@compiled
def switch_lamps(eye: EyeRecord, on: bool) -> None:
    """Switches the headlights in the visibility of an ego; air, light and clarity stay as they are."""
    eye.lamps = HEAD_LIGHTS if on else 0.0
    eye.sight = sight_in(eye.fog, eye.fog_start, eye.rain, eye.light, eye.lamps, eye.clarity)
    far = gain(eye.fog, eye.fog_start, eye.rain, eye.light, eye.lamps, eye.clarity, CLEAR_SIGHT)
    eye.clear = far >= 1.0


@compiled
def detection_chance(signal: float) -> float:
    """Returns the probability to perceive a body beyond the range of sight: the square of its signal, at most 1."""
    bounded = min(signal, 1.0)
    return bounded * bounded


@compiled
def errors_of_place(gain: float, distance2: float) -> tuple[float, float]:
    """Returns the standard deviations of a perceived place [m], along the line of sight and across.

    Errors go with one over the root of the signal, as in the Cramer-Rao bound, less those of a clear noon, where they
    are exactly 0. Within the range of the radar places are known.

    Args:
        gain: share of a clear noon's signal.
        distance2: square of the distance [m^2].
    """
    loss = min(1.0 / math.sqrt(gain) - 1.0, MOST_ERROR) if gain > 0.0 else MOST_ERROR
    beyond = max(distance2 - _RADAR, 0.0)
    return loss * beyond / RANGE_SCALE, loss * BEARING_ERROR * math.sqrt(beyond)


@inlined
def _is_near(body: PlacedBody, x: float, y: float) -> bool:
    dx, dy = body.x - x, body.y - y
    return bool(dx * dx + dy * dy < _FAR)


@inlined
def _look_at(
    seen: RecordArray[SeenRecord],
    count: int,
    eye: EyeRecord,
    body: PlacedBody,
    x: float,
    y: float,
    frame: int,
    number: int,
    group: int,
) -> int:
    """Adds a body to the list if it is perceived; returns the list's length."""
    key, found_x, found_y, is_seen = int(body.key), float(body.x), float(body.y), True
    if not eye.clear:
        found_x, found_y, is_seen = _glimpse(eye, key, found_x, found_y, x, y, frame)
    if not is_seen:
        return count
    dx, dy = found_x - x, found_y - y
    return _insert(seen, count, dx * dx + dy * dy, key, found_x, found_y, number, group)


@compiled
def _glimpse(
    eye: EyeRecord, key: int, body_x: float, body_y: float, x: float, y: float, frame: int
) -> tuple[float, float, bool]:
    """Returns the perceived place of a body, and whether it is perceived at all."""
    dx, dy = body_x - x, body_y - y
    distance2 = dx * dx + dy * dy
    if distance2 <= _RADAR:  # never out of sight, and no errors
        return body_x, body_y, True
    distance = math.sqrt(distance2)
    left = gain(eye.fog, eye.fog_start, eye.rain, eye.light, eye.lamps, eye.clarity, distance)
    state = _stirred(_stirred(_stirred(0, int(eye.seed)), key), int(frame) // GLANCE)
    if distance > eye.sight:
        state = _signed(state + _GOLDEN)
        if _share(_mixed(state)) >= detection_chance(signal(left, distance)):
            return body_x, body_y, False
    away, aside = errors_of_place(left, distance2)
    if away > 0.0:
        first, state = _normal(state)
        second, state = _normal(state)
        along, across = 1.0 + away * first / distance, aside * second / distance
        return x + dx * along - dy * across, y + dy * along + dx * across, True
    return body_x, body_y, True


@inlined
def _insert(
    seen: RecordArray[SeenRecord], count: int, distance2: float, key: int, x: float, y: float, number: int, group: int
) -> int:
    """Inserts a body into the list by distance and key; returns the list's length."""
    at = count
    if count == len(seen):
        at = count - 1
        if at < 0 or not _is_before(distance2, key, seen[at]):
            return count
    else:
        count += 1
    while at > 0 and _is_before(distance2, key, seen[at - 1]):
        here, before = seen[at], seen[at - 1]
        here.distance2, here.key, here.x, here.y = before.distance2, before.key, before.x, before.y
        here.body, here.group = before.body, before.group
        at -= 1
    here = seen[at]
    here.distance2, here.key, here.x, here.y = distance2, key, x, y
    here.body, here.group = number, group
    return count


@inlined
def _is_before(distance2: float, key: int, other: SeenRecord) -> bool:
    return bool(distance2 < other.distance2 or (distance2 == other.distance2 and key < other.key))


@inlined
def _describe(
    thing: SeenRecord,
    vehicles: RecordArray[VehicleRecord],
    pedestrians: RecordArray[PedestrianRecord],
    props: RecordArray[PropRecord],
) -> None:
    """Fills in the fields that have no errors."""
    if thing.group == Group.VEHICLES:
        vehicle = vehicles[thing.body]
        thing.kind, thing.speed, thing.length, thing.width = VEHICLES, vehicle.speed, vehicle.length, vehicle.width
        thing.heading, thing.cos, thing.sin, thing.height = vehicle.heading, vehicle.cos, vehicle.sin, vehicle.height
    elif thing.group == Group.PEDESTRIANS:
        walker = pedestrians[thing.body]
        thing.kind, thing.speed, thing.length, thing.width = PEDESTRIAN_CLASS, walker.speed, WALKER_SIZE, WALKER_SIZE
        thing.heading, thing.cos, thing.sin, thing.height = walker.heading, walker.cos, walker.sin, walker.height
    else:
        prop = props[thing.body]
        thing.kind, thing.speed, thing.length, thing.width = STATIC, 0.0, prop.length, prop.width
        thing.heading, thing.cos, thing.sin, thing.height = prop.heading, prop.cos, prop.sin, prop.height


# --- Hash of seed, body and time --------------------------------------------------------------------------------------


@inlined
def _signed(value: int) -> int:
    """Returns the lowest 64 bits as a signed number, as compiled arithmetic does implicitly."""
    return (value & _LOW_63) - (((value >> 63) & 1) << 62) - (((value >> 63) & 1) << 62)


@inlined
def _mixed(state: int) -> int:
    """Returns the output of splitmix64 for an advanced state."""
    z = _signed((state ^ ((state >> 30) & ((1 << 34) - 1))) * _MIX_A)
    z = _signed((z ^ ((z >> 27) & ((1 << 37) - 1))) * _MIX_B)
    return z ^ ((z >> 31) & ((1 << 33) - 1))


@inlined
def _stirred(state: int, key: int) -> int:
    """Returns a state that also depends on a key."""
    return _mixed(_signed(state + _GOLDEN)) ^ key


@inlined
def _share(bits: int) -> float:
    """Returns a number in [0, 1) from the upper 53 of 64 bits."""
    return ((bits >> 11) & ((1 << 53) - 1)) * _UNIT


@inlined
def _normal(state: int) -> tuple[float, int]:
    """Returns a standard normal number (Box and Muller 1958), bounded by MOST_SIGMAS, and the next state."""
    state = _signed(state + _GOLDEN)
    radius = math.sqrt(-2.0 * pm.log(1.0 - _share(_mixed(state))))
    state = _signed(state + _GOLDEN)
    number = radius * pm.cos(2.0 * math.pi * _share(_mixed(state)))
    return min(max(number, -MOST_SIGMAS), MOST_SIGMAS), state


# --- Perception of a world --------------------------------------------------------------------------------------------


class Perception(CachedViews):
    """Perception with the errors of one seed."""

    CACHED_VIEWS: ClassVar[Sequence[str]] = ("_opened",)

    _opened: tuple[RecordArray[EyeRecord], Visibility] | None = None

    def __init__(self, rng: np.random.Generator) -> None:
        self._seed = int(rng.integers(1 << 63))

    def open(self, eyes: RecordArray[EyeRecord], visibility: Visibility) -> bool:
        """Writes the visibility and the seed into the record of a world.

        Args:
            eyes: (1,) record of the visibility, written.
            visibility: air and light.

        Returns:
            Whether anything has changed.
        """
        if self._opened is not None and self._opened[0] is eyes and self._opened[1] is visibility:
            return False
        self._opened = eyes, visibility
        view = visibility
        eyes[0] = (
            self._seed, view.sight, view.fog, view.fog_start, view.rain, view.light, view.lamps, view.clarity,
            view.is_clear,
        )  # fmt: skip
        return True


BODY = "key", "kind", "x", "y", "heading", "length", "width", "speed", "height"
"""Columns of a table of perceived bodies."""


def detection_probability(visibility: Visibility, distance: float) -> float:
    """Returns the probability to perceive a body at a distance [m]: 1 within sight, then falling with its signal."""
    if distance <= visibility.sight:
        return 1.0
    return float(detection_chance(visibility.signal(distance)))


def position_error(visibility: Visibility, distance: float) -> tuple[float, float]:
    """Returns the standard deviations of a perceived place at a distance [m], along the line of sight and across."""
    away, aside = errors_of_place(visibility.gain(distance), distance * distance)
    return float(away), float(aside)
