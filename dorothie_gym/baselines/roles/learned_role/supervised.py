"""Supervised learning of a network from examples."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, Protocol, Self, TypeVar

import torch
from torch import Tensor, nn
from torch.nn.functional import cross_entropy

from dorothie_gym.baselines.gradients import backpropagate
from dorothie_gym.baselines.roles.learned_role.examples import UNKNOWN

BATCH_SIZE: Final = 256
RATE, LAST_RATE = 1e-3, 5e-5
"""Learning rate at the start and at the end of a fit."""

DECAY: Final = 1e-4
"""Weight decay."""


CHANGED_WEIGHT: Final = 3.0
"""Weight of a value in decisions in which it changes, relative to other decisions."""


class Rows(Protocol):
    """Examples from which rows can be selected."""

    def __len__(self) -> int:
        """Returns the number of examples."""
        ...

    def rows(self, numbers: Tensor) -> Self:
        """Returns the examples with the given numbers (n,)."""
        ...


Examples = TypeVar("Examples", bound=Rows)
OnEpoch = Callable[[int, float], None]
"""Callback with the number of epochs done and the mean loss of the last one."""


def fit(
    network: nn.Module,
    examples: Examples,
    loss_of: Callable[[Examples], Tensor],
    *,
    epochs: int,
    seed: int,
    on_epoch: OnEpoch,
) -> float:
    """Fits a network to examples and returns the mean loss of the last epoch.

    Args:
        network: the network; it is changed.
        examples: examples.
        loss_of: loss of the network in the given examples.
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
            loss = loss_of(examples.rows(rows))
            backpropagate(loss)
            torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
            optimiser.step()
            schedule.step()
            total, count = total + float(loss.detach()), count + 1
        mean = total / max(count, 1)
        on_epoch(epoch + 1, mean)
    network.eval()
    return mean


def entropy(logits: Tensor, target: Tensor) -> Tensor:
    """Returns the cross-entropy of each example (b,); 0 where the target is unknown."""
    return cross_entropy(logits, target.long(), reduction="none", ignore_index=UNKNOWN)


def changed_weights(before: Tensor, after: Tensor) -> Tensor:
    """Returns the weights of the predictions of a value (b,): higher where it changes, which is rarely."""
    return 1.0 + (CHANGED_WEIGHT - 1.0) * (before != after)


def weighted_mean(losses: Tensor, weight: Tensor) -> Tensor:
    """Returns the mean of losses (b,) by the weights of the examples (b,)."""
    return (losses * weight).sum() / weight.sum()
