"""Layers of the networks of both roles: embedded words, hidden layers, successive remarks, scores of options."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from dorothie_gym.baselines.roles.learned_role.utterance_inputs import WORD_BUCKETS

WORD_WIDTH, WIDTH, REMARK_WIDTH = 24, 256, 48
"""Widths of the word embedding, of the hidden layers, and of an embedded remark."""


class RoleNetwork(nn.Module):
    """Network whose inputs are a state and the words of the latest utterance."""

    def __init__(self) -> None:
        super().__init__()
        self.words = nn.EmbeddingBag(WORD_BUCKETS, WORD_WIDTH, mode="mean", padding_idx=0)

    def hidden(self, layers: nn.Module, state: Tensor, words: Tensor) -> Tensor:
        """Returns the hidden layer (b, h) of states (b, n) and rows of words (b, w)."""
        found: Tensor = layers(torch.cat([state, self.words(words)], dim=1))
        return found


def following_remark(remarks: int) -> nn.Sequential:
    """Returns the layers that score the remark after another one, (b, h + `REMARK_WIDTH`) -> (b, r)."""
    return nn.Sequential(nn.Linear(WIDTH + REMARK_WIDTH, WIDTH // 2), nn.ReLU(), nn.Linear(WIDTH // 2, remarks))


def hidden_layers(inputs: int, width: int, dropout: float = 0.0) -> nn.Sequential:
    """Returns two hidden layers (b, inputs) -> (b, width).

    Args:
        inputs: length of the input.
        width: number of units of a layer.
        dropout: share of the units that are left out in training.
    """

    def activation() -> nn.Sequential:
        return nn.Sequential(nn.ReLU(), nn.Dropout(dropout))

    return nn.Sequential(nn.Linear(inputs, width), activation(), nn.Linear(width, width), activation())


def option_scorer(inputs: int, width: int) -> nn.Sequential:
    """Returns the layers that score one option, (..., inputs) -> (..., 1)."""
    return nn.Sequential(nn.Linear(inputs, width), nn.ReLU(), nn.Linear(width, 1))


def option_scores(scorer: nn.Module, hidden: Tensor, options: Tensor, count: Tensor) -> Tensor:
    """Returns the score of each option (b, k), almost minus infinity for those that are only filled in.

    Args:
        scorer: `option_scorer`.
        hidden: hidden layer (b, h).
        options: vectors of the options (b, k, n).
        count: number of options (b,).
    """
    number = options.shape[1]
    repeated = hidden[:, None, :].expand(-1, number, -1)
    scores: Tensor = scorer(torch.cat([repeated, options], dim=2)).squeeze(2)
    return without_missing(scores, count)


def without_missing(scores: Tensor, count: Tensor) -> Tensor:
    """Returns scores (b, k), almost minus infinity for the options that are padding, those from number (b,) upwards."""
    missing = torch.arange(scores.shape[1])[None, :] >= count[:, None]
    return scores.masked_fill(missing, -1e9)
