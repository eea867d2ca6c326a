"""Worlds with objects whose arrays are rows of a batch, so that one call steps all of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.sim.batch.worlds import VectorWorld
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.sim.state.world_arrays import WorldArrays, with_room_of
from dorothie_gym.sim.world import World, parts_of

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.sim.traffic_rules import WorldEvent


class WorldRows:
    """Worlds of one town, each a `World` that shows a row of the arrays of all."""

    def __init__(self, world: World, rows: int, threads: int) -> None:
        """Makes rows.

        Args:
            world: a world of the town; the rows have room for equally many bodies, and grow when one needs more.
            rows: number of rows.
            threads: number of threads at most, the caller's included.
        """
        self._batch = VectorWorld(world.actors.town_arrays, world.actors.arrays, rows, threads=threads)
        self._worlds: list[World | None] = [None] * rows
        self._views = self._rows()

    @property
    def arrays(self) -> WorldArrays:
        """Arrays of all worlds."""
        return self._batch.arrays

    @property
    def threads(self) -> int:
        """Number of threads, the caller's included."""
        return self._batch.threads

    def _rows(self) -> list[WorldArrays]:
        return [self._batch.world(row) for row in range(len(self._batch))]

    def put(self, row: int, world: World) -> None:
        """Moves a world into a row, in the place of the one before."""
        self._worlds[row] = None
        self._move_in(row, world)
        self._worlds[row] = world

    def settle(self, row: int) -> None:
        """Moves a world back into its row if it got other arrays, with more room."""
        world = self._worlds[row]
        if world is not None and world.actors.arrays is not self._views[row]:
            self._move_in(row, world)

    def _move_in(self, row: int, world: World) -> None:
        own = world.actors.arrays
        if self._batch.make_room(own):
            self._show()
        self._batch.put(row, with_room_of(self._batch.town, own, self._views[row]))
        world.actors.arrays = self._views[row]

    def _show(self) -> None:
        """Lets the worlds show their rows after all arrays were replaced."""
        before, self._views = self._views, self._rows()
        for old, new, world in zip(before, self._views, self._worlds, strict=True):
            if world is not None and world.actors.arrays is old:
                world.actors.arrays = new

    def step(self, rows: Sequence[int], frames: int) -> list[list[WorldEvent]]:
        """Runs the given worlds for a number of physics frames, as `World.step` does; returns the events of each."""
        worlds = [world for world in map(self._worlds.__getitem__, rows) if world is not None]
        playing = np.zeros(len(self._batch), dtype=np.bool_)
        playing[list(rows)] = True
        traces: list[list[Array]] = [[] for _ in worlds]
        for part in parts_of(frames):
            for world in worlds:
                world.begin_part()
            arrays = self._batch.arrays
            self._batch.step(part, 1.0 / FRAME_RATE, playing=playing)
            if self._batch.arrays is not arrays:
                self._show()
            for world, trace in zip(worlds, traces, strict=True):
                trace.append(world.end_part(part))
        return [world.end_step(trace) for world, trace in zip(worlds, traces, strict=True)]

    def share(self, work: Callable[..., None], *arguments: object) -> None:
        """Calls `work(turns, home, *arguments)` in every thread, see `VectorWorld.share`."""
        self._batch.share(work, *arguments)

    def close(self) -> None:
        """Ends the threads."""
        self._batch.close()
