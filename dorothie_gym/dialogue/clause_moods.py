"""Moods of clauses: whether a clause orders, asks or states, by its opening and its first finite verb."""

from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from dorothie_gym.dialogue.route_grammar import route_grammar


class ClauseMood(enum.Enum):
    """What a clause does, as far as its form tells."""

    COMMAND = "command"
    REQUEST = "request"
    QUESTION = "question"
    STATEMENT = "statement"


ORDERED: Final = frozenset({ClauseMood.COMMAND, ClauseMood.REQUEST})
"""Moods of the clauses whose steps the driver is asked for."""

_BASE_FORMS: Final = frozenset({"speed", "proceed", "need", "bring", "swing"})
"""Verbs that end as participles do."""

_ORDERED_LAST: Final = frozenset({"next", "first", "now", "please", "instead", "then"})
"""Last words of an errand without a verb."""

_ORDERED_FIRST: Final = frozenset({"now", "so", "just", "then", "next", "instead", "back", "straight", "home"})
"""First words of one behind a statement: "the party's off, now the Ikea"."""

_LOCATING: Final = frozenset({"by", "next", "near", "close", "beside", "opposite", "just"})
"""First words of phrases that tell where something stands."""

_SUBJECT_WORDS: Final = 6
"""Words of a clause among which its finite verb is sought."""

_MODALS: Final = frozenset({"could", "can", "would", "will"})
_NO_SUBJECTS: Final = frozenset({"let's", "here's", "that's", "it's", "there's", "what's", "hour's"})
_SUBORDINATING: Final = frozenset({"where", "when", "what", "which", "how"})
_ENOUGH: Final = frozenset({"plenty", "enough", "ample", "tops", "max", "maximum", "sufficient"})
"""Words by which a statement about a speed sets it: "thirty miles an hour is plenty"."""

_LISTING: Final = (["it's"], ["that's"], ["we've"], ["there's"])
_PLAINLY: Final = frozenset({"just", "simply", "then", "now", "also", "first", "next", "always", "basically"})
"""Adverbs behind "you" of a way that is told."""

_SIDES: Final = frozenset({"left", "right", "lefts", "rights"})
_SETTING_OUT: Final = frozenset(
    {"just", "off", "going", "gonna", "to", "here", "out", "also", "first", "now", "only", "meant"}
)
"""Words between "we're" and what one is about to do."""

_FETCHING: Final = frozenset(
    [
        *("fetch", "fetching", "grab", "grabbing", "collect", "collecting", "pick", "picking", "meet", "meeting"),
        *("scoop", "scooping"),
    ]
)
"""Verbs by which somebody is fetched; a "get" of people is read as one of them."""

_SHORT_VERB: Final = 3
_NO_VERBS: Final = frozenset(
    {"thanks", "cheers", "please", "always", "perhaps", "sometimes", "afterwards", "this", "across"}
)
"""Words in -s that are no verbs."""

_FRAME: Final = 3
"""Least number of words of the frame of a request that are skipped."""

_FRAME_ENDS: Final = frozenset({"could", "can", "would", "might", "should", "we", "you"})
"""Last words of the frame of a request behind which its verb follows."""

_SUPPOSING: Final = frozenset({"suppose", "imagine", "mind"})
"""Words of a frame whose negation is politeness."""

_NEGATED: Final = frozenset(
    {
        "where",
        "that's",
        "#landmark",
        "#street",
        "not",
        "don't",
        "didn't",
        "doesn't",
        "never",
        "no",
        "mustn't",
        "needn't",
        "when",
        "until",
    }
)

_IMPERATIVES: Final = frozenset({"actions", "verbs", "lights"})
"""Groups of the grammar with which an order begins."""

_IN_YOUR_PLACE: Final = (" if i were you ", " if i was you ", " in your shoes ", " in your place ")
_WHERE: Final = frozenset({"where", "when", "wherever", "whenever"})
_INVERTED: Final = (
    ["is"], ["are"], ["do"], ["does"], ["did"], ["can"], ["could"], ["should"], ["shall"], ["will"], ["would"], ["was"],
    ["were"], ["have"], ["has"], ["to"], ["am"], ["next"], ["now"], ["exactly"], ["else"],
)  # fmt: skip
"""Words behind "where" that make a question of it."""

_RELATIVE: Final = (["i"], ["we"], ["you"], ["that"], ["who"])
_ORDERING: Final = frozenset({"actions", "verbs", "lights", "relations", "negations"})
"""Groups of the grammar before which a finite verb must stand to make a statement."""


