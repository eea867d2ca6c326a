"""Room for scenery: all that the map draws is kept free, and a lot is reserved for the landmark of each site."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import shapely
from numpy.typing import NDArray

from dorothie_gym.pictures import palette
from dorothie_gym.pictures.camera.scenery.lots import Lot
from dorothie_gym.pictures.maps.shapes import ribbon
from dorothie_gym.sim.network.network import network_of
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support import portable_math as pm
from dorothie_gym.tasks.landmark_designs import site_key

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array, Site
    from dorothie_gym.maps.town import Town
    from dorothie_gym.pictures.maps.map_layers import MapLayers

BESIDE = 1.8
"""Ground beside a lane that stays free [m]."""

FOOTWAY = 1.0
"""Ground on both sides of the centre of a footway that stays free [m]."""

_TREES = (palette.TREE, palette.COUNTRY_TREE)
_OPEN = (palette.COUNTRY, palette.BLOCK, palette.PARK, palette.BRIDGE_SHADOW, *_TREES)
"""Colours of ground on which scenery may stand."""

_ASPHALT = (palette.ROAD, palette.BAY, palette.TUNNEL)
_NOT_GROUND = (palette.BRIDGE_SHADOW, *_TREES, palette.MEDIAN_TREE)
_PAINT = (
    palette.LANE_LINE,
    palette.EDGE_LINE,
    palette.CENTRE_LINE,
    palette.HATCHING,
    palette.STOP_LINE,
    palette.ARROW,
    palette.ONE_WAY,
)
_SEEN_FROM = (42.0, 26.0)  # [m] before the stop at a site
_SIGN = (2.4, 3.4)  # [m] extent of signs in front of and behind the front of a lot
BESIDE_LOT = 1.2
"""Room at both sides of a lot, for a sign [m]."""

_MIDDLE = 4.0  # [m] to each side of the middle of a lot: its door and the place where people wait

_UNIT = np.array([[0.5, -0.5], [0.5, 0.5], [-0.5, 0.5], [-0.5, -0.5]])
_LOTS = ((20.0, 15.0), (16.0, 12.0), (13.0, 10.0), (10.0, 8.0), (8.0, 7.0), (6.0, 5.0), (4.0, 4.0))
_BEHIND = (0.4, 1.2, 2.4, 4.0, 6.0, 9.0)  # [m] from the place of a landmark to its front, at first as close as can be


def rectangles(centres: Array, headings: Array, lengths: Array, widths: Array) -> NDArray[np.object_]:
    """Returns upright rectangles (n,) around centres (n, 2) [m], their lengths along headings (n,)."""
    local = _UNIT * np.stack((lengths, widths), axis=-1)[:, None]  # (n, 4, 2)
    cos, sin = pn.cos(headings)[:, None], pn.sin(headings)[:, None]
    x, y = local[..., 0] * cos - local[..., 1] * sin, local[..., 0] * sin + local[..., 1] * cos
    return np.asarray(shapely.polygons(np.stack((x, y), axis=-1) + centres[:, None]), dtype=np.object_)


class Clearance:
    """Polygons of a town on which nothing is built.

    Args:
        layers: layers of the town's map.
    """

    def __init__(self, layers: MapLayers) -> None:
        self._layers = layers
        town = layers.town
        drawn = [shape for shape in layers.shapes if shape.colour not in _PAINT]
        ways = [shapely.Polygon(shape.points) for shape in drawn if shape.colour not in _OPEN]
        beside = [shapely.Polygon(ribbon(lane, BESIDE)).buffer(0.0) for lane in town.lanes]
        pavements = [shapely.LineString(walk.points[:, :2]).buffer(walk.width / 2.0 + 0.2) for walk in town.sidewalks]
        footways = _footways(town)
        self._walked = shapely.STRtree([*pavements, *footways])
        self.ways = shapely.STRtree([*ways, *beside, *pavements, *footways])
        """Roads, pavements, footways, medians, lay-bys."""
        self.lanes = shapely.STRtree([shapely.Polygon(ribbon(lane, 0.3)).buffer(0.0) for lane in town.lanes])
        self.trees = shapely.STRtree([shapely.Polygon(s.points) for s in drawn if s.colour in _TREES])
        self.parks = shapely.STRtree([shapely.Polygon(s.points).buffer(0.0) for s in drawn if s.colour == palette.PARK])
        self.blocks = shapely.STRtree(
            [shapely.Polygon(s.points).buffer(0.0) for s in drawn if s.colour == palette.BLOCK]
        )
        self._views: list[shapely.Polygon] = []
        ground = [shape for shape in drawn if shape.colour not in _NOT_GROUND]
        self._ground = shapely.STRtree([shapely.Polygon(shape.points) for shape in ground])
        self._paved = np.array([shape.colour in _ASPHALT for shape in ground], dtype=bool)

    def on_asphalt(self, places: Array, radius: float = 0.0) -> NDArray[np.bool_]:
        """Returns which places (n, 2) [m], or points around them at a radius [m], are asphalt: roads and lay-bys."""
        paved = np.zeros(len(places), dtype=bool)
        for dx, dy in ((0.0, 0.0), (radius, 0.0), (-radius, 0.0), (0.0, radius), (0.0, -radius)):
            place, shape = self._ground.query(shapely.points(places + (dx, dy)), predicate="intersects")
            top = np.full(len(places), -1)
            np.maximum.at(top, place, shape)
            paved |= (top >= 0) & self._paved[top]
            if radius == 0.0:
                break
        return paved

    def on_footway(self, places: Array) -> NDArray[np.bool_]:
        """Returns which places (n, 2) [m] are on pavements or on the ways of pedestrians."""
        return ~free_of(np.asarray(shapely.points(places), dtype=np.object_), self._walked)

    def keep_views(self, views: Sequence[shapely.Polygon]) -> None:
        """Adds ground that buildings must leave free, so that lights and boards are seen."""
        self._views += views
        self.__dict__.pop("views", None)

    @cached_property
    def views(self) -> shapely.STRtree:
        """Ground between drivers and the lights and boards that are for them, see `keep_views`."""
        return shapely.STRtree(self._views)

    def has_room(self, x: float, y: float, radius: float) -> bool:
        """Returns whether a post of a radius [m] stands on no lane, and not on other asphalt such as a lay-by."""
        off_lanes = free_of(np.array([shapely.Point(x, y).buffer(radius)]), self.lanes)[0]
        return bool(off_lanes and not self.on_asphalt(np.array([(x, y)]), radius)[0])

    @cached_property
    def lots(self) -> tuple[Lot, ...]:
        """Lots of all sites, apart from each other, by the ids of the sites."""
        taken: list[shapely.Polygon] = []
        return tuple(self._lot(site, taken) for site in self._layers.town.sites)

    @cached_property
    def lots_with_fronts(self) -> shapely.STRtree:
        """Lots, and the ground between their middles and their streets: thin posts may stand at the flanks."""
        return shapely.STRtree([shape for lot in self.lots for shape in (_ground_of(lot), _with_view(lot, _MIDDLE))])

    @cached_property
    def reserved(self) -> shapely.STRtree:
        """Lots, the ground between them and their streets, and the lines of sight of approaching cars."""
        town = self._layers.town
        sights = [sight for lot, site in zip(self.lots, town.sites, strict=True) for sight in _sights(town, site, lot)]
        return shapely.STRtree([*(_with_view(lot) for lot in self.lots), *sights])

    def _lot(self, site: Site, taken: list[shapely.Polygon]) -> Lot:
        place, way = np.array(site.position), np.array(site.waypoint)
        heading = float(pn.arctan2(*(place - way)[::-1]))
        towards = np.array([pn.cos(heading), pn.sin(heading)])
        # the largest size first, at each size as close to the place as can be
        options = np.array([(*size, behind) for size in _LOTS for behind in _BEHIND])
        length, depth, behind = options.T
        fronts = place + behind[:, None] * towards
        count = len(options)
        middles = fronts + 0.5 * depth[:, None] * towards
        ground = rectangles(middles, np.full(count, heading), depth, length + 2.0 * BESIDE_LOT)
        free = free_of(ground, self.ways) & free_of(ground, self.trees)
        if taken:
            free &= ~shapely.intersects(ground, shapely.MultiPolygon(taken).buffer(1.0))
        chosen = int(np.argmax(free)) if free.any() else count - len(_BEHIND)
        x, y = fronts[chosen].tolist()
        taken.append(ground[chosen])
        key = site_key(self._layers.town.name, site.id)
        return Lot(site.id, site.position, heading, (x, y), float(length[chosen]), float(depth[chosen]), key)


def free_of(polygons: NDArray[np.object_], tree: shapely.STRtree) -> NDArray[np.bool_]:
    """Returns which polygons (n,) touch none of a tree."""
    free = np.ones(len(polygons), dtype=bool)
    if len(tree):
        free[tree.query(polygons, predicate="intersects")[0]] = False
    return free


def _ground_of(lot: Lot) -> shapely.Polygon:
    """Returns a lot with a margin."""
    side = lot.length / 2.0 + 0.5
    return shapely.Polygon(
        [lot.at(-0.5, -side), lot.at(-0.5, side), lot.at(lot.depth + 0.5, side), lot.at(lot.depth + 0.5, -side)]
    )


def _with_view(lot: Lot, widest: float = math.inf) -> shapely.Polygon:
    """Returns a lot with room at its sides and in front of it, at most a width [m] to each side of its middle."""
    ahead = float(pn.hypot(lot.front[0] - lot.place[0], lot.front[1] - lot.place[1])) + 5.0
    side = min(lot.length / 2.0 + 2.5, widest)
    return shapely.Polygon(
        [lot.at(-ahead, -side), lot.at(-ahead, side), lot.at(lot.depth + 1.0, side), lot.at(lot.depth + 1.0, -side)]
    )


def _sights(town: Town, site: Site, lot: Lot) -> list[shapely.Polygon]:
    """Returns triangles between cars that approach a site and the near side of its lot, where signs stand."""
    side = lot.length / 2.0 + BESIDE_LOT
    found = []
    for distance in _SEEN_FROM:
        eye = _before(town, site, distance)
        # the side of the lot that is closer to the car
        near = min((side, -side), key=lambda right: pm.dist(eye, lot.at(0.0, right)))
        found.append(shapely.Polygon([eye, lot.at(-_SIGN[0], near), lot.at(_SIGN[1], near)]).buffer(0.3))
    return found


def _before(town: Town, site: Site, distance: float) -> tuple[float, float]:
    """Returns the position (x, y) [m] at a distance before the stop at a site, limited by the start of the lane."""
    lane, station = town.lanes[site.lane], site.station
    seen = {lane.id}
    while station < distance and (before := [k for k in town.predecessors(lane.id) if k not in seen]):
        distance -= station
        # straight on rather than round a corner
        lane = min((town.lanes[k] for k in before), key=lambda row: abs(row.headings[-1] - row.headings[0]))
        station = lane.length
        seen.add(lane.id)
    x, y = lane.position(max(station - distance, 0.0)).tolist()
    return x, y


def _footways(town: Town) -> list[shapely.Polygon]:
    """Returns the footways of pedestrians, also round corners and beside roads without pavements."""
    arrays = town_arrays(network_of(town))
    lines = [arrays.walk_points[way.first : way.last + 1, :2] for way in arrays.walks if way.length > 0.0]
    return [shapely.LineString(line).buffer(FOOTWAY) for line in lines]
