"""How the Co-Wizard shows that it has understood what it is to do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dorothie_gym.dialogue import ParsedText, Wording
from dorothie_gym.ontology import ActionValue, DialogueMove
from dorothie_gym.policies.co_wizard.state import CoWizardState
from dorothie_gym.policies.speech import Remark, remark

CONFIRMS = 0.45
"""Chance that a command that is not repeated is confirmed, not only acknowledged."""

_AT_ONCE = frozenset({ActionValue.STOP, ActionValue.START})
"""What is done at once is not asked back about."""


def take_up(mind: CoWizardState, action: ActionValue, words: ParsedText, rng: np.random.Generator) -> None:
    """Acknowledges an action that was asked for: not at all, in a word, by repeating it, or by asking back.

    Args:
        mind: of the Co-Wizard.
        action: what it is to do.
        words: how it was told to.
        rng: for the choice.
    """
    if rng.random() < mind.style.silent:
        return
    wording = Wording(
        direction=words.direction,
        faster=words.faster,
        lights=words.lights,
        speed=words.speed if action is ActionValue.SPEED_CHANGE else None,
    )
    at_once = action in _AT_ONCE or words.further or words.distance is not None
    if rng.random() < mind.style.checks * 0.25 and not at_once:
        mind.voice = mind.voice.plan(remark(DialogueMove.CHECK, action, wording=wording))
    elif rng.random() < mind.style.echoes:
        mind.voice = mind.voice.plan(*_repeated(action, wording, rng))
    else:
        move = DialogueMove.CONFIRM if rng.random() < CONFIRMS else DialogueMove.ACKNOWLEDGE
        taken = remark(move, wording=Wording(topic="taken"))
        mind.voice = mind.voice.plan(taken, *musing(mind, rng, joined=True))


def _repeated(action: ActionValue, wording: Wording, rng: np.random.Generator) -> tuple[Remark, ...]:
    draw = rng.random()
    if draw < 0.25:
        return (remark(DialogueMove.CONFIRM, action, wording=replace(wording, topic="taken")),)
    if draw < 0.35:
        return (remark(DialogueMove.ACKNOWLEDGE, action, wording=wording),)
    move = DialogueMove.ACKNOWLEDGE if draw < 0.85 else DialogueMove.CONFIRM
    words = remark(move, wording=Wording(topic="taken"))
    return words, remark(DialogueMove.EXPLAIN, action, wording=wording, joined=True)


def musing(mind: CoWizardState, rng: np.random.Generator, *, joined: bool = False) -> tuple[Remark, ...]:
    """What it is up to, told now and then along with something else.

    Args:
        mind: of the Co-Wizard.
        rng: for the choice.
        joined: whether it goes on from what is said before.
    """
    if rng.random() > mind.style.rambles:
        return ()
    if mind.journey is not None and mind.exact:
        topic = "plan" if rng.random() < 0.4 else "eta"
    else:
        topic = "search" if mind.goal is not None else "idle"
    return (remark(DialogueMove.EXPLAIN, wording=Wording(topic=topic), joined=joined),)
