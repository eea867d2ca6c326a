"""What an encoder is, and the table of vectors that it makes of a corpus's texts, made once and kept."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import Protocol, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.files import replacing

Vectors: TypeAlias = NDArray[np.float32]

ItemT = TypeVar("ItemT", contravariant=True)


class Encoder(Protocol[ItemT]):
    """Turns texts, sounds or pictures into vectors of one length, the same for the same item always.

    Attributes:
        name: how a user calls it.
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
"""Of texts."""

SpeechEncoder: TypeAlias = Encoder[NDArray[np.float32]]
"""Of sounds: float32 (samples,) in [-1, 1] at 16 kHz each."""

ImageEncoder: TypeAlias = Encoder[NDArray[np.uint8]]
"""Of pictures: uint8 (height, width, 3) each."""


def text_table(encoder: TextEncoder, texts: Sequence[str], cache: Path | None = None) -> Vectors:
    """Returns the vectors of texts, float32 (n, dim), from the cache where they are in there.

    Args:
        encoder: what makes them.
        texts: of a corpus, each once.
        cache: folder to keep them in; None: they are made anew.

    Raises:
        OSError: the cache cannot be written.
    """
    if cache is None:
        return encoder.encode(texts)
    path = cache / f"{table_key(encoder.id, texts)}.npy"
    if path.is_file():
        kept = _read(path, (len(texts), encoder.dim))
        if kept is not None:
            return kept
    table = encoder.encode(texts)
    _write(path, table)
    return table


def table_key(encoder_id: str, texts: Sequence[str]) -> str:
    """Returns the name under which a table is kept: a hash of the encoder's id and of all texts in their order."""
    digest = hashlib.sha256(encoder_id.encode())
    for text in texts:
        part = text.encode("utf-8", "surrogatepass")
        digest.update(len(part).to_bytes(8, "little") + part)
    return digest.hexdigest()[:32]


def _read(path: Path, shape: tuple[int, int]) -> Vectors | None:
    """A kept table; None where the file is damaged, which is made anew then."""
    try:
        table = np.load(path, allow_pickle=False)
    except (ValueError, EOFError):
        return None
    return table if table.shape == shape and table.dtype == np.float32 else None


def _write(path: Path, table: Vectors) -> None:
    """Writes whole or not at all; two processes may write the same at once."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path, shared=True) as part, part.open("wb") as file:
        np.save(file, table, allow_pickle=False)
