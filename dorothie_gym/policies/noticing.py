"""Noticing of the scripted agents: the ten parameters of the weather, and crowds."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import numpy as np

from dorothie_gym.angles import wrap_degrees
from dorothie_gym.dialogue import CommunicativeFunction, Predicate, Proposition, Wording
from dorothie_gym.ontology import ObjectClass
from dorothie_gym.ontology import WeatherParameter as W
from dorothie_gym.policies.guidance_config import FOG_LIMIT, RAIN_LIMIT
from dorothie_gym.policies.observation_parser import SeenObject, scalar, weather
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.speech import Remark, intend
from dorothie_gym.spaces import ObservationMapping


def _turned(azimuth: float) -> float:
    """Returns how far the sun stands from where it usually is [degrees]."""
    return abs(wrap_degrees(azimuth))


CONSPICUOUS: Final[Mapping[W, Callable[[Mapping[W, float]], float]]] = MappingProxyType(
    {
        W.CLOUDINESS: lambda now: now[W.CLOUDINESS] / 75.0,
        W.PRECIPITATION: lambda now: now[W.PRECIPITATION] / RAIN_LIMIT,
        W.PRECIPITATION_DEPOSITS: lambda now: now[W.PRECIPITATION_DEPOSITS] / 45.0,
        W.WIND_INTENSITY: lambda now: now[W.WIND_INTENSITY] / 55.0,
        W.SUN_AZIMUTH_ANGLE: lambda now: (now[W.SUN_ALTITUDE_ANGLE] > 0.0) * _turned(now[W.SUN_AZIMUTH_ANGLE]) / 60.0,
        W.SUN_ALTITUDE_ANGLE: lambda now: (60.0 - now[W.SUN_ALTITUDE_ANGLE]) / 45.0,
        W.FOG_DENSITY: lambda now: now[W.FOG_DENSITY] / FOG_LIMIT,
        W.FOG_DISTANCE: lambda now: now[W.FOG_DISTANCE] / 25.0 * (now[W.FOG_DENSITY] > FOG_LIMIT),
        W.FOG_FALLOFF: lambda now: now[W.FOG_FALLOFF] / 1.5 * (now[W.FOG_DENSITY] > FOG_LIMIT),
        W.WETNESS: lambda now: now[W.WETNESS] / 45.0,
    }
)  # fmt: skip
"""How conspicuous each parameter is; it is noticed from 1 on, and its end below `OVER`. The sun is noticed when it is
within 15 degrees of the horizon, or stands elsewhere than at noon."""

OVER: Final = 0.6

CROWD_DISTANCE: Final = 50.0
"""Distance within which a crowd is noticed [m]."""

CROWDS: Final[Mapping[ObjectClass, int]] = MappingProxyType({ObjectClass.PEDESTRIAN: 3, ObjectClass.VEHICLES: 4})
"""Least number of objects in a crowd."""

CROWD_INTERVAL: Final = 60.0
"""Time between remarks about crowds [s]."""


@dataclass(frozen=True, kw_only=True)
class Noticed:
    """What an agent has noticed.

    Attributes:
        weather: parameters that have become conspicuous and are still so.
        crowd_at: time at which a crowd was last noticed [s].
    """

    weather: frozenset[W] = frozenset()
    crowd_at: float = -math.inf

    def with_change(self, parameter: W, *, high: bool) -> Noticed:
        """Records that a parameter has become conspicuous, or has ceased to be."""
        return replace(self, weather=self.weather | {parameter} if high else self.weather - {parameter})


def notice(
    noticed: Noticed,
    observation: ObservationMapping,
    objects: Sequence[SeenObject],
    rng: np.random.Generator,
    *,
    chance: float,
    handled: Collection[W],
) -> tuple[Remark | None, Noticed]:
    """Looks around, and perhaps mentions a change of the weather or a crowd.

    Args:
        noticed: what has been noticed before.
        observation: observation of the agent.
        objects: objects in sight.
        rng: random generator of the decision.
        chance: probability that what is noticed is mentioned.
        handled: parameters whose beginning the agent reacts to elsewhere.

    Returns:
        The remark, or None, and what has been noticed now.
    """
    for parameter, high in changes(observation, noticed.weather):
        noticed = noticed.with_change(parameter, high=high)
        if not (high and parameter in handled) and rng.random() < chance:
            return weather_change_remark(parameter, high=high), noticed
    kind, now = crowd_ahead(objects), scalar(observation, "time")
    if kind is None or now - noticed.crowd_at < CROWD_INTERVAL:
        return None, noticed
    noticed = replace(noticed, crowd_at=now)
    return crowd_remark(kind) if rng.random() < chance else None, noticed


def changes(observation: ObservationMapping, noted: frozenset[W]) -> Iterator[tuple[W, bool]]:
    """Yields the parameters that have become conspicuous (True), or are so no more (False), since they were noted."""
    now = {parameter: weather(observation, parameter) for parameter in W}
    for parameter, measure in CONSPICUOUS.items():
        value = measure(now)
        if value >= 1.0 and parameter not in noted:
            yield parameter, True
        elif value < OVER and parameter in noted:
            yield parameter, False


def crowd_ahead(objects: Sequence[SeenObject]) -> ObjectClass | None:
    """Returns pedestrians or vehicles if conspicuously many of them are near; None otherwise."""
    near = [thing.kind for thing in objects if thing.distance < CROWD_DISTANCE]
    return next((kind for kind, least in CROWDS.items() if near.count(kind) >= least), None)


def crowd_remark(kind: ObjectClass) -> Remark:
    """Returns a remark about many pedestrians or vehicles."""
    return intend(CommunicativeFunction.INFORM, Proposition.of(Predicate.CROWDED, object=kind))


def weather_change_remark(parameter: W, *, high: bool) -> Remark:
    """Returns a remark about a parameter that has become conspicuous, or has ceased to be."""
    said = Proposition.of(Predicate.WEATHER, parameter=parameter, high=high)
    topic = f"{'much' if high else 'less'}_{parameter}"
    return intend(CommunicativeFunction.INFORM, said, wording=Wording(topic=topic))
