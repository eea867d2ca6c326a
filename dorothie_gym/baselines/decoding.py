"""Outputs of a model, and their decoding into predictions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import torch
from torch import Tensor

from dorothie_gym.baselines.inputs import RFN
from dorothie_gym.ontology import LANE_SWITCH_LEFT, LANE_SWITCH_RIGHT, NAVIGATION_ACTIONS
from dorothie_gym.ontology.actions import ArgumentKind


@dataclass(frozen=True, eq=False)
class Outputs:
    """Outputs of a model at B points.

    Attributes:
        move: (B, 2, 15) scores of the moves, for the participant (UfN) and for the Co-Wizard (RfN).
        slot_types: (B, 2, 5) of the slots.
        slot_values: (B, 2, 69) of the slot values.
        action: (B, 6) of the navigation actions.
        angle: (B, 2) cosine and sine of the angle, of any length.
        belief: (B, 5) in the units of `PointTable.label_belief`.
    """

    move: Tensor
    slot_types: Tensor
    slot_values: Tensor
    action: Tensor
    angle: Tensor
    belief: Tensor


@dataclass(frozen=True, eq=False)
class Predicted:
    """Predictions of a model at B points; fields that a point's task does not have are arbitrary.

    Attributes:
        move: (B,) int64.
        slots: (B, 69) bool.
        action: (B,) int64 class of NfD.
        angle: (B,) float32 [degrees, positive left, in [-180, 180)].
    """

    move: Tensor
    slots: Tensor
    action: Tensor
    angle: Tensor


TAKES_ANGLE: Final = tuple(action.argument is ArgumentKind.ANGLE for action in NAVIGATION_ACTIONS)
"""Flags of the NfD classes that take any angle."""

TAKES_SIDE: Final = tuple(action.argument is ArgumentKind.SIDE for action in NAVIGATION_ACTIONS)
"""Flags of the NfD classes that take a side, left or right."""


def decode(outputs: Outputs, task: Tensor, allowed: Tensor | None = None) -> Predicted:
    """Returns the likeliest values that the ontology allows (see `allowed_angle`).

    Args:
        outputs: outputs of a model.
        task: (B,) number of each point's task.
        allowed: (B, 6) actions that may be predicted; all if None.
    """
    role = (task == RFN).long()  # (B,)
    points = torch.arange(len(task), device=task.device)
    action = likeliest(outputs.action, allowed)
    angle = torch.rad2deg(torch.atan2(outputs.angle[:, 1], outputs.angle[:, 0]))
    return Predicted(
        outputs.move[points, role].argmax(-1), outputs.slot_values[points, role] > 0, action,
        allowed_angle(action, angle),
    )  # fmt: skip


def likeliest(scores: Tensor, allowed: Tensor | None) -> Tensor:
    """Returns the class (B,) with the highest score (B, n) among those allowed (B, n); among all where None."""
    return (scores if allowed is None else scores.masked_fill(~allowed, -torch.inf)).argmax(-1)


def allowed_angle(action: Tensor, angle: Tensor) -> Tensor:
    """Returns angles (B,) as the actions (B,) take them: 0 for one that takes none, a lane switch's 90 or -90."""
    any_angle = torch.tensor(TAKES_ANGLE, device=action.device)[action]
    side = torch.tensor(TAKES_SIDE, device=action.device)[action]
    wrapped = (angle + 180.0) % 360.0 - 180.0
    left_or_right = torch.where(wrapped >= 0, LANE_SWITCH_LEFT, LANE_SWITCH_RIGHT).to(wrapped.dtype)
    return torch.where(any_angle, wrapped, torch.where(side, left_or_right, torch.zeros_like(wrapped)))
