"""Conditions that the scripted agents notice: the ten parameters of the weather, crowds, and limits of the view."""

from __future__ import annotations

import functools
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

import numpy as np

from dorothie_gym.dialogue.intentions import CommunicativeFunction
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.ontology.labelled_enums import complete
from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.ontology.world_exceptions import Sensor
from dorothie_gym.ontology.world_exceptions import WeatherParameter as W
from dorothie_gym.policies.observation_parser import SeenObject, scalar
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.scripted_agent_limits import FOG_LIMIT, RAIN_LIMIT
from dorothie_gym.policies.speech import Remark, intend
from dorothie_gym.policies.view_range import DENSE, FAR_SIGHT, Limit
from dorothie_gym.support.portable_math import wrap_degrees

if TYPE_CHECKING:
    from dorothie_gym.dialogue.nlu import ParsedText
    from dorothie_gym.session.spaces.observations import ObservationMapping


def _turned(azimuth: float) -> float:
    """Returns how far the sun stands from where it usually is [degrees]."""
    return abs(wrap_degrees(azimuth))


CONSPICUOUS: Final[Mapping[W, Callable[[Mapping[W, float]], float]]] = complete(
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
    },
    W,
    "CONSPICUOUS",
    __name__,
)
"""Conspicuousness of each parameter: a value of at least 1 is noticed, and so is a fall below `OVER`. The sun is
noticed when it is within 15 degrees of the horizon, or stands elsewhere than at noon."""

OVER: Final = 0.6

CROWD_DISTANCE: Final = 50.0
"""Distance within which a crowd is noticed [m]."""

CROWDS: Final[Mapping[ObjectClass, int]] = MappingProxyType({ObjectClass.PEDESTRIAN: 3, ObjectClass.VEHICLES: 3})
"""Minimum number of objects in a crowd."""

MORE_THAN_USUAL: Final = 1.5
"""Minimum number of objects by which a crowd exceeds the usual number."""

USUAL_TIME: Final = 30.0
"""Time over which the usual number of objects is averaged [s]."""

CROWD_INTERVAL: Final = 180.0
"""Time between remarks about crowds of a kind [s]."""


JUST_HEARD: Final = 12.0
"""Time after a remark on a parameter of the weather within which the listener makes none on it [s]."""

_TELLS_DISTANCE: Final = 0.2  # probability that the range of sight is named
_NAMES_OBJECT: Final = 0.35  # probability that an object is named that is hidden or shown

PARAMETER: Final[Mapping[Limit, W]] = MappingProxyType(
    {Limit.FOG: W.FOG_DENSITY, Limit.RAIN: W.PRECIPITATION, Limit.NIGHT: W.SUN_ALTITUDE_ANGLE}
)
"""Parameter of the weather behind each limit of the view."""

HIDDEN: Final[Mapping[Limit, tuple[ObjectClass, ...]]] = MappingProxyType(
    {
        Limit.FOG: (ObjectClass.ROAD_LINE, ObjectClass.ROAD),
        Limit.RAIN: (ObjectClass.WATER, ObjectClass.GROUND, ObjectClass.ROAD),
        Limit.NIGHT: (ObjectClass.SKY,),
    }
)
"""Objects that each limit hides or shows."""


