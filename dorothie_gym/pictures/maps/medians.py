"""Medians between the two directions of a street (kerbs, grass, trees), and the islands before turn lanes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.pictures import palette
from dorothie_gym.pictures.maps.borders import Border, BorderKind, Borders
from dorothie_gym.pictures.maps.shapes import Shape, disc, longer, stroke
from dorothie_gym.support import portable_arrays as pn

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array, Lane
    from dorothie_gym.maps.town import Town
    from dorothie_gym.pictures.maps.levels import LevelLookup

SHORTEST_MEDIAN = 8.0
"""Longest median without plants [m]."""

_MEDIAN_KERB = 0.3  # [m]
_TREE_SPACING = 11.0  # [m]
_TREE_ROOM = 2.2  # [m] width of median for a tree


def medians(lines: Iterable[Border], bridges: LevelLookup) -> Iterator[Shape]:
    """Yields medians, each half from its own side: a kerb, grass, and trees where they fit."""
    strips = []
    for line in lines:
        if line.kind is not BorderKind.MEDIAN:
            continue
        for run in held(line, bridges, wanted=False):
            if np.ptp(line.points[run, :2], axis=0).max() > SHORTEST_MEDIAN:
                strips.append((line, run))
    for line, run in strips:
        # asphalt around the round ends
        yield from (Shape(piece, palette.ROAD) for piece in flat_strip(line, run))
    for inset, colour in ((0.0, palette.MEDIAN_KERB), (_MEDIAN_KERB, palette.MEDIAN)):
        for line, run in strips:
            yield from (Shape(quad, colour) for quad in _half_strip(line, run, inset))
    planted: list[Array] = []
    for line, run in strips:
        # each strip is found from both sides
        for centre, radius in _median_trees(line, run):
            if not planted or pn.hypot(*(np.array(planted) - centre).T).min() > 0.6 * _TREE_SPACING:
                planted.append(centre)
                yield Shape(disc(centre, radius, 16), palette.MEDIAN_TREE)


def held(line: Border, places: LevelLookup, wanted: bool = True) -> Iterator[NDArray[np.int64]]:
    """Yields index runs of a border that lie (or do not lie) on the stretches of a lookup."""
    on = places.hold(line.points) == wanted
    for run in np.split(np.arange(len(on)), np.flatnonzero(np.diff(on.astype(int)) != 0) + 1):
        if on[run[0]] and len(run) > 1:
            yield run


def flat_strip(line: Border, run: NDArray[np.int64], further: float = 3.0) -> Iterator[Array]:
    """Yields polygons (n, 2) [m] from the edge to slightly beyond the centre of a median, extended by `further` [m]."""
    edge, inner = line.points[run, :2], line.shifted(-line.gap / 2.0 - 0.1)[run]
    if further:
        edge, inner = longer(edge, further), longer(inner, further)
    for k in range(0, len(edge) - 1, 8):
        yield np.concatenate((edge[k : k + 9], inner[k : k + 9][::-1]))


def _half_strip(line: Border, run: NDArray[np.int64], inset: float) -> Iterator[Array]:
    """Yields polygons (n, 2) [m] from the edge to slightly beyond the centre of a median, with round ends."""
    s = np.concatenate(([0.0], np.cumsum(pn.hypot(*np.diff(line.points[run, :2], axis=0).T))))
    fine = np.unique(np.concatenate((np.linspace(0, s[-1], max(2, len(s))), *(_nose(end, s[-1]) for end in (0, 1)))))
    edge = np.stack([np.interp(fine, s, line.points[run, k]) for k in (0, 1)], axis=-1)
    heading = np.interp(fine, s, line.heading[run])
    gap = np.interp(fine, s, line.gap[run])
    inward = line.sign * np.stack((-pn.sin(heading), pn.cos(heading)), axis=-1)
    radius = np.maximum(gap / 2.0 - inset, 0.0)
    # an end is a half circle: the strip narrows over half of its width
    near = np.clip(np.minimum(fine, s[-1] - fine) - inset, 0.0, None)
    depth = np.clip(radius - near, 0.0, radius)
    half = np.sqrt(np.maximum(radius**2 - depth**2, 0.0))
    outer = edge + (gap / 2.0 - half)[:, None] * inward
    inner = edge + (gap / 2.0 + 0.1 * (half > 0.1))[:, None] * inward
    for k in range(0, len(fine) - 1, 8):
        part = slice(k, k + 9)
        if half[part].max() > 0.05:
            yield np.concatenate((outer[part], inner[part][::-1]))


def _nose(end: int, length: float) -> Array:
    """Returns stations near an end of a strip, dense enough for a round end."""
    near = np.arange(0.0, min(length, 7.0), 0.25)
    return length - near if end else near


def _median_trees(line: Border, run: NDArray[np.int64]) -> Iterator[tuple[Array, float]]:
    """Yields positions and radii of trees [m]."""
    middle = line.shifted(-line.gap / 2.0)[run]
    s = np.concatenate(([0.0], np.cumsum(pn.hypot(*np.diff(middle, axis=0).T))))
    for at in np.arange(_TREE_SPACING / 2.0, s[-1] - _TREE_SPACING / 2.0, _TREE_SPACING):
        room = float(np.interp(at, s, line.gap[run])) - 2.0 * _MEDIAN_KERB
        if room >= _TREE_ROOM:
            centre = np.array([np.interp(at, s, middle[:, 0]), np.interp(at, s, middle[:, 1])])
            yield centre, min(1.5, 0.4 * room)


# --- Islands before turn lanes ---------------------------------------------------------------------------------------

BACK_TO_BACK = 9.0
"""Largest distance between two turn lanes that open back to back [m]."""

_TAPER = 8.0  # [m] over which the centre line crosses to the other side of the turn lane
_SHARE = 0.3  # largest share of the turn lane for this
_WIDE_OPENING = 2.0  # [m] width at its start: a lane that widens from zero needs no taper
_OPENING_BACK = 3.0  # [m] of asphalt before the opening
_ISLAND_RIM = 0.7  # [m] of asphalt on both sides
_OVERLAP = 0.2  # [m] of the lines of two adjoining islands
_HATCH = 2.0  # [m] between bars
_SLANT = 1.2  # [m]


@dataclass(frozen=True)
class Pocket:
    """Beginning of a turn lane.

    Attributes:
        lane: id of the lane.
        taper: length of the island in it [m].
        back: length of the island before it, up to half-way to the turn lane of the other direction [m]; 0 without
            one, or with a planted median.
        aside: offset of the island to the right of the centre of the turn lane [m].
    """

    lane: int
    taper: float
    back: float
    aside: float


def find_pockets(town: Town, borders: Borders) -> tuple[Pocket, ...]:
    """Returns all turn lanes that open at full width beside a continuing lane, in the middle of the road."""
    found = [lane for lane in town.lanes if _opens(town, borders, lane)]
    starts = np.array([lane.points[0] for lane in found]).reshape(-1, 3)
    heading = np.array([lane.headings[0] for lane in found])
    out = []
    for k, lane in enumerate(found):
        offset = starts[:, :2] - starts[k, :2]
        behind = -pn.dot(offset, np.array([pn.cos(heading[k]), pn.sin(heading[k])]))
        other = (pn.cos(heading - heading[k]) < -0.9) & (behind > 0.0) & (pn.hypot(*offset.T) < BACK_TO_BACK)
        back, aside = 0.0, 0.0
        if other.any():
            # the island lies midway between the two lanes, which are slightly offset
            nearest = int(np.argmin(np.where(other, behind, np.inf)))
            back = float(behind[nearest]) / 2.0
            aside = float(pn.dot(offset[nearest], np.array([-pn.sin(heading[k]), pn.cos(heading[k])]))) / 2.0
        out.append(Pocket(lane.id, min(_TAPER, _SHARE * lane.length), back, aside))
    return tuple(out)


def _opens(town: Town, borders: Borders, lane: Lane) -> bool:
    outer = borders.outer_neighbour.get(lane.id)
    if lane.in_junction or outer is None or lane.id not in borders.divided or town.predecessors(lane.id):
        return False
    before = town.predecessors(outer)
    return bool(before) and not town.lanes[before[0]].in_junction and lane.width_at(0.0) > _WIDE_OPENING


def pocket_places(town: Town, found: Sequence[Pocket]) -> Array:
    """Returns positions (pockets, 4, 2) [m] along the islands in and before turn lanes."""
    rows = [_placed(town.lanes[p.lane], [(s, p.aside) for s in (-p.back, 0.0, p.taper / 2.0, p.taper)]) for p in found]
    return np.array(rows).reshape(-1, 4, 2)


def pocket_grounds(town: Town, found: Sequence[Pocket]) -> Iterator[Shape]:
    """Yields asphalt under the islands, without kerbs or gaps between the lanes around them."""
    for pocket in found:
        lane = town.lanes[pocket.lane]
        half = lane.width_at(0.0) / 2.0 + _ISLAND_RIM
        corners = [(-max(_OPENING_BACK, pocket.back + 0.2), -half), (-max(_OPENING_BACK, pocket.back + 0.2), half)]
        yield Shape(_placed(lane, [*corners, (1.0, half), (1.0, -half)]), palette.ROAD)


def pocket_paint(town: Town, found: Sequence[Pocket], pen: float, fine: bool) -> Iterator[Shape]:
    """Yields the line that crosses to the other side of the turn lane, and the hatched island that it bounds.

    Args:
        town: town to paint.
        found: starts of turn lanes.
        pen: width of the thinnest line [m].
        fine: whether there is room for bars.
    """
    for pocket in found:
        lane = town.lanes[pocket.lane]
        half = town.traffic.sign * lane.width_at(0.0) / 2.0
        # from the outer side of the turn lane, where the median ended, to its inner side
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
            outer = far - 2.0 * half * max(0.0, at) / pocket.taper
            bar = [(at + _SLANT * (outer - near) / (2.0 * half), near), (at, outer)]
            yield Shape(stroke(_placed(lane, bar), max(0.4, pen)), palette.HATCHING, lane.height_at(0.0))


def _placed(lane: Lane, places: Sequence[tuple[float, float]]) -> Array:
    """Transforms points (forward, right) [m] relative to the start of a lane to positions (n, 2) [m]."""
    start, way = lane.position(0.0), lane.heading_at(0.0)
    forward, right = np.array([pn.cos(way), pn.sin(way)]), np.array([-pn.sin(way), pn.cos(way)])
    return np.array(
        [lane.position(s, aside) if s >= 0.0 else start + s * forward + aside * right for s, aside in places]
    )
