"""Random numbers whose state lives in an array, the same in every process: Marsaglia's xorshift32 (2003)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.compilation import compiled

if TYPE_CHECKING:
    from dorothie_gym.sim.state.records import RandomBody

MASK = 0xFFFFFFFF


@compiled
def draw(body: RandomBody) -> float:
    """Returns a number in [0, 1) and advances the field `random` of a body, which is never 0."""
    state = int(body.random)
    state ^= (state << 13) & MASK
    state ^= state >> 17
    state ^= (state << 5) & MASK
    body.random = state
    return state / 4294967296.0


@compiled
def choose(body: RandomBody, count: int) -> int:
    """Returns one of the numbers 0, 1, ... count - 1."""
    return int(draw(body) * count)


# --- Seeds ------------------------------------------------------------------------------------------------------------

POOL = 4
"""Words of the pool of NumPy's `SeedSequence`."""


@compiled
def seed_of(first: int, second: int, pool: NDArray[np.int64]) -> int:
    """Returns `SeedSequence((first, second)).generate_state(1)[0]`, for two numbers below 2^32.

    Args:
        first: number in 0..2^32 - 1.
        second: likewise.
        pool: (4,) scratch.
    """
    constant = 0x43B0D7E5
    for k in range(POOL):
        pool[k] = _hashed(first if k == 0 else second if k == 1 else 0, constant, 0x931E8875)
        constant = constant * 0x931E8875 & MASK
    for source in range(POOL):
        for target in range(POOL):
            if source != target:
                hashed = _hashed(pool[source], constant, 0x931E8875)
                mixed = 0xCA01F9DD * int(pool[target]) - 0x4973F715 * hashed & MASK
                pool[target] = mixed ^ mixed >> 16
                constant = constant * 0x931E8875 & MASK
    return _hashed(pool[0], 0x8B51F9DD, 0x58F38DED)


@compiled
def _hashed(value: int, constant: int, factor: int) -> int:
    value = (int(value) ^ constant) * (constant * factor & MASK) & MASK
    return value ^ value >> 16
