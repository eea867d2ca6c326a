"""Level of the noise inside the car, of road, airflow, rain and other talk, and the signal-to-noise ratio of speech.

Levels follow published laws of growth; their reference points, like those of rain and talk, are set by hand to ordinary
values of a passenger car.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from dorothie_gym.ontology.world_exceptions import WeatherParameter
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.copying import shared

if TYPE_CHECKING:
    from dorothie_gym.sim.world import World

_IDLE: Final = 42.0
"""Level of a car with a running engine at a standstill [dB(A)]."""

_ROAD: Final = (57.0, 50.0 / 3.6, 30.0)
"""Level of tyres and drive train [dB(A)] at a speed [m/s], and its growth by a factor of ten of speed [dB]: tyre noise
grows with 30 log10 of speed, the usual regression (Sandberg and Ejsmont, Tyre/Road Noise Reference Book, 2002)."""

_AIR: Final = (62.0, 100.0 / 3.6, 60.0)
"""Likewise of the airflow: sound of forces on bodies grows with the sixth power of velocity (Curle, Proceedings of the
Royal Society A 231, 1955)."""

_STRONGEST_WIND: Final = 15.0
"""Velocity of the wind at 100 percent [m/s], a gale's beginning."""

_RAIN: Final = 60.0
"""Level of the heaviest rain on the roof [dB(A)]; half the rain is 3 dB less."""

_TALK: Final = 56.0
"""Level of one other talker at the back of the car, away from the microphone [dB(A)]."""

_SPEECH: Final = 65.0
"""Level of speech of normal effort at half a metre from the lips [dB]: 62.35 dB at a metre by ANSI S3.5-1997, which
would be 68 dB in a free field; less for the usual position of the microphone beside the speaker."""

_LOMBARD: Final = (45.0, 0.6)
"""Level of noise [dB(A)] from which speakers raise their voices, and by how much for each further dB (Pearsons, Bennett
and Fidell, Speech Levels in Various Noise Environments, EPA-600/1-77-025, 1977)."""


@shared
@dataclass(frozen=True, kw_only=True)
class CabinState:
    """State of the world that makes noise in the car.

    Attributes:
        speed: speed of the car [m/s], not negative.
        rain: rain [percent], 0 to 100.
        wind: wind [percent], 0 to 100.
        talkers: number of other people who talk, not negative.

    Raises:
        ValueError: a field is out of its range.
    """

    speed: float = 0.0
    rain: float = 0.0
    wind: float = 0.0
    talkers: int = 0

    def __post_init__(self) -> None:
        if not 0.0 <= self.speed < 200.0:
            raise ValueError(f"CabinState.speed is {self.speed}; it must be in 0..200 m/s")
        for name, value in (("rain", self.rain), ("wind", self.wind)):
            if not 0.0 <= value <= 100.0:
                raise ValueError(f"CabinState.{name} is {value}; it must be in 0..100 percent")
        if not 0 <= self.talkers <= 100:
            raise ValueError(f"CabinState.talkers is {self.talkers}; it must be in 0..100")


def cabin_of(world: World) -> CabinState:
    """Returns what makes noise in the car of a world now."""
    weather = world.weather.values
    return CabinState(
        speed=abs(float(world.car.speed)),
        rain=weather[WeatherParameter.PRECIPITATION],
        wind=weather[WeatherParameter.WIND_INTENSITY],
    )


def noise_levels(state: CabinState) -> dict[str, float]:
    """Returns the levels of the sources that sound [dB(A)], by name: "idle", "road", "air", "rain", "talk"."""
    found = {"idle": _IDLE}
    airflow = state.speed + _STRONGEST_WIND * state.wind / 100.0
    for name, velocity, (level, reference, growth) in (("road", state.speed, _ROAD), ("air", airflow, _AIR)):
        if velocity > 1.0:
            found[name] = level + growth * pm.log10(velocity / reference)
    if state.rain > 0.0:
        found["rain"] = _RAIN + 10.0 * pm.log10(state.rain / 100.0)
    if state.talkers:
        found["talk"] = _TALK + 10.0 * pm.log10(state.talkers)
    return found


def noise_level(state: CabinState) -> float:
    """Returns the level of all noise together [dB(A)]."""
    return 10.0 * pm.log10(sum(pm.power(10.0, level / 10.0) for level in noise_levels(state).values()))


def signal_to_noise(state: CabinState) -> float:
    """Returns the ratio of speech to noise at the microphone [dB], both A-weighted; speakers raise their voices."""
    noise = noise_level(state)
    threshold, slope = _LOMBARD
    return _SPEECH + slope * max(noise - threshold, 0.0) - noise
