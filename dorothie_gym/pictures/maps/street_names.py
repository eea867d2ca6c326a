"""Placement of street names along the road: upright, clear of junctions and of each other."""

from __future__ import annotations

import enum
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from dorothie_gym.maps.model import Array, Lane
from dorothie_gym.pictures.maps.markings import ARROW_LENGTH
from dorothie_gym.pictures.maps.medians import pocket_places
from dorothie_gym.pictures.maps.shapes import sample, side_line
from dorothie_gym.pictures.maps.street_axes import Axis, across_junctions, beside_axes, street_axes
from dorothie_gym.pictures.text import font
from dorothie_gym.support import portable_arrays as pn

if TYPE_CHECKING:
    from dorothie_gym.pictures.maps.borders import Border
    from dorothie_gym.pictures.maps.map_layers import MapLayers


class LabelClearance(enum.IntEnum):
    """Obstacles that a label avoids: fewer on each level, but always bridges, pins and signs."""

    ALL = 0
    ARROWS_HIDDEN = 1
    JUNCTIONS_TOUCHED = 2
    JUNCTIONS_CROSSED = 3
    FIXED_ALONE = 4
    OFF_ROAD = 5


_NARROW = 0.4  # share of the width of a junction that counts on the third level
_OTHER_ROAD = 1.5  # [m] between the heights of two crossing roads
_ISLAND = 2.0  # [m] half the width of the hatching before a turn lane
_NEAREST_CIRCLES = 8  # nearest circles to consider


class Obstacles:
    """Circles [px] that labels avoid, by kind and level."""

    def __init__(self, plan: MapLayers, scale: float, origin: Array, fixed: Array) -> None:
        """Collects the circles of a map; `fixed` are circles (n, 3) [px] that count on all levels."""
        lanes = plan.town.lanes

        def circles(rows: Iterable[tuple[Lane, float, float]], widen: float = 1.0) -> Array:
            out = [np.zeros((0, 4))]
            for lane, start, end in rows:
                s = sample(lane, start, end, 2.0)
                points = (side_line(lane, s, 0.0) - origin) * scale
                radius = np.interp(s, lane.stations, lane.widths) / 2.0 * scale * widen
                out.append(np.column_stack((points, radius, np.interp(s, lane.stations, lane.points[:, 2]))))
            return np.concatenate(out)

        # labels of another road must not cross bridges: their circles have heights, (n, 4)
        self._bridges = _Circles(circles((lanes[p.lane], p.start, p.end) for p in plan.stretches))
        tunnels = circles((lanes[p.lane], p.start, p.end) for p in plan.stretches if p.level < 0)[:, :3]
        junctions = circles(((lane, 0.0, lane.length) for lane in lanes if lane.in_junction), 0.9)[:, :3]
        islands = (pocket_places(plan.town, plan.pockets).reshape(-1, 2) - origin) * scale
        arrows = np.concatenate(
            (
                circles(_arrow_stretches(plan), 0.6)[:, :3],
                np.column_stack((islands, np.full(len(islands), _ISLAND * scale))),
            )
        )
        bars = circles(_stop_stretches(plan), 0.6)[:, :3]
        crossings = [_around((crossing.outline - origin) * scale) for crossing in plan.town.crosswalks]
        paint = np.concatenate((fixed, tunnels, bars, np.array(crossings).reshape(-1, 3)))
        self._levels = {
            LabelClearance.ALL: (paint, arrows, junctions),
            LabelClearance.ARROWS_HIDDEN: (paint, junctions),
            LabelClearance.JUNCTIONS_TOUCHED: (paint, junctions * np.array([1.0, 1.0, _NARROW])),
            LabelClearance.JUNCTIONS_CROSSED: (paint, arrows),
            LabelClearance.FIXED_ALONE: (fixed,),
            LabelClearance.OFF_ROAD: (fixed, circles((lane, 0.0, lane.length) for lane in lanes)[:, :3]),
        }
        self._circles: dict[LabelClearance, _Circles] = {}

    def clearance(self, axis: Axis, level: LabelClearance) -> Array:
        """Returns the distance (n,) [px] from the points of an axis to the nearest obstacle of a level."""
        if level not in axis.clear:
            if level not in self._circles:
                self._circles[level] = _Circles(np.concatenate(self._levels[level]))
            free = self._circles[level].clearance(axis)
            axis.clear[level] = free if axis.beside else np.minimum(free, self._bridges.clearance(axis))
        return axis.clear[level]


