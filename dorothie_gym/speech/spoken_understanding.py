"""Understanding of recognised speech: marks and capitals are restored, and the hypotheses tell how sure the act is."""

from __future__ import annotations

import functools
from collections import defaultdict
from dataclasses import dataclass

from dorothie_gym.copying import shared
from dorothie_gym.dialogue import guess_act
from dorothie_gym.ontology import DialogueAct, DialogueMove
from dorothie_gym.speech.language import punctuation_model
from dorothie_gym.speech.recognizer import Recognition
from dorothie_gym.speech.spoken_form import written_form

INAUDIBLE = "..."
"""Text of speech of which nothing was recognised."""


@shared
@dataclass(frozen=True, kw_only=True)
class SpokenUnderstanding:
    """Reading of a recognised span.

    Attributes:
        text: recognised words with marks and names as they are written; `INAUDIBLE` if there are none.
        act: act of the best hypothesis; Irrelevant if nothing was recognised.
        confidence: share of the hypotheses, by weight, that have this act, in [0, 1].
        alternatives: other acts with their shares, the most probable first.
    """

    text: str
    act: DialogueAct
    confidence: float
    alternatives: tuple[tuple[DialogueAct, float], ...] = ()


@functools.lru_cache(maxsize=8192)
def readable(text: str) -> str:
    """Returns spoken words in lower case as a written sentence: with marks, and with names as they are written."""
    tokens = punctuation_model().restore(text.split())
    return written_form(tokens) or INAUDIBLE


def understand_speech(recognition: Recognition, after: DialogueMove | None = None) -> SpokenUnderstanding:
    """Returns what recognised speech means.

    The act is that of the best hypothesis. Choosing the act with the largest share instead finds it less often, because
    acts without a name have more hypotheses.

    Args:
        recognition: result of a recogniser.
        after: last move of the other speaker if it awaits an answer, see `guess_act`.
    """
    if not recognition.hypotheses:
        return SpokenUnderstanding(text=INAUDIBLE, act=DialogueAct(DialogueMove.IRRELEVANT), confidence=0.0)
    shares: dict[DialogueAct, float] = defaultdict(float)
    for hypothesis in recognition.hypotheses:
        shares[guess_act(readable(hypothesis.text), after)] += hypothesis.weight
    text = readable(recognition.hypotheses[0].text)
    act = guess_act(text, after)
    others = sorted(((each, share) for each, share in shares.items() if each != act), key=lambda each: -each[1])
    return SpokenUnderstanding(text=text, act=act, confidence=shares[act], alternatives=tuple(others))
