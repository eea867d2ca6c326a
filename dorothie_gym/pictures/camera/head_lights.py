"""Light of the headlights of other vehicles on the road and the objects in front of them.

For each picture in the dark, the beams are drawn from above into a map of squares of 1 m, with the height of the road.
Buildings and vehicles do not stop a beam: it reaches few metres.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.pictures.camera.models.model_bank import FIRST_CYCLIST, LAMP_STATES, PlacementRecord
from dorothie_gym.pictures.camera.models.vehicles import Lamps
from dorothie_gym.sim.traffic.parameters import CAR_LENGTH
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import concurrent, inlined
from dorothie_gym.support.compilation.records import RecordArray, by_reference

SQUARES = 128
"""Squares along each side of the map."""

_AHEAD = 50.0  # [m] from the camera to the centre of the map
_FADING, _FARTHEST = 60.0, 90.0  # [m] from the camera over which beams fade
_REACH = 26.0  # [m] from the front of a vehicle
_NARROW, _SPREAD = 1.1, 0.34  # [m] half the width of a beam at the front, and its growth per metre
_MARGIN = 1.5  # [m] around beams in which the height of the road is also stored
_SOFT = 4.0  # [m] over which a beam meets the road
_SQUARED = 180.0  # [m2] distance at which it is half as bright, squared
_BRIGHTEST = 1.2  # factor of the light
_FULL, _NONE = 0.7, 1.3  # [m] above the road up to which a beam is bright, and where it ends
_BELOW = -1.0  # [m]; lower surfaces lie under the road
_FRONT, _LIGHTS = 0.5 * CAR_LENGTH, int(Lamps.LIGHTS)


@by_reference
class HeadLights(NamedTuple):
    """Map of the light of headlights.

    Attributes:
        corner: (2,) x and y of the first square [m], whole numbers.
        light: (h, w) uint8 share of the brightest, 0..255.
        height: (h, w) float32 of the road [m], near light.
    """

    corner: NDArray[np.int64]
    light: NDArray[np.uint8]
    height: NDArray[np.float32]


def new_head_lights() -> HeadLights:
    """Returns a dark map."""
    shape = SQUARES, SQUARES
    return HeadLights(np.zeros(2, np.int64), np.zeros(shape, np.uint8), np.zeros(shape, np.float32))


@concurrent
def draw_head_lights(
    lights: HeadLights, x: float, y: float, heading: float, bodies: RecordArray[PlacementRecord]
) -> None:
    """Draws the beams of all vehicles in front of a camera that have their lights on.

    Args:
        lights: receives the beams.
        x: x coordinate of the camera [m].
        y: y coordinate of the camera [m].
        heading: heading of the camera [rad].
        bodies: models and places.
    """
    middle_x, middle_y = x + _AHEAD * pm.cos(heading), y + _AHEAD * pm.sin(heading)
    lights.corner[0], lights.corner[1] = math.floor(middle_x) - SQUARES // 2, math.floor(middle_y) - SQUARES // 2
    lights.light[:] = 0
    for k in range(len(bodies)):
        body = bodies[k]
        if body.model < FIRST_CYCLIST and body.model % LAMP_STATES & _LIGHTS:
            away = math.sqrt((body.x - x) ** 2 + (body.y - y) ** 2)
            if away < _FARTHEST:
                _add_beam(lights, body, min(1.0, (_FARTHEST - away) / (_FARTHEST - _FADING)))


@inlined
def _add_beam(lights: HeadLights, body: PlacementRecord, strength: float) -> None:
    """Adds the beam of a vehicle."""
    c, s, light, height = body.cos, body.sin, lights.light, lights.height
    x, y = body.x + _FRONT * c - lights.corner[0] - 0.5, body.y + _FRONT * s - lights.corner[1] - 0.5
    side = _NARROW + _SPREAD * _REACH
    reach_x, reach_y = abs(side * s) + _MARGIN, abs(side * c) + _MARGIN
    left, right = math.floor(x + min(0.0, _REACH * c) - reach_x), math.ceil(x + max(0.0, _REACH * c) + reach_x)
    top, bottom = math.floor(y + min(0.0, _REACH * s) - reach_y), math.ceil(y + max(0.0, _REACH * s) + reach_y)
    for j in range(max(top, 0), min(bottom + 1, SQUARES)):
        for i in range(max(left, 0), min(right + 1, SQUARES)):
            ahead, aside = (i - x) * c + (j - y) * s, abs((j - y) * c - (i - x) * s)
            wide = _NARROW + _SPREAD * max(ahead, 0.0)
            if ahead > -_MARGIN and ahead < _REACH + _MARGIN and aside < wide + _MARGIN:
                cone = max(0.0, 1.0 - aside / wide) * min(1.0, max(0.0, ahead / _SOFT))
                end = min(1.0, max(0.0, (_REACH - ahead) * (2.0 / _REACH)))
                share = strength * cone * end * _SQUARED / (_SQUARED + ahead * ahead)
                old = light[j, i]
                if share * 255.0 >= old:
                    height[j, i] = body.z + body.rise * (ahead + _FRONT)
                light[j, i] = int(min(255.0, old + share * 255.0))


@inlined
def beam_light(lights: HeadLights, x: float, y: float, z: float) -> float:
    """Returns the factor of the light of headlights at a position [m]."""
    u, v = x - lights.corner[0] - 0.5, y - lights.corner[1] - 0.5
    i, j = math.floor(u), math.floor(v)
    if i < 0 or j < 0 or i >= SQUARES - 1 or j >= SQUARES - 1:
        return 0.0
    light = lights.light
    one, two, three, four = light[j, i], light[j, i + 1], light[j + 1, i], light[j + 1, i + 1]
    if (one | two | three | four) == 0:
        return 0.0
    a, b = u - i, v - j
    above = z - lights.height[j + (b > 0.5), i + (a > 0.5)]
    if above < _BELOW:
        return 0.0
    total = (one * (1.0 - a) + two * a) * (1.0 - b) + (three * (1.0 - a) + four * a) * b
    return float(total * min(1.0, max(0.0, (_NONE - above) / (_NONE - _FULL))) * (_BRIGHTEST / 255.0))
