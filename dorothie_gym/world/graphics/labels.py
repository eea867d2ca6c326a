"""Where the names of streets go: along the road, upright, clear of junctions and of each other."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from dorothie_gym.world.graphics.fonts import font
from dorothie_gym.world.graphics.plan import Edge, Plan
from dorothie_gym.world.graphics.shapes import sample, side_line, widths_at
from dorothie_gym.world.town.model import NO_STREET, Array, Lane, Town

_MOST_LANES = 8  # of one carriageway
_MOST_BENT = 0.9  # [rad] that the line under a name may turn
_ARROWS = 9.0  # [m] of a lane's end that its arrow takes


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


@dataclass(frozen=True)
class _Axis:
    """A line (n, 2) [px] that a name may be set along, and the room across it [px]."""

    street: int
    line: Array
    room: float


@dataclass
class LabelPlacer:
    """Sets the names of a town's streets.

    Attributes:
        town: whose streets.
        names: by street index.
        scale: [px/m].
        origin: world position of pixel (0, 0) [m].
        sizes: largest and smallest type [px].
        spacing: distance between two settings of the same name [px].
        frame: width and height of the picture [px]; names stay inside.
    """

    town: Town
    names: Sequence[str]
    scale: float
    origin: Array
    frame: tuple[int, int]
    sizes: tuple[int, int] = (20, 11)
    spacing: float = 420.0
    placed: list[Label] = field(default_factory=list)

    def place(self, plan: Plan) -> list[Label]:
        """Sets every name at least once where its street can be seen, and again where it is long.

        Streets with the least room come first; a name is made smaller before it may touch a junction.
        """
        right_of = {edge.beyond: edge.lane for edge in plan.edges if edge.kind == "lane"}
        axes = [axis for edge in plan.edges if (axis := self._axis(edge, right_of)) is not None]
        bridges = self._obstacles((self.town.lanes[k], start, end) for _, k, start, end in plan.bridges)
        junctions = self._obstacles((lane, 0.0, lane.length) for lane in self.town.lanes if lane.in_junction)
        arrows = self._obstacles(self._arrows())
        # What a name keeps clear of: everything, if it can; then it may touch arrows, then junctions' edges, then all.
        free = [
            np.concatenate(parts)
            for parts in (
                (bridges, junctions, arrows),
                (bridges, junctions),
                (bridges, junctions * np.array([1.0, 1.0, 0.4])),
                (bridges,),
            )
        ]
        # Circles (x, y, radius) that names keep clear of.
        taken = np.zeros((0, 3))
        by_street = {
            k: sorted((a for a in axes if a.street == k), key=_length, reverse=True) for k in range(len(self.names))
        }
        order = sorted(by_street, key=lambda k: (sum(_length(a) for a in by_street[k]), k))
        self.placed = []
        for street in order:
            taken = self._place_first(street, by_street[street], free, taken)
        for street in order:
            taken = self._place_more(street, by_street[street], free[0], taken)
        return self.placed

    def _place_first(self, street: int, axes: list[_Axis], free: Sequence[Array], taken: Array) -> Array:
        large, small = self.sizes
        middle = (large + small + 1) // 2
        tries = [(free[0], large), (free[0], middle), (free[1], large), (free[1], middle)]
        tries += [(blocked, size) for blocked in free for size in (middle, small)]
        for force in (False, True):
            for blocked, size in tries:
                circles = self._try(street, axes, size, np.concatenate((blocked, taken)), force)
                if circles is not None:
                    return np.concatenate((taken, circles))
        return taken

    def _place_more(self, street: int, axes: list[_Axis], blocked: Array, taken: Array) -> Array:
        first = next((label for label in self.placed if label.street == street), None)
        while first is not None:
            circles = self._try(street, axes, first.size, np.concatenate((blocked, taken)), force=False)
            if circles is None:
                break
            taken = np.concatenate((taken, circles))
        return taken

    def _try(self, street: int, axes: list[_Axis], size: int, blocked: Array, force: bool) -> Array | None:
        text = self.names[street]
        width = font(size, bold=True).size(text)[0]
        same = np.array([label.path.mean(axis=0) for label in self.placed if label.street == street]).reshape(-1, 2)
        for axis in axes:
            if axis.room < 0.78 * size and not force:
                continue
            for path in _windows(axis.line, width):
                if not self._inside(path, size):
                    continue
                if len(same) and np.hypot(*(same - path.mean(axis=0)).T).min() < self.spacing:
                    continue
                if _bent(path) > _MOST_BENT:
                    continue
                circles = _circles(path, size)
                gap = np.hypot(circles[:, None, 0] - blocked[:, 0], circles[:, None, 1] - blocked[:, 1])
                if (gap < circles[:, 2][:, None] + blocked[:, 2]).any():
                    continue
                self.placed.append(Label(text, street, size, _upright(path)))
                return circles
        return None

    def _inside(self, path: Array, size: int) -> bool:
        low, high = path.min(axis=0) - size, path.max(axis=0) + size
        return bool((low >= 0).all() and high[0] <= self.frame[0] and high[1] <= self.frame[1])

    def _axis(self, edge: Edge, right_of: Mapping[int, int]) -> _Axis | None:
        """The middle of the road where lanes of both directions meet, else the middle of the carriageway."""
        lane = self.town.lanes[edge.lane]
        if lane.street == NO_STREET or lane.street >= len(self.names) or edge.sign > 0 or edge.kind == "lane":
            return None
        s = sample(lane, edge.start, edge.end, 1.5)
        widths = widths_at(lane, s)
        if edge.kind == "centre":
            line, room = side_line(lane, s, -widths / 2.0), 2.0 * float(widths.min())
        else:
            room, beside = float(widths.min()), lane.id
            for _ in range(_MOST_LANES):
                if beside not in right_of:
                    break
                beside = right_of[beside]
                room += float(self.town.lanes[beside].widths.min())
            line = side_line(lane, s, room / 2.0 - widths / 2.0)
        return _Axis(lane.street, (line - self.origin) * self.scale, room * self.scale)

    def _arrows(self) -> Iterator[tuple[Lane, float, float]]:
        """Stretches of lanes that their arrows take."""
        for lane in self.town.lanes:
            if not lane.in_junction and lane.length > 3.0 * _ARROWS and len(self.town.exits(lane.id)) > 1:
                yield lane, lane.length - _ARROWS, lane.length

    def _obstacles(self, stretches: Iterable[tuple[Lane, float, float]]) -> Array:
        """Circles (n, 3) [px] along stretches of lanes [m]."""
        rows = [np.zeros((0, 3))]
        for lane, start, end in stretches:
            s = sample(lane, start, end, 2.0)
            points = (side_line(lane, s, 0.0) - self.origin) * self.scale
            rows.append(np.column_stack((points, np.full(len(points), 1.2 * self.scale))))
        return np.concatenate(rows)


def _length(axis: _Axis) -> float:
    return float(np.hypot(*np.diff(axis.line, axis=0).T).sum())


def _windows(line: Array, width: float) -> Iterator[Array]:
    """Stretches of a line as long as a text, from its middle outwards."""
    stations = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))))
    spare = float(stations[-1]) - width * 1.08
    if spare < 0:
        return
    starts = np.linspace(0.0, spare, max(1, int(spare // 16) + 1))
    for start in sorted(starts.tolist(), key=lambda s: abs(s - spare / 2.0)):
        s = np.linspace(start + 0.04 * width, start + 1.04 * width, 24)
        yield np.stack((np.interp(s, stations, line[:, 0]), np.interp(s, stations, line[:, 1])), axis=-1)


def _bent(path: Array) -> float:
    """How far the direction of a path turns in all [rad]."""
    angle = np.unwrap(np.arctan2(*np.diff(path, axis=0).T[::-1]))
    return float(angle.max() - angle.min())


def _upright(path: Array) -> Array:
    """The path in the direction in which text on it can be read: to the right, and straight upwards."""
    across = path[-1] - path[0]
    backwards = across[0] < -0.02 * abs(across[1]) or (abs(across[0]) <= 0.02 * abs(across[1]) and across[1] > 0)
    return path[::-1] if backwards else path


def _circles(path: Array, size: int) -> Array:
    """Circles (n, 3) that cover a text."""
    return np.column_stack((path, np.full(len(path), 0.62 * size)))
