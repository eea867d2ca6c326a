"""Inputs, labels, outputs and predictions of models as tensors."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Final, Self, TypeAlias

import numpy as np
import torch
from torch import Tensor

from dorothie_gym.archive.visibility import Task
from dorothie_gym.evaluation.teacher_forced.features.batch import Batch, BatchSpec, gather
from dorothie_gym.ontology.actions import LANE_SWITCH_LEFT, LANE_SWITCH_RIGHT, NAVIGATION_ACTIONS, ArgumentKind

if TYPE_CHECKING:
    from dorothie_gym.evaluation.teacher_forced.features.columns import Columns
    from dorothie_gym.evaluation.teacher_forced.features.point_table import PointTable

Inputs: TypeAlias = Mapping[str, Tensor]
"""The fields of `Batch` by name, as tensors of B points; whole numbers as int64."""

TRAIN: Final = "train"
VALIDATION: Final = "val"
TEST: Final = "test"

TASKS: Final = (Task.UFN, Task.RFN, Task.NFD)
"""The tasks in the order of their numbers in `Labels.task`."""

UFN, RFN, NFD = range(len(TASKS))
"""Numbers of the tasks."""

_GATHERED: Final = 512
"""Number of points that are gathered at once."""


@dataclass(frozen=True, eq=False)
class Labels:
    """Labels at B points; fields that a point's task does not have are filled as in `PointTable`.

    Attributes:
        task: (B,) number of the task, int64.
        move: (B,) int64, -1 at NfD points.
        slots: (B, 69) float32, 0 or 1.
        action: (B,) int64, -1 at UfN and RfN points.
        angle: (B,) float32 [degrees], NaN where unknown.
        belief: (B, 5) float32, NaN where unknown.
    """

    task: Tensor
    move: Tensor
    slots: Tensor
    action: Tensor
    angle: Tensor
    belief: Tensor

    def __len__(self) -> int:
        return len(self.task)

    def take(self, rows: Tensor) -> Labels:
        """Returns the labels of the given points."""
        return Labels(*(getattr(self, field.name)[rows] for field in fields(self)))

    def to(self, device: torch.device) -> Labels:
        """Returns the labels on a device."""
        return Labels(*(getattr(self, field.name).to(device, non_blocking=True) for field in fields(self)))

    @classmethod
    def of(cls, table: PointTable) -> Labels:
        """Returns the labels of a task's points."""
        task = torch.full((len(table),), TASKS.index(table.task), dtype=torch.int64)
        return cls(
            task,
            tensor(table.label_move),
            tensor(table.label_slots).float(),
            tensor(table.label_action),
            tensor(table.label_angle),
            tensor(table.label_belief),
        )


@dataclass(frozen=True, eq=False)
class Examples:
    """Points of all three tasks as tensors, gathered once.

    Attributes:
        inputs: fields (N, ...).
        labels: labels of the N points.
    """

    inputs: Inputs
    labels: Labels

    def __len__(self) -> int:
        return len(self.labels)

    def take(self, rows: Tensor, device: torch.device | None = None) -> tuple[dict[str, Tensor], Labels]:
        """Returns inputs and labels of the given points."""
        inputs = {name: values[rows] for name, values in self.inputs.items()}
        labels = self.labels.take(rows)
        if device is None or device.type == "cpu":
            return inputs, labels
        return {name: values.to(device, non_blocking=True) for name, values in inputs.items()}, labels.to(device)

    @classmethod
    def gather(cls, columns: Columns, tables: Sequence[PointTable], spec: BatchSpec) -> Self:
        """Gathers all points of the given tables, in their order.

        Raises:
            ValueError: there is no point.
        """
        batches = [
            gather(columns, table, np.arange(start, min(start + _GATHERED, len(table))), spec)
            for table in tables
            for start in range(0, len(table), _GATHERED)
        ]
        if not batches:
            raise ValueError("there is no point to gather: the tables are empty")
        names = [field.name for field in fields(Batch)]
        inputs = {name: torch.cat([tensor(getattr(batch, name)) for batch in batches]) for name in names}
        return cls(inputs, join(Labels.of(table) for table in tables))


def join(parts: Iterable[Labels]) -> Labels:
    """Returns labels one after another."""
    every = tuple(parts)
    return Labels(*(torch.cat([getattr(part, field.name) for part in every]) for field in fields(Labels)))


def tensor(values: np.ndarray) -> Tensor:
    """Returns an array as a tensor of its own; whole numbers as int64, which look-ups take."""
    array = np.ascontiguousarray(values)
    if array.dtype.kind in "iu" and array.dtype != np.int64:
        array = array.astype(np.int64)
    return torch.from_numpy(array.copy() if array is values or not array.flags.writeable else array)


# --- Outputs of a model, and their decoding into predictions ---------------------------------------------------------


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
    """Returns the most likely values that the ontology allows (see `allowed_angle`).

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
        outputs.move[points, role].argmax(-1),
        outputs.slot_values[points, role] > 0,
        action,
        allowed_angle(action, angle),
    )


def likeliest(scores: Tensor, allowed: Tensor | None) -> Tensor:
    """Returns the class (B,) with the highest score (B, n) among the allowed ones (B, n), or among all if None."""
    return (scores if allowed is None else scores.masked_fill(~allowed, -torch.inf)).argmax(-1)


def allowed_angle(action: Tensor, angle: Tensor) -> Tensor:
    """Returns angles (B,) valid for the actions (B,): 0 for actions without an angle, 90 or -90 for a lane switch."""
    any_angle = torch.tensor(TAKES_ANGLE, device=action.device)[action]
    side = torch.tensor(TAKES_SIDE, device=action.device)[action]
    wrapped = (angle + 180.0) % 360.0 - 180.0
    left_or_right = torch.where(wrapped >= 0, LANE_SWITCH_LEFT, LANE_SWITCH_RIGHT).to(wrapped.dtype)
    return torch.where(any_angle, wrapped, torch.where(side, left_or_right, torch.zeros_like(wrapped)))
