"""Reading of several hypotheses of a recogniser: the one that makes most sense is taken, unsure names are reported.

A recogniser ranks its hypotheses by sound and by short sequences of words. What they say tells more: "turn lift at the
KFC" orders nothing, and where the map has no right turn, "turn right" was probably "turn left". The hypotheses are
ranked again by their weight and by the plausibility of their meaning, as in the rescoring of n-best lists (Rayner et
al., Combining knowledge sources to reorder n-best speech hypothesis lists, HLT 1994).
"""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Protocol

from dorothie_gym.dialogue.conversation import INAUDIBLE, Span
from dorothie_gym.dialogue.dialogue_act_classifier import guess_spans
from dorothie_gym.dialogue.entity_recognition import find_names
from dorothie_gym.dialogue.lexicon import split_words
from dorothie_gym.dialogue.nlu import understand
from dorothie_gym.dialogue.routes import DrivingPlan
from dorothie_gym.dialogue.word_pairs import unusual_pairs
from dorothie_gym.ontology.slots import Slot, SlotValue
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.copying import shared

if TYPE_CHECKING:
    from dorothie_gym.ontology.dialogue_acts import DialogueMove

MOST: Final = 5
"""Number of hypotheses that are compared."""

UNSURE: Final = 0.5
"""Share of the hypotheses, by weight, up to which a name of the best one is unsure."""

_UNUSUAL: Final = 1.3
_VALUE: Final = 0.7
_PLAN: Final = 0.8
_DETAIL: Final = 0.2
"""Weights of unusual pairs of words, named values, having a plan at all, and the fields of its steps, against the
logarithm of a hypothesis's weight. They are those of a softmax regression on 720 sentences of invented passengers,
with 20 % word errors, that are in none of the tests."""

_FORBIDDEN: Final = 4.0
"""Loss of a plan that the map does not allow."""

_LONGEST_NAME: Final = 4
"""Words of the longest name."""

_LEAST_WEIGHT: Final = 1e-9
_PROPER: Final = frozenset({Slot.LANDMARK, Slot.STREET})


class Hypothesis(Protocol):
    """Possible words of an utterance, with their share of the probability of all hypotheses."""

    @property
    def text(self) -> str:
        """The words."""
        ...

    @property
    def weight(self) -> float:
        """The share, in [0, 1]."""
        ...


@shared
@dataclass(frozen=True, kw_only=True)
class TextHypothesis:
    """Possible words of an utterance.

    Attributes:
        text: the words.
        weight: share of the probability of all hypotheses, in [0, 1].
    """

    text: str
    weight: float


@shared
@dataclass(frozen=True, kw_only=True)
class HypothesisReading:
    """Meaning of recognised words.

    Attributes:
        text: words of the hypothesis that is taken.
        spans: its acts.
        plan: steps that it orders.
        confidence: share of the hypotheses, by weight, with the same first move and the same values.
        unsure: landmarks and streets of the reading that are missing in most hypotheses, by weight.
    """

    text: str
    spans: tuple[Span, ...]
    plan: DrivingPlan
    confidence: float
    unsure: tuple[SlotValue, ...] = ()


def nbest(choices: Sequence[Sequence[tuple[str, float]]]) -> tuple[TextHypothesis, ...]:
    """Returns the most probable sequences of words, the first choice of each word first.

    Args:
        choices: what each word may be, with probabilities; "" for no word.

    Returns:
        Up to `MOST` hypotheses, whose weights sum to 1; none without words.
    """
    firsts = [options[0] for options in choices]
    others = [
        (pm.log(max(second[1], 1e-6) / max(options[0][1], 1e-6)), place, second[0])
        for place, options in enumerate(choices)
        for second in options[1:]
    ]
    changed: list[tuple[float, tuple[tuple[int, str], ...]]] = [(0.0, ())]
    best = heapq.nlargest(MOST, others)
    for number in (1, 2):
        for combination in itertools.combinations(best, number):
            swaps = tuple((place, word) for _, place, word in combination)
            if len({place for place, _ in swaps}) == number:
                changed.append((sum(gain for gain, _, _ in combination), swaps))
    found: dict[str, float] = {}
    ranked = [changed[0], *sorted(changed[1:], key=lambda each: -each[0])]
    for gain, swaps in ranked:
        words = [word for word, _ in firsts]
        for place, word in swaps:
            words[place] = word
        text = " ".join(word for word in words if word)
        if text and text not in found:
            found[text] = pm.exp(min(gain, 0.0))
        if len(found) == MOST:
            break
    total = sum(found.values())
    return tuple(TextHypothesis(text=text, weight=weight / total) for text, weight in found.items())


