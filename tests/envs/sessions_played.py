"""Sessions played in code with every action kept, and a digest of nested values."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from dorothie_gym.testing.playing import ByAgent, play_random, play_scripted

Moment = tuple[ByAgent, ByAgent, ByAgent]
"""Observations, infos and actions of all agents; the actions after the last decision are empty."""


def play_at_random(env: Any, *, seed: int, decisions: int) -> Iterator[Moment]:
    """Plays a session with actions sampled from the masks."""
    for decision in play_random(env, seed=seed, decisions=decisions):
        yield decision.observations, decision.infos, decision.actions


def play_by_script(env: Any, *, seed: int, decisions: int) -> Iterator[Moment]:
    """Plays a session with the scripted policies."""
    for decision in play_scripted(env, seed=seed, decisions=decisions):
        yield decision.observations, decision.infos, decision.actions


def digest(value: Any) -> str:
    """Returns a hash of nested dicts, tuples, arrays, numbers and texts."""
    found = hashlib.sha256()

    def add(part: Any) -> None:
        if isinstance(part, Mapping):
            for key in part:  # in the order of the dict, which must be equal too
                found.update(str(key).encode())
                add(part[key])
        elif isinstance(part, list | tuple):
            for item in part:
                add(item)
        elif isinstance(part, np.ndarray | np.generic):
            found.update(str((part.dtype, part.shape)).encode() + part.tobytes())
        else:
            found.update(repr(part).encode())

    add(value)
    return found.hexdigest()
