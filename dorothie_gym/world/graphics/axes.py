"""The lines along which the names of streets may be set."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial import cKDTree

from dorothie_gym.world.graphics.borders import Border, BorderKind
from dorothie_gym.world.graphics.plan import Plan
from dorothie_gym.world.town.model import NO_STREET, Array

_STEP = 5.0  # [px]
_MOST_LANES = 8  # of one carriageway


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
        clear: distance to obstacles (levels, n) [px]: fewer obstacles count on each further level.
        taken: distance to the names set so far (n,) [px].
    """

    street: int
    line: Array
    height: Array
    heading: Array
    room: Array
    step: float
    clear: Array = field(default_factory=lambda: np.zeros((0, 0)))
    taken: Array = field(init=False)

    def __post_init__(self) -> None:
        self.taken = np.full(len(self.line), np.inf)

    @property
    def length(self) -> float:
        """Its length [px]."""
        return (len(self.line) - 1) * self.step

    def keep_off(self, tree: cKDTree, radius: float) -> None:
        """Takes note of a name, given by a tree of its points, that takes so many pixels on either side."""
        near, _ = tree.query(self.line)
        self.taken = np.minimum(self.taken, near - radius)

    def along(self, start: float, length: float, points: int) -> Array:
        """Points (points, 2) [px] of the stretch that begins at a station and has a length [px]."""
        s = np.linspace(start, start + length, points)
        stations = np.arange(len(self.line)) * self.step
        return np.stack([np.interp(s, stations, column) for column in self.line.T], axis=-1)


def street_axes(plan: Plan, scale: float, origin: Array) -> list[Axis]:
    """All axes of a town: between the two directions of a road, else in the middle of a carriageway."""
    return [axis for border in plan.borders.lines for axis in _axis(plan, border, scale, origin)]


def _axis(plan: Plan, border: Border, scale: float, origin: Array) -> Iterator[Axis]:
    if border.street == NO_STREET or border.sign > 0 or border.kind is BorderKind.LANE:
        return
    abreast = min(_abreast(plan, lane) for lane in border.lanes)
    if border.kind is BorderKind.CENTRE:
        line, room = border.shifted(-border.gap / 2.0), 2.0 * abreast * border.width
    else:
        line, room = border.shifted(abreast * border.width / 2.0), abreast * border.width
    pixels = (line - origin) * scale
    stations = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(pixels, axis=0).T))))
    count = int(stations[-1] // _STEP) + 1
    if count < 4:
        return
    s = np.linspace(0.0, stations[-1], count)
    even = np.stack([np.interp(s, stations, column) for column in pixels.T], axis=-1)
    yield Axis(
        street=border.street,
        line=even,
        height=np.interp(s, stations, border.points[:, 2]),
        heading=np.interp(s, stations, border.heading),
        room=np.interp(s, stations, room) * scale,
        step=float(s[1]),
    )


def _abreast(plan: Plan, lane: int) -> int:
    """Lanes of the carriageway from this one to its right edge."""
    count = 1
    while count < _MOST_LANES and (beside := plan.borders.right_neighbour.get(lane)) is not None:
        lane, count = beside, count + 1
    return count
