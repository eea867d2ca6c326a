"""Utterances of the other speaker as inputs of a network: numbers and words."""

from __future__ import annotations

import re
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.nlu import understand
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.ontology.dialogue_acts import LABEL_INDEX, LABELS, DialogueAct, DialogueMove
from dorothie_gym.ontology.slots import ActionValue, GoalStatus, LandmarkName, Slot, SlotValue, StreetName
from dorothie_gym.policies import act_builders
from dorothie_gym.policies.heard_utterance import HeardUtterance

WORD_BUCKETS: Final = 4096
"""Number of rows of the word embedding; row 0 is padding, words are hashed into the others."""

MAX_WORDS: Final = 32
"""Number of words of an utterance that are heard."""

KEPT: Final = 3
"""Number of utterances that are remembered."""

_UNNAMED: Final = (LandmarkName.UNKNOWN, LandmarkName.QUERIED)
_AGES: Final = 6  # number of inputs of the age of an utterance
_PREDICATES: Final = tuple(Predicate)
_DIRECTIONS: Final = tuple(Direction)
_MOVES: Final = tuple(DialogueMove)
_NAMES_LEFT_OUT: Final = frozenset(
    LABEL_INDEX[value] for value in LABELS if isinstance(value, LandmarkName | StreetName) and value.label != "Queried"
)
"""Names of places and streets are compared with the map, not learnt one by one."""
_LABELS_HEARD: Final = tuple(k for k in range(len(LABELS)) if k not in _NAMES_LEFT_OUT)
_MENTION: Final = re.compile(r"[a-z']+|\d+|[?]")


@dataclass(frozen=True, kw_only=True)
class Utterance:
    """Utterance that was heard: when [s], acts and parsed words."""

    time: float
    heard: HeardUtterance

    @cached_property
    def places(self) -> tuple[LandmarkName, ...]:
        """Places named, those of the acts first."""
        acts = [name for act in self.heard.acts for name in act.values(Slot.LANDMARK)]
        named = dict.fromkeys([*self.heard.words.landmarks, *acts])
        return tuple(name for name in named if isinstance(name, LandmarkName) and name not in _UNNAMED)

    @cached_property
    def streets(self) -> tuple[StreetName, ...]:
        """Streets named."""
        acts = [name for act in self.heard.acts for name in act.values(Slot.STREET)]
        named = dict.fromkeys([*self.heard.words.streets, *acts])
        unnamed = (StreetName.UNKNOWN, StreetName.QUERIED)
        return tuple(name for name in named if isinstance(name, StreetName) and name not in unnamed)

    @cached_property
    def said(self) -> NDArray[np.float32]:
        """Moves, slot values other than names, and content of the words, as numbers."""
        return np.array(_numbers(self), dtype=np.float32)

    @cached_property
    def stated(self) -> Proposition | None:
        """Proposition that the words ask for; None where slots tell it, as of a question for the reason of a stop."""
        asked = self.heard.words.asked
        if asked is not None and asked.predicate is Predicate.BECAUSE and any(map(_explained, self.heard.acts)):
            return None
        return asked

    @cached_property
    def asks(self) -> DialogueMove | None:
        """Move of the first question that yes or no answers; None without one.

        A question that is understood only to be about a stop or U-turn is assumed to ask why: "way did we
        stop?".
        """
        for act in self.heard.acts:
            why = self.stated is None and _explained(act)
            if act.move is DialogueMove.CHECK or (act.move is DialogueMove.QUERY_YN and not why):
                return act.move
        return None

    @cached_property
    def asks_why(self) -> ActionValue | None:
        """Action whose reason a question asks for: STOP for a standstill, U_TURN for a U-turn."""
        if self.stated is not None:
            return None
        questions = (DialogueMove.QUERY_W, DialogueMove.QUERY_YN)
        return next((_explained(act) for act in self.heard.acts if act.move in questions and _explained(act)), None)

    @cached_property
    def asked(self) -> Proposition | None:
        """Proposition of a question, from its words or otherwise from its slots; None if unknown."""
        if self.stated is not None:
            return self.stated
        for act in self.heard.acts:
            if act.move in (DialogueMove.QUERY_YN, DialogueMove.CHECK):
                objects, actions = (_known(act.values(slot)) for slot in (Slot.OBJECT, Slot.ACTION))
                return act_builders.asked_by_slots(objects, actions, self.places, self.streets)
        return None


