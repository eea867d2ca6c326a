"""What a listener takes from words alone: directions, ordinals, speeds, names, as far as rules can tell."""

from __future__ import annotations

import functools
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TypeVar

from dorothie_gym.dialogue.lexicon import Lexicon, LexiconError, Mention, load_lexicon, read_data, split_words, strings
from dorothie_gym.dialogue.numerals import read_cardinals, read_ordinal
from dorothie_gym.dialogue.wording import Direction
from dorothie_gym.ontology import ActionValue, GoalStatus, LandmarkName, ObjectClass, SlotValue, StreetName

_Value = TypeVar("_Value")

_LEAST_NUMBER = 5
"""Smaller numbers are rarely speeds or distances: "the next one"."""

_UP = re.compile(r"\b(speed(ing)? (it )?up|fast(er|ly)?|hurry|step on it|accelerat\w+|quick(er|ly)?)\b")
_DOWN = re.compile(r"\b(slow\w*|brak\w+|decelerat\w+|too fast)\b")
_LIGHTS = re.compile(r"\blights?\b|\bbeams?\b|\bheadlights?\b")
_BACK = re.compile(
    r"\bu turn|\b(go|going|head|heading) back\b|\b(turn|turning|come|coming) (back|a?round)\b|\bthe other way\b"
)
_ORDER = re.compile(r"\b(before|after)(?= that\b| it\b| (?:the )?#landmark| or | ,| \?|$)")
_FURTHER = re.compile(r"\b(further|farther|a (bit|little) more|keep going)\b")
_AFTER_NEXT = re.compile(r"\b(the one after|one after the next|after next)\b")
_PAST = frozenset({"past", "behind", "beyond"})
_ARTICLES = frozenset({"the", "a", "an", "about", "of", "to"})
_CLAUSE_ENDS = frozenset({",", "?", "then", "and"})
_SPEED_UNITS = frozenset({"km", "kmh", "kilometers", "kilometres", "kph", "mph", "miles"})
_DISTANCE_UNITS = frozenset({"m", "meter", "meters", "metre", "metres"})


@dataclass(frozen=True, kw_only=True)
class Turn:
    """One turn of a route told in words.

    Attributes:
        direction: which way.
        ordinal: at which opportunity (1 is the next), None if not said.
    """

    direction: Direction
    ordinal: int | None = None


@dataclass(frozen=True, kw_only=True)
class Heard:
    """What was heard; whatever was not said is None, False or empty. Names are in the order in which they were said.

    Attributes:
        text: the words themselves.
        masked: the words in lower case with names masked (see data/cues.yaml).
        turns: directions in order; a route may have several.
        direction: the first of them.
        ordinal: which opportunity, 1 is the next.
        actions: actions named, in the order of the lexicon.
        landmarks: landmarks named.
        streets: streets named.
        objects: objects named.
        statuses: goal statuses expressed.
        past: landmarks behind which something is said to be or to happen.
        dropped: landmarks that are given up or denied.
        order: "before" or "after" where the text says one.
        faster: True to speed up, False to slow down.
        lights: True for on, False for off.
        speed: a speed [km/h].
        distance: a distance [m].
        here: whether it is to be on the spot.
        further: whether the car is to go on a bit.
        affirms: True for a yes, False for a no at the beginning.
        question: whether it is put as a question with a question mark.
    """

    text: str
    masked: str
    turns: tuple[Turn, ...] = ()
    ordinal: int | None = None
    actions: tuple[ActionValue, ...] = ()
    landmarks: tuple[LandmarkName, ...] = ()
    streets: tuple[StreetName, ...] = ()
    objects: tuple[ObjectClass, ...] = ()
    statuses: tuple[GoalStatus, ...] = ()
    past: tuple[LandmarkName, ...] = ()
    dropped: tuple[LandmarkName, ...] = ()
    order: str | None = None
    faster: bool | None = None
    lights: bool | None = None
    speed: int | None = None
    distance: int | None = None
    here: bool = False
    further: bool = False
    affirms: bool | None = None
    question: bool = False

    @property
    def direction(self) -> Direction | None:
        """The first direction said."""
        return self.turns[0].direction if self.turns else None

    @property
    def values(self) -> frozenset[SlotValue]:
        """All slot values heard."""
        return frozenset((*self.actions, *self.landmarks, *self.streets, *self.objects, *self.statuses))