@dataclass(frozen=True, kw_only=True)
class ClauseReader:
    """Tokens of a sentence, with what tells the moods of its clauses.

    Attributes:
        words: tokens with masked names and directions.
        question: whether a question mark ends the sentence.
        contracted: tokens of the names that end in "'s".
    """

    words: Sequence[str]
    question: bool
    contracted: frozenset[int]

    def mood(self, place: int, before: ClauseMood, *, new: bool) -> ClauseMood:
        """Returns the mood of the clause that begins at a token.

        Args:
            place: the token.
            before: mood of the clause before it.
            new: whether the clause begins the sentence.
        """
        found = mood_of(self.words, place)
        if found in (None, ClauseMood.STATEMENT) and self._tells_to_act(self._behind_soft(place)):
            return ClauseMood.REQUEST  # "you just slow down a bit"
        if found is ClauseMood.STATEMENT and (self._advises(place) or self._fetches(self._behind_soft(place))):
            return ClauseMood.REQUEST  # "I'd get in the other lane if I were you"; "we're getting Nana"
        if found is ClauseMood.QUESTION and new and not self.question and self._conditions(place):
            found = None  # "where Plymouth meets Draper take a right"
        word = self.words[place] if place < len(self.words) else ""
        if found is ClauseMood.QUESTION and not new and not self.question and word in _SUBORDINATING:
            found = None
        return self._inherited(place, before, new=new) if found is None else found

    def names_next(self, place: int) -> bool:
        """Returns whether a clause only names what comes next in a list: "(and then) it's the Coco"."""
        if [*self.words[place : place + 1]] not in _LISTING:
            return False
        place += 1 + (self.words[place + 1 : place + 2] in (["the"], ["to"], ["on"]))
        return place < len(self.words) and self.words[place] == "#landmark"

    def _tells_to_act(self, place: int) -> bool:
        """Returns whether the driver is told what to do as a matter of course: "you just get in the left lane"."""
        words, begin = self.words, place
        if words[place : place + 1] not in (["you"], ["ye"]):
            return False
        place += 1
        while place < len(words) and words[place] in _PLAINLY:
            place += 1
        match = route_grammar().terminals.longest(words, place) if place > begin + 1 and place < len(words) else None
        return match is not None and match.group in ("actions", "lights") and not words[place].endswith(("ed", "ing"))

    def _fetches(self, place: int) -> bool:
        """Returns whether a clause tells that somebody is to be fetched now: "we're picking up my brother"."""
        words = self.words
        if words[place : place + 1] not in (["i'm"], ["we're"]):
            return False
        place += 1
        while place < len(words) and words[place] in _SETTING_OUT:
            place += 1
        if place >= len(words) or words[place] not in _FETCHING:
            return False
        return not route_grammar().people.isdisjoint(words[place + 1 : place + 4])

    def _advises(self, place: int) -> bool:
        """Returns whether a clause tells what the speaker would do in the driver's place."""
        joined = f" {' '.join(self.words[place:])} "
        return any(phrase in joined for phrase in _IN_YOUR_PLACE)

    def _conditions(self, place: int) -> bool:
        """Returns whether a clause that begins as a question tells where or when what follows is due."""
        place = self._behind_soft(place)
        words, grammar = self.words, route_grammar()
        if place >= len(words) or words[place] not in _WHERE or words[place + 1 : place + 2] in _INVERTED:
            return False
        for number in range(place + 2, len(words)):
            match = grammar.terminals.longest(words, number)
            acts = match is not None and match.group in ("actions", "verbs", "lights")
            if acts or words[number] in ("left", "right"):
                return True
        return False

    def _inherited(self, place: int, before: ClauseMood, *, new: bool) -> ClauseMood:
        """Returns the mood of a clause whose opening does not tell it."""
        if self._states(self._behind_soft(place)):
            return ClauseMood.STATEMENT
        if new and self.question and self._asks_for(place):
            return ClauseMood.REQUEST  # "from the KFC on, could you go slow?"
        if new:
            return ClauseMood.QUESTION if self.question and "," not in self.words[place:] else ClauseMood.COMMAND
        if before is ClauseMood.QUESTION and not self.question and self._begins_order(place):
            return ClauseMood.COMMAND  # "do you know the KFC, take us there"
        if before is not ClauseMood.STATEMENT:
            return ClauseMood.QUESTION if before is ClauseMood.QUESTION else ClauseMood.COMMAND
        word = self.words[place] if place < len(self.words) else ""
        past = word.endswith("ed") and word not in _BASE_FORMS
        states = past or is_participle(word) or self._names_only(place) or self._locates(place)
        return ClauseMood.STATEMENT if states else ClauseMood.COMMAND

    def _begins_order(self, place: int) -> bool:
        """Returns whether an imperative stands behind a comma."""
        place = self._behind_soft(place)
        if place >= len(self.words) or self.words[place - 1] != ",":
            return False
        match = route_grammar().terminals.longest(self.words, place)
        return match is not None and match.group in _IMPERATIVES

    def _behind_soft(self, place: int) -> int:
        """Returns the place behind words that only open a clause: "look, the Panera's on your left"."""
        openers = route_grammar().openers
        while place < len(self.words):
            match = openers.longest(self.words, place)
            if match is None or match.kind != "soft":
                break
            place += match.length
        return place

    def _asks_for(self, place: int) -> bool:
        """Returns whether "could you" and the like occur behind a condition or a place."""
        pairs = zip(self.words[place:], self.words[place + 1 :], strict=False)
        return any(first in _MODALS and second == "you" for first, second in pairs)

    def _names_only(self, place: int) -> bool:
        """Returns whether a clause goes on with nothing but a name: "it's on the left, the Panera, stop there"."""
        grammar, words = route_grammar(), self.words
        end = next((number for number in range(place, len(words)) if words[number] in (",", "?")), len(words))
        if words[end - 1] in _ORDERED_LAST or not _ORDERED_FIRST.isdisjoint(words[place : place + 1]):
            return False  # "that's the Coco ticked off, the KFC next"
        named = any(words[number].startswith("#") for number in range(place, end))
        quiet = all(
            words[number] not in ("left", "right") and grammar.terminals.longest(words, number) is None
            for number in range(place, end)
        )
        return named and quiet

    def _locates(self, place: int) -> bool:
        """Returns whether a clause goes on with where something is: "it's on the right, by the lights"."""
        grammar, words = route_grammar(), self.words
        if place >= len(words) or words[place] not in _LOCATING:
            return False
        while place < len(words) and words[place] not in (",", "?"):
            match = grammar.terminals.longest(words, place)
            acts = match is not None and match.group in ("actions", "verbs", "lights")
            if acts or words[place] in ("left", "right"):
                return False
            place += 1 if match is None else match.length
        return True

    def _states(self, place: int) -> bool:
        """Returns whether a finite verb comes before anything that is ordered: "nobody's coming", "turning left"."""
        grammar, words = route_grammar(), self.words
        first = words[place] if place < len(words) else ""
        if is_participle(first):
            return True
        if first in grammar.subordinators:
            return False
        for number in range(place, min(place + _SUBJECT_WORDS, len(words))):
            word = words[number]
            if word in (",", "then") or (word in _SIDES and words[number + 1 : number + 2] != ["lane"]):
                return False
            if self._is_finite(number, place):
                return _ENOUGH.isdisjoint(words[number + 1 : number + 3])
            if word.startswith("#") and words[number + 1 : number + 2] in _RELATIVE:
                return True  # "the person I have to meet is on Beal"
            match = grammar.terminals.longest(words, number)
            if match is not None and match.group in _ORDERING:
                return False
        return False

    def _is_unknown(self, number: int) -> bool:
        """Returns whether no phrase of the grammar begins at a token."""
        grammar = route_grammar()
        known = grammar.terminals.longest(self.words, number) or grammar.opportunities.longest(self.words, number)
        return known is None and self.words[number] not in _NO_VERBS

    def _is_finite(self, number: int, place: int) -> bool:
        """Returns whether a token is, or ends in, a finite verb whose subject begins at `place`."""
        word, following = self.words[number], self.words[number + 1 : number + 2]
        if number > place and (word in route_grammar().finite or word in route_grammar().subjects):
            return True
        named = number > 0 and words_name(self.words[number - 1]) and number - 1 >= place
        if named and word.endswith("s") and word.isalpha() and len(word) > _SHORT_VERB and self._is_unknown(number):
            return True  # "the Ikea shuts at eight"
        contracted = number in self.contracted or (word.endswith("'s") and word not in _NO_SUBJECTS)
        return contracted and following != ["#landmark"]


