"""The watch over the rules, on given poses."""

from __future__ import annotations

import numpy as np

from dorothie_gym.maps.model import Array
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.state.world_arrays import empty_world
from dorothie_gym.sim.traffic.parameters import CAR_LENGTH, MAX_SUBSTEPS
from dorothie_gym.sim.traffic_rules import WorldEvent, WorldEventLog, watch


class TrajectoryWatch(WorldEventLog):
    """Watch over a car in a world that holds nothing else."""

    def __init__(self, network: TownNetwork) -> None:
        self._town_arrays = town_arrays(network)
        self.arrays = empty_world(self._town_arrays, vehicles=1, pedestrians=0, driven=True)
        self.arrays.vehicles["length"] = CAR_LENGTH
        super().__init__(network, self)

    def look(self, poses: Array, frame: int) -> list[WorldEvent]:
        """Returns the breaches on a trajectory (n + 1, 6), columns `records.POSE`.

        The first pose is that of `frame`, and the last one of the stretch before.
        """
        for first in range(0, len(poses) - 1, MAX_SUBSTEPS):
            part = poses[first : first + MAX_SUBSTEPS + 1]
            self.arrays.poses[: len(part)] = part
            self.arrays.car["frames"], self.arrays.car["breaches"] = len(part) - 1, 0
            self.arrays.clock["frame"] = frame + first + len(part) - 1
            watch(self._town_arrays, self.arrays)
            self.note(0, int(self.arrays.car["breaches"][0]))
        return self.take()

    @property
    def total(self) -> int:
        """Number of breaches so far."""
        return int(np.sum(self.counts))
