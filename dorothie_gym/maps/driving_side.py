"""Side of the road on which traffic drives: signs of distances, and kinds of turns and lane changes."""

from __future__ import annotations

import enum

from dorothie_gym.maps.link_types import LinkType

OPPOSITES = {
    LinkType.LEFT: LinkType.RIGHT,
    LinkType.RIGHT: LinkType.LEFT,
    LinkType.LANE_CHANGE_LEFT: LinkType.LANE_CHANGE_RIGHT,
    LinkType.LANE_CHANGE_RIGHT: LinkType.LANE_CHANGE_LEFT,
}
"""Turns and lane changes in a mirror image; the others stay what they are."""


class DrivingSide(enum.StrEnum):
    """Side of the road on which vehicles drive: the kerb is on this side of them, oncoming traffic on the other."""

    RIGHT = "right"
    LEFT = "left"

    @property
    def sign(self) -> int:
        """Distance to the right of a point one metre towards the kerb: 1, or -1 in left-hand traffic."""
        return 1 if self is DrivingSide.RIGHT else -1

    @property
    def opposite(self) -> DrivingSide:
        """The other side."""
        return DrivingSide.LEFT if self is DrivingSide.RIGHT else DrivingSide.RIGHT

    @property
    def to_kerb(self) -> LinkType:
        """Lane change towards the kerb."""
        return self.as_right_hand(LinkType.LANE_CHANGE_RIGHT)

    @property
    def to_middle(self) -> LinkType:
        """Lane change towards the middle of the road."""
        return self.as_right_hand(LinkType.LANE_CHANGE_LEFT)

    @property
    def near_turn(self) -> LinkType:
        """Turn round the corner at the kerb, which crosses no oncoming traffic."""
        return self.as_right_hand(LinkType.RIGHT)

    @property
    def far_turn(self) -> LinkType:
        """Turn across oncoming traffic."""
        return self.as_right_hand(LinkType.LEFT)

    def crosses_oncoming(self, turn: LinkType | None) -> bool:
        """Returns whether a turn crosses oncoming traffic, to which it yields."""
        return turn in (self.far_turn, LinkType.U_TURN)

    def as_right_hand(self, turn: LinkType) -> LinkType:
        """Returns the turn or lane change that corresponds to one of this side in right-hand traffic."""
        return turn if self is DrivingSide.RIGHT else OPPOSITES.get(turn, turn)
