"""Ego controller: applies physical actions, and passes path, cruise speed and goals to the compiled world."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dorothie_gym.copying import shared
from dorothie_gym.maps.model import Array
from dorothie_gym.ontology import SPEED_STEP, PhysicalAction
from dorothie_gym.sim.ego.feasibility import may_change_cruise
from dorothie_gym.sim.ego.limits import (
    KMH,
    LATERAL_ACCELERATION,
    MAX_CRUISE,
    MIN_CRUISE,
    PROFILE_BRAKING,
    U_TURN_SPEED,
    VehicleControl,
)
from dorothie_gym.sim.ego.path import Path, find_sides
from dorothie_gym.sim.ego.planner import LocalPlanner
from dorothie_gym.sim.ego.vehicle import Car, CarRecord
from dorothie_gym.sim.state.records import plain
from dorothie_gym.sim.state.world_arrays import WorldArrays
from dorothie_gym.sim.traffic.parameters import CAR_LENGTH, CAR_WIDTH

END_GAP = 0.8
"""Room between the nose of a waiting ego and the end of its lane [m]."""


@shared
@dataclass(frozen=True, kw_only=True)
class GoalAhead:
    """Place where the ego is expected to stop: lane and distance along it [m]."""

    lane: int
    station: float


PATH_BEHIND, PATH_AHEAD = 12.0, 150.0
"""Stretch of path behind and ahead of the ego that is written into the arrays at least [m]."""


def speed_profile(path: Path, stop_at: float | None) -> Array:
    """Returns the speed that curves, limits and the end of a path allow at each of its points (n,) [m/s].

    Args:
        path: the path.
        stop_at: distance along the path at which the ego has to stop [m], or None.
    """
    bend = np.convolve(np.pad(np.abs(path.curvatures), 1, mode="edge"), np.full(3, 1 / 3), mode="valid")
    squared = np.minimum(path.limits**2, LATERAL_ACCELERATION / np.maximum(bend, 1e-4))
    if path.manoeuvre.any():
        tight = path.manoeuvre & (bend > 0.1)
        squared = np.where(tight, np.minimum(squared, U_TURN_SPEED**2), squared)
    if stop_at is not None:
        squared = np.where(path.s >= stop_at, 0.0, squared)
    # v^2 may grow by 2 a ds towards the past: a running minimum from the end
    slope = 2 * PROFILE_BRAKING * path.s
    squared = np.minimum.accumulate((squared + slope)[::-1])[::-1] - slope
    speeds: Array = np.sqrt(np.maximum(squared, 0.0))
    return speeds


def write_path(arrays: WorldArrays, path: Path, s: float, speeds: Array) -> float:
    """Writes the stretch of a path around a place into the arrays of a world.

    Args:
        arrays: arrays of a world with a driven ego.
        path: the path.
        s: place of the ego along it [m].
        speeds: allowed speed at its points (n,) [m/s].

    Returns:
        Distance along the path at which the stretch ends [m].
    """
    car, table = plain(arrays.car)[0], plain(arrays.path)
    first = path.index_at(s - PATH_BEHIND)
    cut = slice(first, first + len(table))
    lanes, headings = path.lanes[cut], path.headings[cut]
    rows = table[: len(lanes)]
    rows["s"], rows["x"], rows["y"] = path.s[cut], path.points[cut, 0], path.points[cut, 1]
    rows["heading"], rows["cos"], rows["sin"] = headings, np.cos(headings), np.sin(headings)
    rows["height"], rows["station"], rows["speed"] = path.heights[cut], path.stations[cut], speeds[cut]
    rows["lane"], rows["manoeuvre"] = lanes, path.manoeuvre[cut]
    find_sides(arrays.path, len(lanes), CAR_LENGTH, CAR_WIDTH)
    starts = np.concatenate(([0], 1 + np.flatnonzero(lanes[1:] != lanes[:-1])))[: len(car["run_lane"])]
    car["runs"], car["run"] = len(starts), -1
    car["run_lane"][: len(starts)], car["run_first"][: len(starts)] = lanes[starts], starts
    car["points"], car["at"], car["s"] = len(lanes), path.index_at(s) - first, s
    return float(path.s[cut][-1])


class EgoController:
    """Control of the ego car between the Co-Wizard's physical actions and the compiled world.

    `apply` takes a physical action. `brief` writes path, speed and goals into the arrays of the world before these
    are stepped (the pedals follow there, in `motion_control`); `debrief` reads the ego's place on the path afterwards.

    Attributes:
        planner: local planner of the ego.
        cruise: desired speed [km/h].
        lights: whether the head lights are on.
        goals: places where the ego is expected to stop; it approaches them slowly.
        manual: throttle, brake and steering of an outside driver; None: the ego drives itself.
    """

    def __init__(self, planner: LocalPlanner, car: Car, *, cruise: float = 40.0) -> None:
        self.planner = planner
        self.cruise = cruise
        self.lights = False
        self.goals: Sequence[GoalAhead] = ()
        self.manual: VehicleControl | None = None
        self._car = car
        self._written: Path | None = None
        self._written_until = 0.0
        self._speeds: Array = np.zeros(0)

    def apply(self, action: PhysicalAction, *, angle: int = 0, up: bool = True) -> str | None:
        """Applies a physical action.

        Args:
            action: the action.
            angle: degrees, positive left; for JTurn and LaneSwitch.
            up: direction of SpeedChange, state of LightChange.

        Returns:
            None, or the reason of the refusal; then nothing has changed.
        """
        if action is PhysicalAction.SPEED_CHANGE:
            return self.change_cruise(up)
        if action is PhysicalAction.LIGHT_CHANGE:
            if self.lights == up:
                return f"the lights are {'on' if up else 'off'} already"
            self.lights = up
            return None
        return self.planner.command(action, angle, float(self._car.speed))

    def change_cruise(self, up: bool) -> str | None:
        """Changes the cruise speed by one step; returns the reason of a refusal."""
        if not may_change_cruise(self.cruise, up):
            return f"the cruise speed stays within {MIN_CRUISE:.0f} and {MAX_CRUISE:.0f} km/h"
        self.cruise += SPEED_STEP if up else -SPEED_STEP
        return None

    def set_goals(self, goals: Sequence[GoalAhead]) -> None:
        """Sets the places where the ego is expected to stop."""
        self.goals = tuple(goals)
        self._written = None

    def brief(self, arrays: WorldArrays, record: CarRecord) -> None:
        """Writes path, manoeuvre, cruise speed and pedals into the arrays of a world, before it is stepped.

        Args:
            arrays: arrays of the world.
            record: the ego's fields in them.
        """
        planner = self.planner
        if planner.path is not self._written:
            self._write(arrays, new_path=True)
        elif self._written_until < min(planner.s + PATH_AHEAD, planner.path.length):
            self._write(arrays, new_path=False)
        action, _ = planner.manoeuvre
        number, manual = 0 if action is None else action.value, self.manual
        record.orders[()] = number, planner.manoeuvre_end, self.cruise * KMH, planner.held, manual is not None
        if manual is not None:
            record.pedals[()] = manual.throttle, manual.steer, manual.brake

    def debrief(self, record: CarRecord) -> None:
        """Reads the ego's place on the path after the world was stepped; see `brief`."""
        self.planner.note(*record.place.item())

    def speed_at(self, s: float) -> float:
        """Returns the speed that curves, limits and the end of the path allow at a distance along the path [m/s].

        The path is that of the last step of the world.
        """
        path = self._written
        return float(np.interp(s, path.s, self._speeds)) if path is not None else self.cruise * KMH

    def _write(self, arrays: WorldArrays, *, new_path: bool) -> None:
        """Writes the stretch of path around the ego, and for a new path its speeds, goals and end."""
        path, s, car = self.planner.path, self.planner.s, plain(arrays.car)[0]
        if new_path:
            stop_at = path.length - self._car.LENGTH / 2 - END_GAP if self.planner.waits_at_end else None
            self._speeds = speed_profile(path, stop_at)
            goals = self._goals_on(path)[: car["goal"].shape[0]]
            car["goals"], car["goal"][: len(goals)] = len(goals), goals
            car["stop_at"] = math.inf if stop_at is None else stop_at
            self._written = path
        car["offset"] = self.planner.offset
        self._written_until = write_path(arrays, path, s, self._speeds)

    def _goals_on(self, path: Path) -> list[float]:
        """Returns the places of the goals along a path [m], goals on lanes beside it included."""
        found: list[float] = []
        for goal in self.goals:
            for lane, station in self.planner.beside(goal.lane, goal.station):
                on = np.flatnonzero((path.lanes == lane) & ~path.manoeuvre)
                if len(on) and path.stations[on[0]] - 1.0 <= station <= path.stations[on[-1]] + 1.0:
                    found.append(float(np.interp(station, path.stations[on], path.s[on])))
        return sorted(place for place in found if place >= self.planner.s - 1.0)
