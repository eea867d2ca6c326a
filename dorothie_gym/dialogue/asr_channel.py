"""Simulated speech recognition (ASR): transcripts with word errors, and the acts derived from them."""

from __future__ import annotations

import functools
import itertools
import math
import re
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
from rapidfuzz import process
from rapidfuzz.distance import Levenshtein

from dorothie_gym.dialogue.conversation import USUAL_WORD_ERROR_RATE, Span, Utterance
from dorothie_gym.dialogue.dialogue_act_classifier import guess_act
from dorothie_gym.dialogue.entity_recognition import sound_of
from dorothie_gym.dialogue.exchanges import ANSWER_TIMEOUT
from dorothie_gym.dialogue.hypotheses import TextHypothesis, nbest, read_hypotheses, with_unsure_names
from dorothie_gym.dialogue.lexicon import read_data, split_words, strings
from dorothie_gym.dialogue.phrases import read_talk_files
from dorothie_gym.dialogue.recognition_errors import (
    Loudness,
    measured_errors,
    proper_words,
    word_class,
)
from dorothie_gym.dialogue.word_pairs import words_of_grammar
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.support.copying import shared

if TYPE_CHECKING:
    from dorothie_gym.ontology.roles import Role

_WORD = re.compile(r"[A-Za-z][A-Za-z']*")
_SURE_RIGHT: Final = 0.7
"""Least confidence of a word that was recognised correctly. This number and the next four are assumed, not measured."""

_LEAST_SURE: Final = 0.4
_SURE_WRONG: Final = 0.5
"""Range of the confidence of a word that was misheard, above the least one."""

_SAID_AMONG_CHOICES: Final = 0.4
"""Share of the errors whose spoken word is the second choice."""

_NO_CHOICE: Final = 0.6
"""Share of the correct words that have no second choice."""

_CANDIDATES = 6
"""Number of candidate words for a substitution."""


@shared
@dataclass(frozen=True, kw_only=True)
class AsrChannel:
    """Error model of a speech recogniser.

    Attributes:
        rate: word error rate in [0, 1): substitutions, deletions and insertions per spoken word.
        substitutions: share of substitutions among the errors.
        deletions: share of deletions among the errors; the rest are insertions. The defaults are those measured in
            spoken sessions (`recognition_errors`), as are the relative error rates of speakers, noises and words.

    Raises:
        ValueError: if `rate` or the shares are out of range.
    """

    rate: float = USUAL_WORD_ERROR_RATE
    substitutions: float = field(default_factory=lambda: measured_errors().substitutions)
    deletions: float = field(default_factory=lambda: measured_errors().deletions)

    def __post_init__(self) -> None:
        if not 0 <= self.rate < 1:
            raise ValueError(f"AsrChannel.rate must be at least 0 and below 1, not {self.rate}")
        if self.substitutions < 0 or self.deletions < 0 or self.substitutions + self.deletions > 1:
            raise ValueError(
                f"AsrChannel.substitutions ({self.substitutions}) and deletions ({self.deletions}) are shares of the "
                "errors: none below 0, their sum at most 1"
            )

    def transcribe(self, text: str, rng: np.random.Generator, circumstances: float = 1.0) -> str:
        """Returns a transcript of a text with random word errors.

        Args:
            text: spoken text.
            rng: source of randomness.
            circumstances: error rate of the speaker in the current noise relative to the mean
                (`ErrorProfile.circumstances`).

        Returns:
            The transcript, with at least one word unless the text is empty.
        """
        return " ".join(word.heard for word in self._hear(text, rng, circumstances) if word.heard)

    def recognise(self, text: str, rng: np.random.Generator, circumstances: float = 1.0) -> tuple[TextHypothesis, ...]:
        """Returns the hypotheses for a text, the most probable first: that of `transcribe`, and some others.

        The others have the second choices of single words: what was said, where that is among them, or a confusion of
        it. `transcribe` returns the same words, and leaves `rng` in the same state.

        Args:
            text: spoken text.
            rng: source of randomness; the second choices are drawn from a generator that it spawns.
            circumstances: as for `transcribe`.
        """
        heard = self._hear(text, rng, circumstances)
        (other,) = rng.spawn(1)
        return nbest([_choices(word, other.random) for word in heard])

    def _hear(self, text: str, rng: np.random.Generator, circumstances: float) -> list[_HeardWord]:
        """Returns what was heard of each spoken word, and the insertions."""
        draw: Callable[[], float] = rng.random
        words = text.split()
        heard: list[_HeardWord] = []
        deletions = self.deletions * self.rate
        substitutions = self.substitutions * self.rate
        insertions = (self.rate - deletions - substitutions) * self._damped(circumstances)
        weights = measured_errors().word_classes
        for place, word in enumerate(words):
            # dividing the number drawn multiplies the probabilities of an error
            drawn = draw() / self._damped(circumstances * weights[word_class(word)])
            before = [number for number, each in enumerate(heard) if each.heard]
            if drawn < deletions and not (place == len(words) - 1 and not before):
                # Punctuation is not part of the deleted word: it moves to the previous word.
                if before and word[-1] in "?.," and heard[before[-1]].heard[-1] not in "?.,":
                    last = heard[before[-1]]
                    heard[before[-1]] = last._replace(heard=last.heard + word[-1])
                heard.append(_HeardWord(word, ""))
            elif drawn < deletions + substitutions:
                heard.append(_HeardWord(word, misheard(word, draw)))
            else:
                heard.append(_HeardWord(word, word))
            if draw() < insertions:
                before = [number for number, each in enumerate(heard) if each.heard]
                place_of = before[-1] if before and draw() < 0.5 else len(heard)
                heard.insert(place_of, _HeardWord("", _inserted(draw)))
        return heard

    def _damped(self, relative: float) -> float:
        """Returns a relative error rate nearer to 1 for large rates, since no word has more errors than one."""
        return 1.0 + (relative - 1.0) * (1.0 - self.rate)


