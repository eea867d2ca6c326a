"""Statistics of a corpus, gathered in one pass over its sessions."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, NotRequired, TypedDict

from dorothie_gym.archive.corpus import Corpus, Fold
from dorothie_gym.evaluation.analysis.agreement import inconsistencies
from dorothie_gym.evaluation.analysis.diversity import (
    has_language_models,
    plain,
    repetition,
    trigram_perplexity,
    words_of,
)
from dorothie_gym.evaluation.analysis.phenomena.catalogue import PHENOMENA
from dorothie_gym.evaluation.analysis.phenomena.dialogue_view import DialogueView, Phenomenon
from dorothie_gym.evaluation.analysis.profiles import Profiles, counted
from dorothie_gym.evaluation.analysis.units import Units
from dorothie_gym.ontology.actions import NAVIGATION_ACTIONS, PhysicalAction
from dorothie_gym.ontology.roles import Role

if TYPE_CHECKING:
    from dorothie_gym.session.recording.events import ActionRecord
    from dorothie_gym.session.recording.session import Session

_STEADY = (PhysicalAction.STOP, PhysicalAction.LANE_FOLLOW)
"""Navigation actions without an effect when repeated."""


def effective_actions(session: Session) -> Iterator[ActionRecord]:
    """Yields the effective actions of the Co-Wizard.

    Refused actions are not recorded as actions. Switching lights to their current state, a stop after a stop, and a
    lane follow after a lane follow have no effect. Hazard stops, and driving on after them, are
    actions of the car itself.
    """
    lights: bool | None = None
    last: PhysicalAction | None = None
    for action in session.physical_actions:
        if action.source is not Role.CO_WIZARD:
            continue
        if action.action is PhysicalAction.LIGHT_CHANGE:
            if action.up is not None and action.up == lights:
                continue
            lights = action.up
        elif action.action is not PhysicalAction.SPEED_CHANGE:
            if action.action in _STEADY and action.action is last:
                continue
            last = action.action
        yield action


# --- Counts (table 2 of the paper) -----------------------------------------------------------------------------------

PAPER: Final[Mapping[str, float]] = MappingProxyType(
    {
        "sessions": 183,
        "control_hours": 18.7,
        "audio_hours": 2.9,
        "utterances": 8415,
        "words": 50398,
        "vocabulary": 1373,
        "transactions": 578,
        "exchanges": 4089,
        "moves": 11623,
        "slot_values": 8618,
        "physical_actions": 9448,
    }
)
"""Table 2 of the paper."""


@dataclass
class Counts:
    """Counts over sessions.

    Attributes:
        sessions: number of sessions.
        control_seconds: their duration [s].
        audio_seconds: speaking time of the participants [s].
        transactions: transactions by the rule of `dialogue.transactions`.
        exchanges: exchanges by the rule of `dialogue.exchanges`.
        moves: dialogue moves of participants and Co-Wizards.
        slot_values: slot values of these moves.
        physical_actions: effective actions of the Co-Wizards.
        words: counts of words.
        texts: counts of utterances, ignoring case and punctuation.
        folds: sessions by fold, without those outside of folds.
    """

    sessions: int = 0
    control_seconds: float = 0.0
    audio_seconds: float = 0.0
    transactions: int = 0
    exchanges: int = 0
    moves: int = 0
    slot_values: int = 0
    physical_actions: int = 0
    words: Counter[str] = field(default_factory=Counter)
    texts: Counter[str] = field(default_factory=Counter)
    folds: Counter[Fold] = field(default_factory=Counter)

    def add(self, session: Session, units: Units, fold: Fold | None) -> None:
        """Counts a session."""
        self.sessions += 1
        self.control_seconds += session.duration
        self.transactions += len(units.transactions)
        self.exchanges += len(units.exchanges)
        self.physical_actions += sum(1 for _ in effective_actions(session))
        for utterance in units.utterances:
            self.texts[plain(utterance.text)] += 1
            self.words.update(words_of(utterance.text))
            self.moves += len(utterance.moves)
            self.slot_values += sum(len(move.act.slots) for move in utterance.moves)
        self.audio_seconds += _spoken_seconds(
            (utterance.start, utterance.end) for utterance in units.utterances if utterance.speaker is Role.PARTICIPANT
        )
        if fold is not None:
            self.folds[fold] += 1

    @property
    def utterances(self) -> int:
        """Number of utterances of participants and Co-Wizards."""
        return self.texts.total()

    @property
    def heading(self) -> str:
        """Numbers of sessions, utterances, transactions and exchanges, as text."""
        return " · ".join(
            counted(count, noun)
            for count, noun in (
                (self.sessions, "session"),
                (self.utterances, "utterance"),
                (self.transactions, "transaction"),
                (self.exchanges, "exchange"),
            )
        )

    def to_json(self) -> dict[str, Any]:
        """Returns the figures of the table; the ratio is None without utterances."""
        return {
            "sessions": self.sessions,
            "control_hours": self.control_seconds / 3600,
            "audio_hours": self.audio_seconds / 3600,
            "utterances": self.utterances,
            "words": self.words.total(),
            "vocabulary": len(self.words),
            "transactions": self.transactions,
            "exchanges": self.exchanges,
            "moves": self.moves,
            "slot_values": self.slot_values,
            "physical_actions": self.physical_actions,
            "folds": {fold.value: self.folds[fold] for fold in Fold if self.folds[fold]},
            "distinct_utterance_ratio": len(self.texts) / self.utterances if self.utterances else None,
        }


def _spoken_seconds(stretches: Iterable[tuple[float, float]]) -> float:
    """Returns the total length of stretches [s]; overlaps count once."""
    total, until = 0.0, 0.0
    for start, end in sorted(stretches):
        total += max(0.0, end - max(start, until))
        until = max(until, end)
    return total


# --- Most frequent labels --------------------------------------------------------------------------------------------

SEEN_SHARES: Final[Mapping[str, float]] = MappingProxyType(
    {
        "commonest_human_move": 0.315,
        "commonest_car_move": 0.244,
        "commonest_navigation_action": 0.315,
        "human_moves_without_slot": 0.369,
        "car_moves_without_slot": 0.557,
    }
)
"""Shares in the paper's seen towns (spec of the dialogue, Anchors)."""

