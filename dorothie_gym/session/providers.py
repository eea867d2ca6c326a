"""Parts of a session that other packages provide: pictures, perception by pictures, spoken words.

A session knows the interfaces of these parts, not their implementations: it imports neither the camera nor speech. If a
configuration requests a part, its class is found by name, as Gymnasium finds environments by the entry points of their
registration.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final, Protocol

import numpy as np
from gymnasium import spaces

from dorothie_gym.ontology.roles import Role
from dorothie_gym.session.config import CameraConfig, CameraOutput

if TYPE_CHECKING:
    from dorothie_gym.dialogue.conversation import Utterance
    from dorothie_gym.pictures.camera.first_person_camera import CameraFrame
    from dorothie_gym.session.dialogue_channel import CabinState
    from dorothie_gym.session.scenario import Scenario
    from dorothie_gym.session.spaces.observations import Observation
    from dorothie_gym.sim.world import World
    from dorothie_gym.support.audio import Samples


PICTURES: Final = "dorothie_gym.pictures.camera.session_pictures:SessionPictures"
"""Entry point of the class that draws `Pictures`."""

PERCEPTION: Final = "dorothie_gym.pictures.camera.camera_perception:CameraPerception"
"""Entry point of the `VisiblePerception`."""

SPEECH: Final = "dorothie_gym.speech.spoken_dialogue:SpokenDialogue"
"""Entry point of the `SpokenChannel`."""


class Pictures(Protocol):
    """Pictures of the camera on the car of a session (`camera.session_pictures`)."""

    def frame(self, decision: int) -> CameraFrame:
        """Returns the picture at the current decision with this number."""

    def add_to(self, observations: Mapping[str, Observation], decision: int) -> None:
        """Adds the pictures of the current decision to the observations of the roles that see them."""


class VisiblePerception(Protocol):
    """Perception of the roles by the pictures of a session (`camera.camera_perception`)."""

    @property
    def in_view(self) -> tuple[int, ...]:
        """Indices of the landmarks that are recognised at the current decision, ascending."""

    @property
    def recognised(self) -> tuple[int, ...]:
        """Indices of the landmarks that have been recognised so far, in the order of the first time."""

    def look(self) -> None:
        """Updates to the current decision."""

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
    """Returns the perception by the pictures of a session, initialised with the first picture."""
    perception: VisiblePerception = _make(PERCEPTION, world, scenario)
    return perception


def speak_aloud(seed: np.random.SeedSequence, *, words_per_second: float, classify: bool) -> SpokenChannel:
    """Returns the voices and the recogniser of a session.

    Args:
        seed: seed of voices and noise.
        words_per_second: speaking rate of the session [words/s].
        classify: as in `dialogue.Recogniser`.

    Raises:
        SpeechError: the extra `speech` is not installed.
    """
    channel: SpokenChannel = _make(SPEECH, seed, words_per_second=words_per_second, classify=classify)
    return channel


def _make(entry_point: str, *arguments: object, **settings: object) -> Any:
    return pkgutil.resolve_name(entry_point)(*arguments, **settings)


# --- Pictures as fields of observations -------------------------------------------------------------------------------

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
