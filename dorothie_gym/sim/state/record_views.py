"""Rows of the arrays as objects, with attributes that read and write the records.

A view keeps its holder, which has the arrays, and the number of its row. Its memory is looked up once, and again
whenever the holder has other arrays: reading a field then takes a fifth of a microsecond, a tenth of what it takes by
way of NumPy's records.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, ClassVar, Generic, Protocol, TypeAlias, TypeVar, cast

import numpy as np

from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.copying import CachedViews

if TYPE_CHECKING:
    from highway_env.vehicle.objects import RoadObject

    from dorothie_gym.maps.model import Array
    from dorothie_gym.sim.network.lane import PolylineLane
    from dorothie_gym.sim.road import TownRoad
    from dorothie_gym.sim.state.world_arrays import WorldArrays


class ArrayHolder(Protocol):
    """Owner of the arrays of a world, which it may replace by bigger ones with the same bodies in the same rows."""

    arrays: WorldArrays


Record_co = TypeVar("Record_co", covariant=True)
T = TypeVar("T")


class Field(Protocol[T]):
    """Attribute of a view that reads and writes a field of its row: a property, of which mypy knows the type."""

    def __get__(self, view: BodyView[object], kind: type | None = None, /) -> T: ...

    def __set__(self, view: BodyView[object], value: T, /) -> None: ...


Cells: TypeAlias = "memoryview[float]"
"""Cells of a row of one type: floats, integers or flags."""

MEMORIES = {"f8": 0, "i4": 1, "b1": 2}
"""Places in `BodyView.memory` of the types of fields."""


def field_offset(dtype: np.dtype[np.void], name: str) -> int:
    """Returns the place of a field in its record [bytes]."""
    fields = dtype.fields or MappingProxyType({})
    return fields[name][1]


def float_field(dtype: np.dtype[np.void], name: str) -> Field[float]:
    """Returns a property for a number of the view's row."""
    return property(*_accessors(dtype, name))


def int_field(dtype: np.dtype[np.void], name: str) -> Field[int]:
    """Returns a property for an integer of the view's row; for an array, of its first element."""
    return property(*_accessors(dtype, name))


def flag_field(dtype: np.dtype[np.void], name: str) -> Field[bool]:
    """Returns a property for a flag of the view's row."""
    return property(*_accessors(dtype, name))


def converted_field(dtype: np.dtype[np.void], name: str, convert: Callable[..., T]) -> Field[T]:
    """Returns a property for a field of the view's row whose value is converted when it is read."""
    which, at = _place(dtype, name)

    def read(view: BodyView[object]) -> T:
        return convert(view.memory()[which][at])

    return property(read, _accessors(dtype, name)[1])


def heading_field(dtype: np.dtype[np.void]) -> Field[float]:
    """Returns a property for the heading of a body [rad]; its cosine and sine change with it."""
    read, store = _accessors(dtype, "heading")

    def write(view: BodyView[object], value: float) -> None:
        store(view, value)
        view.cos, view.sin = pm.cos(value), pm.sin(value)

    return property(read, write)


def _place(dtype: np.dtype[np.void], name: str) -> tuple[int, int]:
    """Returns the memory that holds a field, and the number of its cell."""
    kind = dtype[name].base
    return MEMORIES[kind.str[1:]], field_offset(dtype, name) // kind.itemsize


def _accessors(
    dtype: np.dtype[np.void], name: str
) -> tuple[Callable[[BodyView[object]], float], Callable[[BodyView[object], float], None]]:
    which, at = _place(dtype, name)

    def read(view: BodyView[object]) -> float:
        return view.memory()[which][at]

    def write(view: BodyView[object], value: float) -> None:
        view.memory()[which][at] = value

    return read, write


class BodyView(CachedViews, Generic[Record_co]):
    """A row of the arrays. Its memory address is cached until the holder has other arrays.

    Attributes:
        road: road of the body.
    """

    RECORDS: ClassVar[str]
    DTYPE: ClassVar[np.dtype[np.void]]
    CACHED_VIEWS: ClassVar[Sequence[str]] = ("_arrays", "_cells", "_position")

    # set by `RoadObject.__init__`; the records have no field for them
    collidable = True
    solid = True
    check_collisions = True
    hit = False
    impact: Array | None = None

    _arrays: WorldArrays | None = None
    _cells: tuple[Cells, ...]
    _position: Array

    cos: Field[float]
    sin: Field[float]
    heading: Field[float]
    speed: Field[float] | float

    def __init__(self, road: TownRoad, holder: ArrayHolder, row: int) -> None:
        """Shows a row; `road` is a `TownRoad` of the same town."""
        self.road = road
        self._holder = holder
        self._row = row

    @property
    def row(self) -> int:
        """Number of the row."""
        return self._row

    def memory(self) -> tuple[Cells, ...]:
        """Returns the memory of the row as floats, integers and flags."""
        arrays = self._holder.arrays
        if arrays is not self._arrays:
            size = self.DTYPE.itemsize
            records = np.asarray(getattr(arrays, self.RECORDS)).view(np.uint8)
            row = records[self._row * size : (self._row + 1) * size].data
            self._position = np.frombuffer(row, dtype=np.float64, count=2, offset=field_offset(self.DTYPE, "x"))
            # for mypy all cells are floats: of which type they are depends on the index
            self._cells = cast("tuple[Cells, ...]", (row.cast("d"), row.cast("i"), row.cast("?")))
            self._arrays = arrays
        return self._cells

    @property
    def record(self) -> Record_co:
        """The row itself, for the compiled functions; not to be kept."""
        record: Record_co = getattr(self._holder.arrays, self.RECORDS)[self._row]
        return record

    @property
    def position(self) -> Array:
        """Place of the centre (2,) [m]; as in highway-env an array that changes when the body moves."""
        self.memory()
        return self._position

    @position.setter
    def position(self, value: Sequence[float]) -> None:
        self.memory()
        self._position[:] = value

    @property
    def direction(self) -> Array:
        """Unit vector of its heading (2,)."""
        return np.array((self.cos, self.sin))

    @property
    def velocity(self) -> Array:
        """(2,) [m/s]."""
        return np.array((self.speed * self.cos, self.speed * self.sin))

    @property
    def lane(self) -> PolylineLane:
        """The closest lane."""
        raise NotImplementedError

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
        """Returns the station and distance to the right on the closest lane [m]."""
        return self.lane.local_coordinates(self.position)

    def to_dict(self, origin_vehicle: RoadObject | None = None, observe_intentions: bool = True) -> dict[str, float]:
        """Returns the features that highway-env observes of a vehicle, pedestrian or prop.

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
