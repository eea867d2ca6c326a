"""What fills the gaps of a sentence: names, actions, numbers and references, as a speaker of some style says them."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import TypeVar

import numpy as np

from dorothie_gym.dialogue.grammar import SPOKEN_SLOTS, load_grammar
from dorothie_gym.dialogue.lexicon import load_lexicon
from dorothie_gym.dialogue.numerals import cardinal, ordinal
from dorothie_gym.dialogue.phrases import Register, manner_of
from dorothie_gym.dialogue.realization_context import Direction, Wording, WordingContext
from dorothie_gym.dialogue.speaker_style import SpeakerStyle
from dorothie_gym.ontology import (
    SLOT_VALUES,
    ActionValue,
    DialogueAct,
    LandmarkName,
    Slot,
    SlotValue,
    in_label_order,
)

_Option = TypeVar("_Option")

Draw = Callable[[], float]
"""Draws a number from [0, 1)."""

_BATCH = 32
"""Numbers drawn at once: a draw costs numpy as much as a batch does."""

# Enum members are looked up once: each look-up through the class costs as much as a drawn number.
_ACTION, _LANDMARK, _STREET = Slot.ACTION, Slot.LANDMARK, Slot.STREET
_SLANGY = Register.SLANGY
_OTHERS = ActionValue.UNKNOWN

_COLLOQUIAL = 0.25
"""Share of names that are paraphrased ("the burger place"); the slangy do it twice as often."""

_DEIXIS = 0.5
"""Share of names of what is in view that are pointed at."""


def draws_of(rng: np.random.Generator) -> Draw:
    """Returns a function that draws from [0, 1) by batches of `rng`."""
    return itertools.chain.from_iterable(iter(lambda: rng.random(_BATCH).tolist(), None)).__next__


class SlotRealizer:
    """Fills gaps for one act; see `phrases.PhraseSpeaker`.

    Attributes:
        values: the act's values by slot.
        fronted: whether the sentence goes on from the one before.
    """

    __slots__ = (
        "_names", "_scene", "_style", "_wording", "chattiness", "fronted", "habit", "idiolect", "manner", "random",
        "values", "_without",
    )  # fmt: skip

    def __init__(
        self,
        act: DialogueAct,
        draw: Draw,
        wording: Wording,
        style: SpeakerStyle,
        scene: WordingContext,
        names: int,
    ) -> None:
        """Prepares for an act.

        Args:
            act: what is said.
            draw: source of chance.
            wording: particulars.
            style: of the speaker.
            scene: what has been said and is in view.
            names: how many names of a kind are said at most.
        """
        self.random = draw
        self.values = values_by_slot(act.slots)
        self.manner = manner_of(style.register, draw() < style.indirectness)
        self.chattiness = style.chattiness
        self.habit = style.habit
        self.idiolect = style.idiolect
        self.fronted = scene.joined is not None
        self._wording = wording
        self._style = style
        self._scene = scene
        self._names = names
        self._without: LandmarkName | None = None

    def settle(self, dropping: bool) -> None:
        """Tells whether the sentence names the landmark that is given up, which then is not named again."""
        self._without = self._wording.dropped if dropping else None

    def pick(self, options: Sequence[_Option]) -> _Option:
        """Returns one of several by chance."""
        return options[int(self.random() * len(options))]

    def gap(self, name: str) -> str:
        """Returns the words for a gap of a template or of a spoken action."""
        return _GAPS[name](self)

    def action(self, form: str) -> str:
        """Returns what is (being) done."""
        manners = _action_keys(self._wording)
        # Two things to do are as many as one sentence can bear.
        spoken = []
        for value in self.values[_ACTION][: min(2, self._names)]:
            assert isinstance(value, ActionValue)
            phrases = load_grammar().actions[value]
            keys = manners.get(value) or manners[_OTHERS]
            key = next(key for key in keys if ("do", key) in phrases or (form, key) in phrases)
            spoken.append((phrases.get((form, key)) or phrases["do", key]).say(self))
        return _listed(spoken)

    def landmark(self) -> str:
        """Returns the names of the landmarks, or references to them."""
        values = self.values[_LANDMARK]
        kept = tuple(value for value in values if value is not self._without) if self._without else values
        return self._named(kept or values)

    def street(self) -> str:
        """Returns the names of the streets, or references to them."""
        return self._named(self.values[_STREET])

    def spoken(self, slot: Slot, form: str) -> str:
        """Returns the words of a slot's values in a form of the lexicon."""
        lexicon = load_lexicon()
        return _listed([self.pick(lexicon.forms(value, form)) for value in self.values[slot][: self._names]])

    def copula(self) -> str:
        """Returns "is", or "are" for several landmarks."""
        return "are" if len(self.values.get(_LANDMARK, ())[: self._names]) > 1 else "is"

    def nth(self) -> str:
        """Returns which opportunity."""
        number = self._wording.ordinal or 1
        return "next" if number == 1 else ordinal(number)

    def speed(self) -> str:
        """Returns the speed aimed at, in words."""
        return cardinal(round(self._wording.speed or 0))

    def distance(self) -> str:
        """Returns the distance in tens of metres, in words."""
        metres = cardinal(max(10, 10 * round((self._wording.distance or 0) / 10)))
        return f"{metres} {'metres' if self.idiolect % 3 == 1 else 'meters'}"

    def direction(self) -> str:
        """Returns which way."""
        return str(self._wording.direction)

    def place(self, landmark: LandmarkName | None) -> str:
        """Returns the name of a landmark that the wording gives."""
        return self.pick(load_lexicon().forms(landmark or LandmarkName.UNKNOWN, "say"))

    def past(self) -> str:
        """Returns the landmark behind which it is to happen."""
        return self.place(self._wording.past)

    def dropped(self) -> str:
        """Returns the landmark that is given up."""
        return self.place(self._wording.dropped)

    def _named(self, values: Sequence[SlotValue]) -> str:
        return _listed([self._name(value) for value in values[: self._names]])

    def _name(self, value: SlotValue) -> str:
        lexicon, style, scene = load_lexicon(), self._style, self._scene
        if scene.mentioned and value in scene.mentioned and self.random() < style.anaphora:
            return self.pick(lexicon.forms(value, "again"))
        if value is scene.street and self.random() < style.anaphora:
            return self.pick(lexicon.forms(value, "here"))
        forms = lexicon.phrases[value]
        paraphrased = _COLLOQUIAL * (2 if style.register is _SLANGY else 1)
        name = self.pick(forms["also" if "also" in forms and self.random() < paraphrased else "say"])
        if value is scene.landmark and self.random() < style.chattiness * _DEIXIS:
            name = f"{name} {self.pick(lexicon.deixis)}"
        if style.repairs and value.label not in _NAMELESS and self.random() < style.repairs:
            wrong = self.pick(SLOT_VALUES[value.slot][1:-2])
            if wrong is not value and wrong.label not in _NAMELESS:
                name = f"{self.pick(lexicon.phrases[wrong]['say'])}, {self.pick(lexicon.repairs)} {name}"
        return name


