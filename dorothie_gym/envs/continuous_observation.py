"""Observation vector of `Navigation-continuous-v0`: the path, the car's place on it, and what is ahead."""

from __future__ import annotations

import math

import numpy as np

from dorothie_gym.ontology import ActionValue, ObjectClass, WeatherParameter
from dorothie_gym.policies.navigation.observation_vector import CLOSE, FAR, FAST, KINDS, HeardInstruction, Vector
from dorothie_gym.sim.state.records import plain
from dorothie_gym.sim.world import World
from dorothie_gym.spaces import ObjectColumn, Observation
from dorothie_gym.spaces.fields import share, signal, sizes

AHEAD = (2.0, 4.0, 7.0, 10.0, 14.0, 19.0, 25.0, 32.0, 40.0, 50.0)
"""Distances ahead of the path points in the vector [m]."""

REACH = 50.0
"""Unit of the positions of path points [m]."""

ASIDE = 4.0
"""Unit of the distance from the path [m]."""

NEAREST = 4
"""Number of objects in the vector, the nearest first."""

_WET = tuple(WeatherParameter).index(WeatherParameter.WETNESS)

CONTINUOUS_FIELD_SPECS = (
    signal("speed", 1, unit="25 m/s", meaning="speed of the car"),
    signal("controls", 3, meaning="throttle, steering angle (positive right) and brake in force"),
    signal("offset", 1, unit="4 m", meaning="lateral distance from the path, positive right"),
    signal("course", 2, meaning="sine and cosine of the angle from the path to the heading, positive right"),
    signal(
        "path",
        2 * len(AHEAD),
        unit="50 m",
        meaning=f"points of the path {', '.join(f'{ahead:g}' for ahead in AHEAD)} m ahead: "
        "longitudinal and lateral position relative to the car, positive right",
    ),
    share("allowed", 1 + len(AHEAD), unit="25 m/s", meaning="permitted speed here and at each point of the path"),
    signal("room", 1, unit="100 m", meaning="remaining path before a junction without instruction; 1 for no such end"),
    signal(
        "obstacle",
        4,
        unit="1, 100 m, 25 m/s, 1",
        meaning="1 if something is ahead; its distance; its speed; 1 if it is a stop line",
    ),
    signal("stop", 3, unit="1, 100 m, 10 m", meaning="1 if the car is to stop; remaining distance in two units"),
    signal(
        "objects",
        NEAREST * (4 + len(KINDS)),
        unit="50 m, 1, 1, 25 m/s, 1",
        meaning="for each object: distance, sine and cosine of the bearing, speed, one-hot class "
        "(vehicle, pedestrian, static)",
    ),
    share("wetness", 1, meaning="wetness of the road"),
    share("time", 1, meaning="elapsed share of the time limit"),
)
"""Fields of the observation vector, in order. Values are clipped to their range; units are scales of normalised values.
"""

CONTINUOUS_FIELDS = sizes(CONTINUOUS_FIELD_SPECS)
"""Sizes of the fields by name, in order."""


def observe_continuous(world: World, seen: Observation, heard: HeardInstruction, max_seconds: float) -> Vector:
    """Encodes the observation of a driver.

    Args:
        world: the car and its path.
        seen: observation of the Co-Wizard.
        heard: last instruction.
        max_seconds: time limit [s].

    Returns:
        Vector (n,) in [-1, 1], see `CONTINUOUS_FIELDS`.
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
