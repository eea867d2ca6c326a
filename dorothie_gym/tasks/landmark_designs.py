"""Designs of the landmarks: forms and colours of buildings and people, as the camera draws and speakers describe them.

A brand looks the same everywhere. Houses and people differ by town and site, so that no two of a town look alike: of
60 houses, any two differ in at least two of colour, storeys, roof and garden. Their colours are rare among the other
buildings and the people in the streets. The designs are our own.
"""

from __future__ import annotations

import colorsys
import enum
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import Final, TypeAlias

from dorothie_gym.ontology.slots import LandmarkName

Colour: TypeAlias = tuple[int, int, int]
"""Red, green and blue, 0 to 255."""


class Top(enum.Enum):
    """Form of a store above its walls."""

    FLAT = enum.auto()
    """Flat, with an awning over the front."""
    MANSARD = enum.auto()
    """Slanted on all sides."""
    GABLE = enum.auto()
    TOWER = enum.auto()
    """Flat, with a tower at a corner."""
    STEPPED = enum.auto()
    """Flat, with a higher middle."""
    STRIPED = enum.auto()
    """Flat, with a fascia of three stripes."""
    HALL = enum.auto()
    """A high hall without windows."""
    CANOPY = enum.auto()
    """A roof over pumps before a small building."""


@dataclass(frozen=True)
class StoreDesign:
    """Form and colours of a store.

    Attributes:
        top: form above the walls.
        wall: colour of the walls.
        fascia: colour of the part above them, and of the sign.
        accent: colour of smaller parts.
        most: largest length and depth [m].
    """

    top: Top
    wall: Colour
    fascia: Colour
    accent: Colour
    most: tuple[float, float] = (17.0, 12.0)


class Garden(enum.StrEnum):
    """What grows or stands beside or in front of a house."""

    TREE = "tree"
    HEDGE = "hedge"
    FENCE = "fence"
    FLOWERS = "flowers"


@dataclass(frozen=True)
class HouseDesign:
    """Form and colours of a house.

    Attributes:
        wall: colour of the walls.
        roof: colour of the roof.
        trim: colour of the frames of the windows.
        storeys: number of storeys.
        garden: a tree beside it, or what is in front of it.
    """

    wall: Colour
    roof: Colour
    trim: Colour
    storeys: int
    garden: Garden


@dataclass(frozen=True)
class PersonDesign:
    """Clothes of a waiting person: a coat and trousers."""

    coat: Colour
    trousers: Colour


STORES: Final[Mapping[LandmarkName, StoreDesign]] = MappingProxyType(
    {
        LandmarkName.BURGER_KING: StoreDesign(Top.MANSARD, (226, 204, 172), (112, 56, 28), (206, 60, 34)),
        LandmarkName.COCO: StoreDesign(Top.FLAT, (250, 206, 148), (246, 150, 36), (70, 34, 8), (13.0, 10.0)),
        LandmarkName.IKEA: StoreDesign(Top.HALL, (0, 78, 158), (0, 78, 158), (255, 218, 26), (20.0, 15.0)),
        LandmarkName.KFC: StoreDesign(Top.TOWER, (240, 238, 234), (196, 16, 40), (196, 16, 40)),
        LandmarkName.PANERA: StoreDesign(Top.GABLE, (232, 218, 186), (74, 98, 34), (74, 98, 34)),
        LandmarkName.QDOBA: StoreDesign(Top.STEPPED, (222, 196, 150), (112, 26, 78), (230, 150, 40)),
        LandmarkName.SEVEN_ELEVEN: StoreDesign(
            Top.STRIPED, (244, 244, 242), (0, 126, 84), (238, 118, 36), (14.0, 10.0)
        ),
        LandmarkName.SHELL: StoreDesign(Top.CANOPY, (240, 240, 238), (252, 208, 20), (206, 26, 26)),
    }
)
"""Designs of the brands."""

MIDDLE_STRIPE: Final[Colour] = (208, 30, 44)
"""Colour of the stripe between those of accent and fascia (`Top.STRIPED`)."""

_WALLS: Final[tuple[Colour, ...]] = ((46, 178, 184), (242, 222, 56), (126, 92, 168), (58, 104, 190), (92, 158, 84))
"""Colours of houses; none has the everyday name of a colour of the facades of other buildings, but for glass fronts.

They keep their names in the shade: yellow is without red, because dark orange is brown.
"""

_ROOFS: Final[tuple[Colour, ...]] = ((206, 44, 38), (34, 34, 38), (242, 242, 238), (104, 60, 36), (224, 198, 152))

