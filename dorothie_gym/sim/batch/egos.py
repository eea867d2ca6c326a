"""Decisions of many egos at once, each the first vehicle of its world: actions, substeps, observations."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from highway_env.vehicle.controller import ControlledVehicle
from highway_env.vehicle.kinematics import Vehicle
from numpy.typing import NDArray

from dorothie_gym import portable_math as pm
from dorothie_gym.compilation import compiled, concurrent, inlined
from dorothie_gym.compilation.by_reference import by_reference
from dorothie_gym.compilation.records import Flag, Float, Int32, RecordArray
from dorothie_gym.maps.model import Array
from dorothie_gym.sim.batch.threads import take
from dorothie_gym.sim.batch.worlds import world_of
from dorothie_gym.sim.network.lane_lookup import project, value_near
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.randomness import choose
from dorothie_gym.sim.state.body_records import MovingBody, PlacedBody, VehicleRecord
from dorothie_gym.sim.state.codes import Kind, Walk
from dorothie_gym.sim.step import step_around, update_lane
from dorothie_gym.sim.traffic.parameters import AFTER_END, CAR_LENGTH, MAX_SPEED
from dorothie_gym.sim.traffic.vehicle_models import slip_towards, steering_angle

if TYPE_CHECKING:
    from dorothie_gym.sim.state.town_arrays import TownArrays
    from dorothie_gym.sim.state.world_arrays import WorldArrays


KP_SPEED = float(ControlledVehicle.KP_A)
"""Gain from the error of speed to the acceleration [1/s]."""

MIN_SPEED = float(Vehicle.MIN_SPEED)
"""[m/s]."""

REACHABLE = 2.0
"""Distance to the middle of a lane, in its widths, up to which an ego changes to it."""

NOTHING, LEFT, IDLE, RIGHT, FASTER, SLOWER = range(-1, 5)
"""Meta actions, as `DiscreteMetaAction.ACTIONS_ALL` numbers them, and none at all."""


class HelmRecord:
    """Targets and present action of an ego."""

    target_speed: Float  # [m/s]
    acceleration: Float  # [m/s^2]
    steering: Float  # [rad]
    lowest: Float  # speeds beyond which it no longer accelerates [m/s]
    highest: Float
    lane: Int32  # target lane


def lanes_beside(network: TownNetwork) -> NDArray[np.int32]:
    """Returns the lanes left and right of each lane (lanes, 2) in highway-env's graph; at the edge the lane itself."""
    beside = np.empty((len(network.town.lanes), 2), dtype=np.int32)
    for start, end, place in network.lanes_dict():
        edge = network.graph[start][end]
        for side, number in enumerate((max(place - 1, 0), min(place + 1, len(edge) - 1))):
            beside[network.lane_id((start, end, place)), side] = network.lane_id((start, end, number))
    return beside


@compiled
def take_helm(vehicle: VehicleRecord, helm: HelmRecord, speeds: Array) -> None:
    """Initialises the targets: the closest lane, and the possible speed that is closest to the present one."""
    helm.lane = vehicle.lane
    helm.acceleration, helm.steering = 0.0, 0.0
    helm.lowest, helm.highest = MIN_SPEED, MAX_SPEED
    if len(speeds):
        helm.target_speed = speeds[speed_index(speeds, vehicle.speed)]


@compiled
def speed_index(speeds: Array, speed: float) -> int:
    """Returns the index of the closest of some evenly spaced speeds: `MDPVehicle.speed_to_index`."""
    last = len(speeds) - 1
    share = (speed - speeds[0]) / (speeds[last] - speeds[0])
    return int(min(max(round(share * last), 0), last))


@compiled
def decide(
    town: TownArrays, beside: NDArray[np.int32], vehicle: VehicleRecord, helm: HelmRecord, speeds: Array, action: int
) -> None:
    """Takes a meta action: `MDPVehicle.act` with one.

    Args:
        town: arrays of the town.
        beside: see `lanes_beside`.
        vehicle: the ego.
        helm: its targets.
        speeds: that it may hold, evenly spaced [m/s].
        action: the meta action.
    """
    if action == FASTER or action == SLOWER:
        index = speed_index(speeds, vehicle.speed) + (1 if action == FASTER else -1)
        helm.target_speed = speeds[min(max(index, 0), len(speeds) - 1)]
    _follow_road(town, vehicle, helm)
    if action == LEFT or action == RIGHT:
        lane = beside[helm.lane, 0 if action == LEFT else 1]
        if is_reachable(town, lane, vehicle):
            helm.lane = lane


