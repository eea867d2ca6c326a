"""Surface of the ground as triangles: heights at the corners, and vertical faces where neighbours differ in height."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from dorothie_gym.maps.model import Array
from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.pictures.camera.ground.heights import HeightField, Zone
from dorothie_gym.pictures.camera.ground.materials import KERB_HEIGHT
from dorothie_gym.pictures.camera.ground.partition import Area
from dorothie_gym.pictures.camera.ground.regions import GRID
from dorothie_gym.pictures.camera.mesh import MeshBuilder, Surface
from dorothie_gym.support import portable_arrays as pn

PORTAL_HEIGHT = 4.35
"""Height of tunnels [m]."""

ROOF = 0.4
"""Thickness of the ground above a tunnel, at least [m]."""

BELOW_DECK = 0.3
"""Distance of the ground below the road on a bridge, at least [m]."""

_SAME = 1e-4  # [m]
_FOUNDATION = 6.0  # [m] of the walls over mouths of tunnels below the ground before them
_THICKNESS = 0.02  # [m] of these walls
_LINTEL = 0.06  # [m] of these walls below the ceiling
_THRESHOLD = 1.0  # [m] of the end of the ground before a mouth, as seen from inside
_KERB_FACE = 0.4  # [m]; higher faces are walls
_KERB_COLOUR = (160, 158, 152)
_WALL_COLOUR = (150, 148, 142)
_PLAIN = (255, 255, 255)


class GroundTriangles(NamedTuple):
    """Triangles of a sheet: corners (n, 3, 3) [m], and their areas (n,), `Area`."""

    corners: Array
    areas: NDArray[np.int64]


def lifted(
    points: NDArray[np.int64],
    areas: NDArray[np.int64],
    field: HeightField,
    decks: Sequence[tuple[int, BaseGeometry]],
    median: BaseGeometry,
) -> GroundTriangles:
    """Returns triangles of the ground with their heights: kerbs above carriageways, all below the decks of bridges.

    Args:
        points: (n, 3, 2) [grid steps].
        areas: (n,) `Area`.
        field: heights.
        decks: levels and areas of bridges.
        median: medians, as high as the roads beside them.
    """
    covered = areas & Area.COVERED != 0
    raised = areas & (Area.RAISED | Area.SLOPE) != 0
    corners = np.empty((len(points), 3, 3))
    corners[..., :2] = points * GRID
    for zone, rows in ((Zone.OPEN, ~covered), (Zone.COVER, covered)):
        # one height for each place, so that triangles meet
        places, index = np.unique(points[rows].reshape(-1, 2), axis=0, return_inverse=True)
        index = index.reshape(-1)
        built = np.zeros(len(places), dtype=bool)
        road = np.repeat(areas[rows] & ~int(Area.COVERED) == Area.FLAT, 3)
        built[index[road]] = True
        if not field.flat:
            built |= shapely.dwithin(median, shapely.points(places * GRID), _SAME)
        heights = np.round(field.ground(places * GRID, zone, built) / GRID) * GRID
        corners[rows, :, 2] = heights[index].reshape(-1, 3)
    corners[..., 2] += np.where(raised, KERB_HEIGHT, 0.0)[:, None]
    under = corners[areas & Area.BELOW != 0].reshape(-1, 3)
    for level, deck in decks:
        if len(under):
            near = shapely.dwithin(deck, shapely.points(under[:, :2]), 0.01)
            under[near, 2] = np.minimum(under[near, 2], field.road(under[near, :2], level) - BELOW_DECK)
    corners[areas & Area.BELOW != 0] = under.reshape(-1, 3, 3)
    return GroundTriangles(corners, areas)


def add_sheet(builder: MeshBuilder, corners: Array, sheet: int) -> None:
    """Adds triangles whose colours and classes come from a sheet."""
    builder.triangles(corners, colour=_PLAIN, kind=ObjectClass.GROUND, texture=sheet, surface=Surface.GROUND)


class Edges(NamedTuple):
    """Edges between two triangles.

    Attributes:
        ends: (n, 2, 2) positions [grid steps]; the first triangle is to the right of the line from the first to the
            second, on the map.
        heights: (n, 2, 2) of the first and second triangle at both ends [m].
        areas: (n, 2) of both triangles.
        alone: (m, 2, 3) ends of the edges of one triangle only [m]; it lies on their right, on the map.
    """

    ends: NDArray[np.int64]
    heights: Array
    areas: NDArray[np.int64]
    alone: Array


def find_edges(triangles: GroundTriangles) -> Edges:
    """Returns the edges of triangles by their ends on the map."""
    count = len(triangles.corners)
    points = np.rint(triangles.corners[..., :2] / GRID).astype(np.int64)
    ends = np.stack((points, np.roll(points, -1, axis=1)), axis=2).reshape(-1, 2, 2)
    z = triangles.corners[..., 2]
    heights = np.stack((z, np.roll(z, -1, axis=1)), axis=2).reshape(-1, 2)
    owner = np.repeat(np.arange(count), 3)
    low = points.min(axis=(0, 1))
    number = (ends[..., 0] - low[0]) * (int(points[..., 1].max() - low[1]) + 1) + ends[..., 1] - low[1]
    forward = number[:, 0] < number[:, 1]
    key = np.sort(number, axis=1)
    order = np.lexsort((forward, key[:, 1], key[:, 0]))
    same = (key[order[1:]] == key[order[:-1]]).all(axis=1)
    second = np.flatnonzero(same) + 1
    a, b = order[second], order[second - 1]  # a forward, b backward
    paired = np.zeros(len(order), dtype=bool)
    paired[second] = paired[second - 1] = True
    return Edges(
        ends[a],
        np.stack((heights[a], heights[b][:, ::-1]), axis=1),
        np.stack((triangles.areas[owner[a]], triangles.areas[owner[b]]), axis=1),
        np.concatenate((ends * GRID, heights[..., None]), axis=2)[np.sort(order[~paired])],
    )


class TunnelFloors(NamedTuple):
    """Floors of tunnels.

    Attributes:
        area: union of all areas.
        pavements: area of those that are a kerb higher.
        heights: heights of the roads (n,) at positions (n, 2) [m].
    """

    area: BaseGeometry
    pavements: BaseGeometry
    heights: Callable[[Array], Array]


def add_faces(builder: MeshBuilder, edges: Edges, tunnels: TunnelFloors | None = None) -> None:
    """Adds kerbs and walls: the vertical faces between triangles of different heights.

    Args:
        builder: receives the triangles.
        edges: edges of the ground.
        tunnels: tunnels whose mouths are left open, if there are any.
    """
    if tunnels is not None:
        shapely.prepare((tunnels.area, tunnels.pavements))
    apart = np.abs(edges.heights[:, 0] - edges.heights[:, 1]).max(axis=1) > _SAME
    places = np.concatenate((edges.ends * GRID, np.zeros((len(edges.ends), 2, 1))), axis=2)
    for rows, above in ((apart & _higher(edges, 0), 0), (apart & _higher(edges, 1), 1)):
        top, foot = places[rows].copy(), places[rows].copy()
        top[..., 2], foot[..., 2] = edges.heights[rows, above], edges.heights[rows, 1 - above]
        kinds = edges.areas[rows]
        # seen from the lower side: from the left of the line if the first triangle is the higher one
        start, end = (1, 0) if above == 0 else (0, 1)
        opening = (kinds[:, 1 - above] & Area.COVERED == 0) & (kinds[:, above] & Area.COVERED != 0)
        if tunnels is not None and opening.any():
            level, middle = kinds[:, 1 - above] == Area.FLAT, top[..., :2].mean(axis=1).T
            opening &= np.where(
                level, shapely.contains_xy(tunnels.area, *middle), shapely.contains_xy(tunnels.pavements, *middle)
            )
            _add_thresholds(builder, foot[opening][:, [end, start]])
            ceiling = tunnels.heights(foot[opening, :, :2].reshape(-1, 2)).reshape(-1, 2) + PORTAL_HEIGHT
            foot[opening, :, 2] = np.maximum(
                foot[opening, :, 2], np.minimum(ceiling, top[opening, :, 2] - ROOF) - _LINTEL
            )
        corners = np.stack((foot[:, start], top[:, start], top[:, end], foot[:, end]), axis=1)
        high = (top[..., 2] - foot[..., 2]).max(axis=1) > _KERB_FACE
        mouth = high & (kinds[:, above] & Area.COVERED != 0) & (kinds[:, 1 - above] & Area.COVERED == 0)
        # seen from inside a tunnel, whose floor lies below the slopes beside its mouth
        foot[~opening, :, 2] -= _FOUNDATION
        back = np.stack((foot[:, end], top[:, end], top[:, start], foot[:, start]), axis=1)[mouth]
        way = back[:, 0] - back[:, 3]
        inwards = np.column_stack((way[:, 1], -way[:, 0])) / np.maximum(pn.hypot(*way[:, :2].T), 1e-9)[:, None]
        back[..., :2] += _THICKNESS * inwards[:, None]
        builder.triangles(back[:, [0, 1, 2]], colour=_WALL_COLOUR, kind=ObjectClass.WALL)
        builder.triangles(back[:, [0, 2, 3]], colour=_WALL_COLOUR, kind=ObjectClass.WALL)
        for chosen, colour, kind in (
            (~high, _KERB_COLOUR, ObjectClass.SIDE_WALK),
            (high, _WALL_COLOUR, ObjectClass.WALL),
        ):
            quads = corners[chosen]
            builder.triangles(quads[:, [0, 1, 2]], colour=colour, kind=kind)
            builder.triangles(quads[:, [0, 2, 3]], colour=colour, kind=kind)


def _add_thresholds(builder: MeshBuilder, lines: Array) -> None:
    """Adds the ends of the ground before mouths of tunnels (n, 2, 3) [m], whose floors may be lower."""
    under = lines - [0.0, 0.0, _THRESHOLD]
    builder.triangles(np.stack((under[:, 0], lines[:, 0], lines[:, 1]), 1), colour=_KERB_COLOUR, kind=ObjectClass.WALL)
    builder.triangles(np.stack((under[:, 0], lines[:, 1], under[:, 1]), 1), colour=_KERB_COLOUR, kind=ObjectClass.WALL)


def _higher(edges: Edges, which: int) -> NDArray[np.bool_]:
    """Returns which edges have their first (0) or second (1) triangle above the other one."""
    difference = edges.heights[:, 0].sum(axis=1) - edges.heights[:, 1].sum(axis=1)
    return np.asarray(difference > 0.0 if which == 0 else difference <= 0.0)