@dataclass(frozen=True)
class _WordLists:
    """Word lists of data/cues.yaml, where each is explained."""

    turning: frozenset[str]
    right_not_before: frozenset[str]
    right_not_after: frozenset[str]
    left_not_after: frozenset[str]
    ordinal_nouns: frozenset[str]
    dropping: frozenset[str]
    affirming: frozenset[str]
    denying: frozenset[str]


def understand(text: str) -> Heard:
    """Reads a text in free English, of any case and with typographic or plain apostrophes.

    Args:
        text: what was said; may be empty.

    Returns:
        What rules can take from it. Nothing is ever refused.
    """
    lists = _word_lists()
    mentions, words = load_lexicon().find(split_words(text))
    while words and words[-1] == ",":
        words.pop()
    words = _mask_directions(words, lists)
    joined = " ".join(words)
    speed, distance = _quantities(joined)
    masked = _mask_numbers(joined)
    landmarks = [mention for mention in mentions if isinstance(mention.value, LandmarkName)]
    actions = _actions(masked, load_lexicon())
    turns = _turns(words, lists)
    return Heard(
        text=text,
        masked=masked,
        turns=turns,
        ordinal=next((turn.ordinal for turn in turns if turn.ordinal is not None), _ordinal(words, lists)),
        actions=actions,
        landmarks=_unique(mention.value for mention in landmarks if isinstance(mention.value, LandmarkName)),
        streets=_unique(mention.value for mention in mentions if isinstance(mention.value, StreetName)),
        objects=_unique(mention.value for mention in mentions if isinstance(mention.value, ObjectClass)),
        statuses=_unique(mention.value for mention in mentions if isinstance(mention.value, GoalStatus)),
        past=_behind(landmarks, words, _PAST),
        dropped=_behind(landmarks, words, lists.dropping),
        order=order[1] if (order := _ORDER.search(joined)) else None,
        faster=False if _DOWN.search(joined) else True if _UP.search(joined) else None,
        lights=_lights(words, joined),
        speed=speed,
        distance=distance,
        here="here" in words,
        further=_FURTHER.search(joined) is not None,
        affirms=_affirms(words, lists),
        question="?" in words,
    )


@functools.cache
def _word_lists() -> _WordLists:
    data = read_data("cues.yaml")
    lists = {
        **data.get("directions", {}),
        **{name: data.get(name) for name in ("ordinal_nouns", "dropping", "affirming", "denying")},
    }
    if lists.keys() != _WordLists.__dataclass_fields__.keys():
        raise LexiconError(
            f"cues.yaml: needs the word lists {sorted(_WordLists.__dataclass_fields__)}, has {sorted(lists)}"
        )
    return _WordLists(**{name: frozenset(strings(f"cues.yaml: {name}", words)) for name, words in lists.items()})


def _mask_directions(words: Sequence[str], lists: _WordLists) -> list[str]:
    """Returns the words with each "left" or "right" that is no direction replaced by "#left", "#ok" or "#tag"."""
    masked = list(words)
    for place, word in enumerate(words):
        before = words[place - 1] if place else ","
        after = words[place + 1] if place + 1 < len(words) else ""
        if word == "right":
            masked[place] = _right(before, after, place, lists)
        elif word == "left" and before in lists.left_not_after:
            masked[place] = "#left"
        elif word == "straight" and after == "away":
            masked[place] = "#ok"
    return masked


def _right(before: str, after: str, place: int, lists: _WordLists) -> str:
    if after == "?" and place > 0 and (before == "," or before not in lists.turning):
        return "#tag"
    if before in lists.right_not_after or (place == 0 and after == ","):
        return "#ok"
    turning = before in lists.turning and (before != "," or place == 0)
    return "#ok" if after in lists.right_not_before and not turning else "right"


def _mask_numbers(joined: str) -> str:
    words = joined.split()
    masked: list[str] = []
    for word in words:
        number = any(value >= _LEAST_NUMBER for value in read_cardinals([word]))
        if not number:
            masked.append(word)
        elif masked[-1:] != ["#number"]:
            masked.append("#number")
    return " ".join(masked)


