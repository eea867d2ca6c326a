"""Agreement of annotators on the borders of units: exchanges, or transactions.

Numbers of units are arbitrary, so borders are compared. A *site* is the place between two neighbouring spans of
a session; where annotators split an utterance differently, each of their borders is a site. A site is a border if the
spans on its two sides belong to different units, or one of them to none. Kappa of such sites is the usual measure for
the segmentation of dialogues (Carletta et al., Computational Linguistics 23(1), 1997).

Kappa takes a border that is off by one site as two misses. Boundary similarity B (Fournier, ACL 2013, with n_t = 2)
counts it as half of one: B = 1 - (misses + near misses / 2) / (misses + near misses + common borders).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from dorothie_gym.evaluation.analysis.span_agreement import kappa, nominal_alpha

NEAR_MISS = 0.5
"""Cost of two borders at neighbouring sites, of which each annotator has one (Fournier 2013: distance / n_t)."""


@dataclass(frozen=True)
class UnitSpan:
    """Span of an utterance with its unit.

    Attributes:
        words: number of its words, at least 1.
        unit: number of its exchange, or transaction; None if there is none.
        decided: whether the annotator has finished it.
    """

    words: int
    unit: int | None
    decided: bool = True


SegmentedSession: TypeAlias = Sequence[UnitSpan]
"""Spans of all utterances of a session, in order."""

Site: TypeAlias = tuple[bool | None, ...]
"""Whether a site is a border for each annotator; None if the annotator has not finished the adjacent spans."""


@dataclass(frozen=True, kw_only=True)
class SegmentationAgreement:
    """Agreement of two annotators on borders.

    Attributes:
        kappa: Cohen's kappa of the sites; None if both agree that all of them are borders, or none.
        similarity: boundary similarity; None without borders.
        sites: number of sites that both have judged.
        borders: number of borders of each annotator.
    """

    kappa: float | None
    similarity: float | None
    sites: int
    borders: tuple[int, int]


def segmentation_agreement(
    first: Sequence[SegmentedSession], second: Sequence[SegmentedSession]
) -> SegmentationAgreement:
    """Returns the agreement of two annotators of the same sessions.

    Args:
        first: sessions of one annotator.
        second: those of the other one, with as many words.

    Raises:
        ValueError: the numbers of sessions or words differ.
    """
    judged = [list(_judged_by_both(sites_of(pair))) for pair in zip(first, second, strict=True)]
    sites = [site for each in judged for site in each]
    weights = [_edits(each) for each in judged]
    cost, total = sum(cost for cost, _ in weights), sum(count for _, count in weights)
    return SegmentationAgreement(
        kappa=kappa([(str(a), str(b)) for a, b in sites]),
        similarity=1.0 - cost / total if total else None,
        sites=len(sites),
        borders=(sum(a for a, _ in sites), sum(b for _, b in sites)),
    )


def segmentation_alpha(annotators: Sequence[Sequence[SegmentedSession | None]]) -> float | None:
    """Returns Krippendorff's alpha of the sites for any number of annotators (nominal; Krippendorff 2011).

    Args:
        annotators: sessions of each annotator, all in the same order; None for a session that was not given to this
            annotator.

    Returns:
        Alpha; None if it is undefined.
    """
    units = []
    for sessions in zip(*annotators, strict=True):
        known = [each for each in sessions if each is not None]
        for site in sites_of(known):
            left = iter(site)
            marks = (None if each is None else next(left) for each in sessions)
            units.append([None if mark is None else str(mark) for mark in marks])
    return nominal_alpha(units)


def sites_of(annotators: Sequence[SegmentedSession]) -> Iterator[Site]:
    """Yields the sites of a session, in order.

    Args:
        annotators: the session as each annotator has marked it.

    Raises:
        ValueError: the numbers of words differ.
    """
    spans_of_words = [[k for k, span in enumerate(spans) for _ in range(span.words)] for spans in annotators]
    if len({len(words) for words in spans_of_words}) > 1:
        raise ValueError(f"annotations of a session have {[len(words) for words in spans_of_words]} words")
    for before, after in itertools.pairwise(zip(*spans_of_words, strict=True)):
        if before != after:
            sides = zip(annotators, before, after, strict=True)
            yield tuple(_is_border(spans[a], spans[b], same=a == b) for spans, a, b in sides)


def _is_border(before: UnitSpan, after: UnitSpan, *, same: bool) -> bool | None:
    if not before.decided or not after.decided:
        return None
    return not same and before.unit != after.unit


def _judged_by_both(sites: Iterable[Site]) -> Iterator[tuple[bool, bool]]:
    return ((a, b) for a, b in sites if a is not None and b is not None)


def _edits(sites: Sequence[tuple[bool, bool]]) -> tuple[float, int]:
    """Returns the cost of the edits that make the borders of one annotator those of the other, and their number.

    The number includes common borders. Neighbouring sites are paired from the left, each once.
    """
    cost, number, k = 0.0, 0, 0
    while k < len(sites):
        here = sites[k]
        if here[0] != here[1] and k + 1 < len(sites) and sites[k + 1] == (here[1], here[0]):
            cost, number, k = cost + NEAR_MISS, number + 1, k + 2
            continue
        cost, number, k = cost + (here[0] != here[1]), number + any(here), k + 1
    return cost, number
