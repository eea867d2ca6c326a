"""Tunnels and cuttings: slopes of open cuttings, and the light floor of covered roads."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.model import Array
from dorothie_gym.maps.town import Town
from dorothie_gym.rendering import palette
from dorothie_gym.rendering.borders import Border, BorderKind
from dorothie_gym.rendering.levels import LevelLookup, LevelStretch
from dorothie_gym.rendering.medians import flat_strip, held
from dorothie_gym.rendering.shapes import (
    Shape,
    cut,
    dash_pattern,
    polyline_length,
    polyline_stations,
    ribbon,
    stroke,
    strokes,
)

_LAID_BACK = 0.55  # [m] of slope per metre of depth
_BROADEST = 3.0  # [m]
_HACHURE = 2.4  # [m] between hachures
_PORTAL = 0.9  # [m]
_APRON = 4.0  # [m] of asphalt before a portal, where grass ends
_OVER = 0.9  # [m] by which the wall of a portal extends beyond the road
_JITTER = 2.0  # [m] between the points of borders
_ABREAST = 14.0  # [m] between lanes through one portal


def walls(lines: Iterable[Border], deep: LevelLookup, covered: LevelLookup) -> Iterator[Shape]:
    """Yields slopes beside roads in cuttings, hachured from their upper edges, wider where they are deeper."""
    for line in lines:
        if line.kind is not BorderKind.EDGE:
            continue
        beside = deep.hold(line.points) & ~covered.hold(line.points)
        depth = np.where(beside, -line.points[:, 2], 0.0)
        top = line.shifted(-np.clip(_LAID_BACK * depth, 0.0, _BROADEST) - 0.3)
        for run in _runs(beside):
            yield from _slope(line.points[run, :2], top[run])


def _slope(foot: Array, top: Array) -> Iterator[Shape]:
    """Yields the ground between foot and upper edge (n, 2) [m] of a slope."""
    for k in range(0, len(top) - 1, 8):
        yield Shape(np.concatenate((foot[k : k + 9], top[k : k + 9][::-1])), palette.CUTTING)
    s = polyline_stations(foot)
    for at in np.arange(_HACHURE / 2.0, s[-1], _HACHURE):
        low, high = (np.array([np.interp(at, s, line[:, k]) for k in (0, 1)]) for line in (foot, top))
        along = 0.28 * (foot[-1] - foot[0]) / max(float(np.hypot(*(foot[-1] - foot[0]))), 1e-6)
        # hachures taper downhill
        yield Shape(np.stack((high - along, high + along, 0.35 * high + 0.65 * low)), palette.CUTTING_EDGE)
    yield from (Shape(piece, palette.CUTTING_EDGE) for piece in strokes(top, 0.3))


def _runs(wanted: NDArray[np.bool_]) -> Iterator[NDArray[np.int64]]:
    for run in np.split(np.arange(len(wanted)), np.flatnonzero(np.diff(wanted.astype(int)) != 0) + 1):
        if wanted[run[0]] and len(run) > 1:
            yield run


def tunnel_floors(
    town: Town, parts: Sequence[LevelStretch], lines: Sequence[Border], covered: LevelLookup
) -> Iterator[Shape]:
    """Yields light asphalt with broken edges between walls for the parts of roads under streets.

    Args:
        town: whose lanes.
        parts: the tunnels.
        lines: what lies beside the lanes.
        covered: what lies in the tunnels.
    """
    for line in lines:
        if line.kind is BorderKind.MEDIAN:
            for run in held(line, covered):
                yield from (Shape(piece, palette.TUNNEL) for piece in flat_strip(line, run, _JITTER))
    for part in parts:
        yield Shape(ribbon(town.lanes[part.lane], 0.05, part.start, part.end), palette.TUNNEL)
    for line in lines:
        if line.kind is BorderKind.EDGE:
            for run in held(line, covered):
                dashes = dash_pattern(polyline_length(line.points[run]), 1.6, 1.2)
                for piece in cut(line.points[run, :2], dashes):
                    yield from (Shape(outline, palette.TUNNEL_EDGE) for outline in strokes(piece, 0.6))


def portals(town: Town, parts: Sequence[LevelStretch]) -> Iterator[Shape]:
    """Yields the walls above tunnel mouths: one straight wall for all parallel lanes."""
    mouths = []
    for part in parts:
        lane = town.lanes[part.lane]
        for station, sign in ((part.start, -1.0), (part.end, 1.0)):
            if 0.0 < station < lane.length:
                way = lane.heading_at(station)
                half = lane.width_at(station) / 2.0
                corners = np.stack([lane.position(station, side * half) for side in (-1.0, 1.0)])
                mouths.append((corners, sign * np.array([np.cos(way), np.sin(way)])))
    while mouths:
        group, mouths = [mouths[0]], mouths[1:]
        while beside := [k for k, mouth in enumerate(mouths) if _same_portal(group, mouth)]:
            group += [mouths[k] for k in beside]
            mouths = [mouth for k, mouth in enumerate(mouths) if k not in beside]
        yield from _portal(group)


def _same_portal(group: Sequence[tuple[Array, Array]], mouth: tuple[Array, Array]) -> bool:
    return any(
        float(np.hypot(*(corners.mean(axis=0) - mouth[0].mean(axis=0)))) < _ABREAST and float(out @ mouth[1]) > 0.8
        for corners, out in group
    )


def _portal(group: Sequence[tuple[Array, Array]]) -> Iterator[Shape]:
    """Yields the light floor of each lane up to the wall, and the wall; from corners (2, 2) [m] and directions."""
    out = np.mean([way for _, way in group], axis=0)
    right = np.array([-out[1], out[0]])
    middles = np.array(sorted((corners.mean(axis=0) for corners, _ in group), key=lambda at: float(at @ right)))
    # The wall follows the mouths of the outermost lanes: it is slanted where the street above is.
    along = middles[-1] - middles[0] if len(group) > 1 else right
    along = along / np.hypot(*along)
    across = np.array([along[1], -along[0]])
    across *= 1.0 if float(across @ out) > 0.0 else -1.0
    corners = np.concatenate([pair for pair, _ in group])
    front = float((corners @ across).max())
    for pair, way in group:
        reach = (front - pair @ across) / float(way @ across)
        yield Shape(np.concatenate((pair, (pair + reach[:, None] * way)[::-1])), palette.TUNNEL)
    side = corners @ along
    edges = corners[np.argsort(side)]
    for left, right_edge in zip(edges[1:-1:2], edges[2::2], strict=True):
        # Between the two directions there is asphalt before the portal, where the grass ends.
        reach = (front - np.array([left, right_edge]) @ across) / float(out @ across)
        wall = np.array([left, right_edge]) + reach[:, None] * out
        yield Shape(np.concatenate((wall, (wall + _APRON * out)[::-1])), palette.ROAD)
    ends = front * across + np.array([[side.min() - _OVER], [side.max() + _OVER]]) * along
    yield Shape(stroke(ends, _PORTAL), palette.BRIDGE_PARAPET)
    for shift in (-0.5, 0.5):
        yield Shape(stroke(ends + shift * _PORTAL * across, 0.3), palette.BRIDGE_EDGE)
