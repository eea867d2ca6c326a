"""Generation grammar: templates, action phrases, afterthoughts and discourse markers from the files in data/talk."""

from __future__ import annotations

import functools
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field

from dorothie_gym.dialogue.phrases import (
    WEIGHT,
    Alternative,
    Phrase,
    TalkSection,
    alternatives_of,
    choice,
    parse_alternatives,
    parse_phrase,
    parse_talk_files,
    read_talk_files,
    split_alternatives,
)
from dorothie_gym.dialogue.propositions import Predicate
from dorothie_gym.errors import OntologyError, PhraseFileError
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import SLOT_VALUES, ActionValue, LandmarkName, Slot, SlotValue
from dorothie_gym.ontology.spellings import parse_move, parse_role, parse_slot
from dorothie_gym.ontology.world_exceptions import PropKind, Sensor, WeatherParameter

SLOT_FIELDS: Mapping[str, Slot] = {
    "do": Slot.ACTION,
    "cmd": Slot.ACTION,
    "doing": Slot.ACTION,
    "landmark": Slot.LANDMARK,
    "named_landmark": Slot.LANDMARK,
    "street": Slot.STREET,
    "named_street": Slot.STREET,
    "object": Slot.OBJECT,
    "the_object": Slot.OBJECT,
    "state": Slot.STATUS,
    "is": Slot.STATUS,
    "order": Slot.STATUS,
    "tail": Slot.STATUS,
}
"""Gaps that are filled by slot values, with their slot."""

CONTENT_FIELDS = frozenset(
    {"seconds", "metres", "prop", "feature", "purpose", "person", "item", "the_item", "reason", "cause"}
)
"""Gaps that are filled by the arguments of the content of the same names."""

CONTEXT_FIELDS = frozenset({"side", "nth", "speed", "distance", "past", "dropped", "compass", "plan"}) | CONTENT_FIELDS
"""Gaps that are filled by the wording; `side` is a direction, left or right."""

SPOKEN_SLOTS = (Slot.ACTION, Slot.LANDMARK, Slot.STREET, Slot.OBJECT, Slot.STATUS)
"""Slots with spoken values, in the order of afterthoughts."""

VOICES = (Role.PARTICIPANT, Role.CO_WIZARD)
"""Roles with their own templates."""

_NAMELESS = frozenset({"Unknown", "Unlabeled", "Queried"})
_ACTIONS = {value.label: value for value in ActionValue}
_REMARKS = (
    *(f"{change}_{parameter}" for parameter in WeatherParameter for change in ("much", "less")),
    *(f"failed_{sensor}" for sensor in Sensor),
)
"""Topics of the remarks of scripted speakers (`policies.notable_conditions`) about each member of a vocabulary."""

_FOLDER = "dorothie_gym/dialogue/data/talk"
MARKER_KINDS = ("opener", "closer", "alarm")
"""Kinds of discourse markers: before a sentence, after it, and before it during an exception."""


@dataclass(frozen=True)
class Template:
    """Sentence template with gaps.

    Attributes:
        body: text, as one of several alternatives.
        close: text after the afterthoughts, e.g. "?".
        speaker: role that uses the template; None for all roles.
        when: permitted labels of slot values, by slot; the template then covers the slot.
        topic: topic of the template, or None.
        covers: slots that the template expresses.
        needs: details (fields of the wording) that the template expresses.
    """

    body: Alternative
    close: Phrase
    speaker: Role | None
    when: Mapping[Slot, frozenset[str]]
    topic: str | None
    covers: frozenset[Slot]
    needs: frozenset[str]


@dataclass(frozen=True)
class DiscourseMarker:
    """Words before or after a sentence, such as "okay" or "please".

    Attributes:
        phrase: the words.
        rate: probability of the marker for a speaker of chattiness 1.
    """

    phrase: Phrase
    rate: float