class _Circles:
    """Search tree of circles (n, 3) [px], or (n, 4) with heights of roads."""

    def __init__(self, circles: Array) -> None:
        self._rows = circles
        self._tree = cKDTree(circles[:, :2]) if len(circles) else None

    def clearance(self, axis: Axis) -> Array:
        """Returns the distance (n,) [px] to the nearest relevant circle."""
        if self._tree is None:
            return np.full(len(axis.line), np.inf)
        found = self._tree.query(axis.line, k=min(_NEAREST_CIRCLES, len(self._rows)))
        distance, index = (np.reshape(row, (len(axis.line), -1)) for row in found)
        free = distance - self._rows[index, 2]
        if self._rows.shape[1] > 3:
            free = np.where(np.abs(self._rows[index, 3] - axis.height[:, None]) > _OTHER_ROAD, free, np.inf)
        return np.asarray(free.min(axis=1))


def _arrow_stretches(plan: MapLayers) -> Iterator[tuple[Lane, float, float]]:
    """Yields the parts of lanes covered by arrows."""
    for arrow in plan.arrows if plan.detail.arrows else ():
        lane = plan.town.lanes[arrow.lane]
        yield lane, arrow.station, min(arrow.station + ARROW_LENGTH, lane.length)


def _stop_stretches(plan: MapLayers) -> Iterator[tuple[Lane, float, float]]:
    """Yields the parts of lanes covered by stop lines."""
    for number in plan.ruled:
        lane = plan.town.lanes[number]
        yield lane, max(0.0, plan.stops.get(number, 0.0) - 1.0), lane.length


def _around(outline: Array) -> Array:
    """Returns a circle (3,) around most of a crosswalk; across a road, the width of the road is enough."""
    centre = outline.mean(axis=0)
    return np.array([*centre, 0.8 * pn.hypot(*(outline - centre).T).max()])


# --- Labels ----------------------------------------------------------------------------------------------------------

_TIGHTEST = 2.2  # font sizes: smallest radius of legible text
_ROOM = 0.72  # of the width of the road for one row of text
_ROOM_OF_ROWS = 0.9  # of the width of the road for two rows
ROW_HEIGHT = 1.0
"""Distance between rows, relative to the font size."""

_HALF = 0.62  # of the height of a label kept free on both sides of its line
_LONGER = 1.08  # of the length of a label reserved on the road
_NAME_POINTS = 24
_SHARES = (1.0, 0.85, 0.72, 0.6, 0.5, 0.42)  # of the largest font size
_REPEATED = 0.8  # of the font size for repetitions with less room
_TINY_FONT = 0.8  # of the smallest font size, instead of no label
_LABEL_ASIDE = 3.0  # [m] between the edge of the road and a label beside it: the pavement


@dataclass(frozen=True, kw_only=True)
class _Manner:
    """Constraints on a label.

    Attributes:
        size: font size [px].
        level: obstacles to avoid.
        forced: whether it may be higher than the road is wide.
        across: whether it may cross a junction.
        bent: largest change of direction of its line [rad].
        rows: number of rows.
    """

    size: int
    level: LabelClearance
    forced: bool = False
    across: bool = False
    bent: float = 0.9
    rows: int = 1


@dataclass(frozen=True, eq=False)
class Label:
    """Street name placed on the map.

    Attributes:
        text: the name.
        street: index of the street.
        size: font size [px].
        path: points (n, 2) [px] of its line, from the first letter to the last.
        beside: whether it lies beside the road, for lack of room on it.
        rows: rows of the name, centred on the path.
    """

    text: str
    street: int
    size: int
    path: Array
    beside: bool
    rows: tuple[str, ...]

    @property
    def half(self) -> float:
        """Distance kept free on both sides of the path [px]."""
        return _half(self.size, len(self.rows))

    def row_paths(self) -> list[Array]:
        """Returns the path of each row (n, 2) [px]."""
        steps = np.gradient(self.path, axis=0)
        down = np.stack((-steps[:, 1], steps[:, 0]), axis=-1) / pn.hypot(*steps.T)[:, None]
        middle = (len(self.rows) - 1) / 2.0
        return [self.path + (k - middle) * ROW_HEIGHT * self.size * down for k in range(len(self.rows))]


