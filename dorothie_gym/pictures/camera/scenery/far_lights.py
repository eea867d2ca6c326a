"""Places of further traffic lights, so that each lane sees its own light from its stop line.

A light beside the stop line is out of the picture of the first car. For traffic that goes straight on it is repeated
at the exit; lanes that only turn look past that place. For these, a second head stands on the far side of the junction,
at the first kerb or median ahead that has room and that nothing hides.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from dorothie_gym.pictures import palette
from dorothie_gym.pictures.camera.scenery.clearance import Clearance, free_of, rectangles
from dorothie_gym.pictures.maps.shapes import ribbon
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array, Lane
    from dorothie_gym.pictures.maps.map_layers import MapLayers

EYE_BACK = 2.0
"""Distance from a stop line back to the eye of the first driver [m]."""

EYE_HEIGHT = 1.45
"""Height of the eye above the road [m]."""

_NEAREST, _FARTHEST = 7.0, 48.0  # [m] ahead of the eye: nearer, a light is above the picture
_WIDEST = 0.72  # [m] to the side per metre ahead, within half a field of view of 90 degrees
_HIGHEST, _LOWEST = 0.44, -0.40  # rise per metre ahead, relative to the road
_STEP = 0.75  # [m] between places that are tried
_FROM_LANES, _KERB = 0.5, 2.6  # [m] from the next lane to a light: at least, and at most
_APART = 1.5  # [m] between lights
_WAIST = 0.62  # [m] from a line of sight to other lights, which are 0.74 m wide
_ASIDE = 0.6  # cost of a metre to the side, in metres ahead
_TREES = (palette.TREE, palette.COUNTRY_TREE, palette.MEDIAN_TREE)
_READ = 0.5  # least cosine between the direction of a light and that of the driver who sees it
_CHUNK = 400  # places that are examined at once
_TRIED = 60  # places whose ground is looked at


class Eye(NamedTuple):
    """Eye of a driver at a stop line: place (x, y, z) [m], heading [rad], and rise of the road per metre ahead."""

    x: float
    y: float
    z: float
    heading: float
    rise: float

    def ahead_and_aside(self, points: Array) -> tuple[Array, Array]:
        """Returns the distances ahead and to the right (n,) [m] of points (n, 2)."""
        c, s = pm.cos(self.heading), pm.sin(self.heading)
        dx, dy = points[:, 0] - self.x, points[:, 1] - self.y
        return dx * c + dy * s, dy * c - dx * s

    def frames(self, ahead: float, aside: float, height: float) -> bool:
        """Returns whether a place is well within the picture.

        Args:
            ahead: distance ahead [m].
            aside: distance to the right [m].
            height: height above the eye [m].
        """
        if not _NEAREST <= ahead <= _FARTHEST or abs(aside) > _WIDEST * ahead:
            return False
        return _LOWEST < height / ahead - self.rise < _HIGHEST


def eye_at(lane: Lane, stop: float) -> Eye:
    """Returns the eye of the first driver at a stop line at a station of a lane [m]."""
    station = max(0.0, stop - EYE_BACK)
    x, y = lane.position(station).tolist()
    height, after = lane.height_at(station), min(lane.length, station + 2.0)
    before = max(0.0, after - 4.0)
    rise = (lane.height_at(after) - lane.height_at(before)) / max(after - before, 0.1)
    return Eye(x, y, height + EYE_HEIGHT, lane.heading_at(station), rise)


class FarSides:
    """Room for lights on the far sides of junctions.

    Args:
        layers: layers of the town's map.
        clearance: room for scenery.
    """

    def __init__(self, layers: MapLayers, clearance: Clearance) -> None:
        town = layers.town
        self._clearance = clearance
        self._near = shapely.STRtree([shapely.Polygon(ribbon(lane, _KERB)).buffer(0.0) for lane in town.lanes])
        crowns = [shapely.Polygon(shape.points) for shape in layers.shapes if shape.colour in _TREES]
        lots = [
            rectangles(np.array([lot.middle]), np.array([lot.heading]), np.array([lot.depth]), np.array([lot.length]))[
                0
            ]
            for lot in clearance.lots
        ]
        self._hiding = shapely.STRtree([*crowns, *lots])
        self._crossings = shapely.STRtree([shapely.Polygon(crossing.outline) for crossing in town.crosswalks])
        self._parapets = shapely.STRtree(
            [shapely.Polygon(shape.points) for shape in layers.shapes if shape.colour == palette.BRIDGE_PARAPET]
        )

    def places(
        self, eye: Eye, end: tuple[float, float], side: int, others: Sequence[tuple[float, float]]
    ) -> Iterator[tuple[float, float]]:
        """Yields places (x, y) [m] for a light that the driver sees, the best first.

        Args:
            eye: eye of the driver.
            end: end of the lane (x, y) [m].
            side: 1 if traffic keeps to the right, else -1.
            others: places of other lights and signs.
        """
        (far,), _ = eye.ahead_and_aside(np.array([end]))
        ahead, aside = (
            row.ravel()
            for row in np.meshgrid(
                np.arange(max(_NEAREST, far + 3.0), _FARTHEST, _STEP),
                np.arange(-_WIDEST * _FARTHEST, _WIDEST * _FARTHEST, _STEP),
                indexing="ij",
            )
        )
        framed = np.abs(aside) <= _WIDEST * ahead
        ahead, aside = ahead[framed], aside[framed]
        order = np.argsort(ahead + _ASIDE * np.abs(aside - 2.0 * side), kind="stable")
        c, s = pm.cos(eye.heading), pm.sin(eye.heading)
        points = np.column_stack((eye.x + ahead * c - aside * s, eye.y + ahead * s + aside * c))[order]
        left, taken = _TRIED, np.array(others).reshape(-1, 2)
        for first in range(0, len(points), _CHUNK):
            some = points[first : first + _CHUNK]
            some = some[self._has_room(some, taken)]
            some = some[self.sees(eye, some, others)][:left]
            yield from ((x, y) for x, y in some.tolist())
            left -= len(some)
            if left == 0:
                return

    def _has_room(self, points: Array, others: Array) -> NDArray[np.bool_]:
        """Returns which places (n, 2) [m] are at a kerb, off roads, crosswalks and parapets, and not at a post."""
        spots = np.asarray(shapely.buffer(shapely.points(points), _FROM_LANES - 0.3), dtype=np.object_)
        free = free_of(spots, self._clearance.lanes) & ~free_of(spots, self._near)
        free &= free_of(spots, self._crossings) & free_of(spots, self._parapets)
        for other in others:
            free &= pn.hypot(*(points - other).T) > _APART
        free[free] = ~self._clearance.on_asphalt(points[free], _FROM_LANES)
        return free

    def keep_view(self, eye: Eye, at: tuple[float, float]) -> None:
        """Keeps buildings out of the way between a driver and a light."""
        self._clearance.keep_views([shapely.LineString([(eye.x, eye.y), at]).buffer(0.4)])

    def sees(self, eye: Eye, points: Array, others: Sequence[tuple[float, float]]) -> NDArray[np.bool_]:
        """Returns from which of the places (n, 2) [m] neither trees, landmarks nor other lights hide a light."""
        start = np.array([eye.x, eye.y])
        lines = shapely.linestrings(np.stack((np.broadcast_to(start, points.shape), points), axis=1))
        free = free_of(np.asarray(lines, dtype=np.object_), self._hiding)
        way = points - start
        length = np.maximum(pn.hypot(*way.T), 1e-9)
        for other in others:
            dx, dy = other[0] - eye.x, other[1] - eye.y
            along = (way[:, 0] * dx + way[:, 1] * dy) / length
            across = np.abs(way[:, 0] * dy - way[:, 1] * dx) / length
            free &= (across > _WAIST) | (along < 0.5) | (along > length - 0.8)
        return free


def is_read_from(eye: Eye, at: tuple[float, float], look: float) -> bool:
    """Returns whether a light is turned towards a driver: `look` is the direction in which it is read [rad]."""
    dx, dy = at[0] - eye.x, at[1] - eye.y
    return dx * pm.cos(look) + dy * pm.sin(look) > _READ * pm.hypot(dx, dy)
