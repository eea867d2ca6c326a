"""Which actions would not be refused: masks in the form that `Dict.sample(mask=...)` takes."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from dorothie_gym.ontology import SPEED_STEP, ExceptionKind, PhysicalAction, Role
from dorothie_gym.spaces import SpaceLimits, action_space
from dorothie_gym.tasks import TaskState
from dorothie_gym.world.car.driver import MAX_CRUISE, MIN_CRUISE
from dorothie_gym.world.town import LinkType
from dorothie_gym.world.world import World

Mask = NDArray[np.int8]

EVERY_TIME = (
    ExceptionKind.NONE,
    ExceptionKind.WEATHER,
    ExceptionKind.SPAWN_VEHICLES,
    ExceptionKind.SPAWN_PEDESTRIANS,
    ExceptionKind.SENSOR_FAULT,
    ExceptionKind.MESSAGE,
)
"""Exceptions that are always worth trying."""


class Masks:
    """Masks of the three roles: what depends on the town once, what depends on the moment each time.

    Fields are masked one by one, so an action that passes may still be refused for the way its fields combine. Boxes,
    texts and multi-binary fields take no mask (None).
    """

    def __init__(self, world: World, task: TaskState, limits: SpaceLimits) -> None:
        self._world, self._task, self._limits = world, task, limits
        town = world.town
        longest = max(lane.length for lane in town.lanes)
        self._fixed = {
            role: {name: _everything(space) for name, space in action_space(role, limits).spaces.items()}
            for role in (Role.PARTICIPANT, Role.CO_WIZARD, Role.AD_WIZARD)
        }
        for role in (Role.CO_WIZARD, Role.AD_WIZARD):
            fields = self._fixed[role]
            fields["lane"][len(town.lanes) :] = 0
            fields["metres"][int(longest) + 1 :] = 0
        plan = np.zeros(limits.junctions + 1, dtype=np.int8)
        plan[: len(town.junctions) + 1] = 1
        self._fixed[Role.CO_WIZARD]["plan"] = tuple(plan for _ in range(limits.plan))

    def mask(self, role: Role) -> dict[str, Any]:
        """The mask of a role's action space now."""
        fields = deepcopy(self._fixed[role])  # what an environment returned is its user's to change
        if role is Role.CO_WIZARD:
            fields["physical"], fields["angle"] = self._physical()
        elif role is Role.AD_WIZARD:
            fields["exception"] = self._exception()
        return fields

    def _physical(self) -> tuple[Mask, Mask]:
        world, planner = self._world, self._world.planner
        lane = planner.lane
        speed = float(world.car.speed)
        left, right = planner.may_switch(LinkType.LANE_CHANGE_LEFT), planner.may_switch(LinkType.LANE_CHANGE_RIGHT)
        committed = planner.is_committed(speed)
        exits = () if committed else planner.exits()[0]
        busy = planner.in_manoeuvre or world.town.lanes[lane].in_junction
        legal = {
            PhysicalAction.LANE_FOLLOW: not busy
            and not committed
            and (planner.held or planner.manoeuvre[0] is not None),
            PhysicalAction.LANE_SWITCH: left or right,
            PhysicalAction.U_TURN: not busy and planner.may_turn_round(speed),
            PhysicalAction.J_TURN: bool(exits),
            PhysicalAction.STOP: not planner.held,
            PhysicalAction.START: planner.held,
            PhysicalAction.SPEED_CHANGE: MIN_CRUISE + SPEED_STEP <= world.driver.cruise
            or world.driver.cruise <= MAX_CRUISE - SPEED_STEP,
            PhysicalAction.LIGHT_CHANGE: True,
        }
        physical = np.ones(len(PhysicalAction) + 1, dtype=np.int8)
        for action, possible in legal.items():
            physical[int(action)] = possible
        angle = np.zeros(360, dtype=np.int8)
        angle[180] = 1
        for way in exits:
            angle[way.angle + 180] = planner.held or way.angle != planner.turn_ahead
        for side, possible in ((90, left), (-90, right)):
            angle[side + 180] |= possible
        return physical, angle

    def _exception(self) -> Mask:
        task, props = self._task, self._world.actors.props
        mask = np.zeros(len(ExceptionKind), dtype=np.int8)
        mask[[int(kind) for kind in EVERY_TIME]] = 1
        mask[ExceptionKind.PLACE_PROP] = len(props) < self._limits.props
        mask[ExceptionKind.MOVE_PROP] = mask[ExceptionKind.DELETE_PROP] = bool(props)
        mask[ExceptionKind.TASK_TRIGGER] = bool(task.possible_triggers())
        mask[ExceptionKind.TASK_DELETE] = bool(task.possible_deletions())
        mask[ExceptionKind.TASK_CHANGE] = bool(task.possible_changes())
        return mask


def _everything(space: spaces.Space[Any]) -> Any:
    if isinstance(space, spaces.Discrete):
        return np.ones(int(space.n), dtype=np.int8)
    if isinstance(space, spaces.MultiDiscrete):
        return tuple(np.ones(int(n), dtype=np.int8) for n in space.nvec)
    return None
