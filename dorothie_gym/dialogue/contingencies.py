"""Conditions of the world: clauses such as "if the road is blocked", whose truth no place of the road settles.

A step that depends on such a condition must not be carried out at once. Conditions that are mere politeness ("if you
can", "when it's safe") and those that name a place ("when you see the KFC") are none.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from dorothie_gym.dialogue.route_grammar import RouteGrammar

_DOING: Final = frozenset({"actions", "verbs", "lights"})
"""Groups of the grammar that begin what is to be done."""

_OTHERS: Final = frozenset(
    {"it", "it's", "there", "there's", "that", "that's", "he", "she", "they", "anyone", "anybody"}
)
"""Subjects that are neither the speaker nor the driver."""

_SPEAKERS: Final = frozenset({"i", "i'm", "i've", "you", "you're", "we", "we're", "we've"})
_GOVERNING: Final = frozenset({"to", "the", "a", "an", "that", "still", "not", "don't", "can", "can't", "will", "must"})
"""Words behind which a verb belongs to the clause that they are in."""

_NO_VERBS: Final = frozenset(
    ["to", "down", "along", "up", "on", "off", "back", "over", "be", "have", "right", "need", "want", "clear", "in"]
)
"""First words of actions that as well end the clause before them."""

_WISHING: Final = frozenset(["be", "help", "helps", "mind", "appreciate", "grateful", "love", "like", "ask", "what"])
"""Words behind which "if" begins what is wished for."""

_NEAR: Final = 4
_LONGEST: Final = 12
"""Words of the longest clause of a condition."""


class Contingency(NamedTuple):
    """Clause of a condition.

    Attributes:
        end: token behind it.
        leading: whether what depends on it comes behind it, rather than before.
    """

    end: int
    leading: bool


def find_contingency(words: Sequence[str], place: int, grammar: RouteGrammar) -> Contingency | None:
    """Returns the condition of the world that begins at a token; None if there is none.

    Args:
        words: tokens with masked names and directions.
        place: the token.
        grammar: phrases of route talk.
    """
    match = grammar.contingencies.longest(words, place)
    if match is None or match.kind in ("polite", "events"):
        return None
    if match.kind == "open" and not _WISHING.isdisjoint(words[max(place - _NEAR, 0) : place]):
        return None  # "it would be lovely if this went slower"
    begin = place + match.length
    if match.kind == "temporal" and (begin >= len(words) or not _has_own_subject(words, begin)):
        return None
    if words[begin : begin + 1] and words[begin] in _SPEAKERS and match.kind == "open":
        known = grammar.contingencies.longest(words, begin)
        if known is None or known.kind != "events":
            return None
    end = _end(words, begin, grammar)
    return None if end == begin else Contingency(end, _leads(words, end, grammar))


def _has_own_subject(words: Sequence[str], begin: int) -> bool:
    """Returns whether the subject of a clause is no place, and neither driver nor speaker."""
    if words[begin] in _SPEAKERS:
        return words[begin] in ("i", "i've") and words[begin + 1 : begin + 2] in (
            ["say"],
            ["tell"],
            ["give"],
            ["shout"],
        )
    if words[begin] in _OTHERS:
        return True
    following = [word for word in words[begin : begin + 3] if word not in ("the", "that", "this", "my", "a", "an")]
    return bool(following) and following[0].isalpha() and following[0] not in ("left", "right")


def _end(words: Sequence[str], begin: int, grammar: RouteGrammar) -> int:
    """Returns the token behind the clause: a comma, or the order that follows without one."""
    limit = min(len(words), begin + _LONGEST)
    for number in range(begin, limit):
        if words[number] in (",", "?"):
            return number
        if words[number] in ("and", "then", "but") and number > begin + 1:
            return number
        if number > begin + 1 and _begins_order(words, number, grammar):
            return number
    return limit


def _begins_order(words: Sequence[str], place: int, grammar: RouteGrammar) -> bool:
    word, before = words[place], words[place - 1]
    if before in _GOVERNING or before in _SPEAKERS or before in _OTHERS or word.endswith(("s", "ing", "ed", "'s")):
        return word in ("please", "just")
    match = grammar.terminals.longest(words, place)
    return word in ("please", "just") or (match is not None and match.group in _DOING and word not in _NO_VERBS)


def _leads(words: Sequence[str], end: int, grammar: RouteGrammar) -> bool:
    """Returns whether something to be done follows, and belongs to the condition: no "and stop at the KFC"."""
    if words[end : end + 1] in (["and"], ["then"], ["but"]):
        return False
    for number in range(end, len(words)):
        if words[number] in ("left", "right"):
            return True
        match = grammar.terminals.longest(words, number)
        if match is not None and match.group in _DOING:
            return True
    return False
