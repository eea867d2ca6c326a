"""Closed-loop metrics over sessions with bootstrap intervals (Efron, 1979: percentiles over resampled sessions)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.rollout.closed_loop.metrics import METRICS, Metric, RecoverySeconds
from dorothie_gym.rollout.closed_loop.session_record import SessionRecord

RESAMPLES: Final = 2000
"""Drawings of as many sessions as there are, with replacement."""

SEED: Final = 0
"""Of the drawings: equal sessions, equal intervals."""

TAILS: Final = (2.5, 97.5)
"""Percentiles between which 95 % lie."""


@dataclass(frozen=True, kw_only=True)
class Interval:
    """A figure over sessions.

    Attributes:
        mean: the figure over all sessions; None where it is not defined.
        low: lower end of its 95 % bootstrap interval; None likewise, and for a single session.
        high: upper end.
    """

    mean: float | None
    low: float | None = None
    high: float | None = None

    def to_json(self) -> dict[str, float | None]:
        """Returns `mean`, `low` and `high`, rounded to 6 decimals: to what does not depend on the machine."""
        return {name: None if value is None else round(value, 6) for name, value in vars(self).items()}


def figures_of(records: Sequence[SessionRecord], errored: int = 0) -> dict[str, Interval]:
    """Returns every metric over sessions, by key.

    Args:
        records: of the sessions that were played to their end.
        errored: how many others ended in an error; they count as the worst where a metric has a worst.
    """
    found = {metric.key: interval_of(metric, records, errored) for metric in METRICS}
    found[RecoverySeconds.key] = _median(records)
    return found


def interval_of(metric: Metric, records: Sequence[SessionRecord], errored: int = 0) -> Interval:
    """Returns a metric over sessions with its interval; see `figures_of`."""
    parts = [metric.parts(record) for record in records]
    if metric.worst is not None:
        parts += [(metric.worst, 1.0)] * errored
    if not any(lower for _, lower in parts):
        return Interval(mean=None)
    sums = np.array(parts, dtype=np.float64)  # (n, 2)
    upper, lower = sums.sum(axis=0)
    drawn = _drawings(len(parts)) @ sums  # (RESAMPLES, 2)
    drawn = drawn[drawn[:, 1] > 0.0]
    return _between(float(upper / lower), drawn[:, 0] / drawn[:, 1], len(parts))


def _median(records: Sequence[SessionRecord]) -> Interval:
    """The median time to recovery: sessions are drawn with all their exceptions."""
    metric = RecoverySeconds()
    mean = metric.of(records)
    if mean is None:
        return Interval(mean=None)
    owners = [k for k, record in enumerate(records) for _ in metric.values(record)]
    values = np.array([seconds for record in records for seconds in metric.values(record)])
    order = np.argsort(values, kind="stable")
    counts = _drawings(len(records))[:, np.array(owners)[order]]  # how often each value was drawn
    counts = counts[counts.sum(axis=1) > 0.0]
    medians = _weighted_medians(values[order], counts)
    return _between(mean, medians, len(records))


def _weighted_medians(values: NDArray[np.float64], counts: NDArray[np.float64]) -> NDArray[np.float64]:
    """Medians of values (n,), ascending, of which each row of counts (m, n) has so many: (m,)."""
    reached = np.cumsum(counts, axis=1)
    total = reached[:, -1]
    low = (reached >= np.floor((total + 1.0) / 2.0)[:, None]).argmax(axis=1)
    high = (reached >= np.floor(total / 2.0 + 1.0)[:, None]).argmax(axis=1)
    medians: NDArray[np.float64] = (values[low] + values[high]) / 2.0
    return medians


def _between(mean: float, drawn: NDArray[np.float64], sessions: int) -> Interval:
    if sessions < 2 or not len(drawn):
        return Interval(mean=mean)
    low, high = np.percentile(drawn, TAILS)
    return Interval(mean=mean, low=float(low), high=float(high))


def _drawings(sessions: int) -> NDArray[np.float64]:
    """How often each session is drawn (RESAMPLES, sessions)."""
    rng = np.random.default_rng(SEED)
    drawn = rng.multinomial(sessions, np.full(sessions, 1.0 / sessions), size=RESAMPLES)
    return drawn.astype(np.float64)
