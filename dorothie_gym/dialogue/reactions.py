"""Reactions by their words: corrections of what the other speaker has said, short answers, and remarks in passing."""

from __future__ import annotations

import functools
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.lexicon import read_data, strings, word_set
from dorothie_gym.errors import PhraseFileError
from dorothie_gym.ontology.dialogue_acts import DialogueMove

if TYPE_CHECKING:
    from dorothie_gym.dialogue.lexicon import YamlMapping
    from dorothie_gym.dialogue.nlu import ParsedText

_FILE: Final = "reactions.yaml"
_LONGEST_ANSWER: Final = 6


@dataclass(frozen=True, kw_only=True)
class _Reactions:
    """Contents of data/reactions.yaml; that file explains each list."""

    corrects_first: re.Pattern[str]
    corrects: re.Pattern[str]
    corrects_name: re.Pattern[str]
    insists: re.Pattern[str]
    denials: frozenset[str]
    negative: frozenset[str]
    praises: re.Pattern[str]
    in_passing: re.Pattern[str]
    says_missed: re.Pattern[str]
    greets: re.Pattern[str]


@functools.cache
def _reactions() -> _Reactions:
    data = read_data(_FILE)
    return _Reactions(
        corrects_first=_pattern(data, "corrects_first"),
        corrects=_pattern(data, "corrects"),
        corrects_name=_pattern(data, "corrects_name"),
        insists=_pattern(data, "insists"),
        denials=word_set(_FILE, data, "denials"),
        negative=word_set(_FILE, data, "negative"),
        praises=_pattern(data, "praises"),
        in_passing=_pattern(data, "in_passing"),
        says_missed=_pattern(data, "says_missed"),
        greets=_pattern(data, "greets"),
    )


def _pattern(data: YamlMapping, name: str) -> re.Pattern[str]:
    """Returns the pattern that fits if one of a list does."""
    listed = strings(f"{_FILE}: {name}", data.get(name))
    try:
        return re.compile("|".join(f"(?:{text})" for text in listed))
    except re.error as error:
        raise PhraseFileError(f"{_FILE}: {name}: {error}") from error


def denials() -> frozenset[str]:
    """Returns the words that deny what has been said."""
    return _reactions().denials


def short_answer(parsed: ParsedText) -> DialogueMove | None:
    """Returns the answer that few words give which name nothing: "it certainly is", "only if it's safe"."""
    words = [word for word in parsed.masked.split() if word != ","]
    if parsed.values or parsed.plan.steps or parsed.question or len(words) > _LONGEST_ANSWER:
        return None
    denied = any(word in _reactions().negative or word.endswith("n't") for word in words)
    return DialogueMove.REPLY_N if denied else DialogueMove.REPLY_Y


def insists(parsed: ParsedText) -> bool:
    """Returns whether a span says what has been said before."""
    named = bool(parsed.plan.steps or parsed.values)
    return not parsed.question and named and _reactions().insists.search(parsed.masked) is not None


def corrects(parsed: ParsedText) -> bool:
    """Returns whether a span sets right what the other speaker has announced: "no, I meant the second left"."""
    if parsed.question:
        return False
    reactions = _reactions()
    if reactions.corrects.search(parsed.masked) or reactions.corrects_first.match(parsed.masked):
        return True
    if not (parsed.plan.steps or parsed.values) or parsed.masked.startswith(("no thanks", "no thank you")):
        return False
    denied = not reactions.denials.isdisjoint(parsed.masked.split()[:3])
    return denied or reactions.corrects_name.search(parsed.masked) is not None


def is_praise(text: str) -> bool:
    """Returns whether a remark praises how the trip goes: "so far so good"."""
    return _reactions().praises.search(text.lower()) is not None


def is_in_passing(text: str) -> bool:
    """Returns whether a remark about the trip needs no answer: "that took a while"."""
    return _reactions().in_passing.search(text.lower()) is not None


def says_missed(text: str) -> bool:
    """Returns whether a statement says that the car has driven past the place: "you've gone past it"."""
    return _reactions().says_missed.search(text.lower()) is not None


def is_greeting(text: str) -> bool:
    """Returns whether a remark begins with a greeting: "good evening, driver"."""
    return _reactions().greets.match(text.lower()) is not None
