"""Exceptions that a role could perceive, decided from the record.

- A change of a task reaches the participant as a message, at once.
- A change of the weather is perceived at once if it is at least `CHANGE` of the parameter's range; that of the sun's
  azimuth while the sun is up, those of the fog's distance and falloff in fog.
- A failure of the GPS is perceived once the car has driven `BLIND_WAY` without it; one of the camera as soon as the
  range of sight falls below `LOSS` of that in the current weather.
- An object on the road is perceived when the car comes within `analysis.exception_attribution.MEETING_DISTANCE` of it.
- Vehicles and pedestrians are perceived when `CROWD` of them are within `CROWD_DISTANCE` and within sight, while the
  car is within twice `MEETING_DISTANCE` of the place where they appeared.

An exception that is not perceived within `WITHIN` could not be talked about, and does not count.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from dorothie_gym.evaluation.analysis.exception_attribution import MEETING_DISTANCE, kind_of, place_of, time_met
from dorothie_gym.evaluation.analysis.truth_checks.session_world import ACTORS, SessionWorld
from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.ontology.world_exceptions import ExceptionKind, Sensor, WeatherParameter
from dorothie_gym.sim.config import FAULT_SECONDS

if TYPE_CHECKING:
    from dorothie_gym.session.recording.events import Event

WITHIN: Final = 45.0
"""Time within which an exception is perceived, if at all [s]."""

CHANGE: Final = 0.15
"""Minimum change of a parameter of the weather, as a share of its range."""

LOSS: Final = 0.85
"""Share of the range of sight below which a fault of the camera shows."""

BLIND_WAY: Final = 25.0
"""Distance without GPS after which the position is uncertain [m]."""

CROWD: Final = 3
"""Minimum number of vehicles or pedestrians in a crowd."""

CROWD_DISTANCE: Final = 50.0
"""Distance within which a crowd is perceived [m]."""

_FOG: Final = 25.0  # minimum density of fog in which its distance and falloff are visible [%]
_STEP: Final = 1.0  # time between looks into the record [s]
_BEFORE: Final = 0.5  # time before a change at which its parameter still has the previous value [s]


def perceived_at(world: SessionWorld, event: Event) -> float | None:
    """Returns when an exception can first be perceived [s]; None if it cannot be within `WITHIN`."""
    kind = kind_of(event)
    if kind is None or kind.is_task:
        return event.time
    if kind is ExceptionKind.WEATHER:
        return event.time if _is_conspicuous(world, event) else None
    if kind.is_plan_level:
        met = time_met(world.session, event)
        return met if met <= event.time + WITHIN else None
    times = np.arange(event.time, min(event.time + WITHIN, world.end), _STEP).tolist()
    shows = _shows_fault if kind is ExceptionKind.SENSOR_FAULT else _shows_crowd
    return next((time for time in times if shows(world, event, time)), None)


def _is_conspicuous(world: SessionWorld, event: Event) -> bool:
    parameter = next((each for each in WeatherParameter if each.value == event.data.get("parameter")), None)
    if parameter is None:
        return False
    before, value = world.weather(event.time - _BEFORE, parameter), event.data.get("value")
    change = abs(float(value) - before) if isinstance(value, int | float) else 0.0
    if change < CHANGE * (parameter.high - parameter.low):
        return False
    if parameter is WeatherParameter.SUN_AZIMUTH_ANGLE:
        return world.weather(event.time, WeatherParameter.SUN_ALTITUDE_ANGLE) > 0.0
    if parameter in (WeatherParameter.FOG_DISTANCE, WeatherParameter.FOG_FALLOFF):
        return world.weather(event.time, WeatherParameter.FOG_DENSITY) >= _FOG
    return True


def _shows_fault(world: SessionWorld, event: Event, time: float) -> bool:
    if time >= event.time + FAULT_SECONDS:
        return False
    if event.data.get("sensor") == Sensor.GPS.value:
        begun = world.row(event.time)["frame"]
        rows = world.session.trajectory
        drive = rows[(rows["frame"] >= begun) & (rows["frame"] <= world.row(time)["frame"])]
        return float(np.hypot(np.diff(drive["x"]), np.diff(drive["y"])).sum()) >= BLIND_WAY
    return world.sight(time) < LOSS * world.sight(time, faulty=False)


def _shows_crowd(world: SessionWorld, event: Event, time: float) -> bool:
    place, (x, y) = place_of(event), world.position(time)
    if place is None or math.hypot(place[0] - x, place[1] - y) > 2.0 * MEETING_DISTANCE:
        return False
    people = kind_of(event) is ExceptionKind.SPAWN_PEDESTRIANS
    actors = ACTORS[ObjectClass.PEDESTRIAN if people else ObjectClass.VEHICLES]
    return world.count_near(time, actors, min(CROWD_DISTANCE, world.sight(time))) >= CROWD
