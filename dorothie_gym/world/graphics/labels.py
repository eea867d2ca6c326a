"""Where the names of streets go: along the road, upright, clear of junctions and of each other."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from dorothie_gym.world.graphics.axes import Axis, street_axes
from dorothie_gym.world.graphics.fonts import font
from dorothie_gym.world.graphics.obstacles import LEVELS, Obstacles
from dorothie_gym.world.graphics.plan import Plan
from dorothie_gym.world.town.model import Array

_MOST_BENT = 0.9  # [rad] that the line under a name may turn
_TIGHTEST = 2.2  # sizes of type: the smallest radius that letters still stand well on
_ROOM = 0.72  # of the road's width that type may take
_HALF = 0.62  # of a name's height that is kept free on either side of its line
_LONGER = 1.08  # times a name's length of road is taken
_POINTS = 24
_REPEATED = 0.8  # times its size a name may be set again where there is less room


@dataclass(frozen=True, eq=False)
class Label:
    """A name as it stands on the map.

    Attributes:
        text: the name.
        street: index of the street.
        size: height of the type [px].
        path: points (n, 2) [px] along which it is set, from its first letter to its last.
    """

    text: str
    street: int
    size: int
    path: Array


@dataclass
class LabelPlacer:
    """Sets the names of a town's streets.

    Attributes:
        names: by street index.
        scale: [px/m].
        origin: world position of pixel (0, 0) [m].
        frame: left, top, right and bottom [px] that names stay inside.
        sizes: largest and smallest type [px].
        spacing: distance between two settings of the same name [px].
        placed: the names set so far.
        missing: names of streets on which there is no room at all.
    """

    names: Sequence[str]
    scale: float
    origin: Array
    frame: tuple[int, int, int, int]
    sizes: tuple[int, int] = (20, 11)
    spacing: float = 420.0
    placed: list[Label] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)

    def place(self, plan: Plan, fixed: Array) -> list[Label]:
        """Sets every name at least once where its street can be seen, and again where it is long.

        Streets with the least room come first; a name is made smaller before it may touch a junction.

        Args:
            plan: what is painted.
            fixed: circles (n, 3) [px] that no name may touch: x, y, radius.
        """
        obstacles = Obstacles.of(plan, self.scale, self.origin, fixed)
        axes = street_axes(plan, self.scale, self.origin)
        by_street: dict[int, list[Axis]] = {k: [] for k in range(len(self.names))}
        for axis in axes:
            if axis.street in by_street:
                by_street[axis.street].append(axis)
        for row in by_street.values():
            row.sort(key=lambda axis: -axis.length)
            for axis in row:
                axis.clear = obstacles.clearances(axis)
        order = sorted(by_street, key=lambda k: (sum(axis.length for axis in by_street[k]), k))
        self.placed, self.missing = [], []
        for street in order:
            if not self._place_first(street, by_street[street], axes):
                self.missing.append(self.names[street])
        for street in order:
            first = next((label for label in self.placed if label.street == street), None)
            if first is None:
                continue
            forced = first.size == self.sizes[1]
            for size in dict.fromkeys((first.size, max(self.sizes[1], round(_REPEATED * first.size)))):
                while self._try(street, by_street[street], axes, size, 0, forced):
                    pass
        return self.placed

    def _place_first(self, street: int, own: list[Axis], axes: list[Axis]) -> bool:
        large, small = self.sizes
        # Broad streets have large names; each size is tried on the road's free stretches, then over its arrows.
        shares = (1.0, 0.85, 0.72, 0.6, 0.5, 0.42)
        sizes = list(dict.fromkeys(max(small, round(share * large)) for share in shares))
        tries = [(size, freedom, False) for part in (sizes[:4], sizes[4:]) for freedom in (0, 1) for size in part]
        tries += [(sizes[len(sizes) // 2], 2, False), (small, 2, False)]
        # Rather beyond the road's edges, or on a junction, than not at all.
        tries += [(small, freedom, True) for freedom in range(LEVELS)]
        return any(self._try(street, own, axes, *attempt) for attempt in tries)

    def _try(
        self, street: int, own: list[Axis], axes: list[Axis], size: int, freedom: int, force: bool = False
    ) -> bool:
        text = self.names[street]
        width = font(size, bold=True).size(text)[0] * _LONGER
        for axis in own:
            path = self._window(axis, street, width, size, freedom, force)
            if path is None:
                continue
            label = Label(text, street, size, _upright(path))
            self.placed.append(label)
            tree = cKDTree(label.path)
            for other in axes:
                other.keep_off(tree, _HALF * size)
            return True
        return False

    def _window(self, axis: Axis, street: int, width: float, size: int, freedom: int, force: bool) -> Array | None:
        """The best place on an axis: straight, and near the middle of the stretch that is free."""
        count = int(np.ceil(width / axis.step)) + 1
        if count > len(axis.line):
            return None
        ok = np.minimum(axis.clear[freedom], axis.taken) >= _HALF * size
        if not force:
            ok &= axis.room * _ROOM >= size
        left, top, right, bottom = self.frame
        inside = (axis.line > np.array([left, top]) + size) & (axis.line < np.array([right, bottom]) - size)
        ok &= inside.all(axis=1)
        ok &= np.abs(np.gradient(axis.heading, axis.step)) < 1.0 / (_TIGHTEST * size)
        starts = np.flatnonzero(sliding_window_view(ok, count).all(axis=1))
        if not len(starts):
            return None
        turned = sliding_window_view(axis.heading, count)[starts]
        bent = turned.max(axis=1) - turned.min(axis=1)
        middle = axis.line[starts + count // 2]
        good = bent <= _MOST_BENT
        same = np.array([label.path.mean(axis=0) for label in self.placed if label.street == street]).reshape(-1, 2)
        if len(same):
            good &= np.hypot(*(middle[:, None] - same).transpose(2, 0, 1)).min(axis=1) >= self.spacing
        if not good.any():
            return None
        centred = np.abs(starts - _middle_of_run(starts)) * axis.step
        cost = np.where(good, centred / self.spacing + 1.2 * bent, np.inf)
        first = int(starts[int(np.argmin(cost))])
        return axis.along(first * axis.step + 0.5 * (width - width / _LONGER), width / _LONGER, _POINTS)


def _middle_of_run(starts: NDArray[np.int64]) -> Array:
    """For each of ascending integers (n,), the middle of the run of successive ones that it belongs to."""
    cuts = np.flatnonzero(np.diff(starts) > 1) + 1
    return np.concatenate([np.full(len(run), (run[0] + run[-1]) / 2.0) for run in np.split(starts, cuts)])


def _upright(path: Array) -> Array:
    """The path in the direction in which text on it can be read: to the right, and straight upwards."""
    across = path[-1] - path[0]
    backwards = across[0] < -0.02 * abs(across[1]) or (abs(across[0]) <= 0.02 * abs(across[1]) and across[1] > 0)
    return path[::-1] if backwards else path


def covering(labels: Iterable[Label]) -> Iterator[tuple[float, float, float]]:
    """Circles (x, y, radius) [px] that cover names."""
    for label in labels:
        for x, y in label.path.tolist():
            yield x, y, _HALF * label.size
