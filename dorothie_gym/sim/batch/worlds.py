"""Many worlds of one town in one set of arrays: every array of `WorldArrays` with a leading axis of worlds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.sim.batch.threads import ThreadPool, turns_of
from dorothie_gym.sim.state.codes import CARRIED_OUT, NO_SPACE
from dorothie_gym.sim.state.world_arrays import WorldArrays, lengthened, with_room_of, world_of
from dorothie_gym.sim.step import step_share
from dorothie_gym.support.compilation import direct
from dorothie_gym.support.copying import CachedViews
from dorothie_gym.support.processors import available_processors

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.sim.state.town_arrays import TownArrays


def stacked(world: WorldArrays, count: int) -> WorldArrays:
    """Returns a batch of copies of a world; its arrays have the shapes (count, ...)."""
    batch = WorldArrays._make(_room(array, count) for array in world.plain())
    for number in range(count):
        put(batch, number, world)
    return batch


def _room(array: NDArray[np.generic], count: int) -> NDArray[np.generic]:
    room = np.zeros((count, *array.shape), dtype=array.dtype)
    return room.view(np.recarray) if array.dtype.names else room


def put(batch: WorldArrays, number: int, world: WorldArrays) -> None:
    """Makes a world of a batch the same as another world, byte by byte.

    Raises:
        ValueError: the other world has room for other numbers of bodies.
    """
    for name, row, array in zip(WorldArrays._fields, world_of(batch, number).plain(), world.plain(), strict=True):
        if row.shape != array.shape:
            raise ValueError(f"the worlds of this batch have {name} of the shape {row.shape}, this one {array.shape}")
        # as bytes, since NumPy leaves out those between the fields of records
        np.copyto(row.view(np.uint8), array.view(np.uint8))


def alone(world: WorldArrays) -> WorldArrays:
    """Returns a world as a batch of one: views of its arrays."""
    arrays = (array.reshape(1, *array.shape) for array in world.plain())
    return WorldArrays._make(array.view(np.recarray) if array.dtype.names else array for array in arrays)


_step_share = direct(step_share)


def step_alone(
    town: TownArrays, world: WorldArrays, substeps: int, dt: float, acceleration: float = 0.0, steering: float = 0.0
) -> int:
    """Steps a world as `sim.step.step` does, by the machine code of sessions: a batch of one.

    Args:
        town: arrays of the town.
        world: arrays of the world, changed in place.
        substeps: number of substeps.
        dt: time of each [s].
        acceleration: acceleration of vehicles of the kind `Kind.EGO` [m/s^2].
        steering: angle of their front wheels, positive to the right [rad].

    Returns:
        The answer of `step`.
    """
    return step_batch_of_one(town, alone(world), substeps, dt, acceleration, steering)


def step_batch_of_one(
    town: TownArrays, batch: WorldArrays, substeps: int, dt: float, acceleration: float = 0.0, steering: float = 0.0
) -> int:
    """Like `step_alone`, for a world that already is a batch (`alone`), which saves 30 us."""
    answers = np.full(1, NO_SPACE, dtype=np.int64)
    actions = np.array([acceleration], dtype=np.float64), np.array([steering], dtype=np.float64)
    _step_share(turns_of(1, 1), 0, town, batch, int(substeps), float(dt), *actions, answers)
    return int(answers[0])


# --- Batch of worlds --------------------------------------------------------------------------------------------------


class VectorWorld(CachedViews):
    """Worlds of one town in one set of arrays; every thread steps a share of them in one compiled call.

    A thread has a block of worlds of its own, which stay in its processor's cache; then it takes worlds that other
    threads have not reached yet, so that a late or busy thread does fewer. A world depends only on its own arrays: not
    on the other worlds, its row in the batch, or the threads. Threads share no memory that they write, and hold the
    interpreter's lock between calls only.

    Attributes:
        town: arrays of the town.
        arrays: arrays of all worlds, those of a single one with a leading axis: `arrays.vehicles[b]`.
        threads: number of threads, the caller's included.
    """

    CACHED_VIEWS: ClassVar[Sequence[str]] = ("_pool",)

    def __init__(self, town: TownArrays, world: WorldArrays, worlds: int, *, threads: int | None = None) -> None:
        """Makes copies of a world, each to be replaced by `put`.

        Args:
            town: arrays of the town.
            world: a world of the town; the others have room for equally many bodies.
            worlds: number of worlds.
            threads: maximum number of threads, by default the number of processors for this process.

        Raises:
            ValueError: there is not at least one world and one thread.
        """
        if worlds < 1:
            raise ValueError(f"worlds must be at least 1, not {worlds}")
        if threads is not None and threads < 1:
            raise ValueError(f"threads must be at least 1, or None for one per processor, not {threads}")
        self.town = town
        self.arrays = stacked(world, worlds)
        self.threads = min(threads or available_processors(), worlds)

    @cached_property
    def _pool(self) -> ThreadPool:
        return ThreadPool(self.threads - 1)

    def __len__(self) -> int:
        return len(self.arrays.clock)

    def world(self, number: int) -> WorldArrays:
        """Returns a world as views of the arrays of all; raises `IndexError` if there is no such world."""
        return world_of(self.arrays, range(len(self))[number])

    def put(self, number: int, world: WorldArrays) -> None:
        """Copies another world, which has room for equally many bodies, into one of the worlds."""
        put(self.arrays, range(len(self))[number], world)

    def make_room(self, world: WorldArrays) -> bool:
        """Gives all worlds the room of another one, if they have less; returns whether the arrays were replaced."""
        first = self.world(0)
        if all(len(mine) >= len(other) for mine, other in zip(first.plain(), world.plain(), strict=True)):
            return False
        rows = [with_room_of(self.town, self.world(number), world) for number in range(len(self))]
        self.arrays = stacked(rows[0], len(rows))
        for number, row in enumerate(rows):
            self.put(number, row)
        return True

    def step(
        self,
        substeps: int,
        dt: float,
        acceleration: Array | float = 0.0,
        steering: Array | float = 0.0,
        playing: NDArray[np.bool_] | None = None,
    ) -> None:
        """Steps worlds, as `sim.step.step` does with one; if a path needs more room, the arrays of all worlds grow.

        Args:
            substeps: number of substeps.
            dt: time of each [s].
            acceleration: (worlds,) or one for all: of vehicles of the kind `Kind.EGO` [m/s^2].
            steering: (worlds,) or one for all: angle of their front wheels, positive to the right [rad].
            playing: (worlds,) those that are stepped; None for all.

        Raises:
            ValueError: the number of actions differs from the number of worlds.
        """
        actions = (self._one_each("acceleration", acceleration), self._one_each("steering", steering))
        answers = np.full(len(self), NO_SPACE, dtype=np.int64)
        if playing is not None:
            answers[~playing] = CARRIED_OUT
        while (short := np.flatnonzero(answers == NO_SPACE)).size:
            self.share(_step_share, self.town, self.arrays, substeps, float(dt), *actions, answers)
            for number in short[answers[short] == NO_SPACE].tolist():
                self.make_room(lengthened(self.world(number)))

    def _one_each(self, name: str, value: Array | float) -> Array:
        values = np.asarray(value, dtype=np.float64)
        if values.shape not in ((), (len(self),)):
            raise ValueError(f"{name} must be one number or {len(self)} numbers, not of the shape {values.shape}")
        return np.array(np.broadcast_to(values, len(self)))

    def share(self, work: Callable[..., None], *arguments: object) -> None:
        """Calls `work(turns, home, *arguments)` in every thread, and waits for all of them.

        Args:
            work: takes numbers of worlds from the queue (`threads.take`) until there is none left.
            arguments: for it.
        """
        turns = turns_of(len(self), self.threads)
        self._pool.do(work, lambda home: (turns, home, *arguments))

    def close(self) -> None:
        """Ends the threads; the worlds cannot be stepped any more."""
        self._pool.close()