@compiled
def is_reachable(town: TownArrays, lane: int, vehicle: VehicleRecord) -> bool:
    """Returns whether a vehicle may change to a lane: `AbstractLane.is_reachable_from`."""
    station, lateral, segment = project(town, lane, vehicle.x, vehicle.y)
    if not 0.0 <= station < town.lanes[lane].length + CAR_LENGTH:
        return False
    return bool(abs(lateral) <= REACHABLE * value_near(town.points, town.lanes[lane], segment, 5, station))


@inlined
def control(town: TownArrays, vehicle: VehicleRecord, helm: HelmRecord) -> None:
    """Steers towards the target lane and accelerates to the target speed: `MDPVehicle.act` without an action."""
    station, lateral, segment = _follow_road(town, vehicle, helm)
    slip = slip_towards(town.points, town.lanes[helm.lane], vehicle, segment, station, lateral)
    helm.steering = steering_angle(slip)
    helm.acceleration = KP_SPEED * (helm.target_speed - vehicle.speed)


@inlined
def move(vehicle: VehicleRecord, helm: HelmRecord, pose: Array, dt: float) -> None:
    """Writes where it is after a time [s], as `Vehicle.step`: x, y, heading and speed (4,)."""
    speed, heading = vehicle.speed, vehicle.heading
    if vehicle.crashed:
        helm.acceleration, helm.steering = -speed, 0.0
    if speed > helm.highest:
        helm.acceleration = min(helm.acceleration, helm.highest - speed)
    elif speed < helm.lowest:
        helm.acceleration = max(helm.acceleration, helm.lowest - speed)
    slip = pm.atan(0.5 * pm.tan(helm.steering))
    pose[0] = vehicle.x + speed * pm.cos(heading + slip) * dt
    pose[1] = vehicle.y + speed * pm.sin(heading + slip) * dt
    pose[2] = heading + speed * pm.sin(slip) / (CAR_LENGTH / 2.0) * dt
    pose[3] = speed + helm.acceleration * dt


@compiled
def _follow_road(town: TownArrays, vehicle: VehicleRecord, helm: HelmRecord) -> tuple[float, float, int]:
    """Moves on to a next lane at the end of the target lane; returns the place on the target lane, as `project`."""
    station, lateral, segment = project(town, helm.lane, vehicle.x, vehicle.y)
    lane = town.lanes[helm.lane]
    if station <= lane.length - AFTER_END or lane.successors == 0:
        return station, lateral, segment
    way = choose(vehicle, lane.successors) if lane.successors > 1 else 0
    helm.lane = town.neighbours[lane.successor + way]
    return project(town, helm.lane, vehicle.x, vehicle.y)


@compiled
def speed_along(town: TownArrays, vehicle: VehicleRecord) -> float:
    """Returns the speed along the closest lane [m/s], 0 off the road (`RoadObject.on_road`)."""
    lane, station = town.lanes[vehicle.lane], vehicle.own_station
    if not -CAR_LENGTH <= station < lane.length + CAR_LENGTH:
        return 0.0
    if abs(vehicle.own_lateral) > 0.5 * value_near(town.points, lane, lane.first, 5, station):
        return 0.0
    return float(vehicle.speed * pm.cos(value_near(town.points, lane, lane.first, 3, station) - vehicle.heading))


# --- Observation ------------------------------------------------------------------------------------------------------

PRESENCE, X, Y, VX, VY, HEADING, COS, SIN = range(8)

FEATURES = {
    "presence": PRESENCE, "x": X, "y": Y, "vx": VX, "vy": VY, "heading": HEADING, "cos_h": COS, "sin_h": SIN,
}  # fmt: skip
"""Features by highway-env's names."""

PERCEIVED = 5.0 * MAX_SPEED
"""Range of the observation [m], `AbstractEnv.PERCEPTION_DISTANCE`."""

OBSERVED_BEHIND = 2.0 * CAR_LENGTH
"""Range of the observation behind without `see_behind` [m], `Road.close_objects_to`."""


