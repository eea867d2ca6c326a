"""Reader of driving plans: from the text of an utterance to its steps."""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from dorothie_gym.dialogue.clause_breaks import with_breaks
from dorothie_gym.dialogue.clause_moods import ClauseReader
from dorothie_gym.dialogue.directions import WordLists, mask_directions, word_lists
from dorothie_gym.dialogue.entity_recognition import find_names, known_words
from dorothie_gym.dialogue.lexicon import split_words
from dorothie_gym.dialogue.numerals import NUMBER_WORDS, read_ordinal
from dorothie_gym.dialogue.phrases import read_talk_files
from dorothie_gym.dialogue.plan_chunker import read_items
from dorothie_gym.dialogue.plan_parser import PlanParse, Sentence, parse_plan
from dorothie_gym.dialogue.route_grammar import route_grammar
from dorothie_gym.dialogue.turn_phrases import plain_orders
from dorothie_gym.dialogue.vocatives import without_asides, without_vocative
from dorothie_gym.ontology.slots import ObjectClass

if TYPE_CHECKING:
    from dorothie_gym.ontology.slots import SlotValue

_SENTENCE = re.compile(r"(?<=[.!?;:\u2026])(?<!\b(?:Mr|Ms|Dr|St)\.)(?<!\bMrs\.)\s+|\s+[\u2013\u2014-]+\s+")
_CAPITALISED = re.compile(r"(?<=[a-z,] )[A-Z][a-z]+\b")
_HESITATIONS = frozenset({"uh", "er", "erm", "um", "hm", "hmm"})
_ASKING = (["do"], ["did"], ["d'you"], ["don't"], ["didn't"], ["if"])
"""Words in front of a "you know" that asks."""

_FEW = 4
"""Most words of an errand without a verb."""

_NAMES_FILE = "15_names.talk"
_PERSON = "#person"
_OR_NOT = (["or", "no"], ["or", "not"], ["or", "what"])
"""Last words of a question that leaves it at that: "are we turning or not"."""
_INTO = frozenset({"in", "into", "to", "over"})
_LANES = frozenset({"lane", "lanes"})
_SEPARABLE = frozenset({"pick", "picking"})
_FETCHES = frozenset({"fetch", "fetching", "grab", "grabbing", "collect", "collecting", "meet"})
_GETS = {"get": "fetch", "getting": "fetching"}
_PRONOUNS = frozenset({"him", "her", "them"})
_BEHIND_NAMES = frozenset({"from", "at", "by", "on", "outside", ",", "and", "then", "first", "please", "in", "off"})
_AT_ONCE = frozenset({"turn", "left", "right", "go", "then"})
"""Words behind which lights at the beginning are those of a junction."""
_APART = frozenset({",", "?", "and", "it", "the_pace", "speed", "pace", "up"})
"""Words that do not stand between such a verb and its particle."""
_REACHING = (["you"], ["we"], ["i"], ["you'll"], ["we'll"], ["to"])
"""Words behind which one hits the lights of a junction, rather than a switch."""
_LIGHTS = frozenset({"light", "lights"})
_NONE: frozenset[str] = frozenset()
_AGREEING = frozenset({"yes", "yeah", "yep", "yup", "aye", "i", "said", "okay", "ok"})
"""Words with which a direction is only said again: "left at the sign ... yeah, left"."""
_COMPOUNDS = frozenset({"traffic", "stop", "street", "red", "green", "yellow"})
"""First parts of names of lights that the lexicon knows."""


def with_plain_lights(words: Sequence[str]) -> list[str]:
    """Returns the words with the car's "lights" as "headlights", and those of a junction as "stoplight"."""
    found = list(words)
    if _LIGHTS.isdisjoint(found):
        return found
    if found == ["lights"]:
        return ["headlights", "on"]
    grammar = route_grammar()
    for place in range(len(found)):
        match = grammar.lights.longest(found, place)
        reached = found[place] == "hit" and found[place - 1 : place] in _REACHING
        signal = place > 0 and found[place - 1] in _COMPOUNDS
        if match is not None and not reached and not signal and not _is_at_junction(found, place, _NONE):
            for number in range(place, place + match.length):
                if found[number] in _LIGHTS:
                    found[number] = "headlights"
    for place, word in enumerate(found):
        if word in _LIGHTS and _is_at_junction(found, place):
            found[place] = "stoplight"
    return found


