"""Where the lanes of a town are, to keep people off them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from dorothie_gym.world.town.model import Array, Town

LEVEL = 2.0
"""Lanes that are farther above or below than this are no matter [m]."""

SAMPLE = 0.5
"""Step in which lanes, and lines between places, are sampled [m]."""


class LaneEdges:
    """Lanes as discs on their centre lines, as wide as they are."""

    def __init__(self, town: Town) -> None:
        rows = []
        for lane in town.lanes:
            at = np.linspace(0.0, lane.length, max(2, math.ceil(lane.length / SAMPLE) + 1))
            rows.append(
                np.column_stack(
                    [np.interp(at, lane.stations, column) for column in (*lane.points.T, lane.widths / 2)]
                )
            )  # fmt: skip
        self._discs = np.concatenate(rows)  # (n, 4) x, y, z, radius
        self._tree = cKDTree(self._discs[:, :2])
        self._widest = float(self._discs[:, 3].max())

    def height(self, place: Array) -> float:
        """Height of the road that is nearest to a place (2,) [m]."""
        return float(self._discs[int(self._tree.query(place)[1]), 2])

    def is_clear(self, ends: Sequence[Array] | Array, height: float, margin: float) -> bool:
        """Whether a straight line between two places keeps off all lanes by a margin [m]."""
        first, last = ends[0][:2], ends[1][:2]
        count = max(2, math.ceil(float(np.hypot(*(last - first))) / SAMPLE) + 1)
        share = np.linspace(0.0, 1.0, count)[:, None]
        places = (1.0 - share) * first + share * last
        return bool(self.free(np.column_stack((places, np.full(len(places), height))), margin).all())

    def free(self, places: Array, margin: float) -> NDArray[np.bool_]:
        """Which places (n, 3) keep off all lanes of their height by a margin [m]."""
        near: Any = self._tree.query_ball_point(places[:, :2], self._widest + margin, return_sorted=False)
        counts = np.fromiter((len(discs) for discs in near), dtype=np.int64, count=len(places))
        free = np.ones(len(places), dtype=bool)
        if not counts.any():
            return free
        owners = np.repeat(np.arange(len(places)), counts)
        discs = self._discs[np.concatenate([np.asarray(found, dtype=np.int64) for found in near if found])]
        gaps = np.hypot(*(discs[:, :2] - places[owners, :2]).T)
        free[owners[(gaps < discs[:, 3] + margin) & (np.abs(discs[:, 2] - places[owners, 2]) < LEVEL)]] = False
        return free
