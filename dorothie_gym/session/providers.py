"""Parts of a session that other packages provide: pictures, perception by pictures, spoken words.

A session knows the interfaces of these parts, not their implementations: it imports neither the camera nor speech. If a
configuration requests a part, its class is found by name, as Gymnasium finds environments by the entry points of their
registration.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Any, Final, Protocol

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from dorothie_gym.ontology.roles import Role
from dorothie_gym.session.car_sensors import CrossedLines, car_sensor_fields
from dorothie_gym.session.config import CameraConfig, CameraOutput, EnvConfig
from dorothie_gym.session.sensor_config import LidarConfig, LidarOutput, RadarConfig
from dorothie_gym.session.spaces.fields import UNBOUNDED, dict_space

if TYPE_CHECKING:
    from dorothie_gym.dialogue.conversation import Utterance
    from dorothie_gym.maps.town import Town
    from dorothie_gym.pictures.camera.first_person_camera import CameraFrame
    from dorothie_gym.session.dialogue_channel import CabinState
    from dorothie_gym.session.scenario import Scenario
    from dorothie_gym.session.spaces.observations import Observation
    from dorothie_gym.sim.world import World
    from dorothie_gym.support.audio import Samples


PICTURES: Final = "dorothie_gym.pictures.camera.session_pictures:SessionPictures"
"""Entry point of the class that draws `Pictures`."""

LANE_LINES: Final = "dorothie_gym.pictures.maps.lane_lines:lane_lines"
"""Entry point of the function that finds the `CrossedLines` of a town."""

PERCEPTION: Final = "dorothie_gym.pictures.camera.camera_perception:CameraPerception"
"""Entry point of the `VisiblePerception`."""

SPEECH: Final = "dorothie_gym.speech.spoken_dialogue:SpokenDialogue"
"""Entry point of the `SpokenChannel`."""


class Pictures(Protocol):
    """Pictures, lidar and radar of the car of a session (`camera.session_pictures`)."""

    def frame(self, decision: int, name: str = "") -> CameraFrame | None:
        """Returns the picture of a camera at the current decision with this number; None for no such camera."""

    def begin_decision(self) -> None:
        """Notes the present, which optical flow is measured from, before the world is stepped."""

    def readings(self, decision: int, names: Collection[str]) -> dict[str, NDArray[np.generic]]:
        """Returns fields of observations at the current decision; callers must not write to them."""


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


def draw_pictures(world: World, scenario: Scenario, config: EnvConfig) -> Pictures:
    """Returns the pictures of the cameras, and the turns of lidar and radar, on the car of a session."""
    pictures: Pictures = _make(PICTURES, world, scenario, config)
    return pictures


def lines_of(town: Town) -> CrossedLines:
    """Returns the lines along the lanes of a town."""
    lines: CrossedLines = _make(LANE_LINES, town)
    return lines


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
    CameraOutput.OPTICAL_FLOW: "optical_flow",
    CameraOutput.NORMALS: "normals",
    CameraOutput.BIRDS_EYE: "birds_eye",
}
"""Field of the observation for each part of a picture; boxes are in `LiveSession.picture` only."""

LIDAR_FIELDS: Final[Mapping[LidarOutput, str]] = {
    LidarOutput.POINTS: "lidar",
    LidarOutput.SEMANTIC: "lidar_semantic",
    LidarOutput.INSTANCE: "lidar_instance",
}
"""Field of the observation for each part of a turn of the lidar."""

RADAR_FIELD: Final = "radar"

_KEYS = np.iinfo(np.int32)


def field_of(output: CameraOutput, name: str = "") -> str:
    """Returns the field of a part of the picture of a camera; further cameras have names."""
    return f"{name}_{FIELDS[output]}" if name else FIELDS[output]


def picture_spaces(config: CameraConfig, name: str = "") -> dict[str, spaces.Box]:
    """Returns the spaces of the fields that a camera adds to an observation."""
    size = config.height, config.width
    boxes: dict[CameraOutput, spaces.Box] = {
        CameraOutput.RGB: spaces.Box(0, 255, (*size, 3), np.uint8),
        CameraOutput.DEPTH: spaces.Box(0.0, np.inf, size, np.float32),
        CameraOutput.SEMANTIC: spaces.Box(0, 255, size, np.uint8),
        CameraOutput.INSTANCE: spaces.Box(int(_KEYS.min), int(_KEYS.max), size, np.int32),
        CameraOutput.OPTICAL_FLOW: spaces.Box(-UNBOUNDED, UNBOUNDED, (*size, 2), np.float32),
        CameraOutput.NORMALS: spaces.Box(-1.001, 1.001, (*size, 3), np.float32),
        CameraOutput.BIRDS_EYE: spaces.Box(0, 255, size, np.uint8),
    }
    return {field_of(output, name): boxes[output] for output in config.outputs if output in boxes}


def _lidar_spaces(config: LidarConfig) -> dict[str, spaces.Box]:
    size = config.channels, config.columns
    boxes: dict[LidarOutput, spaces.Box] = {
        LidarOutput.POINTS: spaces.Box(-config.range, config.range, (*size, 4), np.float32),
        LidarOutput.SEMANTIC: spaces.Box(0, 255, size, np.uint8),
        LidarOutput.INSTANCE: spaces.Box(int(_KEYS.min), int(_KEYS.max), size, np.int32),
    }
    return {LIDAR_FIELDS[output]: boxes[output] for output in config.outputs}


def _radar_spaces(config: RadarConfig) -> dict[str, spaces.Box]:
    return {RADAR_FIELD: spaces.Box(-UNBOUNDED, UNBOUNDED, (config.rows * config.columns, 4), np.float32)}


def sensor_spaces(config: EnvConfig, role: Role) -> dict[str, spaces.Space[Any]]:
    """Returns the spaces of the fields that cameras and sensors add to the observation of a role.

    Participant and Co-Wizard observe the pictures; the Co-Wizard also observes the sensors of the car.
    """
    found: dict[str, spaces.Space[Any]] = {}
    if role in OBSERVERS:
        for name, camera in config.all_cameras.items():
            found |= picture_spaces(camera, name)
    if role is Role.CO_WIZARD:
        sensors = config.sensors
        found |= {} if sensors.lidar is None else _lidar_spaces(sensors.lidar)
        found |= {} if sensors.radar is None else _radar_spaces(sensors.radar)
        found |= dict_space(car_sensor_fields(sensors, config.frames)).spaces
    return found
