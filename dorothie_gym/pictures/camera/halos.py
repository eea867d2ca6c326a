"""Halos of traffic lights: the least size of a lit lens in a picture, and the glow around it.

A lens of 0.2 m is smaller than a pixel where a picture is small or the light is far away. A camera still shows its
colour, because its optics and its sensor spread bright light over a few pixels. Depth, classes and instances are those
of the lens alone.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.model import Array
from dorothie_gym.pictures.camera.lighting import clearness
from dorothie_gym.pictures.camera.rasterizer import NEAR
from dorothie_gym.support.compilation import compiled, concurrent, inlined
from dorothie_gym.support.compilation.records import by_reference

if TYPE_CHECKING:
    from dorothie_gym.pictures.camera.optics import Optics
    from dorothie_gym.pictures.camera.pose import View
    from dorothie_gym.pictures.camera.rasterizer import VisibilityBuffer

_LEAST = 1.6  # [pixels] radius of a lit lens in a picture, at least
_NATURAL = 1.5  # times `_LEAST`: radius from which a lens is drawn by its triangles alone
_KEPT, _FARTHEST = 70.0, 140.0  # [m] distances between which the least size fades
_GLOW = 2.2  # radius of the glow relative to that of the lens
_BY_DAY, _BY_NIGHT = 0.22, 0.5  # strength of the glow at the rim of the lens
_HOOD = 0.6  # [m] in front of a lens: what is nearer hides it
_FACING = 0.2  # least cosine between a lens and the direction to the camera
_TRIED = 0.6  # radius, relative to that of the lens, of the places at which it may be hidden


@by_reference
class Halos(NamedTuple):
    """Lenses of traffic lights that may be lit.

    Attributes:
        centres: (n, 3) positions [m].
        looks: (n, 3) unit vectors from the lenses to those who see them.
        radii: (n,) [m].
        colours: (n, 3) of lit lenses, 0..255.
        lit: (n,) whether a lens is lit.
        depths: (n,) scratch: depths of the lenses in view [m].
        found: (n,) scratch: their numbers.
    """

    centres: Array
    looks: Array
    radii: Array
    colours: Array
    lit: NDArray[np.bool_]
    depths: Array
    found: NDArray[np.int64]


def no_halos(count: int = 0) -> Halos:
    """Returns lenses that are not lit."""
    return Halos(
        np.zeros((count, 3)),
        np.zeros((count, 3)),
        np.zeros(count),
        np.zeros((count, 3)),
        np.zeros(count, np.bool_),
        np.zeros(count),
        np.zeros(count, np.int64),
    )


@concurrent
def add_halos(
    view: View, optics: Optics, buffer: VisibilityBuffer, side: int, halos: Halos, picture: NDArray[np.uint8]
) -> None:
    """Draws the halos of all lit lenses in view, the farthest first.

    Args:
        view: projection of the picture.
        optics: numbers of the picture.
        buffer: nearest surfaces, with `side` x `side` samples in a pixel.
        side: 1 or 2.
        halos: lenses.
        picture: (h, w, 3).
    """
    depths, found, count = halos.depths, halos.found, 0
    for k in range(len(halos.lit)):
        if halos.lit[k]:
            depth = _depth(view, halos, k)
            if depth > 0.0:
                depths[count], found[count] = depth, k
                count += 1
    for done in range(count):
        farthest = done
        for k in range(done + 1, count):
            if depths[k] > depths[farthest]:
                farthest = k
        depth, lens = depths[farthest], found[farthest]
        depths[farthest], found[farthest] = depths[done], found[done]
        _add_halo(view, optics, buffer, side, halos, lens, depth, picture)


@inlined
def _depth(view: View, halos: Halos, k: int) -> float:
    """Returns the depth of a lens [m], 0 if it is out of the picture, too far away, or seen from behind."""
    axes = view.axes
    x, y = halos.centres[k, 0] - view.origin[0], halos.centres[k, 1] - view.origin[1]
    if x * x + y * y > _FARTHEST * _FARTHEST:
        return 0.0
    z = halos.centres[k, 2] - view.origin[2]
    depth = x * axes[2, 0] + y * axes[2, 1] + z * axes[2, 2]
    across = abs(x * axes[0, 0] + y * axes[0, 1] + z * axes[0, 2]) * view.focal
    if depth < 1.0 or across > (0.5 * view.width + 8.0) * depth:
        return 0.0
    toward = x * halos.looks[k, 0] + y * halos.looks[k, 1] + z * halos.looks[k, 2]
    return depth if toward < -_FACING * math.sqrt(x * x + y * y + z * z) else 0.0


@compiled
def _add_halo(
    view: View,
    optics: Optics,
    buffer: VisibilityBuffer,
    side: int,
    halos: Halos,
    k: int,
    depth: float,
    picture: NDArray[np.uint8],
) -> None:
    """Draws the halo of one lens as far as it is visible."""
    x, y, z = (
        halos.centres[k, 0] - view.origin[0],
        halos.centres[k, 1] - view.origin[1],
        halos.centres[k, 2] - view.origin[2],
    )
    axes, scale = view.axes, view.focal / depth
    right, up = x * axes[0, 0] + y * axes[0, 1] + z * axes[0, 2], x * axes[1, 0] + y * axes[1, 1] + z * axes[1, 2]
    across, down = 0.5 * view.width + right * scale, 0.5 * view.height - up * scale
    natural = halos.radii[k] * scale
    seen = _visible_share(buffer, side, across, down, _TRIED * natural, 1.0 / max(depth - _HOOD, NEAR))
    if seen == 0.0:
        return
    seen *= clearness(optics, depth, right / depth, up / depth)
    kept = min(1.0, max(0.0, (_FARTHEST - depth) / (_FARTHEST - _KEPT)))
    radius = max(natural, _LEAST)
    core = seen * kept * min(1.0, max(0.0, (_NATURAL * _LEAST - natural) / ((_NATURAL - 1.0) * _LEAST)))
    glow = seen * kept * (_BY_DAY + (_BY_NIGHT - _BY_DAY) * optics.lamps)
    reach = _GLOW * radius
    height, width, _ = picture.shape
    for row in range(max(0, math.floor(down - reach)), min(height, math.ceil(down + reach) + 1)):
        for column in range(max(0, math.floor(across - reach)), min(width, math.ceil(across + reach) + 1)):
            dx, dy = column + 0.5 - across, row + 0.5 - down
            away = math.sqrt(dx * dx + dy * dy)
            share = core * min(1.0, max(0.0, radius + 0.5 - away))
            rest = min(1.0, max(0.0, (reach - away) / (reach - radius)))
            shine = glow * rest * rest * (1.0 - share)
            for j in range(3):
                old, colour = float(picture[row, column, j]), halos.colours[k, j]
                new = old + (colour - old) * share + colour * shine
                picture[row, column, j] = int(min(255.0, new) + 0.5)


@inlined
def _visible_share(
    buffer: VisibilityBuffer, side: int, across: float, down: float, step: float, nearness: float
) -> float:
    """Returns the share of five places in a lens that nothing nearer hides; places out of the picture are hidden."""
    rows, columns = buffer.nearness.shape
    seen = 0
    for place in range(5):
        x, y = across, down
        if place == 1:
            x -= step
        elif place == 2:
            x += step
        elif place == 3:
            y -= step
        elif place == 4:
            y += step
        column, row = math.floor(x * side), math.floor(y * side)
        if column >= 0 and row >= 0 and column < columns and row < rows and buffer.nearness[row, column] <= nearness:
            seen += 1
    return seen * 0.2
