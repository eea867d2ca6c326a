"""Parsers of the vocabularies, for our spelling and all spellings known from SDN files.

Case, spaces and punctuation are ignored; only words that differ otherwise are listed as aliases.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Protocol, TypeVar

from dorothie_gym.errors import OntologyError
from dorothie_gym.ontology.actions import MentalAction, PhysicalAction
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.ontology.labelled_enums import Vocabulary, normalise
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import (
    ActionValue,
    GoalStatus,
    LandmarkName,
    ObjectClass,
    Slot,
    SlotValue,
    StreetName,
)
from dorothie_gym.ontology.world_exceptions import ExceptionKind, PropKind, Sensor, WeatherParameter


class _Labelled(Protocol):
    label: str


_Member = TypeVar("_Member", bound=_Labelled)


def _labelled(
    name: str, members: Iterable[_Member], aliases: Mapping[str, _Member] | None = None
) -> Vocabulary[_Member]:
    """Returns the vocabulary of the labels of the members and the aliases."""
    return Vocabulary(name, [*((member.label, member) for member in members), *(aliases or {}).items()])


_MOVES = _labelled("dialogue move", DialogueMove)
_SLOTS = _labelled("slot", Slot, {"StreetName": Slot.STREET})
_ACTION_VALUES = _labelled("value of slot Action", ActionValue)
_STREETS = _labelled("value of slot Street", StreetName)
_LANDMARKS = _labelled("value of slot Landmark", LandmarkName)
_STATUSES = _labelled("value of slot Status", GoalStatus, {"Completed": GoalStatus.COMPLETE})
_OBJECTS = _labelled("value of slot Object", ObjectClass, {"Vehicle": ObjectClass.VEHICLES})
_PHYSICAL_ACTIONS = _labelled("physical action", PhysicalAction)
_MENTAL_ACTIONS = _labelled("mental action", MentalAction, {"LandmarkUpdate": MentalAction.KNOWLEDGE_UPDATE})
_EXCEPTIONS = _labelled(
    "exception",
    ExceptionKind,
    # Row types of ad_wizardlog.csv in SDN.
    {
        "set_weather": ExceptionKind.WEATHER,
        "make_cars": ExceptionKind.SPAWN_VEHICLES,
        "make_peds": ExceptionKind.SPAWN_PEDESTRIANS,
        "prop_create": ExceptionKind.PLACE_PROP,
    },
)
_ROLES = Vocabulary("role", [(name, role) for role in Role for name in (role.value, *role.sdn_names)])
_WEATHER = Vocabulary("weather parameter", [(parameter.value, parameter) for parameter in WeatherParameter])
_PROPS = Vocabulary("prop", [(name, kind) for kind in PropKind for name in (kind.value, kind.blueprint)])
_SENSORS = Vocabulary("sensor", [(sensor.value, sensor) for sensor in Sensor])


def parse_role(text: str) -> Role:
    """Returns the role that `text` spells; raises OntologyError otherwise."""
    return _ROLES.parse(text)


def parse_move(text: str) -> DialogueMove:
    """Returns the dialogue move that `text` spells; raises OntologyError otherwise."""
    return _MOVES.parse(text)


def parse_slot(text: str) -> Slot:
    """Returns the slot that `text` spells; raises OntologyError otherwise."""
    return _SLOTS.parse(text)


def parse_action_value(text: str) -> ActionValue:
    """Returns the value of Slot.ACTION that `text` spells; raises OntologyError otherwise."""
    return _ACTION_VALUES.parse(text)


def parse_street(text: str) -> StreetName:
    """Returns the street that `text` spells; raises OntologyError otherwise."""
    return _STREETS.parse(text)


def parse_landmark(text: str) -> LandmarkName:
    """Returns the landmark that `text` spells; raises OntologyError otherwise."""
    return _LANDMARKS.parse(text)


def parse_goal_status(text: str) -> GoalStatus:
    """Returns the goal status that `text` spells; raises OntologyError otherwise."""
    return _STATUSES.parse(text)


def parse_object_class(text: str) -> ObjectClass:
    """Returns the object class that `text` spells; raises OntologyError otherwise."""
    return _OBJECTS.parse(text)


def parse_physical_action(text: str) -> PhysicalAction:
    """Returns the physical action that `text` spells; raises OntologyError otherwise."""
    return _PHYSICAL_ACTIONS.parse(text)


def parse_mental_action(text: str) -> MentalAction:
    """Returns the mental action that `text` spells; raises OntologyError otherwise."""
    return _MENTAL_ACTIONS.parse(text)


def parse_exception(text: str) -> ExceptionKind:
    """Returns the exception kind that `text` spells; raises OntologyError otherwise."""
    return _EXCEPTIONS.parse(text)


def parse_sensor(text: str) -> Sensor:
    """Returns the sensor that `text` spells; raises OntologyError otherwise."""
    return _SENSORS.parse(text)


def parse_weather_parameter(text: str) -> WeatherParameter:
    """Returns the weather parameter that `text` spells; raises OntologyError otherwise."""
    return _WEATHER.parse(text)


def parse_prop(text: str) -> PropKind:
    """Returns the prop kind that `text` spells, as a name or as a CARLA blueprint; raises OntologyError otherwise."""
    return _PROPS.parse(text)


_VALUES: Mapping[Slot, Vocabulary[SlotValue]] = MappingProxyType(
    {
        Slot.ACTION: _ACTION_VALUES,
        Slot.STREET: _STREETS,
        Slot.LANDMARK: _LANDMARKS,
        Slot.STATUS: _STATUSES,
        Slot.OBJECT: _OBJECTS,
    }
)


def parse_slot_value(slot: Slot, text: str) -> SlotValue:
    """Returns the value of `slot` that `text` spells.

    Raises:
        OntologyError: if `text` is unknown, or `slot` is Null, which has no values.
    """
    if slot not in _VALUES:
        raise OntologyError(f"value of slot {slot.label}: {text!r} is unknown; the slot has no values")
    return _VALUES[slot].parse(text)


def parse_act(move: str, slots: Mapping[str, Iterable[str] | str | None] | None = None) -> DialogueAct:
    """Returns the act for a move and slots in the spelling of SDN.

    Args:
        move: spelling of the move.
        slots: values of each slot: an iterable, a single text, or None. Null and empty texts count as no value.

    Raises:
        OntologyError: if the move, a slot or a value is unknown.
    """
    values: list[SlotValue] = []
    for slot_text, given in (slots or {}).items():
        slot = parse_slot(slot_text)
        texts = () if given is None else (given,) if isinstance(given, str) else given
        values.extend(parse_slot_value(slot, text) for text in texts if not _is_blank(text))
    return DialogueAct.of(parse_move(move), *values)


def _is_blank(text: object) -> bool:
    """Returns whether `text` stands for "no value" in a file."""
    return text is None or (isinstance(text, str) and normalise(text) in ("", "null"))
