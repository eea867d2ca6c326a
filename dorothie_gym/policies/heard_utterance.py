"""Heard utterance: its acts, true or understood from its words, and the parse of each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from dorothie_gym.dialogue.dialogue_act_classifier import guess_spans
from dorothie_gym.dialogue.nlu import ParsedText, understand
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.session.spaces.observations import ObservationMapping, heard_acts

if TYPE_CHECKING:
    from dorothie_gym.ontology.roles import Role


@dataclass(frozen=True, kw_only=True)
class HeardUtterance:
    """Utterance that ended since the last decision, as a policy reads it from its observation.

    Attributes:
        acts: acts in order; classified from the words where acts are not observed.
        words: parsed words.
        classified: whether the acts are read from the words, because they are not observed.
        parts: parsed words of each act; empty if there is one act, or if the words do not divide into the acts.
    """

    acts: tuple[DialogueAct, ...]
    words: ParsedText
    classified: bool = False
    parts: tuple[ParsedText, ...] = ()

    def words_of(self, number: int) -> ParsedText:
        """Returns the parsed words of an act, or those of the whole utterance where its own are not known."""
        return self.parts[number] if self.parts else self.words


def heard_utterance(
    observation: ObservationMapping, speaker: Role, after: DialogueMove | None = None, question: str = ""
) -> HeardUtterance | None:
    """Returns the utterance completed since the last decision, or None; acts that are not observed are classified.

    Args:
        observation: observation of the listener.
        speaker: role of the speaker.
        after: last move of the listener, as context of the classification.
        question: words of the listener's last remark, see `understand`.
    """
    text = str(observation[f"{speaker}_text"])
    acts = heard_acts(observation, speaker)
    if not text and not acts:
        return None
    spans = guess_spans(text, after, question) if acts is None or len(acts) > 1 else ()
    classified = acts is None
    if acts is None:
        acts = tuple(span.act for span in spans)
    divided = len(spans) == len(acts) > 1
    parts = [understand(span.text, "" if number else question) for number, span in enumerate(spans) if divided]
    return HeardUtterance(acts=acts, words=understand(text, question), classified=classified, parts=tuple(parts))
