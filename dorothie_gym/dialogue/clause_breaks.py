"""Boundaries of clauses in speech without marks, as recognisers and hurried writers leave it.

"turn left here it's the second house" has two clauses. A comma is put where a clause begins by its form: a subject
with its finite verb, an imperative with what belongs to it, a verb before its subject, or words that take something
back. The other readers of this package then see the same boundaries as in punctuated text.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from dorothie_gym.dialogue.lexicon import plain_word, read_data, word_set
from dorothie_gym.dialogue.route_grammar import Match, PhraseIndex, phrase_index, route_grammar

_FILE: Final = "clause_breaks.yaml"
_MARKS: Final = (",", ".", "?", "!", ";", ":", "\u2026", "\u2014", "\u2013", "-")
_OPENS: Final = frozenset({"and", "so", "but", "then", "now", "well", "oh", "okay", "ok", "please", "just", "yeah"})
"""Words that are no clause yet, however many of them open one."""

_AGREED: Final = frozenset({"right", "correct"})
"""Last words that ask whether a statement is right."""

_TELLING: Final = frozenset(
    {
        "it's",
        "that's",
        "you're",
        "we're",
        "this is",
        "that is",
        "it is",
        "you mean",
        "you meant",
        "you said",
        "you want",
    }
)
_DIRECTING: Final = frozenset(
    {
        "the",
        "a",
        "next",
        "on",
        "your",
        "my",
        "our",
        "first",
        "second",
        "third",
        "to",
        "other",
        "hard",
        "then",
        "and",
        "turn",
    }
)
"""Words behind which "right" is a direction."""

_YES_AND_NO: Final = frozenset({"yes", "yeah", "yep", "yup", "aye", "no", "nope", "nah", "naw"})
_ALSO_PREPOSITIONS: Final = frozenset({"after", "before", "since", "until", "till", "as"})
_POSSESSIVE: Final = frozenset({"my", "our", "his", "her", "their"})
_POINTING: Final = frozenset({"this", "that", "these", "those"})
_BEING: Final = (["is"], ["isn't"], ["are"], ["was"], ["has"])
_PREDICATES: Final = frozenset(
    {
        "a",
        "not",
        "so",
        "very",
        "on",
        "in",
        "at",
        "here",
        "there",
        "late",
        "sick",
        "asleep",
        "just",
        "still",
        "gone",
        "too",
    }
)
"""Words behind a subject with a contracted "is"."""

_ENDS: Final = {"subject": ("please",), "repair": ("second", "moment"), "order": ("second", "minute", "moment")}
"""Words that join most clauses to what stands before, but none of a kind: "stop please, I feel sick"."""

_DRIVING: Final = (["we"], ["you"])
_MODALS: Final = (["should"], ["could"], ["can"], ["need"], ["must"], ["better"], ["might"])
_BEFORE_ORDERS: Final = {
    "just": ("order",),
    "please": ("order",),
    "so": ("order", "question"),
}
"""Words in front of an order that belong to it, with the kinds of starts behind them."""

_BEHIND_TURNS: Final = (["at"], ["on"], ["onto"], ["into"], ["after"], ["past"], ["before"], ["here"], ["there"])
"""Words behind a direction that orders a turn: "no right at the bridge"."""

_LETTING: Final = frozenset({"let", "letting"})
_PASSING: Final = frozenset({"go", "pass", "cross"})

_REQUESTING: Final = frozenset({"would", "could", "can", "will", "won't"})

_PERSONAL: Final = frozenset(
    {"i", "we", "you", "he", "she", "they", "i'm", "we're", "you're", "i've", "we've", "he's", "what's"}
)


@dataclass(frozen=True)
class _Breaks:
    """Contents of data/clause_breaks.yaml; that file explains each list."""

    starts: PhraseIndex
    tags: PhraseIndex
    answers: PhraseIndex
    phrases: PhraseIndex
    joining: frozenset[str]
    antecedents: frozenset[str]
    subordinate: frozenset[str]


@functools.cache
def _breaks() -> _Breaks:
    data = read_data(_FILE)
    return _Breaks(
        starts=phrase_index(_FILE, data, "starts", adverbs=False),
        tags=phrase_index(_FILE, data, "tags", adverbs=False),
        answers=phrase_index(_FILE, data, "answers", adverbs=False),
        phrases=phrase_index(_FILE, data, "phrases", adverbs=False),
        joining=word_set(_FILE, data, "joining"),
        antecedents=word_set(_FILE, data, "antecedents"),
        subordinate=word_set(_FILE, data, "subordinate"),
    )


@functools.lru_cache(maxsize=4096)
def with_breaks(text: str, *, answering: bool = True) -> str:
    """Returns a text with commas between clauses that no mark separates; words and their number stay the same.

    Args:
        text: free English; may be empty.
        answering: whether an initial "yes" or "no" can be an answer, and has a comma behind it.
    """
    raw = text.split()
    if len(raw) < 3:
        return text
    words = [plain_word(word) for word in raw]
    if not answering and words[0] not in _YES_AND_NO:
        return with_breaks(text)
    begin, behind = 0, _behind_answer(words, 0)
    changed = False
    for place in range(1, len(raw)):
        if raw[place - 1].endswith(_MARKS):
            begin, behind = place, _behind_answer(words, place)
        elif place != behind and not _may_begin_clause(words[place]):
            continue
        elif _begins_clause(words, begin, place) and (answering or begin):
            raw[place - 1] += ","
            begin, behind, changed = place, _behind_answer(words, place), True
    if raw[-1][-1] not in _MARKS and _asks_for_agreement(words):
        raw[-2] = raw[-2] if words[-1] not in _AGREED or raw[-2].endswith(_MARKS) else f"{raw[-2]},"
        raw[-1] += "?"
        changed = True
    return " ".join(raw) if changed else text


def _behind_answer(words: Sequence[str], begin: int) -> int:
    """Returns the place behind the answer or sign at a place; -1 if there is none."""
    answer = _breaks().answers.longest(words, begin)
    return -1 if answer is None else begin + answer.length


@functools.lru_cache(maxsize=4096)
def _may_begin_clause(word: str) -> bool:
    """Returns whether a clause that follows no answer may begin with a word."""
    starts = _breaks().starts.may_begin(word) or _breaks().tags.may_begin(word)
    return starts or word in _POSSESSIVE or word in _POINTING or word in _BEFORE_ORDERS


def _begins_clause(words: Sequence[str], begin: int, place: int) -> bool:
    """Returns whether a clause begins at a place of the words, behind the one that began at `begin`."""
    breaks = _breaks()
    if place == _behind_answer(words, begin):
        return _answered(words, begin, place)
    found = breaks.starts.longest(words, place)
    if found is None and _has_subject(words, place):
        found = Match("starts", "subject", 1)
    if words[place] == "so" and words[place + 1 : place + 2] in _DRIVING and words[place + 2 : place + 3] in _MODALS:
        found = Match("starts", "order", 1)  # "it's closed, so we should turn around"
    if words[place] in _BEFORE_ORDERS and place + 1 < len(words) and found is None:
        found = breaks.starts.longest(words, place + 1)  # "that's grand, just let me hop out"
        found = found if found is not None and found.kind in _BEFORE_ORDERS[words[place]] else None
    if (found is None and not _ends_in_tag(words, place)) or _is_no_clause(words, place):
        return False
    before = words[place - 1]
    joined = before in breaks.joining and (found is None or before not in _ENDS.get(found.kind, ()))
    ordering = found is not None and found.kind == "order" and words[place] == "stop"
    if joined or (breaks.phrases.longest(words, place) is not None and not ordering):
        return False
    head = words[begin:place]
    if len(head) < 2 or all(word in _OPENS for word in head):
        return False
    if found is None:
        return True
    if found.kind in ("order", "question") and _is_subordinate(head):
        return False
    if found.kind == "subject" and head[0] == "if":
        return False
    return not (words[place] in _PERSONAL and before in breaks.antecedents)


def _is_no_clause(words: Sequence[str], place: int) -> bool:
    """Returns whether a verb begins no clause: "a left turn at the corner", "let this one go by", "Beal it is"."""
    if list(words[place:]) == ["it", "is"]:
        return True
    noun = words[place] == "turn" and words[place - 1] in ("left", "right", "u")
    return noun or (words[place] in _PASSING and not _LETTING.isdisjoint(words[max(place - 5, 0) : place]))


def _has_subject(words: Sequence[str], place: int) -> bool:
    """Returns whether somebody or something of the speaker's does something: "my mum's waiting"."""
    if words[place] in _POINTING and words[place + 2 : place + 3] in _BEING:
        return True  # "this truck is crawling"
    if words[place] not in _POSSESSIVE:
        return False
    noun, verb = words[place + 1 : place + 2], words[place + 2 : place + 3]
    if verb and verb[0] in route_grammar().finite:
        return True
    contracted = bool(noun) and noun[0].endswith("'s")
    return contracted and bool(verb) and (verb[0].endswith("ing") or verb[0] in _PREDICATES)


