"""From a path to throttle, brake and steering wheel."""

from __future__ import annotations

import math
from dataclasses import dataclass

from dorothie_gym.world.car.path import Path

MAX_STEERING = math.pi / 3
"""Front wheel angle at full lock [rad], highway-env's."""

MAX_SLIP = math.atan(math.tan(MAX_STEERING) / 2)
"""Slip angle at full lock [rad]."""

MAX_ACCELERATION = 3.0
"""Acceleration at full throttle [m/s^2]."""

MAX_BRAKING = 8.0
"""Deceleration at full brake [m/s^2]; a dry road gives about 0.8 g."""


@dataclass(frozen=True, kw_only=True)
class Control:
    """What the car's actuators are told, normalised (paper, appendix A.2).

    Attributes:
        throttle: in [0, 1].
        steer: in [-1, 1], positive right.
        brake: in [0, 1].
    """

    throttle: float
    steer: float
    brake: float

    @property
    def acceleration(self) -> float:
        """[m/s^2]."""
        return self.throttle * MAX_ACCELERATION - self.brake * MAX_BRAKING

    @property
    def steering_angle(self) -> float:
        """Front wheel angle [rad], positive right."""
        return self.steer * MAX_STEERING


@dataclass(frozen=True, kw_only=True)
class PIDGains:
    """Gains of a controller; the integral is kept within `integral_limit`."""

    proportional: float
    integral: float = 0.0
    derivative: float = 0.0
    integral_limit: float = 1.0


class PIDController:
    """A proportional-integral-derivative controller of one quantity."""

    def __init__(self, gains: PIDGains) -> None:
        self.gains = gains
        self.reset()

    def reset(self) -> None:
        """Forgets what was summed up."""
        self._integral = 0.0
        self._last: float | None = None

    def step(self, error: float, dt: float) -> float:
        """Answer to an error, `dt` seconds after the last one."""
        gains = self.gains
        self._integral = min(max(self._integral + error * dt, -gains.integral_limit), gains.integral_limit)
        slope = 0.0 if self._last is None else (error - self._last) / dt
        self._last = error
        return gains.proportional * error + gains.integral * self._integral + gains.derivative * slope


class PathController:
    """Steers along a path and keeps a target speed.

    Lateral: highway-env's bicycle moves along its heading plus the slip angle, and the slip angle follows the wheel at
    once. So its course can be laid along the path in every substep, also where the path's curvature jumps; a PID on the
    distance from the path adds the angle to come back at. Longitudinal: a PID on speed.
    """

    LATERAL = PIDGains(proportional=1.2, integral=0.1, derivative=0.1, integral_limit=0.5)
    LONGITUDINAL = PIDGains(proportional=1.6, integral=0.15, integral_limit=0.8)

    def __init__(self) -> None:
        self._lateral = PIDController(self.LATERAL)
        self._longitudinal = PIDController(self.LONGITUDINAL)

    def reset(self) -> None:
        """Forgets what was summed up: after a jump of the path."""
        self._lateral.reset()
        self._longitudinal.reset()

    def step(
        self, path: Path, s: float, offset: float, heading: float, speed: float, target_speed: float, dt: float
    ) -> Control:
        """Control for the next substep.

        Args:
            path: line to follow.
            s: where the car is on it [m].
            offset: signed distance from it, positive right [m].
            heading: of the car [rad].
            speed: [m/s].
            target_speed: [m/s].
            dt: substep [s].
        """
        back = self._lateral.step(-offset, dt) if speed > 0.3 else 0.0
        wanted = path.heading_at(s + speed * dt / 2) + math.atan2(back * 1.4, max(speed, 1.0))
        slip = (wanted - heading + math.pi) % (2 * math.pi) - math.pi
        steering = math.atan(2 * math.tan(min(max(slip, -MAX_SLIP), MAX_SLIP)))
        pull = self._longitudinal.step(target_speed - speed, dt)
        if target_speed <= 0.0:
            self._longitudinal.reset()
            pull = min(pull, -1.0) if speed > 0 else -MAX_BRAKING
        throttle = min(max(pull / MAX_ACCELERATION, 0.0), 1.0)
        brake = min(max(-pull / MAX_BRAKING, 0.0), 1.0)
        return Control(throttle=throttle, steer=min(max(steering / MAX_STEERING, -1.0), 1.0), brake=brake)
