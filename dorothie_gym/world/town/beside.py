"""Lanes beside one another."""

from __future__ import annotations

from dorothie_gym.world.town.model import LinkType, Town


def rightmost(town: Town, lane_id: int) -> int:
    """The last of the lanes beside one another to the right: who walks beside it does not walk on another lane."""
    while (beside := town.neighbour(lane_id, LinkType.LANE_CHANGE_RIGHT)) is not None:
        lane_id = beside
    return lane_id


def leftmost(town: Town, lane_id: int) -> int:
    """The lane of the same direction that is farthest to the left."""
    while (beside := town.neighbour(lane_id, LinkType.LANE_CHANGE_LEFT)) is not None:
        lane_id = beside
    return lane_id
