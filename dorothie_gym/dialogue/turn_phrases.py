"""Forms of orders that differ in words only, put into one form before they are read.

"Hang a quick left down Fuller", "give me your next easy right turn" and "do a left into Beal" order one turn each. The
manner of the turn, a verb without meaning of its own and the preposition of its street are put into a plain form, as
are the subjunctives behind "if you".
"""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Final

from dorothie_gym.dialogue.lexicon import load_lexicon
from dorothie_gym.dialogue.numerals import read_ordinal
from dorothie_gym.ontology.slots import StreetName

_SIDES: Final = frozenset({"left", "right"})
_NOUNS: Final = frozenset({"turn", "turning", "turnoff", "hander", "one"})
_ARTICLES: Final = frozenset({"a", "an", "the", "your", "our", "my", "that", "this", "another", "one"})
_COUNTING: Final = frozenset({"next", "first", "following", "last", "other"})

_OTHER_NOUNS: Final = frozenset({"lane", "lanes", "side", "hand", "kerb", "curb", "thing", "way", "place", "signal"})
"""Nouns behind left and right that are no turns."""

_MANNERS: Final = frozenset(
    {
        "quick", "sharp", "hard", "easy", "gentle", "smooth", "nice", "slight", "tight", "little", "small", "big",
        "wide", "proper", "soft", "swift", "sudden", "full", "clean", "cheeky", "wee", "careful", "steady", "lazy",
        "sweeping", "long", "short", "lovely", "good", "old", "easy-peasy", "legal", "safe", "simple", "shallow",
        "immediate",
    }
)  # fmt: skip
"""Adjectives that tell how a turn is, and not which."""

_VERBS: Final[tuple[tuple[str, ...], ...]] = (
    ("hang", "us"), ("give", "me"), ("give", "us"), ("do", "me"), ("do", "us"), ("get", "us"), ("grab", "us"),
    ("hang",), ("do",), ("bang",), ("pull",), ("throw",), ("chuck",), ("hit",), ("catch",), ("bust",), ("whip",),
    ("execute",), ("perform",), ("pop",), ("snag",), ("nab",),
)  # fmt: skip
"""Verbs that order a turn with the noun behind them, and say nothing else of it."""

_ALONG: Final = frozenset({"down", "up", "along"})
"""Prepositions that behind a turn mean that it leads into the street."""

_EXACTLY: Final = frozenset({"after", "before", "past", "behind", "beyond"})
"""Prepositions in front of which "right" may be "directly"."""

_CLAUSE_STARTS: Final = frozenset({",", "and", "then", "but", "so", "okay", "ok", "well", "now"})
_IRREALIS: Final = (["if"], ["rather"], ["sooner"], ["wish"], ["prefer"])
"""Words behind which the past of a verb is a wish: "if you kept to the limit", "I'd rather you took Beal"."""

_ADDRESSED: Final = frozenset({"you", "we", "ye", "ya"})
_PRESENT: Final[Mapping[str, str]] = MappingProxyType(
    {
        "kept": "keep", "took": "take", "went": "go", "drove": "drive", "got": "get", "put": "put", "let": "let",
        "made": "make", "did": "do", "came": "come", "swung": "swing", "hung": "hang", "held": "hold", "sped": "speed",
        "stuck": "stick", "brought": "bring", "gave": "give", "ran": "run", "stood": "stand", "cut": "cut",
        "slowed": "slow", "stopped": "stop", "turned": "turn", "pulled": "pull", "parked": "park", "dropped": "drop",
        "picked": "pick", "followed": "follow", "stayed": "stay", "waited": "wait", "headed": "head", "used": "use",
        "avoided": "avoid", "crossed": "cross", "passed": "pass", "changed": "change", "switched": "switch",
        "moved": "move", "eased": "ease", "skipped": "skip", "tried": "try", "carried": "carry",
        "continued": "continue",
        "started": "start", "hurried": "hurry", "merged": "merge", "backed": "back", "collected": "collect",
    }
)  # fmt: skip
"""Present of the verbs of driving by their past."""


def plain_orders(words: Sequence[str]) -> list[str]:
    """Returns the words with turns in their plain form, and wishes in the past in the present.

    Args:
        words: lower-case tokens.
    """
    found = _in_present(words)
    if _SIDES.isdisjoint(found):
        return found
    found = _without_directly(found)
    place = 0
    while place < len(found):
        if found[place] in _ARTICLES or read_ordinal(found[place]) is not None or found[place] in _COUNTING:
            place = _plain_turn(found, place)
        elif found[place] in _SIDES:
            _plain_street(found, place)
        place += 1
    return found


def _in_present(words: Sequence[str]) -> list[str]:
    found = list(words)
    for place in range(2, len(found)):
        verb = place
        if found[place] in ("just", "maybe", "simply", "please"):
            continue
        before = place - 1 - (found[place - 1] in ("just", "maybe", "simply", "please"))
        wished = found[before] in _ADDRESSED and [*found[max(before - 1, 0) : before]] in _IRREALIS
        if wished and found[verb] in _PRESENT:
            found[verb] = _PRESENT[found[verb]]
    return found


def _plain_turn(words: list[str], place: int) -> int:
    """Puts the turn whose article or number is at a place into its plain form; returns the last token of it."""
    end = place
    while end < len(words) and (
        words[end] in _ARTICLES or words[end] in _COUNTING or read_ordinal(words[end]) is not None
    ):
        end += 1
    side = end
    while side < len(words) and words[side] in _MANNERS:
        side += 1
    if side >= len(words) or words[side] not in _SIDES or (words[place] in ("that", "this") and end == side == place):
        return place
    if words[side + 1 : side + 2] and words[side + 1] in _OTHER_NOUNS:
        return place
    del words[end:side]
    for verb in _VERBS:
        if tuple(words[max(place - len(verb), 0) : place]) == verb and place >= len(verb):
            words[place - len(verb) : place] = ["take"]
            end += 1 - len(verb)
            break
    _plain_street(words, end)
    return end


def _plain_street(words: list[str], side: int) -> None:
    """Lets the street that a turn leads into follow "onto": "left down Fuller"."""
    behind = side + 1 + (words[side + 1 : side + 2] != [] and words[side + 1] in _NOUNS)
    if words[behind : behind + 1] == [] or words[behind] not in _ALONG:
        return
    street = behind + 1
    if street < len(words) and words[street] in _streets():
        words[behind] = "onto"


@functools.cache
def _streets() -> frozenset[str]:
    """Returns the first words of the names of streets."""
    names = load_lexicon().names
    return frozenset(name[0] for name, value in names.items() if isinstance(value, StreetName))


def _without_directly(words: list[str]) -> list[str]:
    """Returns the words without a "right" that means "directly": "right after the lights, turn left"."""
    for place, word in enumerate(words[:-1]):
        opens = place == 0 or words[place - 1] in _CLAUSE_STARTS
        if word == "right" and opens and words[place + 1] in _EXACTLY and _orders_later(words, place + 3):
            return [*words[:place], *_without_directly(words[place + 1 :])]
    return words


def _orders_later(words: Sequence[str], place: int) -> bool:
    """Returns whether another turn or another order follows in the words behind a place."""
    return any(word in _SIDES or word in _ORDERING for word in words[place:])


_ORDERING: Final = frozenset(
    {
        "turn", "stop", "pull", "slow", "take", "make", "hang", "park", "go", "keep", "drop", "let", "switch", "change",
        "get", "move", "merge", "drive", "follow", "head", "speed", "swing", "u",
    }
)  # fmt: skip
"""First words of orders."""
