"""Understanding of recognised speech: restores marks and capitals, and computes the certainty of the act."""

from __future__ import annotations

import functools
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.conversation import INAUDIBLE
from dorothie_gym.dialogue.dialogue_act_classifier import guess_act
from dorothie_gym.dialogue.hypotheses import TextHypothesis, read_hypotheses
from dorothie_gym.dialogue.nlu import understand
from dorothie_gym.dialogue.routes import DrivingPlan, PlanStep
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.ontology.slots import ActionValue, SlotValue
from dorothie_gym.speech.language import punctuation_model
from dorothie_gym.speech.spoken_form import written_form
from dorothie_gym.support.copying import shared

if TYPE_CHECKING:
    from dorothie_gym.speech.recognizer import Recognition, RecognizedWord

DOUBTFUL: Final = 0.2
"""Confidence of a word below which it is probably wrong. Of the 256 shortest of 400 spans in the noise of the car, 9
are marked by it, of which 6 are wrong; two lost a value: one is marked, and the other is not recognised at all."""

SHORT: Final = 2
"""Number of words up to which every uncertain word matters, because there is no context to compensate for it."""

COMPARED: Final = 3
"""Number of hypotheses that have to agree about the meaning of longer speech with doubtful words. Of 194 spans of 19
sessions, most with errors, 9 lost a value; comparing three hypotheses marks 23 spans and finds 7 of the 9; all ten mark
34 and find the same."""

_UNNAMED: Final = frozenset({"Queried", "Unknown"})
"""Values that are not lost with a single word: the subject follows from the rest of the question."""

_SLIGHT: Final = frozenset(
    {"a", "ah", "an", "and", "er", "hey", "hm", "hmm", "oh", "of", "so", "the", "to", "uh", "um", "well", "yo"}
)
"""Words on which no meaning depends, however uncertain they are."""


@shared
@dataclass(frozen=True, kw_only=True)
class SpokenUnderstanding:
    """Reading of a recognised span.

    Attributes:
        text: recognised words with marks and names as they are written; `INAUDIBLE` if there are none.
        act: act of the hypothesis that makes most sense; Irrelevant if nothing was recognised.
        confidence: share of the hypotheses, by weight, that have this act, in [0, 1].
        alternatives: other acts with their shares, the most probable first.
        steps: steps of the driving plan of the best hypothesis, each with the share of the hypotheses that have it.
        unsure: landmarks and streets that most hypotheses, by weight, lack; to be asked about.
    """

    text: str
    act: DialogueAct
    confidence: float
    alternatives: tuple[tuple[DialogueAct, float], ...] = ()
    steps: tuple[tuple[PlanStep, float], ...] = ()
    unsure: tuple[SlotValue, ...] = ()


@functools.lru_cache(maxsize=8192)
def readable(text: str) -> str:
    """Returns spoken words in lower case as a written sentence: with marks, and with names as they are written."""
    tokens = punctuation_model().restore(text.split())
    return written_form(tokens) or INAUDIBLE


def audible(recognition: Recognition) -> str:
    """Returns the recognised words with `INAUDIBLE` in place of uncertain ones, if these may change the meaning.

    They may if the best hypotheses name different values, if most words are doubtful, or if the speech is short. Short
    speech without a command is inaudible, however sure, if another hypothesis is a stop ("great", "brake"), which must
    not be missed; of 110 short spans other than a stop, none was mistaken for one. Spoken dialogue systems also
    reject uncertain input, and ask again (Bohus and Rudnicky, SIGdial 2005).
    """
    short = len(recognition.words) <= SHORT
    if short and _may_be_stop(recognition):
        return INAUDIBLE
    meanings = {_named_values(each.text) for each in recognition.hypotheses[:COMPARED]}
    doubtful = sum(map(_is_doubtful, recognition.words))
    if not doubtful or (not short and len(meanings) == 1 and 2 * doubtful <= len(recognition.words)):
        return recognition.text
    marked = (INAUDIBLE if _is_doubtful(word) else word.text for word in recognition.words)
    return " ".join(word for text, run in groupby(marked) for word in ([text] if text == INAUDIBLE else run))


def _named_values(text: str) -> frozenset[SlotValue]:
    return frozenset(value for value in guess_act(readable(text)).slots if value.label not in _UNNAMED)


def _may_be_stop(recognition: Recognition) -> bool:
    """Returns whether the best hypothesis has no action and another one is a stop."""
    meanings = [_named_values(each.text) for each in recognition.hypotheses]
    commands = any(isinstance(value, ActionValue) for values in meanings[:1] for value in values)
    return not commands and any(ActionValue.STOP in values for values in meanings[1:])


def _is_doubtful(word: RecognizedWord) -> bool:
    return word.confidence < DOUBTFUL and word.text not in _SLIGHT  # NaN is not below it


def understand_speech(
    recognition: Recognition,
    after: DialogueMove | None = None,
    allows: Callable[[DrivingPlan], bool] | None = None,
) -> SpokenUnderstanding:
    """Returns the interpretation of recognised speech.

    The act is that of the hypothesis that makes most sense, see `read_hypotheses`. Choosing the act with the largest
    share instead finds it less often, because acts without a name have more hypotheses.

    Args:
        recognition: result of a recogniser.
        after: last move of the other speaker if it awaits an answer, see `guess_act`.
        allows: whether the map has what a plan asks for; None if that is unknown.
    """
    if not recognition.hypotheses:
        return SpokenUnderstanding(text=INAUDIBLE, act=DialogueAct(DialogueMove.IRRELEVANT), confidence=0.0)
    shares: dict[DialogueAct, float] = defaultdict(float)
    steps: dict[PlanStep, float] = defaultdict(float)
    readings = [
        TextHypothesis(text=readable(hypothesis.text), weight=hypothesis.weight)
        for hypothesis in recognition.hypotheses
    ]
    for hypothesis in readings:
        words = hypothesis.text
        shares[guess_act(words, after)] += hypothesis.weight
        for step in dict.fromkeys(understand(words).plan):
            steps[step] += hypothesis.weight
    taken = read_hypotheses(readings, after, allows)
    text = taken.text
    act = guess_act(text, after)
    others = sorted(((each, share) for each, share in shares.items() if each != act), key=lambda each: -each[1])
    planned = tuple((step, steps[step]) for step in understand(text).plan)
    return SpokenUnderstanding(
        text=text, act=act, confidence=shares[act], alternatives=tuple(others), steps=planned, unsure=taken.unsure
    )
