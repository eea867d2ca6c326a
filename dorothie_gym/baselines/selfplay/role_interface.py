"""Interface between a role and its network: input vector, discrete actions, action mask."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Final, Generic, TypeAlias, TypeVar

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from dorothie_gym.dialogue.realization_context import Direction
from dorothie_gym.maps.town import Town
from dorothie_gym.ontology.dialogue_acts import LABELS, DialogueAct, DialogueMove
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import LandmarkName
from dorothie_gym.policies.navigation.observation_vector import Vector
from dorothie_gym.policies.observation_parser import heard_utterance, scalar
from dorothie_gym.spaces.actions import ActionMapping, RoleAction
from dorothie_gym.spaces.flat import FlatObservations
from dorothie_gym.spaces.limits import SpaceLimits
from dorothie_gym.spaces.observations import Observation, ObservationMapping, observation_space

Mask: TypeAlias = NDArray[np.bool_]
Memory = TypeVar("Memory")
Action = TypeVar("Action", bound=RoleAction)

SQUASH_LIMIT: Final = 1000.0
"""Magnitude that `squashed` maps to 1."""

UTTERANCE_AGE_UNIT: Final = 20.0
"""Age of an utterance at which its age feature reaches 1 [s]."""

UTTERANCE_SIZE: Final = len(DialogueMove) + len(LABELS) + len(Direction) + 1
"""Size of the features of an utterance: one-hot move, slots, one-hot direction, age."""

_POSITION_COLUMNS: Final = {"landmarks": 1, "objects": 1, "guesses": 1, "props": 1, "waypoints": 0}
"""Tables with positions, and the column of x in each; the column of y is the next."""


@dataclass(frozen=True, kw_only=True)
class LastUtterance:
    """Last utterance that a role heard from a speaker.

    Attributes:
        act: last dialogue act of the utterance.
        direction: direction that the words mention, or None.
        time: time at which it was heard [s].
    """

    act: DialogueAct
    direction: Direction | None
    time: float

    @property
    def landmark(self) -> LandmarkName | None:
        """Landmark that the utterance names."""
        found = (value for value in self.act.ordered if isinstance(value, LandmarkName))
        return next((name for name in found if name not in (LandmarkName.UNKNOWN, LandmarkName.QUERIED)), None)

    def features(self, now: float) -> Vector:
        """Returns the features of the utterance (UTTERANCE_SIZE,) in 0..1, at a time [s]."""
        values = self._content.copy()
        values[-1] = min((now - self.time) / UTTERANCE_AGE_UNIT, 1.0)
        return values

    @cached_property
    def _content(self) -> Vector:
        """Features without the age."""
        move = [float(int(self.act.move) == k) for k in range(len(DialogueMove))]
        direction = [float(self.direction is known) for known in Direction]
        return np.array([*move, *self.act.vector, *direction, 0.0], dtype=np.float32)


def last_utterance(
    observation: ObservationMapping, speaker: Role, previous: LastUtterance | None
) -> LastUtterance | None:
    """Returns the last utterance of a speaker: an utterance is observed for one decision only.

    Args:
        observation: observation of the listener.
        speaker: role that speaks.
        previous: last utterance before this observation.
    """
    said = heard_utterance(observation, speaker)
    if said is None or not said.acts:
        return previous
    return LastUtterance(act=said.acts[-1], direction=said.words.direction, time=scalar(observation, "time"))


_SILENCE: Final[Vector] = np.zeros(UTTERANCE_SIZE, dtype=np.float32)
"""Features of a speaker that has said nothing yet."""


class RoleInterface(ABC, Generic[Memory, Action]):
    """Input vector and discrete actions of a role in a town.

    The input vector has three parts: fields of the role's observation (`FlatObservations`), squashed, with positions in
    the frame of the car (ahead, right); the last utterances that the role heard; and features that the role computes
    itself. Interfaces are stateless: the memory of a role is passed in and handed back.

    Attributes:
        role: the role.
        actions: number of actions; action 0 does nothing.
        size: length of the input vector.
    """

    role: ClassVar[Role]
    speakers: ClassVar[tuple[Role, ...]]
    """Roles that the role hears."""

    fields: ClassVar[tuple[str, ...]]
    """Fields of the observation that enter the input vector."""

    actions: ClassVar[int]
    own_size: ClassVar[int]
    """Length of `own_features`."""

    def __init__(self, town: Town, limits: SpaceLimits) -> None:
        self.town, self.limits = town, limits
        self._flat = self._flat_for(limits)
        self.size = self.size_for(limits)

    @classmethod
    def size_for(cls, limits: SpaceLimits) -> int:
        """Returns the length of the input vector, which does not depend on the town."""
        return len(cls._flat_for(limits).low) + UTTERANCE_SIZE * len(cls.speakers) + cls.own_size

    @classmethod
    def _flat_for(cls, limits: SpaceLimits) -> FlatObservations:
        whole = observation_space(cls.role, limits, observe_acts=False).spaces
        return FlatObservations(spaces.Dict({name: whole[name] for name in cls.fields}))

    @abstractmethod
    def initial_memory(self) -> Memory:
        """Returns the memory before the first decision."""

    @abstractmethod
    def update(self, observation: ObservationMapping, memory: Memory) -> Memory:
        """Returns the memory after an observation."""

    @abstractmethod
    def utterances(self, memory: Memory) -> tuple[LastUtterance | None, ...]:
        """Returns the last utterance of each of `speakers`."""

    @abstractmethod
    def own_features(self, observation: ObservationMapping, memory: Memory) -> list[float]:
        """Returns the features that the role computes itself (own_size,), each in -1..1."""

    @abstractmethod
    def mask(self, observation: ObservationMapping, memory: Memory) -> Mask:
        """Returns the actions that are feasible and useful as far as the role can infer (actions,)."""

    @abstractmethod
    def permitted(self, observation: ObservationMapping, memory: Memory, masks: ActionMapping) -> Mask:
        """Returns the actions that `info["action_mask"]` permits (actions,)."""

    @abstractmethod
    def act(self, choice: int, observation: ObservationMapping, memory: Memory) -> tuple[Action, Memory]:
        """Returns the environment action for the number of an action, and the memory after it."""

    @abstractmethod
    def choice_of(self, action: Action, observation: ObservationMapping, memory: Memory) -> int:
        """Returns the number of the action that is closest to an environment action; 0 if none is similar."""

    def vector(self, observation: ObservationMapping, memory: Memory) -> Vector:
        """Returns the input vector (size,), each in -1..1; `memory` is the result of `update`."""
        stacked = {name: np.asarray(observation[name])[None] for name in (*self.fields, "pose")}
        whole: Vector = self.vectors(stacked, [observation], [memory])[0]
        return whole

    def vectors(
        self, stacked: ObservationMapping, observations: Sequence[ObservationMapping], memories: Sequence[Memory]
    ) -> Vector:
        """Returns the input vectors of several sessions (n, size), see `vector`.

        Args:
            stacked: fields of the observations with a leading axis (n, ...).
            observations: observation of each session.
            memories: memory of the role in each session.
        """
        flat = self._flat.vectors(in_car_frame(stacked, self.fields))
        own = [
            np.concatenate([*self._heard(memory, observation), self.own_features(observation, memory)])
            for observation, memory in zip(observations, memories, strict=True)
        ]
        whole: Vector = np.clip(np.concatenate([squashed(flat), np.array(own, dtype=np.float32)], axis=1), -1.0, 1.0)
        return whole

    def _heard(self, memory: Memory, observation: ObservationMapping) -> list[Vector]:
        """Returns the features of the last utterances."""
        now = scalar(observation, "time")
        return [_SILENCE if said is None else said.features(now) for said in self.utterances(memory)]


AnyRoleInterface: TypeAlias = RoleInterface[Any, Any]
"""Interface of a role that is not known statically."""


def in_car_frame(stacked: ObservationMapping, fields: Iterable[str]) -> Observation:
    """Returns fields of stacked observations, positions as metres ahead and right of the car; unused rows stay 0."""
    x, y, headings = (stacked["pose"][:, k, None] for k in range(3))
    sine, cosine = (
        np.array([[function(heading)] for heading in headings.ravel().tolist()]) for function in (math.sin, math.cos)
    )
    turned = {name: stacked[name] for name in fields}
    for name, column in _POSITION_COLUMNS.items():
        if name not in turned:
            continue
        table = np.array(turned[name], dtype=np.float64)  # (n, rows, columns)
        used = table.any(axis=2)
        east, south = (table[:, :, column] - x) * used, (table[:, :, column + 1] - y) * used
        table[:, :, column] = east * cosine + south * sine
        table[:, :, column + 1] = south * cosine - east * sine
        turned[name] = table
    return turned


def squashed(values: Vector) -> Vector:
    """Returns sign(x) log(1 + |x|) of each number x, scaled: metres, shares and seconds get similar magnitudes."""
    return np.asarray(np.sign(values) * np.log1p(np.abs(values)) / math.log1p(SQUASH_LIMIT), dtype=np.float32)


def one_hot(index: int | None, size: int) -> list[float]:
    """Returns `size` numbers, 1 at `index` and 0 elsewhere; all 0 for None."""
    return [float(k == index) for k in range(size)]