def _quantities(joined: str) -> tuple[int | None, int | None]:
    """Returns a speed [km/h] and a distance [m], each None if not said."""
    speed = distance = None
    words = joined.split()
    for place in range(len(words)):
        run = _number_run(words, place)
        if not run:
            continue
        number = read_cardinals(run)[0]
        unit = words[place + len(run)] if place + len(run) < len(words) else ""
        if unit in _DISTANCE_UNITS:
            distance = number if distance is None else distance
        elif number >= _LEAST_NUMBER or unit in _SPEED_UNITS:
            speed = number if speed is None else speed
    return speed, distance


def _number_run(words: Sequence[str], place: int) -> list[str]:
    """Returns the words of the one number that begins at `place`; none within a number that began before."""
    if not read_cardinals([words[place]]) or (place and _number_run(words[place - 1 : place + 1], 0)[1:]):
        return []
    length = 1
    while place + length < len(words) and len(read_cardinals(words[place : place + length + 1])) == 1:
        if not read_cardinals([words[place + length]]) and words[place + length] != "hundred":
            break
        length += 1
    return list(words[place : place + length])


def _actions(masked: str, lexicon: Lexicon) -> tuple[ActionValue, ...]:
    found = []
    for action, spoken in lexicon.actions.items():
        for pattern in spoken.patterns:
            masked, count = pattern.subn("#action", masked)
            if count and action not in found:
                found.append(action)
    return tuple(found)


def _turns(words: Sequence[str], lists: _WordLists) -> tuple[Turn, ...]:
    turns: list[Turn] = []
    waiting: int | None = None  # an ordinal said before its direction: "the second one, on the left"
    for clause in _clauses(words):
        ordinal = _ordinal(clause, lists)
        directions = _directions(clause, lists)
        for number, direction in enumerate(directions):
            turns.append(Turn(direction=direction, ordinal=(ordinal or waiting) if number == 0 else None))
            waiting = None
        if not directions and ordinal is not None:
            if turns and turns[-1].ordinal is None:
                turns[-1] = Turn(direction=turns[-1].direction, ordinal=ordinal)
            else:
                waiting = ordinal
    return tuple(turns)


def _directions(clause: Sequence[str], lists: _WordLists) -> list[Direction]:
    directions = [
        Direction(word)
        for place, word in enumerate(clause)
        if word in ("left", "right", "straight") and not _is_denied(clause[max(0, place - 3) : place], lists)
    ]
    return [Direction.BACK] if not directions and _BACK.search(" ".join(clause)) else directions


def _is_denied(before: Sequence[str], lists: _WordLists) -> bool:
    """Returns whether the words before a direction deny it: "not right", "don't take a right"; doubt is no denial."""
    return "sure" not in before and not lists.denying.isdisjoint(before)


def _clauses(words: Sequence[str]) -> list[list[str]]:
    clauses: list[list[str]] = [[]]
    for word in words:
        if word in _CLAUSE_ENDS:
            clauses.append([])
        else:
            clauses[-1].append(word)
    return [clause for clause in clauses if clause]


def _ordinal(words: Sequence[str], lists: _WordLists) -> int | None:
    if _AFTER_NEXT.search(" ".join(words)):
        return 2
    for word, noun in zip(words, words[1:], strict=False):
        number = read_ordinal(word)
        if number is not None and noun in lists.ordinal_nouns:
            return number
    return None


def _behind(landmarks: Sequence[Mention], words: Sequence[str], heads: frozenset[str]) -> tuple[LandmarkName, ...]:
    """Returns the landmarks that follow one of the words `heads`, articles aside."""
    found = []
    for mention in landmarks:
        place = mention.start - 1
        while place >= 0 and words[place] in _ARTICLES and words[place] not in heads:
            place -= 1
        if place >= 0 and words[place] in heads and isinstance(mention.value, LandmarkName):
            found.append(mention.value)
    return _unique(found)


def _lights(words: Sequence[str], joined: str) -> bool | None:
    if not _LIGHTS.search(joined):
        return None
    return False if "off" in words else True if "on" in words else None


def _affirms(words: Sequence[str], lists: _WordLists) -> bool | None:
    said = [word for word in words if word not in (",", "oh", "well", "hmm", "um")]
    first = said[0] if said else ""
    if said[:2] == ["not", "sure"]:
        return None
    if first in lists.denying:
        return False
    return True if first in lists.affirming else None


def _unique(values: Iterable[_Value]) -> tuple[_Value, ...]:
    return tuple(dict.fromkeys(values))