_TRIMS: Final[tuple[Colour, ...]] = ((250, 250, 246), (30, 30, 32), (206, 44, 38))

_MOST_STOREYS: Final = 3

_GARDENS: Final = tuple(Garden)

_COATS: Final[tuple[Colour, ...]] = (
    (248, 226, 40),
    (206, 36, 40),
    (40, 150, 70),
    (44, 92, 200),
    (128, 70, 170),
    (36, 176, 180),
)

_TROUSERS: Final[tuple[Colour, ...]] = ((40, 60, 140), (236, 234, 228), (24, 24, 26), (112, 68, 38), (190, 40, 44))
"""Trousers; none is gray, as white ones look in the shade. Together with `_COATS`, 30 sites differ."""


def site_key(town: str, site: int) -> int:
    """Returns the number that determines the design of a house or person, from the town's name and the site's id."""
    return zlib.crc32(town.encode()) % 180 + site  # 180: all designs of houses and of people


def house_design(key: int) -> HouseDesign:
    """Returns the design of a house by the key of its site: neighbouring sites differ in every colour.

    Storeys, garden and roof have numbers of values without a common divisor, so that 60 successive keys have all of
    their combinations (Chinese remainder theorem). The colour is another for every value of each of them. Two of 60
    houses therefore differ in at least two of the four, like words of a code with a checksum.
    """
    storey, garden, roof = key % _MOST_STOREYS, key % len(_GARDENS), key % len(_ROOFS)
    return HouseDesign(
        wall=_WALLS[(storey + garden - roof) % len(_WALLS)],
        roof=_ROOFS[roof],
        trim=_TRIMS[(key + key // (_MOST_STOREYS * len(_GARDENS) * len(_ROOFS))) % len(_TRIMS)],
        storeys=1 + storey,
        garden=_GARDENS[garden],
    )


def person_design(key: int) -> PersonDesign:
    """Returns the clothes of a person by the key of the site."""
    return PersonDesign(coat=_COATS[key % len(_COATS)], trousers=_TROUSERS[key % len(_TROUSERS)])


@lru_cache(maxsize=64)
def features_of(name: LandmarkName) -> tuple[str, ...]:
    """Returns the visible features of a brand, as phrases with an article ("a red roof"); empty for other names."""
    design = STORES.get(name)
    if design is None:
        return ()
    seen = (_top_feature(design), f"a big {colour_name(design.fascia)} billboard")
    if design.top is Top.CANOPY:  # little of the building behind it is visible
        return seen
    return (f"{_with_article(colour_name(design.wall))} facade", *seen)


def _with_article(words: str) -> str:
    return f"{'an' if words[0] in 'aeiou' else 'a'} {words}"


def _top_feature(design: StoreDesign) -> str:
    fascia, accent = colour_name(design.fascia), colour_name(design.accent)
    match design.top:
        case Top.MANSARD:
            return f"{_with_article(fascia)} slanted roof"
        case Top.GABLE:
            return f"{_with_article(fascia)} gable roof"
        case Top.TOWER:
            return f"{_with_article(accent)} tower"
        case Top.STEPPED:
            return f"a high {fascia} front"
        case Top.STRIPED:
            return f"{_with_article(accent)}, {colour_name(MIDDLE_STRIPE)} and {fascia} band"
        case Top.HALL:
            return f"a big {accent} entrance"
        case Top.CANOPY:
            return f"{_with_article(fascia)} roof over the pumps"
        case Top.FLAT:
            return f"{_with_article(accent)} awning"


_HUES: Final = (
    (16.0, "red"), (43.0, "orange"), (66.0, "yellow"), (164.0, "green"), (196.0, "turquoise"), (256.0, "blue"),
    (336.0, "purple"), (360.0, "red"),
)  # fmt: skip
"""Upper limits of the hues [degrees] of the basic colour terms (Berlin and Kay 1969), and turquoise."""


def colour_name(colour: Colour) -> str:
    """Returns the everyday name of a colour."""
    hue, saturation, value = colorsys.rgb_to_hsv(*(part / 255.0 for part in colour))
    if value < 0.2:
        return "black"
    if saturation < 0.1:
        return "white" if value > 0.85 else "gray"
    degrees = 360.0 * hue
    warm = 10.0 <= degrees <= 50.0
    if warm and value < 0.6:
        return "brown"
    if warm and saturation < 0.45:
        return "beige"
    return next(name for limit, name in _HUES if degrees <= limit)
