"""Textures of the camera in one flat array, each with smaller versions of itself (mip levels)."""

from __future__ import annotations

import enum
from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.ontology.slots import LandmarkName, StreetName
from dorothie_gym.pictures.camera import patterns
from dorothie_gym.pictures.camera.lettering import Ink, Picture, lettered
from dorothie_gym.support.compilation.records import by_reference
from dorothie_gym.support.copying import shared

SIGN_SIZE = 256, 64
"""Width and height of panels with words [px]."""

PLATES = 16
"""Number of different number plates, a power of two."""

STREET_INK: Ink = (255, 255, 255)
STREET_GROUND: Ink = (0, 96, 60)
"""Colours of street-name blades: white on green (MUTCD 2009, 2D.43)."""


class Texture(enum.IntEnum):
    """Textures of every town, by their index; street names follow at `STREET_NAMES`.

    Textures with windows show four bays by four storeys in one repeat.
    """

    PLAIN = 0
    BRICK = 1
    BRICK_WINDOWS = 2
    PLASTER = 3
    PLASTER_WINDOWS = 4
    OFFICE = 5
    PANELS = 6
    """Storeys of concrete slabs with bands of windows."""
    HOUSE = 7
    """Clapboard with windows."""
    SHOPS = 8
    """Shop windows, doors and awnings: four adjacent shops, one storey."""
    ROOF_TILES = 9
    LEAVES = 10
    CONCRETE = 11
    BARK = 12
    GLASS_FRONT = 13
    """Glazed front of a shop, lit at night: four panes."""
    PLATE = 14
    """Number plates, `PLATES` of them one above the other."""
    STOP = 15
    YIELD = 16
    WORKS = 17
    """Sign of road works, a square that stands on its corner."""
    STRIPES = 18
    """Slanted stripes of barricades, one repeat of white and orange."""
    DOOR = 19
    BURGER_KING = 20
    COCO = 21
    IKEA = 22
    KFC = 23
    PANERA = 24
    QDOBA = 25
    SEVEN_ELEVEN = 26
    SHELL = 27
    HOUSE_SIGN = 28
    """Pictogram of a house."""
    PERSON_SIGN = 29
    """Pictogram of a person."""


STREET_NAMES = len(Texture)
"""Index of the blade of street 0; that of street k is k larger."""

BRAND_SIGNS: dict[LandmarkName, tuple[Texture, str, Ink, Ink]] = {
    LandmarkName.BURGER_KING: (Texture.BURGER_KING, "Burger King", (255, 226, 180), (112, 56, 28)),
    LandmarkName.COCO: (Texture.COCO, "Coco", (70, 34, 8), (246, 150, 36)),
    LandmarkName.IKEA: (Texture.IKEA, "IKEA", (255, 218, 26), (0, 78, 158)),
    LandmarkName.KFC: (Texture.KFC, "KFC", (255, 255, 255), (196, 16, 40)),
    LandmarkName.PANERA: (Texture.PANERA, "Panera", (255, 244, 214), (74, 98, 34)),
    LandmarkName.QDOBA: (Texture.QDOBA, "Qdoba", (255, 222, 150), (112, 26, 78)),
    LandmarkName.SEVEN_ELEVEN: (Texture.SEVEN_ELEVEN, "7-Eleven", (255, 255, 255), (0, 126, 84)),
    LandmarkName.SHELL: (Texture.SHELL, "Shell", (206, 26, 26), (252, 208, 20)),
}
"""Texture, words, ink and ground of the signs of landmarks: our own plain panels, no logos."""


@by_reference
@shared
class AtlasArrays(NamedTuple):
    """Textures as arrays.

    Attributes:
        texels: (m, 4) uint8, all levels of all textures in a row: red, green, blue, share of own light at night. Row 0
            of a picture is at its bottom: v points up.
        table: (k, 4) int32: first texel, width, height and number of levels of each texture. Widths and heights are
            powers of two; each level follows the one before it and is half as wide and high.
    """

    texels: NDArray[np.uint8]
    table: NDArray[np.int32]


class TextureAtlas:
    """Collects textures; the first one is plain white."""

    def __init__(self, pictures: Iterable[Picture] = ()) -> None:
        self._texels: list[NDArray[np.uint8]] = []
        self._table: list[tuple[int, int, int, int]] = []
        self._size = 0
        self.add(np.broadcast_to(np.array([255.0, 255.0, 255.0, 0.0], np.float32), (1, 1, 4)))
        for picture in pictures:
            self.add(picture)

    def __len__(self) -> int:
        return len(self._table)

    def add(self, picture: Picture) -> int:
        """Adds a picture (height, width, 4) in 0..255 and returns its index.

        Raises:
            ValueError: height or width is not a power of two.
        """
        height, width = picture.shape[:2]
        if any(side < 1 or side & (side - 1) for side in (height, width)):
            raise ValueError(f"a texture of {width} x {height} texels: both must be powers of two")
        levels = mip_levels(picture)
        self._table.append((self._size, width, height, len(levels)))
        for level in levels:
            texels = np.clip(np.rint(level), 0, 255).astype(np.uint8).reshape(-1, 4)
            self._texels.append(texels)
            self._size += len(texels)
        return len(self._table) - 1

    def arrays(self) -> AtlasArrays:
        """Returns all textures so far."""
        return AtlasArrays(np.concatenate(self._texels), np.array(self._table, dtype=np.int32).reshape(-1, 4))


