"""Acknowledgements of instructions, and remarks about the present plan that go with them."""

from __future__ import annotations

import numpy as np

from dorothie_gym.dialogue import ParsedText, Wording
from dorothie_gym.ontology import ActionValue, DialogueMove
from dorothie_gym.policies.co_wizard.state import CoWizardState
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.speech import Remark, remark

_AT_ONCE = frozenset({ActionValue.STOP, ActionValue.START})
"""Actions that are carried out at once and therefore never checked."""


def acknowledge(state: CoWizardState, action: ActionValue, words: ParsedText, rng: np.random.Generator) -> None:
    """Acknowledges an instruction: not at all, with a word, by repeating it, or by checking it.

    Args:
        state: working copy of the state.
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
        state.say(taken, *plan_remark(state, rng, joined=True))


def _repeated(action: ActionValue, wording: Wording, rng: np.random.Generator) -> tuple[Remark, ...]:
    draw = rng.random()
    if draw < 0.25:
        return (remark(DialogueMove.CONFIRM, action, wording=replace(wording, topic="taken")),)
    if draw < 0.35:
        return (remark(DialogueMove.ACKNOWLEDGE, action, wording=wording),)
    move = DialogueMove.ACKNOWLEDGE if draw < 0.85 else DialogueMove.CONFIRM
    words = remark(move, wording=Wording(topic="taken"))
    return words, remark(DialogueMove.EXPLAIN, action, wording=wording, joined=True)


def plan_remark(state: CoWizardState, rng: np.random.Generator, *, joined: bool = False) -> tuple[Remark, ...]:
    """Returns a remark about the present plan, or nothing, by chance.

    Args:
        state: working copy of the state.
        rng: random generator of the decision.
        joined: whether the remark continues the one before.
    """
    if rng.random() > state.style.rambles:
        return ()
    if state.route.progress is not None and state.beliefs.exact:
        topic = "plan" if rng.random() < 0.4 else "eta"
    else:
        topic = "search" if state.beliefs.goal is not None else "idle"
    return (remark(DialogueMove.EXPLAIN, wording=Wording(topic=topic), joined=joined),)
