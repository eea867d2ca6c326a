"""Areas of a sheet: carriageways, raised ground and slopes, from the polygons of the map in the order of painting."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from dorothie_gym.pictures.camera.ground.materials import LOOKS, Material, Relief
from dorothie_gym.pictures.maps.shapes import ribbon

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.maps.town import Town
    from dorothie_gym.pictures.camera.ground.cells import Painted
    from dorothie_gym.pictures.maps.levels import LevelStretch

GRID = 1.0 / 1024.0
"""Distance between the positions that corners of triangles may have [m]; exact in float32 up to 16 km."""

_TOLERANCE = 0.02  # [m] by which the edges of areas are simplified
_SMALLEST = 0.02  # [m2] area


@dataclass(frozen=True, eq=False)
class Regions:
    """Areas of the ground.

    Attributes:
        flat: carriageways.
        slope: sides of cuttings, where they are not covered.
        median: medians between carriageways, as high as these.
    """

    flat: BaseGeometry
    slope: BaseGeometry
    median: BaseGeometry


def polygons_of(points: Iterable[Array]) -> list[BaseGeometry]:
    """Returns valid polygons of outlines (n, 2) [m], by the even-odd rule."""
    return list(_parts([shapely.make_valid(shapely.Polygon(line)) for line in points]))


def _parts(areas: Sequence[BaseGeometry]) -> NDArray[np.object_]:
    """Returns the polygons in geometries, also those in collections."""
    parts = shapely.get_parts(shapely.get_parts(areas))
    return np.asarray(parts[shapely.get_type_id(parts) == shapely.GeometryType.POLYGON])


def find_regions(polygons: Sequence[Painted]) -> Regions:
    """Returns the areas of a sheet: later layers cover earlier ones."""
    flat: BaseGeometry = shapely.Polygon()
    slope: BaseGeometry = shapely.Polygon()
    layers = [(LOOKS[polygon.material].relief, polygon.points) for polygon in polygons]
    layers = [(relief, points) for relief, points in layers if relief is not Relief.PAINT]
    for relief, run in itertools.groupby(layers, key=lambda layer: layer[0]):
        area = only_areas(shapely.union_all(polygons_of(points for _, points in run)))
        flat = _with(flat, area, relief is Relief.FLAT)
        slope = _with(slope, area, relief is Relief.SLOPE)
    medians = polygons_of(part.points for part in polygons if part.material is Material.MEDIAN_KERB)
    return Regions(tidy(flat), tidy(slope), only_areas(shapely.union_all(medians)))


def _with(area: BaseGeometry, other: BaseGeometry, more: bool) -> BaseGeometry:
    """Returns the union or difference of two areas."""
    operation = shapely.union if more else shapely.difference
    return only_areas(operation(area, other))


def only_areas(geometry: BaseGeometry) -> BaseGeometry:
    """Returns the polygons of a result, without lines and points."""
    return shapely.MultiPolygon(list(_parts([geometry])))


def tidy(area: BaseGeometry) -> BaseGeometry:
    """Returns the larger polygons of an area, slightly simplified, with corners on the grid."""
    snapped = shapely.set_precision(shapely.simplify(area, _TOLERANCE), GRID)
    parts = _parts([snapped])
    return shapely.MultiPolygon(list(parts[shapely.area(parts) > _SMALLEST]))


def footprint(town: Town, stretches: Iterable[LevelStretch], margin: float) -> BaseGeometry:
    """Returns the area of stretches of lanes, wider by a margin on both sides [m]."""
    outlines = [ribbon(town.lanes[part.lane], margin, part.start, part.end) for part in stretches]
    return tidy(shapely.union_all(polygons_of(outlines)))


def squares(low: Array, size: float, count: int) -> Array:
    """Returns a grid of square polygons (count * count,) from a corner (2,) [m]."""
    at = low + size * np.stack(np.meshgrid(*(np.arange(count),) * 2, indexing="ij"), axis=-1).reshape(-1, 2)
    return np.asarray(shapely.box(at[:, 0], at[:, 1], at[:, 0] + size, at[:, 1] + size))
