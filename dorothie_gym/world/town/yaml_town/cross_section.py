"""Where the lanes of a street lie beside the line of its course, and where its edges are."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from dorothie_gym.world.town.yaml_town.plan import StreetPlan


@dataclass(frozen=True, eq=False)
class CrossSection:
    """The cross-section of a street, seen along its course; offsets are positive to the right [m].

    A two-way street has its median in the middle of the line, a one-way street the middle of its lanes.
    """

    street: StreetPlan

    @cached_property
    def forward(self) -> tuple[float, ...]:
        """Offsets of the lanes along the course, innermost first [m]."""
        street = self.street
        inner = street.median / 2.0 if street.backward else -street.forward * street.width / 2.0
        return tuple(inner + (k + 0.5) * street.width for k in range(street.forward))

    @cached_property
    def backward(self) -> tuple[float, ...]:
        """Offsets of the lanes against the course, innermost first [m]."""
        street = self.street
        return tuple(-street.median / 2.0 - (k + 0.5) * street.width for k in range(street.backward))

    @property
    def right(self) -> float:
        """Distance from the line to the edge of the road on its right [m]."""
        return self.forward[-1] + self.street.width / 2.0

    @property
    def left(self) -> float:
        """Distance from the line to the edge of the road on its left [m]."""
        return self.street.width / 2.0 - (self.backward[-1] if self.backward else self.forward[0])

    @property
    def pocket(self) -> float:
        """Offset of the left-turn lane that opens in the median for the lanes along the course [m]."""
        return (self.street.median - self.street.width) / 2.0

    def edge(self, to_the_right: bool) -> float:
        """Distance from the line to the edge of the road on one side [m]."""
        return self.right if to_the_right else self.left

    def side(self, to_the_right: bool) -> float:
        """Distance from the line to the outer end of the pavement on one side [m]."""
        return self.edge(to_the_right) + self.street.sidewalk

    def tightest(self, to_the_right: bool, lane_radius: float) -> float:
        """Radius that the line needs in a bend to one side so that the lane inside still has `lane_radius` [m]."""
        edge = self.edge(to_the_right)
        # The pavement needs a little radius of its own, too.
        return max(lane_radius + edge - self.street.width / 2.0, edge + max(self.street.sidewalk, 0.5) + 0.5)
