"""Artificial light, wet surfaces and the air between them and the camera."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.model import Array
from dorothie_gym.sim.sensing.visibility import transmission
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import concurrent, inlined
from dorothie_gym.support.compilation.records import by_reference
from dorothie_gym.support.copying import shared

if TYPE_CHECKING:
    from dorothie_gym.pictures.camera.optics import Optics

LAMP_REACH = 20.0
"""Distance from a lamp's foot up to which its light is drawn [m]."""

WARM = (1.05, 0.95, 0.78)
"""Colour of lamps."""

HAZE_START = 100.0
"""Depth from which even clear air veils [m]; nearer, the simulator's perception has none."""

_HAZE = 1.2e-3  # extinction beyond [1/m]
_SQUARE = 1.0  # [m] width of a square of a map of lamps
_POOL = 0.75  # factor of the light below a lamp
_BEAM = 1.5  # factor of headlights at their brightest


@by_reference
@shared
class LampMap(NamedTuple):
    """Light of street lamps on the ground.

    Attributes:
        origin: (2,) position of the first corner [m].
        light: (h, w) uint8 share of the brightest, 0..255, of squares of 1 m.
    """

    origin: Array
    light: NDArray[np.uint8]


def lamp_map(lamps: Array) -> LampMap:
    """Returns the light of lamps on the ground.

    Args:
        lamps: (n, 3) position on the ground and height above it [m].
    """
    if not len(lamps):
        return LampMap(np.zeros(2), np.zeros((2, 2), np.uint8))
    low = np.floor(lamps[:, :2].min(axis=0) - LAMP_REACH - 2.0)
    columns, rows = (np.ceil(lamps[:, :2].max(axis=0) + LAMP_REACH + 2.0) - low).astype(int)
    total = np.zeros((rows, columns), np.float32)
    reach = int(LAMP_REACH)
    steps = np.arange(-reach, reach + 1)
    for x, y, height in lamps:
        column, row = int(x - low[0]), int(y - low[1])
        dx, dy = column + steps + 0.5 - (x - low[0]), row + steps + 0.5 - (y - low[1])
        away = dx[None, :] ** 2 + dy[:, None] ** 2
        near = height * height / (height * height + away)
        share = near * np.sqrt(near)  # inverse square, and the slant of the rays
        share *= np.clip(1.5 - 1.5 * away / LAMP_REACH**2, 0.0, 1.0)
        total[row - reach : row + reach + 1, column - reach : column + reach + 1] += share.astype(np.float32)
    return LampMap(low, np.clip(np.rint(total * 255.0), 0, 255).astype(np.uint8))


@inlined
def lamp_light(lamps: LampMap, x: float, y: float) -> float:
    """Returns the factor of the light of street lamps at a position [m]."""
    u, v = (x - lamps.origin[0]) / _SQUARE - 0.5, (y - lamps.origin[1]) / _SQUARE - 0.5
    rows, columns = lamps.light.shape
    if u < 0.0 or v < 0.0 or u >= columns - 1 or v >= rows - 1:
        return 0.0
    i, j = int(u), int(v)
    a, b = u - i, v - j
    upper = lamps.light[j, i] * (1.0 - a) + lamps.light[j, i + 1] * a
    lower = lamps.light[j + 1, i] * (1.0 - a) + lamps.light[j + 1, i + 1] * a
    return float(upper * (1.0 - b) + lower * b) * (_POOL / 255.0)


@inlined
def head_light(optics: Optics, x: float, y: float, z: float, slant: float) -> float:
    """Returns the factor of the light of the car's headlights.

    Args:
        optics: strength of the headlights, and the camera on the car.
        x: x coordinate of the surface relative to the camera [m].
        y: y coordinate of the surface relative to the camera [m].
        z: z coordinate of the surface relative to the camera [m].
        slant: cosine between the surface's normal and the direction to the camera.
    """
    ahead = x * optics.car_x + y * optics.car_y
    aside = abs(y * optics.car_x - x * optics.car_y)
    if ahead < 1.0:
        return 0.0
    cone = max(0.0, 1.0 - aside / (1.6 + 0.38 * ahead))
    above = min(1.0, max(0.0, 1.0 - (z - optics.rise * ahead - 0.15) / (0.6 + 0.03 * ahead)))  # low beam
    return float(optics.head_lights * cone * above * _BEAM * 260.0 / (ahead * ahead + 260.0) * (0.35 + 0.65 * slant))


@inlined
def mirrored_share(wetness: float, slant: float) -> float:
    """Returns the share of the sky in the colour of a wet surface (Schlick's approximation)."""
    rest = 1.0 - slant
    return min(0.85, (0.03 + 0.75 * rest * rest * rest * rest * rest) * wetness)


@inlined
def clearness(optics: Optics, depth: float, right: float, up: float) -> float:
    """Returns the share of a surface's colour that the air leaves at a depth [m] in a direction (right, up, 1)."""
    clear = 1.0
    if optics.fog > 0.0 or optics.rain > 0.0:
        distance = depth * math.sqrt(1.0 + right * right + up * up)
        clear = transmission(optics.fog, optics.fog_start, optics.rain, distance)
    if depth > HAZE_START:
        clear *= pm.exp(-_HAZE * (depth - HAZE_START))
    return clear


@concurrent
def add_rain(picture: NDArray[np.uint8], rainfall: float, frame: int) -> None:
    """Draws streaks of rain.

    Args:
        picture: (h, w, 3).
        rainfall: in [0, 1].
        frame: number that determines their places.
    """
    height, width, _ = picture.shape
    state = np.uint64(frame * 2654435761 + 88172645463325252)
    for _ in range(int(width * height / 500 * rainfall)):
        state ^= state << np.uint64(13)
        state ^= state >> np.uint64(7)
        state ^= state << np.uint64(17)
        x = float((state >> np.uint64(8)) & np.uint64(0xFFFF)) / 65536.0 * width
        y = float((state >> np.uint64(24)) & np.uint64(0xFFFF)) / 65536.0 * height
        near = float((state >> np.uint64(40)) & np.uint64(0xFF)) / 255.0
        share = 0.10 + 0.14 * near
        for k in range(int((0.02 + 0.05 * near) * height) + 1):
            column, row = int(x - 0.16 * k), int(y) + k
            if 0 <= column < width and row < height:
                for j in range(3):
                    old = float(picture[row, column, j])
                    picture[row, column, j] = int(old + (0.35 * old + 120.0 - old) * share)
