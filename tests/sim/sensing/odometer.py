"""A localizer that is driven along given poses."""

from __future__ import annotations

import numpy as np

from dorothie_gym.maps.model import Array
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.sim.sensing.localizer import Localizer, localize, switch_on
from dorothie_gym.sim.state.town_arrays import empty_town
from dorothie_gym.sim.state.world_arrays import empty_world
from dorothie_gym.sim.traffic.parameters import MAX_SUBSTEPS


class CarriedLocalizer(Localizer):
    """Localizer in a world that holds nothing else."""

    def __init__(self, x: float, y: float, heading: float, rng: np.random.Generator) -> None:
        self.arrays = empty_world(empty_town(), vehicles=1, pedestrians=0, driven=True)
        car = self.arrays.vehicles[0]
        car.x, car.y, car.heading = x, y, heading
        switch_on(self.arrays, rng)
        super().__init__(self)

    def carry(self, track: Array, frame: int, *, gps_from: int = 0) -> None:
        """Carries the localizer along a track (n + 1, 3); `frame` is the number of the first pose's frame."""
        self.lose_gps(gps_from)
        for first in range(0, len(track) - 1, MAX_SUBSTEPS):
            part = track[first : first + MAX_SUBSTEPS + 1, :3]
            self.arrays.poses[: len(part), :3] = part
            self.arrays.car["frames"], self.arrays.clock["frame"] = len(part) - 1, frame + first + len(part) - 1
            localize(self.arrays, 1.0 / FRAME_RATE)
