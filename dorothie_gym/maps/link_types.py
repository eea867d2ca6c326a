"""Types of links between lanes."""

from __future__ import annotations

import enum


class LinkType(enum.StrEnum):
    """Type of a link between two lanes: a turn, or a change to the parallel lane."""

    STRAIGHT = "straight"
    LEFT = "left"
    RIGHT = "right"
    U_TURN = "uturn"
    LANE_CHANGE_LEFT = "left_lane_change"
    LANE_CHANGE_RIGHT = "right_lane_change"

    @property
    def is_lane_change(self) -> bool:
        """Whether the target lies beside the source instead of following it."""
        return self in LANE_CHANGES


LANE_CHANGES = (LinkType.LANE_CHANGE_LEFT, LinkType.LANE_CHANGE_RIGHT)
"""Types of the links between lanes side by side."""
