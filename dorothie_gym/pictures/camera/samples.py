"""Samples of a picture that are shaded together.

Each quantity takes a stretch of one array, all of one length: loops over the samples then become vector instructions,
because the compiler knows that no quantity overlaps another one.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.model import Array
from dorothie_gym.support.compilation import inlined
from dorothie_gym.support.compilation.records import by_reference

ROOM: Final = 192
"""Maximum number of samples that are shaded together: their quantities fit into the processor's nearest cache."""

# entries of a quantity; were it a multiple of 512, quantities would compete for the same lines of the processor's cache
_STRETCH = ROOM + 24

# place in the picture, relative to the camera, and in the world
RIGHT: Final = 0 * _STRETCH
UP: Final = 1 * _STRETCH
DEPTH: Final = 2 * _STRETCH
SLANT: Final = 3 * _STRETCH
X: Final = 4 * _STRETCH
Y: Final = 5 * _STRETCH
Z: Final = 6 * _STRETCH
WEIGHT: Final = 7 * _STRETCH
# colour and surface
RED: Final = 8 * _STRETCH
GREEN: Final = 9 * _STRETCH
BLUE: Final = 10 * _STRETCH
OWN: Final = 11 * _STRETCH
BRIGHT: Final = 12 * _STRETCH
AMBIENT: Final = 13 * _STRETCH
SUN: Final = 14 * _STRETCH
BIAS: Final = 15 * _STRETCH
LAMP: Final = 16 * _STRETCH
# intermediate results, of which each stage has its own
ONE: Final = 17 * _STRETCH
TWO: Final = 18 * _STRETCH
THREE: Final = 19 * _STRETCH
FOUR: Final = 20 * _STRETCH
FIVE: Final = 21 * _STRETCH
SIX: Final = 22 * _STRETCH
_QUANTITIES = 23

FIRST: Final = 0 * _STRETCH
SECOND: Final = 1 * _STRETCH
THIRD: Final = 2 * _STRETCH
_INDICES = 3

_FEW = 3  # samples that are computed one by one


@by_reference
class Samples(NamedTuple):
    """Samples to be shaded, in the order of their pixels.

    Attributes:
        values: quantities, each from the entry on that has its name:
            RIGHT, UP: place in the picture per metre of depth.
            DEPTH: along the axis of the camera [m], 0 for the sky.
            SLANT: cosine between the normal and the direction to the camera, times the length of (RIGHT, UP, 1).
            X, Y, Z: position [m].
            WEIGHT: share of its pixel.
            RED, GREEN, BLUE: 0..255 before and after the light has been added.
            OWN: light of a texture, 0..255.
            BRIGHT: 1 for surfaces that emit their own colour, 0 otherwise.
            AMBIENT: share of the light of the sky.
            SUN: cosine to the sun, negative for surfaces that face away.
            BIAS: minimum height of a body above the sample for a shadow on it [m].
            LAMP: share of the light of street lamps.
        indices: whole numbers, intermediate results.
        surfaces: (ROOM,) `Surface` of each sample.
        parts: (ROOM,) number of samples of a pixel, at the first of them.
    """

    values: Array
    indices: NDArray[np.int64]
    surfaces: NDArray[np.uint8]
    parts: NDArray[np.uint8]


@inlined
def whole_vectors(count: int) -> int:
    """Returns the number of samples of whole vectors of the processor.

    Values written after the last sample are overwritten by the next samples, or not read.
    """
    return count if count < _FEW else (count + 3) // 4 * 4


def new_samples() -> Samples:
    """Returns room for samples."""
    return Samples(
        np.zeros(_QUANTITIES * _STRETCH),
        np.zeros(_INDICES * _STRETCH, np.int64),
        np.zeros(ROOM, np.uint8),
        np.zeros(ROOM, np.uint8),
    )
