"""Lanes from which no car can drive on: one-way roads that leave the map."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

from dorothie_gym.maps.lane_neighbours import OncomingLanes
from dorothie_gym.maps.town import Town

if TYPE_CHECKING:
    from dorothie_gym.maps.driving_side import DrivingSide
    from dorothie_gym.maps.model import Lane, LaneLink

NOSE = 3.5
"""Distance of the centre of a waiting car from the end of its lane [m]."""


def trapped_lanes(lanes: Sequence[Lane], links: Sequence[LaneLink], traffic: DrivingSide) -> frozenset[int]:
    """Returns the ids of the lanes that lead only to ends at which a car can neither change lanes nor turn round.

    Without them, a car that follows the other lanes can always drive on. Where all lanes are such, as on a single
    one-way road, the result is empty.

    Args:
        lanes: lanes of the town; `lanes[i].id` is `i`.
        links: links between them, lane changes included.
        traffic: side of the road on which vehicles drive.
    """
    followers: dict[int, list[int]] = defaultdict(list)
    beside: dict[int, list[int]] = defaultdict(list)
    for link in links:
        (beside if link.type.is_lane_change else followers)[link.source].append(link.target)
    turning: dict[int, int] | None = None
    left = {lane.id for lane in lanes}
    while left:
        leading = {lane for lane in left if any(target in left for target in followers[lane])}
        if turning is None:
            if len(leading) == len(left):
                return frozenset()
            turning = _turning(lanes, links, traffic)
        leading |= {lane for lane, onto in turning.items() if lane in left and onto in left}
        leading = _with_changes(leading, left, beside)
        if len(leading) == len(left):
            break
        left = leading
    return frozenset(lane.id for lane in lanes if lane.id not in left) if left else frozenset()


def _turning(lanes: Sequence[Lane], links: Sequence[LaneLink], traffic: DrivingSide) -> dict[int, int]:
    """Returns the lanes onto which a car can turn round at the ends of lanes, by the ids of these."""
    oncoming = OncomingLanes(Town(name="", lanes=lanes, links=links, junctions=(), traffic=traffic))
    ends = ((lane.id, max(lane.length - NOSE, 0.0)) for lane in lanes if not lane.in_junction)
    found = ((lane, oncoming.at(lane, station)) for lane, station in ends)
    return {lane: opposite.lane for lane, opposite in found if opposite is not None}


def _with_changes(leading: set[int], left: Collection[int], beside: dict[int, list[int]]) -> set[int]:
    """Returns some lanes, and those from which lane changes lead to them."""
    while True:
        more = {lane for lane in left if lane not in leading and any(other in leading for other in beside[lane])}
        if not more:
            return leading
        leading = leading | more
