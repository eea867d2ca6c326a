"""Features of the words of an utterance, from which a trained tagger finds its spans and their moves.

They are the words themselves, with names masked, their marks, and how the rules have read them.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.entity_recognition import known_words, nearest_name
from dorothie_gym.dialogue.formulas import formula_move
from dorothie_gym.dialogue.lexicon import load_lexicon, split_words
from dorothie_gym.dialogue.nlu import understand
from dorothie_gym.dialogue.span_inputs import (
    ACTIONS,
    CONTINUED,
    LANDMARK,
    MARKS,
    MOODS,
    NO_WORD,
    NUMBER,
    SIGNS,
    STREET,
    SpanFeatures,
)
from dorothie_gym.ontology.slots import Slot, SlotValue

if TYPE_CHECKING:
    from dorothie_gym.dialogue.clause_moods import ClauseMood
    from dorothie_gym.dialogue.conversation import Span
    from dorothie_gym.ontology.dialogue_acts import DialogueMove

_SHORTEST: Final = 4
"""Shortest word that may be a misheard name [letters]."""

_LEADING: Final = re.compile(r"^[.?!,;:'\"\u2026(\u2014-]+")
_TRAILING: Final = re.compile(r"[.?!,;:\u2026\u2014-]+$")


def span_features(spans: Sequence[Span], after: DialogueMove | None) -> SpanFeatures:
    """Returns the features of an utterance.

    Args:
        spans: its spans by the rules, which know the move before it.
        after: move of the other speaker before it.
    """
    tokens: list[str] = []
    begins: list[bool] = []
    moves: list[DialogueMove] = []
    signs: list[tuple[int, ...]] = []
    for span in spans:
        said = span.text.split()
        tokens += said
        begins += [number == 0 for number in range(len(said))]
        moves += [span.act.move] * len(said)
        signs += [_signs(span)] * len(said)
    return SpanFeatures(
        words=tuple(masked_words([_bare(token) for token in tokens])),
        marks=tuple(map(_mark, tokens)),
        begins=tuple(begins),
        moves=tuple(moves),
        signs=tuple(signs),
        after=after,
    )


def _signs(span: Span) -> tuple[int, ...]:
    """Returns what the parser tells of a span."""
    parsed = understand(span.text)
    parse = parsed.parse
    if parse is None:
        return (0,) * SIGNS
    found = [0] * (2 * (1 + len(MOODS)))
    found[_number_of(parse.moods[:1])] = 1
    found[1 + len(MOODS) + _number_of(parse.moods[-1:])] = 1
    answers = (
        bool(parse.plan.steps),
        bool(parse.described) and not parse.plan.steps,
        parsed.question,
        bool(parsed.values),
        formula_move(split_words(span.text)) is not None,
        parse.repaired,
        bool(parse.denied),
        bool(parsed.landmarks or parsed.streets),
        parsed.told is not None,
        parsed.affirms is not None,
    )
    return (*found, *map(int, answers), *action_signs(span.act.slots))


def action_signs(values: frozenset[SlotValue]) -> tuple[int, ...]:
    """Returns for each of the `ACTIONS` whether it is among slot values, 0 or 1."""
    return tuple(int(action in values) for action in ACTIONS)


def _number_of(moods: Sequence[ClauseMood]) -> int:
    return 1 + MOODS.index(moods[0]) if moods else 0


def _bare(token: str) -> str:
    """Returns a token in lower case without the marks around it."""
    return _TRAILING.sub("", _LEADING.sub("", token.lower().replace("\u2019", "'"))) or NO_WORD


def _mark(token: str) -> int:
    found = _TRAILING.search(token)
    if found is None:
        return 0
    return MARKS.index(found[0][0]) if found[0][0] in MARKS else len(MARKS) - 1


def masked_words(words: Sequence[str]) -> list[str]:
    """Returns words with those of landmarks and streets, and numbers in digits, masked, one mask a word."""
    masked: list[str] = []
    while len(masked) < len(words):
        place = len(masked)
        value, length = _name_at(words, place)
        if value is not None:
            masked += [LANDMARK if value.slot is Slot.LANDMARK else STREET, *[CONTINUED] * (length - 1)]
        else:
            masked.append(NUMBER if words[place][:1].isdigit() else words[place])
    return masked


def _name_at(words: Sequence[str], place: int) -> tuple[SlotValue | None, int]:
    """Returns the name that begins at a place, with its number of words; None for other words."""
    word = words[place]
    base = word.removesuffix("'s")
    for name, value in _names().get(word, ()) or _names().get(base, ()):
        said = words[place : place + len(name)]
        if (*said[:-1], said[-1].removesuffix("'s")) == name or tuple(said) == name:
            return value, len(name)
    if len(base) >= _SHORTEST and base.isalpha() and base not in known_words():
        return nearest_name(base), 1
    return None, 1


@functools.cache
def _names() -> Mapping[str, list[tuple[tuple[str, ...], SlotValue]]]:
    """Returns the names of landmarks and streets by their first word, the longest first."""
    found: dict[str, list[tuple[tuple[str, ...], SlotValue]]] = {}
    for name, value in load_lexicon().names.items():
        if value.slot in (Slot.LANDMARK, Slot.STREET) and value.label != "Queried":
            found.setdefault(name[0], []).append((name, value))
    return {first: sorted(named, key=lambda item: -len(item[0])) for first, named in found.items()}
