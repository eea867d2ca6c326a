"""Estimate of the action mask of `Navigation-v0` from the observation of the Co-Wizard."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps import LinkType, Town
from dorothie_gym.ontology import PhysicalAction
from dorothie_gym.policies.feasibility import can_switch_lane, can_turn_round, u_turn_start
from dorothie_gym.policies.navigation.actions import ACTIONS, FIRST_TURN, UNDER_WAY, NavigationAction, prepares
from dorothie_gym.policies.navigation.junction_exits import JunctionExits
from dorothie_gym.sim.ego.feasibility import is_past_stopping
from dorothie_gym.sim.ego.limits import HALF_LENGTH, LEAD, MAX_CRUISE, MIN_CRUISE, MIN_SWITCH, U_TURN_SPEED
from dorothie_gym.spaces import ExitColumn, Motion, ObservationMapping

END_TOLERANCE = 0.5
"""Distance by which a U-turn may begin behind the end of its lane [m]."""

_OFF_LINE = (PhysicalAction.LANE_SWITCH, PhysicalAction.U_TURN)
_SIDES = {
    NavigationAction.SWITCH_LEFT: LinkType.LANE_CHANGE_LEFT,
    NavigationAction.SWITCH_RIGHT: LinkType.LANE_CHANGE_RIGHT,
}


class EstimatedActionMask:
    """Estimate of the mask of `NavigationEnv`.

    The mask of the environment follows from the planned path. This estimate knows neither the progress of a lane
    switch or U-turn, nor whether a roadblock leaves too little room for one, and it shares the errors of the pose.
    """

    def __init__(self, town: Town, exits: JunctionExits) -> None:
        self._town, self._exits = town, exits

    def mask(self, observation: ObservationMapping) -> NDArray[np.bool_]:
        """Returns which actions would be carried out now (18,)."""
        town, held = self._town, int(observation["motion"]) == Motion.STOPPED
        lane, station = town.lanes[int(observation["lane"])], float(observation["station"][0])
        speed, cruise = float(observation["speed"][0]), float(observation["cruise_speed"][0])
        manoeuvre = int(observation["manoeuvre"])
        mask = np.zeros(len(ACTIONS), dtype=np.bool_)
        mask[NavigationAction.NOTHING] = mask[NavigationAction.LIGHTS] = True
        mask[NavigationAction.STOP], mask[NavigationAction.START] = not held, held
        mask[NavigationAction.FASTER], mask[NavigationAction.SLOWER] = cruise < MAX_CRUISE, cruise > MIN_CRUISE
        committed = self._is_committed(observation, speed)
        if not lane.in_junction and manoeuvre not in _OFF_LINE:
            for action, side in _SIDES.items():
                mask[action] = can_switch_lane(town, lane.id, station, side, MIN_SWITCH + LEAD)
            start = u_turn_start(station, speed, U_TURN_SPEED**2)
            on_lane = start <= lane.length + END_TOLERANCE
            mask[NavigationAction.U_TURN] = on_lane and can_turn_round(town, lane.id, start)
        if not lane.in_junction and not committed:
            mask[NavigationAction.LANE_FOLLOW] = held or manoeuvre > 0
        for action in UNDER_WAY:
            mask[action] |= prepares(action, observation, self._exits)
        choice = None if committed else self._exits.choice_ahead(observation)
        if choice is not None:
            mask[FIRST_TURN:] = [way is not None for way in self._exits.by_sector(choice)]
        return mask

    def _is_committed(self, observation: ObservationMapping, speed: float) -> bool:
        """Returns whether the car can no longer stop before the junction at which it is about to turn."""
        first = observation["exits"][0]
        if int(observation["manoeuvre"]) != PhysicalAction.J_TURN or not first[ExitColumn.PRESENT]:
            return False
        if self._town.lanes[int(observation["lane"])].in_junction:
            return False
        left = float(first[ExitColumn.DISTANCE]) - HALF_LENGTH
        return is_past_stopping(speed, left)
