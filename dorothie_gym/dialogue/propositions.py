"""Propositions: the content of an utterance, as statements with typed arguments that can be true or false.

A proposition has a predicate, arguments and a polarity: `arrives_in(place=KFC, seconds=60)`,
`not sees(object=Pedestrian)`, `because(effect=stands(), cause=red())`. Questions leave an argument open (`ASKED`).
Propositions are recorded with utterances; listeners never observe them.
"""

from __future__ import annotations

import enum
import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, TypeAlias

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.errors import did_you_mean
from dorothie_gym.ontology.slots import (
    SLOT_VALUES,
    ActionValue,
    GoalStatus,
    LandmarkName,
    ObjectClass,
    Slot,
    SlotValue,
    StreetName,
)
from dorothie_gym.ontology.world_exceptions import PropKind, Sensor, WeatherParameter
from dorothie_gym.support.copying import shared


class Asked(enum.Enum):
    """Type of `ASKED`."""

    ASKED = "?"

    def __repr__(self) -> str:
        return "?"


ASKED: Final = Asked.ASKED
"""Value of the argument that an open question queries."""


class Predicate(enum.StrEnum):
    """Predicate of a proposition. "The car" is the ego with its Co-Wizard."""

    # the world
    SEES = "sees"
    """The speaker sees an object of a class, or a landmark."""
    ON_STREET = "on_street"
    """The car is on a street."""
    LOCATED = "located"
    """A landmark is on a street, near the corner of another one (`cross`), or on a side of it, seen from the car."""
    NEAR = "near"
    """A landmark is near another one, or near an object."""
    LOOKS = "looks"
    """The building or person at a landmark has a feature."""
    WEATHER = "weather"
    """A parameter of the weather is high (or low), now or later in the day."""
    VISIBILITY = "visibility"
    """The speaker sees far enough, or so far; negated: the view is poor."""
    BLOCKED = "blocked"
    """Something blocks the road ahead."""
    CROWDED = "crowded"
    """Many people or vehicles are on the road ahead."""
    RED = "red"
    """The next traffic light is red."""
    HINDERS = "hinders"
    """An object ahead keeps the car from driving on."""
    FAILED = "failed"
    """A sensor of the car has failed."""
    # the car and its plans
    STANDS = "stands"
    """The car stands."""
    DOES = "does"
    """The car is carrying out an action."""
    WILL = "will"
    """The car will carry out an action according to its current plan."""
    ARRIVES_IN = "arrives_in"
    """The car will stop at a landmark after a time."""
    DISTANCE = "distance"
    """The route to a landmark has a length."""
    CLOSE = "close"
    """The route to a landmark is short."""
    KNOWS = "knows"
    """The Co-Wizard knows where a landmark is."""
    HAS_ROUTE = "has_route"
    """The Co-Wizard has a route to a landmark."""
    RIGHT_WAY = "right_way"
    """The car is on a route to a landmark that is not much longer than the shortest."""
    SHORTER = "shorter"
    """The route over a street is shorter than the current one."""
    LOCALISED = "localised"
    """The Co-Wizard knows where the car is."""
    LIGHTS_ON = "lights_on"
    """The headlights are on."""
    DRIVES_AT = "drives_at"
    """The car drives at a speed, or is set to it; as a limit, the street allows no more."""
    ARRIVED = "arrived"
    """The car has arrived at a landmark."""
    POSSIBLE = "possible"
    """An action can be carried out here and now."""
    SAFE = "safe"
    """Nothing endangers the drive: no hazard, poor view or failed sensor."""
    BEHIND = "behind"
    """A landmark is behind the car."""
    PASSED = "passed"
    """The car has driven past a landmark: a number of times since the errand began, or else once on this trip."""
    TRIED = "tried"
    """An action, or every attempt to reach the place, has failed a number of times."""
    NEARER = "nearer"
    """The route to a landmark is shorter than that to another one."""
    # the tasks
    TASK = "task"
    """The errand at a landmark has a status, or a number of errands besides the present one has."""
    ORDER = "order"
    """An errand comes before another one."""
    PURPOSE = "purpose"
    """Purpose and reason of an errand, with the person and the item that it concerns."""
    GOAL = "goal"
    """Current destination of the car."""
    TOLD = "told"
    """The other speaker has given the speaker an order."""
    # reasons and feelings
    BECAUSE = "because"
    """An effect has a cause, or had one at a time of the session [s]."""
    FEELS = "feels"
    """The speaker has a feeling, which may have a cause."""


