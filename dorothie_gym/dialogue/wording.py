"""What a speaker knows beyond the act: the particulars that slots do not carry and words do."""

from __future__ import annotations

import enum
from dataclasses import dataclass

from dorothie_gym.ontology import LandmarkName


class Direction(enum.StrEnum):
    """Which way, seen from the driver's seat."""

    LEFT = "left"
    RIGHT = "right"
    STRAIGHT = "straight"
    BACK = "back"


@dataclass(frozen=True, kw_only=True)
class Wording:
    """Particulars for the words of one act; each is optional.

    Attributes:
        direction: of a turn or a lane switch; a plain string such as "left" will do.
        ordinal: which opportunity, 1 is the next one; 1 to 9.
        faster: whether a change of speed is upwards.
        speed: speed aimed at [km/h], not negative.
        lights: whether the lights go on.
        distance: how far ahead [m], not negative.
        here: whether it is to happen on the spot.
        past: the landmark behind which it is to happen.
        dropped: the landmark given up in favour of another that the act names.
        topic: what the talk is about ("fog", "wrong_way", ...); picks the templates marked with it, if there are any.
    """

    direction: Direction | None = None
    ordinal: int | None = None
    faster: bool | None = None
    speed: float | None = None
    lights: bool | None = None
    distance: float | None = None
    here: bool = False
    past: LandmarkName | None = None
    dropped: LandmarkName | None = None
    topic: str | None = None

    def __post_init__(self) -> None:
        if self.direction is not None:
            if self.direction not in tuple(Direction):
                raise ValueError(f"Wording.direction must be one of {[*map(str, Direction)]}, not {self.direction!r}")
            object.__setattr__(self, "direction", Direction(self.direction))
        if self.ordinal is not None and not 1 <= self.ordinal <= 9:
            raise ValueError(f"Wording.ordinal must be 1 to 9, not {self.ordinal}")
        for name, value in (("speed", self.speed), ("distance", self.distance)):
            if value is not None and not 0 <= value < 1e5:
                raise ValueError(f"Wording.{name} must be at least 0 and below 100000, not {value}")
