"""Spoken forms of the ontology's values: how they are said and by what they are recognised."""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib import resources
from typing import Any

import yaml

from dorothie_gym.ontology import SLOT_VALUES, ActionValue, Slot, SlotValue

_FORMS = frozenset({"say", "the", "order", "tail", "hear"})
_STREET_KINDS = frozenset({"street", "st", "road", "rd", "avenue", "ave", "drive", "boulevard", "blvd", "lane"})
_FUZZY_LENGTH = 6
"""Names of at least this many letters are understood with one letter wrong."""


class LexiconError(ValueError):
    """A data file of the dialogue package is not as it must be."""


@dataclass(frozen=True)
class SpokenAction:
    """How an action is said and recognised.

    Attributes:
        manners: for each manner, the forms "do" (bare infinitive) and "doing", each with its phrases.
        patterns: expressions over masked words (see `Mention`) that betray the action.
    """

    manners: Mapping[str, Mapping[str, tuple[str, ...]]]
    patterns: tuple[re.Pattern[str], ...]


@dataclass(frozen=True)
class Mention:
    """A name found in a row of words.

    Attributes:
        value: what is named.
        start: index of its first word in the masked words.
    """

    value: SlotValue
    start: int


@dataclass(frozen=True)
class Lexicon:
    """All spoken forms.

    Attributes:
        phrases: forms of each value except actions: "say", "the", "order", "tail" -> phrases.
        actions: spoken actions, in the order in which they are to be recognised.
        names: what is understood: the words of a phrase -> value.
    """

    phrases: Mapping[SlotValue, Mapping[str, tuple[str, ...]]]
    actions: Mapping[ActionValue, SpokenAction]
    names: Mapping[tuple[str, ...], SlotValue]
    _longest: int = field(init=False, default=1)
    _single: Mapping[str, SlotValue] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_longest", max(map(len, self.names)))
        proper = {Slot.LANDMARK, Slot.STREET}
        single = {
            words[0]: value
            for words, value in self.names.items()
            if len(words) == 1 and len(words[0]) >= _FUZZY_LENGTH and value.slot in proper
        }
        object.__setattr__(self, "_single", single)

    def forms(self, value: SlotValue, form: str) -> tuple[str, ...]:
        """Returns the phrases for `value` in `form` ("say", "the", "order", "tail"); those of "say" if it has none."""
        phrases = self.phrases[value]
        return phrases.get(form) or phrases["say"]

    def find(self, words: Sequence[str]) -> tuple[list[Mention], list[str]]:
        """Finds names, the longest first at each place.

        Args:
            words: lower-case words, see `split_words`.

        Returns:
            The mentions in order, and the words with each mention replaced by "#landmark", "#street", "#object" or
            "#status"; by "#what" if it is what somebody asks for.
        """
        mentions: list[Mention] = []
        masked: list[str] = []
        place = 0
        while place < len(words):
            value, length = self._at(words, place)
            if value is None:
                masked.append(words[place])
            else:
                mentions.append(Mention(value, len(masked)))
                masked.append("#what" if value.label == "Queried" else f"#{value.slot.label.lower()}")
                if value.slot is Slot.STREET:
                    length += " ".join(words[place + length : place + length + 1]) in _STREET_KINDS
            place += length
        return mentions, masked

    def _at(self, words: Sequence[str], place: int) -> tuple[SlotValue | None, int]:
        for length in range(min(self._longest, len(words) - place), 0, -1):
            value = self.names.get(tuple(words[place : place + length]))
            if value is not None:
                return value, length
        word = words[place].removesuffix("'s")
        if len(word) >= _FUZZY_LENGTH - 1:
            for name, value in self._single.items():
                if name[0] == word[0] and _one_letter_apart(name, word):
                    return value, 1
        return None, 1


def split_words(text: str) -> list[str]:
    """Returns lower-case words; "?" and "," stand alone, other stops become ",", hyphens part words."""
    text = text.lower().replace("\u2019", "'").replace("\u2018", "'")
    text = re.sub(r"\b(\d+)-(\d+)\b", r"\1 \2", text)
    text = re.sub(r"[.;:!\u2014\u2026]+(?=\s|$)", " , ", text)
    return re.findall(r"[a-z0-9']+|\?|,", re.sub(r"([?,])", r" \1 ", text))


