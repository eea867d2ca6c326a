"""Fault of a town, and the dimensions of the car for which roads must have room."""

from __future__ import annotations

import enum
from dataclasses import dataclass


class FaultKind(enum.StrEnum):
    """Kinds of faults, in the order of the report."""

    UNREACHABLE = "unreachable"
    """Lanes without a route from the rest of the town."""
    NO_RETURN = "no_return"
    """Lanes without a route back to the rest of the town."""
    DEAD_END = "dead_end"
    """A lane without successors, as have all lanes that a car can change to."""
    GAP = "gap"
    """Linked lanes that do not touch."""
    HEIGHT_STEP = "height_step"
    """A step in height, between linked lanes or within a lane."""
    KINK = "kink"
    """A sudden change of direction, between linked lanes or within a lane."""
    TIGHT_CURVE = "tight_curve"
    """A curve that the car cannot follow at full lock."""
    NARROW = "narrow"
    """A lane narrower than the car."""
    KERB = "kerb"
    """A path across a kerb: off the junction's asphalt, across a corner, or over a pavement."""
    OVERLAP = "overlap"
    """A lane on top of another one, or a connector across a lane that it does not lead to."""
    CLEARANCE = "clearance"
    """A lane above another one without sufficient headroom."""
    TURN_TYPE = "turn_type"
    """A turn with a type that contradicts its geometry."""
    LANE_CHANGE = "lane_change"
    """A lane change to a lane that is not parallel."""
    SIGNAL = "signal"
    """A light or sign that applies to no lane, or a light without a programme."""


@dataclass(frozen=True, kw_only=True)
class Fault:
    """Fault of a town.

    Attributes:
        kind: kind of the fault.
        lanes: ids of the affected lanes; empty for a signal that applies to none.
        position: location (x, y) [m].
        message: description with figures, one sentence without a full stop.
    """

    kind: FaultKind
    lanes: tuple[int, ...]
    position: tuple[float, float]
    message: str


# --- Dimensions of the car (highway-env) -----------------------------------------------------------------------------

CAR_WIDTH = 2.0
"""Width of the car [m]."""

HALF_WIDTH = 0.5 * CAR_WIDTH
"""Half the width of the car [m]."""

SMALLEST_TURN = 3.82
"""Radius of the smallest turning circle [m]: a kinematic bicycle of 5 m with the front wheel at 60 degrees."""
