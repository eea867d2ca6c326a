"""Entity recognition: names of places, streets, objects and statuses in words, exact, misspelt or misheard."""

from __future__ import annotations

import functools
import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from rapidfuzz import fuzz, process

from dorothie_gym.dialogue.lexicon import load_lexicon, read_data, split_words, strings
from dorothie_gym.dialogue.phrases import read_talk_files
from dorothie_gym.ontology.slots import Slot, SlotValue

# Spelling to sound, in order: silent letters, letter groups with one sound. A strong simplification of Metaphone
# (L. Philips, Computer Language 7(12), 1990), sufficient for confusions between English words.
_RULES: tuple[tuple[re.Pattern[str], str], ...] = tuple(
    (re.compile(pattern), sound)
    for pattern, sound in (
        (r"[^a-z]", ""),
        (r"^(kn|gn|pn)", "n"),
        (r"^wr", "r"),
        (r"^wh", "w"),
        (r"^x", "s"),
        (r"mb$", "m"),
        (r"tch", "C"),
        (r"ch", "C"),
        (r"sh|(ss|t|s)(?=ion)", "S"),
        (r"ph", "f"),
        (r"th", "T"),
        (r"ght", "t"),
        (r"gh", ""),
        (r"dge", "j"),
        (r"g(?=[eiy])", "j"),
        (r"c(?=[eiy])", "s"),
        (r"ck|c|q", "k"),
        (r"x", "ks"),
        (r"z", "s"),
        (r"(.)\1", r"\1"),
        (r"(?<=[aeiou])h(?![aeiou])", ""),
        (r"e$", ""),
    )
)
# Sounds that differ only in voicing or place are confused most often (Miller and Nicely, JASA 27, 1955).
_CLASSES = str.maketrans("bdgvjzTCS", "ptkfSsfSS")
_VOWELS = re.compile(r"[aeiouyw]+")


@functools.lru_cache(maxsize=16384)
def sound_of(word: str) -> str:
    """Returns the phonetic key of a lower-case word, with all vowels as "a"."""
    for pattern, sound in _RULES:
        word = pattern.sub(sound, word)
    first, rest = word[:1], word[1:]
    return (_VOWELS.sub("a", first) + _VOWELS.sub("a", rest)).translate(_CLASSES)


def skeleton_of(word: str) -> str:
    """Returns the consonants of the phonetic key of a lower-case word; equal for "bates" and "baits"."""
    sound = sound_of(word)
    return sound[:1] + sound[1:].replace("a", "")


# --- Entity recognition: names of places, streets, objects and statuses in words, exact, misspelt or mish ------------

_STREET_KINDS = frozenset({"street", "st", "road", "rd", "avenue", "ave", "drive", "dr", "boulevard", "blvd", "lane"})
_SHORTEST = 4
"""Shortest word that is matched approximately [letters]."""

_VERB_ENDINGS = ("'ll", "'re", "'ve", "'d", "n't")
"""Endings that exclude an approximate match: "she'll"."""

_SIMILAR = 84.0
"""Lowest similarity of a misspelt name (ratio of rapidfuzz) [percent]."""

_SIMILAR_SOUND = 60.0
"""Lowest similarity of a name with the same consonants (ratio of rapidfuzz) [percent]."""

_PROPER = frozenset({Slot.LANDMARK, Slot.STREET})


@dataclass(frozen=True)
class Mention:
    """Mention of a slot value in a sequence of words.

    Attributes:
        value: the slot value.
        start: index of its token in the masked words.
        guessed: whether the match is approximate.
        first: its first word.
        contracted: whether its last word ends in "'s".
    """

    value: SlotValue
    start: int
    guessed: bool = False
    first: str = ""
    contracted: bool = False


def find_names(words: Sequence[str], *, statuses: bool = True) -> tuple[list[Mention], list[str]]:
    """Finds the names in a sequence of words, preferring the longest match at each position.

    Args:
        words: lower-case words, see `lexicon.split_words`.
        statuses: whether to find statuses ("instead of", "done") as well.

    Returns:
        The mentions in order, and the words with each mention replaced by "#landmark", "#street", "#object" or
        "#status", or by "#what" for a queried value.
    """
    first_words, known = _first_words(), known_words()
    words = tuple(words)
    mentions: list[Mention] = []
    masked: list[str] = []
    place = 0
    while place < len(words):
        word = words[place]
        if word in known and word not in first_words:
            masked.append(word)
            place += 1
            continue
        value, length = _at(words, place, statuses)
        if value is None:
            length = _until_name(words, place, length, statuses)
            masked += words[place : place + length]
        else:
            guessed = word not in first_words and word.removesuffix("'s") not in first_words
            contracted = words[place + length - 1].endswith("'s")
            mentions.append(Mention(value, len(masked), guessed=guessed, first=word, contracted=contracted))
            masked.append("#what" if value.label == "Queried" else f"#{value.slot.label.lower()}")
            if value.slot is Slot.STREET and place + length < len(words):
                length += words[place + length] in _STREET_KINDS
        place += length
    return mentions, masked


