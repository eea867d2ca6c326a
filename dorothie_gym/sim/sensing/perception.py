"""Perception of the ego in Python: visibility and seed of the compiled functions in `sensing.seeing`."""

from __future__ import annotations

import numpy as np

from dorothie_gym.sim.sensing.seeing import detection_chance, errors_of_place
from dorothie_gym.sim.sensing.visibility import Visibility
from dorothie_gym.sim.state.records import EyeRecord, RecordArray


class Perception:
    """Perception with the errors of one seed."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._seed = int(rng.integers(1 << 63))
        self._opened: tuple[RecordArray[EyeRecord], Visibility] | None = None

    def open(self, eyes: RecordArray[EyeRecord], visibility: Visibility) -> bool:
        """Writes the visibility and the seed into the record of a world.

        Args:
            eyes: (1,) record of the visibility, written.
            visibility: air and light.

        Returns:
            Whether anything has changed.
        """
        if self._opened is not None and self._opened[0] is eyes and self._opened[1] is visibility:
            return False
        self._opened = eyes, visibility
        view = visibility
        eyes[0] = (
            self._seed, view.sight, view.fog, view.fog_start, view.rain, view.light, view.lamps, view.clarity,
            view.is_clear,
        )  # fmt: skip
        return True


BODY = "key", "kind", "x", "y", "heading", "length", "width", "speed", "height"
"""Columns of a table of perceived bodies."""


def detection_probability(visibility: Visibility, distance: float) -> float:
    """Returns the probability to perceive a body at a distance [m]: 1 within sight, then falling with its signal."""
    if distance <= visibility.sight:
        return 1.0
    return float(detection_chance(visibility.signal(distance)))


def position_error(visibility: Visibility, distance: float) -> tuple[float, float]:
    """Returns the standard deviations of a perceived place at a distance [m], along the line of sight and across."""
    away, aside = errors_of_place(visibility.gain(distance), distance * distance)
    return float(away), float(aside)
