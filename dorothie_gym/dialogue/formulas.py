"""Formulas: utterances, or parts of them, that are understood as a whole, and the answers with which a span begins."""

from __future__ import annotations

import functools
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.lexicon import read_data, split_words, strings
from dorothie_gym.dialogue.route_grammar import PhraseIndex
from dorothie_gym.dialogue.signs import behind_signs
from dorothie_gym.errors import PhraseFileError
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.spellings import parse_move

if TYPE_CHECKING:
    from dorothie_gym.dialogue.nlu import ParsedText

_FILLER: Final = "Filler"
_DECIDING: Final = frozenset({DialogueMove.CONFUSE.label, DialogueMove.CONFIRM.label})
"""Moves whose formulas decide for others beside them: "okay, will do"."""

_PARTS_OF_NO: Final = frozenset(
    {"idea", "clue", "worries", "problem", "rush", "hurry", "bother", "trouble", "way", "need"}
)
"""Words behind which "no" is part of a phrase."""

OPENING_YES: Final = frozenset({"yeah", "aye", "yep", "yes", "righto", "ya"})
"""Words for yes at the beginning of an utterance."""


_SENT_ON: Final = re.compile(r"\byou (?:can|may|could) (?:go|carry|drive) (?:on|ahead)\b")
"""Permission to drive on, of which formulas would make two signs: "you can", "go on"."""


def formula_move(words: Sequence[str]) -> DialogueMove | None:
    """Returns the move of words that consist of formulas only ("right, okay, thank you"); None of other words."""
    words = [word for word in words if word != ","]
    if not words or not _formulas().may_begin(words[0]):
        return None
    if _SENT_ON.search(" ".join(words)):
        return None
    formulas, place = _formulas(), 0
    found: DialogueMove | None = None
    while place < len(words):
        match = formulas.longest(words, place)
        if match is None:
            return None
        if match.kind != _FILLER and (found is None or match.kind in _DECIDING):
            found = parse_move(match.kind)
        place += match.length
    return found


@functools.cache
def formula_moves() -> frozenset[DialogueMove]:
    """Returns the moves that have formulas; the cues alone tell others."""
    return frozenset(parse_move(kind) for kind in read_data("formulas.yaml") if kind != _FILLER)


@functools.cache
def _formulas() -> PhraseIndex:
    rows = []
    for kind, phrases in read_data("formulas.yaml").items():
        if kind != _FILLER:
            parse_move(kind)
        rows += [("formulas", kind, text) for text in strings(f"formulas.yaml: {kind}", phrases)]
    if not rows:
        raise PhraseFileError("formulas.yaml: lists no phrases")
    return PhraseIndex(rows, adverbs=False)


def first_answer(parsed: ParsedText) -> DialogueMove | None:
    """Returns the answer with which a span begins, before its first comma; None without any."""
    words = _without_restart(split_words(parsed.text))
    if "," not in words:
        return None
    move = formula_move(words[: words.index(",")])
    return move if move in (DialogueMove.REPLY_Y, DialogueMove.REPLY_N, DialogueMove.REPLY_U) else None


def leading_answer(parsed: ParsedText) -> DialogueMove | None:
    """Returns the yes or no with which a span begins, behind its interjections, or ends: "Beal, yes"."""
    text = parsed.text.lower()
    words = split_words(behind_signs(text, DialogueMove.QUERY_YN) or text)
    if words[:1] and words[0] in ("no", "nope", "nah", "naw") and _PARTS_OF_NO.isdisjoint(words[1:2]):
        return DialogueMove.REPLY_N
    agrees = words[:1] and (words[0] in OPENING_YES or (words[-2:-1] == [","] and words[-1] in OPENING_YES))
    return DialogueMove.REPLY_Y if agrees else None


def _without_restart(words: list[str]) -> list[str]:
    """Returns the words without a first word that is said twice: "I, I think so"."""
    return words[2:] if len(words) > 2 and words[1] == "," and words[2] == words[0] else words
