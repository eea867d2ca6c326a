"""Drawing of remarks and commands by the learned roles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def drawn(shares: NDArray[np.float64], rng: np.random.Generator) -> int:
    """Returns a number drawn in proportion to shares; 0 if all are 0."""
    total = float(shares.sum())
    if total <= 0.0:
        return 0
    return min(int(np.searchsorted(np.cumsum(shares), rng.random() * total)), len(shares) - 1)
