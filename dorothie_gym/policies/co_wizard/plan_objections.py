"""Reasons why a step of a plan cannot be carried out, with an offer or a question."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.intentions import CommunicativeFunction as Function
from dorothie_gym.dialogue.propositions import Predicate
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.dialogue.routes import PlanStep
from dorothie_gym.ontology.slots import ActionValue, GoalStatus, LandmarkName
from dorothie_gym.policies import act_builders
from dorothie_gym.policies.speech import intend

if TYPE_CHECKING:
    from dorothie_gym.dialogue.routes import PlanStep
    from dorothie_gym.policies.co_wizard.plan_points import Objection
    from dorothie_gym.policies.co_wizard.state import CoWizardState
    from dorothie_gym.policies.co_wizard.view import CoWizardView

_TOPICS = {
    Predicate.KNOWS: "no_map",
    Predicate.BEHIND: "is_behind",
    Predicate.LOCATED: "is_elsewhere",
    Predicate.SEES: "not_ahead",
    Predicate.ON_STREET: "not_crossing",
    Predicate.POSSIBLE: "no_way",
}


def object_to(
    state: CoWizardState, view: CoWizardView, objection: Objection, step: PlanStep, *, joined: bool = False
) -> None:
    """States why a step cannot be carried out, and offers something else or asks.

    Args:
        state: working copy of the state.
        view: observation.
        objection: what the map holds against the step.
        step: the step.
        joined: whether the remark continues the one before.
    """
    reason = objection.reason
    straight = reason.get("action") is ActionValue.LANE_FOLLOW
    unknown = reason.predicate is Predicate.ON_STREET and objection.street is None
    topic = "no_street" if unknown else _TOPICS[reason.predicate]
    wording = Wording(topic=topic, direction=Direction.STRAIGHT if straight else step.direction)
    place = reason.get("place") if reason.predicate is Predicate.KNOWS else None
    also = (act_builders.errand(place, GoalStatus.UNKNOWN),) if isinstance(place, LandmarkName) else ()
    state.say(intend(Function.INFORM, reason, *also, wording=wording, joined=joined))
    state.dialogue = state.dialogue.after_refusal().after_asking(view.time)
    if objection.landmark is not None:
        state.dialogue = state.dialogue.with_offer(objection.landmark)
        there = act_builders.destination(objection.landmark)
        state.say(intend(Function.OFFER, there, wording=Wording(topic="drive_there"), joined=True))
    elif objection.street is not None:
        state.dialogue = state.dialogue.with_offered_street(objection.street)
        over = act_builders.action(None, street=objection.street)
        state.say(intend(Function.OFFER, over, wording=Wording(topic="drive_to_street"), joined=True))
    elif reason.predicate is Predicate.KNOWS:
        state.say(intend(Function.REQUEST, wording=Wording(topic="tell_when"), joined=True))
    else:
        way = act_builders.action(ActionValue.QUERIED)
        state.say(intend(Function.SET_QUESTION, way, wording=Wording(topic="instead"), joined=True))
