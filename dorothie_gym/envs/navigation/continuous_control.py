"""Driving with throttle, steering and brake (compiled): instructed manoeuvres, new paths, observation vector."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from dorothie_gym.ontology.slots import ActionValue
from dorothie_gym.ontology.world_exceptions import WeatherParameter
from dorothie_gym.policies.navigation.actions import LEFT, RIGHT
from dorothie_gym.policies.navigation.observation_fields import (
    CLOSE_UNIT,
    DISTANCE_UNIT,
    KINDS,
    SECTORS,
    SPEED_UNIT,
    Vector,
)
from dorothie_gym.policies.navigation.observation_vector import put
from dorothie_gym.session.spaces.fields import share, signal, sizes
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.sim.ego.limits import KMH
from dorothie_gym.sim.ego.manoeuvres import begin, plan_u_turn
from dorothie_gym.sim.ego.path_builder import point_before
from dorothie_gym.sim.network.lane_lookup import wrap_radians
from dorothie_gym.sim.sensing.perception import see
from dorothie_gym.sim.state.codes import J_TURN, LANE_SWITCH, U_TURN, Refusal
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import compiled, inlined

if TYPE_CHECKING:
    from dorothie_gym.policies.navigation.driver_view import DriverArrays, DriverView, HeardRecord
    from dorothie_gym.policies.navigation.junction_exits import ExitArrays
    from dorothie_gym.sim.state.town_arrays import TownArrays
    from dorothie_gym.sim.state.world_arrays import WorldArrays

AHEAD: Final = (2.0, 4.0, 7.0, 10.0, 14.0, 19.0, 25.0, 32.0, 40.0, 50.0)
"""Distances ahead of the path points in the vector [m]."""

PATH_UNIT: Final = 50.0
"""Unit of the positions of path points [m]."""

OFFSET_UNIT: Final = 4.0
"""Unit of the distance from the path [m]."""

OBJECT_UNIT: Final = 50.0
"""Unit of the distances of objects [m]."""

OBSERVED_OBJECTS: Final = 4
"""Number of objects in the vector, the nearest first."""

LOST: Final = 4.0
"""Distance from the path beyond which a new path from the current lane is planned [m]."""

END: Final = 2.0
"""Distance to the end of the path within which a new one is planned [m]."""

PREPARED_UNTIL: Final = 5.0
"""Distance past its planned place beyond which a manoeuvre is no longer prepared [m]."""

_WET = tuple(WeatherParameter).index(WeatherParameter.WETNESS)
_KINDS = tuple(int(kind.value) for kind in KINDS)
_STOPPING, _TURNING, _SWITCHING, _TURNING_ROUND = (
    int(value.value) for value in (ActionValue.STOP, ActionValue.J_TURN, ActionValue.LANE_SWITCH, ActionValue.U_TURN)
)

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
        OBSERVED_OBJECTS * (4 + len(KINDS)),
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


# --- Manoeuvres and paths ---------------------------------------------------------------------------------------------


@compiled
def instructed_manoeuvre(
    town: TownArrays, exits: ExitArrays, world: WorldArrays, driver: DriverArrays
) -> tuple[int, int]:
    """Returns the manoeuvre of the last instruction: number of a `PhysicalAction`, or 0, and its angle [degrees].

    0 for an instruction without a manoeuvre, or whose manoeuvre is already part of the path or infeasible.
    """
    heard, plan = driver.heard[0], world.plan[0]
    order = 0
    if heard.action == _TURNING:
        order = J_TURN
    elif heard.action == _SWITCHING:
        order = LANE_SWITCH
    elif heard.action == _TURNING_ROUND:
        order = U_TURN
    if order == 0 or plan.off_line or heard.distance - heard.driven < -PREPARED_UNTIL:
        return 0, 0
    if order == J_TURN:
        if heard.sector < 0 or plan.choice < 0 or exits.lane[plan.choice, heard.sector] < 0:
            return 0, 0
        angle = int(exits.angle[plan.choice, heard.sector])
        return (0, 0) if plan.turning and plan.angle == angle else (order, angle)
    if plan.action == order:
        return 0, 0
    if order == LANE_SWITCH:
        return (order, LEFT if SECTORS[heard.sector] > 0 else RIGHT) if heard.sector >= 0 else (0, 0)
    innermost = town.lanes[plan.lane].inner < 0
    may = innermost and plan_u_turn(town, world, world.vehicles[0].speed)[0] == Refusal.NONE
    return (order, 0) if may else (0, 0)


@compiled
def has_lost_path(world: WorldArrays) -> bool:
    """Returns whether the ego has left its path, or reached the end of a path that could continue."""
    plan, car = world.plan[0], world.car[0]
    return bool(abs(car.offset) > LOST or (plan.length - car.s < END and not plan.open_end))


@compiled
def find_path(town: TownArrays, world: WorldArrays) -> int:
    """Lays a new path from the ego's lane; returns `Refusal.NONE` or `Refusal.NO_SPACE`."""
    ego = world.vehicles[0]
    station = min(max(ego.own_station, 0.0), town.lanes[ego.lane].length)
    return begin(town, world, int(ego.lane), station, ego.own_lateral)


