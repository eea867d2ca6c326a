"""Visibility: air, light, and the eye or camera.

A body of a road user's size is seen while its signal is at least that at the edge of sight on a clear day:

    S(d) = (CLEAR_SIGHT / d)^2 * G(d),    G(d) = clarity * exp(-tau(d)) * min(1, sqrt(E(d) / FULL_LIGHT))

- (1 / d)^2: the detection of a small target depends on its area (Ricco's law; Blackwell, J. Opt. Soc. Am. 36, 1946);
- exp(-tau): contrast falls off exponentially with the air's extinction (Koschmieder 1924); the meteorological optical
  range M leaves 5 % of it, so the extinction is ln(20) / M (WMO Guide to Instruments, no. 8, chapter 9);
- sqrt(E): below daylight the threshold contrast rises with the root of the light (Rose, J. Opt. Soc. Am. 38, 1948, and
  de Vries 1943), above it is constant (Weber's law);
- clarity: share that a blurred or covered view leaves.

G is the share of a clear noon's signal, exactly 1 there. S falls with d, and with every one of its causes.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np

from dorothie_gym.ontology.labelled_enums import complete
from dorothie_gym.ontology.world_exceptions import Sensor
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import compiled
from dorothie_gym.support.copying import shared

CLARITY = complete({Sensor.BLUR: 0.25, Sensor.GPS: 1.0, Sensor.VIEW: 0.0}, Sensor, "CLARITY", __name__)
"""Share of the signal of the view that the fault of a sensor leaves: blur halves the sight."""

CLEAR_SIGHT = 80.0
"""Range of perception on a clear day [m]."""

SHORTEST_SIGHT = 16.5
"""Shortest range of perception [m]: that of short-range radar, which neither weather nor darkness hinders; room to
stop from walking pace and to turn round before a roadblock."""

FIVE_PERCENT = pm.log(20.0)
"""Optical depth that leaves 5 % of the contrast."""

FULL_LIGHT = 300.0
"""Illuminance above which more light does not help [lx]: asphalt (reflectance 0.1) then has 10 cd/m^2, about where
Weber's law begins (Blackwell 1946)."""

STREET_LIGHT = 2.0
"""Illuminance of a residential street's lighting [lx] (EN 13201-2, class P6)."""

HEAD_LIGHTS = 2 * 10100.0
"""Luminous intensity of two low beams towards the lane ahead [cd] (UN Regulation 112, class B, points 50R and 75R)."""

DENSEST_FOG = 30.0
"""Meteorological optical range in fog of density 100 % [m]; fog of less than 50 m is the thickest class of the
International Visibility Code."""

FOG_SCALE_HEIGHT = 10.0
"""Height in which fog of falloff 1 thins out to 1 / e [m]: "normal-sized buildings" (CARLA's Python API)."""

EYE_HEIGHT = 1.5
"""Height of the sensors above the road [m]."""

CLOUDBURST = 100.0
"""Rain of precipitation 100 % [mm/h], twice what WMO calls a violent shower."""

_RAIN_RANGE = 2000.0 * 0.3048
"""Sight in rain of 1 inch per hour at 40 mph [m] (Ivey et al. 1975)."""

_RAIN_EXPONENT = 0.68

_CLEAR_SKY = ((-18.0, 6e-4), (-12.0, 8e-3), (-6.0, 3.0), (0.0, 500.0), (45.0, 8e4))
"""Altitude of the sun [degrees] and illuminance under a clear sky [lx] (AMS Glossary of Meteorology, "twilight")."""

_BISECTIONS = 40
"""Halvings of CLEAR_SIGHT: to 1e-10 m."""


def fog_extinction(density: float, falloff: float) -> float:
    """Returns the extinction of fog at the height of the sensors [1/m].

    Args:
        density: above that of a clear noon, in [0, 1].
        falloff: how fast it thins out with height, CARLA's parameter; the density is that at the ground.
    """
    return FIVE_PERCENT / DENSEST_FOG * density * pm.exp(-falloff * EYE_HEIGHT / FOG_SCALE_HEIGHT)


def rain_extinction(rate: float) -> float:
    """Returns the extinction by rain in the air and on the wiped windscreen [1/m].

    Ivey, Lehtipuu and Button (J. Safety Research 7, 1975) measured a sight of 2000 ft / i^0.68 at 40 mph and i in/h.

    Args:
        rate: rate of the rain [mm/h].
    """
    return float(FIVE_PERCENT / _RAIN_RANGE * pm.power(rate / 25.4, _RAIN_EXPONENT))