class _HeardWord(NamedTuple):
    """Spoken word, "" where there was none, and what was heard of it, "" where nothing was."""

    said: str
    heard: str


def _choices(word: _HeardWord, draw: Callable[[], float]) -> tuple[tuple[str, float], ...]:
    """Returns what a recogniser takes a word for, with probabilities: what was heard, and perhaps a second choice.

    Words that were recognised correctly are surer than others, but not always (Wessel et al., Confidence measures for
    large vocabulary continuous speech recognition, IEEE Trans. SAP 9(3), 2001).
    """
    right = word.said == word.heard
    sure = _SURE_RIGHT + (1.0 - _SURE_RIGHT) * draw() if right else _SURE_WRONG * draw() + _LEAST_SURE
    second = word.said if not right and draw() < _SAID_AMONG_CHOICES else misheard(word.heard or word.said, draw)
    if right and draw() < _NO_CHOICE:
        return ((word.heard, 1.0),)
    return ((word.heard, sure), (second, 1.0 - sure))


def word_error_rate(said: Sequence[str], heard: Sequence[str]) -> float:
    """Returns the word error rate of transcripts: word edits per spoken word, ignoring case and punctuation.

    Args:
        said: spoken texts.
        heard: transcripts, in the same order.

    Returns:
        The word error rate; NaN without words.

    Raises:
        ValueError: if the numbers of texts and transcripts differ.
    """
    if len(said) != len(heard):
        raise ValueError(f"{len(said)} texts and {len(heard)} transcripts: pass one transcript per text")
    edits = words = 0
    for text, transcript in zip(said, heard, strict=True):
        reference = _bare(text)
        edits += Levenshtein.distance(reference, _bare(transcript))
        words += len(reference)
    return edits / words if words else math.nan


def same_words(said: str, heard: str) -> bool:
    """Returns whether two texts have the same words, ignoring case and punctuation."""
    return _bare(said) == _bare(heard)


def misheard(word: str, draw: Callable[[], float]) -> str:
    """Returns a random phonetic confusion of a word; similar words are more probable.

    Args:
        word: word, possibly with punctuation, which is kept.
        draw: function that draws from [0, 1).
    """
    found = _WORD.search(word)
    if found is None:
        return f"{_inserted(draw)}{word[-1] if word[-1] in '?.,' else ''}"
    options, weights = _confusions(found[0].lower())
    drawn = draw() * weights[-1]
    choice = next(option for option, weight in zip(options, weights, strict=True) if drawn < weight)
    if found[0][0].isupper() and choice not in proper_words():
        choice = choice[0].upper() + choice[1:] if word[0].isupper() and found.start() == 0 else choice
    elif choice in proper_words():
        choice = proper_words()[choice]
    return word[: found.start()] + choice + word[found.end() :]


@functools.lru_cache(maxsize=8192)
def _confusions(word: str) -> tuple[tuple[str, ...], tuple[float, ...]]:
    """Returns the possible confusions of a word with their cumulative weights."""
    sounds = _vocabulary_by_sound()
    own = sound_of(word)
    near = process.extract(own, list(sounds), scorer=Levenshtein.normalized_similarity, limit=3 * _CANDIDATES)
    options = [
        (other, similarity * similarity)
        for sound, similarity, _ in near
        for other in sounds[sound]
        if other != word and similarity > 0
    ][:_CANDIDATES]
    if word in proper_words():
        # A rare name is confused with a common word or another name, or slightly distorted.
        options += [(_distorted(word), 0.6)]
    if not options:
        options = [(_distorted(word), 1.0)]
    return tuple(other for other, _ in options), tuple(itertools.accumulate(weight for _, weight in options))


