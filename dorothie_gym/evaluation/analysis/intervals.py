"""Confidence intervals: Wilson's for shares, percentile bootstrap over sessions (Efron, 1979), Student's t over seeds.

`scipy.stats.bootstrap` is not used: it draws new samples for each figure instead of one set for all, and a single
sample with an undefined figure (such as no exception met) makes its interval undefined.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

CONFIDENCE: Final = 0.95
"""Confidence level of all intervals."""

RESAMPLES: Final = 2000
"""Number of bootstrap samples."""

_Z: Final = 1.959963984540054  # 0.975 quantile of the normal distribution

TAILS: Final = (0.025, 0.975)
"""Quantiles between which `CONFIDENCE` of the bootstrap samples lie."""


def bootstrap_weights(sessions: int, *, resamples: int = RESAMPLES, seed: int = 0) -> NDArray[np.float64]:
    """Returns how often each session occurs in each bootstrap sample, (resamples, sessions)."""
    rng = np.random.default_rng(seed)
    return rng.multinomial(sessions, np.full(sessions, 1.0 / sessions), size=resamples).astype(np.float64)


def percentile_interval(figures: NDArray[np.float64]) -> tuple[float, float]:
    """Returns the ends of the interval of a figure from its bootstrap samples (n,); NaN is left out."""
    low, high = np.nanquantile(figures, TAILS)
    return float(low), float(high)


def wilson_interval(successes: float, trials: float) -> tuple[float, float]:
    """Returns the 95 % interval of a share (Wilson 1927, JASA 22, 209-212); of 0 trials, (0, 1).

    Unlike the bootstrap interval, it has a width even if all trials succeeded or failed: 4 of 4 give (0.51, 1).
    """
    if not trials:
        return 0.0, 1.0
    share = successes / trials
    middle = share + _Z**2 / (2 * trials)
    half = _Z * math.sqrt(share * (1 - share) / trials + _Z**2 / (4 * trials**2))
    scale = 1 + _Z**2 / trials
    # the ends at a bound are exact; rounding must not move them off it
    low = 0.0 if successes == 0 else (middle - half) / scale
    high = 1.0 if successes == trials else (middle + half) / scale
    return max(low, 0.0), min(high, 1.0)


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """Mean of a figure over seeds, with its confidence interval.

    Attributes:
        values: figure of each seed for which it is defined, by seed.
    """

    values: Mapping[int, float]

    @classmethod
    def of(cls, values: Mapping[int, float]) -> Estimate:
        """Returns the estimate from the figure of each seed; undefined figures (NaN) are left out."""
        return cls(values={seed: value for seed, value in values.items() if not math.isnan(value)})

    @property
    def seeds(self) -> int:
        """Number of seeds for which the figure is defined."""
        return len(self.values)

    @property
    def mean(self) -> float | None:
        """Mean over the seeds; None without seeds."""
        return float(np.mean(list(self.values.values()))) if self.values else None

    @property
    def half_width(self) -> float | None:
        """Half the width of the 95 % interval of the mean, by Student's t; None with fewer than two seeds."""
        return half_width(list(self.values.values()))

    def minus(self, other: Estimate) -> Estimate:
        """Returns the paired difference over the seeds that both estimates have."""
        return Estimate(
            values={seed: value - other.values[seed] for seed, value in self.values.items() if seed in other.values}
        )

    def to_json(self) -> dict[str, object]:
        """Returns `mean`, `half_width`, `seeds` (their number) and `values` by seed."""
        values = {str(seed): value for seed, value in sorted(self.values.items())}
        return {"mean": self.mean, "half_width": self.half_width, "seeds": self.seeds, "values": values}


def half_width(values: list[float]) -> float | None:
    """Returns half the width of the 95 % interval of the mean of numbers; None for fewer than two.

    t(0.975, n - 1) x standard deviation (n - 1) / sqrt(n).
    """
    # imported here because scipy.stats is slow to import
    from scipy.stats import t

    if len(values) < 2:
        return None
    spread = float(np.std(values, ddof=1))
    return float(t.ppf(0.5 + CONFIDENCE / 2, len(values) - 1)) * spread / math.sqrt(len(values))
