"""Statistics of speech in a corpus: hours, overlap, pauses and gaps, speaking rates, and word errors."""

from __future__ import annotations

import itertools
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

from dorothie_gym.evaluation.analysis.lost_meaning import lost_meanings
from dorothie_gym.evaluation.analysis.word_errors import WordErrorCounts
from dorothie_gym.ontology.roles import Role
from dorothie_gym.speech.spoken_form import spoken_words

if TYPE_CHECKING:
    from dorothie_gym.archive.corpus import Corpus
    from dorothie_gym.session.recording.events import UtteranceRecord
    from dorothie_gym.session.recording.session import Session

QUANTILES: Final = (0.1, 0.25, 0.5, 0.75, 0.9)
"""Quantiles of the distributions."""

LONGEST_SILENCE: Final = 10.0
"""Longest silence that is a pause or a gap [s]; after longer ones the conversation starts again."""

SPEAKERS: Final = (Role.PARTICIPANT, Role.CO_WIZARD)


@dataclass(frozen=True, kw_only=True)
class PublishedFigure:
    """Figure of another corpus.

    Attributes:
        figure: path of the comparable figure in `SpeechStats.to_json`.
        corpus: the corpus.
        value: the figure, in the unit of ours.
        source: the publication.
        remark: difference of the definitions; empty without one.
    """

    figure: str
    corpus: str
    value: float
    source: str
    remark: str = ""


PUBLISHED: Final = (
    PublishedFigure(
        figure="participant_hours",
        corpus="SDN, 183 sessions",
        value=2.9,
        source="Ma et al., Findings of EMNLP 2022, table 2",
        remark="trimmed audio",
    ),
    PublishedFigure(
        figure="gaps.mean",
        corpus="English conversations",
        value=0.236,
        source="Stivers et al., PNAS 106, 2009",
        remark="answers to questions",
    ),
    PublishedFigure(
        figure="gaps.quantiles.0.5",
        corpus="conversations in many languages",
        value=0.2,
        source="Levinson and Torreira, Frontiers in Psychology 6:731, 2015",
        remark="order of magnitude",
    ),
    PublishedFigure(
        figure="recognition.word_error_rate",
        corpus="Switchboard",
        value=0.051,
        source="Xiong et al., ICASSP 2018; Saon et al., Interspeech 2017",
        remark="telephone conversations of strangers; systems and professional transcribers",
    ),
    PublishedFigure(
        figure="recognition.word_error_rate",
        corpus="CHiME-4, real test set, 6 channels",
        value=0.0274,
        source="Chen et al., arXiv:1803.10109, 2018",
        remark="read sentences in noisy places",
    ),
)
"""Figures of corpora of people, as their publications state them."""


