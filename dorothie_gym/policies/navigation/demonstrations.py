"""Demonstrations for drivers of `Navigation-v0`, recorded from sessions of other Co-Wizards."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.policies.co_wizard.driving import distance_ahead
from dorothie_gym.policies.co_wizard.policy import ScriptedCoWizard, attend, respond
from dorothie_gym.policies.navigation.actions import LEFT, NavigationAction, prepares
from dorothie_gym.policies.navigation.driver_view import driver_of
from dorothie_gym.policies.navigation.navigation_policy import (
    PLAIN_STYLE,
    DriverInputs,
    NavigationPolicyState,
    has_nothing_to_do,
)
from dorothie_gym.policies.navigation.observation_fields import MAX_SECONDS, Vector
from dorothie_gym.policies.route_progress import lanes_beside
from dorothie_gym.sim.state.codes import Motion
from dorothie_gym.support.portable_math import wrap_degrees

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.policies.co_wizard.state import CoWizardState
    from dorothie_gym.policies.co_wizard.view import CoWizardView
    from dorothie_gym.policies.navigation.junction_exits import JunctionExits
    from dorothie_gym.session.spaces.actions import CoWizardAction, Physical
    from dorothie_gym.session.spaces.observations import ObservationMapping

STOP_FOR_GOAL = 30.0
"""Distance to the destination within which a stop is attributed to it [m]."""

_PLAIN_ACTIONS = {
    PhysicalAction.LANE_FOLLOW: NavigationAction.LANE_FOLLOW,
    PhysicalAction.U_TURN: NavigationAction.U_TURN,
    PhysicalAction.STOP: NavigationAction.STOP,
    PhysicalAction.START: NavigationAction.START,
}


class Demonstration(NamedTuple):
    """Demonstrated decision: the driver's observation (161,), its mask (18,), and the action taken."""

    observation: Vector
    mask: NDArray[np.bool_]
    action: NavigationAction


class DemonstrationRecorder:
    """Converts the decisions of another Co-Wizard in a session to demonstrations.

    Two kinds of decisions are left out: those at which a driver has nothing to decide (`has_nothing_to_do`), and stops
    without an instruction, because scripted Co-Wizards stop before a junction to ask for the way, or behind obstacles.
    """

    def __init__(self, town: Town, max_seconds: float = MAX_SECONDS) -> None:
        """Prepares for a session in a town; `max_seconds` is the time limit of the driver's environment [s]."""
        self._inputs = DriverInputs(town, max_seconds)
        co_wizard = ScriptedCoWizard(style=PLAIN_STYLE).initial_state(0, town)
        self._state = NavigationPolicyState(co_wizard=co_wizard, speed=co_wizard.intentions.speed)
        self._stopped_by_itself = False

    def record(self, observation: ObservationMapping, done: CoWizardAction) -> Demonstration | None:
        """Converts a decision.

        Args:
            observation: observation of the Co-Wizard.
            done: its action.

        Returns:
            The demonstration, or None for a decision that is left out.
        """
        decision = attend(observation, self._state.co_wizard)
        state = self._state = self._inputs.update(self._state, decision.state, decision.view, observation)
        action = action_of(done.physical, observation, self._inputs.exits)
        respond(decision, done.physical)
        standing = int(observation["motion"]) == Motion.STOPPED
        if action is NavigationAction.STOP:
            self._stopped_by_itself = not _has_to_stop(decision.state, decision.view)
        elif not standing:
            self._stopped_by_itself = False
        if self._stopped_by_itself or has_nothing_to_do(state):
            return None
        vector, mask = self._inputs.observe(state)
        mask[action] = True  # an action that was taken is feasible, even where the estimate differs
        return Demonstration(vector, mask, action)


def _has_to_stop(state: CoWizardState, view: CoWizardView) -> bool:
    """Returns whether the car was instructed to stop, or is close to its destination."""
    place = state.intentions.nudge or state.beliefs.stop_place
    left = distance_ahead(state, view, place) if place is not None else None
    return state.intentions.halted or (left is not None and left < STOP_FOR_GOAL)


def action_of(physical: Physical | None, observation: ObservationMapping, exits: JunctionExits) -> NavigationAction:
    """Maps a physical action to the equivalent `NavigationAction`; speed and light changes map to `NOTHING`.

    Args:
        physical: physical action of the Co-Wizard, or None.
        observation: observation of the Co-Wizard.
        exits: exits of the town's junctions.
    """
    if physical is None:
        return NavigationAction.NOTHING
    if physical.action is PhysicalAction.J_TURN:
        return _turn_of(physical.angle, observation, exits)
    if physical.action is PhysicalAction.LANE_SWITCH:
        left = physical.angle * LEFT > 0
        action = NavigationAction.SWITCH_LEFT if left else NavigationAction.SWITCH_RIGHT
    else:
        action = _PLAIN_ACTIONS.get(physical.action, NavigationAction.NOTHING)
    return NavigationAction.NOTHING if prepares(driver_of(observation, exits), int(action)) else action


def _turn_of(angle: int, observation: ObservationMapping, exits: JunctionExits) -> NavigationAction:
    """Returns the turn into the sector of the exit whose angle is closest [degrees]."""
    choice = exits.choice_ahead(observation)
    if choice is None:
        return NavigationAction.NOTHING
    town = exits.town
    ways = [way for lane in (choice, *lanes_beside(town, choice)) for way in town.exits(lane)]
    best = min(ways, key=lambda way: abs(wrap_degrees(way.angle - angle)))
    sector = exits.sector_of(choice, best.connector)
    return NavigationAction.NOTHING if sector is None else NavigationAction.turn(sector)
