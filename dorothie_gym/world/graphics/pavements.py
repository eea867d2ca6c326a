"""Where people walk: the pavements of a map, and what joins them to the kerbs and around the corners."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from scipy.spatial import cKDTree

from dorothie_gym.world.graphics import palette
from dorothie_gym.world.graphics.borders import Border, BorderKind
from dorothie_gym.world.graphics.palette import Colour
from dorothie_gym.world.graphics.shapes import Shape, cut, disc, polyline_length, strokes
from dorothie_gym.world.town.model import Array, Town

_EDGE = 0.15  # [m]
_WIDEST_WALK = 4.0  # [m] that is drawn: squares that a map calls pavements would hide the ground
_WIDEST_VERGE = 4.5  # [m]
_CORNER = 6.0  # [m] between a junction and the pavements that go on around it
_AROUND = 45  # [m] from the end of a pavement to where another one takes over
_BESIDE = 0.1  # [m] between the edge of the road and a pavement
_FROM_ARM = 16.0  # [m] from the end of an arm's pavement to where the ring's goes on
_LARGEST_RING = 80.0  # [m], its radius
_LONGEST_ARC = 120.0  # [m] from arm to arm
_SAME_LEVEL = 1.5  # [m]
_JOINED = 4  # segments of an outline that are drawn at once


def sidewalks(town: Town, areas: Sequence[Array], lines: Sequence[Border]) -> Iterator[Shape]:
    """The pavements, around roundabouts those that go on from its arms, and around corners what joins them."""
    walks = [(walk.points[:, :2], min(walk.width, _WIDEST_WALK)) for walk in town.sidewalks]
    walks += list(_around_rings(walks, lines))
    corners = list(_corners(walks, areas))
    for wider, colour in ((_EDGE, palette.SIDEWALK_EDGE), (0.0, palette.SIDEWALK)):
        for line, width in corners:
            yield from rim(line, width + wider, colour)
        for line, narrow in walks:
            width = narrow + 2.0 * wider
            yield from (Shape(piece, colour) for piece in strokes(line, width))
            yield from (Shape(disc(end, width / 2.0), colour) for end in (line[0], line[-1]))


def _around_rings(walks: Sequence[tuple[Array, float]], lines: Iterable[Border]) -> Iterator[tuple[Array, float]]:
    """Pavements outside the ring of a roundabout, where none is known, between those of its arms."""
    tree = cKDTree(np.concatenate([line[[0, -1]] for line, _ in walks]))
    every = cKDTree(np.concatenate([line for line, _ in walks]))
    for line in lines:
        length = polyline_length(line.points)
        if line.kind is not BorderKind.EDGE or line.sign < 0 or length > _LONGEST_ARC:
            continue
        turns = float(line.heading[0] - line.heading[-1]) / length  # to the left: traffic goes around on the right
        near, where = (np.asarray(row) for row in tree.query(line.points[[0, -1], :2]))
        if turns < 1.0 / _LARGEST_RING or (near > _FROM_ARM).any():
            continue
        width = min(walks[int(k) // 2][1] for k in where)
        middle = line.shifted(-_BESIDE - width / 2.0)
        if float(every.query(middle[len(middle) // 2])[0]) > width:
            yield middle, width


def _corners(walks: Sequence[tuple[Array, float]], areas: Sequence[Array]) -> Iterator[tuple[Array, float]]:
    """Parts (n, 2) [m] of the outlines of junctions between ends of pavements, and how far those reach from them."""
    ends = np.concatenate([line[[0, -1]] for line, _ in walks])
    half = np.repeat([width / 2.0 for _, width in walks], 2)
    for outline in areas:
        closed = np.concatenate((outline, outline[:1]))
        ring = cut(closed, [(0.0, polyline_length(closed))], 1.0)[0][:-1]
        away, where = (np.asarray(row) for row in cKDTree(ring).query(ends))
        near = np.flatnonzero(away < _CORNER)
        near = near[np.argsort(where[near], kind="stable")]
        for k, after in zip(near.tolist(), np.roll(near, -1).tolist(), strict=True):
            count = int(where[after] - where[k]) % len(ring)
            if 1 <= count <= _AROUND:
                part = ring[np.arange(where[k], where[k] + count + 1) % len(ring)]
                yield part, float((away + half)[[k, after]].mean())


def verges(town: Town, lines: Iterable[Border]) -> Iterator[Shape]:
    """What lies between a kerb and a pavement that does not touch it, paved as well."""
    walks = [(walk, cut(walk.points, [(0.0, polyline_length(walk.points))], 1.0)[0]) for walk in town.sidewalks]
    places = np.concatenate([points for _, points in walks])
    tree = cKDTree(places[:, :2])
    half = np.concatenate([np.full(len(points), min(walk.width, _WIDEST_WALK) / 2.0) for walk, points in walks])
    for line in lines:
        if line.kind is not BorderKind.EDGE:
            continue
        near, where = tree.query(line.points[:, :2])
        gap = near - half[where]
        outer = line.shifted(-np.clip(gap + 0.5, 0.0, _WIDEST_VERGE + 0.5))
        beside = (gap < _WIDEST_VERGE) & (np.abs(places[where, 2] - line.points[:, 2]) < _SAME_LEVEL)
        for run in np.split(np.arange(len(gap)), np.flatnonzero(np.diff(beside.astype(int)) != 0) + 1):
            if beside[run[0]] and len(run) > 1:
                for k in range(run[0], run[-1], 8):
                    part = slice(k, min(k + 9, run[-1] + 1))
                    yield Shape(np.concatenate((line.points[part, :2], outer[part][::-1])), palette.SIDEWALK)


def rim(outline: Array, margin: float, colour: Colour) -> Iterator[Shape]:
    """What lies along an outline (n, 2) [m], as far as a margin [m] from it."""
    yield from (Shape(piece, colour) for piece in strokes(outline, 2.0 * margin, _JOINED))
    yield from (Shape(disc(point, margin, 16), colour) for point in (*outline[::_JOINED], outline[-1]))
