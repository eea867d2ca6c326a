"""One decision of a learned role, up to the inputs of the network: the same in training and in play."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Generic, NamedTuple, Protocol, TypeVar

import numpy as np
import torch
from numpy.typing import NDArray

from dorothie_gym.baselines.roles.learned_role.utterance_inputs import (
    KEPT,
    UTTERANCE_SIZE,
    Utterance,
    word_rows,
    write_utterance,
)
from dorothie_gym.policies.heard_utterance import heard_utterance

if TYPE_CHECKING:
    from dorothie_gym.ontology.dialogue_acts import DialogueMove
    from dorothie_gym.ontology.roles import Role
    from dorothie_gym.session.spaces.observations import ObservationMapping


class TimedView(Protocol):
    """Observation that has been read."""

    @property
    def time(self) -> float:
        """Time of the session [s]."""
        ...


View = TypeVar("View", bound=TimedView)
RoleMemory = TypeVar("RoleMemory")


@dataclass(frozen=True, kw_only=True)
class Attention(Generic[RoleMemory]):
    """State of a player between decisions: its memory, and the last utterances of the other speaker, latest first."""

    memory: RoleMemory
    utterances: tuple[Utterance, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Percept(Generic[View, RoleMemory]):
    """Perception at a decision.

    Attributes:
        view: observation.
        memory: memory, brought up to date with it.
        utterances: last utterances of the other speaker, the latest first.
        heard: whether one has just ended.
    """

    view: View
    memory: RoleMemory
    utterances: tuple[Utterance, ...]
    heard: bool

    @property
    def latest(self) -> Utterance | None:
        """The utterance that has just ended."""
        return self.utterances[0] if self.heard else None

    @cached_property
    def talk(self) -> NDArray[np.float32]:
        """Last utterances as numbers."""
        inputs = np.zeros(KEPT * UTTERANCE_SIZE, dtype=np.float32)
        for number, utterance in enumerate(self.utterances):
            write_utterance(utterance, self.view.time, inputs[number * UTTERANCE_SIZE : (number + 1) * UTTERANCE_SIZE])
        return inputs

    @cached_property
    def words(self) -> NDArray[np.int64]:
        """Rows of the words of the utterance that has just ended."""
        return word_rows("" if self.latest is None else self.latest.heard.words.text)


def just_heard(
    observation: ObservationMapping, speaker: Role, last: DialogueMove | None, now: float
) -> Utterance | None:
    """Returns the utterance that has just ended; None if there is none.

    Args:
        observation: observation of the listener.
        speaker: the other speaker.
        last: last move of the listener, as context of the utterance heard.
        now: time [s].
    """
    heard = heard_utterance(observation, speaker, last)
    return None if heard is None else Utterance(time=now, heard=heard)


def kept_utterances(latest: Utterance | None, before: Sequence[Utterance]) -> tuple[Utterance, ...]:
    """Returns the utterances that are remembered, the latest first."""
    return tuple(before) if latest is None else (latest, *before)[:KEPT]


@dataclass(frozen=True, kw_only=True)
class Inputs:
    """Inputs of one of the two steps of a decision.

    Attributes:
        state: state and utterances (n,).
        words: rows of the words of the latest utterance.
        options: vectors of the options: places, commands or errands (k, m), padded with 0.
        rows: number of each option: row of the landmark, index of the command, or number of the subgoal.
    """

    state: NDArray[np.float32]
    words: NDArray[np.int64]
    options: NDArray[np.float32]
    rows: tuple[int, ...] = ()

    @classmethod
    def of(
        cls,
        state: Sequence[float] | NDArray[np.float32],
        words: NDArray[np.int64],
        vectors: Sequence[Sequence[float]],
        rows: tuple[int, ...],
        shape: tuple[int, int],
    ) -> Inputs:
        """Returns the inputs with the vectors of the options filled up to a shape (k, m)."""
        options = np.zeros(shape, dtype=np.float32)
        if vectors:
            options[: len(vectors)] = vectors
        return cls(state=np.asarray(state, dtype=np.float32), words=words, options=options, rows=rows)


class InputBatch(NamedTuple):
    """Inputs of several sessions, rounded as in training.

    Attributes:
        state: (b, n).
        words: (b, w).
        options: (b, k, m).
        counts: number of options (b,).
    """

    state: NDArray[np.float32]
    words: NDArray[np.int64]
    options: NDArray[np.float32]
    counts: NDArray[np.int64]

    @classmethod
    def of(cls, inputs: Sequence[Inputs]) -> InputBatch:
        """Returns the inputs of sessions, at least one."""
        counts = np.array([len(each.rows) for each in inputs], dtype=np.int64)
        used = int(counts.max())  # options beyond are 0, and need no rounding
        options = np.zeros((len(inputs), *inputs[0].options.shape), dtype=np.float32)
        options[:, :used] = np.stack([each.options[:used] for each in inputs]).astype(np.float16)
        return cls(
            np.stack([each.state for each in inputs]).astype(np.float16).astype(np.float32),
            np.stack([each.words for each in inputs]),
            options,
            counts,
        )

    def tensors(self) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor, torch.Tensor]:
        """Returns state, words, options and their numbers for a network of torch."""
        state, words, options, counts = map(torch.from_numpy, self)
        return state, words, options, counts
