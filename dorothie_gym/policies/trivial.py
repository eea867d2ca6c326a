"""Policies without dialogue: silent, random and lane following."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.roles import Role
from dorothie_gym.policies.policy import Policy, TypedPolicy, replace
from dorothie_gym.session.spaces.actions import (
    ActionDict,
    CoWizardAction,
    Physical,
    RoleAction,
    action_space,
    idle_action,
)
from dorothie_gym.session.spaces.observations import ExitColumn, ObservationMapping
from dorothie_gym.sim.state.codes import Motion

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.spaces.fields import SpaceLimits


@dataclass(frozen=True, kw_only=True)
class DrawCount:
    """Position in a stream of random draws: its seed, and the number of decisions taken."""

    seed: int
    count: int = 0

    def next(self) -> DrawCount:
        """Returns the position after one more decision."""
        return replace(self, count=self.count + 1)


class SilentPolicy(TypedPolicy[None]):
    """Policy that neither speaks nor acts."""

    observes = False

    def initial_state(self, seed: int, town: Town) -> None:
        """Returns None: the policy has no state."""

    def act(self, observation: ObservationMapping, state: None) -> tuple[RoleAction, None]:
        """Returns the action that does nothing."""
        return idle_action(self.role), None


class RandomPolicy(Policy[DrawCount]):
    """Samples the action space; the environment words the utterances."""

    observes = False

    def __init__(self, role: Role, limits: SpaceLimits | None = None) -> None:
        """Prepares a policy for `role`, with a copy of its action space."""
        super().__init__(role, limits)
        self._space = deepcopy(action_space(role, self.limits))

    def initial_state(self, seed: int, town: Town) -> DrawCount:
        """Returns the state before the first draw."""
        return DrawCount(seed=seed)

    def step(self, observation: ObservationMapping, state: DrawCount) -> tuple[ActionDict, DrawCount]:
        """Returns a sample that depends only on the seed and the number of the decision."""
        self._space.seed(state.seed * 1_000_003 + state.count & 0x7FFFFFFF)
        action: ActionDict = self._space.sample()
        for field in ("utterance", "message"):
            if field in action:
                action[field] = ""
        return action, state.next()


class LaneFollowPolicy(TypedPolicy[None]):
    """Co-Wizard that drives and never talks; a baseline for driving without dialogue.

    It follows its lane, takes the straightest exit if it has to choose, and turns round at a dead end. It acts only
    where the car has been stopped or waits at the end of its lane.
    """

    def __init__(self, limits: SpaceLimits | None = None) -> None:
        """Prepares the policy; the sizes of the spaces default to those of `SpaceLimits`."""
        super().__init__(Role.CO_WIZARD, limits)

    def initial_state(self, seed: int, town: Town) -> None:
        """Returns None: the policy has no state."""

    def act(self, observation: ObservationMapping, state: None) -> tuple[CoWizardAction, None]:
        """Returns the action that keeps the car going."""
        return CoWizardAction(physical=_drive_on(observation)), None


def _drive_on(observation: ObservationMapping) -> Physical | None:
    motion = Motion(int(observation["motion"]))
    if motion is Motion.STOPPED:
        return Physical(action=PhysicalAction.START)
    if motion is not Motion.WAITING:
        return None
    exits = observation["exits"]
    angles = exits[exits[:, ExitColumn.PRESENT] > 0.0][:, ExitColumn.ANGLE]
    if len(angles) == 0:
        return Physical(action=PhysicalAction.U_TURN)
    return Physical(action=PhysicalAction.J_TURN, angle=int(angles[np.argmin(np.abs(angles))]))
