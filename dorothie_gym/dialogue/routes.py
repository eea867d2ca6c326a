"""Language of routes: what a driver is asked to do, as an ordered plan of steps with conditions and places.

A plan is the shared meaning of directions: the parser reads it from words (`ParsedText.plan`), the Co-Wizard keeps and
carries it out, annotators and language models write it as JSON. Every field of a step but its action may be left out.

```python
from dorothie_gym.dialogue import DrivingPlan

plan = DrivingPlan.from_json(
    [
        {"action": "turn", "direction": "left", "condition": {"relation": "at", "place": {"landmark": "KFC"}}},
        {"action": "stop", "condition": {"relation": "past", "place": {"object": "TrafficLight", "ordinal": 2}}},
    ]
)
print(plan.describe())  # turn left at the KFC, then stop just past the second traffic light
```
"""

from __future__ import annotations

import dataclasses
import enum
import functools
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Final, Self, TypeAlias

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.lexicon import load_lexicon
from dorothie_gym.dialogue.numerals import ordinal as ordinal_word
from dorothie_gym.errors import OntologyError, did_you_mean, short_repr
from dorothie_gym.ontology.slots import LandmarkName, ObjectClass, SlotEnum, SlotValue, StreetName
from dorothie_gym.support.copying import shared

MAX_STEPS: Final = 24
"""Largest number of steps of a plan."""

JsonValue: TypeAlias = "str | int | dict[str, JsonValue]"


class StepAction(enum.StrEnum):
    """What a step asks the driver to do."""

    TURN = "turn"
    """A turn at a junction."""
    STRAIGHT = "straight"
    """On along the road, and straight across junctions."""
    LANE = "lane"
    """A change of lane."""
    U_TURN = "u_turn"
    """A turn back."""
    STOP = "stop"
    """A stop at the kerb, or where passengers can leave."""
    GO = "go"
    """Drive on after a stop."""
    FOLLOW = "follow"
    """Along a street, or behind an object."""
    AVOID = "avoid"
    """Not over a street, nor past a place."""
    SPEED = "speed"
    """A speed, or a change of it."""
    LIGHTS = "lights"
    """The lights of the car on or off."""
    VISIT = "visit"
    """An errand: a drive to a place, by any way."""
    WAIT = "wait"
    """A pause until a condition holds, or until the next order."""


class ConditionRelation(enum.StrEnum):
    """Relation of a step to the place where it begins or ends."""

    AT = "at"
    SEEN = "seen"
    """When the place comes into view."""
    AFTER = "after"
    """At the first opportunity behind the place."""
    PAST = "past"
    """Just behind the place."""
    BEFORE = "before"
    UNTIL = "until"
    """The step ends at the place."""
    OPPOSITE = "opposite"
    BESIDE = "beside"
    FROM = "from"


class StepChange(enum.StrEnum):
    """Change of the speed or of the lights."""

    FASTER = "faster"
    SLOWER = "slower"
    ON = "on"
    OFF = "off"


class Anaphor(enum.StrEnum):
    """Place that is referred to by its role in the conversation or in the drive so far."""

    THERE = "there"
    HERE = "here"
    LAST_STOP = "last_stop"
    START = "start"
    WAY_WE_CAME = "way_we_came"


@dataclass(frozen=True, kw_only=True)
class PlanPart:
    """Base class of the parts of a plan; checks the fields, and converts them to JSON and back.

    Raises:
        OntologyError: a field is of another type or out of range.
    """

    def __post_init__(self) -> None:
        for name, required in self._names():
            if (value := getattr(self, name)) is not None or required:
                _check(f"{type(self).__name__}.{name}", name, value)

    @classmethod
    @functools.cache
    def _names(cls) -> tuple[tuple[str, bool], ...]:
        """Returns the names of the fields, each with whether it must be given."""
        return tuple((field.name, field.default is dataclasses.MISSING) for field in dataclasses.fields(cls))

    def to_json(self) -> dict[str, JsonValue]:
        """Returns the fields that are given, in JSON types; `from_json` is the inverse."""
        values = {name: getattr(self, name) for name, _ in self._names()}
        return {name: _plain(value) for name, value in values.items() if value is not None}

    @classmethod
    def from_json(cls, data: object, where: str) -> Self:
        """Returns the part that `to_json` has encoded; null counts as not given.

        Args:
            data: decoded JSON.
            where: beginning of error messages.

        Raises:
            OntologyError: it is malformed; the message names the field, the problem and the remedy.
        """
        fields = {field.name: field for field in dataclasses.fields(cls)}
        if not isinstance(data, Mapping):
            raise OntologyError(
                f"{where} is {short_repr(data)}; it must be an object with fields of {', '.join(fields)}"
            )
        values: dict[str, Any] = {}
        for name, value in data.items():
            if name not in fields:
                hint = did_you_mean(str(name), fields)
                listed = ", ".join(fields)
                raise OntologyError(f"{where}: there is no field {short_repr(name)}; {hint}its fields: {listed}")
            if value is not None:
                values[name] = _read(f"{where}.{name}", name, value)
        for name, field in fields.items():
            if field.default is dataclasses.MISSING and name not in values:
                raise OntologyError(f"{where}: the field {name!r} is missing; add it")
        try:
            return cls(**values)
        except OntologyError as error:
            raise OntologyError(f"{where}: {error}") from None