@by_reference
class View(NamedTuple):
    """Settings of the observation.

    Attributes:
        features: int32 (f,) codes of the columns.
        absolute: whether others are observed in absolute coordinates, not relative to the observer.
        ordered: whether the closest ones along the lane come first; otherwise in the order of their numbers.
        behind: whether those far behind are seen.
        clip: whether normalised values are kept in [-1, 1].
        walkers: whether pedestrians are seen, too.
    """

    features: NDArray[np.int32]
    absolute: bool
    ordered: bool
    behind: bool
    clip: bool
    walkers: bool


@compiled
def observe(
    town: TownArrays, world: WorldArrays, view: View, ranges: Array, nearest: NDArray[np.int32], distances: Array,
    rows: NDArray[np.float32],
) -> None:  # fmt: skip
    """Writes the observation of the first vehicle of a world: itself in the first row, then others, then zeros.

    Args:
        town: arrays of the town.
        world: arrays of the world.
        view: settings of the observation.
        ranges: (f, 2) values of each feature that become -1 and 1; NaN where it is not normalised.
        nearest: int32 (n,) scratch, with `distances`.
        distances: (n,) see there.
        rows: float32 (n, f), written to.
    """
    count = _find_nearest(town, world, view, nearest, distances, len(rows) - 1)
    vehicles = len(world.vehicles)
    for k in range(len(rows)):
        body = 0 if k == 0 else nearest[k - 1]
        for f in range(len(view.features)):
            feature, value = view.features[f], 0.0
            if k <= count:
                if body < vehicles:
                    value = _feature(world.vehicles[body], feature)
                else:
                    value = _feature(world.pedestrians[body - vehicles], feature)
                if k > 0 and not view.absolute and X <= feature <= VY:
                    value -= _feature(world.vehicles[0], feature)
                low, high = ranges[f, 0], ranges[f, 1]
                if not math.isnan(low):
                    value = -1.0 + (value - low) * 2.0 / (high - low)
                    value = min(max(value, -1.0), 1.0) if view.clip else value
            rows[k, f] = value


@compiled
def _find_nearest(
    town: TownArrays, world: WorldArrays, view: View, nearest: NDArray[np.int32], distances: Array, room: int
) -> int:
    """Lists the bodies that the first vehicle observes, as many as there is room for; returns their number.

    `Road.close_objects_to`: vehicles before pedestrians where distances are equal, and of these only those ahead.
    """
    vehicles, walkers = world.vehicles, world.pedestrians
    count = 0
    for i in range(1, len(vehicles)):
        if vehicles[i].kind != Kind.EMPTY:
            ahead = _ahead(town, vehicles[0], vehicles[i])
            if view.behind or ahead > -OBSERVED_BEHIND:
                count = _list(view, i, ahead, nearest, distances, count, room)
    for p in range(len(walkers) if view.walkers else 0):
        if walkers[p].state != Walk.EMPTY:
            ahead = _ahead(town, vehicles[0], walkers[p])
            if ahead > -OBSERVED_BEHIND:
                count = _list(view, len(vehicles) + p, ahead, nearest, distances, count, room)
    return count


@inlined
def _ahead(town: TownArrays, observer: VehicleRecord, other: PlacedBody) -> float:
    """Returns the distance along the observer's lane to another body [m]; NaN out of range."""
    dx, dy = other.x - observer.x, other.y - observer.y
    if dx * dx + dy * dy >= PERCEIVED * PERCEIVED:
        return math.nan
    station, _, _ = project(town, observer.lane, other.x, other.y)
    return float(station - observer.own_station)


@inlined
def _list(
    view: View, body: int, ahead: float, nearest: NDArray[np.int32], distances: Array, count: int, room: int
) -> int:
    """Inserts a body into the list, behind those that are as close; returns the list's length."""
    if math.isnan(ahead):
        return count
    distance = abs(ahead) if view.ordered else 0.0
    at = count
    while at > 0 and distances[at - 1] > distance:
        if at < room:
            nearest[at], distances[at] = nearest[at - 1], distances[at - 1]
        at -= 1
    if at < room:
        nearest[at], distances[at] = body, distance
        count = min(count + 1, room)
    return count