def _one_letter_apart(one: str, other: str) -> bool:
    if abs(len(one) - len(other)) > 1:
        return False
    short, long = sorted((one, other), key=len)
    place = next((i for i, (a, b) in enumerate(zip(short, long, strict=False)) if a != b), len(short))
    rest = short[place + 1 :] if len(short) == len(long) else short[place:]
    return rest == long[place + 1 :]


def read_data(name: str) -> dict[str, Any]:
    """Returns the mapping in a data file of this package.

    Raises:
        LexiconError: if the file is no YAML mapping.
    """
    text = resources.files(__package__).joinpath("data", name).read_text(encoding="utf-8")
    try:
        data = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise LexiconError(f"{name}: not readable as YAML: {error}") from error
    if not isinstance(data, dict):
        raise LexiconError(f"{name}: the top level must be a mapping")
    return data


def strings(where: str, value: object) -> tuple[str, ...]:
    """Returns a list of strings as a tuple.

    Raises:
        LexiconError: naming `where`, if it is anything else (an unquoted `yes` or `on` is a boolean in YAML).
    """
    if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
        raise LexiconError(f"{where}: expected a list of strings, got {value!r}; quote words such as 'yes' and 'on'")
    return tuple(value)


@functools.cache
def load_lexicon() -> Lexicon:
    """Returns the package's lexicon, read once.

    Raises:
        LexiconError: if a value of the ontology is missing or a phrase stands for two values.
    """
    return parse_lexicon(read_data("lexicon.yaml"))


def parse_lexicon(data: Mapping[str, Any]) -> Lexicon:
    """Returns the lexicon in the data of a lexicon file.

    Raises:
        LexiconError: as `load_lexicon`.
    """
    phrases: dict[SlotValue, Mapping[str, tuple[str, ...]]] = {}
    for slot in (Slot.LANDMARK, Slot.STREET, Slot.OBJECT, Slot.STATUS):
        for value in SLOT_VALUES[slot]:
            phrases[value] = _forms(value, _entry(data, slot.label, value.label))
    order = {label: place for place, label in enumerate(data.get("Action", {}))}
    actions = {value: _spoken_action(value.label, _entry(data, "Action", value.label)) for value in ActionValue}
    ranked = sorted(actions, key=lambda value: order[value.label])
    return Lexicon(phrases, {value: actions[value] for value in ranked}, _names(phrases))


def _entry(data: Mapping[str, Any], slot: str, label: str) -> dict[str, Any]:
    entry = data.get(slot, {}).get(label)
    if not isinstance(entry, dict):
        raise LexiconError(f"lexicon.yaml: {slot}.{label} is missing")
    return entry


def _forms(value: SlotValue, entry: Mapping[str, Any]) -> Mapping[str, tuple[str, ...]]:
    where = f"lexicon.yaml: {value.slot.label}.{value.label}"
    if not set(entry) <= _FORMS or not entry.get("say"):
        raise LexiconError(f"{where}: needs `say` and may have {sorted(_FORMS)}, got {sorted(entry)}")
    return {form: strings(f"{where}.{form}", listed) for form, listed in entry.items()}


def _spoken_action(label: str, entry: Mapping[str, Any]) -> SpokenAction:
    where = f"lexicon.yaml: Action.{label}"
    manners = {
        manner: {form: strings(f"{where}.{manner}.{form}", forms.get(form)) for form in ("do", "doing")}
        for manner, forms in entry.items()
        if manner != "hear"
    }
    if "plain" not in manners:
        raise LexiconError(f"{where}: needs the manner `plain`")
    patterns = tuple(re.compile(rf"(?<!\S)(?:{text})(?!\S)") for text in strings(f"{where}.hear", entry.get("hear")))
    return SpokenAction(manners, patterns)


def _names(phrases: Mapping[SlotValue, Mapping[str, tuple[str, ...]]]) -> dict[tuple[str, ...], SlotValue]:
    names: dict[tuple[str, ...], SlotValue] = {}
    for value, forms in phrases.items():
        heard = [phrase for form in ("say", "the", "tail", "hear") for phrase in forms.get(form, ())]
        for phrase in heard:
            words = tuple(split_words(phrase))
            bare = words[1:] if len(words) > 1 and words[0] in {"a", "an", "the"} else words
            if names.setdefault(bare, value) != value:
                raise LexiconError(f"lexicon.yaml: {phrase!r} stands for {names[bare].label} and for {value.label}")
    return names