@dataclass
class SpeechStats:
    """Counts of the speech in sessions; durations in seconds.

    Attributes:
        sessions: number of sessions.
        recorded: number of sessions with audio files.
        session_seconds: their duration.
        speech: duration of the utterances by speaker.
        words: words by speaker, in their spoken forms.
        any_speech: time in which at least one role speaks.
        overlap: time in which both speak.
        utterances: number of utterances.
        overlapping: utterances that begin while the other speaks.
        gaps: time from the end of an utterance to the next one of the other speaker; negative for an overlap.
        pauses: time from the end of an utterance to the next one of the same speaker.
        rates: words per minute of each utterance by speaker.
        errors: word errors.
        lost: utterances that lost a detail in recognition (`lost_meaning`).
        repaired: those that were repaired.
    """

    sessions: int = 0
    recorded: int = 0
    session_seconds: float = 0.0
    speech: dict[Role, float] = field(default_factory=lambda: defaultdict(float))
    words: dict[Role, int] = field(default_factory=lambda: defaultdict(int))
    any_speech: float = 0.0
    overlap: float = 0.0
    utterances: int = 0
    overlapping: int = 0
    gaps: list[float] = field(default_factory=list)
    pauses: list[float] = field(default_factory=list)
    rates: dict[Role, list[float]] = field(default_factory=lambda: defaultdict(list))
    errors: WordErrorCounts = field(default_factory=WordErrorCounts)
    lost: int = 0
    repaired: int = 0

    def add(self, session: Session) -> None:
        """Counts a session."""
        said = sorted(session.utterances(), key=lambda each: (each.start, each.end))
        self.sessions += 1
        self.recorded += bool(session.audio)
        self.session_seconds += session.duration
        self.utterances += len(said)
        for utterance in said:
            seconds, words = utterance.end - utterance.start, len(spoken_words(utterance.text))
            self.speech[utterance.speaker] += seconds
            self.words[utterance.speaker] += words
            if words and seconds > 0.0:
                self.rates[utterance.speaker].append(60.0 * words / seconds)
        one, both = _durations(said)
        self.any_speech += one
        self.overlap += both
        self._add_silences(said)
        self.errors.add(session)
        for each in lost_meanings(session):
            self.lost += 1
            self.repaired += each.is_repaired

    def _add_silences(self, said: Sequence[UtteranceRecord]) -> None:
        for before, after in itertools.pairwise(said):
            silence = after.start - before.end
            if before.speaker is not after.speaker:
                self.overlapping += silence < 0.0
                if silence <= LONGEST_SILENCE:
                    self.gaps.append(silence)
            elif 0.0 <= silence <= LONGEST_SILENCE:
                self.pauses.append(silence)

    def to_json(self) -> dict[str, object]:
        """Returns the figures in JSON types: hours, shares, seconds, words per minute and word error rates."""
        hours = {role: self.speech[role] / 3600.0 for role in SPEAKERS}
        return {
            "sessions": self.sessions,
            "sessions_with_audio": self.recorded,
            "audio_hours": round(sum(hours.values()), 4),
            "participant_hours": round(hours[Role.PARTICIPANT], 4),
            "co_wizard_hours": round(hours[Role.CO_WIZARD], 4),
            "speech_share": _share(self.any_speech, self.session_seconds),
            "overlap_share": _share(self.overlap, self.any_speech),
            "overlapping_utterances": _share(self.overlapping, self.utterances),
            "gaps": distribution(self.gaps),
            "pauses": distribution(self.pauses),
            "words_per_minute": {
                role.value: {
                    "overall": round(60.0 * self.words[role] / self.speech[role], 1) if self.speech[role] else None,
                    **distribution(self.rates[role], digits=1),
                }
                for role in SPEAKERS
            },
            "recognition": self.errors.to_json() if self.errors.total.words else None,
            "lost_meanings": {
                "utterances": self.lost,
                "repaired": self.repaired,
                "share": _share(self.repaired, self.lost),
            },
            "published": [
                {
                    "figure": each.figure,
                    "corpus": each.corpus,
                    "value": each.value,
                    "source": each.source,
                    "remark": each.remark,
                }
                for each in PUBLISHED
            ],
        }


def speech_stats_of(corpus: Corpus, on_session: Callable[[int, int], None] | None = None) -> SpeechStats:
    """Returns the statistics of a corpus.

    Args:
        corpus: the corpus.
        on_session: called after each session with the number of sessions done and of all.
    """
    found = SpeechStats()
    for number, entry in enumerate(corpus.entries, start=1):
        found.add(entry.load())
        if on_session is not None:
            on_session(number, len(corpus.entries))
    return found


def distribution(values: Sequence[float], digits: int = 3) -> dict[str, object]:
    """Returns number, mean and quantiles of values; mean and quantiles are None without values."""
    known = np.asarray(values, dtype=np.float64)
    return {
        "count": len(known),
        "mean": round(float(known.mean()), digits) if len(known) else None,
        "quantiles": {
            str(share): round(float(np.quantile(known, share)), digits) if len(known) else None for share in QUANTILES
        },
    }


def figure_at(figures: Mapping[str, object], path: str) -> object:
    """Returns the figure at a path such as "gaps.quantiles.0.5"; None if there is none."""
    found: object = figures
    for name in _steps(path):
        if not isinstance(found, Mapping):
            return None
        found = found.get(name)
    return found


def _steps(path: str) -> Iterator[str]:
    names = path.split(".")
    while names:  # a quantile has a point in its name
        name = names.pop(0)
        yield f"{name}.{names.pop(0)}" if name.isdecimal() and names else name


def _durations(said: Sequence[UtteranceRecord]) -> tuple[float, float]:
    """Returns the time in which at least one role speaks, and that in which at least two do [s]."""
    edges = sorted([(each.start, 1) for each in said] + [(each.end, -1) for each in said])
    one = both = 0.0
    speaking, last = 0, 0.0
    for time, change in edges:
        one += (time - last) * (speaking > 0)
        both += (time - last) * (speaking > 1)
        speaking, last = speaking + change, time
    return one, both


def _share(part: float, whole: float) -> float | None:
    return round(part / whole, 4) if whole else None
