"""Agreement of the annotators of a corpus."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from dorothie_gym.errors import AnnotationError
from dorothie_gym.evaluation.analysis.segmentation_agreement import (
    SegmentationAgreement,
    segmentation_agreement,
    segmentation_alpha,
)
from dorothie_gym.evaluation.analysis.span_agreement import Agreement, Alpha, agreement_of, alpha_of
from dorothie_gym.lab.annotation.log import ADJUDICATED, RECORDED, annotators_of, log_path, read_annotation
from dorothie_gym.lab.annotation.marks import Annotation
from dorothie_gym.lab.annotation.session_labels import recorded_annotation
from dorothie_gym.lab.annotation.source_text import SourceText

if TYPE_CHECKING:
    from dorothie_gym.archive.corpus import CorpusEntry


@dataclass(frozen=True, kw_only=True)
class PairAgreement:
    """Agreement of two annotators.

    Attributes:
        labels: on spans, moves and slots.
        exchanges: on the borders of exchanges.
        transactions: on the borders of transactions.
    """

    labels: Agreement
    exchanges: SegmentationAgreement
    transactions: SegmentationAgreement

    def to_json(self) -> dict[str, object]:
        """Returns all figures in JSON types."""
        labels = self.labels
        return {
            "utterances": labels.utterances,
            "spans": {"agreement": labels.spans, "equal": labels.equal_spans},
            "moves": {"kappa": labels.moves_of_equal_spans, "spans": labels.equal_spans},
            "moves_of_pieces": {"kappa": labels.moves, "pieces": labels.pieces},
            "slots": {"kappa": labels.slots, "pieces": labels.pieces},
            "exchanges": _figures_of(self.exchanges),
            "transactions": _figures_of(self.transactions),
        }


def _figures_of(found: SegmentationAgreement) -> dict[str, object]:
    return {
        "kappa": found.kappa,
        "similarity": found.similarity,
        "sites": found.sites,
        "borders": list(found.borders),
    }


@dataclass(frozen=True, kw_only=True)
class CorpusAgreement:
    """Agreement of the annotators of a corpus.

    Attributes:
        annotators: their names, in order.
        sessions: number of sessions with two or more annotations.
        pairs: agreement of each pair of annotators, over the sessions that both have annotated, with the number of
            these.
        alpha: Krippendorff's alpha of all annotators; None if the package `krippendorff` is not installed.
        exchange_alpha: the same for the borders of exchanges; also None if it is undefined.
        transaction_alpha: the same for the borders of transactions.
    """

    annotators: tuple[str, ...]
    sessions: int
    pairs: Mapping[tuple[str, str], tuple[int, PairAgreement]]
    alpha: Alpha | None
    exchange_alpha: float | None = None
    transaction_alpha: float | None = None

    def to_json(self) -> dict[str, object]:
        """Returns all figures in JSON types."""
        return {
            "annotators": list(self.annotators),
            "sessions": self.sessions,
            "pairs": [
                {"annotators": list(names), "sessions": sessions, **each.to_json()}
                for names, (sessions, each) in self.pairs.items()
            ],
            "alpha": None
            if self.alpha is None
            else {
                "moves": self.alpha.moves,
                "slots": self.alpha.slots,
                "pieces": self.alpha.pieces,
                "exchanges": self.exchange_alpha,
                "transactions": self.transaction_alpha,
            },
        }


def agreement_of_two(
    texts: Sequence[SourceText], first: Sequence[Annotation], second: Sequence[Annotation]
) -> PairAgreement:
    """Returns the agreement of two annotators of sessions.

    Args:
        texts: texts of the sessions.
        first: annotations of one annotator.
        second: those of the other one.
    """
    both = [[(text, each) for text, each in zip(texts, annotations, strict=True)] for annotations in (first, second)]
    labels = [[utterance for text, each in rows for utterance in each.labels(text)] for rows in both]
    exchanges = [[each.exchange_spans(text) for text, each in rows] for rows in both]
    transactions = [[each.transaction_spans(text) for text, each in rows] for rows in both]
    return PairAgreement(
        labels=agreement_of(*labels),
        exchanges=segmentation_agreement(*exchanges),
        transactions=segmentation_agreement(*transactions),
    )


def pair_agreement(text: SourceText, annotations: Mapping[str, Annotation]) -> dict[tuple[str, str], PairAgreement]:
    """Returns the agreement of each two annotators of a session."""
    return {
        (first, second): agreement_of_two([text], [annotations[first]], [annotations[second]])
        for first, second in itertools.combinations(annotations, 2)
    }


def corpus_agreement(
    entries: Sequence[CorpusEntry], annotators: Sequence[str] = (), *, with_alpha: bool = True
) -> CorpusAgreement:
    """Returns the agreement of the annotators of the sessions of a corpus.

    Args:
        entries: the sessions.
        annotators: names to compare; `RECORDED` denotes the labels of the sessions, `ADJUDICATED` the final
            version. Empty: all annotators.
        with_alpha: whether to compute Krippendorff's alpha.

    Raises:
        AnnotationError: no session has two of the annotators, or a name is unknown.
        SessionError: a session or log is damaged, or `krippendorff` is missing.
    """
    _check_known(entries, annotators)
    texts, found = list[SourceText](), list[dict[str, Annotation]]()
    for entry in entries:
        names = _present(entry.path, annotators)
        if len(names) < 2:
            continue
        session = entry.load()
        text = SourceText.of(session)
        texts.append(text)
        found.append(
            {
                name: recorded_annotation(session, text)
                if name == RECORDED
                else read_annotation(text, entry.path, name)
                for name in names
            }
        )
    if not found:
        raise AnnotationError("no session has been annotated by two of the annotators; there is nothing to compare")
    names = tuple(sorted({name for each in found for name in each}))
    labels = {
        name: [
            utterance
            for text, each in zip(texts, found, strict=True)
            for utterance in (each[name].labels(text) if name in each else [None] * len(text.lines))
        ]
        for name in names
    }
    pairs = {}
    for first, second in itertools.combinations(names, 2):
        shared = [(text, each) for text, each in zip(texts, found, strict=True) if {first, second} <= each.keys()]
        if shared:
            marks = ([each[name] for _, each in shared] for name in (first, second))
            pairs[first, second] = len(shared), agreement_of_two([text for text, _ in shared], *marks)
    if not with_alpha:
        return CorpusAgreement(annotators=names, sessions=len(found), pairs=pairs, alpha=None)
    marked = [[(text, each.get(name)) for text, each in zip(texts, found, strict=True)] for name in names]
    return CorpusAgreement(
        annotators=names,
        sessions=len(found),
        pairs=pairs,
        alpha=alpha_of([labels[name] for name in names]),
        exchange_alpha=segmentation_alpha(
            [[None if each is None else each.exchange_spans(text) for text, each in row] for row in marked]
        ),
        transaction_alpha=segmentation_alpha(
            [[None if each is None else each.transaction_spans(text) for text, each in row] for row in marked]
        ),
    )


def _present(folder: Path, wanted: Sequence[str]) -> tuple[str, ...]:
    """Returns the annotators of a session that are to be compared."""
    if not wanted:
        return annotators_of(folder)
    return tuple(name for name in wanted if name == RECORDED or log_path(folder, name).is_file())


def _check_known(entries: Sequence[CorpusEntry], annotators: Sequence[str]) -> None:
    known = {name for entry in entries for name in annotators_of(entry.path)}
    for name in annotators:
        if name not in (*known, ADJUDICATED, RECORDED):
            listed = ", ".join(sorted(known)) or "nobody has annotated it"
            raise AnnotationError(f"annotator {name!r} has annotated no session of the corpus ({listed})")