def _distorted(word: str) -> str:
    """Returns a word without its first inner consonant, as a transcript of a mumbled name."""
    for place in range(1, len(word) - 1):
        if word[place] not in "aeiouy'":
            return word[:place] + word[place + 1 :]
    return word + "s"


def _inserted(draw: Callable[[], float]) -> str:
    words = _insertions()
    return words[int(draw() * len(words))]


def _bare(text: str) -> list[str]:
    return re.findall(r"[a-z0-9']+", text.lower())


@functools.cache
def _insertions() -> tuple[str, ...]:
    return strings("cues.yaml: inserted", read_data("cues.yaml").get("inserted"))


@functools.cache
def _vocabulary_by_sound() -> Mapping[str, tuple[str, ...]]:
    """Returns the vocabulary of the recogniser by phonetic key: all generated words and common words like names."""
    spoken = " ".join(map(words_of_grammar, read_talk_files().values())).lower()
    known = split_words(" ".join(strings("cues.yaml: known", read_data("cues.yaml").get("known"))))
    words = {word for word in re.findall(r"\b[a-z][a-z']+\b", spoken)} | set(known) | set(proper_words())
    found: dict[str, list[str]] = defaultdict(list)
    for word in sorted(words):
        if len(word) > 1:
            found[sound_of(word)].append(word)
    return {sound: tuple(listed) for sound, listed in found.items()}


UNCLASSIFIED = DialogueAct(move=DialogueMove.IRRELEVANT)
"""Act of a misrecognised span for listeners that classify transcripts themselves."""


class OpenMoves:
    """Last moves of the speakers that await an answer."""

    def __init__(self) -> None:
        self._open: dict[Role, tuple[DialogueMove, float]] = {}

    def answered_by(self, utterance: Utterance) -> DialogueMove | None:
        """Returns the last unanswered move of another speaker, and marks it as answered."""
        waiting = [(end, move) for role, (move, end) in self._open.items() if role is not utterance.speaker]
        self._open = {role: opened for role, opened in self._open.items() if role is utterance.speaker}
        end, move = max(waiting, default=(-np.inf, None))
        return move if utterance.start - end < ANSWER_TIMEOUT else None

    def note(self, utterance: Utterance) -> None:
        """Records the last move of an utterance, which awaits an answer."""
        self._open[utterance.speaker] = (utterance.spans[-1].act.move, utterance.end)


class Recogniser:
    """Recogniser of the utterances of a session, with the errors of an `AsrChannel`.

    Of several hypotheses, the one that makes most sense is the transcript; names of which the recogniser is unsure are
    left out of it, so that the listener asks for them (`hypotheses`). Correctly recognised spans keep their act. The
    act of a misrecognised span is classified from the transcript, so that the act does not reveal the spoken words.
    """

    def __init__(self, channel: AsrChannel, rng: np.random.Generator, *, classify: bool = True) -> None:
        """Starts a session.

        Args:
            channel: error model.
            rng: source of randomness; unused if the error rate is 0.
            classify: whether misrecognised spans are classified. Without it their act is Irrelevant, for listeners that
                observe transcripts only and classify these themselves.
        """
        self._channel, self._rng, self._classify = channel, rng, classify
        self._open = OpenMoves()

    def hear(self, utterance: Utterance, noise: Loudness = Loudness.QUIET) -> Utterance:
        """Returns the recognised utterance: the same spans with transcripts and matching acts.

        Args:
            utterance: spoken utterance; calls follow the order of utterance ends.
            noise: noise in the car at its end.
        """
        if self._channel.rate == 0:
            return utterance
        after = self._open.answered_by(utterance)
        circumstances = measured_errors().circumstances(utterance.speaker, noise)
        spans = []
        for place, span in enumerate(utterance.spans):
            asked = after if place == 0 else None
            hypotheses = self._channel.recognise(span.text, self._rng, circumstances)
            text, act = span.text, span.act
            if any(each.text != text for each in hypotheses):
                text = with_unsure_names(read_hypotheses(hypotheses, asked))
            if not same_words(text, span.text):
                act = guess_act(text, asked) if self._classify else UNCLASSIFIED
            spans.append(Span(text, act))
        self._open.note(utterance)
        return replace(utterance, spans=tuple(spans))
