"""Map of a town for browsers: polygons in the order of painting, places of street names, junctions."""

from __future__ import annotations

import gzip
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

import msgspec
import numpy as np

from dorothie_gym.ontology.slots import StreetName
from dorothie_gym.pictures import palette
from dorothie_gym.pictures.maps.ground import town_bounds
from dorothie_gym.pictures.maps.map_layers import MapLayers
from dorothie_gym.pictures.maps.town_map import MapPainter

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town

SCALE: Final = 8.0
"""Scale for whose details the map has polygons [px/m]."""

LABEL_SCALE: Final = 3.0
"""Scale for which street names are placed [px/m]: that of the view that follows the car."""

BORDER: Final = 60.0
"""Width of the country around the streets [m]."""

LONGEST_NAME: Final = max((name.label for name in StreetName), key=len)
"""Name whose length every street has room for: the names of a session are drawn by its seed."""


@lru_cache(maxsize=8)
def town_page(town: Town) -> bytes:
    """Returns the map of a town as JSON, compressed by gzip; coordinates are in decimetres.

    The fields are `bounds` (smallest x and y, largest x and y), `ground` (colour of the country), `shapes` (colour and
    alternating x and y), `labels` (street, size of the letters, alternating x and y of the line under the letters) and
    `junctions` (x and y, by index).
    """
    return gzip.compress(msgspec.json.encode(_content(town)), compresslevel=6, mtime=0)


def _content(town: Town) -> dict[str, Any]:
    shapes = MapLayers(town, scale=SCALE, border=BORDER).shapes
    named = MapPainter.at_scale(town, LABEL_SCALE, street_names=[LONGEST_NAME] * len(town.streets))
    return {
        "bounds": _decimetres(np.array(town_bounds(town, BORDER))),
        "ground": _hex(palette.COUNTRY),
        "shapes": [[_hex(shape.colour), _decimetres(shape.points)] for shape in shapes],
        "labels": [
            [label.street, round(label.size / LABEL_SCALE, 1), _decimetres(label.path / LABEL_SCALE + named.origin)]
            for label in named.labels
        ],
        "junctions": [_decimetres(np.array(junction.position)) for junction in town.junctions],
    }


def _decimetres(points: np.ndarray[Any, Any]) -> list[int]:
    found: list[int] = np.round(10.0 * np.asarray(points, dtype=float)).astype(int).ravel().tolist()
    return found


def _hex(colour: tuple[int, int, int]) -> str:
    return "#{:02x}{:02x}{:02x}".format(*colour)