@dataclass(frozen=True, kw_only=True)
class Noticed:
    """Conditions that an agent has noticed.

    Attributes:
        weather: parameters that have become conspicuous and are still so.
        mentioned: changes (parameter, whether it is high) that either speaker has mentioned.
        crowds: kinds of crowds, with the time at which each was last noticed [s].
        usual: usual number of objects near, by the kinds of `CROWDS`.
        looked_at: time of the last look around [s].
        heard: parameters of which the other speaker has spoken, with the time [s].
    """

    weather: frozenset[W] = frozenset()
    mentioned: frozenset[tuple[W, bool]] = frozenset()
    crowds: tuple[tuple[ObjectClass, float], ...] = ()
    usual: tuple[float, ...] = (0.0,) * len(CROWDS)
    looked_at: float = 0.0
    heard: tuple[tuple[W, float], ...] = ()

    def with_change(self, parameter: W, *, high: bool) -> Noticed:
        """Records that a parameter has become conspicuous, or has ceased to be."""
        weather = self.weather | {parameter} if high else self.weather - {parameter}
        return replace(self, weather=weather, mentioned=self.mentioned - {(parameter, not high)})

    def with_mention(self, parameter: W, *, high: bool) -> Noticed:
        """Records that a speaker has mentioned that a parameter is conspicuous, or has ceased to be."""
        return replace(self, mentioned=self.mentioned | {(parameter, high)})

    def has_mentioned(self, parameter: W) -> bool:
        """Returns whether a speaker has mentioned that a parameter is conspicuous."""
        return (parameter, True) in self.mentioned

    def with_crowd(self, kind: ObjectClass, now: float) -> Noticed:
        """Records that a crowd was noticed at a time [s]."""
        return replace(self, crowds=(*(row for row in self.crowds if row[0] is not kind), (kind, now)))

    def after_looking(self, near: Sequence[ObjectClass], now: float) -> Noticed:
        """Updates the usual numbers of objects by the kinds of those near, at a time [s]."""
        weight = min(max(now - self.looked_at, 0.0) / USUAL_TIME, 1.0)
        usual = tuple(mean + weight * (near.count(kind) - mean) for kind, mean in zip(CROWDS, self.usual, strict=True))
        return replace(self, usual=usual, looked_at=now)

    def after_hearing(self, words: ParsedText, now: float) -> Noticed:
        """Records conditions that the other speaker has just mentioned at a time [s], which then need no mention.

        Words may be misheard: "the clouds are" speaks of the clouds, and "there are so people" of a crowd.
        """
        told = words.told
        if told is None and (words.question or words.plan or set(words.objects).isdisjoint(CROWDS)):
            return self
        parameter = None if told is None else told.get("parameter")
        if isinstance(parameter, W):
            heard = (*(row for row in self.heard if row[0] is not parameter), (parameter, now))
            return replace(
                self.with_mention(parameter, high=told is not None and told.get("high") is True), heard=heard
            )
        if told is not None and told.predicate is not Predicate.CROWDED:
            return self
        # "look at that traffic" names no object
        kind = next((thing for thing in words.objects if thing in CROWDS), ObjectClass.VEHICLES)
        return self.with_crowd(kind, now)


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
        noticed: conditions noticed before.
        observation: observation of the agent.
        objects: objects in sight.
        rng: random generator of the decision.
        chance: probability that a noticed condition is mentioned.
        handled: parameters whose onset the agent reacts to elsewhere.

    Returns: The remark, or None, and the noticed conditions.
    """
    heard = {parameter for parameter, at in noticed.heard if scalar(observation, "time") - at < JUST_HEARD}
    for parameter, high in changes(observation, noticed.weather):
        told = (parameter, high) in noticed.mentioned or parameter in heard
        noticed = noticed.with_change(parameter, high=high)
        if not told and not (high and parameter in handled) and rng.random() < chance:
            return weather_change_remark(parameter, high=high), noticed
    near, now = [thing.kind for thing in objects if thing.distance < CROWD_DISTANCE], scalar(observation, "time")
    recent = {kind for kind, at in noticed.crowds if now - at < CROWD_INTERVAL}
    kind = next((kind for kind in crowds_among(near, noticed.usual) if kind not in recent), None)
    noticed = noticed.after_looking(near, now)
    if kind is None:
        return None, noticed
    noticed = noticed.with_crowd(kind, now)
    return crowd_remark(kind) if rng.random() < chance else None, noticed


def changes(observation: ObservationMapping, noted: frozenset[W]) -> Iterator[tuple[W, bool]]:
    """Yields the parameters that have become conspicuous (True), or are no longer (False), since they were noted."""
    for parameter, value in _conspicuousness(tuple(observation["weather"].tolist())):
        if value >= 1.0 and parameter not in noted:
            yield parameter, True
        elif value < OVER and parameter in noted:
            yield parameter, False


@functools.lru_cache(maxsize=256)
def _conspicuousness(values: tuple[float, ...]) -> tuple[tuple[W, float], ...]:
    """Returns the conspicuousness of each parameter in a weather; most decisions have the same."""
    now = dict(zip(W, values, strict=True))
    return tuple((parameter, measure(now)) for parameter, measure in CONSPICUOUS.items())


def crowds_among(near: Sequence[ObjectClass], usual: Sequence[float]) -> list[ObjectClass]:
    """Returns the classes of which conspicuously many objects, and more than usual, are near."""
    return [
        kind
        for (kind, least), mean in zip(CROWDS.items(), usual, strict=True)
        if near.count(kind) >= max(least, mean + MORE_THAN_USUAL)
    ]


def crowd_remark(kind: ObjectClass) -> Remark:
    """Returns a remark about many pedestrians or vehicles."""
    return intend(CommunicativeFunction.INFORM, Proposition.of(Predicate.CROWDED, object=kind))


def weather_change_remark(parameter: W, *, high: bool) -> Remark:
    """Returns a remark about a parameter that has become conspicuous, or has ceased to be."""
    said = Proposition.of(Predicate.WEATHER, parameter=parameter, high=high)
    topic = f"{'much' if high else 'less'}_{parameter}"
    return intend(CommunicativeFunction.INFORM, said, wording=Wording(topic=topic))


def view_remark(limit: Limit, distance: float, rng: np.random.Generator) -> Remark:
    """Returns a remark about the limit of the view: the condition, an object that it hides, or the sight distance.

    Args:
        limit: cause of the limit.
        distance: range of sight [m].
        rng: random generator of the decision.
    """
    draw = rng.random()
    if draw < _TELLS_DISTANCE and distance < FAR_SIGHT:
        said = Proposition.of(Predicate.VISIBILITY, metres=10 * round(distance / 10.0))
        return intend(CommunicativeFunction.INFORM, said, wording=Wording(topic="sight"))
    if limit is Limit.CAMERA:
        said = Proposition.of(Predicate.VISIBILITY, negated=True)
        return intend(CommunicativeFunction.INFORM, said)
    things = HIDDEN[limit]
    thing = things[int(rng.integers(len(things)))] if draw > 1.0 - _NAMES_OBJECT else None
    said = Proposition.of(Predicate.WEATHER, parameter=PARAMETER[limit], high=True, object=thing)
    dense = limit is Limit.FOG and distance < DENSE
    return intend(CommunicativeFunction.INFORM, said, wording=Wording(topic=f"{'dense_' * dense}{limit}"))


def fault_remark(sensor: Sensor, *, over: bool = False, joined: bool = False) -> Remark:
    """Returns a remark that a sensor fails, or works again."""
    said = Proposition.of(Predicate.FAILED, sensor=sensor, negated=over)
    wording = Wording(topic=f"{'not_' * over}failed_{sensor}")
    return intend(CommunicativeFunction.INFORM, said, wording=wording, joined=joined)
