"""Textures of surfaces: the level of detail by the footprint of a pixel, and samples along its longer side."""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.support.compilation import inlined
from dorothie_gym.support.compilation.records import by_reference

if TYPE_CHECKING:
    from dorothie_gym.pictures.camera.atlas import AtlasArrays

_LANES = 0x00FF00FF00FF00FF  # the four channels of a texel, 16 bits apart


@by_reference
class Textures(NamedTuple):
    """Textures for sampling.

    Attributes:
        texels: (m,) uint32: red in the lowest byte, then green, blue and own light.
        table: see `AtlasArrays`.
    """

    texels: NDArray[np.uint32]
    table: NDArray[np.int32]


def textures_of(atlas: AtlasArrays) -> Textures:
    """Returns the textures of an atlas, without a copy on machines whose lowest byte comes first."""
    texels = np.ascontiguousarray(atlas.texels).view(np.uint32).reshape(-1)
    return Textures(texels if sys.byteorder == "little" else texels.byteswap(), atlas.table)


@inlined
def sample_texture(
    texels: NDArray[np.uint32], first: int, width: int, height: int, last: int, u: float, v: float, du: float,
    dv: float, along: float, across: float,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Returns red, green and blue of a texture, 0..1, and its own light, 0..255.

    Args:
        texels: texels of all textures.
        first: texel of the texture.
        width: [texels].
        height: [texels].
        last: number of halvings of the texture.
        u: coordinate to the right, in repeats.
        v: coordinate upwards.
        du: u component of the longer side of the footprint.
        dv: v component of the longer side of the footprint.
        along: square of the longer side of the footprint [texels^2].
        across: square of the shorter side of the footprint [texels^2].
    """
    size = max(across, 0.25 * along, 1.0)
    is_long = along >= 2.25 * size
    while size >= 2.25 and last > 0:
        first += width * height
        width, height, size, last = width >> 1, height >> 1, 0.25 * size, last - 1
    wide, high = width * 256.0, height * 256.0
    if is_long:
        total = _mixed_texel(texels, first, width, height, (u - 0.25 * du) * wide, (v - 0.25 * dv) * high)
        total += _mixed_texel(texels, first, width, height, (u + 0.25 * du) * wide, (v + 0.25 * dv) * high)
        scale = 0.5
    else:
        total, scale = _mixed_texel(texels, first, width, height, u * wide, v * high), 1.0
    share = scale * (1.0 / 255.0)
    return (
        (total & 0xFFFF) * share,
        ((total >> 32) & 0xFFFF) * share,
        ((total >> 16) & 0xFFFF) * share,
        ((total >> 48) & 0xFFFF) * scale,
    )


@inlined
def _mixed_texel(texels: NDArray[np.uint32], first: int, width: int, height: int, x: float, y: float) -> int:
    """Returns the bilinear mean of four texels at a place [1/256 texel]: red (lowest bits), blue, green, own light."""
    i, j = math.floor(x) + 128, math.floor(y) + 128
    a, b = i & 255, j & 255
    right, above = (i >> 8) & (width - 1), (j >> 8) & (height - 1)
    left, below = (right - 1) & (width - 1), first + ((above - 1) & (height - 1)) * width
    above, both = first + above * width, (a * b) >> 8  # the weights sum up to 256
    mixed = (
        _spread(int(texels[below + left])) * (256 - a - b + both)
        + _spread(int(texels[below + right])) * (a - both)
        + _spread(int(texels[above + left])) * (b - both)
        + _spread(int(texels[above + right])) * both
    )
    return (mixed >> 8) & _LANES


@inlined
def _spread(texel: int) -> int:
    """Returns the four channels of a texel 16 bits apart."""
    return (texel & 0x00FF00FF) | ((texel & 0xFF00FF00) << 24)