def read_hypotheses(
    hypotheses: Sequence[Hypothesis],
    after: DialogueMove | None = None,
    allows: Callable[[DrivingPlan], bool] | None = None,
) -> HypothesisReading:
    """Returns the meaning of an utterance by the hypotheses of its recogniser.

    Args:
        hypotheses: the hypotheses, the most probable first.
        after: last move of the other speaker if it awaits an answer, see `guess_spans`.
        allows: whether the map has what a plan asks for; None if that is unknown.

    Raises:
        ValueError: there are no hypotheses.
    """
    if not hypotheses:
        raise ValueError("read_hypotheses needs at least one hypothesis")
    readings = [(each, guess_spans(each.text, after)) for each in hypotheses[:MOST]]
    best = max(range(len(readings)), key=lambda number: _score(*readings[number], allows))
    taken, spans = readings[best]
    total = sum(each.weight for each, _ in readings) or 1.0
    meaning = _meaning(spans)
    same = sum(each.weight for each, found in readings if _meaning(found) == meaning)
    return HypothesisReading(
        text=taken.text,
        spans=spans,
        plan=understand(taken.text).plan,
        confidence=same / total,
        unsure=tuple(
            value
            for value in sorted(meaning[1], key=lambda value: (value.slot.label, value.label))
            if value.slot in _PROPER
            and sum(each.weight for each, found in readings if value in _meaning(found)[1]) <= UNSURE * total
        ),
    )


def with_unsure_names(reading: HypothesisReading) -> str:
    """Returns the text of a reading with `INAUDIBLE` in place of its unsure names, as listeners ask for them."""
    words, place = reading.text.split(), 0
    if not reading.unsure:
        return reading.text
    kept: list[str] = []
    while place < len(words):
        longest = min(_LONGEST_NAME, len(words) - place)
        length = next((n for n in range(longest, 0, -1) if _is_name(words[place : place + n], reading.unsure)), 0)
        if length:
            mark = words[place + length - 1][-1]
            kept.append(INAUDIBLE + (mark if mark in ",?" else ""))
        else:
            kept.append(words[place])
        place += length or 1
    return " ".join(kept)


def _is_name(words: Sequence[str], values: Sequence[SlotValue]) -> bool:
    """Returns whether words are nothing but a name of one of some values; a last mark belongs to no longer name."""
    if any(word[-1] in ".,?!" for word in words[:-1]):
        return False
    mentions, masked = find_names(split_words(" ".join(words)))
    said = [word for word in masked if word not in (",", "?")]
    return len(said) == 1 and len(mentions) == 1 and mentions[0].value in values


def _meaning(spans: Sequence[Span]) -> tuple[DialogueMove | None, frozenset[SlotValue]]:
    """Returns the first move and all values."""
    return spans[0].act.move if spans else None, frozenset(value for span in spans for value in span.act.slots)


def _score(hypothesis: Hypothesis, spans: Sequence[Span], allows: Callable[[DrivingPlan], bool] | None) -> float:
    """Returns how probable a hypothesis is by its sound and by what it says, as a logarithm up to a constant."""
    plan = understand(hypothesis.text).plan
    score = pm.log(max(hypothesis.weight, _LEAST_WEIGHT)) - _UNUSUAL * unusual_pairs(hypothesis.text)
    score += _VALUE * sum(len(span.act.slots) for span in spans) + _PLAN * bool(plan.steps)
    score += _DETAIL * sum(len(step.to_json()) for step in plan)
    return score if allows is None or not plan.steps or allows(plan) else score - _FORBIDDEN
