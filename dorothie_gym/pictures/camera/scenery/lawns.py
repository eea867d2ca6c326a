"""Gardens of the houses along the streets, and shrubs on the lawns beside roads."""

from __future__ import annotations

import zlib
from typing import TYPE_CHECKING, Final

import numpy as np
import shapely
from numpy.typing import NDArray

from dorothie_gym.pictures.camera.mesh import Mesh, MeshBuilder, joined
from dorothie_gym.pictures.camera.scenery.buildings import Building, Style, frontages
from dorothie_gym.pictures.camera.scenery.clearance import free_of, rectangles
from dorothie_gym.pictures.camera.scenery.gardens import SHRUBS, Plot, add_garden, shrub_form, small_tree
from dorothie_gym.pictures.camera.scenery.houses import house_look
from dorothie_gym.pictures.camera.scenery.placing import Heights, feet_on, stamped
from dorothie_gym.pictures.maps.shapes import polyline_stations
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.tasks.landmark_designs import Garden

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.pictures.camera.scenery.clearance import Clearance
    from dorothie_gym.pictures.maps.map_layers import MapLayers

_YARDS: Final = np.array([3.0, 2.2, 1.4, 0.9])  # [m] depths of front gardens that are tried
_TREE: Final = 1.2  # [m] radius of the crown of a garden tree
_TREE_PLACES: Final = ((-1.6, -0.3), (-1.6, 0.3), (2.0, -0.5), (2.0, 0.5))
"""Places of a garden tree: metres behind the front, and to the right relative to the length, one crown further out."""

_EVERY: Final = 24.0  # [m] of the edge of a road for each shrub
_AWAY: Final = 4.5, 15.0  # [m] from the edge of the road to shrubs
_RADII: Final = 0.45, 1.0  # [m]


class _Room:
    """Ground that is free of all that the map draws, of lots, views and buildings."""

    def __init__(self, clearance: Clearance, buildings: list[Building]) -> None:
        outlines = shapely.STRtree([shapely.Polygon(building.outline) for building in buildings])
        self._trees = (clearance.ways, clearance.trees, clearance.reserved, clearance.views, outlines)

    def free(self, ground: NDArray[np.object_]) -> NDArray[np.bool_]:
        """Returns which polygons (n,) are free."""
        free = np.ones(len(ground), dtype=bool)
        for tree in self._trees:
            free[free] = free_of(ground[free], tree)
        return free


def front_garden(building: Building, room: _Room) -> Plot | None:
    """Returns the ground in front of a house, as deep as there is room for; None if there is none."""
    middles = np.array([building.at(-depth / 2.0 - 0.1, 0.0) for depth in _YARDS.tolist()])
    turns, lengths = np.full(len(_YARDS), building.heading), np.full(len(_YARDS), building.length)
    free = room.free(rectangles(middles, turns, _YARDS - 0.1, lengths))
    if not free.any():
        return None
    depth = float(_YARDS[np.argmax(free)])
    return Plot(building.at(-depth, 0.0), building.heading, building.length / 2.0, depth - 0.1, building.tone)


def build_lawns(layers: MapLayers, clearance: Clearance, buildings: list[Building], ground: Heights) -> Mesh:
    """Returns gardens and shrubs of a town, which leave lots, and the views of lights and boards, free."""
    room, builder, trees = _Room(clearance, buildings), MeshBuilder(), list[tuple[float, float]]()
    for building in buildings:
        if building.style is not Style.HOUSE:
            continue
        garden = house_look(building.tone).garden
        if garden is Garden.TREE:
            trees += _tree_beside(building, room)
        elif (plot := front_garden(building, room)) is not None:
            add_garden(builder, garden, plot, ground, fine=False)
    places = np.array(trees).reshape(-1, 2)
    feet = np.column_stack((places, feet_on(ground, places)))
    planted = stamped(small_tree(), feet, np.linspace(0.0, 1.7 * len(places), len(places)), np.full(len(places), _TREE))
    return joined([builder.build(), planted, *_shrubs(layers, room, ground)])


def _tree_beside(building: Building, room: _Room) -> list[tuple[float, float]]:
    """Returns the place of the tree of a house, if there is room."""
    options = [
        building.at(deep, share * building.length + (np.sign(share) * _TREE * 1.3 if deep > 0.0 else 0.0))
        for deep, share in _TREE_PLACES
    ]
    free = room.free(np.array([shapely.Point(option).buffer(_TREE) for option in options], dtype=np.object_))
    return [options[int(np.argmax(free))]] if free.any() else []


def _shrubs(layers: MapLayers, room: _Room, ground: Heights) -> list[Mesh]:
    """Returns shrubs beside the roads of a town."""
    rng = np.random.default_rng(zlib.crc32(b"shrubs of " + layers.town.name.encode()))
    found: list[Array] = []
    for frontage in frontages(layers):
        stations = polyline_stations(frontage.points)
        count = int(rng.poisson(float(stations[-1]) / _EVERY))
        at, away = rng.uniform(0.0, float(stations[-1]), count), rng.uniform(*_AWAY, count)
        turns = np.interp(at, stations, frontage.away)
        spots = np.stack([np.interp(at, stations, column) for column in frontage.points.T], axis=-1)
        found.append(spots + away[:, None] * np.stack((pn.cos(turns), pn.sin(turns)), axis=-1))
    places = np.concatenate([np.zeros((0, 2)), *found])
    radii, headings = rng.uniform(*_RADII, len(places)), rng.uniform(0.0, 2.0 * np.pi, len(places))
    forms = rng.integers(0, SHRUBS, len(places))
    free = room.free(np.asarray(shapely.buffer(shapely.points(places), radii + 0.4), dtype=np.object_))
    heights = feet_on(ground, places)
    feet = np.column_stack((places, heights))
    chosen = [free & (forms == form) for form in range(SHRUBS)]
    return [stamped(shrub_form(form), feet[rows], headings[rows], radii[rows]) for form, rows in enumerate(chosen)]