UNSEEN_SHARES: Final[Mapping[str, float]] = MappingProxyType(
    {
        "commonest_human_move": 0.376,
        "commonest_car_move": 0.307,
        "commonest_navigation_action": 0.369,
        "human_moves_without_slot": 0.262,
        "car_moves_without_slot": 0.548,
    }
)
"""Shares in the paper's unseen town."""

ANCHOR_TOLERANCE = 0.08
"""Accepted difference from the shares in seen towns."""


class AnchorRow(TypedDict):
    """Share of a label in a corpus and in the paper; fields as in `Anchors.to_json`."""

    label: NotRequired[str | None]
    share: float | None
    points: int
    paper: float
    paper_unseen: float
    within: bool | None


@dataclass
class Anchors:
    """Counts of the labels of the three tasks: flagged moves of both speakers, flagged navigation actions."""

    moves: dict[Role, Counter[str]] = field(
        default_factory=lambda: {Role.PARTICIPANT: Counter(), Role.CO_WIZARD: Counter()}
    )
    without_slot: Counter[Role] = field(default_factory=Counter)
    actions: Counter[str] = field(default_factory=Counter)

    def add(self, session: Session) -> None:
        """Counts the points of a session."""
        for move in session.all_moves:
            if move.flagged and move.speaker in self.moves:
                self.moves[move.speaker][move.act.move.label] += 1
                self.without_slot[move.speaker] += not move.act.slots
        for action in session.physical_actions:
            if action.flagged and action.source is Role.CO_WIZARD and action.action in NAVIGATION_ACTIONS:
                self.actions[action.action.label] += 1

    def to_json(self) -> dict[str, AnchorRow]:
        """Returns for each anchor `share` and `points` (and `label` of the most frequent class), `paper`, `within`.

        `paper` is the share in seen towns, `within` whether the corpus differs by at most `ANCHOR_TOLERANCE`. Share and
        `within` are None without a point.
        """
        human, car = self.moves[Role.PARTICIPANT], self.moves[Role.CO_WIZARD]
        commonest = {
            "commonest_human_move": human,
            "commonest_car_move": car,
            "commonest_navigation_action": self.actions,
        }
        without_slot = (
            ("human_moves_without_slot", Role.PARTICIPANT, human),
            ("car_moves_without_slot", Role.CO_WIZARD, car),
        )
        return {
            **{key: _commonest(key, counts) for key, counts in commonest.items()},
            **{key: _share(key, self.without_slot[role], counts.total()) for key, role, counts in without_slot},
        }


def anchors_of(sessions: Iterable[Session]) -> dict[str, AnchorRow]:
    """Returns the anchors of sessions in the form of `Anchors.to_json`."""
    anchors = Anchors()
    for session in sessions:
        anchors.add(session)
    return anchors.to_json()


def _commonest(name: str, counts: Counter[str]) -> AnchorRow:
    label, count = min(counts.items(), key=lambda item: (-item[1], item[0])) if counts else (None, 0)
    return {"label": label, **_share(name, count, counts.total())}


def _share(name: str, count: int, points: int) -> AnchorRow:
    share = count / points if points else None
    return {
        "share": share,
        "points": points,
        "paper": SEEN_SHARES[name],
        "paper_unseen": UNSEEN_SHARES[name],
        "within": None if share is None else abs(share - SEEN_SHARES[name]) <= ANCHOR_TOLERANCE,
    }


