"""Bridges and tunnels: decks with sides, parapets and pillars; floors with walls and ceilings; parapets on portals."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.pictures.camera.ground.heights import HeightField, Zone
from dorothie_gym.pictures.camera.ground.lookup import GROUND_SHEET, GroundArrays, material_at
from dorothie_gym.pictures.camera.ground.materials import KERB_HEIGHT, LOOKS, Material
from dorothie_gym.pictures.camera.ground.partition import Area, cut_areas
from dorothie_gym.pictures.camera.ground.regions import GRID, footprint, only_areas, polygons_of, tidy
from dorothie_gym.pictures.camera.ground.surface import (
    PORTAL_HEIGHT,
    ROOF,
    Edges,
    GroundTriangles,
    TunnelFloors,
    add_faces,
    add_sheet,
    find_edges,
)
from dorothie_gym.support import portable_arrays as pn

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.maps.town import Town
    from dorothie_gym.pictures.camera.ground.sheets import Sheet
    from dorothie_gym.pictures.camera.mesh import MeshBuilder
    from dorothie_gym.pictures.maps.levels import LevelStretch

COVER = 3.2
"""Width of covered ground on both sides of the lanes in a tunnel [m]: beyond the slopes of a cutting."""

_BEHIND = 1.0  # [m] of covered ground behind the pavements in a tunnel
_FARTHEST_PAVEMENT = 14.0  # [m] from the edge of a lane in a tunnel to the outer edge of its pavement
_KERB = 0.05  # [m] of road beyond the lanes there
_TUNNELS = -1  # level
_CELL = 8.0  # [m]
_OVERLAP = 0.05  # [m] by which the floor of a tunnel continues in the open
_UNDER = 0.3  # [m] of the walls of tunnels below their floors
_THICK = 0.4  # [m] of the walls of tunnels, for the sun
_LID = 0.15  # [m] below the ground over tunnels
_SUNK = 0.005  # [m] of the floor there below the road
_MOUTH = 16.0  # [m] of floor beyond the covered lanes, at most: up to the wall over the mouth
_JOINT = 0.35  # [m] of floor beyond the lanes: the walls stand behind the edges of the mouth
_GAP = 5.0  # [m] between two lanes in one tunnel, at most
_DECK_MARGIN = 1.05  # [m] beyond the lanes, as the map draws it
_DECK_OVERLAP = 0.3  # [m] of a deck beyond the ends of a bridge
_DECK_THICKNESS = 0.9  # [m]
_PARAPET = 0.85  # [m] height
_PARAPET_WIDTH = 0.3  # [m]
_STEP = 0.05  # [m] between the heights of parapets that meet, at most
_SHARPEST = 0.4  # 1 + the cosine of the sharpest corner with a mitre
_LOWER = 1.0  # [m] by which the ground lies lower beside a parapet
_PILLARS = 18.0  # [m] apart
_PILLAR_WIDTH = 1.2  # [m]
_TALLEST_WITHOUT = 2.5  # [m] of a bridge without pillars
_CONCRETE = (164, 162, 156)
_SHADED = (138, 136, 131)
_TILES = (178, 178, 172)


def covered_ground(town: Town, sheets: Sequence[Sheet]) -> BaseGeometry:
    """Returns the area above tunnels and their pavements, with the walls that the map draws over their mouths."""
    parts = [part for sheet in sheets for part in sheet.stretches if part.level < 0]
    tunnels = footprint(town, parts, COVER)
    if tunnels.is_empty:
        return tunnels
    pavements = shapely.buffer(_pavements(sheets), _BEHIND, join_style="mitre")
    aside = shapely.intersection(pavements, footprint(town, parts, _FARTHEST_PAVEMENT))
    kinds = (Material.PARAPET, Material.BRIDGE_EDGE, Material.TUNNEL_FLOOR)
    walls = [part.points for part in sheets[GROUND_SHEET].polygons if part.material in kinds]
    return tidy(only_areas(shapely.union_all([tunnels, aside, *polygons_of(walls)])))


def _pavements(sheets: Sequence[Sheet]) -> BaseGeometry:
    """Returns the area of the pavements in tunnels."""
    inside = [part for sheet in sheets if sheet.level < 0 for part in sheet.polygons]
    paved = polygons_of(part.points for part in inside if part.material is Material.PAVEMENT)
    return only_areas(shapely.union_all(paved))


def add_portals(builder: MeshBuilder, edges: Edges) -> None:
    """Adds parapets along the edges of the ground above tunnels."""
    above = edges.areas & Area.COVERED != 0
    places = np.concatenate((edges.ends * GRID, np.zeros((len(edges.ends), 2, 1))), axis=2)
    for which in (0, 1):
        drop = edges.heights[:, which] - edges.heights[:, 1 - which]
        rows = above[:, which] & ~above[:, 1 - which] & (drop.min(axis=1) > _LOWER)
        line = places[rows]
        line[..., 2] = edges.heights[rows, which]
        _add_parapets(builder, line if which == 0 else line[:, ::-1])


def add_lids(builder: MeshBuilder, triangles: GroundTriangles) -> None:
    """Adds surfaces just below the ground above tunnels, which only the sun sees: the ground casts no shadows."""
    covered = triangles.areas & Area.COVERED != 0
    lids = triangles.corners[covered]
    raised = triangles.areas[covered] & (Area.RAISED | Area.SLOPE) != 0
    lids[..., 2] -= _LID + np.where(raised, KERB_HEIGHT, 0.0)[:, None]  # without steps, which would let light through
    builder.triangles(lids, colour=_SHADED, kind=ObjectClass.WALL)


def tunnel_floors(town: Town, sheets: Sequence[Sheet], cover: BaseGeometry, field: HeightField) -> TunnelFloors | None:
    """Returns the floors of tunnels below covered ground, up to slightly beyond their mouths; None without tunnels."""
    if not any(sheet.level < 0 for sheet in sheets):
        return None
    flat, lanes = [], []
    for sheet in sheets:
        if sheet.level < 0:
            lanes += [_longer(town, part, _MOUTH) for part in sheet.stretches]
            flat += [part.points for part in sheet.polygons if part.material is Material.TUNNEL_FLOOR]
    pavements = _pavements(sheets)
    longer = shapely.union_all([footprint(town, lanes, _JOINT), pavements])
    closed = shapely.buffer(shapely.buffer(longer, _GAP / 2.0, join_style="mitre"), -_GAP / 2.0, join_style="mitre")
    within = shapely.buffer(cover, _OVERLAP, join_style="mitre")
    area = tidy(only_areas(shapely.intersection(shapely.union_all([closed, *polygons_of(flat)]), within)))
    road = shapely.union_all([footprint(town, lanes, _KERB), *polygons_of(flat)])
    behind = tidy(only_areas(shapely.intersection(area, shapely.difference(pavements, road))))
    return TunnelFloors(area, behind, partial(field.road, level=_TUNNELS))


def add_tunnel(
    builder: MeshBuilder, level: int, number: int, field: HeightField, floors: TunnelFloors, cover: BaseGeometry
) -> None:
    """Adds floor, walls and ceiling of the tunnels.

    Args:
        builder: receives the triangles.
        level: level of the tunnels.
        number: number of their sheet.
        field: heights.
        floors: areas of their floors.
        cover: area of the ground above.
    """
    road = only_areas(shapely.difference(floors.area, floors.pavements, grid_size=GRID))
    floor = _at_height(cut_areas([(Area.FLAT, road), (Area.RAISED, floors.pavements)], _CELL), field, level)
    floor.corners[..., 2] -= _SUNK
    stepped = GroundTriangles(floor.corners.copy(), floor.areas)
    stepped.corners[floor.areas == Area.RAISED, :, 2] += KERB_HEIGHT
    add_sheet(builder, stepped.corners, number)
    add_faces(builder, find_edges(stepped))
    ceiling = floor.corners.copy()
    ceiling[..., 2] += _headroom(field, ceiling)
    builder.triangles(ceiling[:, ::-1], colour=_SHADED, kind=ObjectClass.WALL)
    ends = find_edges(stepped).alone
    _add_quads(builder, ends - [0.0, 0.0, _UNDER], ends, _CONCRETE, ObjectClass.WALL)  # at the mouths
    sides = find_edges(floor).alone
    inside = shapely.buffer(cover, -2.0 * _OVERLAP)
    shapely.prepare(inside)
    middle = sides[..., :2].mean(axis=1)
    sides = sides[shapely.contains_xy(inside, middle[:, 0], middle[:, 1])]
    way = sides[:, 1] - sides[:, 0]
    way *= 2.0 * _OVERLAP / np.maximum(pn.hypot(way[:, 0], way[:, 1]), 1e-9)[:, None]
    sides = np.stack((sides[:, 0] - way, sides[:, 1] + way), axis=1)  # up to the walls over the mouths
    high = sides.copy()
    high[..., 2] += _headroom(field, high)
    sides[..., 2] -= _UNDER
    _add_quads(builder, sides[:, ::-1], high[:, ::-1], _TILES, ObjectClass.WALL)
    # up to the lid; in the ground, visible to the sun only, it is so far behind the wall that no light passes through
    behind = np.concatenate((_THICK * _inward(sides), np.zeros((len(sides), 1))), axis=1)[:, None]
    high[..., 2] += ROOF - _LID / 2.0
    _add_quads(builder, sides - behind, high - behind, _TILES, ObjectClass.WALL)


def _headroom(field: HeightField, points: Array) -> Array:
    """Returns the height of a tunnel above its floor at positions (..., 3) [m]."""
    above = field.ground(points[..., :2].reshape(-1, 2), Zone.COVER).reshape(points.shape[:-1]) + KERB_HEIGHT
    return np.asarray(np.clip(above - ROOF - points[..., 2], 0.0, PORTAL_HEIGHT))


def add_bridge(
    builder: MeshBuilder, sheet: Sheet, number: int, field: HeightField, town: Town, ground: GroundArrays
) -> None:
    """Adds the decks of one level of bridges, with sides, undersides, parapets and pillars."""
    deck = _at_height(cut_areas([(Area.FLAT, deck_area(town, sheet, _DECK_OVERLAP))], _CELL), field, sheet.level)
    add_sheet(builder, deck.corners, number)
    below = np.array([0.0, 0.0, _DECK_THICKNESS])
    builder.triangles(deck.corners[:, ::-1] - below, colour=_SHADED, kind=ObjectClass.BRIDGE)
    sides = find_edges(deck).alone
    _add_quads(builder, sides - below, sides, _CONCRETE, ObjectClass.BRIDGE)
    outside = sides.mean(axis=1)
    outside[:, :2] -= 0.6 * _inward(sides)
    lower = field.ground(outside[:, :2]) < outside[:, 2] - _LOWER
    _add_parapets(builder, sides[lower])
    _add_pillars(builder, sheet, field, town, ground)


def deck_area(town: Town, sheet: Sheet, further: float = 0.0) -> BaseGeometry:
    """Returns the area of the bridges of one level with their pavements, longer at both ends [m]."""
    lanes = footprint(town, [_longer(town, part, further) for part in sheet.stretches], _DECK_MARGIN)
    edges = [part.points for part in sheet.polygons if part.material is Material.BRIDGE_EDGE]
    return tidy(only_areas(shapely.union_all([lanes, *polygons_of(edges)])))


def _longer(town: Town, part: LevelStretch, more: float) -> LevelStretch:
    length = town.lanes[part.lane].length
    return replace(part, start=max(0.0, part.start - more), end=min(length, part.end + more))


def _add_pillars(builder: MeshBuilder, sheet: Sheet, field: HeightField, town: Town, ground: GroundArrays) -> None:
    """Adds pillars below the centres of lanes, except on roads."""
    stood: list[Array] = []
    reach = _PILLAR_WIDTH * np.array([[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    for part in sheet.stretches:
        lane = town.lanes[part.lane]
        for station in np.arange(part.start + _PILLARS / 2.0, part.end, _PILLARS).tolist():
            at = lane.position(station)
            foot, head = float(field.ground(at[None])[0]), lane.height_at(station) - _DECK_THICKNESS
            if head - foot < _TALLEST_WITHOUT or (stood and pn.hypot(*(np.array(stood) - at).T).min() < _PILLARS / 4.0):
                continue
            kinds = [LOOKS[Material(material_at(ground, GROUND_SHEET, x, y))].kind for x, y in (at + reach).tolist()]
            if ObjectClass.ROAD in kinds or ObjectClass.ROAD_LINE in kinds:
                continue
            stood.append(at)
            builder.box(
                at.tolist(), lane.heading_at(station), _PILLAR_WIDTH, _PILLAR_WIDTH, foot - 1.0, head,
                colour=_CONCRETE, kind=ObjectClass.BRIDGE, closed=(False, False),
            )  # fmt: skip


# --- Parts ------------------------------------------------------------------------------------------------------------


def _at_height(cut: tuple[NDArray[np.int64], NDArray[np.int64]], field: HeightField, level: int) -> GroundTriangles:
    """Returns triangles of a bridge or tunnel (n, 3, 2) [grid steps] with their areas (n,) and heights."""
    points, areas = cut
    places, index = np.unique(points.reshape(-1, 2), axis=0, return_inverse=True)
    heights = np.round(field.road(places * GRID, level) / GRID) * GRID
    corners = np.concatenate((points * GRID, heights[index.reshape(-1)].reshape(-1, 3)[..., None]), axis=2)
    return GroundTriangles(corners, areas)


def _inward(lines: Array) -> Array:
    """Returns unit vectors (n, 2) to the right of lines (n, 2, 3), on the map."""
    way = lines[:, 1, :2] - lines[:, 0, :2]
    across = np.stack((-way[:, 1], way[:, 0]), axis=-1)
    return np.asarray(across / np.maximum(pn.hypot(*across.T), 1e-9)[:, None])


def _add_quads(builder: MeshBuilder, low: Array, high: Array, colour: tuple[int, int, int], kind: ObjectClass) -> None:
    """Adds faces between lines (n, 2, 3) [m], seen from the left of their direction, on the map."""
    builder.triangles(np.stack((low[:, 0], low[:, 1], high[:, 1]), axis=1), colour=colour, kind=kind)
    builder.triangles(np.stack((low[:, 0], high[:, 1], high[:, 0]), axis=1), colour=colour, kind=kind)


def _add_parapets(builder: MeshBuilder, lines: Array) -> None:
    """Adds low walls on the right of lines (n, 2, 3) [m], on the map; they meet in mitres at common ends."""
    if not len(lines):
        return
    up = np.array([0.0, 0.0, _PARAPET])
    aside, alone = _mitres(lines)
    inner = lines.copy()
    inner[..., :2] += _PARAPET_WIDTH * aside
    _add_quads(builder, lines, lines + up, _CONCRETE, ObjectClass.BRIDGE)
    _add_quads(builder, inner[:, ::-1], inner[:, ::-1] + up, _CONCRETE, ObjectClass.BRIDGE)
    _add_quads(builder, lines + up, inner + up, _CONCRETE, ObjectClass.BRIDGE)
    for rows, first, second in ((alone[:, 0], lines[:, :1], inner[:, :1]), (alone[:, 1], inner[:, 1:], lines[:, 1:])):
        end = np.concatenate((second, first), axis=1)[rows]
        _add_quads(builder, end, end + up, _CONCRETE, ObjectClass.BRIDGE)


def _mitres(lines: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Returns the inner sides of walls at both ends of lines (n, 2, 2), and which ends have no neighbour (n, 2).

    A wall of width 1 lies on the right of its line; two that meet share the corner on the bisector of their sides.
    """
    inward = _inward(lines)
    aside = np.stack((inward, inward), axis=1)
    alone = np.ones((len(lines), 2), dtype=bool)
    places = [[tuple(place) for place in row] for row in np.rint(lines[..., :2] / GRID).astype(np.int64).tolist()]
    starts: dict[tuple[int, ...], list[int]] = {}
    for k, (start, _) in enumerate(places):
        starts.setdefault(start, []).append(k)
    ends = Counter(end for _, end in places)
    for k, (_, end) in enumerate(places):
        after = starts.get(end, [])
        if len(after) != 1 or ends[end] != 1 or abs(lines[k, 1, 2] - lines[after[0], 0, 2]) > _STEP:
            continue
        both = inward[k] + inward[after[0]]
        longer = float((both * both).sum()) / 2.0  # 1 + the cosine of the corner
        if longer > _SHARPEST:
            aside[k, 1] = aside[after[0], 0] = both / longer
            alone[k, 1] = alone[after[0], 0] = False
    return aside, alone
