"""Observations with an utterance that has just been completed."""

from __future__ import annotations

from typing import Any

import numpy as np

from dorothie_gym.dialogue import Wording, word_act
from dorothie_gym.ontology import DialogueAct, DialogueMove, Role, SlotValue, encode_slots
from dorothie_gym.policies.heard_utterance import HeardUtterance, heard_utterance


def with_words(observation: dict[str, Any], speaker: Role, text: str, *acts: DialogueAct) -> dict[str, Any]:
    """Returns an observation of a listener with an utterance of a speaker."""
    moves, slots = observation[f"{speaker}_moves"].copy(), np.zeros_like(observation[f"{speaker}_slots"])
    for k, act in enumerate(acts):
        moves[k], slots[k] = int(act.move), encode_slots(act.slots)
    return {**observation, f"{speaker}_text": text, f"{speaker}_moves": moves, f"{speaker}_slots": slots}


def heard(
    observation: dict[str, Any], speaker: Role, move: DialogueMove, *values: SlotValue, wording: Wording | None = None
) -> HeardUtterance:
    """Returns one act, worded by the grammar, as a listener receives it."""
    act = DialogueAct.of(move, *values)
    text = word_act(act, speaker, np.random.default_rng(1), wording)
    found = heard_utterance(with_words(observation, speaker, text, act), speaker)
    assert found is not None
    return found
