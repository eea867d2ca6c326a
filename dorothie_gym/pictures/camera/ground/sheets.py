"""Sheets of ground: the polygons of the map on the ground, on bridges and in tunnels, each with its material."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.maps.model import Array
from dorothie_gym.pictures.camera.ground.cells import Painted
from dorothie_gym.pictures.camera.ground.materials import MATERIALS, SYMBOLS, Material
from dorothie_gym.pictures.maps.ground import town_bounds
from dorothie_gym.pictures.maps.levels import LevelStretch

if TYPE_CHECKING:
    from dorothie_gym.pictures.maps.map_layers import MapLayers
    from dorothie_gym.pictures.maps.shapes import Shape

BORDER = 80.0
"""Width of the country around the outermost roads in the lookup [m]; farther ones have no details."""

MAP_SCALE = 40.0
"""Scale of the map at which all its lines have their true widths [px/m]."""


@dataclass(frozen=True, eq=False)
class Sheet:
    """Sheet of ground.

    Attributes:
        polygons: in the order of painting.
        outside: material where there is no polygon.
        low, high: bounds (2,) [m].
        level: 0 on the ground, 1 and more for bridges, -1 for tunnels.
        stretches: parts of lanes of a bridge or tunnel.
    """

    polygons: tuple[Painted, ...]
    outside: Material
    low: Array
    high: Array
    level: int
    stretches: tuple[LevelStretch, ...]


def painted(shapes: Iterable[Shape]) -> tuple[Painted, ...]:
    """Returns the shapes of a map that lie on the ground, with their materials."""
    return tuple(
        Painted(shape.points, MATERIALS[shape.colour])
        for shape in shapes
        if shape.colour not in SYMBOLS and len(shape.points) > 2
    )


def town_sheets(layers: MapLayers) -> tuple[Sheet, ...]:
    """Returns the sheets of a town: the ground, the bridges level by level, and the tunnels if there are any."""
    town, layers = layers.town, layers.at_scale(MAP_SCALE, BORDER)
    x0, y0, x1, y1 = town_bounds(town, BORDER)
    ground = painted(layers.ground_shapes() if layers.bridge_levels else layers.shapes)
    if layers.bridge_levels:
        below = {Material.TUNNEL_FLOOR: Material.GRAVEL}
        ground = tuple(Painted(part.points, below.get(part.material, part.material)) for part in ground)
    sheets = [Sheet(ground, Material.COUNTRY, np.array([x0, y0]), np.array([x1, y1]), 0, ())]
    for level in [*layers.bridge_levels, -1]:
        above = painted(layers.bridge_shapes(level) if level > 0 else layers.tunnel_shapes())
        if above:
            points = np.concatenate([polygon.points for polygon in above])
            parts = tuple(part for part in layers.stretches if part.level == level)
            outside = Material.NOTHING if level > 0 else Material.TUNNEL_FLOOR
            sheets.append(Sheet(above, outside, points.min(axis=0) - 1.0, points.max(axis=0) + 1.0, level, parts))
    return tuple(sheets)
