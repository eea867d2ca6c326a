"""Sites of a town that a car can reach, found by exhaustive search over places two metres apart.

The search is independent of the router and its cells, so that it can check them. It requires room to stop 15 m before
a prop; 14 m for a U-turn, on the own lane ahead and on the oncoming lane behind the place where it ends; and 14 m of
road, free on both lanes, for a lane switch.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from dorothie_gym.maps import LinkType, Town
from dorothie_gym.maps.lane_neighbours import oncoming_lanes

STEP = 2.0
NEAREST = 15.0
"""Least distance between the middles of a car and of a prop ahead of it: 12.5 m and half the car's length [m]."""
SWITCH = 15.0
TURN = 14.0
AFTER_TURN = 6.0


class Move(NamedTuple):
    """Move to another node, with the stretches (lane, from, to) [m] that must be free of props."""

    target: int
    needs: tuple[tuple[int, float, float], ...]


class BruteForce:
    """Places of a town, two metres apart, and the moves of a car at each."""

    def __init__(self, town: Town) -> None:
        self._town = town
        counts = [int(lane.length // STEP) + 1 for lane in town.lanes]
        self._first = np.concatenate(([0], np.cumsum(counts))).astype(int)
        self._counts = counts
        self._oncoming = oncoming_lanes(town)
        self._moves = [self._moves_from(lane.id, k * STEP, k) for lane in town.lanes for k in range(counts[lane.id])]
        self._sites: dict[int, list[int]] = {}
        for site in town.sites:
            self._sites.setdefault(self._node(site.lane, site.station), []).append(site.id)

    def sites(self, car: tuple[int, float], props: Iterable[tuple[int, float]]) -> set[int]:
        """Returns the ids of the sites that a car can reach from a lane and station, past props at given places."""
        blocks: dict[int, list[float]] = {}
        for lane, station in props:
            blocks.setdefault(lane, []).append(station)
        start = -1
        moves = {start: self._moves_from(*car, int(car[1] // STEP))}
        found: set[int] = set()
        queue, seen = deque([start]), {start}
        while queue:
            node = queue.popleft()
            found.update(self._sites.get(node, ()))
            for move in moves[node] if node == start else self._moves[node]:
                if move.target in seen:
                    continue
                if any(low < at < high for lane, low, high in move.needs for at in blocks.get(lane, ())):
                    continue
                seen.add(move.target)
                queue.append(move.target)
        return found

    def _node(self, lane: int, station: float) -> int:
        return int(self._first[lane]) + min(int(station // STEP), self._counts[lane] - 1)

    def _moves_from(self, lane_id: int, station: float, k: int) -> list[Move]:
        town = self._town
        lane = town.lanes[lane_id]
        # driving on: no prop stands before the next place; a car past the middle of a prop has passed it
        ahead = (lane_id, station, station + STEP + NEAREST)
        if k + 1 < self._counts[lane_id]:
            found = [Move(int(self._first[lane_id]) + k + 1, (ahead,))]
        else:
            found = [
                Move(int(self._first[link.target]), (ahead, (link.target, -1.0, NEAREST)))
                for link in town.successors(lane_id)
            ]
        if lane.in_junction:
            return found
        for side in (LinkType.LANE_CHANGE_LEFT, LinkType.LANE_CHANGE_RIGHT):
            beside = town.neighbour(lane_id, side)
            if beside is None or station + SWITCH + 1.0 > lane.length:
                continue
            begin = town.lanes[beside].project(lane.position(station))[0]
            end = town.lanes[beside].project(lane.position(station + SWITCH))[0]
            needs = ((lane_id, station, station + SWITCH * 0.8), (beside, begin - 1.0, end + NEAREST))
            found.append(Move(self._node(beside, end), needs))
        oncoming = self._oncoming.at(lane_id, station)
        if oncoming is not None:
            land = oncoming.station + AFTER_TURN
            if land < town.lanes[oncoming.lane].length:
                swept = (oncoming.lane, oncoming.station - TURN, land + NEAREST)
                found.append(Move(self._node(oncoming.lane, land), ((lane_id, station, station + TURN), swept)))
        return found


@lru_cache(maxsize=4)
def brute_force(town: Town) -> BruteForce:
    """Returns the search of a town, built once."""
    return BruteForce(town)
