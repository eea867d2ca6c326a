"""Random generator of a decision, made when something is first drawn from it: most decisions draw nothing."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

import numpy as np


class _DeferredGenerator:
    """Stands for the generator of a seed, which is made at the first use of one of its attributes."""

    __slots__ = ("_generator", "_seed")

    def __init__(self, seed: tuple[int, ...]) -> None:
        self._seed = seed
        self._generator: np.random.Generator | None = None

    def __getattr__(self, name: str) -> Any:
        if self._generator is None:
            self._generator = np.random.default_rng(self._seed)
        return getattr(self._generator, name)


def decision_random(*seed: int) -> np.random.Generator:
    """Returns the random generator of a decision.

    Args:
        seed: seed of the session's policy, and the number of the decision.
    """
    if TYPE_CHECKING:
        return np.random.default_rng(seed)
    return cast("np.random.Generator", _DeferredGenerator(seed))
