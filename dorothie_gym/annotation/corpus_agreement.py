"""Agreement of the annotators of a corpus."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from dorothie_gym.analysis import Agreement, Alpha, agreement_of, alpha_of
from dorothie_gym.annotation.log import ADJUDICATED, RECORDED, annotators_of, log_path, read_annotation
from dorothie_gym.annotation.marks import Annotation
from dorothie_gym.annotation.session_labels import recorded_annotation
from dorothie_gym.annotation.source_text import SourceText
from dorothie_gym.errors import AnnotationError
from dorothie_gym.recording import CorpusEntry


@dataclass(frozen=True, kw_only=True)
class CorpusAgreement:
    """Agreement of the annotators of a corpus.

    Attributes:
        annotators: their names, in order.
        sessions: number of sessions with two or more of them.
        pairs: agreement of each two annotators, over the sessions that both have annotated, with the number of these.
        alpha: Krippendorff's alpha of all annotators; None if the package `krippendorff` is not installed.
    """

    annotators: tuple[str, ...]
    sessions: int
    pairs: Mapping[tuple[str, str], tuple[int, Agreement]]
    alpha: Alpha | None

    def to_json(self) -> dict[str, object]:
        """Returns all figures in JSON types."""
        return {
            "annotators": list(self.annotators),
            "sessions": self.sessions,
            "pairs": [
                {"annotators": list(names), "sessions": sessions, **figures_of(each)}
                for names, (sessions, each) in self.pairs.items()
            ],
            "alpha": None
            if self.alpha is None
            else {"moves": self.alpha.moves, "slots": self.alpha.slots, "pieces": self.alpha.pieces},
        }


def figures_of(pair: Agreement) -> dict[str, object]:
    """Returns the figures of two annotators in JSON types."""
    return {
        "utterances": pair.utterances,
        "spans": {"agreement": pair.spans, "equal": pair.equal_spans},
        "moves": {"kappa": pair.moves_of_equal_spans, "spans": pair.equal_spans},
        "moves_of_pieces": {"kappa": pair.moves, "pieces": pair.pieces},
        "slots": {"kappa": pair.slots, "pieces": pair.pieces},
    }


def pair_agreement(text: SourceText, annotations: Mapping[str, Annotation]) -> dict[tuple[str, str], Agreement]:
    """Returns the agreement of each two annotators of a session."""
    labels = {name: each.labels(text) for name, each in annotations.items()}
    return {
        (first, second): agreement_of(labels[first], labels[second])
        for first, second in itertools.combinations(labels, 2)
    }


def corpus_agreement(
    entries: Sequence[CorpusEntry], annotators: Sequence[str] = (), *, with_alpha: bool = True
) -> CorpusAgreement:
    """Returns the agreement of the annotators of the sessions of a corpus.

    Args:
        entries: the sessions.
        annotators: names to compare; `RECORDED` stands for the labels of the sessions, `ADJUDICATED` for the final
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
        judged = zip(labels[first], labels[second], strict=True)
        common = [(a, b) for a, b in judged if a is not None and b is not None]
        sessions = sum(first in each and second in each for each in found)
        if common:
            pairs[first, second] = sessions, agreement_of([a for a, _ in common], [b for _, b in common])
    alpha = alpha_of([labels[name] for name in names]) if with_alpha else None
    return CorpusAgreement(annotators=names, sessions=len(found), pairs=pairs, alpha=alpha)


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
