"""Materials of the ground: colours as they look from the street, semantic classes, and the colours of the map."""

from __future__ import annotations

import enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.pictures import palette
from dorothie_gym.pictures.palette import Colour

KERB_HEIGHT = 0.12
"""Height above the road of pavements and all other ground behind a kerb [m]."""


class Relief(enum.IntEnum):
    """Effect of a material on the height of the ground."""

    PAINT = 0
    """Lies on the surface below it."""
    FLAT = 1
    """At the height of the lanes."""
    RAISED = 2
    """Higher by a kerb."""
    SLOPE = 3
    """Raised, and the ground from a road in a cutting up to the land beside it."""


class Material(enum.IntEnum):
    """Materials of the ground."""

    NOTHING = 0
    """Outside of a bridge or tunnel."""
    COUNTRY = 1
    BLOCK = 2
    PARK = 3
    PAVEMENT = 4
    PAVEMENT_EDGE = 5
    KERB = 6
    ROAD = 7
    BAY = 8
    WHITE_PAINT = 9
    GREY_PAINT = 10
    YELLOW_PAINT = 11
    MEDIAN = 12
    MEDIAN_KERB = 13
    SLOPE = 14
    TUNNEL_FLOOR = 15
    PARAPET = 16
    BRIDGE_EDGE = 17
    GRAVEL = 18
    """Below bridges."""


class Look(NamedTuple):
    """Properties of a material.

    Attributes:
        colour: RGB in 0..255.
        kind: semantic class.
        relief: effect on the height of the ground.
        grain: strength of the noise, relative to the colour.
    """

    colour: Colour
    kind: ObjectClass
    relief: Relief
    grain: float


LOOKS: dict[Material, Look] = {
    Material.NOTHING: Look((110, 110, 106), ObjectClass.GROUND, Relief.FLAT, 0.10),
    Material.COUNTRY: Look((96, 118, 62), ObjectClass.TERRAIN, Relief.RAISED, 0.30),
    Material.BLOCK: Look((128, 134, 92), ObjectClass.TERRAIN, Relief.RAISED, 0.25),
    Material.PARK: Look((84, 124, 58), ObjectClass.TERRAIN, Relief.RAISED, 0.30),
    Material.PAVEMENT: Look((158, 154, 146), ObjectClass.SIDE_WALK, Relief.RAISED, 0.10),
    Material.PAVEMENT_EDGE: Look((140, 137, 130), ObjectClass.SIDE_WALK, Relief.RAISED, 0.08),
    Material.KERB: Look((172, 170, 164), ObjectClass.SIDE_WALK, Relief.RAISED, 0.08),
    Material.ROAD: Look((76, 77, 80), ObjectClass.ROAD, Relief.FLAT, 0.16),
    Material.BAY: Look((88, 88, 90), ObjectClass.ROAD, Relief.FLAT, 0.14),
    Material.WHITE_PAINT: Look((214, 214, 208), ObjectClass.ROAD_LINE, Relief.PAINT, 0.10),
    Material.GREY_PAINT: Look((198, 198, 194), ObjectClass.ROAD_LINE, Relief.PAINT, 0.10),
    Material.YELLOW_PAINT: Look((214, 172, 62), ObjectClass.ROAD_LINE, Relief.PAINT, 0.10),
    Material.MEDIAN: Look((92, 126, 62), ObjectClass.TERRAIN, Relief.RAISED, 0.30),
    Material.MEDIAN_KERB: Look((176, 174, 168), ObjectClass.SIDE_WALK, Relief.RAISED, 0.08),
    Material.SLOPE: Look((112, 120, 78), ObjectClass.TERRAIN, Relief.SLOPE, 0.28),
    Material.TUNNEL_FLOOR: Look((84, 84, 84), ObjectClass.ROAD, Relief.FLAT, 0.12),
    Material.PARAPET: Look((168, 166, 160), ObjectClass.WALL, Relief.RAISED, 0.08),
    Material.BRIDGE_EDGE: Look((140, 138, 132), ObjectClass.WALL, Relief.RAISED, 0.08),
    Material.GRAVEL: Look((126, 121, 108), ObjectClass.TERRAIN, Relief.FLAT, 0.20),
}
"""Properties of all materials."""

MATERIALS: dict[Colour, Material] = {
    palette.COUNTRY: Material.COUNTRY,
    palette.BLOCK: Material.BLOCK,
    palette.PARK: Material.PARK,
    palette.SIDEWALK: Material.PAVEMENT,
    palette.SIDEWALK_EDGE: Material.PAVEMENT_EDGE,
    palette.KERB: Material.KERB,
    palette.ROAD: Material.ROAD,
    palette.BAY: Material.BAY,
    palette.LANE_LINE: Material.WHITE_PAINT,
    palette.STOP_LINE: Material.WHITE_PAINT,
    palette.ZEBRA: Material.WHITE_PAINT,
    palette.ARROW: Material.WHITE_PAINT,
    palette.EDGE_LINE: Material.GREY_PAINT,
    palette.CENTRE_LINE: Material.YELLOW_PAINT,
    palette.HATCHING: Material.YELLOW_PAINT,
    palette.MEDIAN: Material.MEDIAN,
    palette.MEDIAN_KERB: Material.MEDIAN_KERB,
    palette.CUTTING: Material.SLOPE,
    palette.TUNNEL: Material.TUNNEL_FLOOR,
    palette.BRIDGE_PARAPET: Material.PARAPET,
    palette.BRIDGE_EDGE: Material.BRIDGE_EDGE,
}
"""Material of each colour of the map that lies on the ground."""

SYMBOLS: frozenset[Colour] = frozenset(
    {
        palette.TREE,
        palette.COUNTRY_TREE,
        palette.MEDIAN_TREE,
        palette.ONE_WAY,
        palette.CUTTING_EDGE,
        palette.TUNNEL_EDGE,
        palette.BRIDGE_SHADOW,
    }
)
"""Colours of the map for objects that are not on the ground: trees, shadows, and symbols of cartography."""


def material_colours() -> NDArray[np.float32]:
    """Returns RGB of all materials (m, 3), 0..255."""
    return np.array([LOOKS[material].colour for material in Material], dtype=np.float32)


def material_classes() -> NDArray[np.uint8]:
    """Returns the semantic classes of all materials (m,), values of `ObjectClass`."""
    return np.array([LOOKS[material].kind.value for material in Material], dtype=np.uint8)


def material_grains() -> NDArray[np.float32]:
    """Returns the strength of the noise of all materials (m,)."""
    return np.array([LOOKS[material].grain for material in Material], dtype=np.float32)
