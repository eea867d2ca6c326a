"""Agreement of annotators who split the same utterances into spans and label them.

Annotators may split an utterance differently. Moves are compared twice: over the spans that both annotators have with
the same borders, and over *pieces*, the stretches of words that no annotator splits. An utterance that an annotator has
not finished is missing for this annotator.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Final, TypeAlias

import numpy as np

from dorothie_gym.errors import SessionError
from dorothie_gym.ontology.dialogue_acts import DialogueAct
from dorothie_gym.ontology.slots import Slot
from dorothie_gym.support.installation import pip_install

_SLOTS: Final = (Slot.ACTION, Slot.STREET, Slot.STATUS, Slot.LANDMARK, Slot.OBJECT)


@dataclass(frozen=True)
class LabelledSpan:
    """Span of an utterance with its label.

    Attributes:
        words: number of its words, at least 1.
        act: move and slots; None if the annotator has not decided.
    """

    words: int
    act: DialogueAct | None


LabelledUtterance: TypeAlias = Sequence[LabelledSpan]
"""Spans of an utterance, in order."""


@dataclass(frozen=True, kw_only=True)
class Agreement:
    """Agreement of two annotators.

    Attributes:
        moves: Cohen's kappa of the moves of pieces; None if both use a single move, so that chance explains the
            agreement.
        slots: Cohen's kappa of the values of each of the five slots in each piece; None in the same case.
        pieces: compared stretches of words.
        utterances: number of utterances that both have finished.
        equal_spans: number of spans with the same borders in both annotations.
        moves_of_equal_spans: Cohen's kappa of the moves of these spans; None in the same case.
        spans: span agreement: F1 of the spans, twice the number of equal ones divided by the number of all spans of
            both; None without spans.
    """

    moves: float | None
    slots: float | None
    pieces: int
    utterances: int
    equal_spans: int
    moves_of_equal_spans: float | None
    spans: float | None


def agreement_of(first: Sequence[LabelledUtterance], second: Sequence[LabelledUtterance]) -> Agreement:
    """Returns the agreement of two annotators of the same utterances.

    For slots, a piece counts once for each of the five slots; its label is the set of the slot's values there.

    Args:
        first: labelled utterances of one annotator.
        second: those of the other one, in the same order, with as many words in each.

    Raises:
        ValueError: the numbers of utterances or of words differ.
    """
    if len(first) != len(second):
        raise ValueError(f"annotations have {len(first)} and {len(second)} utterances; they must have equally many")
    both = [(a, b) for a, b in zip(first, second, strict=True) if is_finished(a) and is_finished(b)]
    acts = [(a, b) for pair in both for a, b in pieces(pair) if a is not None and b is not None]
    spans = [(_borders(a), _borders(b)) for a, b in both]
    equal = [(a[key], b[key]) for a, b in spans for key in a if key in b]
    total = sum(len(a) + len(b) for a, b in spans)
    return Agreement(
        moves=kappa([(a.move.label, b.move.label) for a, b in acts]),
        slots=kappa([(_slot_label(a, slot), _slot_label(b, slot)) for a, b in acts for slot in _SLOTS]),
        pieces=len(acts),
        utterances=len(both),
        equal_spans=len(equal),
        moves_of_equal_spans=kappa([(a.move.label, b.move.label) for a, b in equal]),
        spans=2.0 * len(equal) / total if total else None,
    )


def kappa(pairs: Sequence[tuple[str, str]]) -> float | None:
    """Returns Cohen's kappa (1960) of pairs of labels of two annotators; None with fewer than two different labels."""
    from sklearn.metrics import cohen_kappa_score

    if len({label for pair in pairs for label in pair}) < 2:
        return None
    return float(cohen_kappa_score(*zip(*pairs, strict=True)))


def is_finished(utterance: LabelledUtterance) -> bool:
    """Returns whether all spans of an utterance are labelled."""
    return bool(utterance) and all(span.act is not None for span in utterance)


