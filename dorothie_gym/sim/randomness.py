"""Random numbers whose state lives in an array, the same in every process: Marsaglia's xorshift32 (2003)."""

from __future__ import annotations

from typing import TYPE_CHECKING

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
