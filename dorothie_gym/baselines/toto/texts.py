"""Text embeddings: frozen vectors, or an encoder trained with the rest of the model."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, Final

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from dorothie_gym.baselines.encoders.byte_pairs import PAD
from dorothie_gym.baselines.toto.layers import Block

_SMALLEST_SPREAD: Final = 1e-6


class Texts(nn.Module, ABC):
    """Turns indices of texts into vectors.

    The texts themselves are not part of a model's weights: a model may be used on another corpus.

    Attributes:
        width: numbers of a vector.
    """

    width: int

    @abstractmethod
    def forward(self, index: Tensor) -> Tensor:
        """Returns the vectors of texts (..., width); zeros where the index (...) is -1."""

    @abstractmethod
    def take(self, table: Tensor) -> None:
        """Replaces the texts: rows of the same form as at construction."""


class FrozenTexts(Texts):
    """Vectors of a text encoder.

    Args:
        table: (n, width) float32, a row for each text of the corpus.
        spread: divisor that scales them to about 1; computed from this table if None.

    Attributes:
        spread: see above.
    """

    table: Tensor

    def __init__(self, table: Tensor, spread: float | None = None):
        super().__init__()
        self.width = table.shape[1]
        self.spread = spread_of(table) if spread is None else spread
        self.register_buffer("table", table, persistent=False)
        self.take(table)

    def take(self, table: Tensor) -> None:
        """Replaces the texts: vectors (n, width)."""
        self.table = torch.cat((table / self.spread, table.new_zeros(1, self.width)))

    def forward(self, index: Tensor) -> Tensor:
        """Returns the vectors of texts (..., width); zeros where the index (...) is -1."""
        return self.table[index]  # -1 is the last row, which is zeros


class TrainedTexts(Texts):
    """Trained text encoder. Each distinct text of a batch is encoded once.

    Args:
        tokens: (n, length) int64 pieces of each text of the corpus, padding at the end.
        reader: module from pieces (u, length) to vectors (u, width).
        width: width of the reader's vectors.
    """

    tokens: Tensor

    def __init__(self, tokens: Tensor, reader: nn.Module, width: int):
        super().__init__()
        self.width = width
        self.reader = reader
        self.register_buffer("tokens", tokens, persistent=False)
        self.take(tokens)

    def take(self, table: Tensor) -> None:
        """Replaces the texts: pieces (n, length)."""
        self.tokens = torch.cat((table, table.new_full((1, table.shape[1]), PAD)))

    def forward(self, index: Tensor) -> Tensor:
        """Returns the vectors of texts (..., width); zeros where the index (...) is -1."""
        distinct, place = torch.unique(index, return_inverse=True)
        pieces = self.tokens[distinct]
        longest = max(1, int((pieces != PAD).sum(1).max()))
        vectors = self.reader(pieces[:, :longest]) * (distinct >= 0).unsqueeze(-1)
        return F.embedding(place, vectors)  # its gradient is summed in a fixed order


def spread_of(table: Tensor) -> float:
    """Returns the root mean square of vectors (n, width)."""
    return float(table.square().mean().sqrt().clamp(min=_SMALLEST_SPREAD))


class SmallTextEncoder(nn.Module):
    """Transformer encoder of few layers over byte pairs, trained from random weights with the rest of the model.

    Args:
        vocabulary: number of pieces.
        length: maximum number of pieces of a text.
        width, layers: sizes of the encoder; each head is 32 wide, or as wide as a narrower encoder.
        dropout: share of values dropped.
    """

    def __init__(self, vocabulary: int, length: int, width: int, layers: int, dropout: float):
        super().__init__()
        self.piece = nn.Embedding(vocabulary, width)
        self.place = nn.Embedding(length, width)
        self.norm = nn.LayerNorm(width)
        heads = max(1, width // 32)
        self.blocks = nn.ModuleList(Block(width, heads, 2 * width, dropout) for _ in range(layers))
        nn.init.normal_(self.piece.weight, std=0.02)
        nn.init.normal_(self.place.weight, std=0.02)

    def forward(self, pieces: Tensor) -> Tensor:
        """Returns vectors of texts (u, width): the mean over their pieces.

        Args:
            pieces: (u, length) padding at the end; a text without any is read as one piece of padding.
        """
        mask = pieces != PAD
        mask = torch.cat((mask.any(1, keepdim=True).logical_not() | mask[:, :1], mask[:, 1:]), dim=1)
        tokens = self.norm(self.piece(pieces) + self.place.weight[: pieces.shape[1]])  # (u, length, width)
        for block in self.blocks:
            tokens = block(tokens, mask)
        kept = mask.unsqueeze(-1)
        pooled: Tensor = (tokens * kept).sum(1) / kept.sum(1)
        return pooled


class PretrainedBert(nn.Module):
    """BERT of transformers whose weights are trained further.

    Args:
        model: a `BertModel`; its padding is id 0, as in every published BERT.
    """

    def __init__(self, model: Any):
        super().__init__()
        self.model = model

    def forward(self, pieces: Tensor) -> Tensor:
        """Returns vectors of texts (u, width): the mean over their pieces (u, length)."""
        mask = pieces != PAD
        mask = torch.cat((mask.any(1, keepdim=True).logical_not() | mask[:, :1], mask[:, 1:]), dim=1)
        tokens = self.model(input_ids=pieces, attention_mask=mask.long()).last_hidden_state
        kept = mask.unsqueeze(-1)
        pooled: Tensor = (tokens * kept).sum(1) / kept.sum(1)
        return pooled
