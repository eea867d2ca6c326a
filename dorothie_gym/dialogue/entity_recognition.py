"""Finding names in words: as the lexicon has them, misspelt, or misheard."""

from __future__ import annotations

import functools
import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from rapidfuzz import fuzz, process

from dorothie_gym.dialogue.lexicon import load_lexicon, read_data, split_words, strings
from dorothie_gym.dialogue.phonetics import skeleton_of
from dorothie_gym.dialogue.talk_files import read_talk_files
from dorothie_gym.ontology import Slot, SlotValue

_STREET_KINDS = frozenset({"street", "st", "road", "rd", "avenue", "ave", "drive", "dr", "boulevard", "blvd", "lane"})
_SHORTEST = 4
"""Names of fewer letters are understood only as they are."""

_VERB_ENDINGS = ("'ll", "'re", "'ve", "'d", "n't")
"""No name ends so, whatever it sounds like: "she'll"."""

_ALIKE = 84.0
"""Least likeness of a misspelt name, in percent of letters that need no change (rapidfuzz's ratio)."""

_SOUNDING_ALIKE = 60.0
"""Least likeness of letters where a name sounds the same."""

_PROPER = frozenset({Slot.LANDMARK, Slot.STREET})


@dataclass(frozen=True)
class Mention:
    """A name found in a row of words.

    Attributes:
        value: what is named.
        start: index of the token that stands for it in the masked words.
        guessed: whether the word is only like the name.
    """

    value: SlotValue
    start: int
    guessed: bool = False


def find_names(words: Sequence[str]) -> tuple[list[Mention], list[str]]:
    """Finds names, the longest first at each place.

    Args:
        words: lower-case words, see `lexicon.split_words`.

    Returns:
        The mentions in order, and the words with each mention replaced by "#landmark", "#street", "#object" or
        "#status"; by "#what" if it is what somebody asks for.
    """
    index, known = _index(), _known_words()
    words = tuple(words)
    mentions: list[Mention] = []
    masked: list[str] = []
    place = 0
    while place < len(words):
        word = words[place]
        if word not in index and word in known:
            masked.append(word)
            place += 1
            continue
        value, length = _at(words, place)
        if value is None:
            masked += words[place : place + length]
        else:
            mentions.append(
                Mention(value, len(masked), guessed=word not in index and word.removesuffix("'s") not in index)
            )
            masked.append("#what" if value.label == "Queried" else f"#{value.slot.label.lower()}")
            if value.slot is Slot.STREET and place + length < len(words):
                length += words[place + length] in _STREET_KINDS
        place += length
    return mentions, masked


def _at(words: tuple[str, ...], place: int) -> tuple[SlotValue | None, int]:
    for name, value in _index().get(words[place], ()):
        if words[place : place + len(name)] == name:
            return value, len(name)
    word = words[place].removesuffix("'s")
    if word != words[place] and (word,) in load_lexicon().names:
        return load_lexicon().names[word,], 1
    if len(word) >= _SHORTEST and word not in _known_words() and not word.endswith(_VERB_ENDINGS):
        return nearest_name(word), 1
    return None, 1


@functools.lru_cache(maxsize=4096)
def nearest_name(word: str) -> SlotValue | None:
    """Returns the place or street that a misspelt or misheard word is meant for, or None.

    Args:
        word: one lower-case word that is no ordinary English word.
    """
    names = _proper_names()
    found = process.extractOne(word, list(names), scorer=fuzz.ratio, score_cutoff=_SOUNDING_ALIKE)
    if found is None:
        return None
    name, likeness, _ = found
    if likeness >= _ALIKE or skeleton_of(name) == skeleton_of(word):
        return names[name]
    return None


@functools.cache
def _index() -> Mapping[str, tuple[tuple[tuple[str, ...], SlotValue | None], ...]]:
    """Names by their first word, the longest first; None stands for what only sounds like one."""
    found: dict[str, list[tuple[tuple[str, ...], SlotValue | None]]] = defaultdict(list)
    for name in load_lexicon().ignored:
        found[name[0]].append((name, None))
    for name, value in load_lexicon().names.items():
        found[name[0]].append((name, value))
    return {first: tuple(sorted(named, key=lambda item: -len(item[0]))) for first, named in found.items()}


@functools.cache
def _proper_names() -> Mapping[str, SlotValue]:
    names = load_lexicon().names.items()
    words = {name[0]: value for name, value in names if len(name) == 1 and value.slot in _PROPER}
    spoken = {word.lower() for value, forms in load_lexicon().phrases.items() for word in _proper_words(value, forms)}
    return {word: value for word, value in words.items() if word in spoken and len(word) >= _SHORTEST}


def _proper_words(value: SlotValue, forms: Mapping[str, tuple[str, ...]]) -> list[str]:
    """Returns the names of one word that are written with a capital: only they are ever unknown to a listener."""
    return [phrase for phrase in forms["say"] if value.slot in _PROPER and phrase[0].isupper() and " " not in phrase]


@functools.cache
def _known_words() -> frozenset[str]:
    """Words that are never taken for a misheard name."""
    spoken = " ".join(read_talk_files().values()).lower()
    listed = strings("cues.yaml: known", read_data("cues.yaml").get("known"))
    other = {word for name in load_lexicon().names for word in name if len(name) > 1}
    return frozenset(re.findall(r"[a-z']+", spoken)) | other | {word for text in listed for word in split_words(text)}
