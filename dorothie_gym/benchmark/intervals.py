"""What several seeds say of one figure: the mean, and how far it may be off."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

CONFIDENCE: Final = 0.95
"""Share of such intervals that hold the true mean, if the seeds' figures are normally distributed."""


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """A figure over seeds.

    Attributes:
        values: the figure of each seed that has one, by seed.
    """

    values: Mapping[int, float]

    @classmethod
    def of(cls, values: Mapping[int, float]) -> Estimate:
        """Returns the estimate from the figure of each seed; those that are undefined (NaN) count in none."""
        return cls(values={seed: value for seed, value in values.items() if not math.isnan(value)})

    @property
    def seeds(self) -> int:
        """Number of seeds that have the figure."""
        return len(self.values)

    @property
    def mean(self) -> float | None:
        """Mean over the seeds; None without any."""
        return float(np.mean(list(self.values.values()))) if self.values else None

    @property
    def half_width(self) -> float | None:
        """Half the width of the 95 % interval of the mean, by Student's t; None with less than two seeds."""
        return half_width(list(self.values.values()))

    def minus(self, other: Estimate) -> Estimate:
        """Returns the difference, seed by seed, over the seeds that both have (paired)."""
        return Estimate(values={seed: value - other.values[seed] for seed, value in self.values.items()
                                if seed in other.values})  # fmt: skip

    def to_json(self) -> dict[str, Any]:
        """Returns `mean`, `half_width`, `seeds` (their number) and `values` by seed."""
        values = {str(seed): value for seed, value in sorted(self.values.items())}
        return {"mean": self.mean, "half_width": self.half_width, "seeds": self.seeds, "values": values}


def half_width(values: list[float]) -> float | None:
    """Returns half the width of the 95 % interval of the mean of some numbers; None with less than two.

    t(0.975, n - 1) x standard deviation (n - 1) / sqrt(n).
    """
    # imported here: scipy.stats is slow to import, and the package is not
    from scipy.stats import t

    if len(values) < 2:
        return None
    spread = float(np.std(values, ddof=1))
    return float(t.ppf(0.5 + CONFIDENCE / 2, len(values) - 1)) * spread / math.sqrt(len(values))
