"""Clarification requests of the Co-Wizard, which asks for a repetition, then for one detail, then stops and waits."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.dialogue.conversation import resembles_request_to_repeat
from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.intentions import CommunicativeFunction as Function
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.ontology.slots import ActionValue, LandmarkName
from dorothie_gym.policies import act_builders
from dorothie_gym.policies.co_wizard.intentions import Directive
from dorothie_gym.policies.co_wizard.proposals import propose_way
from dorothie_gym.policies.co_wizard.repairs import repeat_last
from dorothie_gym.policies.speech import intend
from dorothie_gym.sim.state.codes import Motion

if TYPE_CHECKING:
    from dorothie_gym.dialogue.nlu import ParsedText
    from dorothie_gym.policies.co_wizard.state import CoWizardState
    from dorothie_gym.policies.co_wizard.view import CoWizardView

TWICE = 2
"""Number of failures after which the car stops rather than asks."""


def ask_back(state: CoWizardState, view: CoWizardView, words: ParsedText, *, question: bool = False) -> None:
    """Reacts to an utterance that was not understood.

    The first time, the car asks for a repetition. The second time it narrows: it asks whether the side or the place
    that it has heard is meant, or for the way or the destination. After that it stops until the way is clear, or goes
    on if it knows the destination. It says of a question that it has no answer.

    Args:
        state: working copy of the state.
        view: observation.
        words: what was heard.
        question: whether it was a question, which only needs an answer.
    """
    if _may_be_asked_back(state, view, words):
        repeat_last(state)  # "calm again?"
    elif state.speech.may_ask_back(view.time):
        state.say(intend(Function.NEGATIVE_FEEDBACK))
    elif question:
        state.say(intend(Function.UNCERTAIN_ANSWER))
    elif state.speech.asked_back < TWICE and not _has_just_asked(state):
        _narrow(state, view, words)
    elif _is_stranded(state, view):
        _stop_to_sort_out(state, view)


def explain_differently(state: CoWizardState, view: CoWizardView, words: ParsedText, rng: np.random.Generator) -> None:
    """Reacts to another failure of the participant to understand.

    A question about the way becomes one that a yes or a no answers, others are narrowed; a statement is dropped.

    Args:
        state: working copy of the state.
        view: observation.
        words: what the participant said.
        rng: random generator of the decision.
    """
    last = state.speech.last_content
    if state.speech.turns_of_repair(view.time) > 1:
        return  # the participant goes on as it wants
    if last is None or last.act.move in act_builders.QUESTIONS or state.speech.has_just_asked_back:
        asks_way = last is not None and ActionValue.QUERIED in last.act.slots
        if asks_way and view.choice is not None and not state.speech.has_just_asked_back:
            propose_way(state, view, view.choice, rng)
        elif not _has_just_asked(state):
            _narrow(state, view, words)
    else:
        state.say(intend(Function.INFORM, wording=Wording(topic="unimportant")))


def _may_be_asked_back(state: CoWizardState, view: CoWizardView, words: ParsedText) -> bool:
    """Returns whether the participant has probably not understood the last remark, which was not repeated yet."""
    return state.speech.may_be_asked_for(view.time) and resembles_request_to_repeat(words.text)


def _has_just_asked(state: CoWizardState) -> bool:
    """Returns whether the last remark was a question that narrows."""
    last = state.speech.last
    return last is not None and last.act.move in act_builders.QUESTIONS and state.speech.asked_back > 0


def _narrow(state: CoWizardState, view: CoWizardView, words: ParsedText) -> None:
    """Asks whether what was heard is meant: a side, a place, the destination; or which way, or where to go."""
    state.dialogue = state.dialogue.after_asking(view.time)
    goal, choice = state.beliefs.goal, view.choice
    if words.direction in (Direction.LEFT, Direction.RIGHT) and choice is not None:
        state.dialogue = state.dialogue.with_proposal(Directive(direction=words.direction, junction=choice.junction))
        turn = act_builders.action(ActionValue.J_TURN, direction=words.direction)
        state.say(intend(Function.CHECK_QUESTION, turn, wording=Wording(direction=words.direction)))
    elif goal is not None and not state.intentions.arrived and (state.beliefs.exact or goal in words.landmarks):
        state.say(intend(Function.CHECK_QUESTION, act_builders.destination(goal)))
    elif goal is not None and not state.intentions.arrived:
        state.say(intend(Function.SET_QUESTION, act_builders.action(ActionValue.QUERIED)))
    else:
        state.say(intend(Function.SET_QUESTION, act_builders.destination(LandmarkName.QUERIED)))


def _is_stranded(state: CoWizardState, view: CoWizardView) -> bool:
    """Returns whether the car drives without knowing where to."""
    knows_way = state.beliefs.exact or state.intentions.directive is not None or bool(state.plan.steps)
    return not (knows_way or state.intentions.halted or view.standing or view.motion is Motion.WAITING)


def _stop_to_sort_out(state: CoWizardState, view: CoWizardView) -> None:
    """Stops, says why, and asks for the way or the destination."""
    state.intentions = state.intentions.halting()
    state.dialogue = state.dialogue.after_asking(view.time)
    stops = Proposition.of(Predicate.WILL, action=ActionValue.STOP)
    asked = act_builders.action(ActionValue.QUERIED)
    if state.beliefs.goal is None:
        asked = act_builders.destination(LandmarkName.QUERIED)
    state.say(
        intend(Function.INFORM, stops, wording=Wording(topic="sort_out")),
        intend(Function.SET_QUESTION, asked, joined=True),
    )
