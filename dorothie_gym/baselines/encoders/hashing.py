"""Texts as hashed n-grams: no weights, no download, no training."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from dorothie_gym.baselines.encoders.encoder import Vectors


@dataclass(frozen=True, kw_only=True)
class HashingEncoder:
    """One or two words in a row, and letters in a row, each hashed to a place of the vector with a sign.

    Words tell what is said; letters make speech recognition's near misses lie close to what was said.

    Attributes:
        dim: length of a vector, even: half for words, half for letters. 384 as MiniLM's by default.
    """

    name: ClassVar[str] = "hashing"
    dim: int = 384

    def __post_init__(self) -> None:
        if self.dim < 2 or self.dim % 2:
            raise ValueError(f"HashingEncoder.dim is {self.dim}; it must be even and at least 2")

    @property
    def id(self) -> str:
        """Name, version and length."""
        return f"hashing-1-{self.dim}"

    def encode(self, texts: Sequence[str]) -> Vectors:
        """Returns the vectors of texts, float32 (n, dim), each half of length 1, or 0 for a text without words."""
        if not texts:
            return np.zeros((0, self.dim), dtype=np.float32)
        return np.hstack([part.transform(texts).toarray() for part in self._parts]).astype(np.float32)

    @cached_property
    def _parts(self) -> tuple[Any, Any]:
        # imported here: slow to import, and vectors are mostly found in the cache
        from sklearn.feature_extraction.text import HashingVectorizer

        half = {"n_features": self.dim // 2, "norm": "l2", "lowercase": True}
        words = HashingVectorizer(ngram_range=(1, 2), token_pattern=r"(?u)\w+|\?", **half)
        return words, HashingVectorizer(analyzer="char_wb", ngram_range=(3, 4), **half)
