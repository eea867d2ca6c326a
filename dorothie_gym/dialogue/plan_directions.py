"""Left and right in route talk: turns, lanes, and sides of the street."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.plan_items import (
    PLURAL_SIDES,
    SIDES,
    ActionItem,
    BoundaryItem,
    LaneItem,
    SideItem,
    TokenReader,
    TurnItem,
)
from dorothie_gym.ontology.slots import ObjectClass

if TYPE_CHECKING:
    from dorothie_gym.dialogue.route_grammar import RouteGrammar

_SIDE_WORDS: Final = frozenset({"on", "at", "to", "in", "into", "onto", "along", "down"})
_BESIDE: Final = frozenset({"on", "at", "along", "down"})
_DEGREES: Final = frozenset({"immediate", "hard", "sharp", "far", "very", "available", "possible", "little", "quick"})
_MORE: Final = frozenset({"more", "further", "straight", "consecutive", "easy"})
"""Words between a number of turns and their side: "two more rights"."""

_EDGES: Final = frozenset({"side", "side's", "kerb", "curb", "edge"})
"""Nouns that make left and right a side of the street."""

_TURN_NOUNS: Final = frozenset({"turn", "turning", "one", "street", "road", "exit", "corner", "fork", "again", "turns"})
"""Nouns that make left and right a turn."""

_BEING: Final = frozenset({"is", "are", "be", "over", "up"})
"""Words behind which a side is stated: "the house is on the left"."""

_OVER: Final = frozenset({"over", "across"})
_ENDS: Final = frozenset({"", ",", "?", "and", "then", "please", "now", "when", "if", "before", "a"})
"""Words behind "over to the left" of a change of lane."""
_LANES: Final = frozenset({"lane", "lanes"})
_OF_LANES: Final = frozenset({"lane", "lanes", "file"})
_HUGGING: Final = frozenset({"hug", "hugging"})
_JOINTS: Final = frozenset({",", "then", "and", "turn", "go", "take"})
"""Words between a lane and a direction that has nothing to do with it."""

_SIDEWAYS: Final = frozenset(
    [
        *("move", "moving", "shift", "shifting", "slide", "sliding", "scoot", "scooting", "edge", "edging"),
        *("drift", "drifting", "nudge", "ease", "inch", "scooch", "budge", "sidle", "hop", "squeeze"),
        *("keep", "keeping", "stay", "staying", "stick", "sticking", "remain", "remaining"),
    ]
)
"""Verbs by which the car goes or keeps to one side of its road, rather than turns."""

_TO_SIDES: Final = frozenset({"to", "on", "in"})
_STEERING: Final = frozenset({"go", "going", "swing", "pull", "steer", "come", "be", "get", "drive", "", ",", "and"})
"""Words in front of a side to which the car is to go a little."""

_LITTLE: Final = frozenset({"bit", "little", "touch", "tad", "smidge", "hair", "slightly"})
_SLIGHT: Final = _LITTLE | {"a", "wee", "just", "some", "more", "over", "across", "further"}
"""Words that tell how far the car is to go to a side: "a little more"."""

_SHIFTED: Final = frozenset(
    [
        *("", ",", "?", "and", "then", "please", "now", "when", "if", "once", "before", "until", "till", "for"),
        *("past", "around", "round", "as", "so", "because", "we're", "again", "instead", "after"),
    ]
)
"""Words behind a side to which the car is to go."""

_LANE_NOUNS: Final = (["lane"], ["one"], ["other"])
_CHANGING: Final = frozenset({"change", "changing", "switch", "switching"})


class _Phrase(NamedTuple):
    """Direction with the words around it.

    Attributes:
        begin: its first token.
        place: the token behind left or right, and behind "hand".
        preposition: preposition at its beginning, or "".
        direction: left or right.
        ordinal: number of the opportunity.
        several: whether it is a plural: "two lefts".
        hand: whether it is left-hand or right-hand.
    """

    begin: int
    place: int
    preposition: str
    direction: Direction
    ordinal: int | None
    several: bool
    hand: bool


class DirectionReader(TokenReader):
    """Reads left and right.

    Attributes:
        contracted: tokens of the names that end in "'s".
    """

    contracted: frozenset[int] = frozenset()

    def read_direction(self, place: int) -> int:
        """Reads a direction with the words around it: a turn, a lane, or a side."""
        if SIDES.keys().isdisjoint(self.words):
            return place
        found = self._direction(place)
        if found is None:
            return place
        lane = self._lane(found)
        return lane if lane is not None else self._turn_or_side(found)

    def _direction(self, place: int) -> _Phrase | None:
        """Returns the phrase with a direction at a place; None if there is none."""
        begin = place
        preposition = self.word_at(place) if self.word_at(place) in _SIDE_WORDS else ""
        place += preposition != ""
        ordinal, place = self.ordinal(place)
        while self.word_at(place) in self.grammar.determiners or self.word_at(place) in _DEGREES:
            place += 1
        if ordinal is None:
            ordinal, place = self.ordinal(place)
        while self.word_at(place) in _DEGREES or (ordinal is not None and self.word_at(place) in _MORE):
            place += 1
        direction = SIDES.get(self.word_at(place))
        if direction is None:
            return None
        several = self.word_at(place) in PLURAL_SIDES
        place += 1
        if ordinal is None and self.word_at(place) == "after" and self.word_at(place + 1) in ("next", "this"):
            ordinal, place = 2, place + 2  # "the left after next"
        place = self._behind_repetition(place)
        hand = self.word_at(place) in ("hand", "handed")
        place += hand
        place += self.word_at(place) == "most"
        return _Phrase(begin, place, preposition, direction, ordinal, several, hand)

    def _behind_repetition(self, place: int) -> int:
        """Returns the place behind a direction that is said again, "left left left", unless another one follows."""
        end = place
        while self.word_at(end) == self.word_at(place - 1) and self.word_at(end) in ("left", "right"):
            end += 1
        routed = self.word_at(end) in SIDES  # "right right left"
        return place if routed else end

    def _lane(self, found: _Phrase) -> int | None:
        """Reads the side of a lane; returns the token behind it, or None if it is no lane."""
        begin, place = found.begin, found.place
        if self.word_at(place) in ("a", "one") and self.word_at(place + 1) == "lane":
            self.items.append(LaneItem(found.direction))  # "move left a lane"
            return place + 2
        if self.word_at(begin - 1) == "of" and self.word_at(begin - 2) == "out" and self.word_at(place) in _LANES:
            return place + 1  # "out of the right lane"
        over = self.word_at(begin - 1) == "to" and self.word_at(begin - 2) in _OVER and self.word_at(place) in _ENDS
        if over and isinstance(self.items[-1] if self.items else None, ActionItem):
            self.items.append(LaneItem(found.direction))  # "go over to the left"
            return place
        before = self.word_at(begin - 1)
        changed = (found.preposition == "to" and before in _CHANGING) or before in _HUGGING
        if changed or self.word_at(place) in _OF_LANES or before in _LANES:
            self.items.append(LaneItem(found.direction))
            return place + (self.word_at(place) in _OF_LANES)
        if self._is_other_lane(begin, place):
            self.items.append(LaneItem(found.direction))
            return place + (self.word_at(place) == "one")
        aside = self._aside(found)
        if aside is not None:
            self.items.append(LaneItem(found.direction))
        return aside

    def _aside(self, found: _Phrase) -> int | None:
        """Returns the token behind a side to which the car is to move or keep: "move left a bit"; None if it turns."""
        begin, end, preposition = found.begin, found.place, found.preposition
        if not preposition and self.word_at(begin - 1) in _TO_SIDES and self.word_at(begin - 2) in _SIDEWAYS:
            begin, preposition = begin - 1, self.word_at(begin - 1)  # "keep to" has been read already
        if found.hand or found.ordinal is not None or found.several or preposition not in ("", *_TO_SIDES):
            return None
        while self.word_at(begin - 1) in _SLIGHT:
            begin -= 1
        while self.word_at(end) in _SLIGHT:
            end += 1
        verb, near = self.word_at(begin - 1), {*self.words[begin : found.begin], *self.words[found.place : end]}
        slightly = not _LITTLE.isdisjoint(near) and preposition in ("", "to")
        if not (verb in _SIDEWAYS or (slightly and verb in _STEERING)):
            return None
        here = self.word_at(end) == "here" and (preposition != "" or found.direction is Direction.LEFT)
        return end if here or self.word_at(end) in _SHIFTED else None

    def _turn_or_side(self, found: _Phrase) -> int:
        """Reads a turn or a side of the street; returns the token behind it."""
        place, before = found.place, self.word_at(found.begin - 1)
        edge = self.word_at(place) in _EDGES or self.names.get(place) is ObjectClass.SIDE_WALK
        going = found.preposition in ("to", "in")
        aside = edge or (going and self._stands_behind_stop())
        aside = aside or (found.hand and not going and self.word_at(place) not in _TURN_NOUNS)
        if aside:
            place = self._behind_street(place + edge)
        elif self.word_at(place) in _TURN_NOUNS:
            place += 1
        turning = self.word_at(place - 1) in _TURN_NOUNS and found.preposition in ("down", "along")
        if not turning and (aside or (found.preposition or before) in _BESIDE) and found.ordinal is None:
            stated = before.endswith("'s") or before in _BEING or found.begin - 1 in self.contracted
            self.items.append(SideItem(found.direction, stated))
        else:
            count, place = (found.ordinal or 1, place) if found.several else self._times(place)
            last = self.items[-1] if self.items else None
            if self.word_at(place - 1) == "again" and isinstance(last, BoundaryItem) and last.kind == ",":
                self.items[-1] = BoundaryItem("then", last.place)  # "left, left again"
            self.items.append(TurnItem(found.direction, None if found.several else found.ordinal, min(count, 4)))
        return place

    def _times(self, place: int) -> tuple[int, int]:
        """Returns how often a turn is to be taken, and the token behind it: "right twice", "left three times"."""
        if self.word_at(place) == "twice":
            return 2, place + 1
        number, behind = self.ordinal(place)
        return (number, behind + 1) if number and self.word_at(behind) == "times" else (1, place)

    def _is_other_lane(self, begin: int, place: int) -> bool:
        """Returns whether a side tells one of the lanes spoken of: "switch lanes, the right one"."""
        if _LANES.isdisjoint(self.words[:begin]):
            return False
        near = self.words[max(begin - 3, 0) : begin]
        if not _LANES.isdisjoint(near) and _JOINTS.isdisjoint(near):
            return True  # "one lane more to the right"
        before = [word for word in self.words[max(begin - 4, 0) : begin] if word not in ("which", "that", "is", ",")]
        return self.word_at(place) in ("one", "") and (self.word_at(place) == "one" or before[-1:] in _LANE_NOUNS)

    def _stands_behind_stop(self) -> bool:
        """Returns whether the last item is an order to stop: "stop to the right"."""
        last = self.items[-1] if self.items else None
        return isinstance(last, ActionItem) and last.kind == "stop"

    def _behind_street(self, place: int) -> int:
        """Returns the place behind "of the street"."""
        if self.word_at(place) == "of":
            rest = place + 1 + (self.word_at(place + 1) in self.grammar.determiners)
            return rest + 1 if self.word_at(rest) in ("street", "road", "car") else place
        return place


def begins_direction(word: str, grammar: RouteGrammar) -> bool:
    """Returns whether a word other than a number may begin a direction, see `DirectionReader.read_direction`."""
    return word in SIDES or word in _SIDE_WORDS or word in _DEGREES or word in grammar.determiners
