"""Parts of a session that other packages provide: pictures, perception by pictures, spoken words, noise of the cabin.

A session knows the interfaces of these parts, not their implementations: it imports neither the camera nor speech. If a
    configuration requests a part, its class is found by name, as Gymnasium finds environments by the entry points of
    their registration.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Protocol

import numpy as np
from gymnasium import spaces

from dorothie_gym.dialogue.conversation import Utterance
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.world_exceptions import WeatherParameter
from dorothie_gym.session.config import CameraConfig, CameraOutput
from dorothie_gym.session.spaces.observations import Observation
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.copying import shared

if TYPE_CHECKING:
    from dorothie_gym.pictures.camera.first_person_camera import CameraFrame
    from dorothie_gym.session.scenario import Scenario
    from dorothie_gym.sim.world import World
    from dorothie_gym.support.audio import Samples

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


PICTURES: Final = "dorothie_gym.pictures.camera.session_pictures:SessionPictures"
"""Entry point of the class that draws `Pictures`."""

PERCEPTION: Final = "dorothie_gym.pictures.camera.camera_perception:CameraPerception"
"""Entry point of the `VisiblePerception`."""

SPEECH: Final = "dorothie_gym.speech.spoken_dialogue:SpokenDialogue"
"""Entry point of the `SpokenChannel`."""


class Pictures(Protocol):
    """Pictures of the camera on the car of a session (`camera.session_pictures`)."""

    def frame(self, decision: int) -> CameraFrame:
        """Returns the picture at the present decision, of this number."""

    def add_to(self, observations: Mapping[str, Observation], decision: int) -> None:
        """Adds the pictures of the present decision to the observations of the roles that see them."""


class VisiblePerception(Protocol):
    """Perception of the roles by the pictures of a session (`camera.camera_perception`)."""

    @property
    def in_view(self) -> tuple[int, ...]:
        """Indices of the landmarks that are recognised at the present decision, ascending."""

    @property
    def recognised(self) -> tuple[int, ...]:
        """Indices of the landmarks that have been recognised so far, in the order of the first time."""

    def look(self) -> None:
        """Looks at the present decision."""

    def pixels(self, key: int) -> int:
        """Returns the number of visible pixels of a body, by its key."""

    def add_to(self, observations: Mapping[str, Observation]) -> None:
        """Writes visible objects into the observations of the roles that see them, which own their arrays."""


class SpokenChannel(Protocol):
    """Voices of a session and their recognition (`speech.spoken_dialogue`).

    Attributes:
        recordings: audio of the spans that were delivered last, with noise, at 16 kHz, by file name.
    """

    recordings: dict[str, Samples]

    def give_voices(self, pitches: Mapping[Role, float]) -> None:
        """Sets the pitch of speakers by role, relative to that of the synthesiser."""

    def speak(self, role: Role, text: str, pace: float) -> Samples:
        """Returns a text spoken by a role, at 16 kHz (n,), at a rate relative to that of the session."""

    def begin(self, role: Role, samples: Samples, end: float) -> None:
        """Records a span that a role has begun and that ends at a time [s]."""

    def seconds(self, samples: Samples) -> float:
        """Returns the duration of audio [s]."""

    def audio_name(self, utterance: int, span: int) -> str:
        """Returns the name of the file with the audio of a span; spans are counted from 0."""

    def hear(self, utterance: Utterance, number: int, cabin: CabinState) -> Utterance:
        """Returns the recognition of a completed utterance, the number-th of the session, in a car's noise."""


def draw_pictures(world: World, scenario: Scenario, config: CameraConfig) -> Pictures:
    """Returns the pictures of the camera on the car of a session."""
    pictures: Pictures = _make(PICTURES, world, scenario, config)
    return pictures


def see_by_camera(world: World, scenario: Scenario) -> VisiblePerception:
    """Returns the perception by the pictures of a session, after the first look."""
    perception: VisiblePerception = _make(PERCEPTION, world, scenario)
    return perception


def speak_aloud(seed: np.random.SeedSequence, *, words_per_second: float, classify: bool) -> SpokenChannel:
    """Returns the voices and the recogniser of a session.

    Args:
        seed: seed of voices and noise.
        words_per_second: speaking rate of the session [words/s].
        classify: as of `dialogue.Recogniser`.

    Raises:
        SpeechError: the extra `speech` is not installed.
    """
    channel: SpokenChannel = _make(SPEECH, seed, words_per_second=words_per_second, classify=classify)
    return channel


def _make(entry_point: str, *arguments: object, **settings: object) -> Any:
    return pkgutil.resolve_name(entry_point)(*arguments, **settings)


# --- Pictures as fields -----------------------------------------------------------------------------------------------

OBSERVERS: Final = (Role.PARTICIPANT, Role.CO_WIZARD)
"""Roles that look through the windscreen."""

FIELDS: Final[Mapping[CameraOutput, str]] = {
    CameraOutput.RGB: "camera",
    CameraOutput.DEPTH: "depth",
    CameraOutput.SEMANTIC: "semantic",
    CameraOutput.INSTANCE: "instance",
}
"""Field of the observation for each part of a picture; boxes are in `LiveSession.picture` only."""


def picture_spaces(config: CameraConfig) -> dict[str, spaces.Box]:
    """Returns the spaces of the fields that a camera adds to an observation."""
    size, keys = (config.height, config.width), np.iinfo(np.int32)
    boxes: dict[CameraOutput, spaces.Box] = {
        CameraOutput.RGB: spaces.Box(0, 255, (*size, 3), np.uint8),
        CameraOutput.DEPTH: spaces.Box(0.0, np.inf, size, np.float32),
        CameraOutput.SEMANTIC: spaces.Box(0, 255, size, np.uint8),
        CameraOutput.INSTANCE: spaces.Box(int(keys.min), int(keys.max), size, np.int32),
    }
    return {FIELDS[output]: boxes[output] for output in config.outputs if output in boxes}
