"""Physical actions that changed something."""

from __future__ import annotations

from collections.abc import Iterator

from dorothie_gym.ontology import PhysicalAction, Role
from dorothie_gym.sessions.records import ActionRecord
from dorothie_gym.sessions.session import Session

_STEADY = (PhysicalAction.STOP, PhysicalAction.LANE_FOLLOW)
"""Done twice in a row among the navigation actions, the second changes nothing."""


def effective_actions(session: Session) -> Iterator[ActionRecord]:
    """Yields the Co-Wizard's actions that changed something.

    What was refused is no action. Lights that are switched to what they are, a stop after a stop and following the lane
    while it is followed change nothing. Hazard stops, and going on after them, are the car's own.
    """
    lights: bool | None = None
    last: PhysicalAction | None = None
    for action in session.physical_actions:
        if action.source is not Role.CO_WIZARD:
            continue
        if action.action is PhysicalAction.LIGHT_CHANGE:
            if action.up is not None and action.up == lights:
                continue
            lights = action.up
        elif action.action is not PhysicalAction.SPEED_CHANGE:
            if action.action in _STEADY and action.action is last:
                continue
            last = action.action
        yield action
