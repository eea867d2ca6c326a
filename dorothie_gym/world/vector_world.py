"""Many worlds of one town, stepped by several threads."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import numpy as np

from dorothie_gym.world.crew import Crew
from dorothie_gym.world.kernel import TownArrays, WorldArrays
from dorothie_gym.world.kernel.batch import put, stacked, step_share, world_of
from dorothie_gym.world.kernel.turns import turns_of
from dorothie_gym.world.town.model import Array


class VectorWorld:
    """Worlds of one town in one set of arrays; every thread steps a share of them in one compiled call.

    A thread has a block of worlds of its own, which stay in its processor's cache; when it is done with them it takes
    those that others have not come to: who wakes up late, or gets worlds with much traffic, does fewer.
    What happens in a world depends on its own arrays only: not on the other worlds, its place among them, or the
    threads. Threads share nothing that is written to, and hold the interpreter's lock between calls only.

    Attributes:
        town: arrays of the town.
        arrays: arrays of all worlds, those of a single one with a leading axis: `arrays.vehicles[b]`.
        threads: how many threads work, the caller's included.
    """

    def __init__(self, town: TownArrays, world: WorldArrays, worlds: int, *, threads: int | None = None) -> None:
        """Make copies of a world, each to be replaced by `put`.

        Args:
            town: arrays of the town.
            world: a world of it; the others have room for as many bodies.
            worlds: how many.
            threads: how many threads at most, by default as many as there are processors for this process.

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
        self._crew = Crew(self.threads - 1)

    def __len__(self) -> int:
        return len(self.arrays.clock)

    def world(self, number: int) -> WorldArrays:
        """A world as views of the arrays of all; raises `IndexError` if there is no such world."""
        return world_of(self.arrays, range(len(self))[number])

    def put(self, number: int, world: WorldArrays) -> None:
        """Makes one of the worlds the same as another world, which has room for as many bodies."""
        put(self.arrays, range(len(self))[number], world)

    def step(self, substeps: int, dt: float, acceleration: Array | float = 0.0, steering: Array | float = 0.0) -> None:
        """Lets all worlds go on, as `kernel.step` does with one.

        Args:
            substeps: how many.
            dt: time of each [s].
            acceleration: (worlds,) or one for all: of vehicles of the kind `Kind.EGO` [m/s^2].
            steering: (worlds,) or one for all: angle of their front wheels, positive to the right [rad].

        Raises:
            ValueError: the actions do not fit the number of worlds.
        """
        actions = (self._one_each("acceleration", acceleration), self._one_each("steering", steering))
        self.share(step_share, self.town, self.arrays, substeps, float(dt), *actions)

    def _one_each(self, name: str, value: Array | float) -> Array:
        values = np.asarray(value, dtype=np.float64)
        if values.shape not in ((), (len(self),)):
            raise ValueError(f"{name} must be one number or {len(self)} numbers, not of the shape {values.shape}")
        return np.array(np.broadcast_to(values, len(self)))

    def share(self, work: Callable[..., None], *arguments: Any) -> None:
        """Calls `work(turns, home, *arguments)` in every thread, and waits for all of them.

        Args:
            work: works on the worlds whose numbers it takes (`kernel.turns`) until there is none left.
            arguments: for it.
        """
        turns = turns_of(len(self), self.threads)
        self._crew.do(work, lambda home: (turns, home, *arguments))

    def close(self) -> None:
        """Lets the threads go; the worlds cannot be stepped any more."""
        self._crew.close()


def available_processors() -> int:
    """How many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