def pieces(annotators: Sequence[LabelledUtterance]) -> Iterator[tuple[DialogueAct | None, ...]]:
    """Yields the acts of all annotators for each stretch of words of an utterance that none of them splits.

    Args:
        annotators: spans of each annotator.

    Raises:
        ValueError: the numbers of words differ.
    """
    spans_of_words = [[k for k, span in enumerate(spans) for _ in range(span.words)] for spans in annotators]
    if len({len(words) for words in spans_of_words}) > 1:
        raise ValueError(f"annotations of an utterance have {[len(words) for words in spans_of_words]} words")
    for numbers, _ in itertools.groupby(zip(*spans_of_words, strict=True)):
        yield tuple(spans[k].act for spans, k in zip(annotators, numbers, strict=True))


def _borders(utterance: LabelledUtterance) -> dict[tuple[int, int], DialogueAct]:
    """Returns the act of each span, by its first word and the one after its last."""
    ends = list(itertools.accumulate(span.words for span in utterance))
    starts = [0, *ends[:-1]]
    return {
        (start, end): span.act for start, end, span in zip(starts, ends, utterance, strict=True) if span.act is not None
    }


def _slot_label(act: DialogueAct, slot: Slot) -> str:
    return "+".join(value.label for value in act.values(slot))


# --- Krippendorff's alpha --------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Alpha:
    """Krippendorff's alpha of any number of annotators, for nominal labels (Krippendorff 2011).

    Attributes:
        moves: alpha of the moves of pieces; None if fewer than two different moves, or no piece with two judgements,
            exist.
        slots: alpha of the values of each of the five slots in each piece; None in the same case.
        pieces: number of pieces that at least two annotators have judged.
    """

    moves: float | None
    slots: float | None
    pieces: int


def has_alpha() -> bool:
    """Returns whether the package `krippendorff` is installed (extra `agreement`)."""
    return find_spec("krippendorff") is not None


def alpha_of(annotators: Sequence[Sequence[LabelledUtterance | None]]) -> Alpha:
    """Returns Krippendorff's alpha of annotators of the same utterances.

    Args:
        annotators: labelled utterances of each annotator, all in the same order; None for an utterance that was not
            given to this annotator. Unfinished utterances are also missing.

    Raises:
        SessionError: the package `krippendorff` is not installed.
        ValueError: the numbers of utterances or of words differ.
    """
    if not has_alpha():
        raise SessionError(f"Krippendorff's alpha needs krippendorff; run: {pip_install('agreement')}")
    judged: list[tuple[DialogueAct | None, ...]] = []
    for spans in zip(*annotators, strict=True):
        present = [None if each is None or not is_finished(each) else each for each in spans]
        known = [each for each in present if each is not None]
        if len(known) < 2:
            continue
        for acts in pieces(known):
            left = iter(acts)
            judged.append(tuple(None if each is None else next(left) for each in present))
    moves = [[None if act is None else act.move.label for act in acts] for acts in judged]
    slots = [[None if act is None else _slot_label(act, slot) for act in acts] for acts in judged for slot in _SLOTS]
    return Alpha(moves=nominal_alpha(moves), slots=nominal_alpha(slots), pieces=len(judged))


def nominal_alpha(units: Sequence[Sequence[str | None]]) -> float | None:
    """Returns Krippendorff's alpha of labels (units, annotators), where None is missing; None if it is undefined."""
    import krippendorff

    labels = sorted({label for unit in units for label in unit if label is not None})
    if len(labels) < 2 or all(sum(label is not None for label in unit) < 2 for unit in units):
        return None
    number = {label: float(k) for k, label in enumerate(labels)}
    rows = [[math.nan if label is None else number[label] for label in unit] for unit in units]
    return float(krippendorff.alpha(np.array(rows).T, level_of_measurement="nominal"))