@dataclass
class LabelPlacer:
    """Placement of the street names of a town.

    Attributes:
        names: names by street index; empty for streets without one.
        scale: [px/m].
        origin: world position of pixel (0, 0) [m].
        frame: left, top, right and bottom [px] of the area for labels.
        sizes: largest and smallest font size [px].
        spacing: smallest distance between two labels of the same name [px].
        farthest: distance beyond which a name is repeated even over arrows [px].
        placed: labels placed so far.
        missing: names without any room on or beside their streets.
    """

    names: Sequence[str]
    scale: float
    origin: Array
    frame: tuple[int, int, int, int]
    sizes: tuple[int, int] = (20, 11)
    spacing: float = 420.0
    farthest: float = 1400.0
    placed: list[Label] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)

    def place(self, plan: MapLayers, fixed: Array) -> list[Label]:
        """Places each name at least once where its street is visible, and repeats it on long streets.

        Streets with the least room come first. A label first avoids all markings, then hides arrows, then becomes
        smaller, then crosses a junction, and finally lies beside the road.

        Args:
            plan: layers of the map.
            fixed: circles (n, 3) [px] that no label may touch: x, y, radius.
        """
        lines = plan.borders.lines
        self._obstacles = Obstacles(plan, self.scale, self.origin, fixed)
        self._axes = street_axes(plan.borders, self.scale, self.origin)
        self._own: dict[int, list[Axis]] = {k: [] for k, name in enumerate(self.names) if name}
        for axis in self._axes:
            if axis.street in self._own:
                self._own[axis.street].append(axis)
        order = sorted(self._own, key=lambda k: (sum(axis.length for axis in self._own[k]), k))
        self.placed, self.missing = [], []
        for street in order:
            if not self._set_first(street) and not self._set_beside(street, lines):
                self.missing.append(self.names[street])
        for street in order:
            self._repeat(street)
        return self.placed

    def _set_first(self, street: int) -> bool:
        large, small = self.sizes
        tiny = round(_TINY_FONT * small)
        sizes = list(dict.fromkeys(max(small, round(share * large)) for share in _SHARES))
        # broad streets have large labels; each size is tried on free road first, then over arrows
        manners = [
            _Manner(size=size, level=level)
            for part in (sizes[:2], sizes[2:4], sizes[4:])
            for level in (LabelClearance.ALL, LabelClearance.ARROWS_HIDDEN)
            for size in part
        ]
        manners += [
            _Manner(size=size, level=level, rows=2, bent=0.3)
            for size in sizes
            for level in (LabelClearance.ALL, LabelClearance.ARROWS_HIDDEN)
        ]
        manners += [
            _Manner(size=size, level=level, forced=True, bent=bent)
            for size, bent in ((small, 0.9), (small, 1.8), (tiny, 1.8))
            for level in (LabelClearance.ALL, LabelClearance.ARROWS_HIDDEN)
        ]
        manners += [
            _Manner(size=small, level=LabelClearance.JUNCTIONS_TOUCHED, forced=True, bent=1.2),
            _Manner(size=small, level=LabelClearance.JUNCTIONS_CROSSED, forced=True, across=True, bent=0.3),
            _Manner(size=tiny, level=LabelClearance.JUNCTIONS_TOUCHED, forced=True, bent=1.8),
        ]
        return any(self._set(street, manner) for manner in manners)

    def _set(self, street: int, manner: _Manner, spacing: float = 0.0) -> bool:
        axes: Iterable[Axis] = self._own[street]
        if manner.across:
            # new axes do not know the labels placed earlier
            axes = sorted(across_junctions(self._own[street], self.scale), key=lambda axis: -axis.length)
            self._tell(axes)
        return self._set_on(axes, manner, spacing)

    def _set_beside(self, street: int, lines: Sequence[Border]) -> bool:
        small = self.sizes[1]
        for size, level in (
            (small, LabelClearance.OFF_ROAD),
            (round(_TINY_FONT * small), LabelClearance.OFF_ROAD),
            (small, LabelClearance.FIXED_ALONE),
        ):
            more = font(size, bold=True).size(self.names[street])[0] * _LONGER / 2.0
            axes = list(
                beside_axes(lines, street, self.scale, self.origin, _LABEL_ASIDE * self.scale + _HALF * size, more)
            )
            self._tell(axes)
            if self._set_on(axes, _Manner(size=size, level=level, forced=True), 0.0):
                return True
        return False

    def _repeat(self, street: int) -> None:
        first = next((label for label in self.placed if label.street == street), None)
        if first is None or first.beside:
            return
        large, small = first.size, max(self.sizes[1], round(_REPEATED * first.size))
        forced, rows = first.size <= self.sizes[1] and len(first.rows) == 1, len(first.rows)
        for size in dict.fromkeys((large, small)):
            while self._set(
                street, _Manner(size=size, level=LabelClearance.ALL, forced=forced, rows=rows), self.spacing
            ):
                pass
        farthest = max(self.farthest, self.spacing)
        for size in dict.fromkeys((large, small, self.sizes[1])):
            while self._set(
                street, _Manner(size=size, level=LabelClearance.ARROWS_HIDDEN, forced=forced, rows=rows), farthest
            ):
                pass

    def _tell(self, axes: Iterable[Axis]) -> None:
        """Registers the labels placed so far with new axes."""
        for label in self.placed:
            places = cKDTree(label.path)
            for axis in axes:
                axis.keep_off(places, label.half)

    def _set_on(self, axes: Iterable[Axis], manner: _Manner, spacing: float) -> bool:
        """Places a name on the first axis with room for it; returns whether there is one."""
        for axis in axes:
            text = self.names[axis.street]
            rows = _broken(text, manner)
            if len(rows) != manner.rows:
                return False
            width = max(font(manner.size, bold=True).size(row)[0] for row in rows) * _LONGER
            path = self._window(axis, width, manner, spacing)
            if path is None:
                continue
            label = Label(text, axis.street, manner.size, _upright(path), axis.beside, rows)
            self.placed.append(label)
            places = cKDTree(label.path)
            for other in self._axes:
                other.keep_off(places, label.half)
            return True
        return False

    def _window(self, axis: Axis, width: float, manner: _Manner, spacing: float) -> Array | None:
        """Returns the best path on an axis: straight, and near the centre of a free part; None without room."""
        count = int(np.ceil(width / axis.step)) + 1
        if count > len(axis.line):
            return None
        size = manner.size
        ok = np.minimum(self._obstacles.clearance(axis, manner.level), axis.taken) >= _half(size, manner.rows)
        if not manner.forced:
            room = _ROOM if manner.rows == 1 else _ROOM_OF_ROWS / (1.0 + ROW_HEIGHT)
            ok &= axis.room * room >= size
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
        good = bent <= manner.bent
        same = np.array([label.path.mean(axis=0) for label in self.placed if label.street == axis.street]).reshape(
            -1, 2
        )
        if len(same) and spacing:
            good &= pn.hypot(*(middle[:, None] - same).transpose(2, 0, 1)).min(axis=1) >= spacing
        if not good.any():
            return None
        centred = np.abs(starts - _middle_of_run(starts)) * axis.step
        cost = np.where(good, centred / self.spacing + 1.2 * bent, np.inf)
        first = int(starts[int(np.argmin(cost))])
        return axis.along(first * axis.step + 0.5 * (width - width / _LONGER), width / _LONGER, _NAME_POINTS)


