"""Acknowledgements of instructions, and remarks about the current plan that accompany them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from dorothie_gym.dialogue.intentions import CommunicativeFunction as Function
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.ontology.slots import ActionValue, ObjectClass
from dorothie_gym.policies import act_builders
from dorothie_gym.policies.co_wizard.proposition_truth import DETOUR_TIME, believes, reason_to_stand, seconds_to_goal
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.speech import Remark, intend
from dorothie_gym.sim.state.codes import Motion

if TYPE_CHECKING:
    from dorothie_gym.dialogue.nlu import ParsedText
    from dorothie_gym.policies.co_wizard.state import CoWizardState
    from dorothie_gym.policies.co_wizard.view import CoWizardView

_AT_ONCE = frozenset({ActionValue.STOP, ActionValue.START})
"""Actions that are carried out immediately, and thus never checked with the participant."""

STEERING_AWAY: Final = frozenset({ActionValue.J_TURN, ActionValue.U_TURN, ActionValue.LANE_SWITCH})
"""Requests that a car which is held up keeps for later."""

KEPT_AGAIN: Final = 20.0
"""Time after which a car that is held up says once more by what [s]."""

_GOING: Final = frozenset({ActionValue.LANE_FOLLOW, ActionValue.START})


def acknowledge(
    state: CoWizardState,
    view: CoWizardView,
    action: ActionValue,
    words: ParsedText,
    rng: np.random.Generator,
    *,
    answers: bool,
) -> None:
    """Acknowledges an instruction: with a word, by taking it on, by repeating it, by checking it, or not at all.

    Args:
        state: working copy of the state.
        view: observation.
        action: requested action.
        words: words of the instruction.
        rng: random generator of the decision.
        answers: whether the instruction answers a question of the car, so that it may be obeyed without a word.
    """
    if rng.random() < state.style.silent and answers:
        return
    wanted = act_builders.action(action, words)
    wording = Wording(
        direction=words.direction,
        faster=words.faster,
        lights=words.lights,
        speed=words.speed if action is ActionValue.SPEED_CHANGE else None,
    )
    if action is ActionValue.STOP and (state.beliefs.goal is None or state.beliefs.exact):
        state.say(intend(Function.ACCEPT, wanted, wording=replace(wording, topic="taken")))
        return
    at_once = action in _AT_ONCE or words.further or words.distance is not None
    if rng.random() < state.style.checks * 0.25 and not at_once:
        state.say(intend(Function.CHECK_QUESTION, wanted, wording=wording))
    elif rng.random() < state.style.echoes and not _is_yet_to_come(view, action, words):
        state.say(*_repeated(wanted, wording, rng))
    else:
        more = plan_remark(state, view, rng, joined=True) if state.beliefs.exact and action not in _AT_ONCE else ()
        state.say(taken_on(state, wanted, rng, promises=action in _AT_ONCE), *more)


def _is_yet_to_come(view: CoWizardView, action: ActionValue, words: ParsedText) -> bool:
    """Returns whether "slowing down" or "turning now" would be wrong: the action comes later, or is a short way on."""
    later = (action is ActionValue.SPEED_CHANGE and view.standing) or (words.ordinal or 1) > 1
    return later or words.further or words.distance is not None


def what_keeps(state: CoWizardState, view: CoWizardView, action: ActionValue) -> Remark | None:
    """Returns why the car cannot drive on yet, as a reply to a request to do so; None if nothing holds it up.

    A red light is only mentioned to those who want the car to go at once. What has just been said is not said again.

    Args:
        state: working copy of the state.
        view: observation.
        action: requested action.
    """
    red = view.hazard is ObjectClass.TRAFFIC_LIGHT
    if action not in (_GOING if red else _GOING | STEERING_AWAY):
        return None
    if not view.standing or view.motion is not Motion.HAZARD or view.hazard is ObjectClass.UNLABELED:
        return None
    lately = view.time - state.dialogue.hazard_explained_at < KEPT_AGAIN
    reason = None if lately else reason_to_stand(state.knowledge, view)
    if reason is None:
        return None
    state.dialogue = state.dialogue.after_explaining_hazard(view.time)
    stands = Proposition.of(Predicate.STANDS, action=ActionValue.STOP)
    because = Proposition.of(Predicate.BECAUSE, effect=stands, cause=reason)
    return intend(Function.INFORM, because, wording=Wording(topic="because_standing"))


def sign_of_hearing(topic: str) -> Remark:
    """Returns an acknowledgement.

    Args:
        topic: kind of the utterance: an order ("ordered"), news ("told"), a place close ahead ("near"), something
            visible ("seen"), an answer ("answered"), a completed errand ("done"), small talk ("chat"), or a question
            whether it was understood ("align") or heard at all ("hears").
    """
    return intend(Function.POSITIVE_FEEDBACK, wording=Wording(topic=topic))


def taken_on(state: CoWizardState, wanted: Proposition, rng: np.random.Generator, *, promises: bool = False) -> Remark:
    """Returns an acceptance of the request ("will do") or an acknowledgement ("okay"), drawn at random.

    Args:
        state: working copy of the state.
        wanted: the request.
        rng: random generator of the decision.
        promises: whether it is accepted in any case.
    """
    if rng.random() < state.config.accepts or promises:
        return intend(Function.ACCEPT, wanted, elided=act_builders.arguments_of(wanted), wording=Wording(topic="taken"))
    return sign_of_hearing("ordered")


def _repeated(wanted: Proposition, wording: Wording, rng: np.random.Generator) -> tuple[Remark, ...]:
    """Accepts an instruction by repeating it: "turning left", or "okay, I'm turning left"."""
    if rng.random() < 0.35:
        return (intend(Function.ACCEPT, wanted, wording=replace(wording, topic="taken")),)
    return sign_of_hearing("ordered"), intend(Function.INFORM, wanted, wording=wording, joined=True)


def plan_remark(
    state: CoWizardState, view: CoWizardView, rng: np.random.Generator, *, joined: bool = False
) -> tuple[Remark, ...]:
    """Returns, with some probability, a remark about the current plan.

    Args:
        state: working copy of the state.
        view: observation.
        rng: random generator of the decision.
        joined: whether the remark continues the one before.
    """
    if rng.random() > state.style.rambles:
        return ()
    goal = state.beliefs.goal
    seconds = seconds_to_goal(state.knowledge, view) if _drives_as_planned(state, view) else None
    elided: tuple[str, ...] = ("place",)
    if seconds is not None and rng.random() < 0.6:
        content = Proposition.of(Predicate.ARRIVES_IN, place=goal, seconds=seconds)
    elif state.route.progress is not None and state.beliefs.exact:
        content = Proposition.of(Predicate.HAS_ROUTE, place=goal)
    elif goal is not None:
        content = Proposition.of(Predicate.KNOWS, place=goal, negated=True)
        if believes(state.knowledge, view, content) is not True:
            return ()
    else:
        content, elided = Proposition.of(Predicate.GOAL, negated=True), ()
    repeated = any(content.predicate is known.predicate for item in state.speech.said for known in item.meaning)
    return () if repeated else (intend(Function.INFORM, content, elided=elided, joined=joined),)


def _drives_as_planned(state: CoWizardState, view: CoWizardView) -> bool:
    """Returns whether the car follows its route: nothing is in its way, and no instruction leads elsewhere."""
    intentions = state.intentions
    told = intentions.directive is not None or intentions.wish is not None
    blocked = view.time - state.dialogue.blocked_at < DETOUR_TIME
    return not (told or blocked or view.motion is Motion.HAZARD)


def accept_change(state: CoWizardState, change: Proposition, rng: np.random.Generator) -> None:
    """Acknowledges a change of the tasks: repeats it, or only shows that it was heard, drawn at random."""
    if rng.random() < state.config.accepts_changes:
        state.say(intend(Function.ACCEPT, change))
    else:
        state.say(intend(Function.POSITIVE_FEEDBACK, change, elided=act_builders.arguments_of(change)))
