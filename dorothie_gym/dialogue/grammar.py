"""The grammar behind the words: templates, afterthoughts and manners, read from data/grammar.yaml."""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from dorothie_gym.dialogue.lexicon import LexiconError, read_data, strings
from dorothie_gym.ontology import (
    SLOT_VALUES,
    DialogueMove,
    OntologyError,
    Role,
    Slot,
    parse_move,
    parse_role,
    parse_slot,
)

FIELD = re.compile(r"{(\w+)}")
"""A gap in a template."""

SLOT_FIELDS: Mapping[str, Slot] = {
    "do": Slot.ACTION,
    "doing": Slot.ACTION,
    "landmark": Slot.LANDMARK,
    "street": Slot.STREET,
    "object": Slot.OBJECT,
    "the_object": Slot.OBJECT,
    "state": Slot.STATUS,
    "is": Slot.STATUS,
    "order": Slot.STATUS,
    "tail": Slot.STATUS,
}
"""Gaps that the act's values fill, with their slot."""

CONTEXT_FIELDS = frozenset({"side", "nth", "speed", "distance", "past", "dropped"})
"""Gaps that the wording fills; `side` is a direction that is left or right."""

SPOKEN_SLOTS = (Slot.ACTION, Slot.LANDMARK, Slot.STREET, Slot.OBJECT, Slot.STATUS)
"""The slots that have words, in the order of afterthoughts."""

VOICES = (Role.PARTICIPANT, Role.CO_WIZARD)
"""The roles with words of their own."""

_NAMELESS = frozenset({"Unknown", "Unlabeled", "Queried"})


@dataclass(frozen=True)
class Template:
    """A sentence with gaps.

    Attributes:
        text: the words, gaps in braces.
        speaker: whose words they are; None for anybody's.
        when: for each slot, the labels its values must be among; the template then stands for the slot.
        topic: the topic it belongs to, or None.
        covers: the slots that it says.
        needs: the particulars (fields of the wording) that it says.
    """

    text: str
    speaker: Role | None
    when: Mapping[Slot, frozenset[str]]
    topic: str | None
    covers: frozenset[Slot]
    needs: frozenset[str]


@dataclass(frozen=True)
class Manners:
    """Words around the sentence, by (speaker, move).

    Attributes:
        openers: may be put in front, with a share of sentences that have one.
        closers: may be put behind, likewise.
    """

    openers: tuple[str, ...]
    closers: tuple[str, ...]
    opened: float
    closed: float


@dataclass(frozen=True)
class Grammar:
    """Templates and what goes with them.

    Attributes:
        templates: for each move.
        tails: for each slot, afterthoughts by move; under None those of the other moves.
        manners: openers and closers by speaker and move.
    """

    templates: Mapping[DialogueMove, tuple[Template, ...]]
    tails: Mapping[Slot, Mapping[DialogueMove | None, tuple[str, ...]]]
    manners: Mapping[tuple[Role, DialogueMove], Manners]


@functools.cache
def load_grammar() -> Grammar:
    """Returns the package's grammar, read once.

    Raises:
        LexiconError: if it names what does not exist, or leaves a move of a speaker without words.
    """
    return parse_grammar(read_data("grammar.yaml"))


def parse_grammar(data: Mapping[str, Any]) -> Grammar:
    """Returns the grammar in the data of a grammar file.

    Raises:
        LexiconError: as `load_grammar`.
    """
    templates: dict[DialogueMove, tuple[Template, ...]] = {}
    for move in DialogueMove:
        rules = data.get("moves", {}).get(move.label, [])
        listed = [template for number, rule in enumerate(rules) for template in _rule(f"{move.label}[{number}]", rule)]
        for voice in VOICES:
            # The template of last resort: no slot, no topic, no particulars. With it every act has words.
            if not any(_is_plain(template) and template.speaker in (None, voice) for template in listed):
                raise LexiconError(f"grammar.yaml: {move.label} has no template without slots for {voice.value}")
        templates[move] = tuple(listed)
    return Grammar(templates, _tails(data.get("tails", {})), _manners(data.get("manners", [])))


def _is_plain(template: Template) -> bool:
    return not template.covers and not template.needs and template.topic is None


def _rule(where: str, rule: Any) -> list[Template]:
    where = f"grammar.yaml: {where}"
    if not isinstance(rule, dict) or not {"say"} <= rule.keys() <= {"say", "who", "when", "topic"}:
        raise LexiconError(f"{where}: needs `say` and may have who, when, topic; got {rule!r}")
    when = {_slot(where, name): _labels(where, name, wanted) for name, wanted in rule.get("when", {}).items()}
    speaker = parse_role(rule["who"]) if "who" in rule else None
    return [_template(where, text, speaker, when, rule.get("topic")) for text in strings(where, rule["say"])]


def _template(
    where: str, text: str, speaker: Role | None, when: Mapping[Slot, frozenset[str]], topic: str | None
) -> Template:
    fields = set(FIELD.findall(text))
    needs = fields & CONTEXT_FIELDS
    unknown = fields - needs - SLOT_FIELDS.keys()
    if unknown:
        raise LexiconError(f"{where}: {text!r} has unknown gaps {sorted(unknown)}")
    covers = frozenset(SLOT_FIELDS[name] for name in fields - needs) | when.keys()
    return Template(text, speaker, when, topic, covers, frozenset(needs))


def _slot(where: str, name: str) -> Slot:
    try:
        return parse_slot(name)
    except OntologyError as error:
        raise LexiconError(f"{where}: {error}") from error


def _labels(where: str, slot: str, wanted: object) -> frozenset[str]:
    known = {value.label for value in SLOT_VALUES[_slot(where, slot)]}
    if wanted == "named":
        return frozenset(known - _NAMELESS)
    labels = {wanted} if isinstance(wanted, str) else set(strings(where, wanted))
    if not labels <= known:
        raise LexiconError(f"{where}: {slot} has no values {sorted(labels - known)}")
    return frozenset(labels)


def _tails(data: Mapping[str, Any]) -> dict[Slot, dict[DialogueMove | None, tuple[str, ...]]]:
    tails: dict[Slot, dict[DialogueMove | None, tuple[str, ...]]] = {}
    for slot in SPOKEN_SLOTS:
        where = f"grammar.yaml: tails.{slot.label}"
        tails[slot] = {
            None if key == "other" else parse_move(key): strings(f"{where}.{key}", listed)
            for key, listed in data.get(slot.label, {}).items()
        }
        if None not in tails[slot]:
            raise LexiconError(f"{where}.other is missing")
    return tails


def _manners(data: Any) -> dict[tuple[Role, DialogueMove], Manners]:
    manners: dict[tuple[Role, DialogueMove], Manners] = {}
    for number, rule in enumerate(data):
        where = f"grammar.yaml: manners[{number}]"
        openers, closers = strings(where, rule.get("openers", [])), strings(where, rule.get("closers", []))
        manner = Manners(openers, closers, float(rule.get("opened", 0)), float(rule.get("closed", 0)))
        for move in strings(where, rule.get("moves")):
            manners[parse_role(rule["who"]), parse_move(move)] = manner
    return manners