@shared
@dataclass(frozen=True, kw_only=True)
class PlaceReference(PlanPart):
    """Place as directions refer to it: by name, by an object, by its number or by its role in the conversation.

    Attributes:
        landmark: landmark.
        street: street that it is, or on which the landmark or object is.
        object: class of an object ("the lights").
        ordinal: number among those ahead, 1 is the next; without a name or object, of the junctions ahead.
        side: side of the street, left or right.
        reference: role in the conversation ("there") or in the drive so far ("where we started").

    Raises:
        OntologyError: a field is of another type or out of range, or no field is given.
    """

    landmark: LandmarkName | None = None
    street: StreetName | None = None
    object: ObjectClass | None = None
    ordinal: int | None = None
    side: Direction | None = None
    reference: Anaphor | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.to_json():
            raise OntologyError("PlaceReference: no field is given; name a landmark, street, object or reference")

    def describe(self) -> str:
        """Returns a noun phrase, such as "the second traffic light on Hubbard"."""
        if self.reference is not None:
            return _ANAPHOR_WORDS[self.reference]
        named: SlotValue | None = self.landmark or self.object
        words = _definite(named) if named is not None else "the junction" if self.ordinal is not None else ""
        if self.ordinal is not None:
            words = f"the {_nth(self.ordinal)} {words.removeprefix('the ')}"
        if self.street is not None:
            words = f"{words} on {_definite(self.street)}" if words else _definite(self.street)
        if self.side is not None:
            words = f"{words or 'the place'} on the {self.side}"
        return words


@shared
@dataclass(frozen=True, kw_only=True)
class StepCondition(PlanPart):
    """Place at which a step is due.

    Attributes:
        relation: where or when, relative to the place.
        place: the place.

    Raises:
        OntologyError: a field is of another type.
    """

    relation: ConditionRelation
    place: PlaceReference

    def describe(self) -> str:
        """Returns an adverbial, such as "after the KFC"; "here" and "there" need no preposition."""
        place = self.place.describe()
        bare = self.place.reference in (Anaphor.HERE, Anaphor.THERE, Anaphor.WAY_WE_CAME)
        return place if bare and self.relation is ConditionRelation.AT else f"{_RELATION_WORDS[self.relation]} {place}"


@shared
@dataclass(frozen=True, kw_only=True)
class PlanStep(PlanPart):
    """One step of a plan.

    Attributes:
        action: what to do.
        direction: left or right, of a turn or a change of lane.
        ordinal: number of the opportunity to turn or stop, 1 is the next.
        distance: distance to the step, or of it [m].
        condition: place at which it is due.
        side: side of the street, left or right.
        speed: speed [km/h].
        change: faster or slower, as a change or a manner; on or off, of the lights.
        place: place to visit, follow or avoid; a condition can stand for the place to visit.

    Raises:
        OntologyError: a field is of another type, out of range, or does not belong to the action.
    """

    action: StepAction
    direction: Direction | None = None
    ordinal: int | None = None
    distance: int | None = None
    condition: StepCondition | None = None
    side: Direction | None = None
    speed: int | None = None
    change: StepChange | None = None
    place: PlaceReference | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.direction is not None and self.action not in _SIDEWAYS:
            raise OntologyError(f"PlanStep.direction: a step {self.action!s} has none; only turn, lane and u_turn have")
        if self.place is not None and self.action not in _WITH_PLACE:
            raise OntologyError(f"PlanStep.place: a step {self.action!s} has none; put it into the condition")
        somewhere = self.action is StepAction.VISIT and self.condition is not None  # "the house opposite the KFC"
        if self.place is None and self.action in _WITH_PLACE and not somewhere:
            raise OntologyError(f"PlanStep.place: a step {self.action!s} needs one")
        if (self.change in (StepChange.ON, StepChange.OFF)) is not (self.action is StepAction.LIGHTS):
            raise OntologyError(
                f"PlanStep.change: a step {self.action!s} cannot be {self.change}; on and off are for lights"
            )

    @property
    def places(self) -> tuple[PlaceReference, ...]:
        """Places that the step names: of its condition, and the one to visit, follow or avoid."""
        listed = (self.condition.place if self.condition is not None else None, self.place)
        return tuple(place for place in listed if place is not None)

    def describe(self) -> str:
        """Returns a command, such as "turn left at the KFC"."""
        words = [_COMMANDS[self.action](self)]
        if self.speed is not None and self.action is not StepAction.SPEED:
            words.append(f"at {self.speed} km/h")
        elif self.change is not None and self.action not in (StepAction.SPEED, StepAction.LIGHTS):
            words.append("slowly" if self.change is StepChange.SLOWER else "quickly")
        if self.condition is not None:
            words.append(self.condition.describe())
        if self.distance is not None:
            lasting = self.action in (StepAction.STRAIGHT, StepAction.FOLLOW, StepAction.GO)
            words.append(f"{'for' if lasting else 'in'} {self.distance} m")
        if self.side is not None:
            words.append(f"on the {self.side}-hand side")
        return " ".join(words)


