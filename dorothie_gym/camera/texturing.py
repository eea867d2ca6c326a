"""Textures of surfaces: the level of detail by the footprint of a pixel, and samples along its longer side."""

from __future__ import annotations

import math

from dorothie_gym.camera.atlas import AtlasArrays
from dorothie_gym.compilation import compiled, inlined
from dorothie_gym.maps.model import Array

_PROBES = 4
"""Most samples along a footprint."""


@compiled
def sample_texture(
    atlas: AtlasArrays, texture: int, u: float, v: float, du: float, dv: float, across: float, out: Array
) -> None:
    """Writes red, green, blue and own light (4,) of a texture, 0..255.

    Args:
        atlas: textures.
        texture: index.
        u: coordinate to the right, in repeats.
        v: coordinate upwards.
        du: of the longer side of the footprint.
        dv: of the longer side of the footprint.
        across: shorter side of the footprint [texels].
        out: to be written.
    """
    first, width, height = atlas.table[texture, 0], atlas.table[texture, 1], atlas.table[texture, 2]
    along = math.sqrt(du * du * width * width + dv * dv * height * height)
    size = max(across, along / _PROBES, 1.0)
    probes = min(max(int(along / size + 0.5), 1), _PROBES)
    level, last = 0, atlas.table[texture, 3] - 1
    while size >= 1.5 and level < last:
        first += width * height
        width, height, size, level = width >> 1, height >> 1, 0.5 * size, level + 1
    out[0] = out[1] = out[2] = out[3] = 0.0
    for k in range(probes):
        at = (k + 0.5) / probes - 0.5
        _add_texel(atlas, first, width, height, u + at * du, v + at * dv, 1.0 / probes, out)


@inlined
def _add_texel(
    atlas: AtlasArrays, first: int, width: int, height: int, u: float, v: float, weight: float, out: Array
) -> None:
    """Adds the bilinear mean of four texels."""
    x, y = (u - math.floor(u)) * width + 0.5, (v - math.floor(v)) * height + 0.5
    i, j = int(x), int(y)
    a, b = x - i, y - j
    left, right = (i - 1) & (width - 1), i & (width - 1)
    below, above = first + ((j - 1) & (height - 1)) * width, first + (j & (height - 1)) * width
    for k in range(4):
        lower = atlas.texels[below + left, k] * (1.0 - a) + atlas.texels[below + right, k] * a
        upper = atlas.texels[above + left, k] * (1.0 - a) + atlas.texels[above + right, k] * a
        out[k] += weight * (lower * (1.0 - b) + upper * b)
