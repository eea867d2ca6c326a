"""highway-env's `Kinematics` observation of a vehicle, written from the arrays."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.world.compiling import compiled, inlined
from dorothie_gym.world.kernel.lanes import project
from dorothie_gym.world.kernel.parameters import CAR_LENGTH, MAX_SPEED
from dorothie_gym.world.kernel.records import Kind, Walk
from dorothie_gym.world.town.model import Array

if TYPE_CHECKING:
    from dorothie_gym.world.kernel.town_arrays import TownArrays
    from dorothie_gym.world.kernel.world_arrays import WorldArrays

PRESENCE, X, Y, VX, VY, HEADING, COS, SIN = range(8)

FEATURES = {
    "presence": PRESENCE, "x": X, "y": Y, "vx": VX, "vy": VY, "heading": HEADING, "cos_h": COS, "sin_h": SIN,
}  # fmt: skip
"""Features by highway-env's names."""

PERCEIVED = 5.0 * MAX_SPEED
"""Who is farther away is not observed [m], `AbstractEnv.PERCEPTION_DISTANCE`."""

BEHIND = 2.0 * CAR_LENGTH
"""Who is farther behind is not observed unless `see_behind` [m], `Road.close_objects_to`."""


class View(NamedTuple):
    """What is observed, and how.

    Attributes:
        features: int32 (f,) codes of the columns.
        absolute: whether others are seen where they are, not relative to the observer.
        ordered: whether the closest ones along the lane come first; otherwise in the order of their numbers.
        behind: whether those far behind are seen.
        clip: whether normalised values are kept in [-1, 1].
        walkers: whether pedestrians are seen, too.
    """

    features: NDArray[np.int32]
    absolute: bool
    ordered: bool
    behind: bool
    clip: bool
    walkers: bool


@compiled
def observe(
    town: TownArrays, world: WorldArrays, view: View, ranges: Array, nearest: NDArray[np.int32], distances: Array,
    rows: NDArray[np.float32],
) -> None:  # fmt: skip
    """Writes what the first vehicle of a world observes: itself in the first row, then others, then rows of zeros.

    Args:
        town: arrays of the town.
        world: arrays of the world.
        view: what is observed.
        ranges: (f, 2) values of each feature that become -1 and 1; NaN where it is not normalised.
        nearest: int32 (n,) scratch, with `distances`.
        distances: (n,) see there.
        rows: float32 (n, f), written to.
    """
    count = _find_nearest(town, world, view, nearest, distances, len(rows) - 1)
    vehicles = len(world.vehicles)
    for k in range(len(rows)):
        body = 0 if k == 0 else nearest[k - 1]
        for f in range(len(view.features)):
            feature, value = view.features[f], 0.0
            if k <= count:
                if body < vehicles:
                    value = _feature(world.vehicles[body], feature)
                else:
                    value = _feature(world.pedestrians[body - vehicles], feature)
                if k > 0 and not view.absolute and X <= feature <= VY:
                    value -= _feature(world.vehicles[0], feature)
                low, high = ranges[f, 0], ranges[f, 1]
                if not math.isnan(low):
                    value = -1.0 + (value - low) * 2.0 / (high - low)
                    value = min(max(value, -1.0), 1.0) if view.clip else value
            rows[k, f] = value


@compiled
def _find_nearest(
    town: TownArrays, world: WorldArrays, view: View, nearest: NDArray[np.int32], distances: Array, room: int
) -> int:
    """Lists whom the first vehicle observes, as many as there is room for; returns how many.

    `Road.close_objects_to`: vehicles before pedestrians where the order does not tell, and of these only those ahead.
    """
    vehicles, walkers = world.vehicles, world.pedestrians
    count = 0
    for i in range(1, len(vehicles)):
        if vehicles[i].kind != Kind.EMPTY:
            ahead = _ahead(town, vehicles[0], vehicles[i])
            if view.behind or ahead > -BEHIND:
                count = _list(view, i, ahead, nearest, distances, count, room)
    for p in range(len(walkers) if view.walkers else 0):
        if walkers[p].state != Walk.EMPTY:
            ahead = _ahead(town, vehicles[0], walkers[p])
            if ahead > -BEHIND:
                count = _list(view, len(vehicles) + p, ahead, nearest, distances, count, room)
    return count


@inlined
def _ahead(town: TownArrays, observer: Any, other: Any) -> float:
    """How far along the observer's lane another body is ahead of it [m]; NaN for those too far away."""
    dx, dy = other.x - observer.x, other.y - observer.y
    if dx * dx + dy * dy >= PERCEIVED * PERCEIVED:
        return math.nan
    station, _, _ = project(town, observer.lane, other.x, other.y)
    return float(station - observer.own_station)


@inlined
def _list(
    view: View, body: int, ahead: float, nearest: NDArray[np.int32], distances: Array, count: int, room: int
) -> int:
    """Puts a body into the list, behind those that are as close; returns how many are in it."""
    if math.isnan(ahead):
        return count
    distance = abs(ahead) if view.ordered else 0.0
    at = count
    while at > 0 and distances[at - 1] > distance:
        if at < room:
            nearest[at], distances[at] = nearest[at - 1], distances[at - 1]
        at -= 1
    if at < room:
        nearest[at], distances[at] = body, distance
        count = min(count + 1, room)
    return count


@inlined
def _feature(vehicle: Any, feature: int) -> float:
    if feature == X:
        return float(vehicle.x)
    if feature == Y:
        return float(vehicle.y)
    if feature == VX:
        return float(vehicle.speed * vehicle.cos)
    if feature == VY:
        return float(vehicle.speed * vehicle.sin)
    if feature == HEADING:
        return float(vehicle.heading)
    if feature == COS:
        return float(vehicle.cos)
    return float(vehicle.sin) if feature == SIN else 1.0
