"""What lies between the two directions of a street: kerbs, grass and trees."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.world.graphics import palette
from dorothie_gym.world.graphics.borders import Border, BorderKind
from dorothie_gym.world.graphics.levels import Places
from dorothie_gym.world.graphics.shapes import Shape, disc, longer
from dorothie_gym.world.town.model import Array

SHORTEST_MEDIAN = 8.0
"""What is no longer than this between the two directions is not planted [m]."""

_KERB = 0.3  # [m]
_TREE_SPACING = 11.0  # [m]
_TREE_ROOM = 2.2  # [m] of median that a tree needs


def medians(lines: Iterable[Border], bridges: Places) -> Iterator[Shape]:
    """The strips between the two directions, each half from its own side: a kerb, grass, and trees where they fit."""
    strips = []
    for line in lines:
        if line.kind is not BorderKind.MEDIAN:
            continue
        for run in held(line, bridges, wanted=False):
            if np.ptp(line.points[run, :2], axis=0).max() > SHORTEST_MEDIAN:
                strips.append((line, run))
    for line, run in strips:
        # Asphalt around the round ends.
        yield from (Shape(piece, palette.ROAD) for piece in flat_strip(line, run))
    for inset, colour in ((0.0, palette.MEDIAN_KERB), (_KERB, palette.MEDIAN)):
        for line, run in strips:
            yield from (Shape(quad, colour) for quad in _half_strip(line, run, inset))
    planted: list[Array] = []
    for line, run in strips:
        # Each strip is found from both sides.
        for centre, radius in _median_trees(line, run):
            if not planted or np.hypot(*(np.array(planted) - centre).T).min() > 0.6 * _TREE_SPACING:
                planted.append(centre)
                yield Shape(disc(centre, radius, 16), palette.MEDIAN_TREE)


def held(line: Border, places: Places, wanted: bool = True) -> Iterator[NDArray[np.int64]]:
    """Index runs of a border that lie on some places, or do not."""
    on = places.hold(line.points) == wanted
    for run in np.split(np.arange(len(on)), np.flatnonzero(np.diff(on.astype(int)) != 0) + 1):
        if on[run[0]] and len(run) > 1:
            yield run


def flat_strip(line: Border, run: NDArray[np.int64], further: float = 3.0) -> Iterator[Array]:
    """Polygons (n, 2) [m] from the edge to a little beyond the middle of a median, and `further` [m] at its ends."""
    edge, inner = line.points[run, :2], line.shifted(-line.gap / 2.0 - 0.1)[run]
    if further:
        edge, inner = longer(edge, further), longer(inner, further)
    for k in range(0, len(edge) - 1, 8):
        yield np.concatenate((edge[k : k + 9], inner[k : k + 9][::-1]))


def _half_strip(line: Border, run: NDArray[np.int64], inset: float) -> Iterator[Array]:
    """Quadrangles (4, 2) [m] from the edge to a little beyond the middle of a median, round at its ends."""
    s = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(line.points[run, :2], axis=0).T))))
    fine = np.unique(np.concatenate((np.linspace(0, s[-1], max(2, len(s))), *(_nose(end, s[-1]) for end in (0, 1)))))
    edge = np.stack([np.interp(fine, s, line.points[run, k]) for k in (0, 1)], axis=-1)
    heading = np.interp(fine, s, line.heading[run])
    gap = np.interp(fine, s, line.gap[run])
    left = np.stack((np.sin(heading), -np.cos(heading)), axis=-1)
    radius = np.maximum(gap / 2.0 - inset, 0.0)
    # A nose is a half circle: the strip narrows over as much of its length as it is wide on one side.
    near = np.clip(np.minimum(fine, s[-1] - fine) - inset, 0.0, None)
    depth = np.clip(radius - near, 0.0, radius)
    half = np.sqrt(np.maximum(radius**2 - depth**2, 0.0))
    outer = edge + (gap / 2.0 - half)[:, None] * left
    inner = edge + (gap / 2.0 + 0.1 * (half > 0.1))[:, None] * left
    for k in range(0, len(fine) - 1, 8):
        part = slice(k, k + 9)
        if half[part].max() > 0.05:
            yield np.concatenate((outer[part], inner[part][::-1]))


def _nose(end: int, length: float) -> Array:
    """Stations close to an end of a strip, fine enough for a round nose."""
    near = np.arange(0.0, min(length, 7.0), 0.25)
    return length - near if end else near


def _median_trees(line: Border, run: NDArray[np.int64]) -> Iterator[tuple[Array, float]]:
    """Where trees may stand and how large they are [m]."""
    middle = line.shifted(-line.gap / 2.0)[run]
    s = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(middle, axis=0).T))))
    for at in np.arange(_TREE_SPACING / 2.0, s[-1] - _TREE_SPACING / 2.0, _TREE_SPACING):
        room = float(np.interp(at, s, line.gap[run])) - 2.0 * _KERB
        if room >= _TREE_ROOM:
            centre = np.array([np.interp(at, s, middle[:, 0]), np.interp(at, s, middle[:, 1])])
            yield centre, min(1.5, 0.4 * room)
