"""Watches somebody play the Co-Wizard, and sees what a driver of `Navigation-v0` would see, and should do."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps import Town
from dorothie_gym.maps.model import wrap_degrees
from dorothie_gym.ontology import PhysicalAction
from dorothie_gym.policies.co_wizard import ScriptedCoWizard, attend, respond
from dorothie_gym.policies.co_wizard.driving import distance_ahead
from dorothie_gym.policies.co_wizard.state import CoWizardState
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.navigation.actions import LEFT, NavigationAction, prepares
from dorothie_gym.policies.navigation.junction_exits import JunctionExits
from dorothie_gym.policies.navigation.navigation_policy import (
    PLAIN,
    DriverInputs,
    NavigationPolicyState,
    has_nothing_to_do,
)
from dorothie_gym.policies.navigation.observation_vector import MAX_SECONDS, Vector
from dorothie_gym.policies.route_progress import lanes_beside
from dorothie_gym.spaces import CoWizardAction, Motion, Physical

NEAR_GOAL = 30.0
"""Who stops this near before the place it goes to stops for it [m]."""

_PLAIN_ACTIONS = {
    PhysicalAction.LANE_FOLLOW: NavigationAction.LANE_FOLLOW,
    PhysicalAction.U_TURN: NavigationAction.U_TURN,
    PhysicalAction.STOP: NavigationAction.STOP,
    PhysicalAction.START: NavigationAction.START,
}


class Demonstration(NamedTuple):
    """A decision: what the driver observes (161,), the mask (18,), and what was done."""

    observation: Vector
    mask: NDArray[np.bool_]
    action: NavigationAction


class DemonstrationRecorder:
    """Sits beside a Co-Wizard for a session: it hears and sees the same, and notes what the other does.

    It learns nothing from decisions at which a driver would not be asked, see `has_nothing_to_do`, nor from stops of
    the other's own: scripted Co-Wizards stop before a junction to ask for the way, or to wait for what is in the way.
    """

    def __init__(self, town: Town, max_seconds: float = MAX_SECONDS) -> None:
        """Prepares for a session in a town; `max_seconds` is the time limit of the driver's environment [s]."""
        self._seat = DriverInputs(town, max_seconds)
        mind = ScriptedCoWizard(style=PLAIN).initial_state(0, town)
        self._watched = NavigationPolicyState(mind=mind, speed=mind.speed)
        self._stopped_by_itself = False

    def record(self, seen: Mapping[str, Any], done: CoWizardAction) -> Demonstration | None:
        """Watches a decision.

        Args:
            seen: what the Co-Wizard observed.
            done: what it did then.

        Returns:
            What there is to learn from it; None for nothing.
        """
        attention = attend(seen, self._watched.mind)
        watched = self._watched = self._seat.note(self._watched, attention.mind, attention.view, seen)
        action = action_of(done.physical, seen, self._seat.ways)
        respond(attention, done.physical)
        standing = int(seen["motion"]) == Motion.STOPPED
        if action is NavigationAction.STOP:
            self._stopped_by_itself = not _has_to_stop(attention.mind, attention.view)
        elif not standing:
            self._stopped_by_itself = False
        if self._stopped_by_itself or has_nothing_to_do(watched):
            return None
        observation, mask = self._seat.observe(watched)
        mask[action] = True  # what was done could be done
        return Demonstration(observation, mask, action)


def _has_to_stop(mind: CoWizardState, view: CoWizardView) -> bool:
    """Whether the car was told to stop, or is close to where it is to."""
    place = mind.nudge or (mind.place if mind.exact else None)
    left = distance_ahead(mind, view, place) if place is not None else None
    return mind.halted or (left is not None and left < NEAR_GOAL)


def action_of(physical: Physical | None, seen: Mapping[str, Any], ways: JunctionExits) -> NavigationAction:
    """The action that comes to the same; what the player sets as it is asked for, speed and lights, is nothing.

    Args:
        physical: what the Co-Wizard does.
        seen: what it observes.
        ways: ways on at the town's junctions.
    """
    if physical is None:
        return NavigationAction.NOTHING
    if physical.action is PhysicalAction.J_TURN:
        return _turn(physical.angle, seen, ways)
    if physical.action is PhysicalAction.LANE_SWITCH:
        left = physical.angle * LEFT > 0
        action = NavigationAction.SWITCH_LEFT if left else NavigationAction.SWITCH_RIGHT
    else:
        action = _PLAIN_ACTIONS.get(physical.action, NavigationAction.NOTHING)
    return NavigationAction.NOTHING if prepares(action, seen, ways) else action


def _turn(angle: int, seen: Mapping[str, Any], ways: JunctionExits) -> NavigationAction:
    """The turn into the sector of the exit that fits an angle best [degrees]."""
    choice = ways.choice_ahead(seen)
    if choice is None:
        return NavigationAction.NOTHING
    town = ways.town
    exits = [way for lane in (choice, *lanes_beside(town, choice)) for way in town.exits(lane)]
    best = min(exits, key=lambda way: abs(wrap_degrees(way.angle - angle)))
    sector = ways.sector_of(choice, best.connector)
    return NavigationAction.NOTHING if sector is None else NavigationAction.turn(sector)
