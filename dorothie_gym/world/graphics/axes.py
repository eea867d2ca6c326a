"""The lines along which the names of streets may be set."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.spatial import cKDTree

from dorothie_gym.world.graphics.borders import Border, BorderKind, Borders
from dorothie_gym.world.graphics.roadways import roadways
from dorothie_gym.world.graphics.shapes import longer, polyline_stations
from dorothie_gym.world.town.model import Array

_STEP = 5.0  # [px]
_WIDEST_JUNCTION = 50.0  # [m] that a name may bridge
_STRAIGHT_ON = 0.3  # [rad]
_SAME_LEVEL = 1.5  # [m]


@dataclass(eq=False)
class Axis:
    """A line along a street, in steps of the same length.

    Attributes:
        street: index of the street.
        line: (n, 2) [px].
        height: of the road (n,) [m].
        heading: of the line (n,) [rad], unwrapped.
        room: width of the road around it (n,) [px].
        step: between the points [px].
        beside: whether it runs along the road and not on it.
        clear: by level of obstacles, the distance to them (n,) [px], as far as it is known.
        taken: distance to the names set so far (n,) [px].
    """

    street: int
    line: Array
    height: Array
    heading: Array
    room: Array
    step: float
    beside: bool = False
    clear: dict[int, Array] = field(default_factory=dict)
    taken: Array = field(init=False)

    def __post_init__(self) -> None:
        self.taken = np.full(len(self.line), np.inf)

    @property
    def length(self) -> float:
        """Its length [px]."""
        return (len(self.line) - 1) * self.step

    def keep_off(self, places: cKDTree, radius: float) -> None:
        """Takes note of a name, given by a tree of its points, that takes so many pixels on either side."""
        near, _ = places.query(self.line)
        self.taken = np.minimum(self.taken, near - radius)

    def along(self, start: float, length: float, points: int) -> Array:
        """Points (points, 2) [px] of the stretch that begins at a station and has a length [px]."""
        s = np.linspace(start, start + length, points)
        stations = np.arange(len(self.line)) * self.step
        return np.stack([np.interp(s, stations, column) for column in self.line.T], axis=-1)

    def reversed(self) -> Axis:
        """The same line the other way."""
        back = slice(None, None, -1)
        return replace(
            self,
            line=self.line[back],
            height=self.height[back],
            heading=self.heading[back] + np.pi,
            room=self.room[back],
            clear={},
        )


def street_axes(borders: Borders, scale: float, origin: Array) -> list[Axis]:
    """The middles of all roadways of a town, by street and then by length.

    Args:
        borders: what lies beside the lanes.
        scale: [px/m].
        origin: world position of pixel (0, 0) [m].
    """
    found = [
        _axis(way.street, (way.line - origin) * scale, way.heading, way.height, way.width * scale)
        for way in roadways(borders)
    ]
    return sorted((axis for axis in found if axis is not None), key=lambda axis: (axis.street, -axis.length))


def _axis(street: int, pixels: Array, heading: Array, height: Array, room: Array, beside: bool = False) -> Axis | None:
    stations = polyline_stations(pixels)
    count = int(stations[-1] // _STEP) + 1
    if count < 4:
        return None
    s = np.linspace(0.0, stations[-1], count)
    even = np.stack([np.interp(s, stations, column) for column in pixels.T], axis=-1)
    return Axis(
        street=street,
        line=even,
        height=np.interp(s, stations, height),
        heading=np.interp(s, stations, heading),
        room=np.interp(s, stations, room),
        step=float(s[1]),
        beside=beside,
    )


def across_junctions(axes: Sequence[Axis], scale: float) -> Iterator[Axis]:
    """Axes of one street that go on straight beyond a junction, joined in pairs; `scale` is in px/m."""
    for k, first in enumerate(axes):
        for second in axes[k + 1 :]:
            for a in (first, first.reversed()):
                for b in (second, second.reversed()):
                    if _goes_on(a, b, scale) and (joined := _joined(a, b)) is not None:
                        yield joined


def _goes_on(a: Axis, b: Axis, scale: float) -> bool:
    between = b.line[0] - a.line[-1]
    gap = float(np.hypot(*between))
    if not 2.0 * _STEP < gap < _WIDEST_JUNCTION * scale or abs(a.height[-1] - b.height[0]) > _SAME_LEVEL:
        return False
    way = np.arctan2(between[1], between[0])
    return bool(np.cos(np.array([a.heading[-1], b.heading[0]]) - way).min() > np.cos(_STRAIGHT_ON))


def _joined(a: Axis, b: Axis) -> Axis | None:
    heading = np.unwrap(np.concatenate((a.heading, b.heading)))
    height, room = np.concatenate((a.height, b.height)), np.concatenate((a.room, b.room))
    return _axis(a.street, np.concatenate((a.line, b.line)), heading, height, room)


def beside_axes(
    lines: Sequence[Border], street: int, scale: float, origin: Array, aside: float, more: float
) -> Iterator[Axis]:
    """Lines on the ground along the edges of a street, so many pixels beside it, and as much longer at both ends."""
    for line in lines:
        if line.street != street or line.kind is not BorderKind.EDGE:
            continue
        pixels = (line.shifted(-aside / scale) - origin) * scale
        pixels = pixels[np.concatenate(([True], np.hypot(*np.diff(pixels, axis=0).T) > 1e-6))]
        if len(pixels) < 2:
            continue
        along = longer(pixels, more)
        steps = np.diff(along, axis=0)
        angle = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
        heading = np.concatenate((angle[:1], (angle[1:] + angle[:-1]) / 2.0, angle[-1:]))
        height = np.full(len(along), float(line.points[:, 2].mean()))
        axis = _axis(street, along, heading, height, np.full(len(along), np.inf), beside=True)
        if axis is not None:
            yield axis