Argument: TypeAlias = (
    "SlotValue | Direction | WeatherParameter | PropKind | Sensor | Proposition | bool | int | str | Asked"
)

_Kind: TypeAlias = type[enum.Enum] | type[bool] | type[int] | type[str] | str

_ANY: Final = "proposition"
_PLACE: Final[Mapping[str, _Kind]] = {"place": LandmarkName}
_ACTION: Final[Mapping[str, _Kind]] = {
    "action": ActionValue,
    "direction": Direction,
    "street": StreetName,
    "place": LandmarkName,
    "speed": int,
    "object": ObjectClass,
}

PARAMETERS: Final[Mapping[Predicate, Mapping[str, _Kind]]] = MappingProxyType(
    {
        Predicate.SEES: {"object": ObjectClass, "place": LandmarkName},
        Predicate.ON_STREET: {"street": StreetName},
        Predicate.LOCATED: {**_PLACE, "street": StreetName, "cross": StreetName, "side": Direction},
        Predicate.NEAR: {**_PLACE, "landmark": LandmarkName, "object": ObjectClass},
        Predicate.LOOKS: {**_PLACE, "object": ObjectClass, "feature": str},
        Predicate.WEATHER: {"parameter": WeatherParameter, "high": bool, "object": ObjectClass, "later": bool},
        Predicate.VISIBILITY: {"metres": int},
        Predicate.BLOCKED: {"object": ObjectClass, "prop": PropKind, "street": StreetName},
        Predicate.CROWDED: {"object": ObjectClass},
        Predicate.RED: {"object": ObjectClass},
        Predicate.HINDERS: {"object": ObjectClass},
        Predicate.FAILED: {"sensor": Sensor},
        Predicate.STANDS: {"action": ActionValue},
        Predicate.DOES: _ACTION,
        Predicate.WILL: _ACTION,
        Predicate.ARRIVES_IN: {**_PLACE, "seconds": int},
        Predicate.DISTANCE: {**_PLACE, "metres": int},
        Predicate.CLOSE: _PLACE,
        Predicate.KNOWS: _PLACE,
        Predicate.HAS_ROUTE: _PLACE,
        Predicate.RIGHT_WAY: _PLACE,
        Predicate.SHORTER: {"street": StreetName},
        Predicate.LOCALISED: {},
        Predicate.LIGHTS_ON: {"action": ActionValue},
        Predicate.DRIVES_AT: {"speed": int, "action": ActionValue, "limit": bool},
        Predicate.ARRIVED: _PLACE,
        Predicate.POSSIBLE: _ACTION,
        Predicate.SAFE: {},
        Predicate.BEHIND: _PLACE,
        Predicate.PASSED: {**_PLACE, "times": int},
        Predicate.TRIED: {"action": ActionValue, "times": int},
        Predicate.NEARER: {**_PLACE, "landmark": LandmarkName},
        Predicate.TASK: {**_PLACE, "street": StreetName, "status": GoalStatus, "count": int},
        Predicate.ORDER: {"place": LandmarkName, "then": LandmarkName},
        Predicate.PURPOSE: {**_PLACE, "purpose": str, "person": str, "item": str, "reason": str},
        Predicate.GOAL: {**_PLACE, "street": StreetName},
        Predicate.TOLD: _ACTION,
        Predicate.BECAUSE: {"effect": _ANY, "cause": _ANY, "at": int},
        Predicate.FEELS: {"feeling": str, "cause": _ANY},
    }
)
"""Arguments of each predicate, by name; all of them may be left out."""

_DEEPEST = 3  # nested propositions