@inlined
def _feature(vehicle: MovingBody, feature: int) -> float:
    if feature == X:
        return float(vehicle.x)
    if feature == Y:
        return float(vehicle.y)
    if feature == VX:
        return float(vehicle.speed * vehicle.cos)
    if feature == VY:
        return float(vehicle.speed * vehicle.sin)
    if feature == HEADING:
        return float(vehicle.heading)
    if feature == COS:
        return float(vehicle.cos)
    return float(vehicle.sin) if feature == SIN else 1.0


# --- Decisions --------------------------------------------------------------------------------------------------------


class OutcomeRecord:
    """State of an ego after a decision: its speed, the speed along its lane (0 off the road) [m/s], and crashes."""

    speed: Float
    along: Float
    crashed: Flag


@by_reference
class Egos(NamedTuple):
    """The egos of a batch of worlds; all but `beside`, `speeds` and `rows` have a row for each world.

    Attributes:
        beside: see `lanes_beside`.
        speeds: possible target speeds [m/s]; empty for egos with continuous actions.
        rows: int64 (1,) the row of an ego in its world.
        poses: (worlds, 1, 4) scratch: their next poses.
        helms: `HelmRecord`.
        ranges: (worlds, f, 2) see `observe`.
        nearest: int32 (worlds, n) scratch, with `distances`.
        distances: (worlds, n) see there.
        observations: float32 (worlds, n, f).
        outcomes: `OutcomeRecord`.
    """

    beside: NDArray[np.int32]
    speeds: Array
    rows: NDArray[np.int64]
    poses: Array
    helms: RecordArray[HelmRecord]
    ranges: Array
    nearest: NDArray[np.int32]
    distances: Array
    observations: NDArray[np.float32]
    outcomes: RecordArray[OutcomeRecord]


@concurrent
def begin_one(number: int, town: TownArrays, batch: WorldArrays, view: View, egos: Egos) -> None:
    """Initialises the targets of an ego in its world, and observes.

    Args:
        number: of the world.
        town: arrays of the town.
        batch: arrays of all worlds.
        view: settings of the observation.
        egos: the egos of all worlds.
    """
    vehicle = world_of(batch, number).vehicles[0]
    update_lane(town, vehicle)
    take_helm(vehicle, egos.helms[number], egos.speeds)
    _report(number, town, batch, view, egos)


@concurrent
def play_share(
    turns: NDArray[np.int64], home: int, town: TownArrays, batch: WorldArrays, view: View, egos: Egos,
    actions: NDArray[np.int32], playing: NDArray[np.bool_], substeps: int, dt: float,
) -> None:  # fmt: skip
    """Plays a decision in worlds, until all worlds of the batch have been taken.

    Args:
        turns: numbers of the worlds, see `threads.take`; shared by all threads that work on them.
        home: number of the block that is this thread's own.
        town: arrays of the town.
        batch: arrays of all worlds.
        view: settings of the observation.
        egos: the egos of all worlds.
        actions: int32 (worlds,) meta actions.
        playing: (worlds,) worlds that are stepped at all.
        substeps: number of substeps.
        dt: time of each [s].
    """
    number = take(turns, home)
    while number >= 0:
        if playing[number]:
            _play(number, town, batch, view, egos, actions[number], substeps, dt)
        number = take(turns, home)


@inlined
def _play(
    number: int, town: TownArrays, batch: WorldArrays, view: View, egos: Egos, action: int, substeps: int, dt: float
) -> None:
    """Plays a decision in one world."""
    world, helm, poses = world_of(batch, number), egos.helms[number], egos.poses[number]
    vehicle = world.vehicles[0]
    meta = len(egos.speeds) > 0
    if meta and action != NOTHING:
        decide(town, egos.beside, vehicle, helm, egos.speeds, action)
    for _ in range(substeps):
        if meta:
            control(town, vehicle, helm)
        move(vehicle, helm, poses[0], dt)
        step_around(town, world, dt, egos.rows, poses)
    _report(number, town, batch, view, egos)


@compiled
def _report(number: int, town: TownArrays, batch: WorldArrays, view: View, egos: Egos) -> None:
    world, outcome = world_of(batch, number), egos.outcomes[number]
    vehicle = world.vehicles[0]
    outcome.speed, outcome.crashed = vehicle.speed, vehicle.crashed
    outcome.along = speed_along(town, vehicle)
    observe(
        town, world, view, egos.ranges[number], egos.nearest[number], egos.distances[number], egos.observations[number]
    )
