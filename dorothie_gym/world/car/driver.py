"""Drives the car along the planner's path, no faster than curves, limits, goals and hazards allow."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dorothie_gym.ontology import SPEED_STEP, ObjectClass, PhysicalAction
from dorothie_gym.world.car.control import MAX_BRAKING, Control, PathController
from dorothie_gym.world.car.hazards import Hazard
from dorothie_gym.world.car.path import Path
from dorothie_gym.world.car.planner import BRAKING, U_TURN_SPEED, LocalPlanner

KMH = 1 / 3.6
"""[m/s] of one km/h."""

LATERAL_ACCELERATION = 2.2
"""Comfortable in curves [m/s^2]."""

PROFILE_BRAKING = 2.0
"""Deceleration towards a curve or the end of the path [m/s^2]."""

SURE_BRAKING = 1.8
"""From this on, braking that is needed is applied whatever the speed controller says [m/s^2]."""

APPROACH_SPEED = 14.0 * KMH
"""Speed near a goal, under the design's 15 km/h [m/s]."""

APPROACH_DISTANCE = 20.0
"""Where a goal begins to be near [m]."""

PROP_DEPTH = 1.25
"""Half the length of the longest prop: it is in sight when its middle is [m]."""

WALKING_SPEED = 1.5
"""Speed of a car that hardly sees anything [m/s]."""

END_GAP = 0.8
"""Room left between the nose of a waiting car and the end of its lane [m]."""

MIN_CRUISE, MAX_CRUISE = 5.0, 90.0
"""Range of the cruise speed [km/h]."""


@dataclass(frozen=True, kw_only=True)
class GoalAhead:
    """A place where the car is expected to stop: its lane and the distance along it [m]."""

    lane: int
    station: float


class SpeedProfile:
    """Speed that curves, limits and the end of a path allow, at every point of it."""

    def __init__(self, path: Path, *, stop_at: float | None) -> None:
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
        self._path, self._stop_at = path, stop_at
        self._speeds: list[float] = np.sqrt(np.maximum(squared, 0.0)).tolist()

    def at(self, s: float) -> float:
        """Speed allowed at a distance along the path [m/s]."""
        if self._stop_at is not None:
            # exact near the end, where the points are too coarse
            left = self._stop_at - s
            near = math.sqrt(2 * PROFILE_BRAKING * left) if left > 0.0 else 0.0
        else:
            near = math.inf
        return min(near, self._speeds[self._path.index_at(s)])

    def braking(self, s: float, speed: float) -> float:
        """Deceleration that stops the car at the end of the path from a speed [m/s]; 0 where it goes on [m/s^2]."""
        if self._stop_at is None:
            return 0.0
        return speed**2 / (2 * max(self._stop_at - s, 0.05))


class Driver:
    """From the path, the goals and the hazards to the controls of every substep.

    Attributes:
        cruise: desired speed [km/h].
        goals: places where the car is expected to stop; it comes up to them slowly.
        sight: how far the car perceives bodies now [m]; it goes no faster than it can stop within.
    """

    def __init__(self, planner: LocalPlanner, *, length: float, cruise: float = 40.0) -> None:
        self.planner = planner
        self.cruise = cruise
        self.goals: Sequence[GoalAhead] = ()
        self.sight = math.inf
        self._length = length
        self._controller = PathController()
        self._profile: SpeedProfile | None = None
        self._profiled: Path | None = None
        self._goals_on_path: list[float] = []
        self._hold_speed: float | None = None

    def change_cruise(self, up: bool) -> str | None:
        """Changes the cruise speed by 5 km/h; returns the reason if that cannot be."""
        wanted = self.cruise + (SPEED_STEP if up else -SPEED_STEP)
        if not MIN_CRUISE <= wanted <= MAX_CRUISE:
            return f"the cruise speed stays within {MIN_CRUISE:.0f} and {MAX_CRUISE:.0f} km/h"
        self.cruise = wanted
        return None

    def set_goals(self, goals: Sequence[GoalAhead]) -> None:
        """Sets where the car is expected to stop."""
        self.goals = tuple(goals)
        self._profiled = None

    def allowed_speed(self, hazard: Hazard | None, friction: float = 1.0) -> float:
        """Target speed now [m/s]."""
        planner = self.planner
        self._prepare()
        assert self._profile is not None
        speed = min(self.cruise * KMH, self._profile.at(planner.s + 0.1), self._sight_speed(friction))
        for place in self._goals_on_path:
            left = place - planner.s
            if -1.0 <= left:
                beyond = max(left - APPROACH_DISTANCE, 0.0)
                speed = min(speed, math.sqrt(APPROACH_SPEED**2 + 2 * PROFILE_BRAKING * beyond))
        if hazard is not None:
            speed = min(speed, hazard.safe_speed(friction))
        return speed

    def _sight_speed(self, friction: float) -> float:
        """Speed from which the car can stop behind a roadblock that comes in sight [m/s]."""
        if math.isinf(self.sight):
            return math.inf
        unseen = Hazard(kind=ObjectClass.STATIC, gap=self.sight - self._length / 2 - PROP_DEPTH)
        return max(unseen.safe_speed(friction), WALKING_SPEED)

    def control(self, x: float, y: float, heading: float, speed: float, hazard: Hazard | None, dt: float,
                friction: float = 1.0) -> Control:  # fmt: skip
        """Controls for the next substep.

        Args:
            x: position [m]; `y` likewise.
            y: [m].
            heading: [rad].
            speed: [m/s].
            hazard: what is ahead.
            dt: substep [s].
            friction: share of the dry road's grip.
        """
        planner = self.planner
        planner.advance(x, y)
        target = self.allowed_speed(hazard, friction)
        if planner.held:
            self._hold_speed = min(speed if self._hold_speed is None else self._hold_speed, speed)
            self._hold_speed = max(self._hold_speed - BRAKING * dt, 0.0)
            target = min(target, self._hold_speed)
        else:
            self._hold_speed = None
        control = self._controller.step(planner.path, planner.s, planner.offset, heading, speed, target, dt)
        assert self._profile is not None
        needed = max(self._profile.braking(planner.s, speed), hazard.braking(speed) if hazard is not None else 0.0)
        if needed > SURE_BRAKING:
            # the speed controller lags behind: before a hazard or line the brake is applied that stops the car in time
            control = replace(control, throttle=0.0, brake=max(control.brake, min(needed / MAX_BRAKING, 1.0)))
        return control

    def _prepare(self) -> None:
        path = self.planner.path
        if path is self._profiled:
            return
        stop_at = path.length - self._length / 2 - END_GAP if self.planner.waits_at_end else None
        self._profile = SpeedProfile(path, stop_at=stop_at)
        self._profiled = path
        self._goals_on_path = []
        for goal in self.goals:
            for lane, station in self.planner.beside(goal.lane, goal.station):
                on = np.flatnonzero((path.lanes == lane) & ~path.manoeuvre)
                if len(on) and path.stations[on[0]] - 1.0 <= station <= path.stations[on[-1]] + 1.0:
                    self._goals_on_path.append(float(np.interp(station, path.stations[on], path.s[on])))


def is_turning_round(planner: LocalPlanner) -> bool:
    """Whether a U-turn is under way or about to begin."""
    return planner.manoeuvre[0] is PhysicalAction.U_TURN