@shared
@dataclass(frozen=True)
class Proposition:
    """Statement about the world, the car, the tasks or a speaker.

    Attributes:
        predicate: predicate of the statement.
        arguments: (name, value) pairs of the arguments that are given, by name; see `PARAMETERS`.
        negated: whether the statement is negated.

    Raises:
        ValueError: an argument is unknown, given twice, or of a wrong type.
    """

    predicate: Predicate
    arguments: tuple[tuple[str, Argument], ...] = ()
    negated: bool = False

    def __post_init__(self) -> None:
        names = [name for name, _ in self.arguments]
        if len(set(names)) < len(names):
            raise ValueError(f"{self.predicate}: an argument is given twice, among {', '.join(names)}")
        for name, value in self.arguments:
            _check(self.predicate, name, value)
        object.__setattr__(self, "arguments", tuple(sorted(self.arguments, key=lambda pair: pair[0])))

    @classmethod
    def of(cls, predicate: Predicate, *, negated: bool = False, **arguments: Argument | None) -> Proposition:
        """Returns a proposition; arguments that are None are left out."""
        return cls(predicate, tuple((name, value) for name, value in arguments.items() if value is not None), negated)

    def get(self, name: str) -> Argument | None:
        """Returns the value of an argument; None if it is not given."""
        return next((value for key, value in self.arguments if key == name), None)

    @property
    def asks(self) -> bool:
        """Returns whether an argument is queried, here or in a nested proposition."""
        return any(value is ASKED or (isinstance(value, Proposition) and value.asks) for _, value in self.arguments)

    @property
    def opposite(self) -> Proposition:
        """The proposition with the other polarity."""
        return Proposition(self.predicate, self.arguments, not self.negated)

    def contains(self, other: Proposition) -> bool:
        """Returns whether this proposition entails another one."""
        same = self.predicate is other.predicate and self.negated is other.negated
        return same and set(other.arguments) <= set(self.arguments)

    def without(self, *names: str) -> Proposition:
        """Returns the proposition without the given arguments."""
        kept = tuple((name, value) for name, value in self.arguments if name not in names)
        return Proposition(self.predicate, kept, self.negated)

    def slots(self) -> frozenset[SlotValue]:
        """Returns the slot values among the arguments; a queried argument gives "Queried" of its slot."""
        found: set[SlotValue] = set()
        for name, value in self.arguments:
            if isinstance(value, Proposition):
                found |= value.slots()
            elif isinstance(value, SlotValue):
                found.add(value)
            elif value is ASKED:
                kind = PARAMETERS[self.predicate][name]
                if kind in _SLOTS:
                    found.add(_SLOTS[kind])
        return frozenset(found)

    def to_json(self) -> dict[str, object]:
        """Returns the proposition in JSON types; `from_json` is the inverse."""
        values = {name: _encoded(value) for name, value in self.arguments}
        return {"predicate": self.predicate.value, **({"negated": True} if self.negated else {}), **values}

    @classmethod
    def from_json(cls, data: object, where: str = "proposition", depth: int = 0) -> Proposition:
        """Returns the proposition that `to_json` has encoded.

        Args:
            data: decoded JSON.
            where: prefix of error messages.
            depth: number of propositions around it.

        Raises:
            ValueError: it is malformed; the message says where.
        """
        if not isinstance(data, Mapping) or not all(isinstance(name, str) for name in data) or depth > _DEEPEST:
            raise ValueError(f"{where}: expected an object with a predicate, at most {_DEEPEST} levels deep")
        values = dict(data)
        label = values.pop("predicate", None)
        try:
            predicate = Predicate(label)
        except ValueError:
            hint = did_you_mean(str(label), [predicate.value for predicate in Predicate])
            raise ValueError(f"{where}: there is no predicate {label!r}; {hint}see `Predicate`") from None
        negated = values.pop("negated", False)
        if not isinstance(negated, bool):
            raise ValueError(f"{where}.negated is {negated!r}; it must be true or false")
        try:
            arguments = tuple((name, _decoded(predicate, name, value, where, depth)) for name, value in values.items())
            return cls(predicate, arguments, negated)
        except ValueError as error:
            raise error if str(error).startswith(where) else ValueError(f"{where}: {error}") from None

    def __str__(self) -> str:
        given = ", ".join(f"{name}={_shown(value)}" for name, value in self.arguments)
        return f"{'not ' if self.negated else ''}{self.predicate}({given})"


