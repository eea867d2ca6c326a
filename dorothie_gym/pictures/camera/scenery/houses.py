"""Houses along the streets: colours, roofs and gardens, chosen so that hardly two of a street are alike."""

from __future__ import annotations

import enum
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.pictures.camera.atlas import Texture
from dorothie_gym.pictures.camera.mesh import oriented
from dorothie_gym.pictures.camera.models.solids import Rgb
from dorothie_gym.tasks.landmark_designs import Garden

if TYPE_CHECKING:
    from collections.abc import Sequence

    from dorothie_gym.maps.model import Array
    from dorothie_gym.pictures.camera.mesh import MeshBuilder


class Roof(enum.IntEnum):
    """Form of the roof of a house."""

    ALONG = 0
    """Gabled, with its ridge along the street."""
    ACROSS = 1
    """Gabled, with its gable towards the street."""
    HIPPED = 2


class House(NamedTuple):
    """Individual look of a house along a street.

    Attributes:
        wall: colour of the walls.
        roof: form of the roof.
        tiles: colour of the roof.
        garden: what grows or stands beside or in front of it.
        door: colour of the door.
    """

    wall: Rgb
    roof: Roof
    tiles: Rgb
    garden: Garden
    door: Rgb


WALLS: Final[Sequence[Rgb]] = (
    (226, 210, 186),
    (202, 178, 158),
    (208, 214, 216),
    (222, 208, 170),
    (196, 204, 190),
    (170, 134, 108),
    (240, 236, 228),
    (178, 182, 186),
)
"""Colours of houses; none has the everyday name of a colour of a landmark's house."""

_TILES: Final[Sequence[Rgb]] = ((152, 78, 60), (104, 98, 98), (128, 90, 72), (86, 90, 98), (172, 112, 78))
_DOORS: Final[Sequence[Rgb]] = (
    (150, 110, 90),
    (96, 46, 40),
    (60, 84, 70),
    (66, 76, 104),
    (206, 200, 190),
    (58, 56, 56),
)
_GARDENS: Final = tuple(Garden)
_EAVES: Final = 0.4  # [m] by which roofs overhang the walls


def house_look(tone: int) -> House:
    """Returns the look of a house by a random number; each attribute is independent of the others."""
    tone, wall = divmod(tone, len(WALLS))
    tone, roof = divmod(tone, len(Roof))
    tone, tiles = divmod(tone, len(_TILES))
    tone, garden = divmod(tone, len(_GARDENS))
    return House(WALLS[wall], Roof(roof), _TILES[tiles], _GARDENS[garden], _DOORS[tone % len(_DOORS)])


def add_roof(
    builder: MeshBuilder,
    form: Roof,
    centre: tuple[float, float],
    heading: float,
    size: tuple[float, float],
    low: float,
    *,
    tiles: Rgb,
    gable: Array,
    slope: float = 0.6,
) -> None:
    """Adds the roof of a house above its walls.

    Args:
        builder: receives the triangles.
        form: form of the roof.
        centre: middle of the house (x, y) [m].
        heading: viewing direction of a person who looks at its front from the street [rad].
        size: depth away from the street, and length along it [m].
        low: height of the eaves [m].
        tiles: colour of the roof.
        gable: colour of the gables (3,).
        slope: rise of the roof per metre.
    """
    depth, length = size
    if form is Roof.ACROSS:  # the same as the other one, turned by a right angle
        depth, length, heading = length, depth, heading + np.pi / 2.0
    half, side, rise = depth / 2.0 + _EAVES, length / 2.0 + _EAVES, slope * depth / 2.0
    reach = max(side - half, 0.2 * side) if form is Roof.HIPPED else side
    feet = oriented([(half, -side), (half, side), (-half, side), (-half, -side)], centre, heading)
    ends = oriented([(0.0, -reach), (0.0, reach)], centre, heading)
    a, b, c, d = (np.array([*foot, low]) for foot in feet.tolist())
    left, right = (np.array([*end, low + rise]) for end in ends.tolist())
    repeats = (length / 3.2, depth / 4.0)
    for corners in ([b, right, left, a], [d, left, right, c]):
        builder.quad(corners, colour=tiles, kind=ObjectClass.BUILDING, repeats=repeats, texture=Texture.ROOF_TILES)
    ending = np.array(tiles) * 0.85 if form is Roof.HIPPED else gable
    builder.triangles([[c, right, b], [a, left, d]], colour=ending, kind=ObjectClass.BUILDING)
    builder.quad([a, d, c, b], colour=gable * 0.6, kind=ObjectClass.BUILDING)