@shared
@dataclass(frozen=True)
class DrivingPlan:
    """Steps in the order in which they are to be carried out.

    Attributes:
        steps: the steps; empty where nothing is asked of the driver.

    Raises:
        OntologyError: `steps` is not a tuple of steps, or longer than MAX_STEPS.
    """

    steps: tuple[PlanStep, ...] = ()

    def __post_init__(self) -> None:
        if not isinstance(self.steps, tuple) or not all(isinstance(step, PlanStep) for step in self.steps):
            raise OntologyError(f"DrivingPlan.steps: {short_repr(self.steps)} is no tuple of PlanStep")
        if len(self.steps) > MAX_STEPS:
            raise OntologyError(f"DrivingPlan.steps: has {len(self.steps)} steps; at most {MAX_STEPS} are kept")

    @classmethod
    def of(cls, *steps: PlanStep) -> DrivingPlan:
        """Returns the plan with some steps."""
        return cls(steps)

    def __iter__(self) -> Iterator[PlanStep]:
        return iter(self.steps)

    def __len__(self) -> int:
        return len(self.steps)

    def to_json(self) -> list[dict[str, JsonValue]]:
        """Returns the steps in JSON types; `from_json` is the inverse."""
        return [step.to_json() for step in self.steps]

    @classmethod
    def from_json(cls, data: object, where: str = "plan") -> DrivingPlan:
        """Returns the plan that `to_json` has encoded.

        Args:
            data: decoded JSON.
            where: beginning of error messages.

        Raises:
            OntologyError: it is malformed; the message names the field, the problem and the remedy.
        """
        if not isinstance(data, list | tuple):
            raise OntologyError(f"{where} is {short_repr(data)}; it must be an array of steps")
        return cls(tuple(PlanStep.from_json(row, f"{where}[{number}]") for number, row in enumerate(data)))

    def describe(self) -> str:
        """Returns the plan as commands, such as "turn left, then stop here"; empty for a plan without steps."""
        return ", then ".join(step.describe() for step in self.steps)


# --- words ------------------------------------------------------------------------------------------------------------


def _nth(number: int) -> str:
    return "next" if number == 1 else ordinal_word(number)


def _definite(value: SlotValue) -> str:
    """Returns the definite noun phrase of a value ("the KFC", "the traffic light", "Hubbard")."""
    phrase = load_lexicon().forms(value, "the")[0]
    return phrase if not isinstance(value, ObjectClass) or phrase.startswith("th") else f"the {phrase}"


def _turn(step: PlanStep) -> str:
    if step.ordinal is not None:
        return f"take the {_nth(step.ordinal)} {step.direction or 'turn'}"
    return f"turn {step.direction}" if step.direction is not None else "turn"


def _speed(step: PlanStep) -> str:
    if step.speed is not None:
        return f"drive at {step.speed} km/h"
    return f"drive {step.change or 'at another speed'}"


def _with_place(verb: str) -> Callable[[PlanStep], str]:
    return lambda step: f"{verb} {'a place' if step.place is None else step.place.describe()}"


