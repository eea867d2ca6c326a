"""What a listener has of an utterance: the words, what rules take from them, and the acts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from dorothie_gym.dialogue import ParsedText, guess_spans, understand
from dorothie_gym.ontology import DialogueAct, DialogueMove, Role
from dorothie_gym.spaces import heard_acts


@dataclass(frozen=True, kw_only=True)
class HeardUtterance:
    """An utterance that is over: its acts in order, and its words with what they tell."""

    acts: tuple[DialogueAct, ...]
    words: ParsedText


def heard_utterance(
    observation: Mapping[str, Any], speaker: Role, after: DialogueMove | None = None
) -> HeardUtterance | None:
    """What a speaker has said since the last decision, or None; acts that are not observed are guessed from the words.

    Args:
        observation: of the listener.
        speaker: who may have spoken.
        after: move of what the listener said last.
    """
    text = str(observation[f"{speaker}_text"])
    acts = heard_acts(observation, speaker)
    if not text and not acts:
        return None
    if acts is None:
        acts = tuple(span.act for span in guess_spans(text, after))
    return HeardUtterance(acts=acts, words=understand(text))
