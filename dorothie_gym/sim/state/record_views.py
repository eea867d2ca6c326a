"""Rows of the arrays as objects, with attributes that read and write the records.

A view keeps its holder, which has the arrays, and the number of its row. Its memory is looked up once, and again
whenever the holder has other arrays: reading a field then takes a fifth of a microsecond, a tenth of what it takes by
way of NumPy's records.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

import numpy as np

from dorothie_gym.maps.model import Array
from dorothie_gym.sim.state.world_arrays import WorldArrays

if TYPE_CHECKING:
    from highway_env.vehicle.objects import RoadObject

    from dorothie_gym.sim.road import TownRoad


class ArrayHolder(Protocol):
    """Owner of the arrays of a world, which it may replace by bigger ones with the same bodies in the same rows."""

    arrays: WorldArrays


CASTS = {"f8": (0, "d"), "i4": (1, "i"), "b1": (2, "?")}
"""Types of fields: the memory view of the row that holds them, and its format."""


def field_offset(dtype: np.dtype[np.void], name: str) -> int:
    """Returns the place of a field in its record [bytes]."""
    assert dtype.fields is not None
    return dtype.fields[name][1]


def field(dtype: np.dtype[np.void], name: str, cast: Callable[[Any], Any] | None = None) -> Any:
    """Returns a property that reads and writes a field of the view's row; `cast` converts the value that is read."""
    kind = dtype[name].base
    which, _ = CASTS[kind.str[1:]]
    at = field_offset(dtype, name) // kind.itemsize

    def read(view: BodyView) -> Any:
        return view.memory()[which][at]

    def read_cast(view: BodyView) -> Any:
        return cast(view.memory()[which][at])  # type: ignore[misc]

    def write(view: BodyView, value: Any) -> None:
        view.memory()[which][at] = value

    return property(read if cast is None else read_cast, write)


class BodyView:
    """A row of the arrays. Its memory is looked up once and again whenever the holder has other arrays.

    Attributes:
        road: on which the body is.
    """

    RECORDS: ClassVar[str]
    DTYPE: ClassVar[np.dtype[np.void]]

    # set by `RoadObject.__init__`; the records have no field for them
    collidable = True
    solid = True
    check_collisions = True
    hit = False
    impact: Array | None = None

    cos: Any
    sin: Any
    speed: Any
    lane: Any
    heading: Any
    lane_id: Any
    station: Any

    def __init__(self, road: TownRoad, holder: ArrayHolder, row: int) -> None:
        """Looks at a row; `road` is a `TownRoad` of the same town."""
        self.road = road
        self._holder = holder
        self._row = row
        self._arrays: WorldArrays | None = None
        self._views: tuple[Any, ...] = ()

    @property
    def row(self) -> int:
        """Number of the row."""
        return self._row

    def memory(self) -> tuple[Any, ...]:
        """The row's memory as floats, integers and flags, and its place as an array (2,)."""
        arrays = self._holder.arrays
        if arrays is not self._arrays:
            size = self.DTYPE.itemsize
            records = np.asarray(getattr(arrays, self.RECORDS)).view(np.uint8)
            cells: Any = records[self._row * size : (self._row + 1) * size].data
            place = np.frombuffer(cells, dtype=np.float64, count=2, offset=field_offset(self.DTYPE, "x"))
            self._views = (*(cells.cast(code) for _, code in CASTS.values()), place)
            self._arrays = arrays
        return self._views

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_arrays": None, "_views": ()}  # a copy finds its own memory

    @property
    def record(self) -> Any:
        """The row itself, for the compiled functions; not to be kept."""
        return getattr(self._holder.arrays, self.RECORDS)[self._row]

    @property
    def position(self) -> Array:
        """Place of the middle (2,) [m]; as in highway-env an array that changes when the body moves."""
        place: Array = self.memory()[3]
        return place

    @position.setter
    def position(self, value: Sequence[float]) -> None:
        self.memory()[3][:] = value

    @property
    def direction(self) -> Array:
        """Unit vector of its heading (2,)."""
        return np.array((self.cos, self.sin))

    @property
    def velocity(self) -> Array:
        """(2,) [m/s]."""
        return np.array((self.speed * self.cos, self.speed * self.sin))

    @property
    def lane_offset(self) -> Array:
        """Station [m], distance to the right [m] and angle [rad] to the closest lane (3,)."""
        along, aside = self.on_lane()
        return np.array((along, aside, self.lane.local_angle(self.heading, along)))

    @property
    def destination_direction(self) -> Array:
        """Direction to its destination (2,) of length 1, or zeros."""
        return np.zeros(2)

    def on_lane(self) -> tuple[float, float]:
        """Station and distance to the right on the closest lane [m]."""
        found: tuple[float, float] = self.lane.local_coordinates(self.position)
        return found

    def to_dict(self, origin_vehicle: RoadObject | None = None, observe_intentions: bool = True) -> dict[str, float]:
        """Returns the features that highway-env observes of a vehicle; those of pedestrians and props likewise.

        Args:
            origin_vehicle: position and velocity are given relative to it.
            observe_intentions: whether the direction to the destination is included.
        """
        x, y = self.position.tolist()
        cos, sin, speed, heading = self.cos, self.sin, self.speed, self.heading
        vx, vy = speed * cos, speed * sin
        if origin_vehicle:
            (ox, oy), (ovx, ovy) = origin_vehicle.position, origin_vehicle.velocity
            x, y, vx, vy = x - ox, y - oy, vx - ovx, vy - ovy
        along, aside = self.on_lane()
        to_x, to_y = self.destination_direction if observe_intentions else (0, 0)
        return {
            "presence": 1, "x": x, "y": y, "vx": vx, "vy": vy, "heading": heading, "cos_h": cos, "sin_h": sin,
            "cos_d": to_x, "sin_d": to_y,
            "long_off": along, "lat_off": aside, "ang_off": self.lane.local_angle(heading, along),
        }  # fmt: skip


def heading_field(dtype: np.dtype[np.void]) -> Any:
    """Returns a property for the heading of a body [rad]; its cosine and sine change with it."""
    plain = field(dtype, "heading")

    def write(view: BodyView, value: float) -> None:
        plain.fset(view, value)
        view.cos, view.sin = math.cos(value), math.sin(value)

    return property(plain.fget, write)