_NAMELESS = frozenset({"Unknown", "Queried"})

_GAPS: Mapping[str, Callable[[SlotRealizer], str]] = MappingProxyType(
    {
        "do": lambda teller: teller.action("do"),
        "doing": lambda teller: teller.action("doing"),
        "cmd": lambda teller: teller.action("cmd"),
        "landmark": SlotRealizer.landmark,
        "street": SlotRealizer.street,
        "object": lambda teller: teller.spoken(Slot.OBJECT, "say"),
        "the_object": lambda teller: teller.spoken(Slot.OBJECT, "the"),
        "state": lambda teller: teller.spoken(Slot.STATUS, "say"),
        "order": lambda teller: teller.spoken(Slot.STATUS, "order"),
        "tail": lambda teller: teller.spoken(Slot.STATUS, "tail"),
        "is": SlotRealizer.copula,
        "side": SlotRealizer.direction,
        "direction": SlotRealizer.direction,
        "nth": SlotRealizer.nth,
        "speed": SlotRealizer.speed,
        "distance": SlotRealizer.distance,
        "past": SlotRealizer.past,
        "dropped": SlotRealizer.dropped,
    }
)


@functools.lru_cache(maxsize=8192)
def values_by_slot(slots: frozenset[SlotValue]) -> Mapping[Slot, tuple[SlotValue, ...]]:
    """Returns the values of an act by slot, in the order of afterthoughts; slots without values are left out."""
    ordered = in_label_order(slots)
    found = {slot: tuple(value for value in ordered if value.slot is slot) for slot in SPOKEN_SLOTS}
    return {slot: values for slot, values in found.items() if values}


@functools.lru_cache(maxsize=4096)
def _action_keys(wording: Wording) -> Mapping[ActionValue, tuple[str, ...]]:
    """Returns the manners that a wording allows, the most telling first, by action; UNKNOWN stands for the rest."""
    known = wording.known
    names = (("nth", "nth"), ("past", "past"), ("here", "here"), ("in", "distance"), ("to", "speed"))
    details = [detail for detail, name in names if name in known]
    keys = {_OTHERS: (*details, "plain")}
    for action, base in _bases(wording).items():
        keys[action] = (*(f"{base}_{detail}" for detail in details), base, *details, "plain")
    return keys


def _bases(wording: Wording) -> dict[ActionValue, str]:
    bases: dict[ActionValue, str] = {}
    sideways = wording.direction in (Direction.LEFT, Direction.RIGHT)
    if wording.direction is not None:
        bases[ActionValue.J_TURN] = "side" if sideways else str(wording.direction)
    if sideways:
        bases[ActionValue.LANE_SWITCH] = "side"
    if wording.faster is not None:
        bases[ActionValue.SPEED_CHANGE] = "up" if wording.faster else "down"
    if wording.lights is not None:
        bases[ActionValue.LIGHT_CHANGE] = "on" if wording.lights else "off"
    return bases


def _listed(phrases: Sequence[str]) -> str:
    if len(phrases) == 1:
        return phrases[0]
    unique = list(dict.fromkeys(phrases))
    return unique[0] if len(unique) == 1 else ", ".join(unique[:-1]) + " and " + unique[-1]
