"""Truth of propositions, held against the recorded world."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Final

import numpy as np

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.looks import read_look
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.evaluation.analysis.truth_checks import plans
from dorothie_gym.evaluation.analysis.truth_checks.session_world import ACTORS, SessionWorld
from dorothie_gym.maps.model import SignalKind
from dorothie_gym.maps.whereabouts import is_near_corner, is_on_right, signals_near
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import ActionValue, LandmarkName, ObjectClass, StreetName
from dorothie_gym.ontology.world_exceptions import Sensor, WeatherParameter
from dorothie_gym.policies.place_looks import look_at
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.tasks.landmark_designs import features_of

if TYPE_CHECKING:
    from dorothie_gym.session.recording.header import LandmarkRow

CLOSE, FAR = 130.0, 200.0
"""Routes up to the first length count as short, and those of at least the second as long [m]; in between, both
statements are true.
"""

PLAIN_SIGHT, SIGHT = 20.0, 120.0
"""An actor within the first distance is seen, one beyond the second is not [m]; in between it may be hidden."""

TIME_FACTOR: Final = 1.5
"""Largest ratio of a claimed and an actual time that agree; times up to `SHORT_TIME` agree in any case."""

SHORT_TIME: Final = 15.0
"""Largest irrelevant difference of times [s]."""

_PASSING: Final = 30.0  # distance from a place within which the car passes it [m]
_POOR, _GOOD = 50.0, 65.0  # ranges of sight that are poor and good [m]
_SIGHT_ERROR: Final = 10.0  # error of a range of sight that agrees [m]
_NEAR: Final = 130.0  # largest distance of two places near each other [m]
_BESIDE: Final = 40.0  # largest distance of a light or sign from a place near it [m]
_CORNER: Final = 80.0  # largest distance of a place near a corner from the centre of the junction [m]
_SHORT_WAY, _WAY_ERROR = 40.0, 0.25  # largest error of a stated distance [m], and as a share of it
_NOW: Final = 4.0  # tolerance of "now" [s]
_FADING: Final = 16  # time for which a fault is felt after its end [s]
_CHANGED: Final = 0.15  # share of a parameter's range that is a change
_CROWD: Final = 3  # minimum number in a crowd
_END_IN_SIGHT: Final = 120.0  # distance to the end of a lane that keeps the car from following it [m]
_IN_FRONT: Final = 15.0  # largest distance from the centre of the car to the body that it waits behind [m]
_AHEAD: Final = 25.0  # and its largest angle to the heading [degrees]
_TOLD: Final = 60.0  # longest time between an order and the action that it explains [s]

Evaluator = Callable[[SessionWorld, Proposition, float, Role], bool | None]
"""Returns whether a proposition without negation is true at a time [s], said by a role; None if it is not recorded."""


def is_true(world: SessionWorld, said: Proposition, time: float, speaker: Role) -> bool | None:
    """Returns whether a proposition is true; None if the recording does not determine it.

    Args:
        world: the recorded world.
        said: the proposition.
        time: time of the statement [s].
        speaker: speaker of the statement.
    """
    evaluator = _EVALUATORS.get(said.predicate)
    held = None if evaluator is None or said.asks else evaluator(world, said, time, speaker)
    return held if held is None else held is not said.negated


def is_right_cause(world: SessionWorld, cause: Proposition, effect: Proposition | None, time: float) -> bool | None:
    """Returns whether a cause held when its effect did, at a time [s]; None if the recording does not determine it."""
    evaluator = _CAUSES.get(cause.predicate)
    if evaluator is None:
        return None
    if effect is not None and effect.predicate is Predicate.STANDS:
        stood = any(world.stands(time + shift) for shift in (-_NOW, -1.0, 0.0, 1.0, _NOW))
        if not stood:
            return False
    held = evaluator(world, cause, time)
    return held if held is None else held is not cause.negated


def agrees(claimed: float, actual: float) -> bool:
    """Returns whether a claimed time agrees with the actual one [s]."""
    if abs(claimed - actual) <= SHORT_TIME:
        return True
    return claimed > 0.0 and actual > 0.0 and max(claimed / actual, actual / claimed) <= TIME_FACTOR


# --- evaluators by predicate ------------------------------------------------------------------------------------------


def _sees(world: SessionWorld, said: Proposition, time: float, speaker: Role) -> bool | None:
    kind = said.get("object")
    actors = ACTORS.get(kind) if isinstance(kind, ObjectClass) else None
    if actors is None:
        return None
    nearest = min(world.distance_of(time + shift, actors) for shift in (-_NOW, -2.0, 0.0))
    return True if nearest <= PLAIN_SIGHT else False if nearest > SIGHT else None


def _on_street(world: SessionWorld, said: Proposition, time: float, speaker: Role) -> bool | None:
    street = said.get("street")
    if not isinstance(street, StreetName):
        return None
    names = {world.street(time + shift) for shift in (-_NOW, -2.0, 0.0)}
    return street.label in names if names != {None} else None


def _located(world: SessionWorld, said: Proposition, time: float, speaker: Role) -> bool | None:
    place, street, cross, side = (said.get(name) for name in ("place", "street", "cross", "side"))
    rows = world.landmarks(place) if isinstance(place, LandmarkName) else []
    if not rows:
        return None
    if isinstance(street, StreetName):
        rows = [row for row in rows if world.street_name(row["street"]) == street.label]
    if isinstance(cross, StreetName):
        rows = [row for row in rows if _is_at_corner(world, row, cross)]
    if side is None:
        return bool(rows) if street is not None or cross is not None else None
    if isinstance(side, Direction):
        right = side is Direction.RIGHT
        return any(is_on_right(world.town, row["lane"], row["x"], row["y"]) is right for row in rows)
    return None


def _is_at_corner(world: SessionWorld, row: LandmarkRow, cross: StreetName) -> bool:
    crossing = (number for number in range(len(world.town.streets)) if world.street_name(number) == cross.label)
    here = row["x"], row["y"], _CORNER
    return any(is_near_corner(world.town, row["street"], number, *here) for number in crossing)


def _near(world: SessionWorld, said: Proposition, time: float, speaker: Role) -> bool | None:
    place, other, kind = said.get("place"), said.get("landmark"), said.get("object")
    rows = world.landmarks(place) if isinstance(place, LandmarkName) else []
    if not rows:
        return None
    if isinstance(other, LandmarkName):
        pairs = [(row, there) for row in rows for there in world.landmarks(other)]
        return any(math.hypot(row["x"] - there["x"], row["y"] - there["y"]) <= _NEAR for row, there in pairs)
    if kind in (ObjectClass.TRAFFIC_LIGHT, ObjectClass.TRAFFIC_SIGN):
        light = kind is ObjectClass.TRAFFIC_LIGHT
        found = {sign for row in rows for sign in signals_near(world.town, row["x"], row["y"], _BESIDE)}
        return any((sign is SignalKind.TRAFFIC_LIGHT) is light for sign in found)
    return None


def _looks(world: SessionWorld, said: Proposition, time: float, speaker: Role) -> bool | None:
    """Whether a landmark of the name has the stated feature, or all attributes that the words state."""
    place, feature = said.get("place"), said.get("feature")
    if not isinstance(place, LandmarkName) or not isinstance(feature, str):
        return None
    seen = [look_at(world.town, place, row["x"], row["y"]) for row in world.landmarks(place)]
    stated = read_look(feature)
    if any(look is not None for look in seen):
        return bool(stated.stated) and any(look is not None and stated.fits(look) for look in seen)
    return feature in features_of(place)


def _passed(world: SessionWorld, said: Proposition, time: float, speaker: Role) -> bool | None:
    """Whether the car has come past a place on this trip; None where a number of times since the errand is stated."""
    place = said.get("place")
    if not isinstance(place, LandmarkName) or said.get("times") is not None:
        return None
    rows = world.session.trajectory
    driven = rows[rows["frame"] <= time * FRAME_RATE]
    near = [np.hypot(driven["x"] - row["x"], driven["y"] - row["y"]) <= _PASSING for row in world.landmarks(place)]
    return any(bool(each.any()) for each in near)


def _distance(world: SessionWorld, said: Proposition, time: float, speaker: Role) -> bool | None:
    """Whether the shortest route has about the stated length; detours around roadblocks are ignored."""
    place, metres = said.get("place"), said.get("metres")
    rows = world.landmarks(place) if isinstance(place, LandmarkName) else []
    if len(rows) != 1 or not isinstance(metres, int):
        return None
    way = world.way_to(time, rows[0])
    return abs(way - metres) <= max(_SHORT_WAY, _WAY_ERROR * way) if math.isfinite(way) else None


def _feels(world: SessionWorld, said: Proposition, time: float, speaker: Role) -> bool | None:
    """Whether the cause of a feeling holds; the feeling itself is the speaker's."""
    cause = said.get("cause")
    return is_true(world, cause, time, speaker) if isinstance(cause, Proposition) else None


