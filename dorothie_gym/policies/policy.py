"""What a policy is: a stateless object; what it remembers is handed to it and handed back, so that replay is exact."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

from dorothie_gym.ontology import Role
from dorothie_gym.spaces import ActionDict, SpaceLimits, action_space, noop
from dorothie_gym.world.town import Town

State = TypeVar("State")


class Policy(ABC, Generic[State]):
    """Acts for a role on what that role observes.

    Attributes:
        role: whom it acts for.
        limits: sizes of the spaces that it acts in.
    """

    def __init__(self, role: Role, limits: SpaceLimits | None = None) -> None:
        """Prepares a policy for `role`; the sizes of the spaces default to those of `SpaceLimits`."""
        self.role = role
        self.limits = SpaceLimits() if limits is None else limits

    @abstractmethod
    def initial_state(self, seed: int, town: Town) -> State:
        """What the policy knows before the first decision.

        Args:
            seed: all that is drawn by chance follows from it.
            town: the map, which everybody knows; what stands in it comes with the observations.
        """

    @abstractmethod
    def step(self, observation: Mapping[str, Any], state: State) -> tuple[ActionDict, State]:
        """Decides on an action.

        Args:
            observation: of the role, see `observation_space`.
            state: as `initial_state` or the step before returned it; it is left as it is.

        Returns:
            An action of the role's action space, and the state for the next decision.
        """


@dataclass(frozen=True, kw_only=True)
class Draws:
    """A position in a stream of chance: the seed, and how many decisions have been taken."""

    seed: int
    count: int = 0

    def next(self) -> Draws:
        """The position after one more decision."""
        return replace(self, count=self.count + 1)


class SilentPolicy(Policy[None]):
    """Says and does nothing."""

    def initial_state(self, seed: int, town: Town) -> None:
        """There is nothing to remember."""

    def step(self, observation: Mapping[str, Any], state: None) -> tuple[ActionDict, None]:
        """Returns the action that does nothing."""
        return noop(self.role, self.limits), None


class RandomPolicy(Policy[Draws]):
    """Samples the action space; utterances are left to the environment to word."""

    def __init__(self, role: Role, limits: SpaceLimits | None = None) -> None:
        """Takes a copy of the role's action space, to seed it."""
        super().__init__(role, limits)
        self._space = deepcopy(action_space(role, self.limits))

    def initial_state(self, seed: int, town: Town) -> Draws:
        """The beginning of the stream."""
        return Draws(seed=seed)

    def step(self, observation: Mapping[str, Any], state: Draws) -> tuple[ActionDict, Draws]:
        """Returns a sample that follows from the seed and the number of the decision."""
        self._space.seed(state.seed * 1_000_003 + state.count & 0x7FFFFFFF)
        action: ActionDict = self._space.sample()
        for field in ("utterance", "message"):
            if field in action:
                action[field] = ""
        return action, state.next()
