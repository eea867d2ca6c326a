"""Built surfaces: pavements, kerbs, asphalt, planted medians, lay-bys, bridges and tunnels."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from dorothie_gym.pictures import palette
from dorothie_gym.pictures.maps.borders import SAME_SURFACE, Border, BorderKind
from dorothie_gym.pictures.maps.ground import junction_areas
from dorothie_gym.pictures.maps.levels import LevelLookup, LevelStretch, cuttings
from dorothie_gym.pictures.maps.medians import Pocket, flat_strip, held, medians, pocket_grounds
from dorothie_gym.pictures.maps.shapes import (
    Shape,
    TownSamples,
    cut,
    dash_pattern,
    disc,
    polyline_length,
    polyline_stations,
    ribbon,
    side_line,
    stroke,
    strokes,
)
from dorothie_gym.support import portable_arrays as pn

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array, Lane, Site
    from dorothie_gym.maps.town import Town
    from dorothie_gym.pictures.palette import Colour

_LAID_BACK = 0.55  # [m] of slope per metre of depth
_BROADEST_SLOPE = 3.0  # [m]
_HACHURE = 2.4  # [m] between hachures
_PORTAL = 0.9  # [m]
_APRON = 4.0  # [m] of asphalt before a portal, where grass ends
_OVER = 0.9  # [m] by which the wall of a portal extends beyond the road
_JITTER = 2.0  # [m] between the points of borders
_BEFORE_WALL = 0.35  # [m] of a pavement in a tunnel beyond its width
_ABREAST = 14.0  # [m] between lanes through one portal


def walls(lines: Iterable[Border], deep: LevelLookup, covered: LevelLookup) -> Iterator[Shape]:
    """Yields slopes beside roads in cuttings, hachured from their upper edges, wider where they are deeper."""
    for line in lines:
        if line.kind is not BorderKind.EDGE:
            continue
        beside = deep.hold(line.points) & ~covered.hold(line.points)
        depth = np.where(beside, -line.points[:, 2], 0.0)
        top = line.shifted(-np.clip(_LAID_BACK * depth, 0.0, _BROADEST_SLOPE) - 0.3)
        for run in _runs(beside):
            yield from _slope(line.points[run, :2], top[run])


def _slope(foot: Array, top: Array) -> Iterator[Shape]:
    """Yields the ground between foot and upper edge (n, 2) [m] of a slope."""
    for k in range(0, len(top) - 1, 8):
        yield Shape(np.concatenate((foot[k : k + 9], top[k : k + 9][::-1])), palette.CUTTING)
    s = polyline_stations(foot)
    for at in np.arange(_HACHURE / 2.0, s[-1], _HACHURE):
        low, high = (np.array([np.interp(at, s, line[:, k]) for k in (0, 1)]) for line in (foot, top))
        along = 0.28 * (foot[-1] - foot[0]) / max(float(pn.hypot(*(foot[-1] - foot[0]))), 1e-6)
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
        town: town of the lanes.
        parts: the tunnels.
        lines: borders of the lanes.
        covered: lookup of the parts in tunnels.
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


def tunnel_pavements(town: Town, covered: LevelLookup) -> Iterator[Shape]:
    """Yields the pavements in tunnels, up to the walls; `covered` finds the lanes in tunnels."""
    for walk in town.sidewalks:
        middle = cut(walk.points, [(0.0, polyline_length(walk.points))], 1.0)[0]
        for run in _runs(covered.beside(middle, _LEVEL_REACH)):
            pieces = strokes(middle[run, :2], min(walk.width, _WIDEST_WALK) + 2.0 * _BEFORE_WALL)
            yield from (Shape(piece, palette.SIDEWALK) for piece in pieces)


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
                mouths.append((corners, sign * np.array([pn.cos(way), pn.sin(way)])))
    while mouths:
        group, mouths = [mouths[0]], mouths[1:]
        while beside := [k for k, mouth in enumerate(mouths) if _same_portal(group, mouth)]:
            group += [mouths[k] for k in beside]
            mouths = [mouth for k, mouth in enumerate(mouths) if k not in beside]
        yield from _portal(group)


def _same_portal(group: Sequence[tuple[Array, Array]], mouth: tuple[Array, Array]) -> bool:
    return any(
        float(pn.hypot(*(corners.mean(axis=0) - mouth[0].mean(axis=0)))) < _ABREAST
        and float(pn.dot(out, mouth[1])) > 0.8
        for corners, out in group
    )


def _portal(group: Sequence[tuple[Array, Array]]) -> Iterator[Shape]:
    """Yields the light floor of each lane up to the wall, and the wall; from corners (2, 2) [m] and directions."""
    out = np.mean([way for _, way in group], axis=0)
    right = np.array([-out[1], out[0]])
    middles = np.array(sorted((corners.mean(axis=0) for corners, _ in group), key=lambda at: float(pn.dot(at, right))))
    # The wall follows the mouths of the outermost lanes: it is slanted where the street above is.
    along = middles[-1] - middles[0] if len(group) > 1 else right
    along = along / pn.hypot(*along)
    across = np.array([along[1], -along[0]])
    across *= 1.0 if float(pn.dot(across, out)) > 0.0 else -1.0
    corners = np.concatenate([pair for pair, _ in group])
    front = float(pn.dot(corners, across).max())
    for pair, way in group:
        reach = (front - pn.dot(pair, across)) / float(pn.dot(way, across))
        yield Shape(np.concatenate((pair, (pair + reach[:, None] * way)[::-1])), palette.TUNNEL)
    side = pn.dot(corners, along)
    edges = corners[np.argsort(side, kind="stable")]
    for left, right_edge in zip(edges[1:-1:2], edges[2::2], strict=True):
        # Between the two directions there is asphalt before the portal, where the grass ends.
        reach = (front - pn.dot(np.array([left, right_edge]), across)) / float(pn.dot(out, across))
        wall = np.array([left, right_edge]) + reach[:, None] * out
        yield Shape(np.concatenate((wall, (wall + _APRON * out)[::-1])), palette.ROAD)
    ends = front * across + np.array([[side.min() - _OVER], [side.max() + _OVER]]) * along
    yield Shape(stroke(ends, _PORTAL), palette.BRIDGE_PARAPET)
    for shift in (-0.5, 0.5):
        yield Shape(stroke(ends + shift * _PORTAL * across, 0.3), palette.BRIDGE_EDGE)


# --- Pavements and verges ---------------------------------------------------------------------------------------------

_EDGE = 0.15  # [m]
_WIDEST_WALK = 4.0  # [m] drawn at most: some maps mark whole squares as pavements
_WIDEST_VERGE = 4.5  # [m]
_CORNER = 6.0  # [m] between a junction and the pavements that continue around it
_LONGEST_CORNER = 45  # [m] from the end of a pavement to the start of the next one
_BESIDE = 0.1  # [m] between the edge of the road and a pavement
_FROM_ARM = 16.0  # [m] from the end of an arm's pavement to the start of that of the ring
_LARGEST_RING = 80.0  # [m] radius
_LONGEST_ARC = 120.0  # [m] from arm to arm
_JOINED = 4  # segments of an outline per polygon


def sidewalks(town: Town, areas: Sequence[Array], lines: Sequence[Border], bridges: LevelLookup) -> Iterator[Shape]:
    """Yields pavements on the ground, including those around roundabouts and around the corners of junctions."""
    walks = [
        (walk.points[run, :2], min(walk.width, _WIDEST_WALK))
        for walk in town.sidewalks
        for run in _runs(~bridges.beside(walk.points, _LEVEL_REACH))
    ]
    if not walks:
        return
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
    """Yields pavements outside the ring of a roundabout without its own, between those of its arms."""
    tree = cKDTree(np.concatenate([line[[0, -1]] for line, _ in walks]))
    every = cKDTree(np.concatenate([line for line, _ in walks]))
    for line in lines:
        length = polyline_length(line.points)
        if line.kind is not BorderKind.EDGE or not line.outer or length > _LONGEST_ARC:
            continue
        turns = line.sign * float(line.heading[0] - line.heading[-1]) / length  # away from the kerb
        near, where = (np.asarray(row) for row in tree.query(line.points[[0, -1], :2]))
        if turns < 1.0 / _LARGEST_RING or (near > _FROM_ARM).any():
            continue
        width = min(walks[int(k) // 2][1] for k in where)
        middle = line.shifted(-_BESIDE - width / 2.0)
        if float(every.query(middle[len(middle) // 2])[0]) > width:
            yield middle, width


def _corners(walks: Sequence[tuple[Array, float]], areas: Sequence[Array]) -> Iterator[tuple[Array, float]]:
    """Yields parts (n, 2) [m] of junction outlines between ends of pavements, and the width of pavement on them [m]."""
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
            if 1 <= count <= _LONGEST_CORNER:
                part = ring[np.arange(where[k], where[k] + count + 1) % len(ring)]
                yield part, float((away + half)[[k, after]].mean())


def verges(town: Town, lines: Iterable[Border], bridges: LevelLookup) -> Iterator[Shape]:
    """Yields paving between a kerb and a pavement that does not touch it, on the ground."""
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
        beside = (gap < _WIDEST_VERGE) & (np.abs(places[where, 2] - line.points[:, 2]) < SAME_SURFACE)
        beside &= ~bridges.hold(line.points)
        for run in np.split(np.arange(len(gap)), np.flatnonzero(np.diff(beside.astype(int)) != 0) + 1):
            if beside[run[0]] and len(run) > 1:
                for k in range(run[0], run[-1], 8):
                    part = slice(k, min(k + 9, run[-1] + 1))
                    yield Shape(np.concatenate((line.points[part, :2], outer[part][::-1])), palette.SIDEWALK)


def rim(outline: Array, margin: float, colour: Colour) -> Iterator[Shape]:
    """Yields a strip along an outline (n, 2) [m], up to a margin [m] from it."""
    yield from (Shape(piece, colour) for piece in strokes(outline, 2.0 * margin, _JOINED))
    yield from (Shape(disc(point, margin, 16), colour) for point in (*outline[::_JOINED], outline[-1]))


# --- Streets and bridges ---------------------------------------------------------------------------------------------

_ROAD_KERB = 0.45  # [m]
_VERGE = 1.6  # [m] of fictional pavement beside the roads of a town without sidewalks
_JOINT = 0.05  # [m]
_BAY_DEPTH = 2.3  # [m]
_BAY_LENGTH = 6.0  # [m] without its tapered ends
_BAY_TAPER = 2.2  # [m]
_LEVEL_REACH = 14.0  # [m] from the centre of a lane on a bridge or in a tunnel to that of a pavement there, at most
_BEFORE_PORTAL = 4.0  # [m] of asphalt between a median and the mouth of a tunnel
BEYOND_BRIDGE = 6.0  # [m] of asphalt and paint beyond a bridge: adjacent lanes begin theirs at different places


def streets(
    town: Town,
    samples: TownSamples,
    lines: Sequence[Border],
    parts: Sequence[LevelStretch],
    turn_lanes: Sequence[Pocket],
    left_out: Sequence[LevelStretch] = (),
) -> Iterator[Shape]:
    """Yields all surfaces on the ground, from the pavements to the medians; surfaces in tunnels come first.

    Args:
        town: town of the streets.
        samples: samples of its lanes.
        lines: borders of its lanes.
        parts: bridges and tunnels.
        turn_lanes: starts of turn lanes.
        left_out: bridges that are left out, as if seen from below; their place looks like the floor of a tunnel.
    """
    mouths = [part for part in parts if part.level < 0]
    tunnels = [*mouths, *left_out]
    covered = LevelLookup(samples, tunnels)
    yield from walls(lines, LevelLookup(samples, cuttings(town, mouths)), covered)
    yield from tunnel_floors(town, tunnels, lines, covered)
    pieces = list(_open_pieces(town, tunnels))
    areas = junction_areas(town)
    if town.sidewalks:
        # pavements within reach of the shorter ones lie on bridges
        bridges = LevelLookup(samples, [_longer(part, -_LEVEL_REACH) for part in parts if part.level > 0])
        yield from sidewalks(town, areas, lines, bridges)
        yield from verges(town, lines, bridges)
    else:
        yield from _layer(town, pieces, areas, _VERGE, palette.SIDEWALK)
    yield from _layer(town, pieces, areas, _ROAD_KERB, palette.KERB)
    yield from _bays(town, samples)
    for outline in areas:
        yield Shape(outline, palette.ROAD)
    yield from _layer(town, pieces, [], 0.0, palette.ROAD)
    for line in lines:
        if line.kind in (BorderKind.LANE, BorderKind.CENTRE):
            # parallel lanes may have a small gap
            middle = line.shifted(-line.gap / 2.0)
            for run in held(line, covered, wanted=False):
                yield from (Shape(piece, palette.ROAD) for piece in strokes(middle[run], 1.0))
    yield from pocket_grounds(town, turn_lanes)
    # grass continues below the ends of bridges, which differ between adjacent lanes
    shorter = [_longer(part, -BEYOND_BRIDGE) for part in parts if part.level > 0]
    yield from medians(lines, LevelLookup(samples, [*shorter, *(_longer(part, _BEFORE_PORTAL) for part in tunnels)]))
    yield from portals(town, mouths)


def _longer(part: LevelStretch, more: float) -> LevelStretch:
    """Extends a stretch at both ends [m]."""
    return replace(part, start=part.start - more, end=part.end + more)


def deck(town: Town, parts: Sequence[LevelStretch], lines: Iterable[Border], places: LevelLookup) -> Iterator[Shape]:
    """Yields the bridges of one level: shadow, parapets, pavements and asphalt.

    Args:
        town: town to paint.
        parts: stretches of that level.
        lines: borders; between parallel bridges there is concrete.
        places: lookup of the positions on the stretches.
    """
    lines = list(lines)
    paved = list(_bridge_pavements(town, lines, places))
    between = [(line, run) for line in lines if line.kind is BorderKind.MEDIAN for run in held(line, places)]
    layers = (
        (1.9, 0.0, palette.BRIDGE_SHADOW),
        (1.05, 0.0, palette.BRIDGE_EDGE),
        (0.75, 0.0, palette.BRIDGE_PARAPET),
        (0.25, 0.0, palette.KERB),
        (0.05, BEYOND_BRIDGE, palette.ROAD),
    )
    for margin, further, colour in layers:
        if colour == palette.KERB:
            for line, outer in paved:
                yield from (Shape(piece, palette.SIDEWALK) for piece in _beside(line, outer))
            for line, run in between:
                yield from (Shape(piece, palette.MEDIAN_KERB) for piece in flat_strip(line, run))
        elif colour != palette.ROAD:
            for line, outer in paved:
                yield from (Shape(piece, colour) for piece in _beside(line, outer + margin))
        for part in parts:
            lane = town.lanes[part.lane]
            reach = max(0.0, part.start - further), min(lane.length, part.end + further)
            if reach[1] - reach[0] > 0.5:
                yield Shape(ribbon(lane, margin, *reach), colour)


def _bridge_pavements(town: Town, lines: Iterable[Border], places: LevelLookup) -> Iterator[tuple[Border, Array]]:
    """Yields the edges of roads on bridges that have a pavement, and the distances (n,) to its outer edge [m]."""
    walks = [(walk, cut(walk.points, [(0.0, polyline_length(walk.points))], 1.0)[0]) for walk in town.sidewalks]
    rows = [(walk, points[places.beside(points, _LEVEL_REACH)]) for walk, points in walks]
    middle = np.concatenate([np.zeros((0, 3)), *(points for _, points in rows)])
    if not len(middle):
        return
    half = np.concatenate([np.full(len(points), min(walk.width, _WIDEST_WALK) / 2.0) for walk, points in rows])
    tree = cKDTree(middle[:, :2])
    for line in lines:
        if line.kind is BorderKind.EDGE:
            near, where = (np.asarray(row) for row in tree.query(line.points[:, :2]))
            outside = pn.hypot(*(line.shifted(-near) - middle[where, :2]).T) < near  # and not across the road
            level = np.abs(middle[where, 2] - line.points[:, 2]) < SAME_SURFACE
            for run in _runs(places.hold(line.points) & outside & level & (near < _LEVEL_REACH)):
                yield line.part(run), near[run] + half[where[run]]


def _beside(line: Border, reach: Array) -> Iterator[Array]:
    """Yields polygons (n, 2) [m] from an edge of a road to a distance (n,) [m] outside of it."""
    outer = line.shifted(-reach)
    for k in range(0, len(outer) - 1, 8):
        yield np.concatenate((line.points[k : k + 9, :2], outer[k : k + 9][::-1]))


def _open_pieces(town: Town, tunnels: Sequence[LevelStretch]) -> Iterator[tuple[Lane, float, float]]:
    """Lanes, or their parts outside tunnels."""
    hidden: dict[int, list[LevelStretch]] = defaultdict(list)
    for part in tunnels:
        hidden[part.lane].append(part)
    for lane in town.lanes:
        start = 0.0
        for part in hidden[lane.id]:
            if part.start - start > 0.5:
                yield lane, start, part.start
            start = part.end
        if lane.length - start > (0.5 if start else 0.0):
            yield lane, start, lane.length


def _layer(
    town: Town, pieces: Iterable[tuple[Lane, float, float]], areas: Sequence[Array], margin: float, colour: Colour
) -> Iterator[Shape]:
    """Yields all roads and junctions, wider by a margin [m] on either side."""
    for lane, start, end in pieces:
        wider = _JOINT if lane.in_junction and not margin else 0.0
        yield Shape(ribbon(lane, margin + wider, start, end), colour)
        for s in {start, end} & {0.0, lane.length}:  # rounded joints, but none at the mouths of tunnels
            yield Shape(disc(lane.position(s), lane.width_at(s) / 2.0 + margin), colour)
    for outline in areas:
        yield Shape(outline, colour)
        if margin:
            yield from rim(np.concatenate((outline, outline[:1])), margin, colour)


def _bays(town: Town, samples: TownSamples) -> Iterator[Shape]:
    """Yields a lay-by at each landmark site with room beside the lane, and a path from it to the site."""
    tree = cKDTree(samples.centre[:, :2])
    for site in town.sites:
        lane = town.lanes[site.lane]
        door = np.array(site.waypoint)
        yield from (Shape(piece, palette.SIDEWALK) for piece in strokes(np.array([door, site.position]), 1.4))
        yield Shape(disc(site.position, 2.3), palette.SIDEWALK)
        outline = bay_outline(lane, site)
        if outline is None:
            continue
        near, where = tree.query(outline[2:-2])
        if (near < samples.half_width[where] + 0.2).any():
            continue
        yield from (Shape(piece, palette.KERB) for piece in strokes(outline, 2.0 * _ROAD_KERB))
        yield Shape(outline, palette.BAY)


def bay_outline(lane: Lane, site: Site) -> Array | None:
    """Returns the outline (n, 2) [m] of the lay-by beside a lane at a site, or None if the lane is too short.

    The first and last points lie on the lane, all others beyond its edge.
    """
    half = _BAY_LENGTH / 2.0 + _BAY_TAPER
    if lane.length < 2.0 * half + 1.0:
        return None
    middle = float(np.clip(site.station, half + 0.5, lane.length - half - 0.5))
    side = 1.0 if lane.project(np.array(site.position))[1] >= 0 else -1.0
    s = middle + np.array([-half, -half, *np.linspace(-_BAY_LENGTH / 2.0, _BAY_LENGTH / 2.0, 5), half, half])
    depth = np.array([-0.3, 0.05, *([_BAY_DEPTH] * 5), 0.05, -0.3])
    edge = np.interp(s, lane.stations, lane.widths) / 2.0
    return side_line(lane, s, side * (edge + depth))