def _arrives_in(world: SessionWorld, said: Proposition, time: float, speaker: Role) -> bool | None:
    place, seconds = said.get("place"), said.get("seconds")
    if not isinstance(place, LandmarkName) or not isinstance(seconds, int):
        return None
    arrival = world.arrival(time, place)
    return None if arrival is None else agrees(seconds, arrival - time)


def _close(world: SessionWorld, said: Proposition, time: float, speaker: Role) -> bool | None:
    place = said.get("place")
    rows = world.landmarks(place) if isinstance(place, LandmarkName) else []
    if len(rows) != 1:  # several houses: which one is meant is not known
        return None
    way = world.way_to(time, rows[0])
    return True if way <= CLOSE else False if way >= FAR else None


def _knows(world: SessionWorld, said: Proposition, time: float, speaker: Role) -> bool | None:
    place = said.get("place")
    rows = world.landmarks(place) if isinstance(place, LandmarkName) else []
    if not rows or speaker is not Role.CO_WIZARD:
        return None
    hidden = [row["hidden"] for row in rows]
    return None if any(hidden) and not all(hidden) else not any(hidden)


def _visibility(world: SessionWorld, said: Proposition, time: float, speaker: Role) -> bool | None:
    """Whether the range of sight, now or a moment ago, is long, or as long as stated."""
    metres, sights = said.get("metres"), [world.sight(time - shift) for shift in (0.0, 2.0, _NOW)]
    if isinstance(metres, int):
        return any(abs(metres - sight) <= max(_SIGHT_ERROR, 0.3 * sight) for sight in sights)
    if min(sights) < _POOR < max(sights):
        return None
    return True if min(sights) > _GOOD else False if max(sights) < _POOR else None


