"""Picture of the car's camera in the form in which models read it."""

from __future__ import annotations

import base64
import io
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from dorothie_gym.session.spaces.observations import ObservationMapping


def picture_address(observation: ObservationMapping) -> str:
    """Returns the picture of the camera as an address with its PNG; empty for a role without a camera."""
    pixels = observation.get("camera")
    if pixels is None:
        return ""
    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(np.asarray(pixels, dtype=np.uint8)).save(buffer, format="PNG")
    return "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode()
