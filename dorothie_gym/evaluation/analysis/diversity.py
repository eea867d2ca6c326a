"""Lexical diversity of a corpus: repetition of utterances and trigram perplexity."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from importlib.util import find_spec
from typing import Protocol, TypedDict

_WORD = re.compile(r"[^\W_]+(?:['’\-][^\W_]+)*")


def words_of(text: str) -> tuple[str, ...]:
    """Returns the words of a text, case folded and without punctuation; "7-Eleven" and "don't" are one word each."""
    return tuple(_WORD.findall(text.casefold().replace("’", "'")))


def plain(text: str) -> str:
    """Returns the words of a text, which are equal for texts that differ in case or punctuation only."""
    return " ".join(words_of(text))


# --- Diversity -------------------------------------------------------------------------------------------------------

ORDER = 3
UNKNOWN = "<unk>"


class Repetition(TypedDict):
    """Measures of the repetition of utterances; None without utterances."""

    distinct_utterance_ratio: float | None
    commonest_utterance: str | None
    commonest_utterance_share: float | None


def repetition(texts: Counter[str]) -> Repetition:
    """Returns measures of the repetition of utterances.

    Args:
        texts: counts of texts.

    Returns:
        `distinct_utterance_ratio`, `commonest_utterance` and its share `commonest_utterance_share`; None without
        utterances.
    """
    if not texts:
        return Repetition(distinct_utterance_ratio=None, commonest_utterance=None, commonest_utterance_share=None)
    text, count = min(texts.items(), key=lambda item: (-item[1], item[0]))
    total = texts.total()
    return {
        "distinct_utterance_ratio": len(texts) / total,
        "commonest_utterance": text,
        "commonest_utterance_share": count / total,
    }


def has_language_models() -> bool:
    """Returns whether nltk is installed, which `trigram_perplexity` needs."""
    return find_spec("nltk") is not None


def trigram_perplexity(train: Iterable[str], test: Iterable[str]) -> float | None:
    """Returns the perplexity of texts under an interpolated Kneser-Ney trigram model.

    Words are lower-cased; those that occur at most once in training are unknown. The end of an utterance counts as a
    word. The discount is 0.1, the default of nltk (Kneser and Ney 1995; Chen and Goodman 1998 for the interpolation).

    Args:
        train: training utterances.
        test: test utterances.

    Returns:
        The perplexity; None if one of the sets has no words; infinity if a word has probability 0.

    Raises:
        ModuleNotFoundError: nltk is not installed.
    """
    from nltk.lm import Vocabulary

    learnt, heard = _split(train), _split(test)
    if not learnt or not heard:
        return None
    vocabulary = Vocabulary((word for words in learnt for word in words), unk_cutoff=2, unk_label=UNKNOWN)
    model = _fitted([vocabulary.lookup(words) for words in learnt])
    surprise, count = 0.0, 0
    known: dict[tuple[str, ...], float] = {}
    for words in heard:
        padded = _padded(vocabulary.lookup(words))
        for k in range(ORDER - 1, len(padded)):
            gram = tuple(padded[k - ORDER + 1 : k + 1])
            if gram not in known:
                known[gram] = float(model.unmasked_score(gram[-1], gram[:-1]))
            if known[gram] <= 0.0:
                return math.inf
            surprise -= math.log2(known[gram])
            count += 1
    return float(2.0 ** (surprise / count))


def _split(texts: Iterable[str]) -> list[tuple[str, ...]]:
    return [words for words in map(words_of, texts) if words]


def _padded(words: Sequence[str]) -> list[str]:
    return ["<s>"] * (ORDER - 1) + list(words) + ["</s>"]


class _LanguageModel(Protocol):
    def unmasked_score(self, word: str, context: tuple[str, ...]) -> float:
        """Returns the probability of a word after its context."""
        ...


def _fitted(sentences: Sequence[Sequence[str]]) -> _LanguageModel:
    """Returns nltk's model of the sentences with an estimator that counts continuations once, not for every score."""
    from nltk.lm.models import InterpolatedLanguageModel
    from nltk.lm.smoothing import KneserNey
    from nltk.util import everygrams

    class Remembering(KneserNey):  # type: ignore[misc]  # nltk has no types
        """Kneser-Ney with precomputed sums over contexts; nltk's own takes seconds for a hundred scores."""

        tables: dict[tuple[str, ...], tuple[Counter[str], int]]

        def _continuation_counts(self, word: str, context: tuple[str, ...] = ()) -> tuple[int, int]:
            if not hasattr(self, "tables"):
                self.tables = {}
                for length in range(2, self._order + 1):
                    self._sum_up(length)
            continuations, total = self.tables.get(tuple(context), (Counter(), 0))
            return continuations[word], total

        def _sum_up(self, length: int) -> None:
            for prefix, counts in self.counts[length].items():
                seen = [each for each, count in counts.items() if count > 0]
                continuations, total = self.tables.setdefault(tuple(prefix[1:]), (Counter(), 0))
                continuations.update(seen)
                self.tables[tuple(prefix[1:])] = continuations, total + len(seen)

    model = InterpolatedLanguageModel(Remembering, ORDER, params={"discount": 0.1, "order": ORDER})
    padded = [_padded(words) for words in sentences]
    model.fit((everygrams(words, max_len=ORDER) for words in padded), [word for words in padded for word in words])
    fitted: _LanguageModel = model
    return fitted
