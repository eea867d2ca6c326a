"""Sub-scores of a session: answers, truth and comfort, and the exchanges compared with those of the reference pair."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar, Final, TypedDict

import numpy as np
from msgspec import Meta

from dorothie_gym.dialogue.exchanges import ExchangeState
from dorothie_gym.evaluation.analysis.truth_checks.session_world import SessionWorld
from dorothie_gym.evaluation.analysis.truth_checks.truth import is_true
from dorothie_gym.evaluation.analysis.units import Units
from dorothie_gym.evaluation.closed_loop.metric import ClosedLoopMetric, SessionMetric
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.roles import Role
from dorothie_gym.sim.config import FRAME_RATE

if TYPE_CHECKING:
    from dorothie_gym.evaluation.closed_loop.session_record import SessionRecord
    from dorothie_gym.maps.model import Array
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.recording.session import Session

QUESTIONS: Final = frozenset({DialogueMove.CHECK, DialogueMove.QUERY_YN, DialogueMove.QUERY_W})
"""Moves that expect an answer."""

STATEMENTS: Final = frozenset(
    {
        DialogueMove.EXPLAIN,
        DialogueMove.CLARIFY,
        DialogueMove.REPLY_Y,
        DialogueMove.REPLY_N,
        DialogueMove.REPLY_W,
        DialogueMove.CONFIRM,
    }
)
"""Moves that state facts."""

MAX_ACCELERATION, MAX_BRAKING, MAX_JERK = 2.40, 4.05, 4.13
"""Bounds of comfort [m/s^2, m/s^2, m/s^3]: those of the metric "ego is comfortable" of nuPlan (Caesar et al. 2021,
arXiv:2106.11810; devkit 1.2), taken there from the driving of people."""

COMFORT_PERIOD: Final = 0.5
"""Time over which accelerations and their changes are averaged [s]."""

MOVING: Final = 0.1
"""Speed above which a car moves [m/s]."""


class ConductPage(TypedDict):
    """Conduct in JSON types; fields as in `ConductRecord`."""

    questions: Annotated[int, Meta(ge=0, lt=2**31)]
    unanswered: Annotated[int, Meta(ge=0, lt=2**31)]
    statements: Annotated[int, Meta(ge=0, lt=2**31)]
    true_statements: Annotated[int, Meta(ge=0, lt=2**31)]
    moving: Annotated[float, Meta(ge=0.0, le=1e9)]
    uncomfortable: Annotated[float, Meta(ge=0.0, le=1e9)]
    hard_brakings: Annotated[int, Meta(ge=0, lt=2**31)]


@dataclass(frozen=True, kw_only=True)
class ConductRecord:
    """Conduct of the Co-Wizard in a session.

    Attributes:
        questions: questions of the participant.
        unanswered: those that were abandoned without an answer.
        statements: statements of the Co-Wizard whose truth the recording determines.
        true_statements: those that are true.
        moving: time for which the car moved [s].
        uncomfortable: the part of it with an acceleration or a jerk out of the bounds of comfort [s].
        hard_brakings: number of times that the car braked harder than `MAX_BRAKING`.
    """

    questions: int = 0
    unanswered: int = 0
    statements: int = 0
    true_statements: int = 0
    moving: float = 0.0
    uncomfortable: float = 0.0
    hard_brakings: int = 0

    def to_json(self) -> ConductPage:
        """Returns the fields in JSON types."""
        return {
            "questions": self.questions,
            "unanswered": self.unanswered,
            "statements": self.statements,
            "true_statements": self.true_statements,
            "moving": self.moving,
            "uncomfortable": self.uncomfortable,
            "hard_brakings": self.hard_brakings,
        }

    @classmethod
    def from_json(cls, row: ConductPage) -> ConductRecord:
        """Parses the output of `to_json`."""
        return cls(**row)


def conduct_of(session: Session, town: Town) -> ConductRecord:
    """Returns the conduct of the Co-Wizard in a session.

    Args:
        session: a recorded session.
        town: its town.
    """
    units = Units(session)
    asked = [
        exchange
        for exchange in units.states.values()
        if exchange.initiator is Role.PARTICIPANT and exchange.move in QUESTIONS and not exchange.unprompted
    ]
    verdicts = _verdicts(session, town)
    moving, uncomfortable, brakings = comfort_of(session.trajectory["speed"])
    return ConductRecord(
        questions=len(asked),
        unanswered=sum(exchange.state is ExchangeState.ABANDONED for exchange in asked),
        statements=len(verdicts),
        true_statements=sum(verdicts),
        moving=moving,
        uncomfortable=uncomfortable,
        hard_brakings=brakings,
    )


def _verdicts(session: Session, town: Town) -> list[bool]:
    """Returns whether each statement of the Co-Wizard is true, without those that the recording leaves open."""
    if not len(session.trajectory):
        return []
    world = SessionWorld(session, town)
    found = [
        is_true(world, said, move.start, Role.CO_WIZARD)
        for move in session.moves()
        if move.speaker is Role.CO_WIZARD and move.act.move in STATEMENTS
        for said in move.meaning
    ]
    return [verdict for verdict in found if verdict is not None]


def comfort_of(speed: Array) -> tuple[float, float, int]:
    """Returns the time of motion and the uncomfortable part of it [s], and the number of hard brakings.

    Args:
        speed: (n,) speed in each frame [m/s].
    """
    step = round(COMFORT_PERIOD * FRAME_RATE)
    sampled = np.asarray(speed, dtype=np.float64)[::step]
    if len(sampled) < 3:
        return 0.0, 0.0, 0
    acceleration = np.diff(sampled) / COMFORT_PERIOD  # (k,)
    jerk = np.diff(acceleration, prepend=acceleration[:1]) / COMFORT_PERIOD
    moves = (sampled[1:] > MOVING) | (sampled[:-1] > MOVING)
    hard = acceleration < -MAX_BRAKING
    out = hard | (acceleration > MAX_ACCELERATION) | (np.abs(jerk) > MAX_JERK)
    begins = hard & ~np.concatenate(([False], hard[:-1]))
    return (
        float(moves.sum()) * COMFORT_PERIOD,
        float((out & moves).sum()) * COMFORT_PERIOD,
        int(begins.sum()),
    )


# --- Metrics ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class ExchangesAgainstReference(ClosedLoopMetric):
    """Exchanges per live subgoal as a multiple of those of the reference pair in the same scenarios."""

    key: ClassVar[str] = "exchanges_against_reference"
    title: ClassVar[str] = "exchanges / reference"
    is_share: ClassVar[bool] = False
    optional: ClassVar[bool] = True

    def parts(self, record: SessionRecord) -> tuple[float, float]:
        """Returns exchanges per subgoal of the session, and of its reference."""
        reference = record.reference
        if reference is None or not record.live or not reference.exchanges or not reference.subgoals:
            return 0.0, 0.0
        return record.talk.exchanges / record.live, reference.exchanges / reference.subgoals


@dataclass(frozen=True, kw_only=True)
class UnansweredQuestions(ClosedLoopMetric):
    """Share of the participant's questions that the Co-Wizard left unanswered."""

    key: ClassVar[str] = "unanswered_questions"
    title: ClassVar[str] = "questions unanswered"

    def parts(self, record: SessionRecord) -> tuple[float, float]:
        """Returns unanswered questions, and all questions."""
        conduct = record.conduct or ConductRecord()
        return conduct.unanswered, conduct.questions


