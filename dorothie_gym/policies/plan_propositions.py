"""Content of the steps of a driving plan as propositions."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dorothie_gym.dialogue.plan_fields import ACTION_VALUES
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.dialogue.routes import StepAction
from dorothie_gym.policies import act_builders

if TYPE_CHECKING:
    from dorothie_gym.dialogue.routes import PlanStep


def content_of(step: PlanStep) -> Proposition:
    """Returns what the car is going to do by a step."""
    place = next(iter(step.places), None)
    landmark, street, kind = (None, None, None) if place is None else (place.landmark, place.street, place.object)
    if step.action is StepAction.VISIT:
        return act_builders.destination(landmark, street)
    if step.action is StepAction.AVOID:
        return Proposition.of(Predicate.WILL, street=street, place=landmark, negated=True)
    return Proposition.of(
        Predicate.WILL,
        action=ACTION_VALUES.get(step.action),
        direction=step.direction,
        street=street,
        place=landmark,
        object=kind,
        speed=step.speed,
    )
