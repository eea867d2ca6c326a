"""Exits of junctions by direction: eight sectors, used alike by observations, instructions and actions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.policies.navigation.observation_fields import SECTORS
from dorothie_gym.policies.route_progress import lanes_beside, next_choice
from dorothie_gym.policies.route_tables import is_choice, route_tables
from dorothie_gym.session.spaces.fields import SpaceLimits
from dorothie_gym.session.spaces.observations import ExitColumn, ObservationMapping
from dorothie_gym.support.compilation.records import by_reference
from dorothie_gym.support.copying import shared
from dorothie_gym.support.portable_math import wrap_degrees

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Exit
    from dorothie_gym.maps.town import Town

SECTOR_WIDTH = 45.0
"""Width of a sector [degrees]."""


@shared
@dataclass(frozen=True, kw_only=True)
class SectorExit:
    """Exit of a junction in a sector.

    Attributes:
        angle: angle of the exit, from the car's own lane where that has one [degrees, positive left].
        lane: lane beyond the junction.
        own: whether the exit can be reached from the car's lane; otherwise the car has to change lanes before.
        connectors: lanes across the junction that lead to the exit, from all lanes of the direction.
    """

    angle: int
    lane: int
    own: bool
    connectors: frozenset[int]


@shared
class JunctionExits:
    """Lookup of the exits after each lane of a town; computed on first use.

    Every exit has one of the eight `SECTORS`: the one closest to its angle, or a neighbour where another exit fits
    that one better. Lanes of one direction share their exits, so that a sector means the same on all of them.

    Attributes:
        town: the map.
    """

    def __init__(self, town: Town) -> None:
        self.town = town
        self._found: dict[int, tuple[SectorExit | None, ...]] = {}
        self._lanes = _lanes_by_exits(town)

    def by_sector(self, lane: int) -> tuple[SectorExit | None, ...]:
        """Returns the exits after a lane (8,), by sector."""
        found = self._found.get(lane)
        if found is None:
            found = self._found[lane] = self._find(lane)
        return found

    def choice_ahead(self, observation: ObservationMapping) -> int | None:
        """Returns the lane before the next junction with a choice; None if the car reaches none.

        The turn options of the Co-Wizard's observation identify the lane, even where the position has drifted. The
        position decides only where several lanes have the same options, or more than are observed.
        """
        rows = observation["exits"]
        rows = rows[rows[:, ExitColumn.PRESENT] > 0.0]
        if not len(rows):
            return None
        lanes = self._lanes.get(tuple((int(row[ExitColumn.LANE]), int(row[ExitColumn.ANGLE])) for row in rows), ())
        if len(lanes) == 1:
            return lanes[0]
        believed = next_choice(self.town, int(observation["lane"]), float(observation["station"][0]))
        if believed is not None and (not lanes or believed.lane in lanes):
            return believed.lane
        return next(iter(lanes), None)

    def sector_of(self, lane: int, connector: int) -> int | None:
        """Returns the sector of the exit that a connector at the end of a lane leads to; None if it leads to none."""
        for k, found in enumerate(self.by_sector(lane)):
            if found is not None and connector in found.connectors:
                return k
        return None

    def _find(self, lane: int) -> tuple[SectorExit | None, ...]:
        roads: dict[int, list[tuple[int, Exit]]] = {}
        for source in sorted((lane, *lanes_beside(self.town, lane))):
            for way in self.town.exits(source):
                if way.junction_id >= 0:
                    roads.setdefault(self.town.lanes[way.lane].road_id, []).append((source, way))
        sectors = _assign_sectors({road: exits[0][1].angle for road, exits in roads.items()})
        table: list[SectorExit | None] = [None] * len(SECTORS)
        for road, sector in sectors.items():
            exits = roads[road]
            own = [way for source, way in exits if source == lane]
            chosen = (own or [way for _, way in exits])[0]
            connectors = frozenset(way.connector for _, way in exits)
            table[sector] = SectorExit(angle=chosen.angle, lane=chosen.lane, own=bool(own), connectors=connectors)
        return tuple(table)


@by_reference
@shared
class ExitArrays(NamedTuple):
    """Exits of a town's junctions in arrays.

    Attributes:
        lane: (lanes, 8) int32 lane after the exit in each sector after a lane, -1 for none.
        angle: (lanes, 8) int32 its angle [degrees, positive left].
        street: (lanes,) int32 number of each lane's street.
        ahead: (lanes,) int32 lane before the next junction with a choice on the default lanes, -1 for none.
        first: (lanes,) int32 first of the lanes before a junction whose observed exits are the same as those of a lane;
            -1 for lanes that observed exits do not determine.
        alone: (lanes,) whether there is no other such lane.
    """

    lane: NDArray[np.int32]
    angle: NDArray[np.int32]
    street: NDArray[np.int32]
    ahead: NDArray[np.int32]
    first: NDArray[np.int32]
    alone: NDArray[np.bool_]


@lru_cache(maxsize=16)
def exit_arrays(town: Town) -> ExitArrays:
    """Returns the exits of a town's junctions in arrays; built once for each town."""
    exits, tables, count = JunctionExits(town), route_tables(town), len(town.lanes)
    lanes_by_sector = np.full((count, len(SECTORS)), -1, dtype=np.int32)
    arrays = ExitArrays(
        lanes_by_sector,
        lanes_by_sector.copy(),
        tables.street,
        tables.ahead,
        np.full(count, -1, dtype=np.int32),
        np.zeros(count, dtype=np.bool_),
    )
    for lane in np.flatnonzero(tables.choice).tolist():
        for sector, way in enumerate(exits.by_sector(lane)):
            if way is not None:
                arrays.lane[lane, sector], arrays.angle[lane, sector] = way.lane, way.angle
    for options, lanes in _lanes_by_exits(town).items():
        if len(options) <= SpaceLimits.exits:  # no more are observed
            arrays.first[lanes], arrays.alone[lanes] = lanes[0], len(lanes) == 1
    return arrays


def nearest_sector(angle: float) -> int:
    """Returns the number of the sector whose centre is closest to an angle [degrees, positive left]."""
    return round((angle + 180.0) / SECTOR_WIDTH) % len(SECTORS)


def _lanes_by_exits(town: Town) -> dict[tuple[tuple[int, int], ...], list[int]]:
    """Returns the lanes before junctions with a choice by their exits: lane beyond the junction and angle of each."""
    found: dict[tuple[tuple[int, int], ...], list[int]] = {}
    for lane in town.lanes:
        if is_choice(town, lane.id) and not lane.in_junction:
            found.setdefault(tuple((way.lane, way.angle) for way in town.exits(lane.id)), []).append(lane.id)
    return found


def _assign_sectors(angles: dict[int, int]) -> dict[int, int]:
    """Assigns a sector to each road by the angle of its exit, in order of fit; roads beyond the eighth get none."""
    count = len(SECTORS)

    def misfit(road: int, sector: int) -> float:
        return abs(float(wrap_degrees(angles[road] - SECTORS[sector])))

    taken: dict[int, int] = {}
    for road in sorted(angles, key=lambda road: (misfit(road, nearest_sector(angles[road])), road)):
        free = [sector for sector in range(count) if sector not in taken.values()]
        if free:
            taken[road] = min(free, key=lambda sector: (misfit(road, sector), sector))
    return taken
