"""Byte pair encoding: pieces of words, learnt from the texts of a corpus (Sennrich et al., 2016)."""

from __future__ import annotations

import hashlib
import itertools
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

PAD: Final = 0
"""Id of padding at the end of texts."""

_BYTES: Final = 256
_WORD: Final = re.compile(r"\w+|[^\w\s]")


@dataclass(frozen=True)
class BytePairs:
    """Splits texts into pieces.

    Id 0 is padding, 1 + b is the byte b, and the following ids are the merged pairs in the order in which they were
    learnt.

    Attributes:
        merges: pairs of ids that became one, most frequent first.
    """

    merges: tuple[tuple[int, int], ...]
    _kept: dict[str, tuple[int, ...]] = field(default_factory=dict, repr=False, compare=False)

    @classmethod
    def train(cls, texts: Iterable[str], vocabulary: int = 1024) -> Self:
        """Learns pieces from texts by merging the most frequent pair of adjacent pieces repeatedly.

        Args:
            texts: texts of the training sessions only.
            vocabulary: maximum number of ids, including padding and bytes.

        Raises:
            ValueError: the vocabulary is too small for the bytes.
        """
        if vocabulary <= _BYTES:
            raise ValueError(f"vocabulary is {vocabulary}; it must be above {_BYTES}, which bytes and padding take")
        counts = Counter(word for text in texts for word in words(text))
        pieces = {word: _bytes(word) for word in counts}
        merges: list[tuple[int, int]] = []
        while len(merges) < vocabulary - _BYTES - 1:
            pairs: Counter[tuple[int, int]] = Counter()
            for word, ids in pieces.items():
                for pair in itertools.pairwise(ids):
                    pairs[pair] += counts[word]
            if not pairs:
                break
            pair = min(pairs, key=lambda pair: (-pairs[pair], pair))  # ties by id: the same in every process
            if pairs[pair] < 2:
                break
            new = 1 + _BYTES + len(merges)
            merges.append(pair)
            pieces = {word: _merged(ids, pair, new) for word, ids in pieces.items()}
        return cls(tuple(merges))

    def __len__(self) -> int:
        """Returns the number of ids, padding included."""
        return 1 + _BYTES + len(self.merges)

    @cached_property
    def id(self) -> str:
        """Name and a hash of the merges."""
        return f"byte-pairs-{hashlib.sha256(repr(self.merges).encode()).hexdigest()[:12]}"

    def ids(self, text: str) -> tuple[int, ...]:
        """Returns the ids of a text's pieces."""
        return tuple(piece for word in words(text) for piece in self._word(word))

    def table(self, texts: Sequence[str], length: int) -> NDArray[np.int32]:
        """Returns the ids of texts (n, length), int32, padded with 0 and truncated."""
        table = np.zeros((len(texts), length), dtype=np.int32)
        for row, text in zip(table, texts, strict=True):
            ids = self.ids(text)[:length]
            row[: len(ids)] = ids
        return table

    def _word(self, word: str) -> tuple[int, ...]:
        if word not in self._kept:
            ids = _bytes(word)
            while len(ids) > 1:
                pair = min(itertools.pairwise(ids), key=lambda pair: self._ranks.get(pair, len(self.merges)))
                if pair not in self._ranks:
                    break
                ids = _merged(ids, pair, 1 + _BYTES + self._ranks[pair])
            self._kept[word] = ids
        return self._kept[word]

    @cached_property
    def _ranks(self) -> dict[tuple[int, int], int]:
        return {pair: rank for rank, pair in enumerate(self.merges)}


def words(text: str) -> list[str]:
    """Returns the words and signs of a text in lower case."""
    return _WORD.findall(text.lower())


def _bytes(word: str) -> tuple[int, ...]:
    return tuple(1 + byte for byte in word.encode("utf-8", "surrogatepass"))


def _merged(ids: tuple[int, ...], pair: tuple[int, int], new: int) -> tuple[int, ...]:
    """Returns the ids with each occurrence of the pair replaced."""
    if pair[0] not in ids:
        return ids
    out: list[int] = []
    position = 0
    while position < len(ids):
        if ids[position : position + 2] == pair:
            out.append(new)
            position += 2
        else:
            out.append(ids[position])
            position += 1
    return tuple(out)
