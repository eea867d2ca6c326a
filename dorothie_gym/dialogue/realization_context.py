"""What a speaker knows beyond the act: particulars that words carry and slots do not, and the talk so far."""

from __future__ import annotations

import enum
import functools
from dataclasses import dataclass

from dorothie_gym.ontology import DialogueMove, LandmarkName, SlotValue, StreetName


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

    @functools.cached_property
    def known(self) -> frozenset[str]:
        """Names of the particulars that can be said, as gaps of the grammar, and "here"."""
        sideways = self.direction in (Direction.LEFT, Direction.RIGHT)
        found = {
            "side": sideways,
            "nth": self.ordinal is not None,
            "speed": self.speed is not None,
            "distance": self.distance is not None,
            "past": self.past is not None,
            "dropped": self.dropped is not None,
            "here": self.here,
        }
        return frozenset(name for name, is_known in found.items() if is_known)


@dataclass(frozen=True, kw_only=True)
class WordingContext:
    """What has been said and what is in view when an act is worded; each is optional.

    Attributes:
        joined: the act said just before in the same breath: "yes, and then left".
        last: the other speaker's last move.
        mentioned: values that both have heard lately; they may be referred to by "that one", "the same street".
        street: the street that the car is on: "this street".
        landmark: a landmark in view: "the KFC over there".
        exception: whether something unexpected is going on; words come less smoothly then.
    """

    joined: DialogueMove | None = None
    last: DialogueMove | None = None
    mentioned: frozenset[SlotValue] = frozenset()
    street: StreetName | None = None
    landmark: LandmarkName | None = None
    exception: bool = False
