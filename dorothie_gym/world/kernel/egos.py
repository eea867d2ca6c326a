"""Decisions of many egos at once, each the first vehicle of its world: they act, the worlds go on, they observe."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.world.compiling import compiled, concurrent, inlined
from dorothie_gym.world.kernel.batch import world_of
from dorothie_gym.world.kernel.kinematics import View, observe
from dorothie_gym.world.kernel.meta import NOTHING, control, decide, move, speed_along, take_helm
from dorothie_gym.world.kernel.records import Records
from dorothie_gym.world.kernel.stepping import find, step_around
from dorothie_gym.world.kernel.turns import take
from dorothie_gym.world.town.model import Array

if TYPE_CHECKING:
    from dorothie_gym.world.kernel.town_arrays import TownArrays
    from dorothie_gym.world.kernel.world_arrays import WorldArrays

OUTCOME = np.dtype([("speed", "f8"), ("along", "f8"), ("crashed", "b1")], align=True)
"""How an ego fares: its speed, and that along its lane, 0 off the road [m/s]."""


class Egos(NamedTuple):
    """The egos of a batch of worlds; all but `beside`, `speeds` and `rows` have a row for each world.

    Attributes:
        beside: see `meta.lanes_beside`.
        speeds: that may be held [m/s]; empty for egos that are given acceleration and steering.
        rows: int64 (1,) the row of an ego in its world.
        poses: (worlds, 1, 4) scratch: where they will be.
        helms: `meta.HELM`.
        ranges: (worlds, f, 2) see `kinematics.observe`.
        nearest: int32 (worlds, n) scratch, with `distances`.
        distances: (worlds, n) see there.
        observations: float32 (worlds, n, f).
        outcomes: `OUTCOME`.
    """

    beside: NDArray[np.int32]
    speeds: Array
    rows: NDArray[np.int64]
    poses: Array
    helms: Records
    ranges: Array
    nearest: NDArray[np.int32]
    distances: Array
    observations: NDArray[np.float32]
    outcomes: Records


@concurrent
def begin_one(number: int, town: TownArrays, batch: WorldArrays, view: View, egos: Egos) -> None:
    """Gives an ego that was put into its world its helm, and observes.

    Args:
        number: of the world.
        town: arrays of the town.
        batch: arrays of all worlds.
        view: what is observed.
        egos: the egos of all worlds.
    """
    vehicle = batch.vehicles[number][0]
    find(town, vehicle)
    take_helm(vehicle, egos.helms[number], egos.speeds)
    _report(number, town, batch, view, egos)


@concurrent
def play_share(
    turns: NDArray[np.int64], home: int, town: TownArrays, batch: WorldArrays, view: View, egos: Egos,
    actions: NDArray[np.int32], playing: NDArray[np.bool_], substeps: int, dt: float,
) -> None:  # fmt: skip
    """Plays a decision in worlds, as long as there are any whose turn has not come.

    Args:
        turns: numbers of the worlds, see `turns.take`; shared by all threads that work on them.
        home: number of the block that is this thread's own.
        town: arrays of the town.
        batch: arrays of all worlds.
        view: what is observed.
        egos: the egos of all worlds.
        actions: int32 (worlds,) meta actions.
        playing: (worlds,) which worlds go on at all.
        substeps: how many.
        dt: time of each [s].
    """
    number = take(turns, home)
    while number >= 0:
        if playing[number]:
            _play(number, town, batch, view, egos, actions[number], substeps, dt)
        number = take(turns, home)


@inlined
def _play(
    number: int, town: TownArrays, batch: WorldArrays, view: View, egos: Egos, action: int, substeps: int, dt: float
) -> None:
    """Plays a decision in one world."""
    world, helm, poses = world_of(batch, number), egos.helms[number], egos.poses[number]
    vehicle = world.vehicles[0]
    meta = len(egos.speeds) > 0
    if meta and action != NOTHING:
        decide(town, egos.beside, vehicle, helm, egos.speeds, action)
    for _ in range(substeps):
        if meta:
            control(town, vehicle, helm)
        move(vehicle, helm, poses[0], dt)
        step_around(town, world, dt, egos.rows, poses)
    _report(number, town, batch, view, egos)


@compiled
def _report(number: int, town: TownArrays, batch: WorldArrays, view: View, egos: Egos) -> None:
    world, outcome = world_of(batch, number), egos.outcomes[number]
    vehicle = world.vehicles[0]
    outcome.speed, outcome.crashed = vehicle.speed, vehicle.crashed
    outcome.along = speed_along(town, vehicle)
    observe(
        town, world, view, egos.ranges[number], egos.nearest[number], egos.distances[number], egos.observations[number]
    )
