"""Tables of the ways on from each lane, built once for each town: exits, default successors, lanes beside, oncoming."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.lane_neighbours import oncoming_lanes
from dorothie_gym.maps.model import Exit, LinkType
from dorothie_gym.maps.town import Town
from dorothie_gym.sim.state.codes import NOBODY
from dorothie_gym.sim.state.town_records import ExitRecord, LaneExitsRecord, LaneRecord
from dorothie_gym.support.angles import wrap_degrees
from dorothie_gym.support.compilation.records import RecordArray, empty_records

ANOTHER_WAY = 15.0
"""Difference of angle from which on exits are different turns [degrees]."""

SIDES = (LinkType.LANE_CHANGE_LEFT, LinkType.LANE_CHANGE_RIGHT)


class LaneExits(NamedTuple):
    """The tables.

    Attributes:
        ways: ways on from each lane, by the lanes' ids.
        exits: exits, those of a lane in the order of `Town.exits`.
        lists: int32 lanes beside each lane, and lanes that may be oncoming.
    """

    ways: RecordArray[LaneExitsRecord]
    exits: RecordArray[ExitRecord]
    lists: NDArray[np.int32]


def build_exits(town: Town, lanes: RecordArray[LaneRecord]) -> LaneExits:
    """Builds the tables of a town; `lanes` are its lanes with their junctions."""
    ways = empty_records(LaneExitsRecord, len(town.lanes))
    exits: list[tuple[int, int, int, int]] = []
    lists: list[int] = []
    oncoming = oncoming_lanes(town)
    for lane in town.lanes:
        record, found = ways[lane.id], town.exits(lane.id)
        record.exit, record.exits = len(exits), len(found)
        exits += [(way.connector, way.lane, way.angle, lanes[way.connector].junction) for way in found]
        record.chooses = _is_choice(found)
        record.onward = NOBODY
        if found and not record.chooses:
            record.onward = min(found, key=lambda way: (abs(way.angle), way.connector)).connector
        beside, candidates = side_by_side(town, lane.id), oncoming.candidates(lane.id).tolist()
        record.offers = record.chooses or (bool(found) and ways_part(town, beside))
        record.beside, record.besides = len(lists), len(beside)
        record.oncoming, record.oncomings = len(lists) + len(beside), len(candidates)
        lists += beside + candidates
    table = empty_records(ExitRecord, len(exits))
    for name, column in zip(("connector", "lane", "angle", "junction"), zip(*exits, strict=True), strict=False):
        table[name] = column
    return LaneExits(ways, table, np.array(lists, dtype=np.int32))


def side_by_side(town: Town, lane: int) -> list[int]:
    """Returns a lane and all that are reached from it by lane changes."""
    found = [lane]
    for known in found:
        for side in SIDES:
            beside = town.neighbour(known, side)
            if beside is not None and beside not in found:
                found.append(beside)
    return found


def _is_choice(exits: tuple[Exit, ...]) -> bool:
    return len(exits) > 1 and any(way.junction_id >= 0 for way in exits)


def ways_part(town: Town, beside: list[int]) -> bool:
    """Returns whether the exits of lanes that lie side by side lead different ways."""
    turns = [way.angle for lane in beside for way in town.exits(lane) if way.junction_id >= 0]
    return max((abs(wrap_degrees(turn - turns[0])) for turn in turns), default=0.0) > ANOTHER_WAY
