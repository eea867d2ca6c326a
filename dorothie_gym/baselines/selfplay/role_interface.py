"""Interface between a role and its network: input vector, discrete actions, action mask."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from typing import Any, ClassVar, Final, Generic, TypeAlias, TypeVar

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from dorothie_gym.baselines.selfplay.utterance_memory import HEARD_SIZE, HeardRemark
from dorothie_gym.maps import Town
from dorothie_gym.ontology import Role
from dorothie_gym.policies.observation_parser import scalar
from dorothie_gym.spaces import RoleAction, SpaceLimits, observation_space
from dorothie_gym.wrappers.flatten import FlatObservations

Vector: TypeAlias = NDArray[np.float32]
Mask: TypeAlias = NDArray[np.bool_]
Memory = TypeVar("Memory")

FAR = 1000.0
"""Quantity that the logarithmic squashing maps to 1."""

_PLACES: Final = {"landmarks": 1, "objects": 1, "guesses": 1, "props": 1, "waypoints": 0}
"""Tables with places, and the column of x; that of y is the next."""


class RoleInterface(ABC, Generic[Memory]):
    """Input vector and discrete actions of a role in a town.

    The vector has numbers of the role's observation (`FlatObservations`) with places in the car's own frame (ahead
    and to the right), squashed; then the last remarks that it heard; then what the role makes of it all. Seats are
    stateless: what a role remembers is handed over and back.

    Attributes:
        role: the role.
        actions: how many there are; 0 does nothing.
        size: numbers of the vector.
    """

    role: ClassVar[Role]
    speakers: ClassVar[tuple[Role, ...]]
    """Roles that the role hears."""

    fields: ClassVar[tuple[str, ...]]
    """Fields of the observation whose numbers are taken in as they are."""

    actions: ClassVar[int]
    own_size: ClassVar[int]
    """Numbers that `own` returns."""

    def __init__(self, town: Town, limits: SpaceLimits) -> None:
        self.town, self.limits = town, limits
        self._flat = self._flat_for(limits)
        self.size = self.size_for(limits)

    @classmethod
    def size_for(cls, limits: SpaceLimits) -> int:
        """Numbers of the vector, in whatever town."""
        return len(cls._flat_for(limits).low) + HEARD_SIZE * len(cls.speakers) + cls.own_size

    @classmethod
    def _flat_for(cls, limits: SpaceLimits) -> FlatObservations:
        whole = observation_space(cls.role, limits, observe_acts=False).spaces
        return FlatObservations(spaces.Dict({name: whole[name] for name in cls.fields}))

    @abstractmethod
    def begin(self) -> Memory:
        """Returns the memory before the first decision."""

    @abstractmethod
    def notice(self, observation: Mapping[str, Any], memory: Memory) -> Memory:
        """Returns the memory after an observation."""

    @abstractmethod
    def remarks(self, memory: Memory) -> tuple[HeardRemark | None, ...]:
        """Returns the last utterance of each of `speakers`."""

    @abstractmethod
    def own(self, observation: Mapping[str, Any], memory: Memory) -> list[float]:
        """Returns the role's own features (own_size,), each in -1..1."""

    @abstractmethod
    def mask(self, observation: Mapping[str, Any], memory: Memory) -> Mask:
        """Returns the actions that the role's own observation suggests to be possible (actions,)."""

    @abstractmethod
    def allowed(self, observation: Mapping[str, Any], masks: Mapping[str, Any]) -> Mask:
        """Returns the actions that `info["action_mask"]` allows (actions,)."""

    @abstractmethod
    def act(self, choice: int, observation: Mapping[str, Any], memory: Memory) -> tuple[RoleAction, Memory]:
        """Returns the action of a number, and the memory after it."""

    @abstractmethod
    def choice_of(self, action: Any, observation: Mapping[str, Any], memory: Memory) -> int:
        """Returns the number of the most similar action to a recorded one of the role; 0 for none."""

    def vector(self, observation: Mapping[str, Any], memory: Memory) -> Vector:
        """Returns the input vector (size,), each in -1..1; `memory` is that of `notice`."""
        now = scalar(observation, "time")
        flat = self._flat.vector(in_own_frame(observation, self.fields))
        heard = [
            np.zeros(HEARD_SIZE, dtype=np.float32) if remark is None else remark.vector(now)
            for remark in self.remarks(memory)
        ]
        own = np.array(self.own(observation, memory), dtype=np.float32)
        whole: Vector = np.clip(np.concatenate([squashed(flat), *heard, own]), -1.0, 1.0)
        return whole


def in_own_frame(observation: Mapping[str, Any], fields: Iterable[str]) -> dict[str, Any]:
    """Fields with the places of their tables as metres ahead of the car and to its right; unused rows stay 0."""
    x, y, heading = observation["pose"].tolist()
    sine, cosine = math.sin(heading), math.cos(heading)
    turned = {name: observation[name] for name in fields}
    for name, column in _PLACES.items():
        if name not in turned:
            continue
        table = np.array(turned[name], dtype=np.float64)
        used = table.any(axis=1)
        east, south = (table[:, column] - x) * used, (table[:, column + 1] - y) * used
        table[:, column], table[:, column + 1] = east * cosine + south * sine, south * cosine - east * sine
        turned[name] = table
    return turned


def squashed(values: Vector) -> Vector:
    """Returns sign(x) log(1 + |x|) of each number x, which brings metres, shares and seconds to similar sizes."""
    return np.asarray(np.sign(values) * np.log1p(np.abs(values)) / math.log1p(FAR), dtype=np.float32)


def one_hot(at: int | None, size: int) -> list[float]:
    """Returns zeros with a 1 at a place; None for zeros alone."""
    return [float(k == at) for k in range(size)]