def _half(size: int, rows: int) -> float:
    return size * (_HALF + (rows - 1) * ROW_HEIGHT / 2.0)


def _broken(text: str, manner: _Manner) -> tuple[str, ...]:
    """Breaks a name between two words into rows of similar length, if more than one row is allowed."""
    parts = text.split()
    if manner.rows == 1 or len(parts) < 2:
        return (text,)
    choices = [(" ".join(parts[:k]), " ".join(parts[k:])) for k in range(1, len(parts))]
    face = font(manner.size, bold=True)
    return min(choices, key=lambda rows: max(face.size(row)[0] for row in rows))


def _middle_of_run(starts: NDArray[np.int64]) -> Array:
    """Returns for each of ascending integers (n,) the middle of its run of successive integers."""
    cuts = np.flatnonzero(np.diff(starts) > 1) + 1
    return np.concatenate([np.full(len(run), (run[0] + run[-1]) / 2.0) for run in np.split(starts, cuts)])


def _upright(path: Array) -> Array:
    """Returns the path in reading direction: to the right, or straight up."""
    across = path[-1] - path[0]
    backwards = across[0] < -0.02 * abs(across[1]) or (abs(across[0]) <= 0.02 * abs(across[1]) and across[1] > 0)
    return path[::-1] if backwards else path


def covering(labels: Iterable[Label]) -> Iterator[tuple[float, float, float]]:
    """Yields circles (x, y, radius) [px] that cover labels."""
    for label in labels:
        for x, y in label.path.tolist():
            yield x, y, label.half
