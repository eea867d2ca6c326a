"""What is built: pavements, kerbs, asphalt, planted medians, lay-bys, bridges and tunnels."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from dorothie_gym.world.graphics import palette
from dorothie_gym.world.graphics.borders import Border, BorderKind
from dorothie_gym.world.graphics.ground import junction_areas
from dorothie_gym.world.graphics.levels import Places, Stretch, cuttings
from dorothie_gym.world.graphics.medians import flat_strip, held, medians
from dorothie_gym.world.graphics.palette import Colour
from dorothie_gym.world.graphics.pavements import rim, sidewalks, verges
from dorothie_gym.world.graphics.pockets import Pocket, pocket_grounds
from dorothie_gym.world.graphics.samples import Samples
from dorothie_gym.world.graphics.shapes import Shape, disc, ribbon, side_line, strokes
from dorothie_gym.world.graphics.tunnels import portals, tunnel_floors, walls
from dorothie_gym.world.town.model import Array, Lane, Site, Town

_KERB = 0.45  # [m]
_VERGE = 1.6  # [m] of pavement made up beside the roads of a town that knows of none
_JOINT = 0.05  # [m]
_BAY_DEPTH = 2.3  # [m]
_BAY_LENGTH = 6.0  # [m] without its tapered ends
_BAY_TAPER = 2.2  # [m]
_BEFORE_PORTAL = 4.0  # [m] of asphalt between a median and the mouth of a tunnel
_FURTHER = 6.0  # [m] of asphalt beyond a bridge: lanes side by side do not start theirs at the same place


def streets(
    town: Town, samples: Samples, lines: Sequence[Border], parts: Sequence[Stretch], turn_lanes: Sequence[Pocket]
) -> Iterator[Shape]:
    """Everything on the ground, from the pavements to the medians; what lies in tunnels comes first.

    Args:
        town: whose streets.
        samples: of its lanes.
        lines: what lies beside them.
        parts: bridges and tunnels.
        turn_lanes: the beginnings of turn lanes.
    """
    tunnels = [part for part in parts if part.level < 0]
    covered = Places(samples, tunnels)
    yield from walls(lines, Places(samples, cuttings(town, tunnels)), covered)
    yield from tunnel_floors(town, tunnels, lines, covered)
    pieces = list(_open_pieces(town, tunnels))
    areas = junction_areas(town)
    if town.sidewalks:
        yield from sidewalks(town, areas, lines)
        yield from verges(town, lines)
    else:
        yield from _layer(town, pieces, areas, _VERGE, palette.SIDEWALK)
    yield from _layer(town, pieces, areas, _KERB, palette.KERB)
    yield from _bays(town, samples)
    for outline in areas:
        yield Shape(outline, palette.ROAD)
    yield from _layer(town, pieces, [], 0.0, palette.ROAD)
    for line in lines:
        if line.kind in (BorderKind.LANE, BorderKind.CENTRE):
            # Lanes side by side may lie a little apart.
            middle = line.shifted(-line.gap / 2.0)
            for run in held(line, covered, wanted=False):
                yield from (Shape(piece, palette.ROAD) for piece in strokes(middle[run], 1.0))
    yield from pocket_grounds(town, turn_lanes)
    # Grass goes on below the ends of bridges: those of lanes side by side are not at the same place.
    shorter = [_longer(part, -_FURTHER) for part in parts if part.level > 0]
    yield from medians(lines, Places(samples, [*shorter, *(_longer(part, _BEFORE_PORTAL) for part in tunnels)]))
    yield from portals(town, tunnels)


def _longer(part: Stretch, more: float) -> Stretch:
    """A stretch that begins and ends so much further out [m]."""
    return replace(part, start=part.start - more, end=part.end + more)


def deck(town: Town, parts: Sequence[Stretch], lines: Iterable[Border], places: Places) -> Iterator[Shape]:
    """The bridges of one level: their shadow on what lies below, the parapets, and the asphalt.

    Args:
        town: whose lanes.
        parts: the stretches of that level.
        lines: borders; between two bridges side by side there is concrete.
        places: what lies on the stretches.
    """
    between = [(line, run) for line in lines if line.kind is BorderKind.MEDIAN for run in held(line, places)]
    layers = (
        (1.9, 0.0, palette.BRIDGE_SHADOW),
        (1.05, 0.0, palette.BRIDGE_EDGE),
        (0.75, 0.0, palette.BRIDGE_PARAPET),
        (0.25, 0.0, palette.KERB),
        (0.05, _FURTHER, palette.ROAD),
    )
    for margin, further, colour in layers:
        if colour == palette.KERB:
            for line, run in between:
                yield from (Shape(piece, palette.MEDIAN_KERB) for piece in flat_strip(line, run))
        for part in parts:
            lane = town.lanes[part.lane]
            reach = max(0.0, part.start - further), min(lane.length, part.end + further)
            if reach[1] - reach[0] > 0.5:
                yield Shape(ribbon(lane, margin, *reach), colour)


def _open_pieces(town: Town, tunnels: Sequence[Stretch]) -> Iterator[tuple[Lane, float, float]]:
    """Lanes, or what of them lies not in tunnels."""
    hidden: dict[int, list[Stretch]] = defaultdict(list)
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
    """All roads and junctions, wider by a margin [m] on either side."""
    for lane, start, end in pieces:
        wider = _JOINT if lane.in_junction and not margin else 0.0
        yield Shape(ribbon(lane, margin + wider, start, end), colour)
        for s in {start, end} & {0.0, lane.length}:  # rounded joints, but none at the mouths of tunnels
            yield Shape(disc(lane.position(s), lane.width_at(s) / 2.0 + margin), colour)
    for outline in areas:
        yield Shape(outline, colour)
        if margin:
            yield from rim(np.concatenate((outline, outline[:1])), margin, colour)


def _bays(town: Town, samples: Samples) -> Iterator[Shape]:
    """A lay-by at every landmark site where there is room beside the lane, and a path from it to the site."""
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
        yield from (Shape(piece, palette.KERB) for piece in strokes(outline, 2.0 * _KERB))
        yield Shape(outline, palette.BAY)


def bay_outline(lane: Lane, site: Site) -> Array | None:
    """Outline (n, 2) [m] of the lay-by beside a lane at a site, or None where the lane is too short for one.

    Its first and last points are on the lane; all others are beyond its edge.
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
