"""The car that the session is about: highway-env's bicycle, driven by normalised controls."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from highway_env.vehicle.kinematics import Vehicle

from dorothie_gym.world.boxes import Box, boxes_touch
from dorothie_gym.world.car.control import MAX_BRAKING, Control
from dorothie_gym.world.network.road import TownRoad
from dorothie_gym.world.town.model import Array


class Car(Vehicle):
    """A highway-env vehicle that takes throttle, steering wheel and brake, and never rolls backwards.

    Attributes:
        control: what the actuators were told last.
        height: of the road under it [m].
        friction: share of the dry road's grip.
        drift: angle by which wind moves it beside its course, positive right [rad].
        sweep: places [m] that it has still to pass while it turns round, across lanes where others do not expect it.
        touched: what it has touched since that was last asked for (`take_touched`).
    """

    MAX_SPEED = 40.0

    def __init__(self, road: TownRoad, position: Array, heading: float, height: float) -> None:
        self.height = height
        super().__init__(road, position, heading, 0.0)
        self.control = Control(throttle=0.0, steer=0.0, brake=0.0)
        self.friction = 1.0
        self.drift = 0.0
        self.sweep: list[tuple[float, float]] = []
        self.touched: list[Any] = []

    def drive(self, control: Control, dt: float) -> None:
        """Sets the controls for the next substep of `dt` seconds; brakes stop the car, they do not reverse it."""
        self.control = control
        acceleration = control.acceleration
        if acceleration < 0.0:
            acceleration = max(acceleration, -MAX_BRAKING * self.friction, -self.speed / dt)
        self.act({"acceleration": acceleration, "steering": control.steering_angle})

    def step(self, dt: float) -> None:
        """Moves on by `dt` [s], and with the wind."""
        if self.drift:
            aside = float(self.speed) * dt * math.tan(self.drift)
            self.position += aside * np.array([-math.sin(self.heading), math.cos(self.heading)])
        super().step(dt)

    def on_state_update(self) -> None:
        """Matches the car to the closest lane of its height."""
        network = self.road.network
        self.lane_index = network.get_closest_lane_index(self.position, self.heading, height=self.height)
        self.lane = network.get_lane(self.lane_index)

    def handle_collisions(self, other: Any, dt: float = 0.0) -> None:
        """Takes note of what the car touches; `dt` is part of highway-env's interface.

        Stock highway-env flags those that will have met by the next frame, pushes them apart, and tells nobody whom
        they met. Here a collision is that the two outlines have a point in common, and both come to a stand.
        """
        if other.solid and other.collidable and boxes_touch(Box.of(self), Box.of(other)):
            self.crashed = other.crashed = True
            self.touched.append(other)

    def take_touched(self) -> list[Any]:
        """What the car has touched since this was asked last; it drives on as if nothing had happened."""
        touched, self.touched, self.crashed = self.touched, [], False
        return touched
