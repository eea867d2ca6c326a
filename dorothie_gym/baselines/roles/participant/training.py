"""Training of the learned participant: imitation of a corpus, then rounds of practice beside the teacher (DAgger)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

import torch
from torch import Tensor
from torch.nn.functional import binary_cross_entropy_with_logits

from dorothie_gym.baselines.roles.learned_role.supervised import changed_weights, entropy, weighted_mean
from dorothie_gym.baselines.roles.learned_role.training import LearnedRole, train_role
from dorothie_gym.baselines.roles.participant.demonstrations import follow, practise
from dorothie_gym.baselines.roles.participant.examples import ParticipantExamples
from dorothie_gym.baselines.roles.participant.files import FILES

if TYPE_CHECKING:
    from dorothie_gym.baselines.roles.learned_role.dagger import FinishedFit, OnStage, RoundSettings
    from dorothie_gym.baselines.roles.participant.network import ParticipantNetwork


def loss_of(network: ParticipantNetwork, batch: ParticipantExamples) -> Tensor:
    """Returns the sum of the mean losses of all outputs [nats]."""
    weight, words, guides = batch.weight, batch.words.long(), batch.guides.float()
    target, guiding = network.choose(
        batch.choosing.float(), words, batch.errands.float(), batch.errand_count.long(), guides
    )
    losses = [weighted_mean(entropy(target, batch.target), weight)]
    changed = changed_weights(batch.guides, batch.guiding)
    wanted = binary_cross_entropy_with_logits(guiding, batch.guiding.float(), reduction="none")
    losses.append(weighted_mean(wanted, weight * changed))
    first, hidden = network.speak(batch.speaking.float(), words)
    losses.append(weighted_mean(entropy(first, batch.remarks[:, 0]), weight))
    for k in range(1, batch.remarks.shape[1]):
        before = batch.remarks[:, k - 1].long()
        said = before > 0
        if bool(said.any()):
            following = entropy(network.then(hidden[said], before[said]), batch.remarks[said, k])
            losses.append((following * weight[said]).sum() / weight.sum())
    return torch.stack(losses).sum()


PARTICIPANT: Final = LearnedRole(
    files=FILES, examples=ParticipantExamples, loss=loss_of, follow=follow, practise=practise, branch=31
)
"""The learned participant."""


def train_participant(
    settings: RoundSettings, out: Path, *, workers: int, on_stage: OnStage, lessons: Path | None = None
) -> tuple[FinishedFit, ...]:
    """Trains a participant; a started training is resumed. See `train_in_rounds`."""
    return train_role(PARTICIPANT, settings, out, workers=workers, on_stage=on_stage, lessons=lessons)
