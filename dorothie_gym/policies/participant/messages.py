"""Messages to the participant: the time to read or hear them, and remarks about them."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.dialogue.conversation import WORDS_PER_SECOND
from dorothie_gym.dialogue.intentions import CommunicativeFunction as Function
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.policies.speech import Remark, intend
from dorothie_gym.tasks.purposes import ReadMessage, read_message
from dorothie_gym.tasks.storyboard import Channel

if TYPE_CHECKING:
    from dorothie_gym.policies.observation_parser import SeenLandmark
    from dorothie_gym.policies.participant.state import ParticipantState
    from dorothie_gym.policies.participant.view import ParticipantView

READING_RATE = 4.0
"""Rate at which a message is read [words/s] (Brysbaert, Journal of Memory and Language 109, 2019: 238 a minute)."""

LONGEST_REASON = 55
"""Longest purpose or reason that is said [characters]."""

_PRONOUN = re.compile(r"\b(he|she|it|they|him|her|his|its|them|their|theirs|this|that|those|these|ones?)\b")


_HERE = re.compile(r"\bhere\b")
_POINTS = re.compile(r"\b(this|these|I|we|my|our|us|me)\b", re.IGNORECASE)
"""Words of a sender that mean something else in another mouth."""


def refers_back(text: str) -> bool:
    """Returns whether a text has a pronoun, whose antecedent must have been mentioned."""
    return _PRONOUN.search(text) is not None


def seconds_to_take_in(view: ParticipantView) -> float:
    """Returns the time to read the message that has just arrived, or to listen to a caller [s]; 0 without one."""
    message = _message(view)
    if message is None:
        return 0.0
    rate = WORDS_PER_SECOND if message.channel is Channel.CALL else READING_RATE
    return len(message.text.split()) / rate


def message_remark(
    state: ParticipantState, view: ParticipantView, landmark: SeenLandmark, rng: np.random.Generator
) -> tuple[Remark, ...]:
    """Returns, with some probability, remarks on sender and reason of the last message about an errand that has one."""
    read = _message(view)
    if read is None or read.reason is None or len(read.reason) > LONGEST_REASON:
        return ()
    if rng.random() >= state.config.tells_message or (read.sender is None and refers_back(read.reason)):
        return ()
    if _POINTS.search(read.reason) is not None:
        return ()
    reason = _HERE.sub("there", read.reason)  # where the sender is
    said = Proposition.of(Predicate.PURPOSE, place=landmark.name, person=read.sender, reason=reason)
    topic = "reason_after" if read.sender is None else "message"
    return (intend(Function.INFORM, said, elided=("place",), wording=Wording(topic=topic), joined=True),)


def _message(view: ParticipantView) -> ReadMessage | None:
    """Returns the message that has just arrived; None without one."""
    text = str(view.raw["message"])
    return read_message(text) if text else None
