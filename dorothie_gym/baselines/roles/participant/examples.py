"""Training examples: inputs of decisions, and the teacher's decisions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Final, Self

import numpy as np
import torch

from dorothie_gym.baselines.roles.learned_role.decision import Inputs
from dorothie_gym.baselines.roles.learned_role.examples import (
    IDLE_SHARE,
    UNKNOWN,
    ExampleBatch,
    form_numbers,
    reals,
    weights_of,
    whole,
    word_tensor,
)
from dorothie_gym.baselines.roles.participant.memory import KEEP_TARGET, SessionMemory, TargetChoice
from dorothie_gym.baselines.roles.participant.remarks import STOP_FORM, form_of, is_stop

if TYPE_CHECKING:
    from dorothie_gym.baselines.roles.participant.decision import ParticipantPercept
    from dorothie_gym.policies.speech import Remark

MOST_REMARKS: Final = 4
"""Maximum number of remarks of one decision."""


@dataclass(frozen=True, kw_only=True)
class Example:
    """A decision with its targets.

    Attributes:
        choosing: inputs of the first step.
        speaking: inputs of the second step.
        guides: whether the car was guided before.
        target: 0 for no change, or 1 + position of the errand; `UNKNOWN` if it is missing.
        guiding: whether the car is guided after.
        remarks: forms of the remarks, then ""; None if it is not trained.
        weight: number of decisions that it represents.
    """

    choosing: Inputs
    speaking: Inputs
    guides: bool
    target: int
    guiding: bool
    remarks: tuple[str | None, ...]
    weight: float


def make_example(
    percept: ParticipantPercept,
    choosing: Inputs,
    speaking: Inputs,
    choice: TargetChoice,
    remarks: Sequence[str | None],
    rng: np.random.Generator,
) -> Example | None:
    """Returns the example of a decision; None if it is one of those left out because nothing happens.

    Args:
        percept: perception.
        choosing: inputs of the first step.
        speaking: inputs of the second step.
        choice: the teacher's choice.
        remarks: forms of its remarks.
        rng: draws which idle decisions are kept.
    """
    guides = percept.memory.records.guidance.guiding
    idle = not (percept.heard or remarks or choice.target != KEEP_TARGET or choice.guiding is not guides)
    if idle and rng.random() >= IDLE_SHARE:
        return None
    target = 0
    if choice.target != KEEP_TARGET:
        target = 1 + choosing.rows.index(choice.target) if choice.target in choosing.rows else UNKNOWN
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
    remarks: Sequence[Remark], memory: SessionMemory, percept: ParticipantPercept, available: Mapping[str, object]
) -> list[str | None]:
    """Returns the forms of remarks; None for remarks that are not trained, and for all that follow them."""
    found: list[str | None] = []
    for one in remarks[:MOST_REMARKS]:
        form = STOP_FORM if is_stop(one, memory, percept.view) else form_of(one, available)
        found.append(form)
        if form is None:
            return [*found, *[None] * MOST_REMARKS]
    return found


@dataclass(frozen=True, eq=False)
class ParticipantExamples(ExampleBatch[Example]):
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

    @classmethod
    def of(cls, found: Sequence[Example], forms: Sequence[str]) -> Self:
        """Returns examples as tensors, see `ExampleBatch`."""
        return cls(
            choosing=reals([one.choosing.state for one in found]),
            words=word_tensor([one.choosing.words for one in found]),
            errands=reals([one.choosing.options for one in found]),
            errand_count=whole([len(one.choosing.rows) for one in found]),
            guides=whole([int(one.guides) for one in found]),
            target=whole([one.target for one in found]),
            guiding=whole([int(one.guiding) for one in found]),
            speaking=reals([one.speaking.state for one in found]),
            remarks=form_numbers([one.remarks for one in found], forms),
            weight=weights_of([one.weight for one in found]),
        )
