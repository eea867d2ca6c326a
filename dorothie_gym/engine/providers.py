"""Parts of a session that other packages provide: pictures, perception by pictures, and spoken words.

A session knows what these parts do (`Pictures`, `VisiblePerception`, `SpokenChannel`), not how: it imports neither the
camera nor speech. Where a configuration asks for a part, its class is found by name, as Gymnasium finds environments by
the entry points of their registration.
"""

from __future__ import annotations

import pkgutil
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from dorothie_gym.engine.camera_config import CameraConfig
from dorothie_gym.engine.pictures import Pictures, VisiblePerception
from dorothie_gym.engine.spoken_channel import SpokenChannel

if TYPE_CHECKING:
    from dorothie_gym.engine.scenario import Scenario
    from dorothie_gym.sim.world import World

PICTURES: Final = "dorothie_gym.camera.session_pictures:SessionPictures"
"""Entry point of what draws `Pictures`."""

PERCEPTION: Final = "dorothie_gym.camera.camera_perception:CameraPerception"
"""Entry point of the `VisiblePerception`."""

SPEECH: Final = "dorothie_gym.speech.spoken_dialogue:SpokenDialogue"
"""Entry point of the `SpokenChannel`."""


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
