"""A lane of a town as a highway-env lane."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import TypedDict

import numpy as np
from highway_env.road.lane import AbstractLane, LineType
from highway_env.utils import get_class_path
from numpy.typing import NDArray

from dorothie_gym.maps import model
from dorothie_gym.maps.model import Array, Lane, LaneTable
from dorothie_gym.support.copying import shared


class TownLaneConfig(TypedDict):
    """Lane of a town as JSON."""

    id: int
    road_id: int
    lane_id: int
    junction_id: int
    points: list[list[float]]
    widths: list[float]
    speed_limit: float
    street: int


class PolylineLaneConfig(TypedDict):
    """Arguments of a `PolylineLane` as JSON."""

    town_lane: TownLaneConfig
    line_types: list[int]
    forbidden: bool
    priority: int


class LaneConfig(TypedDict):
    """Lane as highway-env's `lane_from_config` reads it."""

    class_path: str
    config: PolylineLaneConfig


@shared
class PolylineLane(AbstractLane):
    """A lane of a town for the vehicles, observations and viewer of highway-env.

    Stations and lateral distances are metres along and to the right of the centre line; before the start and after the
    end, the lane is extended straight. A lane never changes after it is built, so that copies return the lane itself.

    Attributes:
        town_lane: the town's lane.
        length: [m].
        width: width at the start [m].
        line_types: marks on the left and right side (`highway_env.road.lane.LineType`).
        forbidden: whether vehicles must not change to this lane.
        priority: right of way, as highway-env ranks it.
        speed_limit: [m/s].
        row: row of the lane in the table that it measures with.
    """

    def __init__(
        self,
        town_lane: Lane | TownLaneConfig,
        *,
        line_types: Sequence[int] | None = None,
        forbidden: bool = False,
        priority: int = 0,
    ) -> None:
        """Builds a lane with a table of its own; `TownNetwork` makes it share the network's.

        Args:
            town_lane: lane of a town, or the dict that `to_config` wrote for one.
            line_types: marks on the left and right; none in junctions and continuous elsewhere by default.
            forbidden: whether vehicles must not change to this lane.
            priority: right of way.
        """
        lane = town_lane if isinstance(town_lane, Lane) else _lane_of(town_lane)
        mark = LineType.NONE if lane.in_junction else LineType.CONTINUOUS
        self.town_lane = lane
        self.length = lane.length
        self.width = float(lane.widths[0])
        self.line_types = list(line_types) if line_types is not None else [mark, mark]
        self.forbidden = forbidden
        self.priority = priority
        self.speed_limit = lane.speed_limit
        self.share(LaneTable.of([lane]), 0)

    def share(self, table: LaneTable, row: int) -> None:
        """Measures with a row of a table that other lanes also use."""
        self.row = row
        self._points, self._offsets, self._ends = table.points, table.offsets, table.ends
        shape = self._points, self._offsets, self._ends, row
        # Bound once: highway-env calls these for every lane and stripe that it draws.
        self._local = functools.partial(model.local_coordinates, *shape)
        self._place = functools.partial(model.position, *shape)
        self._value = functools.partial(model.value_at, self._points, self._offsets, row)
        self._distance = functools.partial(model.distance, *shape)

    def position(self, longitudinal: float, lateral: float = 0.0) -> Array:
        """Returns the world position (2,) [m] at a station and a distance to the right."""
        return np.array(self._place(float(longitudinal), float(lateral)))

    def heading_at(self, longitudinal: float) -> float:
        """Returns the direction of the lane [rad], beyond its ends that of the end."""
        return float(self._value(model.HEADING, float(longitudinal)))

    def width_at(self, longitudinal: float) -> float:
        """Returns the width of the lane [m]."""
        return float(self._value(model.WIDTH, float(longitudinal)))

    def height_at(self, longitudinal: float) -> float:
        """Returns the height of the lane [m]."""
        return float(self._value(model.HEIGHT, float(longitudinal)))

    def local_coordinates(self, position: Array) -> tuple[float, float]:
        """Returns the station and signed distance to the right [m] of a world position (2,)."""
        station, lateral = self._local(float(position[0]), float(position[1]))
        return station, lateral

    def distance(self, position: Array) -> float:
        """Returns |lateral| + overshoot [m] of a world position (2,)."""
        return self.distance_with_heading(position, None)

    def distance_with_heading(self, position: Array, heading: float | None, heading_weight: float = 1.0) -> float:
        """Returns |lateral| + overshoot [m] + `heading_weight` x difference of heading [rad], highway-env's ranking."""
        if heading is None:
            heading, heading_weight = 0.0, 0.0
        cost, _ = self._distance(float(position[0]), float(position[1]), float(heading), float(heading_weight))
        return float(cost)

    def positions(self, stations: Array, lateral: float = 0.0) -> Array:
        """Returns the world positions (n, 2) [m] at many stations (n,), equal to those of `position`."""
        wanted = np.ascontiguousarray(stations, dtype=np.float64)
        return model.positions(self._points, self._offsets, self._ends, self.row, wanted, float(lateral))

    def local_coordinates_many(self, points: NDArray[np.float64]) -> Array:
        """Stations and lateral distances (n, 2) [m] of world positions (n, 2), as `local_coordinates` gives them."""
        places = np.ascontiguousarray(points, dtype=np.float64)
        return model.local_coordinates_many(self._points, self._offsets, self._ends, self.row, places)

    @classmethod
    def from_config(cls, config: PolylineLaneConfig) -> PolylineLane:
        """Builds the lane whose parameters `to_config` wrote under "config"."""
        return cls(**config)

    def to_config(self) -> LaneConfig:
        """Returns the lane as a dict for JSON, which highway-env's `lane_from_config` reads."""
        lane = self.town_lane
        return {
            "class_path": get_class_path(self.__class__),
            "config": {
                "town_lane": {
                    "id": lane.id,
                    "road_id": lane.road_id,
                    "lane_id": lane.lane_id,
                    "junction_id": lane.junction_id,
                    "points": lane.points.tolist(),
                    "widths": lane.widths.tolist(),
                    "speed_limit": lane.speed_limit,
                    "street": lane.street,
                },
                "line_types": list(self.line_types),
                "forbidden": self.forbidden,
                "priority": self.priority,
            },
        }


def _lane_of(config: TownLaneConfig) -> Lane:
    return Lane(
        id=config["id"],
        road_id=config["road_id"],
        lane_id=config["lane_id"],
        junction_id=config["junction_id"],
        points=np.array(config["points"], dtype=np.float64),
        widths=np.array(config["widths"], dtype=np.float64),
        speed_limit=config["speed_limit"],
        street=config["street"],
    )
