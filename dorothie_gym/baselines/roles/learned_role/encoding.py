"""Encodings of times, distances and choices as inputs of a network, and the topics of remarks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Final

from dorothie_gym.dialogue.propositions import Predicate
from dorothie_gym.ontology.dialogue_acts import DialogueMove

AWAY: Final = 300.0
"""Time that stands for "never" or "long ago" [s]."""

TOPICS: Final = (*(str(predicate) for predicate in Predicate), *(move.label for move in DialogueMove))
"""Subjects of remarks: their predicate or, without content, their move."""

TIME_SCALES: Final = (1.0, 4.0, 15.0)
"""Scales of times [s]."""


@lru_cache(maxsize=4096)
def one_hot(index: int, size: int) -> tuple[float, ...]:
    """Returns zeros (size,) with a one at an index, or without one for an index outside."""
    return tuple(float(k == index) for k in range(size))


def seconds_since(now: float, then: float) -> float:
    """Returns the time since a moment [s], at most `AWAY`."""
    return min(max(now - then, 0.0), AWAY) if math.isfinite(then) else AWAY


@lru_cache(maxsize=4096)
def time_scales(seconds: float) -> tuple[float, ...]:
    """Returns a time [s] on several scales (4,)."""
    seconds = min(max(seconds, 0.0), AWAY)
    return float(seconds <= 0.01), *(math.exp(-seconds / scale) for scale in TIME_SCALES)


def age_scales(now: float, then: float) -> tuple[float, ...]:
    """Returns the time since a moment on several scales (4,)."""
    return time_scales(seconds_since(now, then))


def distance_scales(metres: float, scales: Sequence[float]) -> list[float]:
    """Returns a distance [m] on several scales [m]."""
    metres = min(max(metres, -50.0), 1000.0)
    return [math.tanh(metres / scale) for scale in scales]
