"""What may be wrong with a town, in the eyes of somebody who drives in it."""

from __future__ import annotations

import enum
from dataclasses import dataclass


class FaultKind(enum.StrEnum):
    """Kinds of faults, in the order in which they are reported."""

    UNREACHABLE = "unreachable"
    """Lanes to which no way leads from the rest of the town."""
    NO_RETURN = "no_return"
    """Lanes from which no way leads back to the rest of the town."""
    DEAD_END = "dead_end"
    """A lane that goes on in none, nor does one that a car can change to."""
    GAP = "gap"
    """Linked lanes that do not touch."""
    HEIGHT_STEP = "height_step"
    """A step in the road, between linked lanes or within one."""
    KINK = "kink"
    """A sudden change of direction, between linked lanes or within one."""
    TIGHT_CURVE = "tight_curve"
    """A curve that the car cannot follow at full lock."""
    NARROW = "narrow"
    """A lane that is narrower than the car."""
    KERB = "kerb"
    """A way that leads over a kerb: off the junction's paved ground, across a corner, or over a pavement."""
    OVERLAP = "overlap"
    """A lane in the place of another one, or a connector that runs over a lane it has nothing to do with."""
    CLEARANCE = "clearance"
    """A lane above another one, but not high enough to pass under."""
    TURN_TYPE = "turn_type"
    """A way on that is called something else than it is."""
    LANE_CHANGE = "lane_change"
    """A lane change to a lane that does not run beside."""
    SIGNAL = "signal"
    """A light or sign that nobody has to heed, or a light that never shows anything."""


@dataclass(frozen=True, kw_only=True)
class Fault:
    """A fault of a town.

    Attributes:
        kind: what is wrong.
        lanes: lanes that it is about; empty for a signal that rules none.
        position: where it is (x, y) [m].
        message: what is wrong in figures, one sentence without its full stop.
    """

    kind: FaultKind
    lanes: tuple[int, ...]
    position: tuple[float, float]
    message: str


# --- The car that the roads have to fit: highway-env's, in figures ---------------------------------------------------

CAR_WIDTH = 2.0
"""Width of the car [m]."""

HALF_WIDTH = 0.5 * CAR_WIDTH
"""From the car's middle to its side [m]."""

SMALLEST_RADIUS = 3.82
"""Radius of its smallest turning circle [m]: a bicycle 5 m long with its front wheel at 60 degrees."""
