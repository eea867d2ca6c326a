"""All lanes of a town cut into samples, so that questions about what lies beside or above them are array work."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.world.graphics.shapes import right_of, sample, side_line, widths_at
from dorothie_gym.world.town.model import Array, Town

STEP = 2.0  # [m] between samples, at most


@dataclass(frozen=True, eq=False)
class Samples:
    """Places on lanes, lane after lane and along each.

    Attributes:
        lane: index of the lane (n,).
        station: distance along it (n,) [m].
        heading: (n,) [rad].
        half_width: of the lane (n,) [m].
        centre: on its centre line (n, 3) [m].
        bounds: of each lane, its first sample and the one after its last (lanes, 2).
    """

    lane: NDArray[np.int64]
    station: Array
    heading: Array
    half_width: Array
    centre: Array
    bounds: NDArray[np.int64]

    @classmethod
    def of(cls, town: Town) -> Samples:
        """Samples every lane of a town about every two metres, its ends included."""
        columns: list[list[Array]] = [[], [], [], []]
        owners, bounds, count = [], [], 0
        for lane in town.lanes:
            s = sample(lane, 0.0, lane.length, STEP)
            xyz = np.column_stack((side_line(lane, s, 0.0), np.interp(s, lane.stations, lane.points[:, 2])))
            heading = np.interp(s, lane.stations, lane.headings)
            for column, value in zip(columns, (s, heading, widths_at(lane, s) / 2.0, xyz), strict=True):
                column.append(value)
            owners.append(np.full(len(s), lane.id, dtype=np.int64))
            bounds.append((count, count + len(s)))
            count += len(s)
        station, heading, half, centre = (np.concatenate(column) for column in columns)
        return cls(np.concatenate(owners), station, heading, half, centre, np.array(bounds, dtype=np.int64))

    def edge(self, sign: float) -> Array:
        """Points (n, 2) [m] on the right (+1) or left (-1) edges."""
        return np.asarray(self.centre[:, :2] + sign * self.half_width[:, None] * right_of(self.heading))

    def of_lanes(self, wanted: NDArray[np.bool_]) -> NDArray[np.int64]:
        """Indices of the samples of the lanes that are wanted (lanes,)."""
        return np.flatnonzero(wanted[self.lane])