def _is_subordinate(head: Sequence[str]) -> bool:
    """Returns whether a clause depends on the one to come: "when you see the KFC"."""
    subordinate = _breaks().subordinate
    last = max((place for place, word in enumerate(head) if word in ("so", "but")), default=-1)
    return not subordinate.isdisjoint(head[:2]) or not (subordinate - _ALSO_PREPOSITIONS).isdisjoint(head[last + 1 :])


def _asks_for_agreement(words: Sequence[str]) -> bool:
    """Returns whether a statement ends in a tag: "you're going down Beal, aren't you", "this is Fuller, right"."""
    if words[-1] in _AGREED:
        if words[-2] in _DIRECTING or words[-2].endswith("ing"):
            return False
        return words[0] in _TELLING or " ".join(words[:2]) in _TELLING
    places = (place for place in (len(words) - 2, len(words) - 3) if place > 1 and _ends_in_tag(words, place))
    return any(words[place] not in _REQUESTING and not _orders(words[:place]) for place in places)


def _orders(words: Sequence[str]) -> bool:
    """Returns whether words order something by their first ones: "you take a right, isn't it" asks nothing."""
    opening = route_grammar().openers.longest(words, 0)
    if opening is not None and opening.kind != "soft":
        return opening.kind == "request"
    begins = route_grammar().terminals.longest(words, 0)
    ordered = words[0] == "you" and words[1:2] != [] and route_grammar().terminals.longest(words, 1) is not None
    return begins is not None or ordered


def _ends_in_tag(words: Sequence[str], place: int) -> bool:
    """Returns whether nothing but a tag stands at a place: "aren't you"."""
    found = _breaks().tags.longest(words, place)
    if words[place - 1] in ("that", "this", "what", "where", "it", "here", "there") and words[place] == "is":
        return False  # "that is it"
    return found is not None and place + found.length == len(words)


def _answered(words: Sequence[str], begin: int, place: int) -> bool:
    """Returns whether a clause of its own follows an answer or a sign: "no don't stop"."""
    breaks = _breaks()
    known = breaks.phrases.longest(words, begin)
    if known is not None and known.length > place - begin:
        return False
    turns = words[place] in ("left", "right") and words[place + 1 : place + 2] in _BEHIND_TURNS
    return turns or breaks.starts.longest(words, place) is not None
