"""Slot realizer: words for the gaps of a template (names, actions, numbers, references) in the style of a speaker."""

from __future__ import annotations

import functools
import itertools
import re
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Protocol, TypeVar

import numpy as np

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.grammar import SPOKEN_SLOTS, load_grammar
from dorothie_gym.dialogue.lexicon import load_lexicon
from dorothie_gym.dialogue.numerals import CAR_LENGTH, cardinal, duration, ordinal
from dorothie_gym.dialogue.phrases import Register, manner_of
from dorothie_gym.dialogue.propositions import Proposition
from dorothie_gym.dialogue.realization_context import Wording, WordingContext, enumeration
from dorothie_gym.errors import PhraseFileError
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove, in_label_order
from dorothie_gym.ontology.slots import SLOT_VALUES, ActionValue, GoalStatus, LandmarkName, Slot, SlotValue
from dorothie_gym.ontology.world_exceptions import PropKind

if TYPE_CHECKING:
    from dorothie_gym.dialogue.speaker_style import SpeakerStyle

_Option = TypeVar("_Option")
_Kind = TypeVar("_Kind")


class Draw(Protocol):
    """Function that draws a number from [0, 1)."""

    def __call__(self) -> float:
        """Returns the next number."""
        ...


_DRAWN_AT_ONCE = 32
"""Numbers per draw from numpy; a single number costs as much as a batch."""

# Enum members are bound once: each look-up through the class costs as much as a random draw.
_ACTION, _LANDMARK, _STREET = Slot.ACTION, Slot.LANDMARK, Slot.STREET
_SLANGY = Register.SLANGY
_OTHERS = ActionValue.UNKNOWN

_COLLOQUIAL = 0.25
"""Share of paraphrased names ("the burger place"); twice as high in the slangy register."""

_DEIXIS = 0.5
"""Share of names with a deictic expression for landmarks in view, scaled by chattiness."""


def draws_of(rng: np.random.Generator) -> Draw:
    """Returns a function that draws from [0, 1), in batches from `rng`."""
    return itertools.chain.from_iterable(iter(lambda: rng.random(_DRAWN_AT_ONCE).tolist(), None)).__next__


