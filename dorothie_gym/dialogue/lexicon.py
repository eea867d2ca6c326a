"""Lexicon: spoken forms of the slot values for generation, and cues for their recognition."""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from typing import Any, TypeAlias

import yaml

from dorothie_gym.errors import PhraseFileError
from dorothie_gym.ontology.slots import SLOT_VALUES, ActionValue, Slot, SlotValue

_LOADER: type[yaml.CSafeLoader | yaml.SafeLoader] = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""Safe loader of libyaml, where PyYAML has it: ten times as fast."""

_FORMS = frozenset({"say", "also", "again", "here", "the", "order", "tail", "hear"})
_HEARD_FORMS = ("say", "also", "the", "tail", "hear")
_ARTICLES = frozenset({"a", "an", "the", "some"})


@dataclass(frozen=True)
class ActionCues:
    """Cues for the recognition of an action.

    Attributes:
        stems: first four letters of words of which one must occur.
        pattern: pattern over masked words (see `entity_recognition.find_names`).
    """

    stems: frozenset[str]
    pattern: re.Pattern[str]


@dataclass(frozen=True)
class Lexicon:
    """Spoken forms of all slot values.

    Attributes:
        phrases: phrases of each value except actions, by form: "say", "also", "again", "here", "the", "order", "tail".
        actions: cues of actions, in order of recognition.
        names: recognised names: words of a phrase without article -> value.
        deixis: deictic expressions for landmarks in view.
        repairs: words that correct the preceding name.
        plurals: noun phrases in the plural.
        ignored: phrases that resemble names but are none.
    """

    phrases: Mapping[SlotValue, Mapping[str, tuple[str, ...]]]
    actions: Mapping[ActionValue, ActionCues]
    names: Mapping[tuple[str, ...], SlotValue]
    deixis: tuple[str, ...]
    repairs: tuple[str, ...]
    plurals: frozenset[str] = frozenset()
    ignored: tuple[tuple[str, ...], ...] = ()

    def forms(self, value: SlotValue, form: str) -> tuple[str, ...]:
        """Returns the phrases for `value` in `form` ("say", "the", "order", ...); falls back to "say"."""
        phrases = self.phrases[value]
        return phrases.get(form) or phrases["say"]


_TYPOGRAPHY = str.maketrans({"\u2019": "'", "\u2018": "'", "-": " ", "/": " "})
_APOSTROPHES = str.maketrans({"\u2019": "'", "\u2018": "'"})
_EDGES = '.,;:!?\u2014\u2013\u2026"()-'
_STOP = re.compile(r"[.;:!\u2014\u2026]+(?=\s|$)")
_WORD = re.compile(r"[a-z0-9']+|\?|,")
_STAMMER = re.compile(r"\b(\w{1,3})(?:-\1)*-+(?=\1)")
"""Beginning of a word that is said once more: "t-turn", "l-l-left"."""

_LETTERS = re.compile(r"[a-z]+")
_DRAWL = re.compile(r"([a-z])\1{2,}")
"""Letters of a drawl: "stooop"."""

_DOUBLED = frozenset("eo")
"""Vowels of which a drawl stands for two where the word is none with one: "sloow" but "sleeep"."""


YamlMapping: TypeAlias = Mapping[str, Any]
"""Mapping read from a data file, before its values are checked."""


def word_set(file: str, data: YamlMapping, name: str) -> frozenset[str]:
    """Returns a list of words of a data file; raises `PhraseFileError` if it is missing or malformed."""
    return frozenset(strings(f"{file}: {name}", data.get(name)))


def split_words(text: str) -> list[str]:
    """Returns lower-case tokens: "?" and "," are tokens, other stops become ",", hyphens and contractions are split.

    Spellings of speech and of dialects become plain words, see data/spoken_forms.yaml.
    """
    return list(_tokens(text))


@functools.lru_cache(maxsize=4096)
def _tokens(text: str) -> tuple[str, ...]:
    plain = _STOP.sub(" , ", _fluent(text.lower().translate(_APOSTROPHES)).translate(_TYPOGRAPHY))
    return tuple(part for word in _WORD.findall(plain) for part in _spoken(word))


@functools.lru_cache(maxsize=8192)
def plain_word(word: str) -> str:
    """Returns a word of a text in lower case, without marks around it and with its plain spelling."""
    word = _fluent(word.lower().translate(_APOSTROPHES)).strip(_EDGES)
    spoken = _spoken(word)
    return spoken[0] if len(spoken) == 1 else word


def _fluent(text: str) -> str:
    """Returns a text without beginnings of words that are said once more, and without drawls."""
    if "-" in text:
        text = _STAMMER.sub("", text)
    return _LETTERS.sub(lambda word: _DRAWL.sub(_undrawled, word[0]), text) if _DRAWL.search(text) else text


def _undrawled(match: re.Match[str]) -> str:
    """Returns the letters for which those of a drawl in a word stand."""
    letter, word = match[1], match.string
    single = word[: match.start()] + letter + word[match.end() :] in _spoken_forms().single
    return letter if single or letter not in _DOUBLED else 2 * letter


@functools.lru_cache(maxsize=16384)
def _spoken(word: str) -> tuple[str, ...]:
    """Returns the plain words for which a word of speech stands: "of" for "o'", "coming" for "comin"."""
    forms = _spoken_forms()
    found = forms.words.get(word)
    if found is not None:
        return found
    if word.endswith("in'") and len(word) > _SHORTEST_ING:
        return (f"{word[:-1]}g",)
    return (f"{word}g",) if word.endswith("in") and f"{word}g" in forms.ings else (word,)


_SHORTEST_ING = 4
"""Letters of the shortest verb whose ending may lack its g: "goin'" has more."""


@dataclass(frozen=True)
class _SpokenForms:
    """Contents of data/spoken_forms.yaml; that file explains each list."""

    words: Mapping[str, tuple[str, ...]]
    ings: frozenset[str]
    single: frozenset[str]


@functools.cache
def _spoken_forms() -> _SpokenForms:
    file = "spoken_forms.yaml"
    data = read_data(file)
    listed = data.get("words")
    if not isinstance(listed, dict) or not all(isinstance(text, str) for pair in listed.items() for text in pair):
        raise PhraseFileError(f"{file}: words must be a mapping from spellings to words; quote words such as 'no'")
    return _SpokenForms(
        words={spelling: tuple(text.split()) for spelling, text in listed.items()},
        ings=word_set(file, data, "ings"),
        single=word_set(file, data, "drawled"),
    )


def read_data(name: str) -> YamlMapping:
    """Returns the mapping of a data file of this package.

    Raises:
        PhraseFileError: if the file is not a YAML mapping.
    """
    text = resources.files("dorothie_gym.dialogue").joinpath("data", name).read_text(encoding="utf-8")
    try:
        data = yaml.load(text, Loader=_LOADER)
    except yaml.YAMLError as error:
        raise PhraseFileError(f"{name}: not readable as YAML: {error}") from error
    if not isinstance(data, dict):
        raise PhraseFileError(f"{name}: the top level must be a mapping")
    return data


def strings(where: str, value: object) -> tuple[str, ...]:
    """Returns a list of strings as a tuple.

    Raises:
        PhraseFileError: if `value` is not a list of strings (an unquoted `yes` or `on` is a boolean in YAML); names
            `where`.
    """
    if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
        raise PhraseFileError(f"{where}: expected a list of strings, got {value!r}; quote words such as 'yes' and 'on'")
    return tuple(value)


@functools.cache
def load_lexicon() -> Lexicon:
    """Returns the cached lexicon of the package.

    Raises:
        PhraseFileError: if a value of the ontology is missing, or if a phrase stands for two values.
    """
    return parse_lexicon(read_data("lexicon.yaml"))


def parse_lexicon(data: YamlMapping) -> Lexicon:
    """Builds the lexicon from the data of a lexicon file.

    Raises:
        PhraseFileError: as `load_lexicon`.
    """
    phrases: dict[SlotValue, Mapping[str, tuple[str, ...]]] = {}
    for slot in (Slot.LANDMARK, Slot.STREET, Slot.OBJECT, Slot.STATUS):
        shared = {
            form: strings(f"lexicon.yaml: {form}.{slot.label}", data[form][slot.label])
            for form in ("again", "here")
            if slot.label in data.get(form, {})
        }
        for value in SLOT_VALUES[slot]:
            phrases[value] = {**shared, **_forms(value, _entry(data, slot.label, value.label))}
    order = {label: place for place, label in enumerate(data.get("Action", {}))}
    actions = {value: _action_cues(value.label, _entry(data, "Action", value.label)) for value in ActionValue}
    ranked = sorted(actions, key=lambda value: order[value.label])
    return Lexicon(
        phrases,
        {value: actions[value] for value in ranked},
        _names(phrases),
        strings("lexicon.yaml: deixis", data.get("deixis")),
        strings("lexicon.yaml: repairs", data.get("repairs")),
        frozenset(strings("lexicon.yaml: plurals", data.get("plurals", []))),
        tuple(tuple(split_words(phrase)) for phrase in strings("lexicon.yaml: ignore", data.get("ignore"))),
    )


def bare_name(words: Sequence[str]) -> tuple[str, ...]:
    """Returns the words of a name without the article."""
    return tuple(words[1:] if len(words) > 1 and words[0] in _ARTICLES else words)


def _entry(data: YamlMapping, slot: str, label: str) -> Mapping[str, object]:
    entry = data.get(slot, {}).get(label)
    if not isinstance(entry, dict):
        raise PhraseFileError(f"dorothie_gym/dialogue/data/lexicon.yaml: {slot}.{label} is missing")
    return entry


def _forms(value: SlotValue, entry: Mapping[str, object]) -> Mapping[str, tuple[str, ...]]:
    where = f"lexicon.yaml: {value.slot.label}.{value.label}"
    if not set(entry) <= _FORMS or not entry.get("say"):
        raise PhraseFileError(f"{where}: needs `say` and may have {sorted(_FORMS)}, got {sorted(entry)}")
    return {form: strings(f"{where}.{form}", listed) for form, listed in entry.items()}


def _action_cues(label: str, entry: Mapping[str, object]) -> ActionCues:
    where = f"lexicon.yaml: Action.{label}"
    if set(entry) != {"stems", "hear"}:
        raise PhraseFileError(f"{where}: needs `stems` and `hear`, has {sorted(entry)}")
    listed = strings(f"{where}.hear", entry["hear"])
    try:
        pattern = re.compile(rf"(?<!\S)(?:{'|'.join(f'(?:{text})' for text in listed)})(?!\S)")
    except re.error as error:
        raise PhraseFileError(f"{where}.hear: {error}") from error
    return ActionCues(frozenset(stem[:4] for stem in strings(f"{where}.stems", entry["stems"])), pattern)


def _names(phrases: Mapping[SlotValue, Mapping[str, tuple[str, ...]]]) -> dict[tuple[str, ...], SlotValue]:
    names: dict[tuple[str, ...], SlotValue] = {}
    for value, forms in phrases.items():
        for phrase in [phrase for form in _HEARD_FORMS for phrase in forms.get(form, ())]:
            name = bare_name(split_words(phrase))
            if names.setdefault(name, value) != value:
                raise PhraseFileError(f"lexicon.yaml: {phrase!r} stands for {names[name].label} and for {value.label}")
    return names
