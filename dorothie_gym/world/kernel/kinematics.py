"""highway-env's `Kinematics` observation of a vehicle, written from the arrays."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.world.kernel.compiling import compiled, inlined
from dorothie_gym.world.kernel.lanes import project
from dorothie_gym.world.kernel.parameters import CAR_LENGTH, MAX_SPEED
from dorothie_gym.world.kernel.records import Kind
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
    """

    features: NDArray[np.int32]
    absolute: bool
    ordered: bool
    behind: bool
    clip: bool


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
    for k in range(len(rows)):
        for f in range(len(view.features)):
            value = 0.0
            if k <= count:
                vehicle = world.vehicles[0 if k == 0 else nearest[k - 1]]
                value = _feature(vehicle, view.features[f])
                if k > 0 and not view.absolute and X <= view.features[f] <= VY:
                    value -= _feature(world.vehicles[0], view.features[f])
                low, high = ranges[f, 0], ranges[f, 1]
                if not math.isnan(low):
                    value = -1.0 + (value - low) * 2.0 / (high - low)
                    value = min(max(value, -1.0), 1.0) if view.clip else value
            rows[k, f] = value


@inlined
def _find_nearest(
    town: TownArrays, world: WorldArrays, view: View, nearest: NDArray[np.int32], distances: Array, room: int
) -> int:
    """Lists whom the first vehicle observes, as many as there is room for; returns how many."""
    vehicles = world.vehicles
    observer, count = vehicles[0], 0
    for i in range(1, len(vehicles)):
        other = vehicles[i]
        dx, dy = other.x - observer.x, other.y - observer.y
        if other.kind == Kind.EMPTY or dx * dx + dy * dy >= PERCEIVED * PERCEIVED:
            continue
        station, _, _ = project(town, observer.lane, other.x, other.y)
        ahead = station - observer.own_station
        if not view.behind and ahead <= -BEHIND:
            continue
        distance = abs(ahead) if view.ordered else 0.0
        at = count
        while at > 0 and distances[at - 1] > distance:
            if at < room:
                nearest[at], distances[at] = nearest[at - 1], distances[at - 1]
            at -= 1
        if at < room:
            nearest[at], distances[at] = i, distance
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
