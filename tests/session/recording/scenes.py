"""Surroundings of the car, built in code."""

from __future__ import annotations

from typing import Any

import numpy as np

from dorothie_gym.ontology import WeatherParameter
from dorothie_gym.session.recording import ACTOR_DTYPE, ActorKind


def actors(count: int, seed: int = 0) -> Any:
    """Rows of `ACTOR_DTYPE`."""
    draw = np.random.default_rng(seed)
    rows = np.zeros(count, dtype=ACTOR_DTYPE)
    rows["key"] = np.arange(count) + 100
    rows["kind"] = draw.integers(0, len(ActorKind), count)
    for name in ("x", "y", "heading", "speed", "length", "width"):
        rows[name] = draw.normal(size=count)
    return rows


def lights(frame: int) -> dict[int, str]:
    return {7: "red" if frame % 2 else "green", 12: "yellow"}


def weather(frame: int) -> dict[str, float]:
    return {str(parameter): parameter.clear_noon + frame / 3 for parameter in WeatherParameter}