# --- Statistics of a corpus ------------------------------------------------------------------------------------------


@dataclass
class CorpusStats:
    """Statistics of a corpus.

    Attributes:
        counts: table 2 of the paper.
        anchors: shares of the most frequent labels.
        profiles: moves and slots per transaction and exchange.
        texts: utterances of the training and the test folds.
        incomplete: names of interrupted sessions, whose recorded part counts.
    """

    counts: Counts = field(default_factory=Counts)
    anchors: Anchors = field(default_factory=Anchors)
    profiles: Profiles = field(default_factory=Profiles)
    texts: dict[str, list[str]] = field(default_factory=lambda: {"train": [], "test": []})
    incomplete: list[str] = field(default_factory=list)

    def add(self, session: Session, fold: Fold | None = None) -> None:
        """Counts a session."""
        units = Units(session)
        self.counts.add(session, units, fold)
        self.anchors.add(session)
        self.profiles.add(units)
        split = None if fold is None else fold.value.split("/")[0]
        if split in self.texts:
            self.texts[split].extend(utterance.text for utterance in units.utterances)
        if not session.complete:
            self.incomplete.append(session.name)

    def diversity(self) -> dict[str, object]:
        """Returns measures of lexical diversity.

        Returns:
            The figures of `diversity.repetition`, and `perplexity` of the test folds under a trigram model of the
            training folds; None without such folds or nltk, or if it is infinite.
        """
        train, test = self.texts["train"], self.texts["test"]
        perplexity = trigram_perplexity(train, test) if has_language_models() else None
        if perplexity is not None and not math.isfinite(perplexity):
            perplexity = None
        return {**repetition(self.counts.texts), "perplexity": perplexity}

    def to_json(self) -> dict[str, Any]:
        """Returns the figures of table 2, `anchors` and `diversity`."""
        return {**self.counts.to_json(), "anchors": self.anchors.to_json(), "diversity": self.diversity()}


def corpus_stats_of(corpus: Corpus) -> CorpusStats:
    """Returns the statistics of a corpus; raises `SessionError` if a session cannot be read."""
    census = CorpusStats()
    for entry in corpus.entries:
        census.add(entry.load(), entry.fold)
    return census


class PhenomenonRow(TypedDict):
    """Counts of a phenomenon, see `phenomena_of`."""

    number: int
    title: str
    cause: str
    sessions: int
    occurs: int
    share: float | None
    findings: int
    forms: dict[str, int]
    example: dict[str, object] | None


def phenomena_of(sessions: Iterable[Session]) -> list[PhenomenonRow]:
    """Returns counts of the 24 phenomena.

    Returns:
        For each phenomenon `number`, `title`, `cause`, the number of `sessions` with its cause, the number of those in
        which it `occurs`, their `share` (None without a cause), the total of `findings`, `forms` ({form: findings}),
        and `example`: session, time [s] and text of the first finding, or None.
    """
    rows = [_Row(phenomenon) for phenomenon in PHENOMENA]
    for session in sessions:
        talk = DialogueView(session)
        for row in rows:
            row.add(talk)
    return [row.to_json() for row in rows]


def faults_of_corpus(corpus: Corpus) -> dict[str, tuple[str, ...]]:
    """Returns the annotation faults of each session, by the path of its folder within the corpus."""
    return {_name(corpus, entry.path): inconsistencies(entry.load()) for entry in corpus.entries}


def _name(corpus: Corpus, path: Path) -> str:
    return str(path.relative_to(corpus.root)) if path != corpus.root else path.resolve().name


class _Row:
    def __init__(self, phenomenon: Phenomenon) -> None:
        self.phenomenon = phenomenon
        self.sessions = self.occurs = 0
        self.forms = dict.fromkeys(phenomenon.forms, 0)
        self.example: dict[str, object] | None = None

    def add(self, talk: DialogueView) -> None:
        if not self.phenomenon.has_cause(talk):
            return
        self.sessions += 1
        findings = list(self.phenomenon.find(talk))
        self.occurs += bool(findings)
        for finding in findings:
            self.forms[finding.form] += 1
        if findings and self.example is None:
            turn = findings[0].turn
            self.example = {"session": talk.session.name, "time": round(turn.start, 1), "text": turn.text}

    def to_json(self) -> PhenomenonRow:
        return {
            "number": self.phenomenon.number,
            "title": self.phenomenon.title,
            "cause": self.phenomenon.cause,
            "sessions": self.sessions,
            "occurs": self.occurs,
            "share": self.occurs / self.sessions if self.sessions else None,
            "findings": sum(self.forms.values()),
            "forms": self.forms,
            "example": self.example,
        }