def words_name(word: str) -> bool:
    """Returns whether a token stands for a landmark or a street."""
    return word in ("#landmark", "#street")


def is_participle(word: str) -> bool:
    """Returns whether a word is a form in -ing: "turning", but neither "swing" nor "anything"."""
    return word.endswith("ing") and not word.endswith("thing") and word not in _BASE_FORMS


def mood_of(words: Sequence[str], place: int = 0) -> ClauseMood | None:
    """Returns what the clause that begins at a place does; None if its opening does not tell, as of "turn left"."""
    openers = route_grammar().openers
    while place < len(words):
        match = openers.longest(words, place)
        if match is None:
            return None
        if match.kind != "soft":
            return ClauseMood(match.kind)
        place += match.length
    return None


def behind_request(words: Sequence[str], place: int) -> int:
    """Returns the place behind words that only frame a request: "do you think you could"; `place` without any."""
    match = route_grammar().openers.longest(words, place)
    if match is None or match.kind != "request" or match.length < _FRAME or place + match.length >= len(words):
        return place
    frame = words[place : place + match.length]
    plain = _NEGATED.isdisjoint(frame) or not _SUPPOSING.isdisjoint(frame)  # "I don't suppose you could"
    return place + match.length if frame[-1] in _FRAME_ENDS and plain else place