def _known(values: Sequence[SlotValue]) -> list[SlotValue]:
    return [value for value in values if value.label != "Queried"]


def _explained(act: DialogueAct) -> ActionValue | None:
    """Returns the action of an act whose reason can be asked for."""
    return next((value for value in (ActionValue.STOP, ActionValue.U_TURN) if value in act.slots), None)


def word_rows(text: str) -> NDArray[np.int64]:
    """Returns the rows of the embedding for the words of a text (`MAX_WORDS`,), filled with 0."""
    rows = np.zeros(MAX_WORDS, dtype=np.int64)
    words = _MENTION.findall(text.lower().replace("’", "'"))[:MAX_WORDS]
    rows[: len(words)] = [1 + zlib.crc32(word.encode()) % (WORD_BUCKETS - 1) for word in words]
    return rows


def write_utterance(utterance: Utterance, now: float, inputs: NDArray[np.float32]) -> None:
    """Writes an utterance, its age and content, into inputs (`UTTERANCE_SIZE`,)."""
    age = now - utterance.time
    inputs[:_AGES] = 1.0, age <= 0.0, age < 1.0, age < 3.0, age < 8.0, min(age, 30.0) / 30.0
    inputs[_AGES:] = utterance.said


def _numbers(utterance: Utterance) -> list[float]:
    acts, words = utterance.heard.acts, utterance.heard.words
    first, rest = [0.0] * len(_MOVES), [0.0] * len(_MOVES)
    labels = [0.0] * len(LABELS)
    for k, act in enumerate(acts):
        (first if k == 0 else rest)[_MOVES.index(act.move)] = 1.0
        for value in act.slots:
            labels[LABEL_INDEX[value]] = 1.0
    turns = [float(words.direction is direction) for direction in _DIRECTIONS]
    asked, told = utterance.asked, words.told
    predicates = [0.0] * (2 * len(_PREDICATES))
    if asked is not None:
        predicates[_PREDICATES.index(asked.predicate)] = -1.0 if asked.negated else 1.0
    if told is not None:
        predicates[len(_PREDICATES) + _PREDICATES.index(told.predicate)] = -1.0 if told.negated else 1.0
    return [
        *first, *rest, *(labels[k] for k in _LABELS_HEARD), *turns, *predicates,
        min(len(acts), 4) / 4.0, *(float((words.ordinal or 0) == k) for k in range(1, 5)),
        float(words.distance is not None), min(words.distance or 0, 200) / 100.0,
        float((words.distance or 999) <= 100), float(words.speed is not None), (words.speed or 0) / 60.0,
        _sign(words.faster), _sign(words.lights), _sign(words.affirms), float(words.here), float(words.further),
        float(words.question), float(bool(words.turns)), float(bool(words.denied)), float(bool(words.dropped)),
        float(bool(words.guessed)), float(bool(words.past)), float(words.order == "before"),
        float(words.order == "after"), min(len(utterance.places), 3) / 3.0, min(len(utterance.streets), 3) / 3.0,
        float("wrong" in words.text.lower()), *(float(status in words.statuses) for status in GoalStatus),
        float(words.direction is not None and len(words.turns) > 1),
    ]  # fmt: skip


def _sign(value: bool | None) -> float:
    return 0.0 if value is None else 1.0 if value else -1.0


UTTERANCE_SIZE: Final = _AGES + len(Utterance(time=0.0, heard=HeardUtterance(acts=(), words=understand(""))).said)
"""Number of inputs of an utterance."""
