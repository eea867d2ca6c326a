"""Splitting of a heard utterance into spans, with or without known acts."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import Final

from dorothie_gym.dialogue import Span, guess_act, guess_spans
from dorothie_gym.ontology import DialogueAct, DialogueMove

_CLAUSE_END: Final = re.compile(r"(?<=[,.?!]) ")

_MOST: Final = 8
"""Largest number of clauses; the last one gets the rest of a longer utterance."""


def spans_of(text: str, acts: Sequence[DialogueAct] | None, after: DialogueMove | None = None) -> tuple[Span, ...]:
    """Returns the spans of an utterance.

    If the acts are known, the words are split at ends of clauses so that the rule-based act classifier agrees
    with them best; otherwise that classifier splits the words and predicts the acts.

    Args:
        text: the words; blank for no utterance.
        acts: the acts in order; None if they are not known.
        after: move of the listener's last utterance, for the classifier.
    """
    if acts is None:
        return guess_spans(text, after)
    words = text.split()
    if not words or not acts:
        return ()
    if len(acts) == 1:
        return (Span(text, acts[0]),)
    clauses = _CLAUSE_END.split(text)
    clauses = clauses if len(clauses) >= len(acts) else words
    clauses = [*clauses[: _MOST - 1], " ".join(clauses[_MOST - 1 :])] if len(clauses) > _MOST else clauses
    shared = list(acts)[: len(clauses)]
    best = max(_partings(clauses, len(shared)), key=lambda pieces: _fit(pieces, shared))
    return tuple(Span(piece, act) for piece, act in zip(best, shared, strict=True))


def _partings(clauses: Sequence[str], count: int) -> Iterator[tuple[str, ...]]:
    """Yields every grouping of clauses into a number of pieces, those with long first pieces first."""
    for cuts in reversed(list(itertools.combinations(range(1, len(clauses)), count - 1))):
        ends = (0, *cuts, len(clauses))
        yield tuple(" ".join(clauses[start:end]) for start, end in itertools.pairwise(ends))


def _fit(pieces: Sequence[str], acts: Sequence[DialogueAct]) -> tuple[int, int]:
    """Returns how many moves, and how many slot sets, the classifier predicts correctly."""
    guessed = [_guess(piece) for piece in pieces]
    moves = sum(guess.move is act.move for guess, act in zip(guessed, acts, strict=True))
    return moves, sum(guess.slots == act.slots for guess, act in zip(guessed, acts, strict=True))


@lru_cache(maxsize=1024)
def _guess(piece: str) -> DialogueAct:
    return guess_act(piece)
