"""Light that falls on samples of a picture, and the air between them and the camera."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dorothie_gym.pictures.camera.head_lights import HeadLights, beam_light
from dorothie_gym.pictures.camera.lighting import (
    HAZE_START,
    WARM,
    LampMap,
    clearness,
    head_light,
    lamp_light,
    mirrored_share,
)
from dorothie_gym.pictures.camera.mesh import Surface
from dorothie_gym.pictures.camera.optics import Optics, ray
from dorothie_gym.pictures.camera.samples import (
    AMBIENT,
    BIAS,
    BLUE,
    BRIGHT,
    DEPTH,
    FIRST,
    FIVE,
    FOUR,
    GREEN,
    LAMP,
    ONE,
    OWN,
    RED,
    RIGHT,
    SECOND,
    SLANT,
    SUN,
    THREE,
    TWO,
    UP,
    Samples,
    X,
    Y,
    Z,
)
from dorothie_gym.pictures.camera.shadows import REACH, STEPS, TEXEL, ShadowMaps, sunlit
from dorothie_gym.support.compilation import compiled, inlined

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array

_GROUND, _GLASS, _EMISSIVE = int(Surface.GROUND), int(Surface.GLASS), int(Surface.EMISSIVE)
_GLOW = (0.8, 0.69, 0.5)  # factors of the light of lit windows


@compiled
def light_samples(
    optics: Optics, lamps: LampMap, beams: HeadLights, shadows: ShadowMaps, samples: Samples, count: int
) -> None:
    """Converts the colours of surfaces to those in the picture, 0..255.

    Args:
        optics: numbers of the picture.
        lamps: light of street lamps.
        beams: light of the headlights of other vehicles, that was drawn for the picture.
        shadows: maps that were drawn for the picture.
        samples: colours, places and surfaces.
        count: number of the samples.
    """
    values = samples.values
    _find_shadows(optics, shadows, samples, count)
    if optics.lamps > 0.0 or optics.head_lights > 0.0 or optics.beams > 0.0:
        _find_lamps(optics, lamps, beams, samples, count)
    else:
        for k in range(count):
            values[TWO + k] = 0.0
    _multiply(optics, values, count)
    if optics.wetness > 0.0:
        _wet(optics, samples, count)
    _mirror(optics, samples, count)
    _find_clearness(optics, values, count)
    red, green, blue = optics.air_r, optics.air_g, optics.air_b
    for k in range(count):
        clear = values[ONE + k]
        values[RED + k] = min(red + (values[RED + k] - red) * clear, 255.0)
        values[GREEN + k] = min(green + (values[GREEN + k] - green) * clear, 255.0)
        values[BLUE + k] = min(blue + (values[BLUE + k] - blue) * clear, 255.0)


@inlined
def _find_shadows(optics: Optics, shadows: ShadowMaps, samples: Samples, count: int) -> None:
    """Writes positions, and to ONE the share of the sun's light."""
    values, places = samples.values, samples.indices
    for k in range(count):
        right, up, depth = values[RIGHT + k], values[UP + k], values[DEPTH + k]
        dx, dy, dz = ray(optics, right, up)
        x, y, z = optics.x + depth * dx, optics.y + depth * dy, optics.z + depth * dz
        values[X + k], values[Y + k], values[Z + k], values[ONE + k] = x, y, z, 1.0
        across = (x - optics.slope_x * z) * (1.0 / TEXEL) - 0.5
        down = (y - optics.slope_y * z) * (1.0 / TEXEL) - 0.5
        column, row = math.floor(across), math.floor(down)
        places[FIRST + k], places[SECOND + k] = column, row
        values[THREE + k], values[FOUR + k] = across - column, down - row
        values[FIVE + k] = (z + values[BIAS + k]) * STEPS
    if optics.shadows:
        town, bodies = shadows.town, shadows.bodies
        for k in range(count):
            if values[SUN + k] > 0.0 and values[DEPTH + k] < REACH:
                values[ONE + k] = sunlit(
                    town, bodies, optics.town_x, optics.town_y, optics.bodies_x, optics.bodies_y, places[FIRST + k],
                    places[SECOND + k], values[THREE + k], values[FOUR + k], values[FIVE + k],
                )  # fmt: skip


