"""highway-env's `Kinematics` and `OccupancyGrid` without what takes most of the time of a step in a compiled world.

That are data frames with a few rows, and looking at each point of each lane of a town to see which cells have a road.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from highway_env.envs.common.observation import KinematicObservation, ObservationType, OccupancyGridObservation
from highway_env.utils import lmap
from numpy.typing import NDArray

from dorothie_gym.world.town.model import Array


class Kinematics(KinematicObservation):
    """The same rows to the last bit: the observer, then those close to it, each feature scaled to [-1, 1]."""

    def observe(self) -> NDArray[np.float32]:
        """Rows (`vehicles_count`, features); zeros where nobody is, NaN for what a foreign object does not tell."""
        if not self.env.road:
            return np.zeros((self.vehicles_count, len(self.features)), dtype=np.float32)
        observer = self.observer_vehicle
        close = self.env.road.close_objects_to(
            observer,
            self.env.PERCEPTION_DISTANCE,
            count=self.vehicles_count - 1,
            see_behind=self.see_behind,
            sort=self.order == "sorted",
            vehicles_only=not self.include_obstacles,
        )
        origin = None if self.absolute else observer
        told = [observer.to_dict()]
        for other in close[: self.vehicles_count - 1]:
            told.append(other.to_dict(origin, observe_intentions=self.observe_intentions))
        rows = np.zeros((self.vehicles_count, len(self.features)))
        rows[: len(told)] = [[row.get(feature, math.nan) for feature in self.features] for row in told]
        if self.normalize:
            self._scale(rows[: len(told)])
        if self.order == "shuffled":
            self.env.np_random.shuffle(rows[1:])
        return rows.astype(np.float32)

    def _scale(self, rows: Array) -> None:
        """Maps the features' ranges to [-1, 1] in place; highway-env chooses these at the first observation."""
        if not self.features_range:
            self.normalize_obs({})  # a table without columns: it sets the ranges and has nothing to scale
        for column, feature in enumerate(self.features):
            if feature in self.features_range:
                values = rows[:, column]
                values[:] = lmap(values, self.features_range[feature], [-1, 1])
                if self.clip:
                    np.clip(values, -1, 1, out=values)


class OccupancyGrid(OccupancyGridObservation):
    """The same cells; of those without a value images show 0, for which highway-env leaves it to the machine."""

    def observe(self) -> NDArray[Any]:
        """A grid (features, cells along, cells across) around the observer: float32, or uint8 for images."""
        if not self.env.road or self.absolute:
            return np.asarray(super().observe())  # nothing yet, or an error that there is no such grid
        self.grid.fill(np.nan)
        rows = [vehicle.to_dict(self.observer_vehicle) for vehicle in self.env.road.vehicles]
        self.normalize({})  # a table without columns: it sets the ranges and has nothing to scale
        cells = [self._cell(row) for row in rows]
        told = {feature for row in rows for feature in row}
        for layer, feature in enumerate(self.features):
            if feature in told:
                self._fill(layer, feature, rows, cells)
            elif feature == "on_road":
                self.fill_road_layer_by_lanes(layer)
        shown = np.clip(self.grid, -1, 1) if self.clip else self.grid
        grid: Array = np.nan_to_num(shown, nan=-1.0 if self.as_image else 0.0)
        if self.as_image:
            return ((np.clip(grid, -1, 1) + 1) / 2 * 255).astype(np.uint8)
        return grid.astype(np.float32)

    def _cell(self, row: dict[str, float]) -> tuple[int, int] | None:
        """Where a vehicle is in the grid, or None. highway-env takes it from scaled features and back."""
        place = [self._there_and_back(row[name], name) for name in ("x", "y")]
        along, across = self.pos_to_index(place, relative=True)
        if 0 <= along < self.grid.shape[-2] and 0 <= across < self.grid.shape[-1]:
            return along, across
        return None

    def _there_and_back(self, value: float, feature: str) -> float:
        limits = self.features_range.get(feature)
        return value if limits is None else float(lmap(lmap(value, limits, [-1, 1]), [-1, 1], limits))

    def _fill(
        self, layer: int, feature: str, rows: list[dict[str, float]], cells: list[tuple[int, int] | None]
    ) -> None:
        limits = self.features_range.get(feature)
        for row, cell in zip(rows[::-1], cells[::-1], strict=True):
            if cell is not None:
                value = row.get(feature, math.nan)
                self.grid[layer, *cell] = value if limits is None else lmap(value, limits, [-1, 1])

    def fill_road_layer_by_lanes(self, layer_index: int, lane_perception_distance: float = 100) -> None:
        """Sets the cells that points of lanes fall into to 1; only lanes that reach into the grid are looked at.

        Args:
            layer_index: of the grid.
            lane_perception_distance: points are looked at so far along each lane before and behind the observer [m].
        """
        spacing, network, place = np.amin(self.grid_step), self.env.road.network, self.observer_vehicle.position
        reach = float(np.linalg.norm(np.abs(self.grid_size).max(axis=1)))
        boxes = network.table.boxes  # (n, 4): least x, least y, greatest x, greatest y
        near = (boxes[:, :2] <= place + reach).all(axis=1) & (boxes[:, 2:] >= place - reach).all(axis=1)
        lanes = network.lanes_list()
        for row in np.flatnonzero(near).tolist():
            lane = lanes[row]
            start, _ = lane.local_coordinates(place)
            stations = np.arange(start - lane_perception_distance, start + lane_perception_distance, spacing)
            points = lane.positions(stations.clip(0, lane.length)) - place  # (m, 2)
            if self.align_to_vehicle_axes:
                cos, sin = np.cos(self.observer_vehicle.heading), np.sin(self.observer_vehicle.heading)
                points = points @ np.array([[cos, -sin], [sin, cos]])
            cells = np.floor((points - self.grid_size[:, 0]) / self.grid_step).astype(int)
            inside = ((cells >= 0) & (cells < self.grid.shape[-2:])).all(axis=1)
            self.grid[layer_index, cells[inside, 0], cells[inside, 1]] = 1


def quicken(kind: Any) -> None:
    """Lets highway-env's observation type, and those that it consists of, observe in the quick ways of this module."""
    for part in parts_of(kind):
        quick = _QUICK.get(type(part))
        if quick is not None:
            part.__class__ = quick  # they differ in what they do, not in what they keep


def parts_of(kind: Any) -> list[Any]:
    """A type of observation and those that it consists of."""
    parts = [*getattr(kind, "observation_types", ()), *getattr(kind, "agents_observation_types", ())]
    return [kind, *(found for part in parts for found in parts_of(part))]


_QUICK: dict[type[ObservationType], type[ObservationType]] = {
    KinematicObservation: Kinematics,
    OccupancyGridObservation: OccupancyGrid,
}