def _until_name(words: tuple[str, ...], place: int, length: int, statuses: bool) -> int:
    """Returns the number of words of no name, up to a name that reaches beyond them: "the" of "the car in front"."""
    for skipped in range(1, length):
        value, behind = _at(words, place + skipped, statuses)
        if value is not None and skipped + behind > length:
            return skipped
    return length


def _at(words: tuple[str, ...], place: int, statuses: bool) -> tuple[SlotValue | None, int]:
    for length, names in _index(statuses).get(words[place], ()):
        name = words[place : place + length]
        if name in names:
            return names[name], length
    word = words[place].removesuffix("'s")
    if word != words[place] and (word,) in load_lexicon().names:
        return load_lexicon().names[word,], 1
    if len(word) >= _SHORTEST and word not in known_words() and not word.endswith(_VERB_ENDINGS):
        return nearest_name(word), 1
    return None, 1


@functools.lru_cache(maxsize=4096)
def nearest_name(word: str) -> SlotValue | None:
    """Returns the landmark or street that best matches a misspelt or misheard word, or None.

    Args:
        word: lower-case word that is not an ordinary English word.
    """
    names = _proper_names()
    found = process.extractOne(word, list(names), scorer=fuzz.ratio, score_cutoff=_SIMILAR_SOUND)
    if found is None:
        return None
    name, similarity, _ = found
    if similarity >= _SIMILAR or skeleton_of(name) == skeleton_of(word):
        return names[name]
    return None


@functools.cache
def _first_words() -> frozenset[str]:
    """Returns the first words of names, and of phrases to ignore."""
    return frozenset(_index(True))


_Names: TypeAlias = Mapping[tuple[str, ...], SlotValue | None]


@functools.cache
def _index(statuses: bool) -> Mapping[str, tuple[tuple[int, _Names], ...]]:
    """Returns the names by first word and number of words, the longest first; the value None marks phrases to ignore.

    Landmarks of several words have a form in "'s" as well.
    """
    found: dict[str, dict[int, dict[tuple[str, ...], SlotValue | None]]] = defaultdict(lambda: defaultdict(dict))
    for name in load_lexicon().ignored:
        found[name[0]][len(name)][name] = None
    for name, value in load_lexicon().names.items():
        if statuses or value.slot is not Slot.STATUS:
            same = found[name[0]][len(name)]
            same.setdefault(name, value)
            if len(name) > 1 and value.slot is Slot.LANDMARK:
                same.setdefault((*name[:-1], f"{name[-1]}'s"), value)
    return {first: tuple(sorted(named.items(), reverse=True)) for first, named in found.items()}


@functools.cache
def _proper_names() -> Mapping[str, SlotValue]:
    names = load_lexicon().names.items()
    words = {name[0]: value for name, value in names if len(name) == 1 and value.slot in _PROPER}
    spoken = {word.lower() for value, forms in load_lexicon().phrases.items() for word in _proper_words(value, forms)}
    return {word: value for word, value in words.items() if word in spoken and len(word) >= _SHORTEST}


def _proper_words(value: SlotValue, forms: Mapping[str, tuple[str, ...]]) -> list[str]:
    """Returns the capitalized one-word names; only these are matched approximately."""
    return [phrase for phrase in forms["say"] if value.slot in _PROPER and phrase[0].isupper() and " " not in phrase]


@functools.cache
def known_words() -> frozenset[str]:
    """Returns the words that are never matched approximately."""
    spoken = " ".join(read_talk_files().values()).lower()
    listed = strings("cues.yaml: known", read_data("cues.yaml").get("known"))
    other = {word for name in load_lexicon().names for word in name if len(name) > 1}
    return frozenset(re.findall(r"[a-z']+", spoken)) | other | {word for text in listed for word in split_words(text)}
