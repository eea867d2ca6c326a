"""Building of the ground of a town, from the polygons of its map to a mesh with heights."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from dorothie_gym.pictures.camera.ground.arrays import ground_arrays
from dorothie_gym.pictures.camera.ground.bridges_and_tunnels import (
    add_bridge,
    add_lids,
    add_portals,
    add_tunnel,
    covered_ground,
    deck_area,
    tunnel_floors,
)
from dorothie_gym.pictures.camera.ground.ground import Ground
from dorothie_gym.pictures.camera.ground.heights import HeightField
from dorothie_gym.pictures.camera.ground.lookup import GROUND_SHEET
from dorothie_gym.pictures.camera.ground.partition import Area, Cut, cut_ground
from dorothie_gym.pictures.camera.ground.regions import GRID, Regions, find_regions, only_areas, tidy
from dorothie_gym.pictures.camera.ground.sheets import town_sheets
from dorothie_gym.pictures.camera.ground.surface import add_faces, add_sheet, find_edges, lifted
from dorothie_gym.pictures.camera.mesh import MeshBuilder

if TYPE_CHECKING:
    from dorothie_gym.pictures.maps.map_layers import MapLayers

_SLIVER = 0.05  # [m] width


def build_ground(layers: MapLayers) -> Ground:
    """Returns the ground of a town, out to the horizon."""
    town, sheets = layers.town, town_sheets(layers)
    arrays = ground_arrays(sheets)
    stretches = [part for sheet in sheets for part in sheet.stretches]
    field = HeightField(town, stretches)
    ground = sheets[GROUND_SHEET]
    cover = covered_ground(town, sheets)
    decks = [(sheet.level, deck_area(town, sheet)) for sheet in sheets if sheet.level > 0]
    regions = find_regions(ground.polygons)
    areas = _faces(regions, cover, only_areas(shapely.union_all([deck for _, deck in decks])), field)
    points, kinds = cut_ground(areas, ground.low, ground.high, None if field.flat else field.ground)
    triangles = lifted(points, kinds, field, decks, regions.median)
    edges = find_edges(triangles)
    builder = MeshBuilder()
    add_sheet(builder, triangles.corners, GROUND_SHEET)
    tunnels = tunnel_floors(town, sheets, cover, field)
    add_faces(builder, edges, tunnels)
    add_portals(builder, edges)
    add_lids(builder, triangles)
    for number, sheet in enumerate(sheets):
        if sheet.level > 0:
            add_bridge(builder, sheet, number, field, town, arrays)
        elif tunnels is not None and sheet.level < 0:
            add_tunnel(builder, sheet.level, number, field, tunnels, cover)
    return Ground(builder.build(), arrays)


def _faces(regions: Regions, cover: BaseGeometry, decks: BaseGeometry, field: HeightField) -> list[Cut]:
    """Returns the areas of the ground that are not simply raised; neighbours share the corners on their edges."""
    shapes = {Area.FLAT: regions.flat, Area.SLOPE: regions.slope, Area.COVERED: cover, Area.BELOW: decks}
    shapes |= {
        flag: tidy(area) for flag, area in zip((Area.BENCH, Area.BANK), field.benches(), strict=True) if area.area > 0.0
    }
    lines = shapely.union_all([shapely.boundary(shape) for shape in shapes.values()], grid_size=GRID)
    faces = shapely.get_parts(shapely.polygonize(shapely.get_parts([lines])))
    inside = shapely.point_on_surface(faces)
    for shape in shapes.values():
        shapely.prepare(shape)
    flags = np.where(shapely.contains(regions.slope, inside), int(Area.SLOPE), int(Area.RAISED))
    flags[shapely.contains(regions.flat, inside)] = int(Area.FLAT)
    for flag in shapes.keys() - {Area.FLAT, Area.SLOPE}:
        flags[shapely.contains(shapes[flag], inside)] |= int(flag)
    flags[flags & (Area.RAISED | Area.SLOPE) == 0] &= ~int(Area.BENCH | Area.BANK)
    _join_slivers(faces, flags)
    return [
        (flag, only_areas(shapely.union_all(faces[flags == flag])))
        for flag in np.unique(flags).tolist()
        if flag != Area.RAISED
    ]


def _join_slivers(faces: NDArray[np.object_], flags: NDArray[np.int64]) -> None:
    """Gives faces of a few centimetres' width the area of the neighbour with the longest common edge.

    Edges that should coincide differ by the tolerance with which areas are simplified.
    """
    lines = shapely.boundary(faces)
    lengths = shapely.length(lines)
    thin = shapely.area(faces) < _SLIVER * lengths / 2.0
    tree = shapely.STRtree(faces)
    for k in np.flatnonzero(thin).tolist():
        around = np.sort(tree.query(faces[k], predicate="intersects"))
        shared = shapely.length(shapely.intersection(lines[k], lines[around]))
        shared[around == k] = 0.0
        outside = lengths[k] - shared.sum()  # beyond all faces lies raised ground
        shared[thin[around]] = 0.0
        best = int(np.argmax(shared))
        flags[k] = int(Area.RAISED) if outside > shared[best] else flags[around[best]]
