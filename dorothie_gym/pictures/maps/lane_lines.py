"""Lines between lanes, and the crossings of wheels with them."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.model import LEVEL_HEIGHT
from dorothie_gym.pictures.maps.borders import BorderKind, find_borders
from dorothie_gym.pictures.maps.shapes import TownSamples
from dorothie_gym.session.car_sensors import LaneMarking

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.maps.town import Town

_ORDER: Final = tuple(BorderKind[marking.name] for marking in LaneMarking)
"""Kinds of lines, in the order of `LaneMarking`."""

_NEAR = 3.0  # [m] around the path of the wheels in which lines are looked for


class LaneLines:
    """Lines along the lanes of a town, outside junctions."""

    def __init__(self, town: Town) -> None:
        lines = [line for line in find_borders(town, TownSamples.of(town)).lines if line.kind in _ORDER]
        nothing = np.zeros((0, 3))
        self._begins = np.concatenate([nothing, *(line.points[:-1] for line in lines)])
        self._ends = np.concatenate([nothing, *(line.points[1:] for line in lines)])
        kinds = [np.full(len(line.points) - 1, _ORDER.index(line.kind)) for line in lines]
        self._kinds: NDArray[np.int64] = np.concatenate([np.zeros(0, np.int64), *kinds])

    def crossed(self, paths: Array, height: float) -> NDArray[np.int8]:
        """Returns the kinds of lines that paths cross, as flags (4,) in the order of `LaneMarking`.

        Args:
            paths: successive places of each wheel (wheels, n, 2) [m].
            height: height of the road [m].
        """
        flags = np.zeros(len(_ORDER), np.int8)
        low, high = paths.min(axis=(0, 1)) - _NEAR, paths.max(axis=(0, 1)) + _NEAR
        least, most = np.minimum(self._begins, self._ends), np.maximum(self._begins, self._ends)
        near = np.flatnonzero(
            (most[:, :2] >= low).all(axis=1)
            & (least[:, :2] <= high).all(axis=1)
            & (np.abs(least[:, 2] - height) <= LEVEL_HEIGHT)
        )
        if len(near):
            begins, ends = paths[:, :-1].reshape(-1, 1, 2), paths[:, 1:].reshape(-1, 1, 2)
            one, two = self._begins[near, :2], self._ends[near, :2]
            crossed = (_side(begins, ends, one) != _side(begins, ends, two)) & (
                _side(one, two, begins) != _side(one, two, ends)
            )
            moved = (begins != ends).any(axis=-1)
            flags[self._kinds[near[(crossed & moved).any(axis=0)]]] = 1
        return flags


def _side(begin: Array, end: Array, place: Array) -> NDArray[np.bool_]:
    """Returns whether places lie to the right of the directed lines through two points."""
    along, away = end - begin, place - begin
    return np.asarray(along[..., 0] * away[..., 1] - along[..., 1] * away[..., 0] > 0.0)


@lru_cache(maxsize=8)
def lane_lines(town: Town) -> LaneLines:
    """Returns the lines of a town, which are found once."""
    return LaneLines(town)
