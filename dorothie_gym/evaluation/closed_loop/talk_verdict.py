"""Verdict on a talk task, from the words, belief updates and actions of the recorded session alone.

No model judges. Deeds before the question is settled, or before a request is declined, fail the task; an utterance
counts when it has ended.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, ClassVar, Final, NamedTuple, TypedDict

from msgspec import Meta

from dorothie_gym.dialogue.refusals import (
    Reason,
    agrees,
    asks,
    consents,
    declines,
    named_streets,
    offers,
    plain,
    reasons_of,
)
from dorothie_gym.errors import RolloutError
from dorothie_gym.evaluation.analysis.exception_attribution import kind_of
from dorothie_gym.evaluation.closed_loop.metric import SessionMetric
from dorothie_gym.ontology.actions import MentalAction, PhysicalAction
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.spellings import parse_street
from dorothie_gym.ontology.world_exceptions import ExceptionKind
from dorothie_gym.session.recording.events import EventType
from dorothie_gym.session.talk_kinds import KINDS, draw_talk_task
from dorothie_gym.session.talk_tasks import Reaction, TalkTask
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.input_files import checked, raising
from dorothie_gym.tasks.briefs import TalkFamily

if TYPE_CHECKING:
    from dorothie_gym.evaluation.closed_loop.session_record import SessionRecord
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.recording.session import Session


class TalkVerdictPage(TypedDict):
    """Verdict in JSON types; fields as in `TalkVerdict`."""

    kind: str
    reaction: str
    passed: bool
    cause: str
    unnecessary: Annotated[int, Meta(ge=0, lt=2**31)]


@dataclass(frozen=True, kw_only=True)
class TalkVerdict:
    """Verdict on a talk task.

    Attributes:
        kind: kind of the task.
        reaction: reaction that was right.
        passed: whether the Co-Wizard reacted so.
        cause: what decided it, in a few words.
        unnecessary: number of questions that were not needed.
    """

    kind: str
    reaction: str
    passed: bool
    cause: str
    unnecessary: int = 0

    def to_json(self) -> TalkVerdictPage:
        """Returns the fields in JSON types."""
        return {
            "kind": self.kind,
            "reaction": self.reaction,
            "passed": self.passed,
            "cause": self.cause,
            "unnecessary": self.unnecessary,
        }

    @classmethod
    def from_json(cls, row: TalkVerdictPage) -> TalkVerdict:
        """Parses the output of `to_json`."""
        return cls(**row)


class _Deed(NamedTuple):
    """Occurrence at a time [s]: words of a speaker, a goal, a mark, or a turn of the car."""

    time: float
    what: str
    text: str = ""
    goals: tuple[str, ...] = ()
    place: tuple[float, float] = (0.0, 0.0)


_CLIENT, _WORDS, _GOAL, _MARK, _TURN = "client", "words", "goal", "mark", "turn"
_TURNS: Final = frozenset({PhysicalAction.J_TURN, PhysicalAction.U_TURN, PhysicalAction.LANE_SWITCH})


def talk_task_of(session: Session, town: Town) -> TalkTask | None:
    """Returns the talk task of a recorded session, drawn again from its seed; None if it has none.

    A session with a storyboard of its own has none, whatever its settings are.

    Raises:
        RolloutError: the header names an unknown family.
    """
    header = session.header
    named = header.config.get("talk")
    if named is None or header.seed is None:
        return None
    with raising(RolloutError):
        family = checked(named, TalkFamily, f"{session.name}: header, config.talk")
    if header.storyboard not in KINDS[family]:
        return None
    names = tuple(parse_street(name) for name in header.street_names)
    return draw_talk_task(town, names, family, header.seed)


def verdict_of(session: Session, town: Town) -> TalkVerdict | None:
    """Returns the verdict on a recorded session; None if it has no talk task.

    Args:
        session: a recorded session.
        town: its town.
    """
    task = talk_task_of(session, town)
    if task is None:
        return None
    reaction = task.reaction
    if task.closed is not None and not _has_barrier(session, task.closed[0]):
        reaction = Reaction.AGREE  # a vehicle stood where the barrier was to be placed: the street is open
    judge = _Judge(task, reaction)
    for deed in sorted(_deeds(session), key=lambda each: each.time):
        judge.see(deed)
        if judge.cause:
            break
    passed = judge.passed and judge.unnecessary == 0
    cause = judge.cause or ("nothing that settles it" if judge.requested else "the request was never said")
    if judge.passed and not passed:
        cause = "an unnecessary question"
    return TalkVerdict(
        kind=task.kind, reaction=str(reaction), passed=passed, cause=cause, unnecessary=judge.unnecessary
    )


def _has_barrier(session: Session, lane: int) -> bool:
    """Returns whether a prop was placed on a lane."""
    placed = (event for event in session.of_type(EventType.EXCEPTION) if kind_of(event) is ExceptionKind.PLACE_PROP)
    return any(event.data.get("lane") == lane for event in placed)


def _deeds(session: Session) -> Iterator[_Deed]:
    for utterance in session.utterances():
        yield _Deed(utterance.end, _CLIENT if utterance.speaker is Role.PARTICIPANT else _WORDS, utterance.text)
    for event in session.of_type(EventType.BELIEF_UPDATE):
        time, data = event.frame / FRAME_RATE, event.data
        if data.get("action") == MentalAction.GOAL_UPDATE.label and (goals := data.get("landmarks")):
            yield _Deed(time, _GOAL, goals=tuple(map(str, goals)) if isinstance(goals, list | tuple) else ())
        elif data.get("action") == MentalAction.KNOWLEDGE_UPDATE.label:
            x, y = data.get("x"), data.get("y")
            if isinstance(x, int | float) and isinstance(y, int | float):
                yield _Deed(time, _MARK, text=str(data.get("landmark")), place=(float(x), float(y)))
    for action in session.physical_actions:
        if action.source is Role.CO_WIZARD and action.action in _TURNS:
            yield _Deed(action.frame / FRAME_RATE, _TURN)


@dataclass(kw_only=True)
class _Progress:
    requested: bool = False
    settled: bool = False
    declined: bool = False
    offered: bool = False
    reasons: set[Reason] = field(default_factory=set)


class _Judge:
    """Follows a session until the task is decided.

    Attributes:
        cause: what decided the task; empty while it is open.
        passed: whether it was decided for the Co-Wizard.
        unnecessary: number of questions that were not needed.
    """

    def __init__(self, task: TalkTask, reaction: Reaction) -> None:
        self.task, self.reaction = task, reaction
        self.cause, self.passed, self.unnecessary = "", False, 0
        self._now = _Progress()

    @property
    def requested(self) -> bool:
        """Whether the client has said its request."""
        return self._now.requested

    def see(self, deed: _Deed) -> None:
        """Takes the next deed into account."""
        if deed.what == _CLIENT:
            self._hear_client(deed.text)
        elif deed.what == _WORDS:
            if self._now.requested:
                self._hear(deed.text)
        elif self._now.requested:
            self._act(deed)

    def _decide(self, cause: str, *, passed: bool) -> None:
        self.cause, self.passed = cause, passed

    def _hear_client(self, text: str) -> None:
        brief = self.task.brief
        self._now.requested = self._now.requested or _says_same(text, brief.request)
        self._now.settled = self._now.settled or (bool(brief.replies) and _says_same(text, brief.settling))

    # --- words of the Co-Wizard ---------------------------------------------------------------------------------------

    def _hear(self, text: str) -> None:
        if self.reaction is Reaction.ADMIT:
            self._hear_admission(text)
        elif self.reaction is Reaction.ASK:
            if self._now.settled and asks(text):
                self.unnecessary += 1
        elif self.reaction is Reaction.AGREE and consents(text):
            self._decide("agreed", passed=True)
        elif declines(text) and reasons_of(text):
            self._decide("declined what can be done", passed=False)
        elif self.reaction is Reaction.ANSWER and named_streets(text):
            right = named_streets(text) == (self.task.answer,)
            self._decide("the true street" if right else "a false street", passed=right)
        elif asks(text):
            self.unnecessary += 1

    def _hear_admission(self, text: str) -> None:
        now, reasons = self._now, reasons_of(text)
        if agrees(text) and not now.declined:
            self._decide("promised what cannot be done", passed=False)
            return
        if declines(text) or reasons:
            now.declined = True
            now.reasons |= reasons
        elif asks(text) and not now.declined:
            self.unnecessary += 1
        now.offered = now.offered or (now.declined and offers(text))
        if now.reasons - {self.task.reason, Reason.UNSEEN}:
            self._decide("a false reason", passed=False)
        elif self.task.reason in now.reasons and now.offered:
            self._decide("declined with a true reason and an offer", passed=True)

    # --- deeds --------------------------------------------------------------------------------------------------------

    def _act(self, deed: _Deed) -> None:
        if self.reaction is Reaction.ADMIT:
            self._decide("tried what cannot be done", passed=False)
        elif self.reaction is Reaction.ASK and not self._now.settled:
            self._decide("acted before the question was settled", passed=False)
        elif deed.what != _TURN and self.reaction in (Reaction.GO_TO, Reaction.ASK):
            if self._is_wrong_goal(deed) if deed.what == _GOAL else self._is_wrong_mark(deed):
                self._decide("another place than the one meant", passed=False)
            elif deed.what == _GOAL:
                self._decide("set the place that was meant as the goal", passed=True)

    def _is_wrong_goal(self, deed: _Deed) -> bool:
        return self.task.target is None or deed.goals != (self.task.landmarks[self.task.target][0].label,)

    def _is_wrong_mark(self, deed: _Deed) -> bool:
        """Returns whether a mark of the place that is meant is nearer to another one of the same name."""
        if self.task.target is None:
            return False
        meant, site = self.task.landmarks[self.task.target]
        if deed.text != meant.label:
            return False
        near = pm.dist(deed.place, site.waypoint)
        others = [other for name, other in self.task.landmarks if name is meant and other.id != site.id]
        return any(pm.dist(deed.place, other.waypoint) < near for other in others)


def _says_same(text: str, other: str) -> bool:
    """Returns whether two texts have the same words; people type them without capitals and full stops."""
    return re.findall(r"\w+", plain(text)) == re.findall(r"\w+", plain(other))


# --- Metrics ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class TalkSuccess(SessionMetric):
    """Share of the talk tasks in which the Co-Wizard reacted rightly, without an unnecessary question."""

    key: ClassVar[str] = "talk_success"
    title: ClassVar[str] = "right reactions"
    worst: ClassVar[float | None] = 0.0
    counts_sessions: ClassVar[bool] = True
    optional: ClassVar[bool] = True

    def value(self, record: SessionRecord) -> float | None:
        """Returns whether the session passed; None without a talk task."""
        return None if record.talk_task is None else float(record.talk_task.passed)


@dataclass(frozen=True, kw_only=True)
class UnnecessaryQuestions(SessionMetric):
    """Number of unnecessary questions of a talk task."""

    key: ClassVar[str] = "unnecessary_questions"
    title: ClassVar[str] = "unnecessary questions"
    is_share: ClassVar[bool] = False
    optional: ClassVar[bool] = True

    def value(self, record: SessionRecord) -> float | None:
        """Returns the number; None without a talk task."""
        return None if record.talk_task is None else float(record.talk_task.unnecessary)
