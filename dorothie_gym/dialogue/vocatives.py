"""Vocatives: words by which a speaker addresses the listener, which say nothing about the drive."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dorothie_gym.dialogue.directions import WordLists

_OWNERS = frozenset({"my", "you", "me", "our"})
_FOND = frozenset(
    {"dear", "good", "old", "lovely", "young", "sweet", "darling", "kind", "little", "big", "brave", "fine", "clever"}
)
_ADDRESSEES = frozenset(
    {
        "boy", "chap", "fellow", "lad", "man", "woman", "lady", "girl", "friend", "fella", "child", "sir", "thing",
        "soul", "sweetheart", "love", "dear", "sport", "chum", "pal", "bean", "son", "lass", "gentleman", "angel",
    }
)  # fmt: skip
"""Nouns with which somebody is spoken to."""

_LONGEST = 4
_LEAST = 2
_ENDEARING = frozenset({"my", "dear", "lovely", "old"})
_AFTER_ADDRESSEE = frozenset(
    {
        ",", "?", "please", "can", "could", "would", "will", "are", "do", "did", "have", "is", "how", "what", "where",
        "which", "who", "i", "we", "let's", "turn", "stop", "go", "take", "drive", "slow", "keep", "head", "follow",
        "make", "pull", "just",
    }
)  # fmt: skip
"""Words behind a vocative that has no comma: "hey car ahead" warns of a car, "hey car turn left" speaks to it."""


def without_vocative(words: list[str], lists: WordLists) -> list[str]:
    """Returns the words without a vocative at the end ("stop here, man"), at the beginning or behind a greeting."""
    while words and words[-1] == ",":
        words.pop()
    words = _without_endearment(_without_addressee(words, lists))
    marked = words[-1:] == ["?"]
    end = len(words) - marked
    for length in (1, 2):
        if (
            end > length + 1
            and words[end - length - 1] == ","
            and " ".join(words[end - length : end]) in lists.vocatives
        ):
            return words[: end - length - 1] + words[end:]
        if len(words) > length + 1 and words[length] == "," and " ".join(words[:length]) in lists.vocatives:
            return words[length + 1 :]
    return words


def _without_endearment(words: list[str]) -> list[str]:
    """Returns the words without "my dear boy" or "you lovely man" in front of the first, or behind the last comma."""
    if "," not in words:
        return words
    first = words.index(",")
    if is_endearment(words[:first]) and first + 1 < len(words):
        return words[first + 1 :]
    last = len(words) - words[::-1].index(",") - 1
    marked = words[-1:] == ["?"]
    if is_endearment(words[last + 1 : len(words) - marked]):
        return words[:last] + words[len(words) - marked :]
    return words


def is_endearment(part: Sequence[str]) -> bool:
    """Returns whether words are an owner or "you", endearments, and a noun for somebody."""
    if not 1 < len(part) <= _LONGEST or part[-1] not in _ADDRESSEES or part[0] not in (*_OWNERS, *_FOND):
        return False
    return all(word in _FOND for word in part[1:-1]) and (len(part) > _LEAST or part[0] != "my")


def _without_addressee(words: list[str], lists: WordLists) -> list[str]:
    """Returns the words without a vocative that follows a greeting or thanks, a comma between or not: "hi dear car"."""
    opening = next((n for n in (2, 1) if " ".join(words[:n]) in lists.addressing and len(words) > n), 0)
    if not opening:
        return words
    begin = opening + (words[opening] == ",")
    begin += words[begin : begin + 1] != [] and words[begin] in _ENDEARING
    for end in (begin + 2, begin + 1):
        if " ".join(words[begin:end]) in lists.vocatives and (end >= len(words) or words[end] in _AFTER_ADDRESSEE):
            joint = [","] if end < len(words) and words[end] not in (",", "?") else []
            return words[:opening] + joint + words[end:]
    return words


def without_asides(words: list[str], lists: WordLists, *, machines: bool = False) -> list[str]:
    """Returns the words without vocatives between commas, and without plain ones at the end: "left here, hun".

    Args:
        words: lower-case words.
        lists: word lists with the vocatives.
        machines: whether only those for a car or a robot are left out.
    """
    kept: list[str] = []
    part: list[str] = []
    for word in [*words, ","]:
        if word not in (",", "?"):
            part.append(word)
            continue
        aside = " ".join(part) in lists.vocatives and part[-1] != "friend"
        if aside and machines:
            aside = part[-1] in _MACHINES
        if not aside:
            while not machines and len(part) > 1 and part[-1] in lists.vocatives and not _is_noun(part):
                part.pop()
            kept += [*part, word]
        elif word == "?":
            kept.append(word)
        part = []
    return kept[:-1] if kept[-1:] == [","] else kept


def _is_noun(words: list[str]) -> bool:
    """Returns whether the last word stands for somebody rather than addresses somebody: "pick up my buddy"."""
    return words[-1] in _ALSO_NOUNS or words[-2] in _BEFORE_NOUNS


_MACHINES = frozenset({"car", "robot"})
_BEFORE_NOUNS = frozenset({"my", "our", "your", "the", "a", "his", "her", "that", "this", "is"})
_ALSO_NOUNS = frozenset({"car", "driver", "friend", "love", "robot", "captain", "folks", "kids", "guys", "pet"})
"""Vocatives that are as well the last noun of a sentence."""
