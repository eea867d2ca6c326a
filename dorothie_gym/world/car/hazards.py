"""What is in the way: bodies on the path ahead, and bodies about to be there."""

from __future__ import annotations

from dataclasses import dataclass

from dorothie_gym.ontology import ObjectClass

LOOKAHEAD = 45.0
"""How far ahead the path is watched [m]."""

SIDE_MARGIN = 0.35
"""Room kept beside the car [m]."""

HEIGHT_MARGIN = 2.5
"""Things further above or below are on another road [m]."""

CROSSING = 0.35
"""Sine of the angle to the path from which on a moving body counts as crossing it."""

REACTION = 0.4
"""Time until brakes bite, kept in hand [s]."""

STANDSTILL_GAP = 2.5
"""Gap that is left to a body that stands [m]."""

ROADBLOCK_GAP = 12.5
"""Gap that is left to a prop [m]: room for a U-turn (`path.U_TURN_REACH` from the car's middle)."""

LINE_GAP = 1.5
"""Gap that is left to the line before a junction [m]."""

TIGHT_GAP = 1.0
"""Gap that is left to what stands, while the car turns or switches lanes [m]."""

HARD_BRAKING = 4.0
"""Deceleration that the safe speed counts on [m/s^2]."""


@dataclass(frozen=True, kw_only=True)
class Body:
    """A thing that can be hit, as perceived.

    Attributes:
        key: tells it apart from others, the same over time.
        kind: its object class.
        x: position of its middle [m]; `y` likewise.
        heading: [rad].
        length: [m].
        width: [m].
        speed: along its heading [m/s].
        height: of the road it is on [m].
    """

    key: int
    kind: ObjectClass
    x: float
    y: float
    heading: float
    length: float
    width: float
    speed: float
    height: float


@dataclass(frozen=True, kw_only=True)
class Hazard:
    """Something that the car stops for: its class, and the gap from the car's nose to it [m]."""

    kind: ObjectClass
    gap: float
