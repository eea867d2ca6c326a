"""Context of language generation beyond the act: details that slots do not represent, and the dialogue history."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.slots import LandmarkName, SlotValue, StreetName

if TYPE_CHECKING:
    from dorothie_gym.dialogue.propositions import Proposition  # noqa: TC004 (propositions have directions)


def enumeration(phrases: Sequence[str]) -> str:
    """Returns different phrases as one: "a, b and c"; empty for none."""
    unique = list(dict.fromkeys(phrases))
    return "".join(unique) if len(unique) < 2 else f"{', '.join(unique[:-1])} and {unique[-1]}"


@dataclass(frozen=True, kw_only=True)
class Wording:
    """Details of one act for its wording; all fields are optional.

    Attributes:
        direction: direction of a turn or a lane switch; a plain string such as "left" is accepted.
        ordinal: number of the opportunity, 1 (the next) to 9.
        faster: whether a speed change is an increase.
        speed: target speed [km/h], not negative.
        lights: whether the lights are switched on.
        distance: distance ahead [m], not negative.
        here: whether the action takes place at the current position.
        past: landmark to drive past before the action.
        dropped: landmark abandoned in favour of another one in the act.
        topic: topic of the utterance ("fog", "wrong_way", ...); selects the templates marked with it, if any.
        compass: point of the compass to which a street leads: "north".
        plan: driving plan in words, as `plan_words.spoken_plan` returns it.
        content: proposition that the act is about; its arguments fill gaps such as {time} and {cause}.

    Raises:
        ValueError: if a field is out of its range; names the field.
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
    compass: str | None = None
    plan: str | None = None
    content: Proposition | None = None

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
        """Names of the given details, as gaps of the grammar, and "here"."""
        sideways = self.direction in (Direction.LEFT, Direction.RIGHT)
        found = {
            "side": sideways,
            "nth": self.ordinal is not None,
            "speed": self.speed is not None,
            "distance": self.distance is not None,
            "past": self.past is not None,
            "dropped": self.dropped is not None,
            "here": self.here,
            "compass": self.compass is not None,
            "plan": self.plan is not None,
        }
        told = {} if self.content is None else dict(self.content.arguments)
        known = {name for name, is_known in found.items() if is_known} | told.keys()
        return frozenset(known | {"the_item"} if "item" in told else known)


@dataclass(frozen=True, kw_only=True)
class WordingContext:
    """Dialogue history and view at the time of generation; all fields are optional.

    Attributes:
        joined: move of the previous act in the same utterance: "yes, and then left".
        last: last move of the other speaker.
        mentioned: values mentioned recently, which permit references such as "that one" and "the same street".
        street: street of the car: "this street".
        landmark: a landmark in view: "the KFC over there".
        exception: whether an exception is in progress; selects alarm markers.
        owner: person whose house is the destination: "Mateo's house".
        friend: name of the person who is the destination: "my friend Priya".
        passenger: name of that person if it is to be picked up: "our passenger Aunt Mei".
    """

    joined: DialogueMove | None = None
    last: DialogueMove | None = None
    mentioned: frozenset[SlotValue] = frozenset()
    street: StreetName | None = None
    landmark: LandmarkName | None = None
    exception: bool = False
    owner: str | None = None
    friend: str | None = None
    passenger: str | None = None
