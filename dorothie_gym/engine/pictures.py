"""Pictures in observations: their fields, and what a session asks of those who draw them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Final, Protocol

import numpy as np
from gymnasium import spaces

from dorothie_gym.engine.camera_config import CameraConfig, CameraOutput
from dorothie_gym.ontology.roles import Role
from dorothie_gym.spaces.observations import Observation

if TYPE_CHECKING:
    from dorothie_gym.camera.first_person_camera import CameraFrame

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


class Pictures(Protocol):
    """Pictures of the camera on the car of a session (`camera.session_pictures`)."""

    def frame(self, decision: int) -> CameraFrame:
        """Returns the picture at the present decision, of this number."""

    def add_to(self, observations: Mapping[str, Observation], decision: int) -> None:
        """Adds the pictures of the present decision to the observations of the roles that see them."""


class VisiblePerception(Protocol):
    """What the pictures of a session let the roles perceive (`camera.camera_perception`)."""

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
        """Writes what is seen into the observations of the roles that see it, which own their arrays."""
