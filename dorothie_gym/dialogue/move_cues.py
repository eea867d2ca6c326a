"""Cues of the dialogue moves: patterns and words of data/cues.yaml by which a text is classified."""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping
from dataclasses import dataclass

from dorothie_gym.dialogue.lexicon import YamlMapping, read_data, strings
from dorothie_gym.dialogue.pattern_index import PatternIndex
from dorothie_gym.errors import OntologyError, PhraseFileError
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.spellings import parse_move

_DOMAIN_RULE = "%domain"
_WORD_LISTS = ("domain", "small_talk", "reports")


@dataclass(frozen=True)
class MoveRule:
    """Rule with the cues of one move.

    Attributes:
        move: the move.
        masked: pattern over masked words.
        acted: pattern over words with actions masked as well.
        domain: whether any driving-domain word is a cue.
        words: words of which one must occur before the patterns are tried; empty for no condition.
    """

    move: DialogueMove
    masked: re.Pattern[str] | None
    acted: re.Pattern[str] | None
    domain: bool
    words: frozenset[str]


@dataclass(frozen=True)
class MoveCues:
    """Cues of all moves.

    Attributes:
        rules: rules in order; the first match decides.
        answers: for each preceding move, replacements of the classified move.
        domain: words of the driving domain.
        small_talk: words of small talk.
        reports: words that report a wish, which exclude small talk.
    """

    rules: tuple[MoveRule, ...]
    answers: Mapping[DialogueMove, Mapping[DialogueMove, DialogueMove]]
    domain: frozenset[str]
    small_talk: frozenset[str]
    reports: frozenset[str]

    @functools.cached_property
    def masked(self) -> PatternIndex:
        """Index of the rules by their patterns over masked words."""
        return PatternIndex([rule.masked for rule in self.rules])

    @functools.cached_property
    def acted(self) -> PatternIndex:
        """Index of the rules by their patterns over words with actions masked."""
        return PatternIndex([rule.acted for rule in self.rules])

    @functools.cached_property
    def by_domain(self) -> int:
        """Rules for which any word of the driving domain is a cue, as the index numbers them."""
        return sum(1 << number for number, rule in enumerate(self.rules) if rule.domain)


@functools.cache
def move_cues() -> MoveCues:
    """Returns the cached cues of the package.

    Raises:
        PhraseFileError: a rule of cues.yaml is malformed, or a move has none.
    """
    data = read_data("cues.yaml")
    terms = {
        "{soft}": data.get("soft", ""),
        "{verb}": f"(?:{'|'.join(strings('cues.yaml: verbs', data.get('verbs')))})",
    }
    rules = tuple(_rule(f"cues.yaml: moves[{n}]", rule, terms) for n, rule in enumerate(data.get("moves", [])))
    ruled = {rule.move for rule in rules}
    if missing := [move.label for move in DialogueMove if move not in ruled]:
        raise PhraseFileError(f"dorothie_gym/dialogue/data/cues.yaml: moves has no rule for {', '.join(missing)}")
    answers = {
        parse_move(before): {parse_move(guess): parse_move(move) for guess, move in changes.items()}
        for before, changes in data.get("answers", {}).items()
    }
    words = {name: frozenset(strings(f"cues.yaml: {name}", data.get(name))) for name in _WORD_LISTS}
    return MoveCues(rules, answers, **words)


def _rule(where: str, rule: YamlMapping, terms: Mapping[str, str]) -> MoveRule:
    texts = list(strings(f"{where}.cues", rule.get("cues")))
    for name, expression in terms.items():
        texts = [text.replace(name, expression) for text in texts]
    try:
        move = parse_move(rule["move"])
        acted = _either([text[1:] for text in texts if text.startswith("@")])
        masked = _either([text for text in texts if text[0] not in "@%"])
    except (re.error, OntologyError) as error:
        raise PhraseFileError(f"{where}: {error}") from error
    words = frozenset(strings(f"{where}.words", rule.get("words", [])))
    return MoveRule(move, masked, acted, _DOMAIN_RULE in texts, words)


def _either(patterns: list[str]) -> re.Pattern[str] | None:
    for pattern in patterns:
        re.compile(pattern)  # compiled separately, so that the error message shows the faulty pattern
    return re.compile("|".join(f"(?:{pattern})" for pattern in patterns)) if patterns else None