_SLOTS: Final[Mapping[object, SlotValue]] = {
    type(SLOT_VALUES[slot][0]): next(value for value in SLOT_VALUES[slot] if value.label == "Queried")
    for slot in (Slot.ACTION, Slot.STREET, Slot.LANDMARK, Slot.STATUS, Slot.OBJECT)
}
"""The value "Queried" of each slot, by the type of its values."""


def encode_meaning(propositions: Iterable[Proposition]) -> str:
    """Returns propositions as one line of JSON; `find_meaning` is the inverse."""
    rows = [proposition.to_json() for proposition in propositions]
    return json.dumps(rows, ensure_ascii=True, separators=(",", ":")) if rows else ""


def find_meaning(text: str) -> tuple[Proposition, ...] | None:
    """Returns the propositions in the JSON that `encode_meaning` writes; None for any other text."""
    try:
        return read_meaning(json.loads(text)) if text else ()
    except (ValueError, RecursionError):
        return None


def read_meaning(rows: object, where: str = "meaning") -> tuple[Proposition, ...]:
    """Returns the propositions of a decoded JSON array.

    Raises:
        ValueError: it is malformed; the message says where.
    """
    if not isinstance(rows, list | tuple):
        raise ValueError(f"{where}: expected an array of propositions")
    return tuple(Proposition.from_json(row, f"{where}[{number}]") for number, row in enumerate(rows))


def _check(predicate: Predicate, name: str, value: Argument) -> None:
    kinds = PARAMETERS[predicate]
    if name not in kinds:
        listed = ", ".join(kinds) or "none"
        raise ValueError(f"{predicate}: has no argument {name!r}; its arguments: {listed}")
    kind = kinds[name]
    if value is ASKED:
        return
    fits = isinstance(value, Proposition) if isinstance(kind, str) else isinstance(value, kind)
    if not fits or (kind is int and isinstance(value, bool)):
        wanted = kind if isinstance(kind, str) else kind.__name__
        raise ValueError(f"{predicate}.{name} is {value!r}; it must be a {wanted}")


def _encoded(value: Argument) -> object:
    if isinstance(value, Proposition):
        return value.to_json()
    if value is ASKED:
        return "?"
    if isinstance(value, SlotValue):
        return value.label
    return value.value if isinstance(value, enum.Enum) else value


def _decoded(predicate: Predicate, name: str, value: object, where: str, depth: int) -> Argument:
    kind = PARAMETERS[predicate].get(name)
    if kind is None:
        listed = ", ".join(PARAMETERS[predicate]) or "none"
        raise ValueError(f"{where}: {predicate} has no argument {name!r}; its arguments: {listed}")
    if value == "?":
        return ASKED
    if isinstance(kind, str):
        return Proposition.from_json(value, f"{where}.{name}", depth + 1)
    if issubclass(kind, enum.Enum):
        found = _LABELS[kind].get(value) if isinstance(value, str) else None
        if found is None:
            hint = did_you_mean(str(value), [*_LABELS[kind]])
            raise ValueError(f"{where}.{name}: there is no {kind.__name__} {value!r}; {hint}see `{kind.__name__}`")
        return found
    if isinstance(value, float) and kind is int and math.isfinite(value) and value == int(value):
        value = int(value)
    if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
        raise ValueError(f"{where}.{name} is {value!r}; it must be of type {kind.__name__}")
    assert isinstance(value, bool | int | str)
    return value


def _labels(kind: type[enum.Enum]) -> dict[str, Argument]:
    found: dict[str, Argument] = {}
    for member in kind:
        if not isinstance(member, SlotValue | Direction | WeatherParameter | PropKind | Sensor):
            raise TypeError(f"{kind.__name__} is no type of an argument")
        found[str(_encoded(member))] = member
    return found


_LABELS: Final = {
    kind: _labels(kind)
    for kinds in PARAMETERS.values()
    for kind in kinds.values()
    if not isinstance(kind, str) and issubclass(kind, enum.Enum)
}


def _shown(value: Argument) -> str:
    return str(value) if isinstance(value, Proposition) else str(_encoded(value))
