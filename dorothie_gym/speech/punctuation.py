"""Punctuation of recognised words: marks as hidden events between words (Stolcke and Shriberg, ICSLP 1996).

A trigram model of words and marks gives the probability of a sentence with its marks. The most probable marks for given
words are found by dynamic programming. Whether a sentence is a question depends more on the beginning of its last
clause ("should I", "which way") than on its end, so the beginning also counts.
"""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from dorothie_gym.speech.spoken_form import PUNCTUATION
from dorothie_gym.speech.trigrams import END, START, Trigrams, estimate
from dorothie_gym.support import portable_math as pm

_BETWEEN: Final = ("", ",", ".", "?")
_BEHIND: Final = (".", "?")

_OPEN: Final = frozenset({"a", "an", "hang", "make", "my", "take", "the", "your"})
"""Words followed by their object, not by a mark: "take right" lacks an article and does not ask for agreement."""

_PRIOR: Final = 0.5
"""Weight of the overall share of questions in that of sentences with a given beginning [sentences]."""

_Path = tuple[float, tuple[str, ...]]


@dataclass(frozen=True)
class PunctuationModel:
    """Model of marks.

    Attributes:
        trigrams: trigrams of words and marks.
        questions: share of questions by the first one or two words of the last clause.
        share: share of questions among all sentences.
    """

    trigrams: Trigrams
    questions: Mapping[tuple[str, ...], float]
    share: float

    @classmethod
    def learn(cls, sentences: Iterable[tuple[Sequence[str], float]]) -> PunctuationModel:
        """Returns the model of sentences with their marks (see `spoken_tokens`), and their weights."""
        learned = [(_ended(tokens), weight) for tokens, weight in sentences]
        learned = [(tokens, weight) for tokens, weight in learned if tokens]
        asked: dict[tuple[str, ...], float] = defaultdict(float)  # weights may be fractions
        counted: dict[tuple[str, ...], float] = defaultdict(float)
        for tokens, weight in learned:
            for opening in ((), *_openings(tokens[:-1])):
                counted[opening] += weight
                asked[opening] += weight * (tokens[-1] == "?")
        share = asked[()] / counted[()]
        shares = {start: (asked[start] + _PRIOR * share) / (counted[start] + _PRIOR) for start in counted if start}
        return cls(estimate(learned), shares, share)

    def texts(self) -> dict[str, str]:
        """Returns the model as texts by name, for `from_texts`."""
        questions = {" ".join(start): round(share, 6) for start, share in self.questions.items()}
        return {"arpa": self.trigrams.arpa(), "questions": json.dumps([self.share, questions])}

    @classmethod
    def from_texts(cls, texts: Mapping[str, str]) -> PunctuationModel:
        """Returns the model of the texts that `texts` has returned."""
        share, questions = json.loads(texts["questions"])
        found = {tuple(start.split(" ")): each for start, each in questions.items()}
        return cls(Trigrams.from_arpa(texts["arpa"]), found, share)

    def restore(self, words: Sequence[str]) -> list[str]:
        """Returns words with the most probable marks between and after them.

        Args:
            words: spoken words in lower case.

        Returns:
            The words, with ",", "." and "?" as own tokens; the last one is "." or "?" if there are words.
        """
        if not words:
            return []
        # best path to each pair of the last two tokens: log probability and tokens
        paths: dict[tuple[str, str], _Path] = {(START, START): (0.0, ())}
        for place, word in enumerate(words):
            following: dict[tuple[str, str], _Path] = {}
            marks = _BETWEEN if place and words[place - 1] not in _OPEN else ("",)
            for ends, path in paths.items():
                for mark in marks:
                    self._extend(following, ends, path, (mark, word) if mark else (word,))
            paths = following
        ended: dict[tuple[str, str], _Path] = {}
        for ends, (score, tokens) in paths.items():
            for mark in _BEHIND:
                self._extend(ended, ends, (score + self._asks(tokens, mark), tokens), (mark, END))
        _, best = max(ended.values())
        return list(best[:-1])

    def _extend(
        self, following: dict[tuple[str, str], _Path], ends: tuple[str, str], path: _Path, added: Sequence[str]
    ) -> None:
        """Adds a path continued by the given tokens, if it is the best path that ends in its last two tokens."""
        (first, second), (score, tokens) = ends, path
        for token in added:
            score += self.trigrams.log_probability(first, second, token)
            first, second = second, token
        known = following.get((first, second))
        if known is None or score > known[0]:
            following[first, second] = score, (*tokens, *added)

    def _asks(self, tokens: Sequence[str], mark: str) -> float:
        """Returns the log ratio by which the beginning of the last clause favours a mark after it."""
        found = [self.questions[start] for start in _openings(tokens) if start in self.questions]
        share = found[-1] if found else self.share
        return pm.log(share / self.share) if mark == "?" else pm.log((1 - share) / (1 - self.share))


def _ended(tokens: Sequence[str]) -> list[str]:
    """Returns a sentence to learn from: it begins with a word and ends with "." or "?"."""
    kept = list(tokens)
    last = ""
    while kept and kept[-1] in PUNCTUATION:
        last = kept.pop()
    return [*kept, "?" if last == "?" else "."] if kept else []


def _openings(tokens: Sequence[str]) -> list[tuple[str, ...]]:
    """Returns the first word, and the first two words, of the last clause."""
    start = max((place + 1 for place, token in enumerate(tokens) if token in PUNCTUATION), default=0)
    clause = tuple(tokens[start : start + 2])
    return [clause[:1], clause] if len(clause) == 2 else [clause] if clause else []
