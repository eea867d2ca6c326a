"""Closed-loop metrics (spec: metrics) and their figures over sessions, with confidence intervals.

Over several sessions a metric is the ratio of the sums of its two parts. For metrics that a session has once (success,
driving score) the ratio is the mean over sessions; for metrics per subgoal, exchange or exception it is the mean over
all subgoals, exchanges or exceptions, so that a session with few exchanges has a small weight.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, ClassVar, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.evaluation.analysis.intervals import bootstrap_weights, percentile_interval, wilson_interval
from dorothie_gym.evaluation.closed_loop.metric import TIMEOUT, ClosedLoopMetric, SessionMetric
from dorothie_gym.evaluation.closed_loop.sub_scores import (
    Discomfort,
    ExchangesAgainstReference,
    HardBraking,
    Truth,
    UnansweredQuestions,
)
from dorothie_gym.evaluation.closed_loop.talk_verdict import TalkSuccess, UnnecessaryQuestions
from dorothie_gym.support import portable_arrays as pn

if TYPE_CHECKING:
    from dorothie_gym.evaluation.closed_loop.session_record import SessionRecord

PENALTIES: Final[Mapping[str, float]] = MappingProxyType(
    {"pedestrian": 0.50, "vehicle": 0.60, "static": 0.65, "red_light": 0.70, "stop_sign": 0.80, TIMEOUT: 0.70}
)
"""Factor of the driving score for each infraction, as in the CARLA leaderboard (leaderboard.carla.org, version 2)."""


@dataclass(frozen=True, kw_only=True)
class Success(SessionMetric):
    """Whether all live subgoals were reached in an allowed order, destination last, without an at-fault collision."""

    key: ClassVar[str] = "success"
    title: ClassVar[str] = "success"
    worst: ClassVar[float | None] = 0.0
    counts_sessions: ClassVar[bool] = True

    def value(self, record: SessionRecord) -> float:
        """Returns 1 for a success, else 0."""
        return float(record.success)


@dataclass(frozen=True, kw_only=True)
class GoalConditionSuccess(SessionMetric):
    """Share of the live subgoals that were reached (ALFRED; Shridhar et al., 2020)."""

    key: ClassVar[str] = "goal_condition_success"
    title: ClassVar[str] = "goals"
    worst: ClassVar[float | None] = 0.0

    def value(self, record: SessionRecord) -> float | None:
        """Returns the share."""
        return record.reached / record.live if record.live else None


@dataclass(frozen=True, kw_only=True)
class SPL(SessionMetric):
    """Success weighted by path length: success x shortest / max(shortest, driven) (Anderson et al., 2018)."""

    key: ClassVar[str] = "spl"
    title: ClassVar[str] = "SPL"
    worst: ClassVar[float | None] = 0.0

    def value(self, record: SessionRecord) -> float | None:
        """Returns the product."""
        if not record.success:
            return 0.0
        if record.shortest is None:
            return None
        longest = max(record.shortest, record.driven)
        return record.shortest / longest if longest else 1.0


@dataclass(frozen=True, kw_only=True)
class RouteCompletion(SessionMetric):
    """Share of the route through the live subgoals that was driven (`session_record.route_completion`)."""

    key: ClassVar[str] = "route_completion"
    title: ClassVar[str] = "completion"
    worst: ClassVar[float | None] = 0.0

    def value(self, record: SessionRecord) -> float | None:
        """Returns the share."""
        return record.completion


@dataclass(frozen=True, kw_only=True)
class InfractionScore(SessionMetric):
    """Product of the penalties of all infractions; 1 without infractions.

    Attributes:
        penalties: factor of each kind of infraction; other kinds have the factor 1.
    """

    key: ClassVar[str] = "infraction_score"
    title: ClassVar[str] = "infraction score"
    is_share: ClassVar[bool] = False
    penalties: Mapping[str, float] = field(default_factory=lambda: PENALTIES)

    def value(self, record: SessionRecord) -> float:
        """Returns the product."""
        product = 1.0
        for name, count in record.infractions.items():
            product *= math.prod([self.penalties.get(name, 1.0)] * count)
        return product


@dataclass(frozen=True, kw_only=True)
class Infractions(SessionMetric):
    """Number of infractions of a session that have a penalty."""

    key: ClassVar[str] = "infractions"
    title: ClassVar[str] = "infractions"
    is_share: ClassVar[bool] = False

    def value(self, record: SessionRecord) -> float:
        """Returns the number."""
        return float(sum(count for name, count in record.infractions.items() if name in PENALTIES))


@dataclass(frozen=True, kw_only=True)
class DrivingScore(SessionMetric):
    """Route completion x infraction score."""

    key: ClassVar[str] = "driving_score"
    title: ClassVar[str] = "driving score"
    worst: ClassVar[float | None] = 0.0

    def value(self, record: SessionRecord) -> float | None:
        """Returns the product."""
        return None if record.completion is None else record.completion * InfractionScore().value(record)


@dataclass(frozen=True, kw_only=True)
class TimelyCompletion(SessionMetric):
    """Route completion x infraction score x min(1, 2 T_ref / T), with the time T and the reference time T_ref.

    The reference is that of the scenario (`ReferenceDrive`); sessions without one are left out.
    """

    key: ClassVar[str] = "timely_completion"
    title: ClassVar[str] = "timely completion"
    worst: ClassVar[float | None] = 0.0
    optional: ClassVar[bool] = True

    def value(self, record: SessionRecord) -> float | None:
        """Returns the product."""
        score = DrivingScore().value(record)
        if record.reference is None or score is None:
            return None
        return score * min(1.0, TIMELY * record.reference.seconds_for(record.live) / max(record.seconds, 1e-9))


TIMELY: Final = 2.0
"""Time up to which a completion is timely, as a multiple of the reference time."""


@dataclass(frozen=True, kw_only=True)
class Seconds(SessionMetric):
    """Simulated time of a session [s]."""

    key: ClassVar[str] = "seconds"
    title: ClassVar[str] = "seconds"
    is_share: ClassVar[bool] = False

    def value(self, record: SessionRecord) -> float:
        """Returns the time."""
        return record.seconds


@dataclass(frozen=True, kw_only=True)
class ExchangesPerSubgoal(ClosedLoopMetric):
    """Exchanges per live subgoal, reached or not."""

    key: ClassVar[str] = "exchanges_per_subgoal"
    title: ClassVar[str] = "exchanges / subgoal"
    is_share: ClassVar[bool] = False

    def parts(self, record: SessionRecord) -> tuple[float, float]:
        """Returns exchanges, and live subgoals."""
        return record.talk.exchanges, record.live


@dataclass(frozen=True, kw_only=True)
class UtterancesPerSubgoal(ClosedLoopMetric):
    """Utterances of participant and Co-Wizard per live subgoal, reached or not."""

    key: ClassVar[str] = "utterances_per_subgoal"
    title: ClassVar[str] = "utterances / subgoal"
    is_share: ClassVar[bool] = False

    def parts(self, record: SessionRecord) -> tuple[float, float]:
        """Returns utterances, and live subgoals."""
        return record.talk.utterances, record.live


@dataclass(frozen=True, kw_only=True)
class AbandonedExchanges(ClosedLoopMetric):
    """Share of the exchanges that were abandoned without an answer."""

    key: ClassVar[str] = "abandoned_exchanges"
    title: ClassVar[str] = "exchanges abandoned"

    def parts(self, record: SessionRecord) -> tuple[float, float]:
        """Returns abandoned exchanges, and all exchanges."""
        return record.talk.abandoned, record.talk.exchanges


@dataclass(frozen=True, kw_only=True)
class ClarificationRate(ClosedLoopMetric):
    """Clarifying moves (Confuse, Clarify, Check) per exchange."""

    key: ClassVar[str] = "clarification_rate"
    title: ClassVar[str] = "clarifications / exchange"
    is_share: ClassVar[bool] = False

    def parts(self, record: SessionRecord) -> tuple[float, float]:
        """Returns such moves, and exchanges."""
        return record.talk.clarifications, record.talk.exchanges


@dataclass(frozen=True, kw_only=True)
class ExceptionsMet(SessionMetric):
    """Number of exceptions that the car met (`met_exceptions`)."""

    key: ClassVar[str] = "exceptions_met"
    title: ClassVar[str] = "exceptions met"
    is_share: ClassVar[bool] = False

    def value(self, record: SessionRecord) -> float:
        """Returns the number."""
        return float(sum(each.met is not None for each in record.exceptions))


@dataclass(frozen=True, kw_only=True)
class ExceptionsRecovered(ClosedLoopMetric):
    """Share of the met exceptions from which the car recovered (`met_exceptions`)."""

    key: ClassVar[str] = "exceptions_recovered"
    title: ClassVar[str] = "recovered"

    def parts(self, record: SessionRecord) -> tuple[float, float]:
        """Returns exceptions recovered from, and exceptions met."""
        met = [each for each in record.exceptions if each.met is not None]
        return float(sum(each.seconds is not None for each in met)), float(len(met))


METRICS: Final[tuple[ClosedLoopMetric, ...]] = (
    TalkSuccess(),
    TimelyCompletion(),
    Success(),
    GoalConditionSuccess(),
    SPL(),
    RouteCompletion(),
    Infractions(),
    InfractionScore(),
    DrivingScore(),
    Seconds(),
    ExchangesPerSubgoal(),
    UtterancesPerSubgoal(),
    AbandonedExchanges(),
    ClarificationRate(),
    ExchangesAgainstReference(),
    UnansweredQuestions(),
    UnnecessaryQuestions(),
    Truth(),
    Discomfort(),
    HardBraking(),
    ExceptionsMet(),
    ExceptionsRecovered(),
)
"""All metrics that are ratios of sums, in the order of tables; `RecoverySeconds` is a median."""


@dataclass(frozen=True, kw_only=True)
class RecoverySeconds:
    """Median time from meeting an exception to recovery, over the exceptions recovered from [s]."""

    key: ClassVar[str] = "recovery_seconds"
    title: ClassVar[str] = "seconds to recovery"
    is_share: ClassVar[bool] = False
    optional: ClassVar[bool] = False

    def values(self, record: SessionRecord) -> tuple[float, ...]:
        """Returns the times of one session."""
        return tuple(each.seconds for each in record.exceptions if each.seconds is not None)

    def of(self, records: Iterable[SessionRecord]) -> float | None:
        """Returns the median over the exceptions of the given sessions; None without a recovery."""
        found = [seconds for record in records for seconds in self.values(record)]
        return statistics.median(found) if found else None


@dataclass(frozen=True, kw_only=True)
class AllTrials:
    """Share of the scenarios in which all of several trials are passed: Pass^k (Yao et al., 2024, tau-bench).

    A trial is passed by a success, or by the right reaction to a talk task (`SessionRecord.passed`). Scenarios with
    another number of trials are left out. With `trials` 3 it is Pass^3.
    """

    key: ClassVar[str] = "all_trials"
    title: ClassVar[str] = "Pass^3"
    is_share: ClassVar[bool] = True
    optional: ClassVar[bool] = True
    trials: int = 3

    def interval(self, scenarios: Iterable[Sequence[bool]]) -> MetricInterval:
        """Returns the share with Wilson's interval.

        Args:
            scenarios: whether each trial of each scenario is passed.
        """
        passed = [all(each) for each in scenarios if len(each) == self.trials]
        if not passed:
            return MetricInterval(mean=None)
        low, high = wilson_interval(sum(passed), len(passed))
        return MetricInterval(mean=sum(passed) / len(passed), low=low, high=high)


ShownMetric: TypeAlias = ClosedLoopMetric | RecoverySeconds | AllTrials
"""Metric of the tables: its key, its title, and whether it is a share."""


# --- figures over sessions --------------------------------------------------------------------------------------------

BOOTSTRAP_SEED: Final = 0
"""Seed of the bootstrap samples: equal sessions give equal intervals."""


FigurePage: TypeAlias = dict[str, float | None]
"""Metric over sessions in JSON types: `mean`, `low` and `high`."""


@dataclass(frozen=True, kw_only=True)
class MetricInterval:
    """Metric over sessions with its 95 % interval.

    The interval is Wilson's for a share of sessions (success), and for shares that are 0, or 1, in all sessions, where
    the sessions count as trials. For all others, it is the percentile bootstrap over sessions.

    Attributes:
        mean: value over all sessions; None if undefined.
        low: lower end of the interval; None if undefined or for a single session.
        high: upper end of the interval.
    """

    mean: float | None
    low: float | None = None
    high: float | None = None

    def to_json(self) -> FigurePage:
        """Returns `mean`, `low` and `high`, rounded to 6 decimals, which do not depend on the machine."""
        return {name: None if value is None else round(value, 6) for name, value in vars(self).items()}


def figures_of(records: Sequence[SessionRecord], errored: int = 0) -> dict[str, MetricInterval]:
    """Returns every metric over sessions, by key.

    Args:
        records: records of the finished sessions.
        errored: number of sessions that ended in an error; they count with the `worst` value of a metric.
    """
    found = {metric.key: interval_of(metric, records, errored) for metric in METRICS}
    found[RecoverySeconds.key] = _median(records)
    return found


def interval_of(metric: ClosedLoopMetric, records: Sequence[SessionRecord], errored: int = 0) -> MetricInterval:
    """Returns a metric over sessions with its interval; see `figures_of`."""
    parts = [metric.parts(record) for record in records]
    if metric.worst is not None and not (metric.optional and not any(lower for _, lower in parts)):
        parts += [(metric.worst, 1.0)] * errored
    if not any(lower for _, lower in parts):
        return MetricInterval(mean=None)
    sums = np.array(parts, dtype=np.float64)  # (n, 2)
    upper, lower = sums.sum(axis=0).tolist()
    if metric.is_share and len(parts) > 1 and (metric.counts_sessions or upper in (0.0, lower)):
        sessions = sum(part > 0.0 for _, part in parts)
        low, high = wilson_interval(sessions * upper / lower, sessions)
        return MetricInterval(mean=upper / lower, low=low, high=high)
    drawn = pn.matmul(bootstrap_weights(len(parts), seed=BOOTSTRAP_SEED), sums)  # (RESAMPLES, 2)
    drawn = drawn[drawn[:, 1] > 0.0]
    return _between(float(upper / lower), drawn[:, 0] / drawn[:, 1], len(parts))


def _median(records: Sequence[SessionRecord]) -> MetricInterval:
    """Returns the median time to recovery; sessions are resampled with all their exceptions."""
    metric = RecoverySeconds()
    mean = metric.of(records)
    if mean is None:
        return MetricInterval(mean=None)
    owners = [k for k, record in enumerate(records) for _ in metric.values(record)]
    values = np.array([seconds for record in records for seconds in metric.values(record)])
    order = np.argsort(values, kind="stable")
    counts = bootstrap_weights(len(records), seed=BOOTSTRAP_SEED)[
        :, np.array(owners)[order]
    ]  # occurrences of each value in each sample
    counts = counts[counts.sum(axis=1) > 0.0]
    medians = _weighted_medians(values[order], counts)
    return _between(mean, medians, len(records))


def _weighted_medians(values: NDArray[np.float64], counts: NDArray[np.float64]) -> NDArray[np.float64]:
    """Returns the medians (m,) of ascending values (n,) that occur as often as counts (m, n) state."""
    reached = np.cumsum(counts, axis=1)
    total = reached[:, -1]
    low = (reached >= np.floor((total + 1.0) / 2.0)[:, None]).argmax(axis=1)
    high = (reached >= np.floor(total / 2.0 + 1.0)[:, None]).argmax(axis=1)
    medians: NDArray[np.float64] = (values[low] + values[high]) / 2.0
    return medians


def _between(mean: float, drawn: NDArray[np.float64], sessions: int) -> MetricInterval:
    if sessions < 2 or not len(drawn):
        return MetricInterval(mean=mean)
    low, high = percentile_interval(drawn)
    return MetricInterval(mean=mean, low=low, high=high)
