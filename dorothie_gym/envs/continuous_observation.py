"""What a driver with pedals and a steering wheel observes: the path, where the car is on it, what is in the way."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from dorothie_gym.ontology import ActionValue, ObjectClass, WeatherParameter
from dorothie_gym.policies.navigation.observation_vector import CLOSE, FAR, FAST, KINDS, HeardInstruction, Vector
from dorothie_gym.sim.state.records import plain
from dorothie_gym.sim.world import World
from dorothie_gym.spaces import ObjectColumn, Observation

AHEAD = (2.0, 4.0, 7.0, 10.0, 14.0, 19.0, 25.0, 32.0, 40.0, 50.0)
"""Points of the path are shown this far ahead [m]."""

REACH = 50.0
"""Their places are shares of this [m]."""

ASIDE = 4.0
"""The distance from the path is a share of this [m]."""

NEAREST = 4
"""Bodies that are shown, the nearest first."""

_WET = tuple(WeatherParameter).index(WeatherParameter.WETNESS)

CONTINUOUS_FIELDS: Mapping[str, int] = MappingProxyType(
    {
        "speed": 1,  # of FAST
        "controls": 3,  # throttle, steer and brake as they are
        "offset": 1,  # how far the car is to the right of the path, of ASIDE
        "course": 2,  # sine and cosine of the angle from the path to the car's heading, positive right
        "path": 2 * len(AHEAD),  # points ahead in the car's frame: ahead and to the right, of REACH
        "allowed": 1 + len(AHEAD),  # speed that curves, limits and the end of the path allow here and there, of FAST
        "room": 1,  # path that is left before a junction where no way was told, of FAR; 1 if it goes on
        "obstacle": 4,  # whether something is in the way, how far, of FAR, its speed, of FAST; whether it is a line
        "stop": 3,  # whether the car is to stop, what is left of the way to there, of FAR and of CLOSE
        "objects": NEAREST * (4 + len(KINDS)),  # distance [50 m], sine and cosine of bearing, speed, one-hot class
        "wetness": 1,  # of the road
        "time": 1,  # share of the time there is
    }
)
"""Fields of the observation and their sizes, in order; shares are clipped to -1..1."""


def observe_continuous(world: World, seen: Observation, heard: HeardInstruction, max_seconds: float) -> Vector:
    """The observation of a driver with pedals.

    Args:
        world: the car and its path; the path ahead and what is in the way are seen from the car.
        seen: what the Co-Wizard observes.
        heard: what it remembers of what was said.
        max_seconds: time there is [s].

    Returns:
        Numbers (n,) within -1 and 1, see `CONTINUOUS_FIELDS`.
    """
    car, planner = world.car, world.planner
    control = car.control
    course = float(car.heading) - planner.path.heading_at(planner.s)
    waits = planner.waits_at_end
    values = [
        float(car.speed) / FAST,
        control.throttle,
        control.steer,
        control.brake,
        planner.offset / ASIDE,
        math.sin(course),
        math.cos(course),
        *_path(world),
        *(world.ego.speed_at(min(planner.s + ahead, planner.path.length)) / FAST for ahead in (0.0, *AHEAD)),
        min(planner.room / FAR, 1.0) if waits else 1.0,
        *_obstacle(world),
        *_stop(heard),
        *_objects(seen),
        float(seen["weather"][_WET]) / 100.0,
        float(seen["time"][0]) / max_seconds,
    ]
    observation = np.array(values, dtype=np.float32)
    return np.minimum(np.maximum(observation, -1.0, out=observation), 1.0, out=observation)


def _path(world: World) -> list[float]:
    planner = world.planner
    x, y = (float(value) for value in world.car.position)
    sine, cosine = math.sin(world.car.heading), math.cos(world.car.heading)
    values = []
    for ahead in AHEAD:
        px, py = planner.path.position_at(min(planner.s + ahead, planner.path.length))
        dx, dy = px - x, py - y
        values += [(dx * cosine + dy * sine) / REACH, (dy * cosine - dx * sine) / REACH]
    return values


def _obstacle(world: World) -> list[float]:
    record = plain(world.actors.arrays.car)[0]
    if not record["kind"]:
        return [0.0] * 4
    return [1.0, float(record["gap"]) / FAR, float(record["ahead_speed"]) / FAST, float(record["line"])]


def _stop(heard: HeardInstruction) -> list[float]:
    told = heard.instruction
    if told is None or told.action is not ActionValue.STOP:
        return [0.0] * 3
    left = told.distance - heard.driven
    return [1.0, left / FAR, left / CLOSE]


def _objects(seen: Observation) -> list[float]:
    values: list[float] = []
    for row in seen["objects"][:NEAREST].tolist():
        if not row[ObjectColumn.KIND]:
            break
        kind, bearing = ObjectClass(int(row[ObjectColumn.KIND])), row[ObjectColumn.BEARING]
        values += (row[ObjectColumn.DISTANCE] / 50.0, math.sin(bearing), math.cos(bearing))
        values += (row[ObjectColumn.SPEED] / FAST, *(float(kind is known) for known in KINDS))
    return values + [0.0] * (CONTINUOUS_FIELDS["objects"] - len(values))
