"""The ways on at a junction, in eighths of a circle: the same eight places in observations, words and actions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from dorothie_gym.maps import Exit, Town
from dorothie_gym.maps.model import wrap_degrees
from dorothie_gym.policies.route_progress import is_choice, lanes_beside, next_choice
from dorothie_gym.spaces import ExitColumn

SECTORS = tuple(range(-180, 180, 45))
"""Middles of the eighths [degrees, positive left]: back, sharp right, right, half right, ahead, ..."""

SECTOR = 45.0
"""Width of an eighth [degrees]."""


@dataclass(frozen=True, kw_only=True)
class SectorExit:
    """A way on at a junction.

    Attributes:
        angle: of the exit that leads there, from the car's own lane where one does [degrees, positive left].
        lane: lane behind the junction.
        own: whether it leads there from the car's own lane; otherwise the car has to change lanes before.
        connectors: lanes across the junction that lead there, from all lanes of the direction.
    """

    angle: int
    lane: int
    own: bool
    connectors: frozenset[int]


class JunctionExits:
    """Looks up the ways on behind lanes of a town; each is found once.

    Every way has one of the eight `SECTORS`: the one closest to its angle, or where that is taken by another way that
    fits it better, one beside it. Lanes of one direction share their ways, so that a sector means the same on all.

    Attributes:
        town: the map.
    """

    def __init__(self, town: Town) -> None:
        self.town = town
        self._found: dict[int, tuple[SectorExit | None, ...]] = {}
        self._lanes = _lanes_by_exits(town)

    def after(self, lane: int) -> tuple[SectorExit | None, ...]:
        """Ways on behind a lane (8,), by sector."""
        found = self._found.get(lane)
        if found is None:
            found = self._found[lane] = self._find(lane)
        return found

    def choice_ahead(self, seen: Mapping[str, Any]) -> int | None:
        """The lane at whose end the Co-Wizard has to choose a way; None where it comes to no junction with a choice.

        Its turn options tell it, wherever the Co-Wizard believes to be; only where several lanes have the same ones,
        or where there are more than are observed, its place decides.
        """
        rows = seen["exits"]
        rows = rows[rows[:, ExitColumn.PRESENT] > 0.0]
        if not len(rows):
            return None
        lanes = self._lanes.get(tuple((int(row[ExitColumn.LANE]), int(row[ExitColumn.ANGLE])) for row in rows), ())
        if len(lanes) == 1:
            return lanes[0]
        believed = next_choice(self.town, int(seen["lane"]), float(seen["station"][0]))
        if believed is not None and (not lanes or believed.lane in lanes):
            return believed.lane
        return next(iter(lanes), None)

    def sector_of(self, lane: int, connector: int) -> int | None:
        """Sector of the way that a connector at the end of a lane takes, or None if it is no way on from there."""
        for k, way in enumerate(self.after(lane)):
            if way is not None and connector in way.connectors:
                return k
        return None

    def _find(self, lane: int) -> tuple[SectorExit | None, ...]:
        roads: dict[int, list[tuple[int, Exit]]] = {}
        for source in sorted((lane, *lanes_beside(self.town, lane))):
            for way in self.town.exits(source):
                if way.junction_id >= 0:
                    roads.setdefault(self.town.lanes[way.lane].road_id, []).append((source, way))
        sectors = _assign({road: ways[0][1].angle for road, ways in roads.items()})
        table: list[SectorExit | None] = [None] * len(SECTORS)
        for road, sector in sectors.items():
            ways = roads[road]
            own = [way for source, way in ways if source == lane]
            chosen = (own or [way for _, way in ways])[0]
            connectors = frozenset(way.connector for _, way in ways)
            table[sector] = SectorExit(angle=chosen.angle, lane=chosen.lane, own=bool(own), connectors=connectors)
        return tuple(table)


def nearest_sector(angle: float) -> int:
    """Number of the sector whose middle is closest to an angle [degrees, positive left]."""
    return round((angle + 180.0) / SECTOR) % len(SECTORS)


def _lanes_by_exits(town: Town) -> dict[tuple[tuple[int, int], ...], list[int]]:
    """Lanes that end at a junction with a choice, by their exits: the lanes that those lead to, and their angles."""
    found: dict[tuple[tuple[int, int], ...], list[int]] = {}
    for lane in town.lanes:
        if is_choice(town, lane.id) and not lane.in_junction:
            found.setdefault(tuple((way.lane, way.angle) for way in town.exits(lane.id)), []).append(lane.id)
    return found


def _assign(angles: dict[int, int]) -> dict[int, int]:
    """A sector for each way, those that fit best first; ways beyond the eighth are left out."""
    count = len(SECTORS)

    def misfit(key: int, sector: int) -> float:
        return abs(float(wrap_degrees(angles[key] - SECTORS[sector])))

    taken: dict[int, int] = {}
    for key in sorted(angles, key=lambda key: (misfit(key, nearest_sector(angles[key])), key)):
        free = [sector for sector in range(count) if sector not in taken.values()]
        if free:
            taken[key] = min(free, key=lambda sector: (misfit(key, sector), sector))
    return taken
