"""What lies ahead of the car on its planned path: lanes, and the next junction where there is a choice."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dorothie_gym.spaces import ExitColumn
from dorothie_gym.world.car.path import Path
from dorothie_gym.world.town import Exit, Town
from dorothie_gym.world.town.model import Array
from dorothie_gym.world.world import World


class Options(NamedTuple):
    """Turn options at a junction.

    Attributes:
        exits: ways on, from right to left.
        rows: the same as rows of `ExitColumn` (n, 6), the distance still to be filled in.
        at: place of the junction on the path [m].
    """

    exits: tuple[Exit, ...]
    rows: Array
    at: float


NO_OPTIONS = Options((), np.zeros((0, len(ExitColumn))), 0.0)


class Prospect:
    """The path ahead of the car in a session; looked at anew when there is another path.

    The answers are those of `LocalPlanner.lanes_ahead` and `LocalPlanner.exits`.
    """

    def __init__(self, world: World) -> None:
        self._planner, self._town = world.planner, world.town
        self._numbers = {junction.id: k for k, junction in enumerate(world.town.junctions)}
        self._rows: dict[int, Array] = {}
        self._path: Path | None = None
        self._starts: list[int] = []
        self._lanes: list[int] = []
        self._options = NO_OPTIONS
        self._holds = range(0)  # stretches from which these are the next options

    @property
    def lanes(self) -> list[int]:
        """Lanes of the path from here on, each once, in order."""
        return self._lanes[self._stretch() :]

    @property
    def options(self) -> Options:
        """Turn options at the next junction with a choice; none where the path comes to none."""
        stretch = self._stretch()
        if stretch not in self._holds:
            self._options, until = self._next_options(stretch)
            self._holds = range(stretch, until + 1)
        return self._options

    def _stretch(self) -> int:
        """Number of the stretch of the path, all of one lane, that the car is on."""
        planner = self._planner
        if planner.path is not self._path:
            path = self._path = planner.path
            starts = (np.flatnonzero(path.lanes[1:] != path.lanes[:-1]) + 1).tolist()
            self._starts = [0, *starts]
            self._lanes = path.lanes[self._starts].tolist()
            self._holds = range(0)
        k = self._path.index_at(planner.s)
        stretch = len(self._starts) - 1
        while self._starts[stretch] > k:
            stretch -= 1
        return stretch

    def _next_options(self, stretch: int) -> tuple[Options, int]:
        """The options at the next choice, and the last stretch from which they are the next."""
        path = self._planner.path
        for k in range(stretch, len(self._lanes)):
            lane = self._town.lanes[self._lanes[k]]
            if lane.in_junction or not is_choice(self._town, lane.id):
                continue
            # the lane may come again, round a block: its last point on the path counts
            last = len(self._lanes) - 1 - self._lanes[::-1].index(lane.id)
            point = (self._starts[last + 1] if last + 1 < len(self._starts) else len(path.s)) - 1
            left = lane.length - float(path.stations[point])
            return Options(self._town.exits(lane.id), self._rows_of(lane.id), float(path.s[point]) + left), k
        return NO_OPTIONS, len(self._lanes)

    def _rows_of(self, lane: int) -> Array:
        if lane not in self._rows:
            self._rows[lane] = np.array(
                [
                    (1.0, way.angle, 0.0, way.lane, self._town.lanes[way.lane].street, self._number(way))
                    for way in self._town.exits(lane)
                ]
            )
        return self._rows[lane]

    def _number(self, way: Exit) -> int:
        return self._numbers.get(way.junction_id, -1)


def is_choice(town: Town, lane: int) -> bool:
    """Whether a turn has to be chosen at the end of a lane."""
    exits = town.exits(lane)
    return len(exits) > 1 and any(way.junction_id >= 0 for way in exits)
