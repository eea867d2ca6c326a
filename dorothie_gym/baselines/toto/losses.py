"""Loss of TOTO (paper, appendix C) for batches of points of different tasks."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import torch
from torch import Tensor
from torch.nn import functional as F

from dorothie_gym.baselines.point_tensors import NFD, RFN, Labels, Outputs
from dorothie_gym.ontology.dialogue_acts import SLOT_SPANS, VECTOR_SLOTS

if TYPE_CHECKING:
    from dorothie_gym.baselines.toto.config import LossWeights, TOTOConfig

_ROOT_OFFSET: Final = 1e-6
"""Summand under a root, so that its slope stays finite at 0."""


def point_losses(outputs: Outputs, labels: Labels, config: TOTOConfig) -> Tensor:
    """Returns the published loss of each point (B,).

    The error of the angle is the chord between directions, in degrees: small errors count as published, and 179 is
    next to -179.

    Args:
        outputs: outputs of the model at B points.
        labels: the labels.
        config: weights of the parts, and whether the belief counts.
    """
    weights = config.loss
    decides = labels.task == NFD
    loss = torch.where(decides, _decision(outputs, labels, weights), _act(outputs, labels, weights))
    if config.belief:
        loss = loss + weights.belief * _belief(outputs, labels)
    return loss


def _act(outputs: Outputs, labels: Labels, weights: LossWeights) -> Tensor:
    """Returns the loss of UfN and RfN: the move, the slots, their values."""
    role = (labels.task == RFN).long()
    points = torch.arange(len(role), device=role.device)
    move = F.cross_entropy(outputs.move[points, role], labels.move.clamp(min=0), reduction="none")
    types = F.binary_cross_entropy_with_logits(
        outputs.slot_types[points, role], slot_types(labels.slots), reduction="none"
    )
    values = F.binary_cross_entropy_with_logits(outputs.slot_values[points, role], labels.slots, reduction="none")
    return weights.move * move + weights.slot_types * types.mean(-1) + weights.slot_values * values.mean(-1)


def _decision(outputs: Outputs, labels: Labels, weights: LossWeights) -> Tensor:
    """Returns the loss of NfD: the action and its angle."""
    action = F.cross_entropy(outputs.action, labels.action.clamp(min=0), reduction="none")
    return weights.action * action + weights.angle * angle_error(outputs.angle, labels.angle)


def angle_error(direction: Tensor, degrees: Tensor) -> Tensor:
    """Returns the error of directions (B, 2) from angles (B,) [degrees]; 0 where the angle is unknown."""
    known = ~degrees.isnan()
    radians = torch.deg2rad(torch.where(known, degrees, 0.0))
    target = torch.stack((radians.cos(), radians.sin()), dim=-1)
    chord = ((direction - target).square().sum(-1) + _ROOT_OFFSET).sqrt()
    return torch.where(known, chord, 0.0) * (180.0 / math.pi)


def _belief(outputs: Outputs, labels: Labels) -> Tensor:
    """Returns the error of the known parts of the belief (B,), on the circle for the angle."""
    known = ~labels.belief.isnan()
    error = outputs.belief - torch.where(known, labels.belief, outputs.belief.detach())
    turned = (error[:, 2] + 180.0) % 360.0 - 180.0
    error = torch.stack((error[:, 0], error[:, 1], turned, error[:, 3], error[:, 4]), dim=-1)
    count = known.sum(-1)
    mean = (error.square() * known).sum(-1) / count.clamp(min=1)
    return torch.where(count > 0, (mean + _ROOT_OFFSET).sqrt(), 0.0)


def slot_types(slots: Tensor) -> Tensor:
    """Returns which slots are filled (..., 5) by the slot values (..., 69), as 0 and 1."""
    return torch.stack([slots[..., SLOT_SPANS[slot]].amax(-1) for slot in VECTOR_SLOTS], dim=-1)
