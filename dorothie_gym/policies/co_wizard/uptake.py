"""How the Co-Wizard shows that it has understood what it is to do."""

from __future__ import annotations

import numpy as np

from dorothie_gym.dialogue import Heard, Wording
from dorothie_gym.ontology import ActionValue, DialogueMove
from dorothie_gym.policies.co_wizard.mind import CoWizardMind
from dorothie_gym.policies.speech import remark

_AT_ONCE = frozenset({ActionValue.STOP, ActionValue.START})
"""What is done at once is not asked back about."""

PLAIN = 0.45
"""Chance that nothing but an acknowledgement is said by somebody who does not repeat what it was told."""


def take_up(mind: CoWizardMind, action: ActionValue, words: Heard, rng: np.random.Generator) -> None:
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
    draw = rng.random()
    if draw < mind.style.checks * 0.3 and action not in _AT_ONCE:
        mind.voice = mind.voice.plan(remark(DialogueMove.CHECK, action, wording=wording))
    elif rng.random() < mind.style.echoes:
        _repeat(mind, action, wording, rng)
    else:
        mind.voice = mind.voice.plan(remark(DialogueMove.ACKNOWLEDGE))
        if rng.random() > PLAIN:
            mind.voice = mind.voice.plan(remark(DialogueMove.EXPLAIN, action, wording=wording, joined=True))


def _repeat(mind: CoWizardMind, action: ActionValue, wording: Wording, rng: np.random.Generator) -> None:
    draw = rng.random()
    if draw < 0.4:
        mind.voice = mind.voice.plan(remark(DialogueMove.CONFIRM, action, wording=wording))
    elif draw < 0.6:
        mind.voice = mind.voice.plan(remark(DialogueMove.ACKNOWLEDGE, action, wording=wording))
    elif draw < 0.85:
        mind.voice = mind.voice.plan(
            remark(DialogueMove.ACKNOWLEDGE), remark(DialogueMove.EXPLAIN, action, wording=wording, joined=True)
        )
    else:
        mind.voice = mind.voice.plan(remark(DialogueMove.EXPLAIN, action, wording=wording))