def _arrived(world: SessionWorld, said: Proposition, time: float, speaker: Role) -> bool | None:
    place = said.get("place")
    if not isinstance(place, LandmarkName):
        return None
    if speaker is Role.PARTICIPANT and len(world.landmarks(place)) > 1:
        return None  # several houses: the car may be at another one
    return world.arrived_at(time, place)


def _lights_on(world: SessionWorld, said: Proposition, time: float, speaker: Role) -> bool | None:
    """Whether the headlights are on; None if they have been switched since the question."""
    now, before = world.lights_on(time), world.lights_on(time - _NOW)
    return now if now is before else None


def _because(world: SessionWorld, said: Proposition, time: float, speaker: Role) -> bool | None:
    cause, effect, at = said.get("cause"), said.get("effect"), said.get("at")
    if not isinstance(cause, Proposition):
        return None
    when = float(at) if isinstance(at, int) else time
    return is_right_cause(world, cause, effect if isinstance(effect, Proposition) else None, when)


def _failed(world: SessionWorld, said: Proposition, time: float, speaker: Role) -> bool | None:
    """Whether a sensor, or any sensor, has failed or had failed until a moment ago: the effect of a fault fades."""
    sensor = said.get("sensor")
    asked = [sensor] if isinstance(sensor, Sensor) else list(Sensor)
    return any(world.failed(time - k, one) for one in asked for k in range(0, _FADING if not said.negated else 2, 2))


def _weather(world: SessionWorld, said: Proposition, time: float, speaker: Role) -> bool | None:
    """Whether a parameter is away from clear noon, or close to it."""
    parameter, high = said.get("parameter"), said.get("high")
    if not isinstance(parameter, WeatherParameter) or not isinstance(high, bool):
        return None
    span = parameter.high - parameter.low
    away = abs(world.weather(time, parameter) - parameter.clear_noon) / span
    return away > _CHANGED if high else away < 2.0 * _CHANGED


def _crowded(world: SessionWorld, said: Proposition, time: float, speaker: Role) -> bool | None:
    kind = said.get("object")
    actors = ACTORS.get(kind) if isinstance(kind, ObjectClass) else None
    return None if actors is None else world.count_near(time, actors, SIGHT / 2.0) >= _CROWD