@inlined
def _find_lamps(optics: Optics, lamps: LampMap, beams: HeadLights, samples: Samples, count: int) -> None:
    """Writes the factor of the light of lamps to TWO."""
    values = samples.values
    for k in range(count):
        lamp = 0.0
        if values[BRIGHT + k] == 0.0:
            x, y, z = values[X + k], values[Y + k], values[Z + k]
            if optics.head_lights > 0.0:
                slant = _slant(values, k)
                lamp = head_light(optics, x - optics.x, y - optics.y, z - optics.z, slant)
            if optics.lamps > 0.0:
                lamp += lamp_light(lamps, x, y) * optics.lamps * values[LAMP + k]
            if optics.beams > 0.0:
                lamp += beam_light(beams, x, y, z) * optics.beams
        values[TWO + k] = lamp


@inlined
def _slant(values: Array, k: int) -> float:
    """Returns the cosine between the normal of a sample and the direction to the camera."""
    right, up = values[RIGHT + k], values[UP + k]
    return float(values[SLANT + k] / math.sqrt(1.0 + right * right + up * up))


@inlined
def _multiply(optics: Optics, values: Array, count: int) -> None:
    """Multiplies colours with the light, and adds that of textures."""
    lamps = optics.lamps
    for k in range(count):
        ambient, lamp, bright, glow = values[AMBIENT + k], values[TWO + k], values[BRIGHT + k], values[OWN + k] * lamps
        share = values[ONE + k]
        share += (1.0 - share) * min(1.0, max(0.0, values[DEPTH + k] * (4.0 / REACH) - 3.0))  # distant shadows fade
        lit = max(values[SUN + k], 0.0) * share
        values[RED + k] = (
            values[RED + k] * (optics.sky_r * ambient + optics.sun_r * lit + lamp * WARM[0] + bright) + glow * _GLOW[0]
        )
        values[GREEN + k] = (
            values[GREEN + k] * (optics.sky_g * ambient + optics.sun_g * lit + lamp * WARM[1] + bright)
            + glow * _GLOW[1]
        )
        values[BLUE + k] = (
            values[BLUE + k] * (optics.sky_b * ambient + optics.sun_b * lit + lamp * WARM[2] + bright) + glow * _GLOW[2]
        )


@inlined
def _wet(optics: Optics, samples: Samples, count: int) -> None:
    """Darkens wet ground, and adds its reflection of the horizon."""
    values = samples.values
    for k in range(count):
        if samples.surfaces[k] & _GROUND:
            share = mirrored_share(optics.wetness, _slant(values, k))
            dark = (1.0 - 0.42 * optics.wetness) * (1.0 - share)
            values[RED + k] = values[RED + k] * dark + optics.horizon_r * share
            values[GREEN + k] = values[GREEN + k] * dark + optics.horizon_g * share
            values[BLUE + k] = values[BLUE + k] * dark + optics.horizon_b * share


@inlined
def _mirror(optics: Optics, samples: Samples, count: int) -> None:
    """Adds reflections in glass: the sky and the street."""
    values = samples.values
    for k in range(count):
        if samples.surfaces[k] & (_GLASS | _EMISSIVE) == _GLASS:
            depth, slant = values[DEPTH + k], _slant(values, k)
            rest, rise = 1.0 - slant, (values[AMBIENT + k] - 0.78) * (1.0 / 0.22)
            share = 0.12 + 0.6 * rest * rest * rest
            sky = min(1.0, max(0.0, 0.5 + 2.0 * ((values[Z + k] - optics.z) / max(depth, 1e-6) + 2.0 * slant * rise)))
            street = 70.0 * (1.0 - sky)
            values[RED + k] += (optics.horizon_r * sky + optics.sky_r * street - values[RED + k]) * share
            values[GREEN + k] += (optics.horizon_g * sky + optics.sky_g * street - values[GREEN + k]) * share
            values[BLUE + k] += (optics.horizon_b * sky + optics.sky_b * street - values[BLUE + k]) * share


@inlined
def _find_clearness(optics: Optics, values: Array, count: int) -> None:
    """Writes the share of colours that the air leaves to ONE."""
    for k in range(count):
        values[ONE + k] = 1.0
    if optics.fog > 0.0 or optics.rain > 0.0:
        for k in range(count):
            values[ONE + k] = clearness(optics, values[DEPTH + k], values[RIGHT + k], values[UP + k])
    else:
        for k in range(count):
            if values[DEPTH + k] > HAZE_START:
                values[ONE + k] = clearness(optics, values[DEPTH + k], values[RIGHT + k], values[UP + k])