# --- Observation ------------------------------------------------------------------------------------------------------


@compiled
def observe_path(world: WorldArrays, driver: DriverArrays, max_seconds: float) -> None:
    """Writes the observation vector of a driver with continuous control, see `CONTINUOUS_FIELDS`.

    Args:
        world: arrays of the world.
        driver: arrays of the driver, of which weather and instruction are read; `vector` is written.
        max_seconds: time limit of the session [s].
    """
    ego, car, plan, vector = world.vehicles[0], world.car[0], world.plan[0], driver.vector
    vector[:] = 0.0
    k = put(vector, 0, ego.speed / SPEED_UNIT)
    for value in (car.throttle, car.steer, car.brake, car.offset / OFFSET_UNIT):
        k = put(vector, k, value)
    heading = _interpolated(world, car.s)[2]
    k = put(vector, k, pm.sin(ego.heading - heading))
    k = put(vector, k, pm.cos(ego.heading - heading))
    sine, cosine = pm.sin(ego.heading), pm.cos(ego.heading)
    for ahead in AHEAD:
        x, y, _ = _interpolated(world, min(car.s + ahead, plan.length))
        dx, dy = x - ego.x, y - ego.y
        k = put(vector, k, (dx * cosine + dy * sine) / PATH_UNIT)
        k = put(vector, k, (dy * cosine - dx * sine) / PATH_UNIT)
    k = put(vector, k, _allowed_speed(world, min(car.s, plan.length)) / SPEED_UNIT)
    for ahead in AHEAD:
        k = put(vector, k, _allowed_speed(world, min(car.s + ahead, plan.length)) / SPEED_UNIT)
    k = put(vector, k, (plan.length - car.s) / DISTANCE_UNIT if plan.open_end else 1.0)
    if car.kind > 0:
        vector[k] = 1.0
        put(vector, k + 1, car.gap / DISTANCE_UNIT)
        put(vector, k + 2, car.ahead_speed / SPEED_UNIT)
        vector[k + 3] = 1.0 if car.line else 0.0
    k = _encode_stop(driver.heard[0], vector, k + 4)
    k = _encode_objects(world, vector, k)
    view: DriverView = driver.inputs[0]
    k = put(vector, k, view.weather[_WET] / 100.0)
    put(vector, k, world.clock[0].frame / FRAME_RATE / max_seconds)


@inlined
def _encode_stop(heard: HeardRecord, vector: Vector, k: int) -> int:
    if heard.action == _STOPPING:
        left = heard.distance - heard.driven
        vector[k] = 1.0
        put(vector, k + 1, left / DISTANCE_UNIT)
        put(vector, k + 2, left / CLOSE_UNIT)
    return k + 3


@inlined
def _encode_objects(world: WorldArrays, vector: Vector, k: int) -> int:
    ego, size = world.vehicles[0], 4 + len(_KINDS)
    count = see(
        world.vehicles, world.pedestrians, world.props, world.seen, world.eye[0], ego.x, ego.y, world.clock[0].frame, 0
    )
    for row in range(min(count, OBSERVED_OBJECTS)):
        body, at = world.seen[row], k + row * size
        dx, dy = body.x - ego.x, body.y - ego.y
        bearing = wrap_radians(pm.atan2(dy, dx) - ego.heading)
        at = put(vector, at, math.sqrt(dx * dx + dy * dy) / OBJECT_UNIT)
        at = put(vector, at, pm.sin(bearing))
        at = put(vector, at, pm.cos(bearing))
        at = put(vector, at, body.speed / SPEED_UNIT)
        for n in range(len(_KINDS)):
            if body.kind == _KINDS[n]:
                vector[at + n] = 1.0
    return k + OBSERVED_OBJECTS * size


@compiled
def _interpolated(world: WorldArrays, s: float) -> tuple[float, float, float]:
    """Returns position [m] and direction [rad] of the path at a distance along it [m], as `Path` does."""
    course = world.course
    k = min(point_before(world, s), int(world.plan[0].points) - 2)
    one, other = course[k], course[k + 1]
    t = min(max((s - one.s) / (other.s - one.s), 0.0), 1.0)
    x, y = one.x + t * (other.x - one.x), one.y + t * (other.y - one.y)
    return x, y, one.heading + t * (other.heading - one.heading)


@compiled
def _allowed_speed(world: WorldArrays, s: float) -> float:
    """Returns the speed that the path allows at a distance along it [m/s]; before the first step, the cruise speed."""
    plan, course = world.plan[0], world.course
    if plan.written == 0:
        return float(plan.cruise * KMH)
    k = point_before(world, s)
    one = course[k]
    if k == plan.points - 1 or s <= one.s:
        return float(one.speed)
    other = course[k + 1]
    return float((other.speed - one.speed) / (other.s - one.s) * (s - one.s) + one.speed)