@dataclass(frozen=True)
class Grammar:
    """Complete generation grammar.

    Attributes:
        templates: templates of each move.
        actions: phrases of each action by (form, key); the form is "do", "doing" or, for some actions, "cmd".
        tails: afterthoughts of each slot by move; the key None holds the default.
        markers: openers, closers and alarms by (kind, speaker, move).
        joints: links between two acts of one utterance, by (previous move, move).
        fillers: filled pauses.
        clauses: clauses that state a proposition, by its topic ("red", "not goal"), with "past " in front for the past
            and its action ("told LaneFollow") last if it has a clause of its own.
        props: names of each kind of prop, with an article.
    """

    templates: Mapping[DialogueMove, tuple[Template, ...]]
    actions: Mapping[ActionValue, Mapping[tuple[str, str], Phrase]]
    tails: Mapping[Slot, Mapping[DialogueMove | None, Phrase]]
    markers: Mapping[tuple[str, Role, DialogueMove], DiscourseMarker]
    joints: Mapping[tuple[DialogueMove, DialogueMove], Phrase]
    fillers: Phrase
    clauses: Mapping[str, Phrase]
    props: Mapping[PropKind, Phrase]


@functools.cache
def load_grammar() -> Grammar:
    """Returns the cached grammar of the package.

    Raises:
        PhraseFileError: if the files refer to undefined names, or if a move of a speaker or an action has no words.
    """
    return parse_grammar(read_talk_files())


def parse_grammar(texts: dict[str, str]) -> Grammar:
    """Builds the grammar from the texts of talk files, by file name.

    Raises:
        PhraseFileError: as `load_grammar`.
    """
    builder = _Builder(texts)
    return builder.build()


@dataclass
class _Builder:
    """Builder that dispatches the sections of talk files by their heads."""

    texts: dict[str, str]
    phrases: dict[str, Phrase] = field(default_factory=dict)
    templates: dict[DialogueMove, list[Template]] = field(default_factory=lambda: defaultdict(list))
    actions: dict[ActionValue, dict[tuple[str, str], Phrase]] = field(default_factory=lambda: defaultdict(dict))
    tails: dict[Slot, dict[DialogueMove | None, Phrase]] = field(default_factory=lambda: defaultdict(dict))
    markers: dict[tuple[str, Role, DialogueMove], DiscourseMarker] = field(default_factory=dict)
    joints: dict[tuple[DialogueMove, DialogueMove], Phrase] = field(default_factory=dict)
    fillers: Phrase = Phrase("uh", frozenset(), frozenset())
    clauses: dict[str, Phrase] = field(default_factory=dict)
    props: dict[PropKind, Phrase] = field(default_factory=dict)

    def build(self) -> Grammar:
        files = parse_talk_files(self.texts)
        self.phrases = files.phrases
        for section in files.sections:
            try:
                self._take(section)
            except (OntologyError, ValueError) as error:
                raise (
                    error if isinstance(error, PhraseFileError) else PhraseFileError(f"{section.where}: {error}")
                ) from error
        self._check()
        templates = {move: tuple(self.templates[move]) for move in DialogueMove}
        return Grammar(
            templates,
            dict(self.actions),
            dict(self.tails),
            self.markers,
            self.joints,
            self.fillers,
            self.clauses,
            self.props,
        )

    def _take(self, section: TalkSection) -> None:
        kind, *words = section.words
        if kind in ("do", "doing", "cmd"):
            action = _ACTIONS.get(words[0] if words else "")
            if action is None:
                head = " ".join(section.words)
                raise PhraseFileError(f"{section.where}: `{head}` names no action; they are {sorted(_ACTIONS)}")
            self.actions[action][kind, words[1] if len(words) > 1 else "plain"] = self._phrase(section)
        elif kind == "tail":
            slot, move = parse_slot(words[0]), parse_move(words[1]) if len(words) > 1 else None
            self.tails[slot][move] = self._phrase(section)
        elif kind in MARKER_KINDS:
            marker = DiscourseMarker(self._phrase(section), float(section.keys.get("rate", 1)))
            for word in words[1:] or [move.label for move in DialogueMove]:
                self.markers[kind, parse_role(words[0]), parse_move(word)] = marker
        elif kind == "filler":
            self.fillers = self._phrase(section)
        elif kind == "prop":
            self.props[PropKind(words[0])] = self._phrase(section)
        elif kind == "clause":
            named = words[:-1] if words[-1] in _ACTIONS else words
            Predicate(named[-1])
            self.clauses[" ".join(words)] = self._phrase(section)
        elif kind == "join":
            for before in words[0].split(","):
                for after in words[1].split(","):
                    self.joints[parse_move(before), parse_move(after)] = self._phrase(section)
        else:
            self._take_templates(section, parse_move(kind), words)

    def _phrase(self, section: TalkSection) -> Phrase:
        return choice(" ".join(section.words), alternatives_of(section, self.phrases))

    def _take_templates(self, section: TalkSection, move: DialogueMove, words: list[str]) -> None:
        keys = dict(section.keys)
        topic = keys.pop("topic", None)
        speaker = parse_role(words[0]) if words else None
        when = {parse_slot(name): _labels(section.where, parse_slot(name), listed) for name, listed in keys.items()}
        for line in section.lines:
            for text in split_alternatives(line.text):
                body, close = _split_close(text)
                ending = parse_phrase(line.where, close, self.phrases)
                (parsed,) = parse_alternatives(line.where, body, self.phrases)
                covers, needs = _fields(line.where, parsed.phrase)
                self.templates[move].append(Template(parsed, ending, speaker, when, topic, covers | when.keys(), needs))

    def _check(self) -> None:
        for move in DialogueMove:
            for voice in VOICES:
                # Fallback template without slots, topic and details; it guarantees words for every act.
                if not any(_is_plain(item) and item.speaker in (None, voice) for item in self.templates[move]):
                    raise PhraseFileError(
                        f"{_FOLDER}: {move.label} has no template without slots for {voice.value}; "
                        f"add a section `== {move.label}` to a file there"
                    )
        for action in ActionValue:
            for form in ("do", "doing"):
                if (form, "plain") not in self.actions[action]:
                    raise PhraseFileError(f"{_FOLDER}: there is no section `== {form} {action.label}`")
        for slot in SPOKEN_SLOTS:
            if None not in self.tails[slot]:
                raise PhraseFileError(f"{_FOLDER}: there is no section `== tail {slot.label}`")
        self._check_world()

    def _check_world(self) -> None:
        """Checks that there are words for each prop, each change of the weather and each fault."""
        for kind in PropKind:
            if kind not in self.props:
                raise PhraseFileError(f"{_FOLDER}: there is no section `== prop {kind}` with its names")
        topics = {template.topic for template in self.templates[DialogueMove.EXPLAIN]}
        for topic in _REMARKS:
            if topic not in topics:
                raise PhraseFileError(f"{_FOLDER}: there is no section `== Explain topic={topic}`")


