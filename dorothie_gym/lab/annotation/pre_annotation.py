"""Marks that the classifier of the package suggests, for annotators to accept or to correct."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from dorothie_gym.dialogue.dialogue_act_classifier import guess_act, guess_spans
from dorothie_gym.evaluation.analysis.units import Units
from dorothie_gym.lab.annotation.marks import Annotation, Change, SpanMark
from dorothie_gym.lab.annotation.session_labels import with_labels
from dorothie_gym.lab.annotation.source_text import SourceLine, SourceText, UtteranceId
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.session.recording.header import NATIVE

if TYPE_CHECKING:
    from dorothie_gym.ontology.roles import Role
    from dorothie_gym.session.recording.session import Session


def pre_annotation(session: Session, text: SourceText) -> Annotation:
    """Returns suggested marks of all utterances: spans and acts of the classifier, units by the rules.

    The labels of the session are not read.
    """
    last: dict[Role, DialogueMove] = {}
    guessed = {}
    for line in text.lines:
        after = next((move for speaker, move in last.items() if speaker is not line.id.speaker), None)
        guessed[line.id] = _guess(line, after)
        last[line.id.speaker] = guessed[line.id][-1].move or DialogueMove.IRRELEVANT
    acts = Annotation.empty(text).after(Change(utterances=guessed))
    return acts.after(Change(utterances=_with_units(session, text, acts)))


def _guess(line: SourceLine, after: DialogueMove | None) -> tuple[SpanMark, ...]:
    words = " ".join(line.words)
    found = [(len(span.text.split()), span.act) for span in guess_spans(words, after)]
    if sum(count for count, _ in found) != len(line.words):  # an utterance without words
        found = [(len(line.words), guess_act(words, after))]
    return tuple(SpanMark(words=count, move=act.move, slots=act.slots, suggested=True) for count, act in found)


def _with_units(session: Session, text: SourceText, acts: Annotation) -> dict[UtteranceId, tuple[SpanMark, ...]]:
    """Returns the spans with the exchanges and transactions that the rules derive from the suggested acts."""
    ours = replace(session, header=replace(session.header, source=NATIVE, extra={}))
    units = Units(with_labels(ours, text, acts, {}))
    marked = {}
    for utterance in units.utterances:
        id = UtteranceId(utterance.speaker, utterance.number)
        marked[id] = tuple(
            replace(span, exchange=units.exchange_of(move), transaction=units.transaction_of(move))
            for span, move in zip(acts.utterances[id], utterance.moves, strict=True)
        )
    return marked
