"""Acknowledgements of instructions, and remarks about the present plan that go with them."""

from __future__ import annotations

import numpy as np

from dorothie_gym.dialogue import CommunicativeFunction as Function
from dorothie_gym.dialogue import ParsedText, Predicate, Proposition, Wording
from dorothie_gym.ontology import ActionValue, DialogueMove
from dorothie_gym.policies.co_wizard.judgement import seconds_to_goal
from dorothie_gym.policies.co_wizard.state import CoWizardState
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.speech import Remark, intend, remark

_AT_ONCE = frozenset({ActionValue.STOP, ActionValue.START})
"""Actions that are carried out at once and therefore never checked."""


def acknowledge(
    state: CoWizardState, view: CoWizardView, action: ActionValue, words: ParsedText, rng: np.random.Generator
) -> None:
    """Acknowledges an instruction: not at all, with a word, by repeating it, or by checking it.

    Args:
        state: working copy of the state.
        view: observation.
        action: action that was asked for.
        words: words of the instruction.
        rng: random generator of the decision.
    """
    if rng.random() < state.style.silent:
        return
    wording = Wording(
        direction=words.direction,
        faster=words.faster,
        lights=words.lights,
        speed=words.speed if action is ActionValue.SPEED_CHANGE else None,
    )
    at_once = action in _AT_ONCE or words.further or words.distance is not None
    if rng.random() < state.style.checks * 0.25 and not at_once:
        state.say(remark(DialogueMove.CHECK, action, wording=wording))
    elif rng.random() < state.style.echoes:
        state.say(*_repeated(action, wording, rng))
    else:
        move = DialogueMove.CONFIRM if rng.random() < state.config.confirms else DialogueMove.ACKNOWLEDGE
        taken = remark(move, wording=Wording(topic="taken"))
        state.say(taken, *plan_remark(state, view, rng, joined=True))


def _repeated(action: ActionValue, wording: Wording, rng: np.random.Generator) -> tuple[Remark, ...]:
    draw = rng.random()
    if draw < 0.25:
        return (remark(DialogueMove.CONFIRM, action, wording=replace(wording, topic="taken")),)
    if draw < 0.35:
        return (remark(DialogueMove.ACKNOWLEDGE, action, wording=wording),)
    move = DialogueMove.ACKNOWLEDGE if draw < 0.85 else DialogueMove.CONFIRM
    words = remark(move, wording=Wording(topic="taken"))
    return words, remark(DialogueMove.EXPLAIN, action, wording=wording, joined=True)


def plan_remark(
    state: CoWizardState, view: CoWizardView, rng: np.random.Generator, *, joined: bool = False
) -> tuple[Remark, ...]:
    """Returns a remark about the present plan, or nothing, by chance.

    Args:
        state: working copy of the state.
        view: observation.
        rng: random generator of the decision.
        joined: whether the remark continues the one before.
    """
    if rng.random() > state.style.rambles:
        return ()
    goal, seconds = state.beliefs.goal, seconds_to_goal(state, view)
    elided: tuple[str, ...] = ("place",)
    if seconds is not None and rng.random() < 0.6:
        content = Proposition.of(Predicate.ARRIVES_IN, place=goal, seconds=seconds)
    elif state.route.progress is not None and state.beliefs.exact:
        content = Proposition.of(Predicate.HAS_ROUTE, place=goal)
    elif goal is not None:
        content = Proposition.of(Predicate.KNOWS, place=goal, negated=True)
    else:
        content, elided = Proposition.of(Predicate.GOAL, negated=True), ()
    repeated = any(content.predicate is known.predicate for item in state.speech.said for known in item.meaning)
    return () if repeated else (intend(Function.INFORM, content, elided=elided, joined=joined),)
