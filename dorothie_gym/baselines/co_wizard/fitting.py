"""Supervised learning of the network from examples."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import torch
from torch import Tensor
from torch.nn.functional import binary_cross_entropy_with_logits, cross_entropy

from dorothie_gym.baselines.co_wizard.examples import UNKNOWN, Batch
from dorothie_gym.baselines.co_wizard.network import CoWizardNetwork

BATCH_SIZE: Final = 256
RATE, LAST_RATE = 1e-3, 5e-5
"""Learning rate at the beginning and at the end of a fit."""

DECAY: Final = 1e-4
"""Weight decay."""

CHANGED_WEIGHT: Final = 3.0
"""Weight of a memory variable in the decisions in which it changes, relative to the others."""

OnEpoch = Callable[[int, float], None]
"""Callback with the number of epochs done and the mean loss of the last one."""


def fit(network: CoWizardNetwork, examples: Batch, *, epochs: int, seed: int, on_epoch: OnEpoch) -> float:
    """Fits a network to examples and returns the mean loss of the last epoch.

    Args:
        network: the network; it is changed.
        examples: examples.
        epochs: number of passes.
        seed: seed of their order.
        on_epoch: called after each epoch.
    """
    generator = torch.Generator().manual_seed(seed)
    optimiser = torch.optim.AdamW(network.parameters(), lr=RATE, weight_decay=DECAY)
    steps = epochs * -(-len(examples) // BATCH_SIZE)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, steps, LAST_RATE)
    network.train()
    mean = 0.0
    for epoch in range(epochs):
        total, count = 0.0, 0
        for rows in torch.split(torch.randperm(len(examples), generator=generator), BATCH_SIZE):
            optimiser.zero_grad()
            loss = loss_of(network, examples.rows(rows))
            loss.backward()  # type: ignore[no-untyped-call]  # torch does not annotate it
            torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
            optimiser.step()
            schedule.step()
            total, count = total + float(loss.detach()), count + 1
        mean = total / max(count, 1)
        on_epoch(epoch + 1, mean)
    network.eval()
    return mean


def loss_of(network: CoWizardNetwork, batch: Batch) -> Tensor:
    """Returns the sum of the mean losses of all outputs [nats]."""
    weight, words = batch.weight, batch.words.long()
    before, values = batch.before.long(), batch.values.long()
    heard = network.listen(batch.listening.float(), words, batch.places.float(), batch.place_count.long(), before)
    losses = [_mean(_entropy(heard.goal, batch.goal), weight), _mean(_entropy(heard.status, batch.status), weight)]
    for k, logits in enumerate(heard.values):
        changed = 1.0 + (CHANGED_WEIGHT - 1.0) * (before[:, k] != values[:, k])
        losses.append(_mean(cross_entropy(logits, values[:, k], reduction="none"), weight * changed))
    fresh = binary_cross_entropy_with_logits(heard.fresh, batch.fresh.float(), reduction="none")
    losses.append(_mean(fresh.sum(dim=1), weight))
    acting = network.act(batch.acting.float(), words, batch.commands.float(), batch.command_count.long())
    commands, first, hidden = acting
    losses.append(_mean(_entropy(commands, batch.command), weight))
    losses.append(_mean(_entropy(first, batch.first), weight))
    second = _entropy(network.then(hidden, batch.first.long().clamp(min=0)), batch.second)
    losses.append(_mean(torch.where(batch.first > 0, second, torch.zeros_like(second)), weight))
    return torch.stack(losses).sum()


def _entropy(logits: Tensor, target: Tensor) -> Tensor:
    """Returns the cross-entropy of each example (b,); 0 where the target is unknown."""
    return cross_entropy(logits, target.long(), reduction="none", ignore_index=UNKNOWN)


def _mean(losses: Tensor, weight: Tensor) -> Tensor:
    return (losses * weight).sum() / weight.sum()
