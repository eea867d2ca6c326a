"""What of all bodies is perceived, and how exactly: glimpses beyond the sight, and errors of place.

All chance is a hash of the seed, the body and the time: it does not depend on who asks, how often, or in what order.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from dorothie_gym.world.car.hazards import Body
from dorothie_gym.world.config import FRAME_RATE
from dorothie_gym.world.visibility import SHORTEST_SIGHT, Visibility

GLANCE = FRAME_RATE // 2
"""Errors and misses stay the same for so long [frames]."""

RANGE_SCALE = 900.0
"""A camera's error of range is distance^2 / RANGE_SCALE: 5 % at 45 m, 10 % at 90 m (Stein, Mano and Shashua, IEEE
Intelligent Vehicles Symposium 2003) [m]."""

BEARING_ERROR = math.radians(0.25)
"""Error of bearing in poor sight [rad]: at 38 m, the sight at night with lights on, twice that is less than the room
that the car leaves beside others (`hazards.SIDE_MARGIN`)."""

MOST_ERROR = 1.0
"""Bound of the loss that scales errors: poor sight at most adds the camera's own error once more."""

MOST_SIGMAS = 2.0
"""Errors are cut off here: what is within sight is never far from where it is thought to be."""

MISS_EXPONENT = 2.0
"""How fast the chance of a glimpse falls with the signal beyond the sight."""

_GOLDEN, _MIX_A, _MIX_B = 0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9, 0x94D049BB133111EB
_MASK = (1 << 64) - 1


class Perception:
    """Sees bodies as well as visibility allows."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._seed = int(rng.integers(1 << 63))

    def perceive(
        self, bodies: Sequence[Body], x: float, y: float, visibility: Visibility, frame: int
    ) -> list[Body]:  # fmt: skip
        """The bodies that are perceived, where they seem to be, nearest first.

        What is within sight is always perceived; beyond it, now and then. On a clear noon nothing is changed.

        Args:
            bodies: all within sight of a clear noon.
            x: position of whoever looks [m]; `y` likewise.
            y: [m].
            visibility: air and light.
            frame: present frame.
        """
        if visibility.is_clear:
            return list(bodies)
        seen: list[tuple[float, int, Body]] = []
        for body in bodies:
            dx, dy = body.x - x, body.y - y
            distance = math.hypot(dx, dy)
            draw = _Draw(self._seed, body.key, frame // GLANCE)
            if distance > visibility.sight and draw.uniform() >= detection_probability(visibility, distance):
                continue
            away, aside = position_error(visibility, distance)
            if away > 0.0:
                away, aside = 1.0 + away * draw.normal() / distance, aside * draw.normal() / distance
                body = replace(body, x=x + dx * away - dy * aside, y=y + dy * away + dx * aside)
            seen.append((math.hypot(body.x - x, body.y - y), body.key, body))
        seen.sort(key=lambda row: row[:2])
        return [body for _, _, body in seen]


def detection_probability(visibility: Visibility, distance: float) -> float:
    """Chance that something at a distance [m] is perceived: 1 within sight, then falling with its signal."""
    if distance <= visibility.sight:
        return 1.0
    return float(min(visibility.signal(distance), 1.0) ** MISS_EXPONENT)


def position_error(visibility: Visibility, distance: float) -> tuple[float, float]:
    """Standard deviations of the place of something at a distance [m], away from the car and across [m].

    Errors go with one over the root of the signal, as the Cramer-Rao bound has it; what a clear noon has of them is
    left out, so that there they are exactly 0. Within the range of the radar places are known.
    """
    gain = visibility.gain(distance)
    loss = min(1.0 / math.sqrt(gain) - 1.0, MOST_ERROR) if gain > 0.0 else MOST_ERROR
    beyond = max(distance**2 - SHORTEST_SIGHT**2, 0.0)
    return loss * beyond / RANGE_SCALE, loss * BEARING_ERROR * math.sqrt(beyond)


class _Draw:
    """Numbers by chance that are a function of a few integers (splitmix64; Steele, Lea and Flood, OOPSLA 2014)."""

    def __init__(self, *keys: int) -> None:
        self._state = 0
        for key in keys:
            self._state = self._next() ^ (key & _MASK)

    def uniform(self) -> float:
        """In [0, 1)."""
        return (self._next() >> 11) * 2.0**-53

    def normal(self) -> float:
        """Standard normal (Box and Muller 1958), cut off at MOST_SIGMAS."""
        radius = math.sqrt(-2.0 * math.log(1.0 - self.uniform()))
        return min(max(radius * math.cos(2 * math.pi * self.uniform()), -MOST_SIGMAS), MOST_SIGMAS)

    def _next(self) -> int:
        self._state = (self._state + _GOLDEN) & _MASK
        z = self._state
        z = ((z ^ (z >> 30)) * _MIX_A) & _MASK
        z = ((z ^ (z >> 27)) * _MIX_B) & _MASK
        return z ^ (z >> 31)
