"""Parser of route directions: turns with their ordinals; separates "right" and "left" from other senses."""

from __future__ import annotations

import functools
import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.lexicon import read_data, strings
from dorothie_gym.dialogue.numerals import read_ordinal
from dorothie_gym.errors import PhraseFileError

_BACK = re.compile(
    r"\bu turn|\b(go|going|head|heading) back\b|\b(turn|turning|come|coming) (back|a?round)\b|\bthe other way\b"
    r"|\b(doubl(e|ing)|turning|driving) back\b|\bflip(ping)? around\b|\bturn(ing)? the car around\b"
)
_AFTER_NEXT = re.compile(r"\b(the one after|one after the next|after next)\b")
_RIGHT_OPENS = frozenset({"you", "so", "well", "ho", "i"})
"""Words after which an initial "right" is not a direction: "right you are"."""

_DOUBT = frozenset({"sure", "know", "certain", "idea", "clue", "wonder"})
_CLAUSE_ENDS = frozenset({",", "?", "then", "and"})
_SAYS = frozenset({"it's", "that's"})
_ENDS = frozenset(
    {"", ",", "then", "and", "at", "again", "here", "now", "there", "please", "up", "next", "onto", "into", "out"}
)
"""Words behind "it's left" where it is a direction."""

_TAKING = frozenset({
    "take", "taking", "make", "want", "need", "grab", "do", "get", "catch", "miss", "hang", "use",
    "whip", "swing", "cut", "bring", "pull", "hook", "chuck", "steer", "turn", "throw", "bang", "spin",
    "not", "skip", "ignore",
})  # fmt: skip
"""Words behind which "this right" is a turn."""

_TELLING = (["is"], ["are"], ["that's"], ["there's"], ["it's"])
"""First words behind which a last "right" is no direction: "that's the KFC, right"."""

_BESIDE = frozenset({"by", "beside", "opposite", "outside"})
"""Words in front of which "right" may be "exactly", where a side has been told."""

_SIDED = frozenset({"lane", "hand", "turning", "side", "kerb", "curb"})
"""Words behind "right" that make it a direction wherever it stands: "to that right lane"."""

_LISTED = frozenset({"left", "right", "lefts", "rights"})
"""Words of which "right, then ..." needs one to begin a list of turns."""

_KEEPING = frozenset(
    {"keep", "keeping", "stay", "staying", "move", "moving", "stick", "sit", "hold", "wait", "park", "stop"}
)
_PLACED = frozenset(
    ["on", "along", "behind", "where", "here", "there", "up", "past", "by", "beside", "next", "outside", "opposite"]
)
"""Words behind a "right" that only stresses them."""

_HEADING = frozenset({"go", "going", "drive", "driving", "head", "heading", "come", "get"})
_ONWARDS = frozenset({"to", "home", "back", "through"})
"""Words behind a "right" that means "directly": "go right home"."""

_TURNING_WORDS = frozenset({"left", "right", "straight", "turn", "turning", "back", "around", "way", "round"})


@dataclass(frozen=True, kw_only=True)
class RouteTurn:
    """One turn of a route description.

    Attributes:
        direction: direction of the turn.
        ordinal: number of the opportunity (1 is the next), None if not given.
    """

    direction: Direction
    ordinal: int | None = None


@dataclass(frozen=True)
class WordLists:
    """Word lists of data/cues.yaml; that file explains each list."""

    turning: frozenset[str]
    right_not_before: frozenset[str]
    right_never_before: frozenset[str]
    right_not_after: frozenset[str]
    left_not_after: frozenset[str]
    ordinal_nouns: frozenset[str]
    dropping: frozenset[str]
    affirming: frozenset[str]
    denying: frozenset[str]
    vocatives: frozenset[str]
    addressing: frozenset[str]


@functools.cache
def word_lists() -> WordLists:
    """Returns the cached word lists; raises PhraseFileError if a list is missing or malformed."""
    data = read_data("cues.yaml")
    lists = {
        **data.get("directions", {}),
        **{
            name: data.get(name)
            for name in ("ordinal_nouns", "dropping", "affirming", "denying", "vocatives", "addressing")
        },
    }
    if lists.keys() != WordLists.__dataclass_fields__.keys():
        raise PhraseFileError(
            f"cues.yaml: needs the word lists {sorted(WordLists.__dataclass_fields__)}, has {sorted(lists)}"
        )
    return WordLists(**{name: frozenset(strings(f"cues.yaml: {name}", words)) for name, words in lists.items()})


