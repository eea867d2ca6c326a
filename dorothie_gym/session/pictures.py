"""Pictures as parts of observations: their fields and spaces."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np
from gymnasium import spaces

from dorothie_gym.ontology.roles import Role
from dorothie_gym.session.camera_config import CameraConfig, CameraOutput

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