_EVALUATORS: Final[dict[Predicate, Evaluator]] = {
    **plans.EVALUATORS,
    Predicate.SEES: _sees,
    Predicate.ON_STREET: _on_street,
    Predicate.LOCATED: _located,
    Predicate.NEAR: _near,
    Predicate.LOOKS: _looks,
    Predicate.DISTANCE: _distance,
    Predicate.PASSED: _passed,
    Predicate.FEELS: _feels,
    Predicate.ARRIVES_IN: _arrives_in,
    Predicate.CLOSE: _close,
    Predicate.KNOWS: _knows,
    Predicate.VISIBILITY: _visibility,
    Predicate.ARRIVED: _arrived,
    Predicate.BECAUSE: _because,
    Predicate.LIGHTS_ON: _lights_on,
    Predicate.STANDS: lambda world, said, time, speaker: world.stands(time),
    Predicate.FAILED: _failed,
    Predicate.WEATHER: _weather,
    Predicate.BLOCKED: lambda world, said, time, speaker: _blocked(world, said, time),
    Predicate.CROWDED: _crowded,
    Predicate.LOCALISED: lambda world, said, time, speaker: None if world.failed(time, Sensor.GPS) else True,
}


# --- causes -----------------------------------------------------------------------------------------------------------


def _red(world: SessionWorld, cause: Proposition, time: float) -> bool | None:
    label = ObjectClass.TRAFFIC_LIGHT.label
    shifts = (-_NOW, -2.0, 0.0)
    return label in world.hazards(time, _NOW) or any(world.light_is_red(time + shift) for shift in shifts)


_OBSTACLES: Final = {**ACTORS, ObjectClass.TRAFFIC_SIGN: ACTORS[ObjectClass.STATIC]}  # a sign on the road is a prop


def _hinders(world: SessionWorld, cause: Proposition, time: float) -> bool | None:
    """Whether the car brakes for a body, or stands right behind it and may thus have braked for another one."""
    kind = cause.get("object")
    if not isinstance(kind, ObjectClass):
        return None
    shifts = (-_NOW, -2.0, 0.0)
    in_front = any(world.is_ahead(time + shift, _OBSTACLES.get(kind, ()), _IN_FRONT, _AHEAD) for shift in shifts)
    return in_front or kind.label in world.hazards(time, 2.0 * _NOW)


def _told(world: SessionWorld, cause: Proposition, time: float) -> bool | None:
    action = cause.get("action")
    return world.told_to(time, action, _TOLD) if isinstance(action, ActionValue) else None


def _behind(world: SessionWorld, cause: Proposition, time: float) -> bool | None:
    place = cause.get("place")
    rows = world.landmarks(place) if isinstance(place, LandmarkName) else []
    bearings = [world.bearing(time + shift, row["x"], row["y"]) for row in rows for shift in (-8.0, -_NOW, 0.0)]
    return max(bearings) > 60.0 if bearings else None


def _blocked(world: SessionWorld, cause: Proposition, time: float) -> bool | None:
    nearest = min(world.distance_of(time + shift, ACTORS[ObjectClass.STATIC]) for shift in (-30.0, -15.0, -_NOW, 0.0))
    return math.isfinite(nearest) and nearest < SIGHT


def _impossible(world: SessionWorld, cause: Proposition, time: float) -> bool | None:
    """Whether the lane of the car ends ahead, where that keeps it from following the lane."""
    if cause.get("action") is not ActionValue.LANE_FOLLOW or not cause.negated:
        return None
    places = [world.place(time + shift) for shift in (-_NOW, -2.0, 0.0)]
    return any(
        not world.town.successors(lane) and world.town.lanes[lane].length - station < _END_IN_SIGHT
        for lane, station in places
    )


_CAUSES: Final[dict[Predicate, Callable[[SessionWorld, Proposition, float], bool | None]]] = {
    Predicate.RED: _red,
    Predicate.HINDERS: _hinders,
    Predicate.TOLD: _told,
    Predicate.BEHIND: _behind,
    Predicate.BLOCKED: _blocked,
    Predicate.POSSIBLE: _impossible,
    Predicate.ARRIVED: lambda world, cause, time: _arrived(world, cause, time, Role.CO_WIZARD),
    Predicate.GOAL: lambda world, cause, time: world.goal_named(time) and world.believed_goal(time) is not None,
}
