"""The network of the learned participant: it chooses the errand, then speaks, over one word embedding."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from dorothie_gym.baselines.co_wizard.hearing import KEPT, UTTERANCE_SIZE, WORD_BUCKETS
from dorothie_gym.baselines.imitation.layers import hidden_layers, option_scorer, option_scores
from dorothie_gym.baselines.participant.features import ERRAND_SIZE, STATE_SIZE

WORD_WIDTH, WIDTH, OPTION_WIDTH, REMARK_WIDTH = 24, 256, 64, 48
"""Widths of the word embedding, of the hidden layers, of the layer that scores errands, and of an embedded remark."""


@dataclass(frozen=True, kw_only=True)
class Layout:
    """Lengths of the inputs and outputs.

    Attributes:
        state: length of state and utterances.
        errand: length of the vector of an errand.
        remarks: size of the vocabulary of remarks.
    """

    state: int
    errand: int
    remarks: int

    @classmethod
    def of(cls, remarks: int) -> Layout:
        """Returns the layout of this version for a vocabulary of some size."""
        return cls(state=STATE_SIZE + KEPT * UTTERANCE_SIZE, errand=ERRAND_SIZE, remarks=remarks)


class ParticipantNetwork(nn.Module):
    """Chooses the target, whether to guide, and the remarks."""

    def __init__(self, layout: Layout) -> None:
        super().__init__()
        self.layout = layout
        self.words = nn.EmbeddingBag(WORD_BUCKETS, WORD_WIDTH, mode="mean", padding_idx=0)
        self.choosing = hidden_layers(layout.state + WORD_WIDTH, WIDTH)
        self.keep = nn.Linear(WIDTH, 1)
        self.errand = option_scorer(WIDTH + layout.errand, OPTION_WIDTH)
        self.guiding = nn.Linear(WIDTH, 1)
        self.kept = nn.Parameter(torch.tensor(2.0))
        self.speaking = hidden_layers(layout.state + WORD_WIDTH, WIDTH)
        self.first = nn.Linear(WIDTH, layout.remarks)
        self.remarks = nn.Embedding(layout.remarks, REMARK_WIDTH)
        self.next = nn.Sequential(
            nn.Linear(WIDTH + REMARK_WIDTH, WIDTH // 2), nn.ReLU(), nn.Linear(WIDTH // 2, layout.remarks)
        )

    def choose(
        self, state: Tensor, words: Tensor, errands: Tensor, count: Tensor, guides: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Returns the logits of keeping the target and of each errand (b, 1 + k), and that of guiding (b,).

        Args:
            state: (b, n).
            words: rows of the words of the latest utterance (b, w).
            errands: vectors of the errands (b, k, e).
            count: number of errands (b,).
            guides: whether the car is guided so far, 0 or 1 (b,).
        """
        hidden = self.choosing(torch.cat([state, self.words(words)], dim=1))
        scores = option_scores(self.errand, hidden, errands, count)
        guiding = self.guiding(hidden).squeeze(1) + self.kept * (2.0 * guides - 1.0)
        return torch.cat([self.keep(hidden), scores], dim=1), guiding

    def speak(self, state: Tensor, words: Tensor) -> tuple[Tensor, Tensor]:
        """Returns the logits of the first remark (b, r), and the hidden layer for `then`."""
        hidden = self.speaking(torch.cat([state, self.words(words)], dim=1))
        return self.first(hidden), hidden

    def then(self, hidden: Tensor, before: Tensor) -> Tensor:
        """Returns the logits of the remark (b, r) behind another one (b,)."""
        scores: Tensor = self.next(torch.cat([hidden, self.remarks(before)], dim=1))
        return scores