def _is_at_junction(words: Sequence[str], place: int, compounds: frozenset[str] = _COMPOUNDS) -> bool:
    """Returns whether the lights at a place are those of a junction: "at the next set of lights"."""
    grammar = route_grammar()
    if place == 0 and not _AT_ONCE.isdisjoint(words[1:2]):
        return True  # "lights, turn left"
    place -= 1
    if place >= 0 and words[place] in compounds:
        return False
    while place >= 0 and words[place] in grammar.modifiers and words[place] not in grammar.junction_words:
        if words[place] in ("your", "my", "our"):
            return False
        place -= 1
    reached = place > 0 and words[place] == "hit" and [words[place - 1]] in _REACHING
    return place >= 0 and (words[place] in grammar.junction_words or reached)


@functools.lru_cache(maxsize=2048)
def read_plan(text: str) -> PlanParse:
    """Returns the plan of an utterance, with the steps that it names otherwise.

    Args:
        text: free English; may be empty.
    """
    sentences: list[Sentence] = []
    for part in _SENTENCE.split(with_breaks(text)):
        sentence = _sentence(part)
        if sentence is not None and not (sentences and _says_again(sentences[-1], sentence)):
            sentences.append(sentence)
    return parse_plan(sentences)


def _says_again(before: Sentence, sentence: Sentence) -> bool:
    """Returns whether a sentence only repeats the direction of the one before: "Left! Left, left!"."""
    if len({*before.clauses.words, *sentence.clauses.words}) == 1:
        return True
    said = [word for word in sentence.clauses.words if word != ","]
    rest = [word for word in said if word not in _AGREEING]
    return len(rest) == 1 < len(said) and rest[0] in ("left", "right") and rest[0] in before.clauses.words


def _plain(words: Sequence[str], lists: WordLists) -> list[str]:
    """Returns the words without vocatives and fillers."""
    words = without_vocative(list(words), lists)
    fillers, kept, place = route_grammar().fillers, list[str](), 0
    while place < len(words):
        match = fillers.longest(words, place)
        knows = match is not None and words[place] == "you" and kept[-1:] in _ASKING
        if match is None or knows or _asks_for_name(kept, words[place:]):
            kept.append(words[place])
            match = None
        elif words[place] in _HESITATIONS and _counts_again(kept, words[place + match.length :]):
            kept.append("sorry")
        place += 1 if match is None else match.length
    return without_asides(kept, lists) if kept else words


def _asks_for_name(before: Sequence[str], behind: Sequence[str]) -> bool:
    """Returns whether a "please" stands behind a few words of their own, and orders what they name: "home please"."""
    if behind[0] != "please" or behind[1:2] not in ([], [","], ["?"]) or "," not in before:
        return False
    return 1 <= before[::-1].index(",") <= _FEW


def _counts_again(before: Sequence[str], behind: Sequence[str]) -> bool:
    """Returns whether a turn or a speed is counted anew behind a hesitation: "second right, er, third right"."""
    before = before[:-1] if before[-1:] == [","] else before
    behind = [word for word in behind[:4] if word != ","]
    if before and behind and before[-1] in NUMBER_WORDS and behind[0] in NUMBER_WORDS:
        return True  # "do forty, er, thirty five"
    counted = len(before) > 1 and read_ordinal(before[-2]) is not None and before[-1] in ("left", "right")
    return counted and bool(behind) and read_ordinal(behind[0]) is not None and before[-1] in behind


