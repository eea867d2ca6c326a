"""Interface of a role to a language model: times of calls, prompts, and effects of answers."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from typing import TYPE_CHECKING, ClassVar, Final, Generic, TypeVar

from dorothie_gym.dialogue.dialogue_act_classifier import guess_spans
from dorothie_gym.maps.town import Town
from dorothie_gym.ontology.slots import LandmarkName, StreetName
from dorothie_gym.policies.language_model.answer_schema import AnswerSchema, ChoiceField, WordsField
from dorothie_gym.policies.observation_parser import (
    SeenLandmark,
    is_dark,
    is_foggy,
    is_rainy,
    read_landmarks,
    scalar,
    street_of,
)
from dorothie_gym.policies.place_looks import look_of
from dorothie_gym.policies.policy import DecisionClock, replace
from dorothie_gym.session.spaces.actions import ActionDict, Speech

if TYPE_CHECKING:
    from dorothie_gym.ontology.roles import Role
    from dorothie_gym.session.spaces.fields import SpaceLimits
    from dorothie_gym.session.spaces.observations import ObservationMapping

KEEP: Final = "keep"
"""Label of leaving a goal, a status or a plan as it is."""

NONE: Final = "none"
"""Label of doing nothing in a field."""

SHOWN_TALK: Final = 30
"""Number of utterances that a prompt shows."""

SAY_LENGTH: Final = 160
"""Longest utterance of a model [characters]."""

NOTE_LENGTH: Final = 600
"""Longest note of a model to itself [characters]."""

ADDS: Final = "add: "
"""Beginning of a note that is added to the one before."""

THOUGHT_LENGTH: Final = 240
"""Longest thought of a model before its choices [characters]."""

LONGEST_YIELD: Final = 4.0
"""Time for which a role lets the other speaker finish before it speaks [s]."""

AGAIN: Final = ("10", "1", "2", "3", "5", "20", "30")
"""Times after which a model can request another call [s]."""


@dataclass(frozen=True, kw_only=True)
class Line:
    """Utterance of the conversation as a role knows it; `speaker` is "you" for its own."""

    time: float
    speaker: str
    text: str


@dataclass(frozen=True, kw_only=True)
class Memory:
    """Memory of a role between its decisions.

    Attributes:
        town: the map.
        clock: times of the decisions.
        talk: utterances that were said and heard, the latest last.
        note: note of the model to itself.
        again_at: time at which the model has requested another call [s].
        speech: spans that are still to be spoken.
        yields_since: start of a wait for the other speaker to finish [s]; None if the role does not wait.
    """

    town: Town
    clock: DecisionClock = DecisionClock()
    talk: tuple[Line, ...] = ()
    note: str = ""
    again_at: float = math.inf
    speech: tuple[Speech, ...] = ()
    yields_since: float | None = None


M = TypeVar("M", bound=Memory)


class RoleInterface(ABC, Generic[M]):
    """Interface of one role; without state, like a policy.

    Attributes:
        patience: longest time between two calls as a multiple of `LanguageModelConfig.quiet_time`.
        action_field: field of the answer with an action that may no longer be possible when it is due; empty for none.
    """

    role: ClassVar[Role]
    patience: ClassVar[float] = 1.0
    action_field: ClassVar[str] = ""

    def __init__(self, limits: SpaceLimits) -> None:
        """Prepares the interface for spaces of given sizes."""
        self.limits = limits

    @property
    def system(self) -> str:
        """System prompt of the role."""
        return system_prompt(self.role)

    @abstractmethod
    def begin(self, town: Town) -> M:
        """Returns the memory before the first decision."""

    @abstractmethod
    def attend(self, observation: ObservationMapping, memory: M, delay: float) -> tuple[M, tuple[str, ...]]:
        """Processes an observation.

        Args:
            observation: observation of the role, with its action mask.
            memory: memory of the decision before.
            delay: simulated time that an answer takes [s].

        Returns: The memory, and the events that trigger a call, in words.
        """

    @abstractmethod
    def prompt(self, observation: ObservationMapping, memory: M, events: Sequence[str]) -> tuple[str, AnswerSchema]:
        """Returns the prompt of a call and the schema of its answer.

        Args:
            observation: observation of the role, with its action mask.
            memory: result of `attend`.
            events: events since the last call, in words.
        """

    @abstractmethod
    def accept(self, observation: ObservationMapping, memory: M, answer: Mapping[str, str]) -> tuple[M, int]:
        """Processes an answer of the schema.

        Args:
            observation: current observation of the role.
            memory: current memory.
            answer: value of each field.

        Returns:
            The memory, and the number of chosen actions that are no longer possible.
        """

    @abstractmethod
    def act(self, observation: ObservationMapping, memory: M) -> tuple[ActionDict, M, int]:
        """Returns the action of a decision, the memory, and the number of actions that are no longer possible."""


@lru_cache(maxsize=8)
def system_prompt(role: Role) -> str:
    """Returns the system prompt of a role, a text file of this package."""
    return files(__package__).joinpath("prompts", f"{role}.txt").read_text(encoding="utf-8").strip()


# --- Talk -------------------------------------------------------------------------------------------------------------


def thought_field() -> WordsField:
    """Returns the first field of an answer: room to consider the choices, of which nothing is kept."""
    meaning = "what you consider before you choose, in brief; nobody hears or keeps it; may be empty"
    return WordsField(name="thought", length=THOUGHT_LENGTH, meaning=meaning)


def words_fields() -> tuple[WordsField, WordsField, ChoiceField]:
    """Returns the fields of talk, note, and time of the next call, which all speaking roles have."""
    return (
        WordsField(name="say", length=SAY_LENGTH, meaning="what you say now; empty to say nothing"),
        note_field(),
        again_field(),
    )


def note_field() -> WordsField:
    """Returns the field of the note that the model keeps for itself."""
    meaning = f"note to yourself, shown next time; replaces the last one; {KEEP}: as before; {ADDS}WORDS: adds words"
    return WordsField(name="note", length=NOTE_LENGTH, meaning=meaning)


def edited_note(note: str, words: str) -> str:
    """Returns a note after an answer: kept, extended or replaced.

    A note that becomes too long loses its beginning, up to the end of an addition if there is one.

    Args:
        note: note before.
        words: field of the answer.
    """
    if words == KEEP:
        return note
    if not words.startswith(ADDS):
        return words
    edited = f"{note}; {words.removeprefix(ADDS)}" if note else words.removeprefix(ADDS)
    while len(edited) > NOTE_LENGTH:
        edited = edited.partition("; ")[2] or edited[-NOTE_LENGTH:]
    return edited


def again_field() -> ChoiceField:
    """Returns the field of the time of the next call."""
    return ChoiceField(name="again", labels=AGAIN, meaning="ask me again after so many seconds if nothing happens")


def with_talk(memory: M, answer: Mapping[str, str], now: float) -> M:
    """Takes words, note and time of the next call from an answer."""
    memory = replace(memory, note=edited_note(memory.note, answer["note"]), again_at=now + float(answer["again"]))
    words = answer["say"].strip()
    if not words:
        return memory
    spans = tuple(Speech(act=span.act, text=span.text[:SAY_LENGTH]) for span in guess_spans(words))
    talk = (*memory.talk, Line(time=now, speaker="you", text=words))
    return replace(memory, talk=talk, speech=(*memory.speech, *spans) if spans else memory.speech)


def next_speech(observation: ObservationMapping, memory: M) -> tuple[Speech | None, M]:
    """Returns the next span to speak, None while the other speaker talks or there is nothing to say."""
    if not memory.speech:
        return None, replace(memory, yields_since=None) if memory.yields_since is not None else memory
    now = scalar(observation, "time")
    begins = scalar(observation, "speaking") <= 0.0
    since = now if memory.yields_since is None else memory.yields_since
    if begins and bool(observation["other_speaking"][0]) and now - since < LONGEST_YIELD:
        return None, replace(memory, yields_since=since)
    return memory.speech[0], replace(memory, speech=memory.speech[1:], yields_since=None)


def with_heard(memory: M, observation: ObservationMapping, speaker: Role, called: str) -> tuple[M, str]:
    """Adds an utterance that has ended to the talk; returns its words, empty if there are none."""
    words = str(observation[f"{speaker}_text"]).strip()
    if not words:
        return memory, ""
    line = Line(time=scalar(observation, "time"), speaker=called, text=words)
    return replace(memory, talk=(*memory.talk, line)), words


# --- Words of a prompt ------------------------------------------------------------------------------------------------


def clock(seconds: float) -> str:
    """Returns minutes and seconds, as "4:07"."""
    return f"{int(seconds) // 60}:{int(seconds) % 60:02d}"


def talk_lines(talk: Sequence[Line]) -> list[str]:
    """Returns the last utterances, a line each."""
    if not talk:
        return ["- nothing yet"]
    return [f"- {clock(line.time)} {line.speaker}: {line.text}" for line in talk[-SHOWN_TALK:]]


def weather_words(observation: ObservationMapping) -> str:
    """Returns weather and light in words."""
    words = [
        name for name, there in (("fog", is_foggy), ("heavy rain", is_rainy), ("dark", is_dark)) if there(observation)
    ]
    return ", ".join(words) or "clear"


def section(title: str, lines: Sequence[str]) -> list[str]:
    """Returns a titled list; nothing if it is empty."""
    return [f"{title}:", *lines] if lines else []


def street_name(name: StreetName) -> str:
    """Returns a street in words."""
    return "an unnamed street" if name is StreetName.UNKNOWN else f"{name.label} Street"


def street_here(observation: ObservationMapping, town: Town, lane: int) -> str:
    """Returns the street of a lane in words."""
    return street_name(street_of(observation, town, lane))


def named_places(observation: ObservationMapping, town: Town) -> dict[str, SeenLandmark]:
    """Returns the landmarks of an observation by their names in prompts; those that share a name have their street."""
    marks = read_landmarks(observation, town)
    found: dict[str, SeenLandmark] = {}
    for mark in marks:
        alone = sum(other.name is mark.name for other in marks) == 1
        name = mark.name.label if alone else f"{mark.name.label} on {street_name(mark.street)}"
        found[name if name not in found else f"{name} ({mark.row})"] = mark
    return found


def look_lines(observation: ObservationMapping, town: Town, seen: Collection[SeenLandmark]) -> list[str]:
    """Returns the looks of houses and people among landmarks, a line each.

    Args:
        observation: observation of the role, which names the landmarks.
        town: the map.
        seen: landmarks whose looks the role knows.
    """
    rows = {mark.row for mark in seen}
    looks = {label: look_of(town, mark) for label, mark in named_places(observation, town).items() if mark.row in rows}
    return [f"- {label}: {look.listed}" for label, look in looks.items() if look is not None]


ALL_NAMES: Final = tuple(name for name in LandmarkName if name not in (LandmarkName.UNKNOWN, LandmarkName.QUERIED))
"""Names of places, by which also those can be goals that are not on the map."""
