"""Training of the learned Co-Wizard: imitation of a corpus, then rounds of practice beside the teacher (DAgger)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

import torch
from torch import Tensor
from torch.nn.functional import binary_cross_entropy_with_logits, cross_entropy

from dorothie_gym.baselines.roles.co_wizard.demonstrations import CoWizardTraining, follow, practise
from dorothie_gym.baselines.roles.co_wizard.examples import CoWizardExamples
from dorothie_gym.baselines.roles.co_wizard.files import FILES
from dorothie_gym.baselines.roles.learned_role.supervised import changed_weights, entropy, weighted_mean
from dorothie_gym.baselines.roles.learned_role.training import LearnedRole, train_role

if TYPE_CHECKING:
    from dorothie_gym.baselines.roles.co_wizard.network import CoWizardNetwork
    from dorothie_gym.baselines.roles.learned_role.dagger import FinishedFit, OnStage


def loss_of(network: CoWizardNetwork, batch: CoWizardExamples) -> Tensor:
    """Returns the sum of the mean losses of all outputs [nats]."""
    weight, words = batch.weight, batch.words.long()
    before, values = batch.before.long(), batch.values.long()
    heard = network.listen(batch.listening.float(), words, batch.places.float(), batch.place_count.long(), before)
    goal_changed = changed_weights(torch.zeros_like(batch.goal), batch.goal)
    losses = [
        weighted_mean(entropy(heard.goal, batch.goal), weight * goal_changed),
        weighted_mean(entropy(heard.status, batch.status), weight),
    ]
    for k, logits in enumerate(heard.values):
        changed = changed_weights(before[:, k], values[:, k])
        losses.append(weighted_mean(cross_entropy(logits, values[:, k], reduction="none"), weight * changed))
    fresh = binary_cross_entropy_with_logits(heard.fresh, batch.fresh.float(), reduction="none")
    losses.append(weighted_mean(fresh.sum(dim=1), weight))
    acting = network.act(batch.acting.float(), words, batch.commands.float(), batch.command_count.long())
    commands, first, hidden = acting
    losses.append(weighted_mean(entropy(commands, batch.command), weight))
    losses.append(weighted_mean(entropy(first, batch.first), weight))
    second = entropy(network.then(hidden, batch.first.long().clamp(min=0)), batch.second)
    losses.append(weighted_mean(torch.where(batch.first > 0, second, torch.zeros_like(second)), weight))
    return torch.stack(losses).sum()


CO_WIZARD: Final = LearnedRole(
    files=FILES, examples=CoWizardExamples, loss=loss_of, follow=follow, practise=practise, branch=29, at_once=16
)
"""The learned Co-Wizard."""


def train_co_wizard(
    settings: CoWizardTraining, out: Path, *, workers: int, on_stage: OnStage, lessons: Path | None = None
) -> tuple[FinishedFit, ...]:
    """Trains a Co-Wizard; a started training is resumed. See `train_in_rounds`."""
    return train_role(CO_WIZARD, settings, out, workers=workers, on_stage=on_stage, lessons=lessons)