def mask_directions(words: Sequence[str], lists: WordLists) -> list[str]:
    """Returns the words with each non-directional "left" or "right" replaced by "#left", "#ok" or "#tag"."""
    masked = list(words)
    for place, word in enumerate(words):
        before = words[place - 1] if place else ","
        after = words[place + 1] if place + 1 < len(words) else ""
        if word == "right":
            following = words[place + 2] if place + 2 < len(words) else ""
            listed = (
                place == 0
                and after == ","
                and (following in _LISTED or (following == "then" and not _LISTED.isdisjoint(words[3:6])))
            )
            taken = (
                before in ("this", "that", "it", "her") and words[place - 2 : place - 1] and words[place - 2] in _TAKING
            )
            if before == "," and after in ("", "?") and _is_told(words[: place - 1]):
                masked[place] = "#ok"  # "the KFC, right"
                continue
            if before in _HEADING and after in _ONWARDS:
                masked[place] = "#ok"  # "go right to the KFC"
                continue
            if before == "," and after in _BESIDE and not _LISTED.isdisjoint(words[:place]):
                masked[place] = "#ok"  # "stop on the left, right by the KFC"
                continue
            taken = taken or (before == "you" and list(words[place - 2 : place - 1]) == ["told"])
            direct = listed or (taken and after not in lists.right_never_before | lists.right_not_before)
            masked[place] = "right" if direct else _right(before, after, following, place, lists)
        elif word == "left" and before in lists.left_not_after and not (before in _SAYS and after in _ENDS):
            masked[place] = "#left"
        elif word == "left" and (list(words[place + 1 : place + 3]) == ["to", "do"] or _remains(words, place)):
            masked[place] = "#left"
        elif word == "straight" and after == "away":
            masked[place] = "#ok"
    return masked


def _is_told(words: Sequence[str]) -> bool:
    """Returns whether words before ", right" only name a landmark, or tell or ask something."""
    named = words[-1:] == ["#landmark"] and len(words) <= 2 and (len(words) == 1 or words[0] in ("the", "a"))
    return named or words[:1] in _TELLING or words[:2] in (["oh", "is"], ["ah", "is"])


def _remains(words: Sequence[str], place: int) -> bool:
    """Returns whether something is left over: "there's still the KFC left"."""
    return place == len(words) - 1 and "still" in words[:place]


def _right(before: str, after: str, following: str, place: int, lists: WordLists) -> str:
    if after in _SIDED and following != "?":
        return "right"
    if before in _KEEPING and after in _PLACED:
        return "#ok"  # "stay right where you are"
    if after == "?" and place > 0 and before != "all" and (before == "," or before not in lists.turning):
        return "#tag"
    if after == "now" and before in ("going", "driving", "doing"):
        return "#ok"  # "how fast are you going right now"
    if before in lists.right_not_after or after in lists.right_never_before or (place == 0 and after == ","):
        return "#ok"
    if place == 0 and (after in _RIGHT_OPENS or (after == "then" and following in (",", ""))):
        return "#ok"
    turning = before in lists.turning and (before != "," or place == 0)
    return "#ok" if after in lists.right_not_before and not turning else "right"


def find_turns(words: Sequence[str], lists: WordLists) -> tuple[RouteTurn, ...]:
    """Returns the turns in masked words (see `mask_directions`), in order, each with the ordinal of its clause."""
    if _TURNING_WORDS.isdisjoint(words):
        return ()
    turns: list[RouteTurn] = []
    waiting: int | None = None  # an ordinal before its direction: "the second one, on the left"
    for clause in _clauses(words):
        ordinal = find_ordinal(clause, lists)
        directions = _directions(clause, lists)
        for number, direction in enumerate(directions):
            turns.append(RouteTurn(direction=direction, ordinal=(ordinal or waiting) if number == 0 else None))
            waiting = None
        if not directions and ordinal is not None:
            if turns and turns[-1].ordinal is None:
                turns[-1] = RouteTurn(direction=turns[-1].direction, ordinal=ordinal)
            else:
                waiting = ordinal
    return tuple(turns)


def _directions(clause: Sequence[str], lists: WordLists) -> list[Direction]:
    directions = [
        Direction(word)
        for place, word in enumerate(clause)
        if word in ("left", "right", "straight") and not _is_denied(clause[max(0, place - 5) : place], lists)
    ]
    return [Direction.BACK] if not directions and _BACK.search(" ".join(clause)) else directions


def _is_denied(before: Sequence[str], lists: WordLists) -> bool:
    """Returns whether the preceding words negate a direction ("not right"); doubt is not a negation."""
    return _DOUBT.isdisjoint(before) and not lists.denying.isdisjoint(before)


def _clauses(words: Sequence[str]) -> list[list[str]]:
    clauses: list[list[str]] = [[]]
    for word in words:
        if word in _CLAUSE_ENDS:
            clauses.append([])
        else:
            clauses[-1].append(word)
    return [clause for clause in clauses if clause]


def find_ordinal(words: Sequence[str], lists: WordLists) -> int | None:
    """Returns the ordinal in the words ("the second light"), 1 for the next opportunity, or None."""
    if _AFTER_NEXT.search(" ".join(words)):
        return 2
    for word, noun in itertools.pairwise(words):
        number = read_ordinal(word)
        if number is not None and noun in lists.ordinal_nouns:
            return number
    return None