def daylight(altitude: float, cloudiness: float) -> float:
    """Returns the illuminance by the sky [lx].

    Interpolated in its logarithm; clouds over the share N of the sky leave 1 - 0.75 N^3.4 of it (Kasten and Czeplak,
    Solar Energy 24, 1980).

    Args:
        altitude: altitude of the sun [degrees].
        cloudiness: share of the sky in [0, 1].
    """
    angles, lux = zip(*_CLEAR_SKY, strict=True)
    clear = pm.exp(float(np.interp(altitude, angles, [pm.log(each) for each in lux])))
    return float(clear * (1.0 - 0.75 * pm.power(cloudiness, 3.4)))


@compiled
def transmission(fog: float, fog_start: float, rain: float, distance: float) -> float:
    """Returns the share of the contrast that the air leaves over a distance [m]; the rest as in `Visibility`."""
    return pm.exp(-fog * max(distance - fog_start, 0.0) - rain * distance)


@compiled
def gain(
    fog: float, fog_start: float, rain: float, light: float, lamps: float, clarity: float, distance: float
) -> float:
    """Returns the share G of a clear noon's signal, in [0, 1], at a distance [m]; the rest as in `Visibility`."""
    air = transmission(fog, fog_start, rain, distance)
    if lamps != 0.0 and light < FULL_LIGHT:  # their light passes through the air once more
        near = max(distance, 1.0)
        light += lamps / (near * near) * air
    return clarity * air * min(1.0, math.sqrt(light / FULL_LIGHT))


@compiled
def signal(gain: float, distance: float) -> float:
    """Returns the signal S of a body at a distance [m], 1 at the edge of sight on a clear day, by its gain."""
    nearness = CLEAR_SIGHT / max(distance, 1.0)
    return nearness * nearness * gain


@compiled
def sight_in(fog: float, fog_start: float, rain: float, light: float, lamps: float, clarity: float) -> float:
    """Returns the range within which all bodies are perceived [m], see `Visibility`."""
    if signal(gain(fog, fog_start, rain, light, lamps, clarity, CLEAR_SIGHT), CLEAR_SIGHT) >= 1.0:
        return CLEAR_SIGHT
    near, far = 0.0, CLEAR_SIGHT
    for _ in range(_BISECTIONS):
        middle = (near + far) / 2
        if signal(gain(fog, fog_start, rain, light, lamps, clarity, middle), middle) >= 1.0:
            near = middle
        else:
            far = middle
    return max(near, SHORTEST_SIGHT)


@shared
@dataclass(frozen=True, kw_only=True)
class Visibility:
    """Visibility between an observer and a body.

    Attributes:
        fog: extinction by fog [1/m].
        fog_start: where the fog begins [m].
        rain: extinction by rain [1/m].
        light: illuminance of the scene, without headlights [lx].
        lamps: luminous intensity of the headlights [cd], 0 if they are off.
        clarity: share of the signal that the view itself leaves, in [0, 1].
    """

    fog: float = 0.0
    fog_start: float = 0.0
    rain: float = 0.0
    light: float = math.inf
    lamps: float = 0.0
    clarity: float = 1.0

    def transmission(self, distance: float) -> float:
        """Returns the share of the contrast that the air leaves over a distance [m]."""
        return float(transmission(self.fog, self.fog_start, self.rain, distance))

    def gain(self, distance: float) -> float:
        """Returns the share of a clear noon's signal, in [0, 1], of a body at a distance [m]."""
        return float(gain(self.fog, self.fog_start, self.rain, self.light, self.lamps, self.clarity, distance))

    def signal(self, distance: float) -> float:
        """Returns the signal of a body at a distance [m], 1 at the edge of sight."""
        return float(signal(self.gain(distance), distance))

    @functools.cached_property
    def sight(self) -> float:
        """Range within which all bodies are perceived [m], in [SHORTEST_SIGHT, CLEAR_SIGHT]."""
        return float(sight_in(self.fog, self.fog_start, self.rain, self.light, self.lamps, self.clarity))

    @functools.cached_property
    def is_clear(self) -> bool:
        """Returns whether perception within the sight distance of a clear noon is without loss."""
        return self.gain(CLEAR_SIGHT) >= 1.0
