"""Surface text: an act, its speaker and what else is known become a short spoken English sentence.

The template of the grammar that says most of what is known is used, several equally good ones by chance; what it leaves
out is appended as an afterthought.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

import numpy as np

from dorothie_gym.dialogue.grammar import (
    CONTEXT_FIELDS,
    FIELD,
    SLOT_FIELDS,
    SPOKEN_SLOTS,
    Manners,
    Template,
    load_grammar,
)
from dorothie_gym.dialogue.lexicon import LexiconError, load_lexicon
from dorothie_gym.dialogue.numerals import cardinal, ordinal
from dorothie_gym.dialogue.wording import Direction, Wording
from dorothie_gym.ontology import ActionValue, DialogueAct, Role, Slot, SlotValue

MAX_CHARACTERS = 160
"""Longest text [characters]."""

_Option = TypeVar("_Option")


def word_act(act: DialogueAct, speaker: Role, rng: np.random.Generator, context: Wording | None = None) -> str:
    """Words one act.

    Every act gets a text. One that carries more than can be said in a breath is said in part: at most three names of a
    kind, and afterthoughts only as far as `MAX_CHARACTERS` allows.

    Args:
        act: move and slot values.
        speaker: who speaks; the Ad-Wizard speaks as the participant does, the car itself as the Co-Wizard.
        rng: chooses among equally good wordings.
        context: particulars that the slots do not carry.

    Returns:
        A text of 1 to `MAX_CHARACTERS` characters.
    """
    voice = Role.PARTICIPANT if speaker in (Role.PARTICIPANT, Role.AD_WIZARD) else Role.CO_WIZARD
    wording = Wording() if context is None else context
    for names in (3, 1):
        text = _Writer(act, voice, rng, wording, names).text()
        if len(text) <= MAX_CHARACTERS:
            return text
    raise LexiconError(f"grammar.yaml: {act.move.label} gives a text longer than {MAX_CHARACTERS} characters: {text!r}")


class _Writer:
    """Writes one sentence."""

    def __init__(self, act: DialogueAct, voice: Role, rng: np.random.Generator, wording: Wording, names: int) -> None:
        self._lexicon = load_lexicon()
        self._grammar = load_grammar()
        self._act = act
        self._voice = voice
        self._rng = rng
        self._wording = wording
        self._names = names
        self._values = {slot: act.values(slot) for slot in SPOKEN_SLOTS if act.values(slot)}
        self._context = self._particulars()

    def text(self) -> str:
        template = self._choose()
        body, close = _split_close(self._fill(template))
        manners = self._grammar.manners.get((self._voice, self._act.move))
        # A bare answer or a set phrase stands as it is: manners go with what has content.
        if manners is not None and template.covers and template.topic is None:
            body = self._mannered(body, manners)
        for slot in SPOKEN_SLOTS:
            if slot in self._values and slot not in template.covers:
                tail = self._tail(slot)
                if len(body) + len(tail) + len(close) < MAX_CHARACTERS:
                    body += tail
        return self._punctuate(body + close)

    def _choose(self) -> Template:
        fitting = [template for template in self._grammar.templates[self._act.move] if self._fits(template)]
        best = max(map(self._merit, fitting))
        return self._pick([template for template in fitting if self._merit(template) == best])

    def _fits(self, template: Template) -> bool:
        return (
            template.speaker in (None, self._voice)
            and template.topic in (None, self._wording.topic)
            and template.covers <= self._values.keys()
            and template.needs <= self._context.keys()
            and all({value.label for value in self._values[slot]} <= labels for slot, labels in template.when.items())
        )

    def _merit(self, template: Template) -> tuple[bool, int, int, int]:
        return template.topic is not None, len(template.covers), len(template.needs), len(template.when)

    def _fill(self, template: Template) -> str:
        without = self._wording.dropped if "dropped" in template.needs else None
        return FIELD.sub(lambda gap: self._phrase(gap[1], without), template.text)

    def _phrase(self, name: str, without: SlotValue | None = None) -> str:
        """Returns the words for a gap; `without` is a landmark that has been named already."""
        if name in CONTEXT_FIELDS:
            return self._context[name]
        values = self._values[SLOT_FIELDS[name]]
        if name in ("do", "doing"):
            # Two things to do are as many as one sentence can bear.
            return self._join([self._action(value, name) for value in values[: min(2, self._names)]])
        if name == "is":
            return "are" if len(self._values.get(Slot.LANDMARK, ())[: self._names]) > 1 else "is"
        if name == "landmark":
            values = tuple(value for value in values if value is not without) or values
        form = {"the_object": "the", "order": "order", "tail": "tail"}.get(name, "say")
        return self._join([self._pick(self._lexicon.forms(value, form)) for value in values[: self._names]])

    def _action(self, value: SlotValue, form: str) -> str:
        assert isinstance(value, ActionValue)
        manners = self._lexicon.actions[value].manners
        manner = next(manner for manner in self._manner_keys(value) if manner in manners)
        return FIELD.sub(lambda gap: self._action_field(gap[1]), self._pick(manners[manner][form]))

    def _action_field(self, name: str) -> str:
        return str(self._wording.direction) if name == "direction" else self._context[name]

    def _manner_keys(self, value: ActionValue) -> list[str]:
        """Returns the manners that the wording allows for `value`, the most telling first."""
        base = _base(value, self._wording)
        details = [
            detail
            for detail, known in (
                ("nth", "nth" in self._context),
                ("past", "past" in self._context),
                ("here", self._wording.here),
                ("in", "distance" in self._context),
                ("to", "speed" in self._context),
            )
            if known
        ]
        if base is None:
            return [*details, "plain"]
        return [*(f"{base}_{detail}" for detail in details), base, *details, "plain"]

    def _particulars(self) -> dict[str, str]:
        """Returns the words for what the wording knows, by field."""
        wording = self._wording
        found: dict[str, str] = {}
        if wording.direction in (Direction.LEFT, Direction.RIGHT):
            found["side"] = str(wording.direction)
        if wording.ordinal is not None:
            found["nth"] = "next" if wording.ordinal == 1 else ordinal(wording.ordinal)
        if wording.speed is not None:
            found["speed"] = cardinal(round(wording.speed))
        if wording.distance is not None:
            found["distance"] = f"{cardinal(max(10, 10 * round(wording.distance / 10)))} meters"
        for name, landmark in (("past", wording.past), ("dropped", wording.dropped)):
            if landmark is not None:
                found[name] = self._pick(self._lexicon.forms(landmark, "say"))
        return found

    def _tail(self, slot: Slot) -> str:
        tails = self._grammar.tails[slot]
        text = self._pick(tails.get(self._act.move) or tails[None])
        return FIELD.sub(lambda gap: self._phrase(gap[1]), text)

    def _mannered(self, body: str, manners: Manners) -> str:
        if manners.openers and self._rng.random() < manners.opened:
            body = f"{self._pick(manners.openers)} {body}"
        if manners.closers and self._rng.random() < manners.closed:
            body = f"{body}{self._pick(manners.closers)}"
        return body

    def _punctuate(self, sentence: str) -> str:
        # Typed transcripts of people are half in lower case without a stop; what the car says is set properly.
        if self._voice is Role.PARTICIPANT and self._rng.random() < 0.5:
            return sentence
        return sentence[0].upper() + sentence[1:] + ("" if sentence.endswith("?") else ".")

    def _join(self, phrases: Sequence[str]) -> str:
        unique = list(dict.fromkeys(phrases))
        if len(unique) == 1:
            return unique[0]
        return ", ".join(unique[:-1]) + " and " + unique[-1]

    def _pick(self, options: Sequence[_Option]) -> _Option:
        return options[int(self._rng.integers(len(options)))]


def _split_close(sentence: str) -> tuple[str, str]:
    """Returns what comes before and behind the place for afterthoughts: a "|", else the end but for a question mark."""
    if "|" in sentence:
        body, _, close = sentence.partition("|")
        return body, close
    return (sentence[:-1], "?") if sentence.endswith("?") else (sentence, "")


def _side(wording: Wording) -> str | None:
    return "side" if wording.direction in (Direction.LEFT, Direction.RIGHT) else None


def _turn(wording: Wording) -> str | None:
    return _side(wording) or (str(wording.direction) if wording.direction is not None else None)


def _speed(wording: Wording) -> str | None:
    return None if wording.faster is None else "up" if wording.faster else "down"


def _lights(wording: Wording) -> str | None:
    return None if wording.lights is None else "on" if wording.lights else "off"


_BASES: Mapping[ActionValue, Callable[[Wording], str | None]] = {
    ActionValue.J_TURN: _turn,
    ActionValue.LANE_SWITCH: _side,
    ActionValue.SPEED_CHANGE: _speed,
    ActionValue.LIGHT_CHANGE: _lights,
}


def _base(value: ActionValue, wording: Wording) -> str | None:
    return _BASES[value](wording) if value in _BASES else None
