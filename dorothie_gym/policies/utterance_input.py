"""Utterances as a listener observes them: acts, words, and the interpretation of the words by rules."""

from __future__ import annotations

from dataclasses import dataclass

from dorothie_gym.dialogue import ParsedText, guess_spans, understand
from dorothie_gym.ontology import DialogueAct, DialogueMove, Role
from dorothie_gym.spaces import ObservationMapping, heard_acts


@dataclass(frozen=True, kw_only=True)
class HeardUtterance:
    """Completed utterance: its acts in order, and its parsed words."""

    acts: tuple[DialogueAct, ...]
    words: ParsedText


def heard_utterance(
    observation: ObservationMapping, speaker: Role, after: DialogueMove | None = None
) -> HeardUtterance | None:
    """Returns the utterance completed since the last decision, or None; acts that are not observed are classified.

    Args:
        observation: observation of the listener.
        speaker: role of the speaker.
        after: last move of the listener, as context of the classification.
    """
    text = str(observation[f"{speaker}_text"])
    acts = heard_acts(observation, speaker)
    if not text and not acts:
        return None
    if acts is None:
        acts = tuple(span.act for span in guess_spans(text, after))
    return HeardUtterance(acts=acts, words=understand(text))
