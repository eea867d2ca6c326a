"""Faults of the camera: a blurred picture, and none at all."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.ontology.labelled_enums import complete
from dorothie_gym.ontology.world_exceptions import Sensor
from dorothie_gym.sim.sensing.visibility import CLARITY
from dorothie_gym.support.compilation import concurrent

_SHARE = 0.012  # radius of the blur as a share of the picture's width
_ROUNDS = 2  # of means; two make the weights fall off linearly


def apply_faults(picture: NDArray[np.uint8], faults: Collection[Sensor], scratch: NDArray[np.uint8]) -> None:
    """Applies to a picture (h, w, 3) the fault that degrades it most.

    Args:
        picture: picture to change.
        faults: faults of any sensors.
        scratch: (max(h, w),) or longer.
    """
    worst = min((sensor for sensor in faults if _CHANGES[sensor] is not None), key=CLARITY.__getitem__, default=None)
    change = None if worst is None else _CHANGES[worst]
    if change is not None:
        change(picture, scratch)


def _black_out(picture: NDArray[np.uint8], scratch: NDArray[np.uint8]) -> None:
    picture[:] = 0


def _take_details(picture: NDArray[np.uint8], scratch: NDArray[np.uint8]) -> None:
    radius = max(1, round(_SHARE * picture.shape[1]))
    for _ in range(_ROUNDS):
        for channel in range(3):
            blur(picture, channel, radius, scratch)


_CHANGES: Mapping[Sensor, Callable[[NDArray[np.uint8], NDArray[np.uint8]], None] | None] = complete(
    {Sensor.BLUR: _take_details, Sensor.GPS: None, Sensor.VIEW: _black_out}, Sensor, "_CHANGES", __name__
)
"""Change of the picture by each fault; None for sensors other than the camera."""


@concurrent
def blur(picture: NDArray[np.uint8], channel: int, radius: int, scratch: NDArray[np.uint8]) -> None:
    """Replaces a channel by its means over squares; rows and columns are extended by their last values."""
    height, width, _ = picture.shape
    for axis in range(2):
        lines, length = (height, width) if axis == 0 else (width, height)
        for line in range(lines):
            for k in range(length):
                scratch[k] = picture[line, k, channel] if axis == 0 else picture[k, line, channel]
            total = 0
            for k in range(-radius, radius + 1):
                total += int(scratch[min(max(k, 0), length - 1)])
            for k in range(length):
                mean = (total + radius) // (2 * radius + 1)
                if axis == 0:
                    picture[line, k, channel] = mean
                else:
                    picture[k, line, channel] = mean
                total += int(scratch[min(k + radius + 1, length - 1)]) - int(scratch[max(k - radius, 0)])
