"""Trigram language model with interpolated Kneser-Ney smoothing, and its form for the recogniser (ARPA)."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

from dorothie_gym.support import portable_math as pm

START, END = "<s>", "</s>"
"""Tokens before and after each sentence."""

DISCOUNT: Final = 0.75
"""Absolute discount of counts; estimates for bigrams and trigrams of English lie between 0.6 and 0.9 (Chen and Goodman,
Computer Speech and Language 13, 1999, section 5)."""

_UNIFORM: Final = 0.05
"""Share of the uniform distribution in unigrams, so that a rare word of the vocabulary stays possible."""

_TINY: Final = 1e-99


@dataclass(frozen=True)
class Trigrams:
    """Probabilities of words after two words.

    Attributes:
        unigrams: probability of each word, `END` included.
        bigrams: probability of a word after a word, for pairs that were counted.
        trigrams: probability of a word after two, for triples that were counted.
        backoff1: weight of the unigrams after a word.
        backoff2: weight of the bigrams after two words.
    """

    unigrams: Mapping[str, float]
    bigrams: Mapping[tuple[str, str], float]
    trigrams: Mapping[tuple[str, str, str], float]
    backoff1: Mapping[str, float]
    backoff2: Mapping[tuple[str, str], float]

    def log_probability(self, first: str, second: str, word: str) -> float:
        """Returns the natural logarithm of the probability of a word after two words, the lowest if it is unknown."""
        found = self.trigrams.get((first, second, word))
        if found is None:
            found = self.bigrams.get((second, word))
            if found is None:
                found = self.backoff1.get(second, 1.0) * self.unigrams.get(word, 1e-7)
            found *= self.backoff2.get((first, second), 1.0)
        return pm.log(max(found, _TINY))

    def arpa(self) -> str:
        """Returns the model in the ARPA format, as the recogniser reads it."""
        lines = ["\\data\\", f"ngram 1={len(self.unigrams) + 1}", f"ngram 2={len(self.bigrams)}"]
        lines += [f"ngram 3={len(self.trigrams)}", "", "\\1-grams:", f"{_log10(_TINY)}\t{START}\t{self._after(START)}"]
        lines += [f"{_log10(p)}\t{word}\t{self._after(word)}" for word, p in self.unigrams.items()]
        lines += ["", "\\2-grams:"]
        for pair, p in self.bigrams.items():
            lines.append(f"{_log10(p)}\t{pair[0]} {pair[1]}\t{_log10(self.backoff2.get(pair, 1.0))}")
        lines += ["", "\\3-grams:"]
        for triple, p in self.trigrams.items():
            lines.append(f"{_log10(p)}\t{triple[0]} {triple[1]} {triple[2]}")
        return "\n".join([*lines, "", "\\end\\", ""])

    @classmethod
    def from_arpa(cls, text: str) -> Trigrams:
        """Returns the model that `arpa` has written; numbers are rounded to five decimal places."""
        orders: dict[str, list[list[str]]] = {}
        for line in text.splitlines():
            if line.startswith("\\") and line.endswith("-grams:"):
                rows = orders.setdefault(line[1], [])
            elif orders and line and line[0] != "\\":
                rows.append(line.split("\t"))
        ones = {row[1]: (10 ** float(row[0]), 10 ** float(row[2])) for row in orders["1"]}
        twos = {_pair(row[1]): (10 ** float(row[0]), 10 ** float(row[2])) for row in orders["2"]}
        return cls(
            {word: p for word, (p, _) in ones.items() if word != START},
            {pair: p for pair, (p, _) in twos.items()},
            {_triple(row[1]): 10 ** float(row[0]) for row in orders["3"]},
            {word: weight for word, (_, weight) in ones.items()},
            {pair: weight for pair, (_, weight) in twos.items()},
        )

    def _after(self, word: str) -> str:
        return _log10(self.backoff1.get(word, 1.0))


def _pair(text: str) -> tuple[str, str]:
    first, second = text.split(" ")
    return first, second


def _triple(text: str) -> tuple[str, str, str]:
    first, second, third = text.split(" ")
    return first, second, third


def _log10(probability: float) -> str:
    return f"{pm.log10(max(probability, _TINY)):.5f}"


def estimate(sentences: Iterable[tuple[Sequence[str], float]], words: Iterable[str] = ()) -> Trigrams:
    """Returns the model of weighted sentences.

    Interpolated Kneser-Ney smoothing with one discount: the lower order of a word counts the different words before it
    (Kneser and Ney, ICASSP 1995; Chen and Goodman, 1999).

    Args:
        sentences: words of each sentence, and its weight; a weight of 1 is one occurrence.
        words: further words of the vocabulary.
    """
    two: dict[tuple[str, str], float] = defaultdict(float)  # counts may be fractions
    three: dict[tuple[str, str, str], float] = defaultdict(float)
    for sentence, weight in sentences:
        tokens = [START, *sentence, END]
        for pair in pairwise(tokens):
            two[pair] += weight
        for triple in zip(tokens, tokens[1:], tokens[2:], strict=False):
            three[triple] += weight
    before = Counter(second for _, second in two)
    vocabulary = sorted({*before, *words, END})
    total = sum(before.values()) or 1
    unigrams = {word: (1 - _UNIFORM) * before[word] / total + _UNIFORM / len(vocabulary) for word in vocabulary}
    bigrams, backoff1 = _smoothed(two, unigrams)
    trigrams: dict[tuple[str, str, str], float] = {}
    backoff2: dict[tuple[str, str], float] = {}
    following: dict[tuple[str, str], dict[str, float]] = defaultdict(dict)
    for (first, second, word), count in three.items():
        following[first, second][word] = count
    for (first, second), counts in following.items():
        lower = {word: bigrams[second, word] for word in counts}
        found, backoff2[first, second] = _discounted(counts, lower)
        trigrams |= {(first, second, word): p for word, p in found.items()}
    return Trigrams(unigrams, bigrams, trigrams, backoff1, backoff2)


def _smoothed(
    counts: Mapping[tuple[str, str], float], unigrams: Mapping[str, float]
) -> tuple[dict[tuple[str, str], float], dict[str, float]]:
    following: dict[str, dict[str, float]] = defaultdict(dict)
    for (first, word), count in counts.items():
        following[first][word] = count
    bigrams: dict[tuple[str, str], float] = {}
    backoff: dict[str, float] = {}
    for first, found in following.items():
        smoothed, backoff[first] = _discounted(found, {word: unigrams[word] for word in found})
        bigrams |= {(first, word): p for word, p in smoothed.items()}
    return bigrams, backoff


def _discounted(counts: Mapping[str, float], lower: Mapping[str, float]) -> tuple[dict[str, float], float]:
    """Returns the probabilities of the words that follow a context, and the weight of the lower order for others."""
    total = sum(counts.values())
    kept = {word: max(count - DISCOUNT * min(count, 1.0), 0.0) / total for word, count in counts.items()}
    spare = 1.0 - sum(kept.values())
    smoothed = {word: share + spare * lower[word] for word, share in kept.items()}
    rest, unseen = 1.0 - sum(smoothed.values()), 1.0 - sum(lower.values())
    return smoothed, max(rest, 1e-9) / max(unseen, 1e-9)
