"""Observations of `Town-v0`: those of highway-env, faster, and with defined values where highway-env has none."""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from highway_env.envs.common.graphics import EnvViewer
from highway_env.envs.common.observation import (
    GrayscaleObservation,
    KinematicObservation,
    ObservationType,
    OccupancyGridObservation,
)
from highway_env.utils import lmap
from numpy.typing import NDArray

from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support.copying import CachedViews

if TYPE_CHECKING:
    from collections.abc import Sequence

    from dorothie_gym.maps.model import Array


class Kinematics(KinematicObservation):
    """highway-env's `Kinematics`, bit for bit, with one scaling per column instead of one per vehicle."""

    def observe(self) -> NDArray[np.float32]:
        """Returns rows (`vehicles_count`, features); zeros for missing ones, NaN for features that an object lacks."""
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
        near, intentions = close[: self.vehicles_count - 1], self.observe_intentions
        rows_of = [observer.to_dict(), *(other.to_dict(origin, observe_intentions=intentions) for other in near)]
        rows = np.zeros((self.vehicles_count, len(self.features)))
        rows[: len(rows_of)] = [[row.get(feature, math.nan) for feature in self.features] for row in rows_of]
        if self.normalize:
            self._scale(rows[: len(rows_of)])
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
    """highway-env's `OccupancyGrid` with a defined value, 0, of empty cells in images."""

    def observe(self) -> NDArray[np.float32] | NDArray[np.uint8]:
        """Returns a grid (features, cells along, cells across) around the observer: float32, or uint8 for images."""
        if not self.env.road or self.absolute:
            return np.asarray(super().observe())  # no road yet, or highway-env's error for an absolute grid
        self.grid.fill(np.nan)
        rows = [vehicle.to_dict(self.observer_vehicle) for vehicle in self.env.road.vehicles]
        self.normalize({})  # a table without columns: it sets the ranges and has nothing to scale
        cells = [self._cell(row) for row in rows]
        known = {feature for row in rows for feature in row}
        for layer, feature in enumerate(self.features):
            if feature in known:
                self._fill(layer, feature, rows, cells)
            elif feature == "on_road":
                self.fill_road_layer_by_lanes(layer)
        shown = np.clip(self.grid, -1, 1) if self.clip else self.grid
        grid: Array = np.nan_to_num(shown, nan=-1.0 if self.as_image else 0.0)
        if self.as_image:
            return ((np.clip(grid, -1, 1) + 1) / 2 * 255).astype(np.uint8)
        return grid.astype(np.float32)

    def _cell(self, row: dict[str, float]) -> tuple[int, int] | None:
        """Returns the cell of a vehicle, or None. highway-env takes it from scaled features and back."""
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
        """Sets the cells of points of lanes to 1; only lanes that reach into the grid are sampled.

        Args:
            layer_index: index of the layer of the grid.
            lane_perception_distance: range along each lane ahead of and behind the observer that is sampled [m].
        """
        spacing, network, place = np.amin(self.grid_step), self.env.road.network, self.observer_vehicle.position
        reach = float(np.linalg.norm(np.abs(self.grid_size).max(axis=1)))
        boxes = network.table.boxes  # (n, 4): minimum x, minimum y, maximum x, maximum y
        near = (boxes[:, :2] <= place + reach).all(axis=1) & (boxes[:, 2:] >= place - reach).all(axis=1)
        lanes = network.lanes_list()
        for row in np.flatnonzero(near).tolist():
            lane = lanes[row]
            start, _ = lane.local_coordinates(place)
            stations = np.arange(start - lane_perception_distance, start + lane_perception_distance, spacing)
            points = lane.positions(stations.clip(0, lane.length)) - place  # (m, 2)
            if self.align_to_vehicle_axes:
                cos, sin = pn.cos(self.observer_vehicle.heading), pn.sin(self.observer_vehicle.heading)
                points = points @ np.array([[cos, -sin], [sin, cos]])
            cells = np.floor((points - self.grid_size[:, 0]) / self.grid_step).astype(int)
            inside = ((cells >= 0) & (cells < self.grid.shape[-2:])).all(axis=1)
            self.grid[layer_index, cells[inside, 0], cells[inside, 1]] = 1


def use_faster_observations(kind: ObservationType) -> None:
    """Replaces the classes of highway-env's observation type and its parts by the faster ones of this module."""
    for part in parts_of(kind):
        faster = _FASTER.get(type(part))
        if faster is not None:
            part.__class__ = faster  # the subclass adds no attributes


def parts_of(kind: ObservationType) -> list[ObservationType]:
    """Returns an observation type and the types that it consists of."""
    parts = [*getattr(kind, "observation_types", ()), *getattr(kind, "agents_observation_types", ())]
    return [kind, *(found for part in parts for found in parts_of(part))]


class Grayscale(CachedViews, GrayscaleObservation):
    """highway-env's `GrayscaleObservation`, whose viewer is recreated in copies."""

    CACHED_VIEWS: ClassVar[Sequence[str]] = ("viewer",)

    def __getstate__(self) -> dict[str, object]:
        return {**super().__getstate__(), "_viewed": self.viewer.config}

    @cached_property
    def viewer(self) -> EnvViewer:
        """highway-env's viewer, which also draws under SDL's dummy video driver, where its own would show black."""
        viewer = EnvViewer(self.env, config=self._viewed)
        viewer.enabled = True
        return viewer


_FASTER: dict[type[ObservationType], type[ObservationType]] = {
    GrayscaleObservation: Grayscale,
    KinematicObservation: Kinematics,
    OccupancyGridObservation: OccupancyGrid,
}
