"""Substeps of a world, and of a share of the worlds of a batch: all of a decision in one compiled call."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.sim.batch.threads import take
from dorothie_gym.sim.collisions import collide
from dorothie_gym.sim.ego.decision_setup import prepare
from dorothie_gym.sim.ego.manoeuvres import note_place
from dorothie_gym.sim.ego.motion_control import guide
from dorothie_gym.sim.pedestrians.walking import walk
from dorothie_gym.sim.sensing.localizer import localize
from dorothie_gym.sim.state.codes import NO_SPACE, Kind, Refusal, Wait
from dorothie_gym.sim.state.world_arrays import note_pose, trace, world_of
from dorothie_gym.sim.traffic.idm_traffic import drive
from dorothie_gym.sim.traffic.lane_index import rebuild
from dorothie_gym.sim.traffic.parameters import TRAFFIC_STANDING
from dorothie_gym.sim.traffic.respawn import tow
from dorothie_gym.sim.traffic.vehicle_models import move, slip_of, update_lane
from dorothie_gym.sim.traffic_rules import watch
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import compiled, concurrent, inlined

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.sim.state.records import VehicleRecord
    from dorothie_gym.sim.state.town_arrays import TownArrays
    from dorothie_gym.sim.state.world_arrays import WorldArrays


@compiled
def step(
    town: TownArrays, world: WorldArrays, substeps: int, dt: float, acceleration: float = 0.0, steering: float = 0.0
) -> int:
    """Steps a world; then localizes the ego that follows a path, if there is one, and watches over its driving.

    As on a highway-env road, all bodies decide by the state at the start of a substep, then all move. The path of
    an ego with a plan is lengthened before.

    Args:
        town: arrays of the town.
        world: arrays of the world, changed in place.
        substeps: number of substeps.
        dt: time of each [s].
        acceleration: acceleration of vehicles of the kind `Kind.EGO` [m/s^2].
        steering: angle of their front wheels, positive to the right [rad].

    Returns:
        `Refusal.NONE`, or `Refusal.NO_SPACE` where the arrays have no room for the path; then nothing has changed.
    """
    vehicles, slip = world.vehicles, slip_of(steering)
    driven = len(vehicles) > 0 and vehicles[0].kind == Kind.DRIVEN
    planned = driven and world.plan[0].version > 0
    if planned and prepare(town, world) != Refusal.NONE:
        return Refusal.NO_SPACE
    world.car[0].events = world.car[0].breaches = world.car[0].frames = 0
    if driven:
        note_pose(world, 0)
    for _ in range(substeps):
        for i in range(len(vehicles)):
            if vehicles[i].kind == Kind.EGO:
                vehicles[i].acceleration, vehicles[i].slip = acceleration, slip
        _decide(town, world, dt)
        _move(town, world, dt, True)
        _meet(town, world, dt, True)
        world.clock[0].time = world.clock[0].frame * dt
        if driven:
            trace(world)
    if planned:
        note_place(town, world)
    if driven:
        localize(world, dt)
        watch(town, world)
    return Refusal.NONE


@concurrent
def step_share(
    turns: NDArray[np.int64],
    home: int,
    town: TownArrays,
    batch: WorldArrays,
    substeps: int,
    dt: float,
    acceleration: Array,
    steering: Array,
    answers: NDArray[np.int64],
) -> None:
    """Steps worlds of a batch, until all of them have been taken.

    Args:
        turns: numbers of the worlds, see `threads.take`; shared by all threads that work on the batch.
        home: number of the block that is this thread's own.
        town: arrays of the town.
        batch: arrays of all worlds.
        substeps: number of substeps.
        dt: time of each [s].
        acceleration: (worlds,) of each world's vehicles of the kind `Kind.EGO` [m/s^2].
        steering: (worlds,) angle of their front wheels, positive to the right [rad].
        answers: (worlds,) `Refusal.NO_SPACE` for worlds that must be stepped; replaced by the answers of `step`.
    """
    number = take(turns, home)
    while number >= 0:
        if answers[number] == NO_SPACE:
            answers[number] = step(town, world_of(batch, number), substeps, dt, acceleration[number], steering[number])
        number = take(turns, home)


# Each phase is compiled on its own: inlined into one function they would take the compiler twice as long.


@compiled
def _decide(town: TownArrays, world: WorldArrays, dt: float) -> None:
    """Decides for all vehicles, and moves the pedestrians."""
    for i in range(len(world.vehicles)):
        kind = world.vehicles[i].kind
        if kind == Kind.DRIVEN:
            guide(town, world, dt)
        elif kind != Kind.EMPTY and kind != Kind.EGO:
            drive(town, world, i)
    walk(town, world, dt)


@compiled
def _move(town: TownArrays, world: WorldArrays, dt: float, egos: bool) -> None:
    """Moves all vehicles; those of the kind `Kind.EGO` only with `egos`."""
    for i in range(len(world.vehicles)):
        kind = world.vehicles[i].kind
        if kind != Kind.EMPTY and (egos or kind != Kind.EGO):
            _go_on(town, world.vehicles[i], dt)


@compiled
def _meet(town: TownArrays, world: WorldArrays, dt: float, tows: bool) -> None:
    """Detects collisions, respawns with `tows`, rebuilds the lane index, and ends the substep."""
    collide(world)
    if tows:
        tow(town, world, dt, bool(world.car[0].sweeping))
    rebuild(town, world)
    world.clock[0].frame += 1


@inlined
def _go_on(town: TownArrays, vehicle: VehicleRecord, dt: float) -> None:
    """Moves a vehicle and updates its lane."""
    vehicle.timer += dt
    if vehicle.speed < TRAFFIC_STANDING:
        vehicle.standing += dt if vehicle.wait != Wait.LIGHT else 0.0
    else:
        vehicle.standing = 0.0
    if vehicle.speed == 0.0 and vehicle.acceleration <= 0.0:
        return  # it stands: its lane is unchanged
    move(vehicle, dt)
    update_lane(town, vehicle)


@compiled
def step_around(town: TownArrays, world: WorldArrays, dt: float, rows: NDArray[np.int64], poses: Array) -> None:
    """Steps a world by one substep in which vehicles of the kind `Kind.EGO` are moved from outside.

    As in `step`, all bodies decide by the previous state. Once one of those vehicles has crashed, no body is
    respawned, so that the bodies it touched are found where it happened.

    Args:
        town: arrays of the town.
        world: arrays of the world, changed in place.
        dt: time of the substep [s].
        rows: (n,) rows of those vehicles.
        poses: (n, 4) their state at its end: x, y [m], heading [rad], speed [m/s].
    """
    vehicles = world.vehicles
    _decide(town, world, dt)
    _move(town, world, dt, False)
    intact = True
    for k in range(len(rows)):
        vehicle = vehicles[rows[k]]
        vehicle.x, vehicle.y, vehicle.heading, vehicle.speed = poses[k, 0], poses[k, 1], poses[k, 2], poses[k, 3]
        vehicle.sin, vehicle.cos = pm.sincos(vehicle.heading)
        update_lane(town, vehicle)
        intact = intact and not vehicle.crashed
    _meet(town, world, dt, intact)
    world.clock[0].time = world.clock[0].frame * dt
