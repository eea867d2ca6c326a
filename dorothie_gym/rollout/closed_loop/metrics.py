"""Closed-loop metrics (spec: metrics), each a class that reads a session's record.

Over several sessions a metric is the ratio of the sums of its two parts: of those that a session has once (its success,
its driving score) that is the mean over sessions; of those per subgoal, per exchange or per exception met it is over
all subgoals, exchanges or exceptions, so that a session in which little was said counts little.
"""

from __future__ import annotations

import statistics
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import ClassVar, Final

from dorothie_gym.rollout.closed_loop.session_record import TIMEOUT, SessionRecord

PENALTIES: Final[Mapping[str, float]] = MappingProxyType(
    {"pedestrian": 0.50, "vehicle": 0.60, "static": 0.65, "red_light": 0.70, "stop_sign": 0.80, TIMEOUT: 0.70}
)
"""What one infraction leaves of the driving score, as in the CARLA leaderboard (leaderboard.carla.org, version 2)."""


@dataclass(frozen=True, kw_only=True)
class Metric(ABC):
    """One number for one or more sessions.

    Attributes:
        key: its name in JSON.
        title: how tables call it.
        worst: what a session counts for that ended in an error; None where such a session counts in none.
        is_share: whether it is a share, which tables show in per cent.
    """

    key: ClassVar[str]
    title: ClassVar[str]
    worst: ClassVar[float | None] = None
    is_share: ClassVar[bool] = True

    @abstractmethod
    def parts(self, record: SessionRecord) -> tuple[float, float]:
        """Returns what the session adds to the upper and to the lower sum; (0, 0) where it counts in none."""

    def of(self, records: Iterable[SessionRecord]) -> float | None:
        """Returns the metric over some sessions; None where nothing counts."""
        sums = [self.parts(record) for record in records]
        lower = sum(part for _, part in sums)
        return sum(part for part, _ in sums) / lower if lower else None


@dataclass(frozen=True, kw_only=True)
class Success(Metric):
    """Whether all live subgoals were reached in an order that is allowed, the destination last, and nothing was hit."""

    key: ClassVar[str] = "success"
    title: ClassVar[str] = "success"
    worst: ClassVar[float | None] = 0.0

    def parts(self, record: SessionRecord) -> tuple[float, float]:
        """Success, and 1."""
        return float(record.success), 1.0


