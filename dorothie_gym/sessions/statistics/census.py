"""Everything that is counted over a corpus, in one pass over its sessions."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from dorothie_gym.sessions.corpus import Corpus
from dorothie_gym.sessions.folds import Fold
from dorothie_gym.sessions.session import Session
from dorothie_gym.sessions.statistics.anchors import Anchors
from dorothie_gym.sessions.statistics.consistency import inconsistencies
from dorothie_gym.sessions.statistics.counts import Counts
from dorothie_gym.sessions.statistics.diversity import has_language_models, repetition, trigram_perplexity
from dorothie_gym.sessions.statistics.phenomena import PHENOMENA, Phenomenon, Talk
from dorothie_gym.sessions.statistics.profiles import Profiles
from dorothie_gym.sessions.statistics.units import Units


@dataclass
class Census:
    """What a corpus is like.

    Attributes:
        counts: table 2 of the paper.
        anchors: how easy the tasks are for who knows nothing.
        profiles: moves and slots per transaction and exchange.
        texts: the utterances of the folds that train and of those that test.
        incomplete: names of sessions that were cut off; they count as far as they go.
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

    def diversity(self) -> dict[str, Any]:
        """How varied the talk is.

        Returns:
            What `diversity.repetition` tells, and `perplexity` of the utterances of the folds that test under a trigram
            of those that train; None where there are no such folds, nltk is not installed, or it is infinite.
        """
        train, test = self.texts["train"], self.texts["test"]
        perplexity = trigram_perplexity(train, test) if has_language_models() else None
        if perplexity is not None and not math.isfinite(perplexity):
            perplexity = None
        return {**repetition(self.counts.texts), "perplexity": perplexity}

    def to_json(self) -> dict[str, Any]:
        """Returns the figures of table 2, `anchors` and `diversity`."""
        return {**self.counts.to_json(), "anchors": self.anchors.to_json(), "diversity": self.diversity()}


def census_of(corpus: Corpus) -> Census:
    """Counts a corpus; raises `SessionError` where a session cannot be read."""
    census = Census()
    for entry in corpus.entries:
        census.add(entry.load(), entry.fold)
    return census


def phenomena_of(sessions: Iterable[Session]) -> list[dict[str, Any]]:
    """Counts the 24 phenomena.

    Returns:
        For each `number`, `title`, `cause`, in how many `sessions` its cause occurs, in how many of them it `occurs`,
        their `share` (None without a cause), `findings` in all, `forms` ({form: findings}), and `example`: session,
        time [s] and text of the first finding, None if there is none.
    """
    rows = [_Row(phenomenon) for phenomenon in PHENOMENA]
    for session in sessions:
        talk = Talk(session)
        for row in rows:
            row.add(talk)
    return [row.to_json() for row in rows]


def faults_of_corpus(corpus: Corpus) -> dict[str, tuple[str, ...]]:
    """Returns the faults of annotation of each session by the name of its folder within the corpus."""
    return {_name(corpus, entry.path): inconsistencies(entry.load()) for entry in corpus.entries}


def _name(corpus: Corpus, path: Any) -> str:
    return str(path.relative_to(corpus.root)) if path != corpus.root else path.resolve().name


class _Row:
    def __init__(self, phenomenon: Phenomenon) -> None:
        self.phenomenon = phenomenon
        self.sessions = self.occurs = 0
        self.forms = dict.fromkeys(phenomenon.forms, 0)
        self.example: dict[str, Any] | None = None

    def add(self, talk: Talk) -> None:
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

    def to_json(self) -> dict[str, Any]:
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