def mip_levels(picture: Picture) -> list[Picture]:
    """Returns a picture and its halves, until one side is a single texel."""
    levels = [np.asarray(picture, dtype=np.float32)]
    while min(levels[-1].shape[:2]) > 1:
        height, width, _ = levels[-1].shape
        blocks = levels[-1].reshape(height // 2, 2, width // 2, 2, 4)
        sums = (blocks[:, 0, :, 0] + blocks[:, 0, :, 1]) + (blocks[:, 1, :, 0] + blocks[:, 1, :, 1])
        levels.append(sums * np.float32(0.25))
    return levels


@lru_cache(maxsize=1)
def town_atlas() -> AtlasArrays:
    """Returns the textures of `Texture`, the same in every town."""
    pictures: dict[Texture, Picture] = {
        Texture.BRICK: patterns.brick(),
        Texture.BRICK_WINDOWS: patterns.brick_windows(),
        Texture.PLASTER: patterns.plaster(),
        Texture.PLASTER_WINDOWS: patterns.plaster_windows(),
        Texture.OFFICE: patterns.office(),
        Texture.PANELS: patterns.panels(),
        Texture.HOUSE: patterns.clapboard_windows(),
        Texture.SHOPS: patterns.shops(),
        Texture.ROOF_TILES: patterns.roof_tiles(),
        Texture.LEAVES: patterns.leaves(),
        Texture.CONCRETE: patterns.concrete(),
        Texture.BARK: patterns.bark(),
        Texture.GLASS_FRONT: patterns.glass_front(),
        Texture.PLATE: _plates(),
        Texture.STOP: lettered("STOP", (64, 64), ink=(255, 255, 255), ground=(190, 24, 32), margin=0.1),
        Texture.YIELD: lettered("YIELD", (64, 64), ink=(190, 24, 32), ground=(252, 252, 250), margin=0.26),
        Texture.WORKS: lettered("ROAD\nWORK", (64, 64), ink=(20, 20, 20), ground=(245, 132, 20), margin=0.22),
        Texture.STRIPES: patterns.stripes(),
        Texture.DOOR: patterns.door(),
        Texture.HOUSE_SIGN: patterns.house_sign(),
        Texture.PERSON_SIGN: patterns.person_sign(),
    }
    for texture, words, ink, ground in BRAND_SIGNS.values():
        pictures[texture] = lettered(words, SIGN_SIZE, ink=ink, ground=ground, margin=0.14)
    return TextureAtlas(pictures[texture] for texture in Texture if texture != Texture.PLAIN).arrays()


def _plates() -> Picture:
    """Returns all number plates, the first one at the bottom."""
    letters, digits = "ABDEFHKLMNPRSTVX", np.random.default_rng(4127).integers(1000, 10_000, PLATES)
    words = [f"{letters[k]}{letters[(5 * k + 3) % 16]}{letters[(11 * k + 7) % 16]} {digits[k]}" for k in range(PLATES)]
    plates = [lettered(text, (64, 16), ink=(24, 30, 60), ground=(236, 236, 230), rim=(60, 60, 70)) for text in words]
    return np.concatenate(plates)


@lru_cache(maxsize=1)
def street_atlas() -> AtlasArrays:
    """Returns the textures of `Texture`, followed by the blades of all street names of the ontology."""
    return _with_blades(town_atlas(), list(_STREETS))


def with_street_names(base: AtlasArrays, names: Sequence[str]) -> AtlasArrays:
    """Returns the textures of `Texture`, followed by the blades of streets.

    Args:
        base: textures. If it is that of `street_atlas`, sessions whose names are those of the ontology share its
            texels, and only their tables differ.
        names: names of the streets of a session.
    """
    if len(base.table) == STREET_NAMES + len(_STREETS) and all(name in _STREETS for name in names):
        rows = [*range(STREET_NAMES), *(STREET_NAMES + _STREETS[name] for name in names)]
        return AtlasArrays(base.texels, base.table[rows])
    return _with_blades(base, names)


_STREETS = {street.label: k for k, street in enumerate(StreetName)}


def _with_blades(base: AtlasArrays, names: Sequence[str]) -> AtlasArrays:
    blades = TextureAtlas(
        lettered(name or " ", SIGN_SIZE, ink=STREET_INK, ground=STREET_GROUND, rim=STREET_INK, margin=0.1)
        for name in names
    ).arrays()
    own = base.texels[: base.table[STREET_NAMES, 0]] if len(base.table) > STREET_NAMES else base.texels
    table = blades.table[1:].copy()  # without the plain one
    table[:, 0] += len(own) - 1
    return AtlasArrays(np.concatenate((own, blades.texels[1:])), np.concatenate((base.table[:STREET_NAMES], table)))