class SlotRealizer:
    """Realizes the gaps of one act; implements `phrases.PhraseSpeaker`.

    Attributes:
        values: slot values of the act by slot.
        fronted: whether the sentence continues the previous one.
    """

    __slots__ = (
        "_names",
        "_naming",
        "_of_rider",
        "_plurals",
        "_scene",
        "_style",
        "_without",
        "_wording",
        "chattiness",
        "fronted",
        "habit",
        "idiolect",
        "manner",
        "random",
        "values",
    )

    def __init__(
        self,
        act: DialogueAct,
        draw: Draw,
        wording: Wording,
        style: SpeakerStyle,
        scene: WordingContext,
        names: int,
        of_rider: bool = True,
    ) -> None:
        """Prepares the realization of an act.

        Args:
            act: the dialogue act.
            draw: source of random numbers in [0, 1).
            wording: details of the act.
            style: style of the speaker.
            scene: dialogue history and objects in view.
            names: maximum number of names per slot.
            of_rider: whether the friends and home in question are the speaker's.
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
        self._naming = act.move in _NAMING
        self._of_rider = of_rider
        self._without: LandmarkName | None = None
        self._plurals: list[str] = []

    def exclude_dropped(self, dropping: bool) -> None:
        """Sets whether the sentence names the abandoned landmark, which is then excluded from the landmark gap."""
        self._without = self._wording.dropped if dropping else None

    def pick(self, options: Sequence[_Option]) -> _Option:
        """Returns a random option."""
        return options[int(self.random() * len(options))]

    def gap(self, name: str) -> str:
        """Returns the words of a gap in a template or an action phrase."""
        return _GAPS[name](self)

    def action(self, form: str) -> str:
        """Returns the words of the actions in a form: "do", "doing" or "cmd"."""
        manners = _action_keys(self._wording)
        # A sentence names at most two actions.
        spoken = []
        named = [value for value in self.values[_ACTION] if isinstance(value, ActionValue)]
        for value in named[: min(2, self._names)]:
            phrases = load_grammar().actions[value]
            keys = manners.get(value) or manners[_OTHERS]
            key = next(key for key in keys if ("do", key) in phrases or (form, key) in phrases)
            spoken.append((phrases.get((form, key)) or phrases["do", key]).say(self))
        return enumeration(spoken)

    def landmark(self, named: bool = False) -> str:
        """Returns the names of the landmarks, or anaphoric references unless they must be `named`."""
        values = self.values[_LANDMARK]
        kept = tuple(value for value in values if value is not self._without) if self._without else values
        return self._named(kept or values, named)

    def street(self, named: bool = False) -> str:
        """Returns the names of the streets, or anaphoric references unless they must be `named`."""
        return self._named(self.values[_STREET], named)

    def spoken(self, slot: Slot, form: str) -> str:
        """Returns the words of the values of a slot in a form of the lexicon."""
        lexicon = load_lexicon()
        phrases = [self.pick(lexicon.forms(value, form)) for value in self.values[slot][: self._names]]
        listed = enumeration(phrases)
        if slot is Slot.OBJECT and (len(phrases) > 1 or listed in lexicon.plurals):
            self._plurals.append(listed)
        return listed

    def agreed(self, text: str) -> str:
        """Returns the text with verbs that agree in number with the plural noun phrases spoken in it."""
        for phrase in self._plurals:
            for pattern, plural in _agreements(phrase):
                text = pattern.sub(plural, text)
        return text

    def copula(self) -> str:
        """Returns "is", or "are" for several landmarks."""
        return "are" if len(self.values.get(_LANDMARK, ())[: self._names]) > 1 else "is"

    def nth(self) -> str:
        """Returns the ordinal of the opportunity."""
        number = self._wording.ordinal or 1
        return "next" if number == 1 else ordinal(number)

    def speed(self) -> str:
        """Returns the target speed in words."""
        return cardinal(round(self._wording.speed or 0))

    def distance(self) -> str:
        """Returns the distance in words: car lengths for the way of a few of them, otherwise tens of metres."""
        metres = self._wording.distance or 0
        lengths = max(1, round(metres / CAR_LENGTH))
        if lengths > _MOST_LENGTHS:
            return self._length(metres)
        return "a car length" if lengths == 1 else f"{cardinal(lengths)} car lengths"

    def metres(self) -> str:
        """Returns the distance of the content in words."""
        return self._length(self.argument("metres", int))

    def _length(self, metres: float) -> str:
        words = cardinal(10 * round(metres / 10) if metres >= 9.5 else max(round(metres), 2))
        return f"{words} meters"

    def direction(self) -> str:
        """Returns the direction."""
        return str(self._wording.direction)

    def place(self, landmark: LandmarkName | None) -> str:
        """Returns the name of a landmark of the wording."""
        return self.pick(load_lexicon().forms(landmark or LandmarkName.UNKNOWN, "say"))

    def argument(self, name: str, kind: type[_Kind]) -> _Kind:
        """Returns an argument of the content, which has all that the chosen template has gaps for.

        Raises:
            PhraseFileError: the content has no such argument of that type.
        """
        content = self._wording.content
        value = None if content is None else content.get(name)
        if value is None or not isinstance(value, kind):
            raise PhraseFileError(f"a template has a gap for {name!r}, a {kind.__name__}; the content is {content}")
        return value

    def words(self, name: str) -> str:
        """Returns an argument of the content as it is spoken."""
        return str(self.argument(name, object))

    def duration(self) -> str:
        """Returns the time of the content in words."""
        return duration(self.argument("seconds", int))

    def clause(self) -> str:
        """Returns the clause that states the cause of the content."""
        cause = self.argument("cause", Proposition)
        tense = "past " if self._wording.topic == "because_then" else ""
        clauses, stem = load_grammar().clauses, f"{tense}{'not ' * cause.negated}{cause.predicate}"
        action = cause.get("action")
        special = f"{stem} {action.label}" if isinstance(action, ActionValue) else stem
        return clauses[special if special in clauses else stem].say(self)

    def prop(self) -> str:
        """Returns the name of the prop of the content, with an article."""
        return load_grammar().props[self.argument("prop", PropKind)].say(self)

    def definite_item(self) -> str:
        """Returns the item of the content with a definite article: "the newspaper" of "a newspaper"."""
        item = self.words("item")
        return item if _POSSESSED.match(item) else f"the {_INDEFINITE.sub('', item)}"

    def past(self) -> str:
        """Returns the name of the landmark to drive past."""
        return self.place(self._wording.past)

    def plan(self) -> str:
        """Returns the words of a driving plan."""
        return self._wording.plan or ""

    def compass(self) -> str:
        """Returns the point of the compass to which a street leads."""
        return self._wording.compass or ""

    def dropped(self) -> str:
        """Returns the name of the abandoned landmark."""
        return self.place(self._wording.dropped)

    def _named(self, values: Sequence[SlotValue], named: bool) -> str:
        listed = enumeration([self._name(value, named) for value in values[: self._names]])
        if len(values[: self._names]) > 1:
            self._plurals.append(listed)
        return listed

    def _name(self, value: SlotValue, named: bool) -> str:
        lexicon, style, scene = load_lexicon(), self._style, self._scene
        named = named or value in (LandmarkName.PERSON, LandmarkName.HOUSE)  # "that one" could be any house
        if not named and scene.mentioned and value in scene.mentioned and self.random() < style.anaphora:
            return self.pick(lexicon.forms(value, "again"))
        if not named and value is scene.street and self.random() < style.anaphora:
            return self.pick(lexicon.forms(value, "here"))
        forms = lexicon.phrases[value]
        paraphrased = _COLLOQUIAL * (2 if style.register is _SLANGY else 1)
        of_person = self._of_person(value)
        name = of_person or self.pick(forms["also" if "also" in forms and self.random() < paraphrased else "say"])
        if not self._of_rider and name.startswith("my "):
            name = f"your {name[3:]}"
        if not named and value is scene.landmark and self.random() < style.chattiness * _DEIXIS:
            name = f"{name} {self.pick(lexicon.deixis)}"
        if style.repairs and not of_person and value.label not in _NAMELESS and self.random() < style.repairs:
            wrong = self.pick(SLOT_VALUES[value.slot][1:-2])
            if wrong is not value and wrong.label not in _NAMELESS:
                name = f"{self.pick(lexicon.phrases[wrong]['say'])}, {self.pick(lexicon.repairs)} {name}"
        return name

    def _of_person(self, value: SlotValue) -> str | None:
        """Returns a name by a person, "Mateo's house" or "my friend Priya"; None if unknown, or at random.

        A destination that is named to the car always has the name, because there may be several houses on a street.
        """
        scene = self._scene
        owner, friend = value is LandmarkName.HOUSE and scene.owner, value is LandmarkName.PERSON and scene.friend
        passenger = value is LandmarkName.PERSON and scene.passenger
        elsewhere = not _ELSEWHERE.isdisjoint(self.values.get(Slot.STATUS, ()))
        if not (owner or friend or passenger) or elsewhere:
            return None
        if owner and not self._naming and self.random() >= _NAMES_OWNER:
            return None
        if owner:
            return f"{owner}'s house"
        if passenger and self._wording.topic == "pick_up":
            return str(passenger)
        if not friend and "'" in str(passenger):
            return None  # "Ayumi's mother" is my friend from then on
        if not self._naming:
            return str(friend or passenger)  # it is clear by now who that is
        return f"my friend {friend}" if friend else f"our passenger {passenger}"


_NAMING = frozenset({DialogueMove.INSTRUCT, DialogueMove.REPLY_W, DialogueMove.CLARIFY})
_MOST_LENGTHS = 4  # number of car lengths from which on metres are said
_NAMES_OWNER = 0.93  # probability that a house is called by its owner
_ELSEWHERE = frozenset({GoalStatus.PENDING, GoalStatus.ABANDONED, GoalStatus.COMPLETE})  # of other errands
_INDEFINITE = re.compile(r"^(an?|some|another|the) ")
_POSSESSED = re.compile(r"^(my|your|our|his|her|their|\w+'s) ")
_NAMELESS = frozenset({"Unknown", "Queried"})


@functools.lru_cache(maxsize=1024)
def _agreements(phrase: str) -> tuple[tuple[re.Pattern[str], str], ...]:
    """Returns patterns of singular verbs next to a plural noun phrase, with their plural forms."""
    noun = re.escape(phrase)
    forms = (
        (rf"\bthere's(?= {noun}\b)", "there are"),
        (rf"\bthere was(?= {noun}\b)", "there were"),
        (rf"\bthat's(?= {noun}\b)", "those are"),
        (rf"\bis there(?= {noun}\b)", "are there"),
        (rf"\bis that(?= {noun}\b)", "are those"),
        (rf"\bis(?= {noun}\b)", "are"),
        (rf"(?<=\b{noun} )is\b", "are"),
        (rf"(?<=\b{noun} )isn't\b", "aren't"),
        (rf"(?<=\b{noun} )was\b", "were"),
        (rf"(?<=\b{noun} )has\b", "have"),
        (rf"(?<=\b{noun} )blocks\b", "block"),
    )
    return tuple((re.compile(pattern), plural) for pattern, plural in forms)


_GAPS: Mapping[str, Callable[[SlotRealizer], str]] = MappingProxyType(
    {
        "do": lambda realizer: realizer.action("do"),
        "doing": lambda realizer: realizer.action("doing"),
        "cmd": lambda realizer: realizer.action("cmd"),
        "landmark": SlotRealizer.landmark,
        "named_landmark": lambda realizer: realizer.landmark(named=True),
        "street": SlotRealizer.street,
        "named_street": lambda realizer: realizer.street(named=True),
        "object": lambda realizer: realizer.spoken(Slot.OBJECT, "say"),
        "the_object": lambda realizer: realizer.spoken(Slot.OBJECT, "the"),
        "state": lambda realizer: realizer.spoken(Slot.STATUS, "say"),
        "order": lambda realizer: realizer.spoken(Slot.STATUS, "order"),
        "tail": lambda realizer: realizer.spoken(Slot.STATUS, "tail"),
        "is": SlotRealizer.copula,
        "side": SlotRealizer.direction,
        "direction": SlotRealizer.direction,
        "nth": SlotRealizer.nth,
        "speed": SlotRealizer.speed,
        "distance": SlotRealizer.distance,
        "past": SlotRealizer.past,
        "dropped": SlotRealizer.dropped,
        "compass": SlotRealizer.compass,
        "plan": SlotRealizer.plan,
        "seconds": SlotRealizer.duration,
        "metres": SlotRealizer.metres,
        "cause": SlotRealizer.clause,
        "prop": SlotRealizer.prop,
        "feature": lambda realizer: realizer.words("feature"),
        "purpose": lambda realizer: realizer.words("purpose"),
        "person": lambda realizer: realizer.words("person"),
        "item": lambda realizer: realizer.words("item"),
        "the_item": SlotRealizer.definite_item,
        "reason": lambda realizer: realizer.words("reason"),
    }
)


@functools.lru_cache(maxsize=8192)
def values_by_slot(slots: frozenset[SlotValue]) -> Mapping[Slot, tuple[SlotValue, ...]]:
    """Returns the values of an act by slot, in the order of afterthoughts; slots without values are omitted."""
    ordered = in_label_order(slots)
    found = {slot: tuple(value for value in ordered if value.slot is slot) for slot in SPOKEN_SLOTS}
    return {slot: values for slot, values in found.items() if values}


@functools.lru_cache(maxsize=4096)
def _action_keys(wording: Wording) -> Mapping[ActionValue, tuple[str, ...]]:
    """Returns the phrase keys that a wording allows, the most specific first, by action; UNKNOWN covers the rest."""
    known = wording.known
    names = (("nth", "nth"), ("past", "past"), ("here", "here"), ("in", "distance"), ("to", "speed"))
    details = [detail for detail, name in names if name in known]
    keys: dict[ActionValue, tuple[str, ...]] = {_OTHERS: (*details, "plain")}
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
