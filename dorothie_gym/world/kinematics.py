"""highway-env's `Kinematics`, without its data frames, which take most of the time of a step in a compiled world."""

from __future__ import annotations

import math

import numpy as np
from highway_env.envs.common.observation import KinematicObservation
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
        for other in close[-self.vehicles_count + 1 :]:
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
                low, high = self.features_range[feature]
                values = rows[:, column]
                values[:] = -1 + (values - low) * 2 / (high - low)
                if self.clip:
                    np.clip(values, -1, 1, out=values)