def _split_close(text: str) -> tuple[str, str]:
    """Splits a template into the text before (with the weight) and after the place for afterthoughts."""
    weight = WEIGHT.search(text)
    words = text[: weight.start()] if weight else text.rstrip()
    body, slash, close = words.partition("/")
    if not slash and words.endswith("?"):
        body, close = words[:-1], "?"
    return body + (weight[0] if weight else ""), close


def _is_plain(template: Template) -> bool:
    return not template.covers and not template.needs and template.topic is None


def _fields(where: str, phrase: Phrase) -> tuple[frozenset[Slot], frozenset[str]]:
    needs = phrase.maybe & CONTEXT_FIELDS
    unknown = phrase.maybe - needs - SLOT_FIELDS.keys()
    if unknown:
        raise PhraseFileError(f"{where}: unknown gaps {sorted(unknown)}")
    covers = frozenset(SLOT_FIELDS[name] for name in phrase.gaps - needs)
    if covers != frozenset(SLOT_FIELDS[name] for name in phrase.maybe - needs):
        raise PhraseFileError(f"{where}: a slot is filled in some alternatives only; write them as lines of their own")
    return covers, needs


def _labels(where: str, slot: Slot, wanted: str) -> frozenset[str]:
    values: tuple[SlotValue, ...] = SLOT_VALUES[slot]
    known = {value.label for value in values}
    named = known - _NAMELESS
    sets = {"named": named, "place": named - {LandmarkName.PERSON.label}}
    labels = frozenset(sets[wanted] if wanted in sets else wanted.split(","))
    if not labels <= known:
        raise PhraseFileError(f"{where}: {slot.label} has no values {sorted(labels - known)}")
    return labels