@dataclass(frozen=True, kw_only=True)
class Truth(ClosedLoopMetric):
    """Share of the Co-Wizard's statements that are true, of those whose truth the recording determines."""

    key: ClassVar[str] = "truth"
    title: ClassVar[str] = "true statements"

    def parts(self, record: SessionRecord) -> tuple[float, float]:
        """Returns true statements, and all statements."""
        conduct = record.conduct or ConductRecord()
        return conduct.true_statements, conduct.statements


@dataclass(frozen=True, kw_only=True)
class Discomfort(ClosedLoopMetric):
    """Share of the time of motion with an acceleration or a jerk out of the bounds of comfort."""

    key: ClassVar[str] = "discomfort"
    title: ClassVar[str] = "uncomfortable time"

    def parts(self, record: SessionRecord) -> tuple[float, float]:
        """Returns uncomfortable time, and time of motion [s]."""
        conduct = record.conduct or ConductRecord()
        return conduct.uncomfortable, conduct.moving


@dataclass(frozen=True, kw_only=True)
class HardBraking(SessionMetric):
    """Number of hard brakings of a session."""

    key: ClassVar[str] = "hard_brakings"
    title: ClassVar[str] = "hard brakings"
    is_share: ClassVar[bool] = False

    def value(self, record: SessionRecord) -> float | None:
        """Returns the number."""
        return None if record.conduct is None else float(record.conduct.hard_brakings)
