"""Small sessions and random annotations."""

from __future__ import annotations

import random
from pathlib import Path

from dorothie_gym.evaluation.analysis import Handled
from dorothie_gym.lab.annotation.log import AnnotationLog
from dorothie_gym.lab.annotation.marks import Annotation, Change, ExchangeMark, SpanMark, TransactionMark
from dorothie_gym.lab.annotation.source_text import SourceText, UtteranceId
from dorothie_gym.ontology import DialogueMove, DialogueUnit, LandmarkName, Role, SlotValue
from dorothie_gym.ontology.dialogue_acts import LABELS
from dorothie_gym.session.recording import Session
from tests.session.recording.builders import write
from tests.session.recording.dialogues import talk

FIRST = UtteranceId(Role.PARTICIPANT, 0)
"""To the KFC please."""
OKAY = UtteranceId(Role.CO_WIZARD, 1)
"""Okay, turning left."""
YES = UtteranceId(Role.PARTICIPANT, 2)
"""Yes, left on Fuller."""


def recorded(folder: Path) -> tuple[Session, SourceText]:
    """A written session of five utterances, and its text."""
    session = Session.load(write(folder, talk()))
    return session, SourceText.of(session)


def span(words: int, move: DialogueMove | None = None, *slots: SlotValue, **fields: object) -> SpanMark:
    return SpanMark(words=words, move=move, slots=frozenset(slots), **fields)  # type: ignore[arg-type]


def random_change(text: SourceText, rng: random.Random, *, complete: bool = False) -> Change:
    """Marks of a few utterances, or of all of them with a move for every span."""
    lines = text.lines if complete else rng.sample(text.lines, rng.randint(1, len(text.lines)))
    utterances = {}
    for line in lines:
        left, spans = len(line.words), list[SpanMark]()
        while left:
            words = rng.randint(1, left)
            move = rng.choice(list(DialogueMove)) if complete or rng.random() < 0.8 else None
            spans.append(
                SpanMark(
                    words=words,
                    move=move,
                    slots=frozenset(rng.sample(LABELS, rng.randint(0, 3))),
                    exchange=rng.choice([None, *range(4)]),
                    transaction=rng.choice([None, 0, 7]),
                    suggested=not complete and move is not None and rng.random() < 0.2,
                )
            )
            left -= words
        utterances[line.id] = tuple(spans)
    return Change(
        utterances=utterances,
        exchanges={
            k: ExchangeMark(exception=rng.choice([None, *Handled]), end=rng.choice([None, *DialogueUnit.EXCHANGE.ends]))
            for k in rng.sample(range(4), rng.randint(0, 4))
        },
        transactions={
            k: TransactionMark(
                goal=rng.choice([None, *LandmarkName]), end=rng.choice([None, *DialogueUnit.TRANSACTION.ends])
            )
            for k in rng.sample([0, 7], rng.randint(0, 2))
        },
    )


def random_annotation(text: SourceText, rng: random.Random, *, complete: bool = False) -> Annotation:
    return Annotation.empty(text).after(random_change(text, rng, complete=complete))


def annotate(folder: Path, text: SourceText, name: str, annotation: Annotation) -> None:
    """Stores the marks of an annotator beside a session."""
    AnnotationLog(text, folder, name).mark(annotation.difference(Annotation.empty(text)))
