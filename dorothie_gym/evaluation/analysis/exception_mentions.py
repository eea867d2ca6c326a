"""Propositions that are about an exception: the content of an utterance decides, not its words.

- weather: `weather` with a parameter of the same kind (fog; rain and wet roads; sun; clouds; wind); `visibility` where
  that kind limits it; `lights_on`, and switching the headlights, for the altitude of the sun;
- vehicles, pedestrians: `crowded` with their class, and `hinders` near the place;
- an object on the road: `blocked`, and `hinders` with an obstacle;
- a sensor fault: `failed` with the sensor or with none; `localised` for the GPS; `visibility` for the camera;
- a task exception: `task`, `goal`, `order` or `purpose` with its landmark.

Propositions inside others count: causes of effects and of feelings.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.ontology.slots import ActionValue, ObjectClass
from dorothie_gym.ontology.world_exceptions import ExceptionKind, Sensor
from dorothie_gym.ontology.world_exceptions import WeatherParameter as W

if TYPE_CHECKING:
    from dorothie_gym.session.recording.events import Event

_FOG: Final = frozenset({W.FOG_DENSITY, W.FOG_DISTANCE, W.FOG_FALLOFF})
_RAIN: Final = frozenset({W.PRECIPITATION, W.PRECIPITATION_DEPOSITS, W.WETNESS})
_SUN: Final = frozenset({W.SUN_ALTITUDE_ANGLE, W.SUN_AZIMUTH_ANGLE})
_KINDS_OF_WEATHER: Final = (_FOG, _RAIN, _SUN, frozenset({W.CLOUDINESS}), frozenset({W.WIND_INTENSITY}))
_LIMITS_VIEW: Final = _FOG | {W.PRECIPITATION, W.SUN_ALTITUDE_ANGLE}

_CROWDS: Final[Mapping[ExceptionKind, ObjectClass]] = MappingProxyType(
    {ExceptionKind.SPAWN_VEHICLES: ObjectClass.VEHICLES, ExceptionKind.SPAWN_PEDESTRIANS: ObjectClass.PEDESTRIAN}
)
_ERRANDS: Final = frozenset({Predicate.TASK, Predicate.GOAL, Predicate.ORDER, Predicate.PURPOSE})


def mentions(propositions: Iterable[Proposition], kind: ExceptionKind, event: Event, *, near: bool) -> bool:
    """Returns whether a proposition is about an exception.

    Args:
        propositions: content of the utterances.
        kind: kind of the exception.
        event: the exception.
        near: whether the car is near its place, if it has one.
    """
    return any(_is_about(said, kind, event, near) for said in _flat(propositions))


def _flat(propositions: Iterable[Proposition]) -> Iterator[Proposition]:
    for said in propositions:
        yield said
        yield from _flat(value for _, value in said.arguments if isinstance(value, Proposition))


def _is_about(said: Proposition, kind: ExceptionKind, event: Event, near: bool) -> bool:
    predicate, thing = said.predicate, said.get("object")
    if kind is ExceptionKind.WEATHER:
        return _is_about_weather(said, event)
    if kind is ExceptionKind.SENSOR_FAULT:
        return _is_about_sensor(said, event)
    if kind.is_task:
        places = (said.get(name) for name in ("place", "then"))
        labels = {str(getattr(place, "label", "")) for place in places}
        return predicate in _ERRANDS and str(event.data.get("landmark")) in labels
    if kind in _CROWDS:
        crowd = thing is _CROWDS[kind]
        return crowd and (predicate is Predicate.CROWDED or (predicate is Predicate.HINDERS and near))
    hinders = predicate is Predicate.HINDERS and thing is ObjectClass.STATIC
    return predicate is Predicate.BLOCKED or hinders


def _is_about_weather(said: Proposition, event: Event) -> bool:
    changed = next((parameter for parameter in W if parameter.value == event.data.get("parameter")), None)
    if said.predicate is Predicate.WEATHER:
        parameter = said.get("parameter")
        return any(changed in group and parameter in group for group in _KINDS_OF_WEATHER)
    if said.predicate is Predicate.VISIBILITY:
        return changed in _LIMITS_VIEW
    lights = said.predicate is Predicate.LIGHTS_ON or said.get("action") is ActionValue.LIGHT_CHANGE
    return lights and changed is W.SUN_ALTITUDE_ANGLE


def _is_about_sensor(said: Proposition, event: Event) -> bool:
    faulty = next((sensor for sensor in Sensor if sensor.value == event.data.get("sensor")), None)
    if said.predicate is Predicate.FAILED:
        return said.get("sensor") in (None, faulty)
    if faulty is Sensor.GPS:
        return said.predicate is Predicate.LOCALISED
    return said.predicate is Predicate.VISIBILITY
