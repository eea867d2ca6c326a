"""Where turn lanes open in the middle of a road: the closed ends of what parts the directions before them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from dorothie_gym.world.graphics import palette
from dorothie_gym.world.graphics.borders import Borders
from dorothie_gym.world.graphics.shapes import Shape, stroke
from dorothie_gym.world.town.model import Array, Lane, Town

FACING = 9.0
"""Between two turn lanes that open back to back, at most [m]."""

_TAPER = 8.0  # [m] over which the middle line goes over to the other side of the turn lane
_SHARE = 0.3  # of the turn lane that this takes at most
_WIDE = 2.0  # [m] at its beginning: a lane that widens from nothing needs no taper
_BACK = 3.0  # [m] of asphalt before the opening
_AROUND = 0.7  # [m] of it on either side
_OVERLAP = 0.2  # [m] of the lines of two islands that meet
_HATCH = 2.0  # [m] from bar to bar
_SLANT = 1.2  # [m]


@dataclass(frozen=True)
class Pocket:
    """The beginning of a turn lane.

    Attributes:
        lane: index of the lane.
        taper: length of the island in it [m].
        back: length of the island before it, up to half-way to the turn lane of the other direction [m]; 0 where
            there is none, or a planted median.
        aside: how far the island lies to the right of the turn lane's middle [m].
    """

    lane: int
    taper: float
    back: float
    aside: float


def find_pockets(town: Town, borders: Borders) -> tuple[Pocket, ...]:
    """All turn lanes that open beside a lane that goes on, on its left, with their full width."""
    found = [lane for lane in town.lanes if _opens(town, borders, lane)]
    starts = np.array([lane.points[0] for lane in found]).reshape(-1, 3)
    heading = np.array([lane.headings[0] for lane in found])
    out = []
    for k, lane in enumerate(found):
        offset = starts[:, :2] - starts[k, :2]
        behind = -(offset @ np.array([np.cos(heading[k]), np.sin(heading[k])]))
        other = (np.cos(heading - heading[k]) < -0.9) & (behind > 0.0) & (np.hypot(*offset.T) < FACING)
        back, aside = 0.0, 0.0
        if other.any():
            # The island lies in the middle between the two lanes, which are not quite in line.
            nearest = int(np.argmin(np.where(other, behind, np.inf)))
            back = float(behind[nearest]) / 2.0
            aside = float(offset[nearest] @ np.array([-np.sin(heading[k]), np.cos(heading[k])])) / 2.0
        out.append(Pocket(lane.id, min(_TAPER, _SHARE * lane.length), back, aside))
    return tuple(out)


def _opens(town: Town, borders: Borders, lane: Lane) -> bool:
    right = borders.right_neighbour.get(lane.id)
    if lane.in_junction or right is None or lane.id not in borders.divided or town.predecessors(lane.id):
        return False
    before = town.predecessors(right)
    return bool(before) and not town.lanes[before[0]].in_junction and lane.width_at(0.0) > _WIDE


def pocket_places(town: Town, found: Sequence[Pocket]) -> Array:
    """Places (pockets, 4, 2) [m] along the islands in and before turn lanes."""
    rows = [_placed(town.lanes[p.lane], [(s, p.aside) for s in (-p.back, 0.0, p.taper / 2.0, p.taper)]) for p in found]
    return np.array(rows).reshape(-1, 4, 2)


def pocket_grounds(town: Town, found: Sequence[Pocket]) -> Iterator[Shape]:
    """Asphalt where the island lies: neither kerbs nor gaps are left between the lanes around it."""
    for pocket in found:
        lane = town.lanes[pocket.lane]
        half = lane.width_at(0.0) / 2.0 + _AROUND
        corners = [(-max(_BACK, pocket.back + 0.2), -half), (-max(_BACK, pocket.back + 0.2), half)]
        yield Shape(_placed(lane, [*corners, (1.0, half), (1.0, -half)]), palette.ROAD)


def pocket_paint(town: Town, found: Sequence[Pocket], pen: float, fine: bool) -> Iterator[Shape]:
    """The line that goes over to the other side of the turn lane, and the hatched island that it bounds.

    Args:
        town: whose lanes.
        found: the beginnings of turn lanes.
        pen: width of the thinnest line [m].
        fine: whether there is room for bars.
    """
    for pocket in found:
        lane = town.lanes[pocket.lane]
        half = lane.width_at(0.0) / 2.0
        # From the right side of the turn lane, where the median ended, to its left side.
        near, far = pocket.aside - half, pocket.aside + half
        line = [(-pocket.back - _OVERLAP, far), (0.0, far), (pocket.taper, near)]
        other = [(-pocket.back - _OVERLAP, near), (0.0, near)]
        lines = [line, other] if pocket.back else [line[1:]]
        for course in lines:
            outline = stroke(_placed(lane, course), max(0.2, pen))
            yield Shape(outline, palette.HATCHING, lane.height_at(0.0))
        if not fine:
            continue
        for at in np.arange(_HATCH / 2.0 - pocket.back, pocket.taper - _SLANT - 0.5, _HATCH).tolist():
            right = far - 2.0 * half * max(0.0, at) / pocket.taper
            bar = [(at + _SLANT * (right - near) / (2.0 * half), near), (at, right)]
            yield Shape(stroke(_placed(lane, bar), max(0.4, pen)), palette.HATCHING, lane.height_at(0.0))


def _placed(lane: Lane, places: Sequence[tuple[float, float]]) -> Array:
    """Positions (n, 2) [m] of places (forward, right) [m] seen from a lane's start, before it straight on."""
    start, way = lane.position(0.0), lane.heading_at(0.0)
    forward, right = np.array([np.cos(way), np.sin(way)]), np.array([-np.sin(way), np.cos(way)])
    return np.array(
        [lane.position(s, aside) if s >= 0.0 else start + s * forward + aside * right for s, aside in places]
    )
