"""Layers of TOTO: time encoding, dropout, attention over a sequence and over a graph."""

from __future__ import annotations

import math
from typing import Final

import torch
from torch import Tensor, nn
from torch.nn import functional as F

TIME_STEP: Final = 0.5
"""One step of the time encoding [s]: the sines of the fastest channel turn once in about 3 s."""

_PERIOD_RATIO: Final = 10_000.0
"""Ratio of the slowest to the fastest channel (Vaswani et al., 2017, section 3.5)."""

_LOWEST: Final = torch.iinfo(torch.int64).min


def time_encoding(seconds: Tensor, width: int) -> Tensor:
    """Returns the encoding of times in all channels (..., width): sines in the first half, cosines in the second.

    Args:
        seconds: (...) of 0 or more [s].
        width: even.
    """
    exponents = torch.arange(width // 2, device=seconds.device, dtype=torch.float32) * (2.0 / width)
    angles = (seconds.float() / TIME_STEP).unsqueeze(-1) * torch.exp(
        exponents * -math.log(_PERIOD_RATIO)
    )  # (..., width/2)
    return torch.cat((angles.sin(), angles.cos()), dim=-1)


class Dropout(nn.Module):
    """Dropout with one random byte per value, an eighth of the usual cost; `rate` is rounded to 1/256.

    Remaining values are scaled by the rounded rate, so that the mean is exact.

    Args:
        rate: share of values that become 0, in [0, 1).
    """

    def __init__(self, rate: float):
        super().__init__()
        self.level = round(256 * rate)

    def forward(self, values: Tensor) -> Tensor:
        """Returns the values, in training with some of them set to 0."""
        if not self.training or self.level == 0:
            return values
        if values.device.type != "cpu":
            return F.dropout(values, self.level / 256)
        words = torch.empty((values.numel() + 7) // 8, dtype=torch.int64).random_(_LOWEST, None)
        dropped = words.view(torch.uint8)[: values.numel()] < self.level
        return (values * (256 / (256 - self.level))).masked_fill(dropped.view(values.shape), 0.0)


class Block(nn.Module):
    """Layer of the encoder: attention, then feed-forward, each added to its input and normalised after (2017).

    Args:
        width: numbers of a token.
        heads: number of attention heads.
        feed_forward: numbers between its two matrices.
        dropout: share of values dropped.
        attention_dropout: share of the attention's weights dropped.
    """

    def __init__(self, width: int, heads: int, feed_forward: int, dropout: float, attention_dropout: float = 0.0):
        super().__init__()
        self.heads = heads
        self.query = nn.Linear(width, width)
        self.key_value = nn.Linear(width, 2 * width)
        self.out = nn.Linear(width, width)
        self.expand = nn.Linear(width, feed_forward)
        self.contract = nn.Linear(feed_forward, width)
        self.after_attention = nn.LayerNorm(width)
        self.after_feed_forward = nn.LayerNorm(width)
        self.dropout = Dropout(dropout)
        self.attention_dropout = Dropout(attention_dropout)

    def forward(self, tokens: Tensor, mask: Tensor, queries: Tensor | None = None) -> Tensor:
        """Returns the tokens after the layer.

        Args:
            tokens: (B, T, width) tokens that are attended to.
            mask: (B, T) True where there is a token.
            queries: (B, Q, width) the tokens to compute; all if None.
        """
        queries = tokens if queries is None else queries
        queries = self.after_attention(queries + self.dropout(self._attend(queries, tokens, mask)))
        hidden = self.contract(self.dropout(F.relu(self.expand(queries))))
        normed: Tensor = self.after_feed_forward(queries + self.dropout(hidden))
        return normed

    def _attend(self, queries: Tensor, tokens: Tensor, mask: Tensor) -> Tensor:
        query = _split(self.query(queries), self.heads)  # (B, heads, Q, width/heads)
        key, value = (_split(part, self.heads) for part in self.key_value(tokens).chunk(2, dim=-1))
        seen = mask[:, None, None, :]  # (B, 1, 1, T)
        if self.training and self.attention_dropout.level and query.device.type == "cpu":
            # torch's own attention is slow on a CPU with dropout of weights
            scores = (query @ key.mT / math.sqrt(query.shape[-1])).masked_fill(~seen, -math.inf)
            attended = self.attention_dropout(scores.softmax(dim=-1)) @ value
        else:
            rate = self.attention_dropout.level / 256 if self.training else 0.0
            attended = F.scaled_dot_product_attention(query, key, value, attn_mask=seen, dropout_p=rate)
        out: Tensor = self.out(attended.transpose(1, 2).flatten(2))
        return out


class GraphAttention(nn.Module):
    """Attention of each node to those that lead to it, and to itself (Velickovic et al., 2018), written sparse.

    The result does not depend on the number of nodes: concatenated graphs give the same vectors as each graph alone.

    Args:
        inputs: numbers of a node.
        outputs: numbers of a node after, a multiple of `heads`.
        heads: number of attention heads.
        edge_types: number of kinds of edges, without that of a node to itself.
    """

    def __init__(self, inputs: int, outputs: int, heads: int, edge_types: int):
        super().__init__()
        self.heads = heads
        self.project = nn.Linear(inputs, outputs, bias=False)
        self.to_source = nn.Parameter(torch.empty(heads, outputs // heads))
        self.to_target = nn.Parameter(torch.empty(heads, outputs // heads))
        self.of_edge = nn.Embedding(edge_types + 1, heads)
        self.bias = nn.Parameter(torch.zeros(outputs))
        nn.init.xavier_uniform_(self.to_source)
        nn.init.xavier_uniform_(self.to_target)

    def forward(self, nodes: Tensor, edges: Tensor, edge_types: Tensor) -> Tensor:
        """Returns the nodes (L, outputs).

        Args:
            nodes: (L, inputs).
            edges: (2, E) sources and targets.
            edge_types: (E,).
        """
        count = len(nodes)
        itself = torch.arange(count, device=nodes.device)
        source, target = torch.cat((edges, itself.expand(2, -1)), dim=1)  # (E + L,) each
        own = torch.full_like(itself, self.of_edge.num_embeddings - 1)
        hidden = self.project(nodes).view(count, *self.to_source.shape)  # (L, heads, outputs/heads)
        score = (hidden * self.to_source).sum(-1).index_select(0, source)
        score = score + (hidden * self.to_target).sum(-1).index_select(0, target)
        score = F.leaky_relu(score + self.of_edge(torch.cat((edge_types, own))), 0.2)  # (E + L, heads)
        weight = segment_softmax(score, target, count)
        message = hidden.index_select(0, source) * weight.unsqueeze(-1)  # (E + L, heads, outputs/heads)
        summed = torch.zeros_like(hidden).index_add(0, target, message)
        return F.elu(summed.flatten(1) + self.bias)


def segment_softmax(scores: Tensor, segment: Tensor, count: int) -> Tensor:
    """Returns the softmax of scores over the rows of each segment (n, heads).

    Args:
        scores: (n, heads).
        segment: (n,) segment of each row, in any order.
        count: number of segments.
    """
    highest = scores.new_full((count, scores.shape[1]), -math.inf)
    highest = highest.scatter_reduce(0, segment[:, None].expand_as(scores), scores.detach(), "amax")
    weight = (scores - highest.index_select(0, segment)).exp()
    total = weight.new_zeros(highest.shape).index_add(0, segment, weight)
    return weight / total.index_select(0, segment)


def _split(tokens: Tensor, heads: int) -> Tensor:
    """Reshapes (B, T, width) to (B, heads, T, width/heads)."""
    return tokens.view(*tokens.shape[:2], heads, -1).transpose(1, 2)
