"""A Co-Wizard that drives on and never talks: what driving is worth without talk."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from dorothie_gym.ontology import PhysicalAction, Role
from dorothie_gym.policies.policy import Policy
from dorothie_gym.spaces import ActionDict, CoWizardAction, ExitColumn, Motion, Physical, SpaceLimits
from dorothie_gym.world.town import Town


class LaneFollowPolicy(Policy[None]):
    """Follows its lane, goes as straight on as it can where it has to choose, and turns round at a dead end.

    It does only what the car asks for: it acts where the car stands by Stop or waits at the end of its lane.
    """

    def __init__(self, limits: SpaceLimits | None = None) -> None:
        """Prepares the policy; the sizes of the spaces default to those of `SpaceLimits`."""
        super().__init__(Role.CO_WIZARD, limits)

    def initial_state(self, seed: int, town: Town) -> None:
        """There is nothing to remember."""

    def step(self, observation: Mapping[str, Any], state: None) -> tuple[ActionDict, None]:
        """Returns the action that keeps the car going."""
        return CoWizardAction(physical=_drive_on(observation)).encode(self.limits), None


def _drive_on(observation: Mapping[str, Any]) -> Physical | None:
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