@dataclass(frozen=True, kw_only=True)
class GoalConditionSuccess(Metric):
    """Share of the live subgoals that were reached (ALFRED; Shridhar et al., 2020)."""

    key: ClassVar[str] = "goal_condition_success"
    title: ClassVar[str] = "goals"
    worst: ClassVar[float | None] = 0.0

    def parts(self, record: SessionRecord) -> tuple[float, float]:
        """The share, and 1."""
        return (record.reached / record.live, 1.0) if record.live else (0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class SPL(Metric):
    """Success weighted by path length: success x shortest / max(shortest, driven) (Anderson et al., 2018)."""

    key: ClassVar[str] = "spl"
    title: ClassVar[str] = "SPL"
    worst: ClassVar[float | None] = 0.0

    def parts(self, record: SessionRecord) -> tuple[float, float]:
        """The product, and 1."""
        if not record.success:
            return 0.0, 1.0
        if record.shortest is None:
            return 0.0, 0.0
        longest = max(record.shortest, record.driven)
        return (record.shortest / longest if longest else 1.0), 1.0


@dataclass(frozen=True, kw_only=True)
class RouteCompletion(Metric):
    """Share of the way through the live subgoals that was done (`record.route_completion`)."""

    key: ClassVar[str] = "route_completion"
    title: ClassVar[str] = "completion"
    worst: ClassVar[float | None] = 0.0

    def parts(self, record: SessionRecord) -> tuple[float, float]:
        """The share, and 1."""
        return (0.0, 0.0) if record.completion is None else (record.completion, 1.0)


@dataclass(frozen=True, kw_only=True)
class InfractionScore(Metric):
    """Product of the penalties of all infractions; 1 without any.

    Attributes:
        penalties: factor of each kind of infraction; others cost nothing.
    """

    key: ClassVar[str] = "infraction_score"
    title: ClassVar[str] = "infraction score"
    is_share: ClassVar[bool] = False
    penalties: Mapping[str, float] = field(default_factory=lambda: PENALTIES)

    def parts(self, record: SessionRecord) -> tuple[float, float]:
        """The product, and 1."""
        product = 1.0
        for name, count in record.infractions.items():
            product *= self.penalties.get(name, 1.0) ** count
        return product, 1.0


@dataclass(frozen=True, kw_only=True)
class Infractions(Metric):
    """Infractions of a session that cost something."""

    key: ClassVar[str] = "infractions"
    title: ClassVar[str] = "infractions"
    is_share: ClassVar[bool] = False

    def parts(self, record: SessionRecord) -> tuple[float, float]:
        """Their number, and 1."""
        return float(sum(count for name, count in record.infractions.items() if name in PENALTIES)), 1.0


@dataclass(frozen=True, kw_only=True)
class DrivingScore(Metric):
    """Route completion x infraction score."""

    key: ClassVar[str] = "driving_score"
    title: ClassVar[str] = "driving score"
    worst: ClassVar[float | None] = 0.0

    def parts(self, record: SessionRecord) -> tuple[float, float]:
        """The product, and 1."""
        share, counts = RouteCompletion().parts(record)
        return share * InfractionScore().parts(record)[0], counts


@dataclass(frozen=True, kw_only=True)
class Seconds(Metric):
    """Simulated time of a session [s]."""

    key: ClassVar[str] = "seconds"
    title: ClassVar[str] = "seconds"
    is_share: ClassVar[bool] = False

    def parts(self, record: SessionRecord) -> tuple[float, float]:
        """The time, and 1."""
        return record.seconds, 1.0


@dataclass(frozen=True, kw_only=True)
class ExchangesPerSubgoal(Metric):
    """Exchanges for each live subgoal, reached or not."""

    key: ClassVar[str] = "exchanges_per_subgoal"
    title: ClassVar[str] = "exchanges / subgoal"
    is_share: ClassVar[bool] = False

    def parts(self, record: SessionRecord) -> tuple[float, float]:
        """Exchanges, and live subgoals."""
        return record.talk.exchanges, record.live


@dataclass(frozen=True, kw_only=True)
class UtterancesPerSubgoal(Metric):
    """Utterances of participant and Co-Wizard for each live subgoal, reached or not."""

    key: ClassVar[str] = "utterances_per_subgoal"
    title: ClassVar[str] = "utterances / subgoal"
    is_share: ClassVar[bool] = False

    def parts(self, record: SessionRecord) -> tuple[float, float]:
        """Utterances, and live subgoals."""
        return record.talk.utterances, record.live


@dataclass(frozen=True, kw_only=True)
class AbandonedExchanges(Metric):
    """Share of the exchanges that were given up without an answer."""

    key: ClassVar[str] = "abandoned_exchanges"
    title: ClassVar[str] = "exchanges abandoned"

    def parts(self, record: SessionRecord) -> tuple[float, float]:
        """Those that were abandoned, and all."""
        return record.talk.abandoned, record.talk.exchanges


@dataclass(frozen=True, kw_only=True)
class ClarificationRate(Metric):
    """Moves that repair or make sure (Confuse, Clarify, Check) for each exchange."""

    key: ClassVar[str] = "clarification_rate"
    title: ClassVar[str] = "clarifications / exchange"
    is_share: ClassVar[bool] = False

    def parts(self, record: SessionRecord) -> tuple[float, float]:
        """Such moves, and exchanges."""
        return record.talk.clarifications, record.talk.exchanges


@dataclass(frozen=True, kw_only=True)
class ExceptionsMet(Metric):
    """Exceptions that a session met (`recovery`)."""

    key: ClassVar[str] = "exceptions_met"
    title: ClassVar[str] = "exceptions met"
    is_share: ClassVar[bool] = False

    def parts(self, record: SessionRecord) -> tuple[float, float]:
        """Their number, and 1."""
        return float(sum(each.met is not None for each in record.exceptions)), 1.0


@dataclass(frozen=True, kw_only=True)
class ExceptionsRecovered(Metric):
    """Share of the exceptions met that were recovered from (`recovery`)."""

    key: ClassVar[str] = "exceptions_recovered"
    title: ClassVar[str] = "recovered"

    def parts(self, record: SessionRecord) -> tuple[float, float]:
        """Those recovered from, and those met."""
        met = [each for each in record.exceptions if each.met is not None]
        return float(sum(each.seconds is not None for each in met)), float(len(met))


METRICS: Final[tuple[Metric, ...]] = (
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
    ExceptionsMet(),
    ExceptionsRecovered(),
)
"""All metrics that are ratios of sums, in the order of tables; `RecoverySeconds` is a median."""


@dataclass(frozen=True, kw_only=True)
class RecoverySeconds:
    """Median time from meeting an exception to having recovered from it, over those recovered from [s]."""

    key: ClassVar[str] = "recovery_seconds"
    title: ClassVar[str] = "seconds to recovery"
    is_share: ClassVar[bool] = False

    def values(self, record: SessionRecord) -> tuple[float, ...]:
        """The times of one session."""
        return tuple(each.seconds for each in record.exceptions if each.seconds is not None)

    def of(self, records: Iterable[SessionRecord]) -> float | None:
        """Returns the median over the exceptions of some sessions; None where none was recovered from."""
        found = [seconds for record in records for seconds in self.values(record)]
        return statistics.median(found) if found else None
