"""Examples to learn from: the inputs of decisions, and what the teacher did."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, Final

import numpy as np
import torch

from dorothie_gym.baselines.roles.learned_role.batches import IDLE_SHARE, UNKNOWN, TensorBatch, reals, whole
from dorothie_gym.baselines.roles.participant.decision import Inputs, Scene
from dorothie_gym.baselines.roles.participant.memory import KEEP_TARGET, Choice, Memory
from dorothie_gym.baselines.roles.participant.remarks import STOP_FORM, form_of, is_stop
from dorothie_gym.policies.speech import Remark

MOST_REMARKS: Final = 4
"""Largest number of remarks of one decision."""


@dataclass(frozen=True, kw_only=True)
class Example:
    """A decision with its targets.

    Attributes:
        choosing: inputs of the first step.
        speaking: inputs of the second step.
        guides: whether the car was guided before.
        target: 0 for no change, or 1 + position of the errand; `UNKNOWN` if it is missing.
        guiding: whether the car is guided after.
        remarks: forms of the remarks, then ""; None if it is not learnt from.
        weight: number of decisions that it stands for.
    """

    choosing: Inputs
    speaking: Inputs
    guides: bool
    target: int
    guiding: bool
    remarks: tuple[str | None, ...]
    weight: float


def make_example(
    scene: Scene,
    choosing: Inputs,
    speaking: Inputs,
    choice: Choice,
    remarks: Sequence[str | None],
    rng: np.random.Generator,
) -> Example | None:
    """Returns the example of a decision; None if it is one of those left out because nothing happens.

    Args:
        scene: what was perceived.
        choosing: inputs of the first step.
        speaking: inputs of the second step.
        choice: the teacher's choice.
        remarks: forms of its remarks.
        rng: draws which idle decisions are kept.
    """
    guides = scene.memory.records.guidance.guiding
    idle = not (scene.heard or remarks or choice.target != KEEP_TARGET or choice.guiding is not guides)
    if idle and rng.random() >= IDLE_SHARE:
        return None
    target = 0
    if choice.target != KEEP_TARGET:
        target = 1 + choosing.numbers.index(choice.target) if choice.target in choosing.numbers else UNKNOWN
    padded = (*remarks, *[""] * MOST_REMARKS)[:MOST_REMARKS]
    return Example(
        choosing=choosing,
        speaking=speaking,
        guides=guides,
        target=target,
        guiding=choice.guiding,
        remarks=padded,
        weight=1.0 / IDLE_SHARE if idle else 1.0,
    )


def forms_of_remarks(
    remarks: Sequence[Remark], memory: Memory, scene: Scene, available: Mapping[str, object]
) -> list[str | None]:
    """Returns the forms of remarks; None for those that are not learnt, and for all behind them."""
    found: list[str | None] = []
    for one in remarks[:MOST_REMARKS]:
        form = STOP_FORM if is_stop(one, memory, scene.view) else form_of(one, available)
        found.append(form)
        if form is None:
            return [*found, *[None] * MOST_REMARKS]
    return found


@dataclass(frozen=True, eq=False)
class Batch(TensorBatch):
    """Examples as tensors; the first axis of each is that of the examples."""

    REMARKS: ClassVar[tuple[str, ...]] = ("remarks",)

    choosing: torch.Tensor
    words: torch.Tensor
    errands: torch.Tensor
    errand_count: torch.Tensor
    guides: torch.Tensor
    target: torch.Tensor
    guiding: torch.Tensor
    speaking: torch.Tensor
    remarks: torch.Tensor
    weight: torch.Tensor


def batch_of(found: Sequence[Example], forms: Sequence[str]) -> Batch:
    """Returns examples as tensors.

    Args:
        found: the examples, at least one.
        forms: forms of remarks that are numbered; others are not learnt. The first one, "", stands for silence.
    """
    numbers = {form: k for k, form in enumerate(forms)}
    remarks = [[UNKNOWN if form is None else numbers.get(form, UNKNOWN) for form in one.remarks] for one in found]
    return Batch(
        choosing=reals([one.choosing.state for one in found]),
        words=torch.from_numpy(np.stack([one.choosing.words for one in found]).astype(np.int16)),
        errands=reals([one.choosing.errands for one in found]),
        errand_count=whole([len(one.choosing.numbers) for one in found]),
        guides=whole([int(one.guides) for one in found]),
        target=whole([one.target for one in found]),
        guiding=whole([int(one.guiding) for one in found]),
        speaking=reals([one.speaking.state for one in found]),
        remarks=whole(remarks),
        weight=torch.tensor([one.weight for one in found], dtype=torch.float32),
    )
