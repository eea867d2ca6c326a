"""Observations read into typed records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import ArrayLike

from dorothie_gym.dialogue.street_titles import NO_TITLES, StreetTitles
from dorothie_gym.ontology.slots import GoalStatus, LandmarkName, ObjectClass, StreetName
from dorothie_gym.ontology.world_exceptions import PropKind, WeatherParameter
from dorothie_gym.policies.lane_bounds import may_be_near
from dorothie_gym.policies.scripted_agent_limits import FOG_LIMIT, RAIN_LIMIT
from dorothie_gym.session.spaces.observations import (
    LandmarkColumn,
    ObjectColumn,
    ObservationMapping,
    SubgoalColumn,
)
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation.records import Rows

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town

PARAMETERS = tuple(WeatherParameter)
_WEATHER_COLUMN = {parameter: column for column, parameter in enumerate(PARAMETERS)}


@dataclass(frozen=True, kw_only=True)
class SeenLandmark:
    """Landmark on the map.

    Attributes:
        row: row of the observation.
        name: name.
        x: position [m].
        y: position [m].
        lane: lane of the place where a car stops for it.
        station: distance along that lane [m].
        street: street of that lane.
    """

    row: int
    name: LandmarkName
    x: float
    y: float
    lane: int
    station: float
    street: StreetName

    @property
    def place(self) -> tuple[int, float]:
        """Lane and station at which a car stops for it."""
        return self.lane, self.station


COMMON = (LandmarkName.HOUSE, LandmarkName.PERSON)
"""Names of which a town may have several places, so that the name alone says little."""

IN_VIEW = 45.0
"""Largest distance, along each axis, of a landmark that utterances refer to [m]."""


def landmarks_in_view(
    observation: ObservationMapping, landmarks: Sequence[SeenLandmark]
) -> Sequence[SeenLandmark] | None:
    """Returns those landmarks of an observation that the picture shows; None without perception by a camera."""
    flags = observation.get("landmarks_in_view")
    return None if flags is None else [mark for mark in landmarks if flags[mark.row]]


def nearest_landmark(
    observation: ObservationMapping, landmarks: Sequence[SeenLandmark], x: float, y: float
) -> SeenLandmark | None:
    """Returns the landmark of an observation that is closest to a point [m]; None if none is in view from there."""
    shown = landmarks_in_view(observation, landmarks)
    seen = landmarks if shown is None else shown
    near = [mark for mark in seen if abs(mark.x - x) < IN_VIEW and abs(mark.y - y) < IN_VIEW]
    return min(near, key=lambda mark: (pm.hypot(mark.x - x, mark.y - y), mark.row), default=None)


@dataclass(frozen=True, kw_only=True)
class SeenSubgoal:
    """Subgoal with its current status; `landmark` is a row of the landmarks."""

    index: int
    live: bool
    landmark: int
    status: GoalStatus
    reached: bool
    allowed: bool
    can_trigger: bool = False
    can_delete: bool = False
    can_change: bool = False

    @property
    def open(self) -> bool:
        """Returns whether the subgoal counts and has not been reached."""
        return self.live and not self.reached


@dataclass(frozen=True, kw_only=True)
class SeenObject:
    """Object in sight: its class, position [m], distance [m], length and width [m]."""

    kind: ObjectClass
    x: float
    y: float
    distance: float
    length: float = 0.0
    width: float = 0.0

    @property
    def prop(self) -> PropKind | None:
        """The kind of prop whose size this is; None for objects other than props."""
        if self.kind is not ObjectClass.STATIC:
            return None
        return min(PropKind, key=lambda kind: abs(kind.length - self.length) + abs(kind.width - self.width))


def street_of(observation: ObservationMapping, town: Town, lane: int) -> StreetName:
    """Returns the name of the street that a lane belongs to; UNKNOWN if it has none."""
    street = town.lanes[lane].street
    names = observation["street_names"]
    return StreetName(int(names[street])) if 0 <= street < len(names) else StreetName.UNKNOWN


def titles_of(observation: ObservationMapping, town: Town) -> StreetTitles:
    """Returns the names that the map has for the streets, for texts that people or language models read."""
    return _titles(tuple(observation["street_names"].tolist()), town) if any(town.street_titles) else NO_TITLES


@lru_cache(maxsize=64)
def _titles(street_names: tuple[int, ...], town: Town) -> StreetTitles:
    return StreetTitles([StreetName(name) for name in street_names], town.street_titles)


def read_landmarks(observation: ObservationMapping, town: Town) -> tuple[SeenLandmark, ...]:
    """Returns the rows of `landmarks` in use."""
    return _landmarks(_bytes(observation["landmarks"]), tuple(observation["street_names"].tolist()), town)


@lru_cache(maxsize=64)
def _landmarks(table: bytes, street_names: tuple[int, ...], town: Town) -> tuple[SeenLandmark, ...]:
    column = LandmarkColumn
    return tuple(
        SeenLandmark(
            row=k,
            name=LandmarkName(int(row[column.NAME])),
            x=row[column.X],
            y=row[column.Y],
            lane=int(row[column.LANE]),
            station=row[column.STATION],
            street=street_of({"street_names": street_names}, town, int(row[column.LANE])),
        )
        for k, row in enumerate(_rows(table, len(column)))
        if row[column.NAME] > 0
    )


def read_subgoals(observation: ObservationMapping) -> tuple[SeenSubgoal, ...]:
    """Returns all rows of `subgoals`; rows that are not in use are not live."""
    return _subgoals(_bytes(observation["subgoals"]))


@lru_cache(maxsize=256)
def _subgoals(table: bytes) -> tuple[SeenSubgoal, ...]:
    column = SubgoalColumn
    return tuple(
        SeenSubgoal(
            index=k,
            live=bool(row[column.LIVE]),
            landmark=int(row[column.LANDMARK]),
            status=GoalStatus(int(row[column.STATUS])),
            reached=bool(row[column.REACHED]),
            allowed=bool(row[column.ALLOWED]),
            can_trigger=bool(row[column.CAN_TRIGGER]),
            can_delete=bool(row[column.CAN_DELETE]),
            can_change=bool(row[column.CAN_CHANGE]),
        )
        for k, row in enumerate(_rows(table, len(column)))
    )


def _bytes(table: ArrayLike) -> bytes:
    """Returns a table as a cache key; most tables are the same at successive decisions."""
    return np.asarray(table, dtype=np.float64).tobytes()


def _rows(table: bytes, columns: int) -> list[list[float]]:
    rows: list[list[float]] = np.frombuffer(table).reshape(-1, columns).tolist()
    return rows


def read_objects(observation: ObservationMapping) -> tuple[SeenObject, ...]:
    """Returns the rows of `objects` in use, nearest first."""
    column = ObjectColumn
    rows: list[list[float]] = observation["objects"].tolist()
    return tuple(
        SeenObject(
            kind=ObjectClass(int(row[column.KIND])),
            x=row[column.X],
            y=row[column.Y],
            distance=row[column.DISTANCE],
            length=row[column.LENGTH],
            width=row[column.WIDTH],
        )
        for row in rows
        if row[column.KIND] > 0
    )


def weather(observation: ObservationMapping, parameter: WeatherParameter) -> float:
    """Returns a parameter of the weather, in its own unit."""
    return float(observation["weather"][_WEATHER_COLUMN[parameter]])


def is_foggy(observation: ObservationMapping) -> bool:
    """Returns whether fog limits the view."""
    return weather(observation, WeatherParameter.FOG_DENSITY) > FOG_LIMIT


def is_rainy(observation: ObservationMapping) -> bool:
    """Returns whether it rains heavily."""
    return weather(observation, WeatherParameter.PRECIPITATION) > RAIN_LIMIT


def is_dark(observation: ObservationMapping) -> bool:
    """Returns whether the sun is below the horizon."""
    return weather(observation, WeatherParameter.SUN_ALTITUDE_ANGLE) < 0.0


def scalar(observation: ObservationMapping, name: str) -> float:
    """Returns the value of a field of one number."""
    value = observation[name]
    if isinstance(value, np.ndarray) and value.size == 1:
        return float(value.item())
    return float(np.asarray(value).reshape(-1)[0])


def place_on_lanes(
    town: Town, lanes: Sequence[int], x: float, y: float, width: float = 2.0
) -> tuple[int, float] | None:
    """Returns the first of the given lanes on which a point lies, and the distance along it; None if it lies on none.

    Args:
        town: the map.
        lanes: lanes to try, in order.
        x: position [m].
        y: position [m].
        width: largest distance from the centre line [m].
    """
    point = np.array([x, y])
    for lane in lanes:
        if not may_be_near(town, lane, x, y, width + 1.0):
            continue
        station, lateral = town.lanes[lane].project(point)
        end = town.lanes[lane].position(station)
        if abs(lateral) <= width and pm.hypot(end[0] - x, end[1] - y) <= width + 1.0:
            return lane, station
    return None


def place_on_path(town: Town, observation: ObservationMapping, ahead: float) -> tuple[int, float] | None:
    """Returns lane and station of a point ahead on the path that the Ad-Wizard sees; None beyond the path's end.

    Args:
        town: the map.
        observation: observation of the Ad-Wizard.
        ahead: distance along the path [m].
    """
    start = scalar(observation, "station") + ahead
    lane, station = place_ahead(town.lanes, observation["path_lanes"].tolist(), int(observation["lane"]), start)
    return (lane, station) if lane >= 0 else None


class LaneLength(Protocol):
    """Lane of a town or of its arrays."""

    @property
    def length(self) -> float:
        """Length [m]."""
        ...


def place_ahead(lanes: Rows[LaneLength], path: Rows[int], lane: int, ahead: float) -> tuple[int, float]:
    """Returns lane and station of a place on a path; the lane is -1 beyond its end, or if the path starts elsewhere.

    Args:
        lanes: lanes of the town.
        path: 1 + index of each lane of the path, padded with 0.
        lane: lane of the car.
        ahead: distance from the start of that lane [m].
    """
    for k in range(len(path)):
        number = path[k] - 1
        if number < 0 or (k == 0 and number != lane):
            break
        length = lanes[number].length
        if ahead <= length:
            return number, ahead
        ahead -= length
    return -1, 0.0
