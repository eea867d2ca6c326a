"""Why the car of the learned Co-Wizard stands or turns round, from its own observation and memory."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dorothie_gym.dialogue.intentions import CommunicativeFunction
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.ontology.slots import ActionValue, LandmarkName, ObjectClass
from dorothie_gym.policies.co_wizard.answers import RECENT_STOP, explanation
from dorothie_gym.policies.co_wizard.proposition_truth import DETOUR_TIME, OBEYED_WITHIN, is_red_ahead
from dorothie_gym.policies.co_wizard.state import TOLD_TO_STOP
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.speech import Remark, intend
from dorothie_gym.sim.state.codes import Motion

if TYPE_CHECKING:
    from dorothie_gym.baselines.roles.co_wizard.memory import Memory


def reason_to_stand(memory: Memory, view: CoWizardView) -> Proposition | None:
    """Returns why the car stands now; None if that cannot be told."""
    goal, ordered = memory.goal, bool(memory.value("order"))
    since = view.time if memory.standing_since is None else memory.standing_since
    if memory.value("arrived") and goal is not None:
        return Proposition.of(Predicate.ARRIVED, place=goal)
    if memory.value("detour"):
        return Proposition.of(Predicate.BLOCKED, object=ObjectClass.STATIC)
    if view.motion is Motion.HAZARD and view.hazard is ObjectClass.TRAFFIC_LIGHT:
        return Proposition.of(Predicate.RED, object=view.hazard) if is_red_ahead(memory.town, view) else None
    if view.motion is Motion.HAZARD and view.hazard is not ObjectClass.UNLABELED:
        return Proposition.of(Predicate.HINDERS, object=view.hazard)
    if memory.value("halted") and since - memory.told_to_stop_at < OBEYED_WITHIN:
        return TOLD_TO_STOP
    if goal is None and not ordered:
        return Proposition.of(Predicate.GOAL, negated=True)
    guided = goal is not None and memory.goal_mark < 0 and not ordered
    if view.motion is Motion.WAITING or memory.value("pausing") or guided:
        return Proposition.of(Predicate.HAS_ROUTE, negated=True)
    return None


def why_standing(memory: Memory, view: CoWizardView) -> Remark:
    """Returns the answer to why the car stands, or has just stood."""
    stands = Proposition.of(Predicate.STANDS, action=ActionValue.STOP)
    stood = view.time - memory.stood_until < RECENT_STOP
    if view.standing or (view.motion is Motion.HAZARD and not stood):
        reason = reason_to_stand(memory, view) or memory.reason
        if reason is not None and reason.predicate is Predicate.GOAL:
            where = Proposition.of(Predicate.GOAL, place=LandmarkName.QUERIED)
            return intend(CommunicativeFunction.SET_QUESTION, where)
        return explanation(stands, reason)
    if stood:
        since = memory.stood_until if memory.reason is None else memory.reason_since
        return explanation(stands, memory.reason, at=round(since))
    return intend(CommunicativeFunction.ANSWER, stands.opposite, elided=("action",))


def why_turning_round(memory: Memory, view: CoWizardView) -> Remark:
    """Returns the answer to why the car turns round."""
    turns, reason = Proposition.of(Predicate.DOES, action=ActionValue.U_TURN), None
    if view.time - memory.told_to_turn_round_at < RECENT_STOP:
        reason = Proposition.of(Predicate.TOLD, action=ActionValue.U_TURN)
    elif view.time - memory.navigator.blocked_at < DETOUR_TIME:
        reason = Proposition.of(Predicate.BLOCKED, object=ObjectClass.STATIC)
    elif memory.goal is not None and memory.goal_mark >= 0:
        reason = Proposition.of(Predicate.BEHIND, place=memory.goal)
    return explanation(turns, reason)
