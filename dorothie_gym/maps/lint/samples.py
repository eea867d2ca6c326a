"""Samples along all lanes of a town as arrays, for checks that compare lanes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from dorothie_gym.maps.model import Array
from dorothie_gym.support import portable_arrays as pn

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town

SAMPLE_SPACING = 1.0
"""Largest distance between samples of a lane [m]."""

SAME_GROUND = 0.5
"""Largest difference of height of points on the same ground [m]: bridges are thicker than this."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LaneSamples:
    """Samples of all lanes, lane by lane in driving direction.

    Attributes:
        owner: lane id of each sample (n,).
        points: positions on the centre lines (n, 2) [m].
        heights: (n,) [m].
        along: unit direction vectors of the lanes (n, 2).
        widths: (n,) [m].
        first: index of the first sample of each lane, and n (lanes + 1,).
    """

    owner: NDArray[np.intp]
    points: Array
    heights: Array
    along: Array
    widths: Array
    first: NDArray[np.intp]

    @cached_property
    def right(self) -> Array:
        """Unit vectors to the right of the lanes (n, 2)."""
        return np.column_stack((-self.along[:, 1], self.along[:, 0]))

    @cached_property
    def tree(self) -> cKDTree:
        """Search tree over `points`."""
        return cKDTree(self.points)

    def rows(self, lane: int) -> slice:
        """Returns the range of samples of one lane."""
        return slice(int(self.first[lane]), int(self.first[lane + 1]))


def sample_lanes(town: Town) -> LaneSamples:
    """Samples every lane at both ends and at most `SAMPLE_SPACING` apart in between."""
    rows = []
    for lane in town.lanes:
        s = np.linspace(0.0, lane.length, max(2, int(np.ceil(lane.length / SAMPLE_SPACING)) + 1))
        columns = (*lane.points.T, lane.headings, lane.widths)
        rows.append(np.column_stack([np.interp(s, lane.stations, column) for column in columns]))
    counts = [len(row) for row in rows]
    table = np.concatenate(rows)  # (n, 5)
    return LaneSamples(
        owner=np.repeat(np.arange(len(rows)), counts),
        points=np.ascontiguousarray(table[:, :2]),
        heights=table[:, 2],
        along=np.column_stack((pn.cos(table[:, 3]), pn.sin(table[:, 3]))),
        widths=table[:, 4],
        first=np.concatenate(([0], np.cumsum(counts))),
    )
