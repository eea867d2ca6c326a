"""Which actions the car is likely to carry out, as far as the Co-Wizard's observation tells."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps import LinkType, Town
from dorothie_gym.maps.lane_neighbours import oncoming_lanes
from dorothie_gym.ontology import PhysicalAction
from dorothie_gym.policies.navigation.actions import ACTIONS, FIRST_TURN, NavigationAction, prepares
from dorothie_gym.policies.navigation.junction_exits import JunctionExits
from dorothie_gym.sim.ego.ego_controller import MAX_CRUISE, MIN_CRUISE
from dorothie_gym.sim.ego.manoeuvre_lanes import LEAD, MIN_SWITCH
from dorothie_gym.sim.ego.obstacles import BRAKING, HALF_LENGTH
from dorothie_gym.sim.ego.planner import HARD_STOP, U_TURN_SPEED
from dorothie_gym.spaces import ExitColumn, Motion

_OFF_LINE = (PhysicalAction.LANE_SWITCH, PhysicalAction.U_TURN)


class EstimatedActionMask:
    """Estimates the mask of `NavigationEnv` from what is observed.

    The environment's own mask follows from the plan of the car. This one knows neither how far a lane switch or U-turn
    has got, nor whether a roadblock leaves too little room for one, and where the pose is off it is, too.
    """

    def __init__(self, town: Town, ways: JunctionExits) -> None:
        self._town, self._ways = town, ways
        self._oncoming = oncoming_lanes(town)

    def mask(self, seen: Mapping[str, Any]) -> NDArray[np.bool_]:
        """Which actions the car follows now (18,)."""
        town, held = self._town, int(seen["motion"]) == Motion.STOPPED
        lane, station, speed = town.lanes[int(seen["lane"])], float(seen["station"][0]), float(seen["speed"][0])
        cruise, manoeuvre = float(seen["cruise_speed"][0]), int(seen["manoeuvre"])
        mask = np.zeros(len(ACTIONS), dtype=np.bool_)
        mask[NavigationAction.NOTHING] = mask[NavigationAction.LIGHTS] = True
        mask[NavigationAction.STOP], mask[NavigationAction.START] = not held, held
        mask[NavigationAction.FASTER], mask[NavigationAction.SLOWER] = cruise < MAX_CRUISE, cruise > MIN_CRUISE
        committed = self._is_committed(seen, speed)
        if not lane.in_junction and manoeuvre not in _OFF_LINE:
            room = lane.length - station >= MIN_SWITCH + LEAD
            sides = (NavigationAction.SWITCH_LEFT, NavigationAction.SWITCH_RIGHT)
            links = (LinkType.LANE_CHANGE_LEFT, LinkType.LANE_CHANGE_RIGHT)
            for action, side in zip(sides, links, strict=True):
                mask[action] = room and town.neighbour(lane.id, side) is not None
            begin = station + LEAD * (speed > 0.5) + max(0.0, speed**2 - U_TURN_SPEED**2) / (2.0 * BRAKING)
            reaches = begin <= lane.length + 0.5
            mask[NavigationAction.U_TURN] = (
                reaches and self._oncoming.at(lane.id, min(begin, lane.length)) is not None
            )  # fmt: skip
        if not lane.in_junction and not committed:
            mask[NavigationAction.LANE_FOLLOW] = held or manoeuvre > 0
        for action in (NavigationAction.SWITCH_LEFT, NavigationAction.SWITCH_RIGHT, NavigationAction.U_TURN):
            mask[action] |= prepares(action, seen, self._ways)
        choice = None if committed else self._ways.choice_ahead(seen)
        if choice is not None:
            mask[FIRST_TURN:] = [way is not None for way in self._ways.after(choice)]
        return mask

    def _is_committed(self, seen: Mapping[str, Any], speed: float) -> bool:
        """Whether the car cannot stop any more before the junction at which it is about to turn."""
        first = seen["exits"][0]
        if int(seen["manoeuvre"]) != PhysicalAction.J_TURN or not first[ExitColumn.PRESENT]:
            return False
        if self._town.lanes[int(seen["lane"])].in_junction:
            return False
        return speed > 0.5 and speed**2 / (2.0 * HARD_STOP) > float(first[ExitColumn.DISTANCE]) - HALF_LENGTH
