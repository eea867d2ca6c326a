"""The ego car as a highway-env vehicle: a view on the arrays of its world."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from highway_env.vehicle.kinematics import Vehicle
from numpy.typing import NDArray

from dorothie_gym.maps.model import Array
from dorothie_gym.sim.ego.limits import VehicleControl
from dorothie_gym.sim.road import TownRoad
from dorothie_gym.sim.state.record_views import ArrayHolder
from dorothie_gym.sim.state.world_arrays import WorldArrays
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation.records import fields, plain
from dorothie_gym.support.copying import CachedViews


class Car(CachedViews, Vehicle):
    """The ego, vehicle number 0 of a world (`Kind.DRIVEN`), as of the last step of the world.

    Setting its position, heading or speed moves it.
    """

    MAX_SPEED = 40.0
    CACHED_VIEWS: ClassVar[Sequence[str]] = ("_state_of", "_own_state")

    _state_of: WorldArrays | None = None

    def __init__(self, road: TownRoad, holder: ArrayHolder) -> None:
        """Shows the first vehicle of `holder.arrays`, which may be replaced by others with more room."""
        self._holder = holder
        self._heading: float
        self._speed: float
        self._height: float
        self.refresh()
        super().__init__(road, self.position, self.heading, self.speed)

    def refresh(self) -> None:
        """Reads place, heading, speed and height from the arrays."""
        x, y, self._heading, self._speed, self._height = self._state.item()
        self._position = np.array((x, y))

    @property
    def _state(self) -> NDArray[np.void]:
        """Place, heading, speed and height in the arrays, see `fields`."""
        arrays: WorldArrays = self._holder.arrays
        if arrays is not self._state_of:
            self._state_of, self._own_state = arrays, fields(arrays.vehicles, "x", "y", "heading", "speed", "height")
        return self._own_state

    @property
    def _row(self) -> np.void:
        row: np.void = plain(self._holder.arrays.vehicles)[0]
        return row

    @property
    def position(self) -> Array:
        """Position of its middle (2,) [m]."""
        return self._position

    @position.setter
    def position(self, place: Array) -> None:
        self._row["x"], self._row["y"] = place
        self.refresh()

    @property
    def heading(self) -> float:
        """Heading [rad]."""
        return self._heading

    @heading.setter
    def heading(self, heading: float) -> None:
        row = self._row
        row["heading"], row["cos"], row["sin"] = heading, pm.cos(heading), pm.sin(heading)
        self.refresh()

    @property
    def speed(self) -> float:
        """Speed [m/s]."""
        return self._speed

    @speed.setter
    def speed(self, speed: float) -> None:
        self._row["speed"] = speed
        self.refresh()

    @property
    def height(self) -> float:
        """Height of the road under it [m]."""
        return self._height

    @property
    def control(self) -> VehicleControl:
        """Last input of the actuators."""
        car = plain(self._holder.arrays.car)[0]
        return VehicleControl(throttle=float(car["throttle"]), steer=float(car["steer"]), brake=float(car["brake"]))

    def on_state_update(self) -> None:
        """Matches the car to the closest lane of its height."""
        network = self.road.network
        self.lane_index = network.get_closest_lane_index(self.position, self.heading, height=self.height)
        self.lane = network.get_lane(self.lane_index)


# --- Fields of the ego's record ---------------------------------------------------------------------------------------


class CarRecord:
    """Groups of fields of the ego's record; ``.item()`` reads one as a tuple, ``[()] = numbers`` writes one (`fields`).

    Attributes:
        hazard: hazard and hazard_gap: the cause of a hazard stop.
        outcome: numbers of events, breaches of rules and collisions.
        props: number of props that it sees.
        air: friction, wind, wind_heading and wind_phase: effects of the weather.
    """

    def __init__(self, arrays: WorldArrays) -> None:
        """Shows the record in the arrays of a world."""
        self.hazard = fields(arrays.car, "hazard", "hazard_gap")
        self.outcome = fields(arrays.car, "events", "breaches", "collisions")
        self.props = fields(arrays.plan, "props")
        self.air = fields(arrays.car, "friction", "wind", "wind_heading", "wind_phase")
