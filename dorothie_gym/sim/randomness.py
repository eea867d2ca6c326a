"""Random numbers whose state is kept in records, the same in every process.

- xorshift32 (Marsaglia, 2003) for the choices of traffic and pedestrians, one stream a body.
- PCG64 (O'Neill, 2014) with the ziggurat of Marsaglia and Tsang (2000) for normal numbers: those of
  `numpy.random.Generator.standard_normal`, continuing from the state of a generator.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numba.np.random._constants import fi_double, ki_double, wi_double, ziggurat_nor_inv_r, ziggurat_nor_r
from numpy.typing import NDArray

from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import compiled

if TYPE_CHECKING:
    from dorothie_gym.sim.state.records import RandomBody, RandomStream

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
        second: number in 0..2^32 - 1.
        pool: (4,) scratch.
    """
    _fill_pool(first, second, pool)
    return _hashed(pool[0], _OUTPUT, _OUTPUT_FACTOR)


_OUTPUT, _OUTPUT_FACTOR = 0x8B51F9DD, 0x58F38DED
"""First constant of the hash of the pool's words, and its factor from each to the next."""


@compiled
def _fill_pool(first: int, second: int, pool: NDArray[np.int64]) -> None:
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


@compiled
def _hashed(value: int, constant: int, factor: int) -> int:
    value = (int(value) ^ constant) * (constant * factor & MASK) & MASK
    return value ^ value >> 16


# --- Normal numbers ---------------------------------------------------------------------------------------------------

_MASK64 = 0xFFFFFFFFFFFFFFFF
_HIGH, _LOW = 0x2360ED051FC65DA4, 0x4385DF649FCCF645
"""PCG64's multiplier of 128 bits, by halves."""

_LAYERS, _WIDTHS, _HEIGHTS = ki_double, wi_double, fi_double
"""Tables of the ziggurat of 256 layers, NumPy's own: share of each layer under the curve, width and height."""

_TAIL, _INVERSE_TAIL = float(ziggurat_nor_r), float(ziggurat_nor_inv_r)
"""Where the tail begins, and one over that."""


def begin_stream(stream: RandomStream, generator: np.random.Generator) -> None:
    """Continues a generator's numbers from a record's stream.

    Raises:
        TypeError: the generator is not of the kind PCG64, as `numpy.random.default_rng` makes it.
    """
    if not isinstance(generator.bit_generator, np.random.PCG64):
        raise TypeError(f"the generator must be of the kind PCG64, not {type(generator.bit_generator).__name__}")
    numbers = generator.bit_generator.state["state"]
    stream.state_high, stream.state_low = divmod(numbers["state"], 1 << 64)
    stream.step_high, stream.step_low = divmod(numbers["inc"], 1 << 64)


@compiled
def seed_stream(stream: RandomStream, first: int, second: int, pool: NDArray[np.int64]) -> None:
    """Begins the stream of `numpy.random.default_rng((first, second))`; see `seed_of`."""
    _fill_pool(first, second, pool)
    stream.state_high, stream.state_low = _seed_words(pool, 0) & _MASK64, _seed_words(pool, 2) & _MASK64
    high, low = _seed_words(pool, 4), _seed_words(pool, 6)
    stream.step_high = (high << 1 | (low >> 63 & 1)) & _MASK64
    stream.step_low = (low << 1 | 1) & _MASK64
    _add_step(stream)
    _next_bits(stream)


@compiled
def _seed_words(pool: NDArray[np.int64], first: int) -> int:
    """Returns two of the words that a seed sequence generates as a number of 64 bits, the lower one first."""
    constant, bits = _OUTPUT, 0
    for k in range(first + 2):
        word = _hashed(pool[k % POOL], constant, _OUTPUT_FACTOR)
        constant = constant * _OUTPUT_FACTOR & MASK
        if k >= first:
            bits |= word << 32 * (k - first)
    return bits


@compiled
def _add_step(stream: RandomStream) -> None:
    """Adds the increment of a stream to its state."""
    low, step = int(stream.state_low), int(stream.step_low)
    total = (low + step) & _MASK64
    overflow = (((low & step) | ((low | step) & ~total)) >> 63) & 1
    stream.state_high = (int(stream.state_high) + int(stream.step_high) + overflow) & _MASK64
    stream.state_low = total


@compiled
def _next_bits(stream: RandomStream) -> int:
    """Returns 64 random bits, and advances a stream (PCG's XSL-RR).

    Plain Python computes with masks, compiled code with integers that wrap; the bits are the same.
    """
    high, low = int(stream.state_high), int(stream.state_low)
    upper, lower = (low >> 32) & MASK, low & MASK
    first, second = lower * (_LOW & MASK), lower * (_LOW >> 32)
    third, fourth = upper * (_LOW & MASK), upper * (_LOW >> 32)
    carry = ((first >> 32) & MASK) + (second & MASK) + (third & MASK)
    product = fourth + ((second >> 32) & MASK) + ((third >> 32) & MASK) + (carry >> 32)
    high = (product + high * _LOW + low * _HIGH) & _MASK64
    stream.state_high, stream.state_low = high, (low * _LOW) & _MASK64
    _add_step(stream)
    high, low = int(stream.state_high), int(stream.state_low)
    turn, bits = (high >> 58) & 63, high ^ low
    return ((bits >> turn) & (_MASK64 >> turn)) | ((bits << ((64 - turn) & 63)) & _MASK64)


@compiled
def draw_share(stream: RandomStream) -> float:
    """Returns a number in [0, 1), as `numpy.random.Generator.random`, and advances a stream."""
    return float(((_next_bits(stream) >> 11) & 0x1FFFFFFFFFFFFF) * (1.0 / 9007199254740992.0))


@compiled
def draw_normal(stream: RandomStream) -> float:
    """Returns a number of the standard normal distribution, and advances a stream."""
    while True:
        bits = _next_bits(stream)
        layer, place = bits & 0xFF, (bits >> 9) & 0x000FFFFFFFFFFFFF
        number = place * _WIDTHS[layer]
        if (bits >> 8) & 1:
            number = -number
        if place < int(_LAYERS[layer]):
            return float(number)
        if layer == 0:
            while True:
                beyond = -_INVERSE_TAIL * pm.log1p(-draw_share(stream))
                height = -pm.log1p(-draw_share(stream))
                if height + height > beyond * beyond:
                    return -(_TAIL + beyond) if (place >> 8) & 1 else _TAIL + beyond
        height = (_HEIGHTS[layer - 1] - _HEIGHTS[layer]) * draw_share(stream) + _HEIGHTS[layer]
        if height < pm.exp(-0.5 * number * number):
            return float(number)
