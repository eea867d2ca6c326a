"""The network of the learned participant: it chooses the errand, then speaks, over one word embedding."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
import torch
from torch import Tensor, nn

from dorothie_gym.baselines.roles.learned_role.inference import Dense, Floats, FollowingRemark, HiddenLayers, Scorer
from dorothie_gym.baselines.roles.learned_role.network import (
    REMARK_WIDTH,
    WIDTH,
    WORD_WIDTH,
    RoleNetwork,
    following_remark,
    hidden_layers,
    option_scorer,
    option_scores,
)
from dorothie_gym.baselines.roles.learned_role.utterance_inputs import KEPT, UTTERANCE_SIZE
from dorothie_gym.baselines.roles.participant.features import ERRAND_SIZE, STATE_SIZE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from dorothie_gym.baselines.roles.learned_role.decision import InputBatch

ERRAND_WIDTH: Final = 64
"""Width of the layer that scores errands."""


@dataclass(frozen=True, kw_only=True)
class ParticipantLayout:
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
    def of(cls, remarks: int) -> ParticipantLayout:
        """Returns the layout of this version for a vocabulary of a given size."""
        return cls(state=STATE_SIZE + KEPT * UTTERANCE_SIZE, errand=ERRAND_SIZE, remarks=remarks)


class ParticipantNetwork(RoleNetwork):
    """Chooses the target, whether to guide, and the remarks."""

    def __init__(self, layout: ParticipantLayout) -> None:
        super().__init__()
        self.layout = layout
        self.choosing = hidden_layers(layout.state + WORD_WIDTH, WIDTH)
        self.keep = nn.Linear(WIDTH, 1)
        self.errand = option_scorer(WIDTH + layout.errand, ERRAND_WIDTH)
        self.guiding = nn.Linear(WIDTH, 1)
        self.kept = nn.Parameter(torch.tensor(2.0))
        self.speaking = hidden_layers(layout.state + WORD_WIDTH, WIDTH)
        self.first = nn.Linear(WIDTH, layout.remarks)
        self.remarks = nn.Embedding(layout.remarks, REMARK_WIDTH)
        self.next = following_remark(layout.remarks)

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
        hidden = self.hidden(self.choosing, state, words)
        scores = option_scores(self.errand, hidden, errands, count)
        guiding = self.guiding(hidden).squeeze(1) + self.kept * (2.0 * guides - 1.0)
        return torch.cat([self.keep(hidden), scores], dim=1), guiding

    def speak(self, state: Tensor, words: Tensor) -> tuple[Tensor, Tensor]:
        """Returns the logits of the first remark (b, r), and the hidden layer for `then`."""
        hidden = self.hidden(self.speaking, state, words)
        return self.first(hidden), hidden

    def then(self, hidden: Tensor, before: Tensor) -> Tensor:
        """Returns the logits of the remark (b, r) that follows another one (b,)."""
        scores: Tensor = self.next(torch.cat([hidden, self.remarks(before)], dim=1))
        return scores


class ParticipantInference:
    """Forward passes of a trained network in play, with equal results in batches of any size."""

    def __init__(self, network: ParticipantNetwork) -> None:
        """Copies the parameters of a network."""
        self._choosing, self._speaking = (HiddenLayers(network, each) for each in (network.choosing, network.speaking))
        self._keep, self._guiding, self._kept = Dense(network.keep), Dense(network.guiding), network.kept.item()
        first, size = network.errand[0], WIDTH + network.layout.errand
        self._errand = Scorer(Dense.of_part(first, 0, WIDTH), Dense.of_part(first, WIDTH, size), network.errand[2])
        self._first, self.then = Dense(network.first), FollowingRemark(network.remarks, network.next)

    def choose(self, batch: InputBatch, guides: Sequence[bool]) -> tuple[Floats, Floats]:
        """Returns the logits of keeping the target and of each errand (b, 1 + k), and that of guiding (b,)."""
        hidden = self._choosing(batch)
        scores = self._errand(hidden, batch.options, batch.counts)
        kept = np.array([self._kept if guided else -self._kept for guided in guides], dtype=np.float32)
        return np.concatenate([self._keep(hidden), scores], axis=1), self._guiding(hidden)[:, 0] + kept

    def speak(self, batch: InputBatch) -> tuple[Floats, Floats]:
        """Returns the logits of the first remark (b, r), and the hidden layer for `then`."""
        hidden = self._speaking(batch)
        return self._first(hidden), hidden
