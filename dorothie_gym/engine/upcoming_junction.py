"""Next junction with a choice of exits on the planned path of the ego."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dorothie_gym.engine.path_measurements import next_choice
from dorothie_gym.maps import Exit
from dorothie_gym.maps.model import Array
from dorothie_gym.sim.ego.path import Path
from dorothie_gym.sim.world import World
from dorothie_gym.spaces import ExitColumn


class TurnOptions(NamedTuple):
    """Exits at a junction.

    Attributes:
        exits: exits from right to left.
        rows: the exits as rows of `ExitColumn` (n, 6); the column of the distance is not filled in.
        distance: distance to the junction along the path [m].
        lane: lane that ends at the junction; -1 if there is none.
    """

    exits: tuple[Exit, ...]
    rows: Array
    distance: float
    lane: int


NO_TURN_OPTIONS = TurnOptions((), np.zeros((0, len(ExitColumn))), 0.0, -1)


class UpcomingJunction:
    """Finds the next junction with a choice; the results agree with those of `LocalPlanner`."""

    def __init__(self, world: World) -> None:
        town = self._town = world.town
        self._planner = world.planner
        self._numbers = {junction.id: k for k, junction in enumerate(town.junctions)}
        self._rows: dict[int, Array] = {}
        self._path: Path | None = None  # path and position of the cached options
        self._s = 0.0
        self._options = NO_TURN_OPTIONS
        # Lanes outside junctions that end at a choice of exits.
        self._chooses = np.array([not lane.in_junction and _is_choice(town.exits(lane.id)) for lane in town.lanes])

    def options(self) -> TurnOptions:
        """Returns the exits at the next junction with a choice, or `NO_TURN_OPTIONS`."""
        planner = self._planner
        if planner.path is not self._path or planner.s != self._s:
            self._path, self._s = planner.path, planner.s
            self._options = self._find(planner.path, planner.s)
        return self._options

    def _find(self, path: Path, s: float) -> TurnOptions:
        point = next_choice(path.lanes, path.index_at(s), self._chooses)
        if point < 0:
            return NO_TURN_OPTIONS
        lane = int(path.lanes[point])
        left = self._town.lanes[lane].length - float(path.stations[point])
        return TurnOptions(self._town.exits(lane), self._rows_of(lane), float(path.s[point]) + left - s, lane)

    def _rows_of(self, lane: int) -> Array:
        rows = self._rows.get(lane)
        if rows is None:
            rows = self._rows[lane] = np.array([self._row(way) for way in self._town.exits(lane)])
        return rows

    def _row(self, way: Exit) -> tuple[float, ...]:
        street = self._town.lanes[way.lane].street
        return 1.0, way.angle, 0.0, way.lane, street, self._numbers.get(way.junction_id, -1)


def _is_choice(exits: tuple[Exit, ...]) -> bool:
    return len(exits) > 1 and any(way.junction_id >= 0 for way in exits)
