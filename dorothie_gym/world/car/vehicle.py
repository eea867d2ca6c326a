"""The car that the session is about, as a highway-env vehicle: a view on the arrays of its world."""

from __future__ import annotations

from typing import Any

import numpy as np
from highway_env.vehicle.kinematics import Vehicle

from dorothie_gym.world.car.control import Control
from dorothie_gym.world.kernel.world_arrays import WorldArrays
from dorothie_gym.world.network.road import TownRoad
from dorothie_gym.world.town.model import Array


class Car(Vehicle):
    """Vehicle number 0 of a world (`kernel.Kind.DRIVEN`), for reading; whoever writes to it moves it.

    Attributes:
        position: (2,) of its middle [m]; what is read is a copy.
        heading: [rad].
        speed: [m/s].
        height: of the road under it [m].
        control: what the actuators were told last.
    """

    MAX_SPEED = 40.0

    def __init__(self, road: TownRoad, holder: Any) -> None:
        """Shows the first vehicle of `holder.arrays`, which may be replaced by others with more room."""
        self._holder = holder
        super().__init__(road, self.position, self.heading, self.speed)

    @property
    def _row(self) -> Any:
        arrays: WorldArrays = self._holder.arrays
        return arrays.vehicles.view(np.ndarray)[0]

    @property
    def position(self) -> Array:
        row = self._row
        return np.array((row["x"], row["y"]))

    @position.setter
    def position(self, place: Array) -> None:
        row = self._row
        row["x"], row["y"] = place

    @property
    def heading(self) -> float:
        return float(self._row["heading"])

    @heading.setter
    def heading(self, heading: float) -> None:
        row = self._row
        row["heading"], row["cos"], row["sin"] = heading, np.cos(heading), np.sin(heading)

    @property
    def speed(self) -> float:
        return float(self._row["speed"])

    @speed.setter
    def speed(self, speed: float) -> None:
        self._row["speed"] = speed

    @property
    def height(self) -> float:
        return float(self._row["height"])

    @property
    def control(self) -> Control:
        """What the actuators were told last."""
        car = self._holder.arrays.car.view(np.ndarray)[0]
        return Control(throttle=float(car["throttle"]), steer=float(car["steer"]), brake=float(car["brake"]))

    def on_state_update(self) -> None:
        """Matches the car to the closest lane of its height."""
        network = self.road.network
        self.lane_index = network.get_closest_lane_index(self.position, self.heading, height=self.height)
        self.lane = network.get_lane(self.lane_index)