_COMMANDS: Final[Mapping[StepAction, Callable[[PlanStep], str]]] = MappingProxyType(
    {
        StepAction.TURN: _turn,
        StepAction.STRAIGHT: lambda step: (
            f"go straight on past the {_nth(step.ordinal)} junction" if step.ordinal else "go straight on"
        ),
        StepAction.LANE: lambda step: f"change to the {step.direction} lane" if step.direction else "change lanes",
        StepAction.U_TURN: lambda step: "turn around",
        StepAction.STOP: lambda step: "stop",
        StepAction.GO: lambda step: "drive on",
        StepAction.FOLLOW: _with_place("follow"),
        StepAction.AVOID: _with_place("avoid"),
        StepAction.SPEED: _speed,
        StepAction.LIGHTS: lambda step: f"switch the lights {step.change}",
        StepAction.VISIT: _with_place("drive to"),
        StepAction.WAIT: lambda step: "wait",
    }
)

_RELATION_WORDS: Final[Mapping[ConditionRelation, str]] = MappingProxyType(
    {
        ConditionRelation.AT: "at",
        ConditionRelation.SEEN: "at the sight of",
        ConditionRelation.AFTER: "after",
        ConditionRelation.PAST: "just past",
        ConditionRelation.BEFORE: "before",
        ConditionRelation.UNTIL: "as far as",
        ConditionRelation.OPPOSITE: "opposite",
        ConditionRelation.BESIDE: "next to",
        ConditionRelation.FROM: "from",
    }
)

_ANAPHOR_WORDS: Final[Mapping[Anaphor, str]] = MappingProxyType(
    {
        Anaphor.THERE: "there",
        Anaphor.HERE: "here",
        Anaphor.LAST_STOP: "the last stop",
        Anaphor.START: "the start of the drive",
        Anaphor.WAY_WE_CAME: "the way we came",
    }
)

_SIDEWAYS: Final = frozenset({StepAction.TURN, StepAction.LANE, StepAction.U_TURN})
_WITH_PLACE: Final = frozenset({StepAction.VISIT, StepAction.FOLLOW, StepAction.AVOID})


# --- fields and JSON --------------------------------------------------------------------------------------------------

_KINDS: Final[Mapping[str, type]] = MappingProxyType(
    {
        "action": StepAction,
        "direction": Direction,
        "condition": StepCondition,
        "side": Direction,
        "change": StepChange,
        "place": PlaceReference,
        "relation": ConditionRelation,
        "landmark": LandmarkName,
        "street": StreetName,
        "object": ObjectClass,
        "reference": Anaphor,
    }
)
"""Types of the fields that are no numbers."""

_LARGEST: Final[Mapping[str, int]] = MappingProxyType({"ordinal": 9, "distance": 99_999, "speed": 399})
"""Largest values of the fields that are numbers, in m and km/h; the smallest is 1."""

_SIDES: Final = (Direction.LEFT, Direction.RIGHT)


def _check(where: str, name: str, value: object) -> None:
    if name in _LARGEST:
        if not isinstance(value, int) or isinstance(value, bool) or not 1 <= value <= _LARGEST[name]:
            raise OntologyError(f"{where} is {short_repr(value)}; it must be a whole number of 1 to {_LARGEST[name]}")
        return
    kind = _KINDS[name]
    if not isinstance(value, kind):
        raise OntologyError(f"{where} is {short_repr(value)}; it must be a {kind.__name__}")
    if kind is Direction and value not in _SIDES:
        raise OntologyError(f"{where} is {str(value)!r}; it must be 'left' or 'right'")


def _plain(value: object) -> JsonValue:
    if isinstance(value, PlanPart):
        return value.to_json()
    if isinstance(value, SlotEnum):
        return value.label
    return value if isinstance(value, int) else str(value)


def _read(where: str, name: str, value: object) -> object:
    """Returns the value of a field from decoded JSON."""
    if name in _LARGEST:
        _check(where, name, value)
        return value
    kind = _KINDS[name]
    if issubclass(kind, PlanPart):
        return kind.from_json(value, where)
    labels = _LABELS[kind]
    if not isinstance(value, str) or value not in labels:
        hint = did_you_mean(str(value), labels)
        raise OntologyError(
            f"{where}: there is no {kind.__name__} {short_repr(value)}; {hint}it may be {', '.join(labels)}"
        )
    return labels[value]


def _labels_of(kind: type[enum.Enum]) -> Mapping[str, enum.Enum]:
    members = [*_SIDES] if kind is Direction else [*kind]
    return {member.label if isinstance(member, SlotEnum) else str(member.value): member for member in members}


_LABELS: Final[Mapping[type, Mapping[str, enum.Enum]]] = MappingProxyType(
    {kind: _labels_of(kind) for kind in _KINDS.values() if issubclass(kind, enum.Enum)}
)
"""Members of the enums by their spelling in JSON."""
