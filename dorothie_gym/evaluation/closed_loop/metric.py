"""Interface of the closed-loop metrics."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Final

if TYPE_CHECKING:
    from dorothie_gym.evaluation.closed_loop.session_record import SessionRecord


TIMEOUT: Final = "timeout"
"""Name of the infraction of a session whose time ran out."""


@dataclass(frozen=True, kw_only=True)
class ClosedLoopMetric(ABC):
    """Metric over one or more sessions.

    Attributes:
        key: name of the metric in JSON.
        title: name of the metric in tables.
        worst: value of a session that ended in an error; None leaves such sessions out.
        is_share: whether tables show the metric in per cent.
        counts_sessions: whether the metric is 0 or 1 for a session.
        optional: whether tables leave it out where no session has it, as without a `ReferenceDrive`.
    """

    key: ClassVar[str]
    title: ClassVar[str]
    worst: ClassVar[float | None] = None
    is_share: ClassVar[bool] = True
    counts_sessions: ClassVar[bool] = False
    optional: ClassVar[bool] = False

    @abstractmethod
    def parts(self, record: SessionRecord) -> tuple[float, float]:
        """Returns the contributions of a session to numerator and denominator; (0, 0) leaves the session out."""

    def of(self, records: Iterable[SessionRecord]) -> float | None:
        """Returns the metric over sessions; None if all are left out."""
        sums = [self.parts(record) for record in records]
        lower = sum(part for _, part in sums)
        return sum(part for part, _ in sums) / lower if lower else None


class SessionMetric(ClosedLoopMetric):
    """Metric that a session has once; over several sessions it is the mean."""

    @abstractmethod
    def value(self, record: SessionRecord) -> float | None:
        """Returns the value of a session; None leaves the session out."""

    def parts(self, record: SessionRecord) -> tuple[float, float]:
        """Returns the value and 1, or (0, 0) for a session that is left out."""
        value = self.value(record)
        return (0.0, 0.0) if value is None else (value, 1.0)
