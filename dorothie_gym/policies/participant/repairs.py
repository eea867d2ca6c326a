"""When understanding fails: the participant has not caught the car's words, or the car has not caught its own."""

from __future__ import annotations

import numpy as np

from dorothie_gym.dialogue import ParsedText, speech_seconds
from dorothie_gym.ontology import ActionValue, DialogueAct, DialogueMove, GoalStatus, Slot, SlotValue
from dorothie_gym.policies.participant.state import ParticipantState
from dorothie_gym.policies.participant.view import ParticipantView
from dorothie_gym.policies.speech import Remark, remark
from dorothie_gym.policies.utterance_input import HeardUtterance

RECENT = 15.0
"""What the car repeats, it has been told no longer ago than this [s]."""

_SPOKEN_INTO = frozenset({DialogueMove.EXPLAIN, DialogueMove.QUERY_YN, DialogueMove.CHECK, DialogueMove.QUERY_W})
"""What one would rather have said again than let pass."""

_TAKEN_UP = frozenset({DialogueMove.ACKNOWLEDGE, DialogueMove.CONFIRM, DialogueMove.EXPLAIN, DialogueMove.QUERY_W})

_SIDEWAYS = (ActionValue.J_TURN, ActionValue.LANE_SWITCH)


def not_caught(mind: ParticipantState, view: ParticipantView, heard: HeardUtterance, rng: np.random.Generator) -> bool:
    """Whether the participant asks what the car has said: it was speaking itself meanwhile.

    Args:
        mind: of the participant; remembers the words, to answer them when they are made clear.
        view: what it sees.
        heard: what the car has said.
        rng: for the choice.
    """
    if heard.acts[0].move is DialogueMove.CLARIFY:
        return False
    spoke_meanwhile = mind.voice.last_end > view.time - speech_seconds(heard.words.text)
    wants_it = any(act.move in _SPOKEN_INTO and _names_something(act) for act in heard.acts)
    if not (spoke_meanwhile and wants_it and mind.voice.idle and rng.random() < mind.style.puzzled):
        return False
    mind.puzzled_by = heard
    mind.voice = mind.voice.plan_first(remark(DialogueMove.CONFUSE))
    return True


def _names_something(act: DialogueAct) -> bool:
    return any(value.label not in ("Unknown", "Queried") for value in act.slots)


def misunderstood(mind: ParticipantState, view: ParticipantView, act: DialogueAct, words: ParsedText) -> Remark | None:
    """What to say to a car that takes up something that it has not been told; None if it has understood.

    Args:
        mind: of the participant.
        view: what it sees.
        act: of the car.
        words: of the car.
    """
    if act.move not in _TAKEN_UP or mind.goal is None or not mind.told:
        return None
    return _wrong_place(mind, act) or _wrong_side(mind, view, act, words)


def _wrong_place(mind: ParticipantState, act: DialogueAct) -> Remark | None:
    """The place again, if another one was taken up."""
    assert mind.goal is not None
    named = {value for value in act.values(Slot.LANDMARK) if value.label not in ("Unknown", "Queried")}
    said = {value for item in mind.voice.said for value in item.act.slots}
    dropped = {item.wording.dropped for item in mind.voice.said}
    if not named or mind.goal.name in named or named & (said | dropped):
        return None
    if act.move is DialogueMove.EXPLAIN and GoalStatus.UNKNOWN not in act.slots:
        return None  # it only tells what it sees
    values: list[SlotValue] = [mind.goal.name]
    if mind.goal.street.label not in ("Unknown", "Queried"):
        values.append(mind.goal.street)
    return remark(DialogueMove.CLARIFY, *values)


def _wrong_side(mind: ParticipantState, view: ParticipantView, act: DialogueAct, words: ParsedText) -> Remark | None:
    """The turn again, if another direction was taken up."""
    if words.direction is None or view.time - mind.voice.last_end > RECENT or act.move is DialogueMove.EXPLAIN:
        return None
    for item in reversed(mind.voice.said):
        wanted = item.wording.direction
        same = set(item.act.values(Slot.ACTION)) & set(act.values(Slot.ACTION)) & set(_SIDEWAYS)
        if wanted is not None and same:
            right = wanted is words.direction
            return None if right else remark(DialogueMove.CLARIFY, *item.act.slots, wording=item.wording)
    return None
