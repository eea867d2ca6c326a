"""Many worlds of one town in one set of arrays: every array of `WorldArrays` with a leading axis of worlds."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba.extending import overload
from numpy.typing import NDArray

from dorothie_gym.world.compiling import WITHOUT_COUNTS, concurrent
from dorothie_gym.world.kernel.stepping import step
from dorothie_gym.world.kernel.town_arrays import TownArrays
from dorothie_gym.world.kernel.turns import take
from dorothie_gym.world.kernel.world_arrays import WorldArrays
from dorothie_gym.world.town.model import Array

WOVEN_IN = {**WITHOUT_COUNTS, "forceinline": True}


def stacked(world: WorldArrays, count: int) -> WorldArrays:
    """A batch of copies of a world; its arrays have the shapes (count, ...)."""
    batch = WorldArrays(*(_room(np.asarray(array), count, isinstance(array, np.recarray)) for array in world))
    for number in range(count):
        put(batch, number, world)
    return batch


def _room(array: NDArray[Any], count: int, records: bool) -> Any:
    room = np.zeros((count, *array.shape), dtype=array.dtype)
    return room.view(np.recarray) if records else room


def put(batch: WorldArrays, number: int, world: WorldArrays) -> None:
    """Makes a world of a batch the same as another world, byte by byte.

    Raises:
        ValueError: the other world has room for other numbers of bodies.
    """
    for name, row, array in zip(WorldArrays._fields, world_of(batch, number), world, strict=True):
        if row.shape != array.shape:
            raise ValueError(f"the worlds of this batch have {name} of the shape {row.shape}, this one {array.shape}")
        # as bytes, since NumPy leaves out those between the fields of records
        np.copyto(np.asarray(row).view(np.uint8), np.asarray(array).view(np.uint8))


def world_of(batch: WorldArrays, number: int) -> WorldArrays:
    """A world of a batch: views of its arrays, of the same types as those of a world that stands alone."""
    return WorldArrays(*_rows(batch, number))


def _rows(arrays: tuple[Any, ...], number: int) -> tuple[Any, ...]:
    return tuple(array[number] for array in arrays)


@overload(world_of, jit_options=WOVEN_IN)
def _compiled_world_of(batch: Any, number: int) -> Any:
    def one(batch: Any, number: int) -> Any:
        return WorldArrays(*_rows(batch, number))

    return one


@overload(_rows, jit_options=WOVEN_IN)
def _compiled_rows(arrays: Any, number: int) -> Any:
    # the items of a tuple are of several types: numba takes them one by one when it compiles
    def last(arrays: Any, number: int) -> Any:
        return (arrays[0][number],)

    def first_and_others(arrays: Any, number: int) -> Any:
        return (arrays[0][number], *_rows(arrays[1:], number))

    return last if len(arrays) == 1 else first_and_others


@concurrent
def step_share(
    turns: NDArray[Any],
    home: int,
    town: TownArrays,
    batch: WorldArrays,
    substeps: int,
    dt: float,
    acceleration: Array,
    steering: Array,
) -> None:
    """Lets worlds of a batch go on, each as `step` does, as long as there are any whose turn has not come.

    Args:
        turns: numbers of the worlds, see `turns.take`; shared by all threads that work on the batch.
        home: number of the block that is this thread's own.
        town: arrays of the town.
        batch: arrays of all worlds.
        substeps: how many.
        dt: time of each [s].
        acceleration: (worlds,) of each world's vehicles of the kind `Kind.EGO` [m/s^2].
        steering: (worlds,) angle of their front wheels, positive to the right [rad].
    """
    number = take(turns, home)
    while number >= 0:
        step(town, world_of(batch, number), substeps, dt, acceleration[number], steering[number])
        number = take(turns, home)
