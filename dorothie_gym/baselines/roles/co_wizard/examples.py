"""Training examples: inputs of decisions, and the teacher's decisions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, NamedTuple, Self

import numpy as np
import torch

from dorothie_gym.baselines.roles.co_wizard.memory import GoalEvent, WorkingMemory
from dorothie_gym.baselines.roles.co_wizard.remarks import form_of
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
from dorothie_gym.baselines.roles.learned_role.remark_forms import Sources
from dorothie_gym.session.spaces.actions import Physical

if TYPE_CHECKING:
    from dorothie_gym.baselines.roles.co_wizard.decision import CoWizardPercept
    from dorothie_gym.baselines.roles.co_wizard.teacher import Lesson


@dataclass(frozen=True, kw_only=True)
class Example:
    """A decision with its targets.

    Attributes:
        listening: inputs of the first step.
        acting: inputs of the second step.
        before: values of the memory before (v,).
        values: values of the memory after (v,).
        fresh: which variables are set again.
        goal: `GoalEvent`, or their number + position of the place among `listening.rows`; `UNKNOWN` if it is missing.
        status: status given to an errand.
        command: index of the command; `UNKNOWN` if it could not be commanded.
        remarks: forms of the first two remarks; "" for no remark, None if it is not trained.
        weight: number of decisions that it represents.
    """

    listening: Inputs
    acting: Inputs
    before: tuple[int, ...]
    values: tuple[int, ...]
    fresh: tuple[bool, ...]
    goal: int
    status: int
    command: int
    remarks: tuple[str | None, str | None]
    weight: float


class LessonInputs(NamedTuple):
    """Inputs of both steps, possible commands, and names and numbers that could be said."""

    listening: Inputs
    acting: Inputs
    commands: Sequence[Physical | None]
    available: Sources


def make_example(
    percept: CoWizardPercept,
    inputs: Callable[[], LessonInputs],
    lesson: Lesson,
    rng: np.random.Generator,
    *,
    talks: bool = True,
) -> Example | None:
    """Returns the example of a decision; None if it is one of those left out because nothing happens.

    Args:
        percept: perception.
        inputs: returns the inputs, which are computed for those examples only that are kept.
        lesson: decision of the teacher.
        rng: draws which idle decisions are kept.
        talks: whether the remarks, or silence, are learnt.
    """
    update = lesson.update
    before = percept.memory.values
    idle = not (
        percept.heard
        or lesson.physical
        or lesson.remarks
        or update.goal
        or update.status
        or any(update.fresh)
        or update.values != before
    )
    if idle and rng.random() >= IDLE_SHARE:
        return None
    listening, acting, commands, available = inputs()
    goal = update.goal
    if goal >= len(GoalEvent):
        row = goal - len(GoalEvent)
        goal = len(GoalEvent) + listening.rows.index(row) if row in listening.rows else UNKNOWN
    command = commands.index(lesson.physical) if lesson.physical in commands else UNKNOWN
    forms = [form_of(remark, available) for remark in lesson.remarks[:2]] if talks else [None, None]
    first, second = (*forms, "", "")[:2]
    return Example(
        listening=listening, acting=acting, before=before, values=update.values, fresh=update.fresh, goal=goal,
        status=update.status, command=command if lesson.ready else UNKNOWN, remarks=(first, second),
        weight=1.0 / IDLE_SHARE if idle else 1.0,
    )  # fmt: skip


def correcting_example(
    percept: CoWizardPercept, listening: Inputs, acting: Inputs, led: WorkingMemory, lesson: Lesson
) -> Example | None:
    """Returns an example of how a memory that differs from the teacher's returns to it; None if it does not differ.

    Where the own goal is another place than the teacher's, and the utterance does not say which, the player has to
    doubt it (a place of the same name) or to give it up: it cannot know the right one, but it no longer plans a route
    against its directions.

    Args:
        percept: the player's perception, with its own memory.
        listening: inputs of the first step.
        acting: inputs of the second step, for which there is no target.
        led: memory that the teacher has led to.
        lesson: decision of the teacher.
    """
    own, update = percept.memory, lesson.update
    same_goal = own.goal is led.goal and own.goal_mark == led.goal_mark
    if own.values == update.values and same_goal and not update.goal:
        return None
    latest = percept.latest
    goal = UNKNOWN
    if same_goal:
        goal = int(GoalEvent.KEEP)
    elif led.goal is None:
        goal = int(GoalEvent.CLEAR)
    elif own.goal_mark >= 0 and (latest is None or led.goal not in latest.places):
        goal = int(GoalEvent.DOUBT if own.goal is led.goal else GoalEvent.CLEAR)
    elif led.goal_mark in listening.rows:
        goal = len(GoalEvent) + listening.rows.index(led.goal_mark)
    elif led.goal_mark < 0 and latest is not None and led.goal in latest.places[:2]:
        goal = GoalEvent.OFF_MAP_FIRST + latest.places.index(led.goal)
    return Example(
        listening=listening, acting=acting, before=own.values, values=update.values, fresh=update.fresh, goal=goal,
        status=update.status, command=UNKNOWN, remarks=(None, None), weight=1.0,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class CoWizardExamples(ExampleBatch[Example]):
    """Examples as tensors; the first axis of each is that of the examples."""

    REMARKS: ClassVar[tuple[str, ...]] = ("first", "second")

    listening: torch.Tensor
    words: torch.Tensor
    places: torch.Tensor
    place_count: torch.Tensor
    before: torch.Tensor
    values: torch.Tensor
    fresh: torch.Tensor
    goal: torch.Tensor
    status: torch.Tensor
    acting: torch.Tensor
    commands: torch.Tensor
    command_count: torch.Tensor
    command: torch.Tensor
    first: torch.Tensor
    second: torch.Tensor
    weight: torch.Tensor

    @classmethod
    def of(cls, found: Sequence[Example], forms: Sequence[str]) -> Self:
        """Returns examples as tensors, see `ExampleBatch`."""
        remarks = form_numbers([one.remarks for one in found], forms)
        return cls(
            listening=reals([one.listening.state for one in found]),
            words=word_tensor([one.listening.words for one in found]),
            places=reals([one.listening.options for one in found]),
            place_count=whole([len(one.listening.rows) for one in found]),
            before=whole([one.before for one in found]),
            values=whole([one.values for one in found]),
            fresh=reals([np.asarray(one.fresh, dtype=np.float32) for one in found]),
            goal=whole([one.goal for one in found]),
            status=whole([one.status for one in found]),
            acting=reals([one.acting.state for one in found]),
            commands=reals([one.acting.options for one in found]),
            command_count=whole([len(one.acting.rows) for one in found]),
            command=whole([one.command for one in found]),
            first=remarks[:, 0],
            second=remarks[:, 1],
            weight=weights_of([one.weight for one in found]),
        )