def _with_particles(words: list[str]) -> list[str]:
    """Returns the words with the particle of a verb beside it: "pick my son up" as "pick up my son".

    Units that are spelt out are joined: "k p h".
    """
    for place in range(len(words) - 2):
        if words[place] in ("k", "m") and words[place + 1 : place + 3] == ["p", "h"]:
            words = [*words[:place], f"{words[place]}ph", *words[place + 3 :]]
            break
    for place in range(1, len(words) - 2):
        if words[place] == "back" and words[place + 1] in _INTO and _LANES.intersection(words[place + 2 : place + 6]):
            words = [*words[:place], *words[place + 1 :]]  # "go back in the right lane"
            break
    for place, word in enumerate(words):
        if word not in _SEPARABLE:
            continue
        end = next((n for n in range(place + 2, min(place + 5, len(words))) if words[n] == "up"), None)
        if end is not None and _APART.isdisjoint(words[place + 1 : end]):
            return [*words[: place + 1], "up", *words[place + 1 : end], *words[end + 1 :]]
    return words


@functools.cache
def _first_names() -> frozenset[str]:
    """Returns the first names that the talk files give to people."""
    lines = [line for line in read_talk_files()[_NAMES_FILE].splitlines() if not line.startswith("#")]
    return frozenset(word.lower() for word in re.findall(r"\b[A-Z][a-z]+\b", " ".join(lines)))


def _with_people(words: list[str], names: Mapping[int, SlotValue]) -> list[str]:
    """Returns the words with the name of somebody who is fetched masked: "grab dave from the house".

    A "get" of people is read as "fetch".
    """
    grammar = route_grammar()
    for place in range(len(words) - 1):
        verb = words[place] in _FETCHES or words[place : place + 2] == ["pick", "up"]
        begin = place + 1 + (words[place] == "pick")
        name = words[begin] if begin < len(words) else ""
        following = words[begin + 1] if begin + 1 < len(words) else ","
        known = name in grammar.modifiers or (name in known_words() and name not in _first_names())
        known = known or grammar.terminals.longest([name], 0) is not None
        if verb and name.isalpha() and not known and following in _BEHIND_NAMES:
            words = [*words[:begin], _PERSON, *words[begin + 1 :]]
        elif words[place] in _GETS and _gets_people(words, names, place + 1):
            words = [*words[:place], _GETS[words[place]], *words[place + 1 :]]
    return words


def _gets_people(words: Sequence[str], names: Mapping[int, SlotValue], place: int) -> bool:
    """Returns whether somebody stands at a place behind a "get", and nothing that is got for them."""
    grammar = route_grammar()
    while place < len(words) and words[place] in grammar.modifiers and place not in names:
        place += 1
    people = grammar.people - _PRONOUNS | _first_names()
    person = place < len(words) and (words[place] in people or names.get(place) is ObjectClass.PEDESTRIAN)
    place += 1
    if words[place : place + 1] == [_PERSON]:
        place += 1  # "auntie Jo"
    return person and (place >= len(words) or words[place] in _BEHIND_NAMES | {"?", "now", "today", "when", "before"})


def _strangers(text: str) -> frozenset[str]:
    """Returns the words within a sentence that are written as names, and are none of the town's."""
    return frozenset(word.lower() for word in _CAPITALISED.findall(text)) - known_words()


def _sentence(text: str) -> Sentence | None:
    lists = word_lists()
    said = _with_particles(with_plain_lights(plain_orders(_plain(split_words(text), lists))))
    if not said:
        return None
    mentions, masked = find_names(said, statuses=False)
    strangers = _strangers(text)
    names = {mention.start: mention.value for mention in mentions}
    words = _with_people([_PERSON if word in strangers else word for word in mask_directions(masked, lists)], names)
    lead = {mention.start: mention.first for mention in mentions}
    contracted = frozenset(mention.start for mention in mentions if mention.contracted)
    clauses = ClauseReader(words=words, question=words[-1:] == ["?"] or words[-2:] in _OR_NOT, contracted=contracted)
    return Sentence(clauses, read_items(words, names, lead, contracted))
