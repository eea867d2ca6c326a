"""Encoders of texts, sounds and images, the cache of text vectors, and the hashing encoder."""

from __future__ import annotations

import hashlib
import io
import logging
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Protocol, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.support.user_cache import read_signed, write_signed

if TYPE_CHECKING:
    from sklearn.feature_extraction.text import HashingVectorizer

_log = logging.getLogger(__name__)

Vectors: TypeAlias = NDArray[np.float32]

ItemT = TypeVar("ItemT", contravariant=True)


class Encoder(Protocol[ItemT]):
    """Deterministic mapping of texts, sounds or images to vectors of one length.

    Attributes:
        name: name for users.
        id: name, version and sizes, or a hash of the weights: equal ids, equal vectors. Part of the key of every cache
            and of every result.
        dim: length of a vector.
    """

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def id(self) -> str: ...  # noqa: D102
    @property
    def dim(self) -> int: ...  # noqa: D102

    def encode(self, items: Sequence[ItemT], /) -> Vectors:
        """Returns the vectors of items, float32 (n, dim)."""
        ...


TextEncoder: TypeAlias = Encoder[str]
"""Encoder of texts."""

SpeechEncoder: TypeAlias = Encoder[NDArray[np.float32]]
"""Encoder of sounds: float32 (samples,) in [-1, 1] at 16 kHz each."""

ImageEncoder: TypeAlias = Encoder[NDArray[np.uint8]]
"""Encoder of images: uint8 (height, width, 3) each."""


def text_table(encoder: TextEncoder, texts: Sequence[str], cache: Path | None = None) -> Vectors:
    """Returns the vectors of texts, float32 (n, dim), from the cache if it contains them.

    Args:
        encoder: the encoder.
        texts: texts of a corpus, each once.
        cache: folder of the user's cache folder to keep them in; None for no cache.
    """
    if cache is None:
        return encoder.encode(texts)
    path = cache / f"{table_key(encoder.id, texts)}.npy"
    kept = _read(path, (len(texts), encoder.dim))
    if kept is not None:
        return kept
    table = encoder.encode(texts)
    buffer = io.BytesIO()
    np.save(buffer, table, allow_pickle=False)
    try:
        write_signed(path, buffer.getvalue())
    except OSError as error:
        _log.warning("%s: cannot be written (%s); the vectors are computed again the next time", path, error)
    return table


def table_key(encoder_id: str, texts: Sequence[str]) -> str:
    """Returns the cache key of a table: a hash of the encoder's id and of all texts in their order."""
    digest = hashlib.sha256(encoder_id.encode())
    for text in texts:
        part = text.encode("utf-8", "surrogatepass")
        digest.update(len(part).to_bytes(8, "little") + part)
    return digest.hexdigest()[:32]


def _read(path: Path, shape: tuple[int, int]) -> Vectors | None:
    """Returns a cached table; None if there is none of this shape."""
    content = read_signed(path)
    if content is None:
        return None
    table: Vectors = np.load(io.BytesIO(content), allow_pickle=False)
    return table if table.shape == shape and table.dtype == np.float32 else None


# --- Hashed n-grams ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class HashingEncoder:
    """Signed feature hashing of word unigrams and bigrams and of character n-grams.

    Words carry the content; letters place misrecognised words near the spoken ones.

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
        """Name, version and vector length."""
        return f"hashing-1-{self.dim}"

    def encode(self, texts: Sequence[str]) -> Vectors:
        """Returns the vectors of texts, float32 (n, dim), each half of length 1, or 0 for a text without words."""
        if not texts:
            return np.zeros((0, self.dim), dtype=np.float32)
        return np.hstack([part.transform(texts).toarray() for part in self._parts]).astype(np.float32)

    @cached_property
    def _parts(self) -> tuple[HashingVectorizer, HashingVectorizer]:
        # imported here: slow to import, and vectors are mostly found in the cache
        from sklearn.feature_extraction.text import HashingVectorizer

        half = {"n_features": self.dim // 2, "norm": "l2", "lowercase": True}
        words = HashingVectorizer(ngram_range=(1, 2), token_pattern=r"(?u)\w+|\?", **half)
        return words, HashingVectorizer(analyzer="char_wb", ngram_range=(3, 4), **half)
