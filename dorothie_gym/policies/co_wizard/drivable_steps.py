"""Steps of a plan as the car drives them: junctions count once, streets are ways, and the way back starts behind."""

from __future__ import annotations

from typing import Final

from dorothie_gym.dialogue.routes import Anaphor, ConditionRelation, PlaceReference, PlanStep, StepAction
from dorothie_gym.policies.policy import replace

STOP_APART: Final = frozenset({ConditionRelation.AFTER, ConditionRelation.PAST, ConditionRelation.BEFORE})
"""Relations to a landmark of a stop that is no visit of it."""


def counted_together(steps: tuple[PlanStep, ...]) -> tuple[PlanStep, ...]:
    """Returns the steps without a stretch that the number of the next turn counts again: "over two, third right"."""
    kept: list[PlanStep] = []
    steps = tuple(map(_way_along, steps))
    for step, following in zip(steps, (*steps, None)[1:], strict=True):
        turns = following is not None and following.action is StepAction.TURN and following.condition is None
        crossed = None if step.action is not StepAction.STRAIGHT else _crossed(step)
        if not (turns and crossed is not None and following is not None and following.ordinal == crossed + 1):
            kept.append(step)
    return tuple(kept)


def turned_back(steps: tuple[PlanStep, ...]) -> tuple[PlanStep, ...]:
    """Returns the steps with a turn in place of "the way we came", which adds nothing to a destination."""
    visits = any(step.action is StepAction.VISIT for step in steps)
    back = PlanStep(action=StepAction.U_TURN)
    return tuple(back if _is_way_back(step) else step for step in steps if not (visits and _is_way_back(step)))


def _is_way_back(step: PlanStep) -> bool:
    place = step.place
    return step.action is StepAction.FOLLOW and place is not None and place.reference is Anaphor.WAY_WE_CAME


def _way_along(step: PlanStep) -> PlanStep:
    """Returns a step along a street in place of a visit to one, and on to a place where the car is to wait for it."""
    place, until = step.place, step.condition
    if step.action is StepAction.WAIT and until is not None and until.relation is ConditionRelation.UNTIL:
        return replace(step, action=StepAction.STRAIGHT)
    if step.action is not StepAction.VISIT or place is None or place.street is None or place.landmark is not None:
        return step
    return PlanStep(action=StepAction.FOLLOW, place=PlaceReference(street=place.street))


def _crossed(step: PlanStep) -> int | None:
    """Returns the number of junctions that a stretch straight on crosses; None where it ends at something else."""
    if step.condition is None:
        return step.ordinal
    return step.condition.place.ordinal if step.condition.relation in STOP_APART and counts_junctions(step) else None


def counts_junctions(step: PlanStep) -> bool:
    """Returns whether the condition of a step is a numbered junction that nothing else tells."""
    place = None if step.condition is None else step.condition.place
    if place is None or place.ordinal is None:
        return False
    return place.landmark is None and place.street is None and place.object is None
