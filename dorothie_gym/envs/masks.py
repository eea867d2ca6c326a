"""Which actions would not be refused: masks in the form that `Dict.sample(mask=...)` takes."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from dorothie_gym.envs.prospect import Prospect
from dorothie_gym.envs.sheets import Shape, Sheet
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

    def __init__(self, world: World, task: TaskState, limits: SpaceLimits, prospect: Prospect | None = None) -> None:
        self._world, self._task, self._limits = world, task, limits
        self._prospect = prospect or Prospect(world)
        self._unmasked: dict[Role, dict[str, None]] = {}
        self._sheets: dict[Role, Sheet] = {}
        town = world.town
        longest = max(lane.length for lane in town.lanes)
        for role in (Role.PARTICIPANT, Role.CO_WIZARD, Role.AD_WIZARD):
            fields = {name: _shape(space) for name, space in action_space(role, limits).spaces.items()}
            self._unmasked[role] = {name: None for name, shape in fields.items() if shape is None}
            sheet = Sheet({name: (np.int8, shape) for name, shape in fields.items() if shape is not None})
            for array in sheet.form.values():
                array[...] = 1
            if "lane" in sheet.form:
                sheet.form["lane"][len(town.lanes) :] = 0
                sheet.form["metres"][int(longest) + 1 :] = 0
            if "plan" in sheet.form:
                sheet.form["plan"][:, len(town.junctions) + 1 :] = 0
            self._sheets[role] = sheet
        angle = self._sheets[Role.CO_WIZARD].form["angle"]
        angle[:] = 0
        angle[180] = 1
        self._sheets[Role.AD_WIZARD].form["exception"][:] = 0
        self._sheets[Role.AD_WIZARD].form["exception"][[int(kind) for kind in EVERY_TIME]] = 1
        self._version = -1

    def mask(self, role: Role) -> dict[str, Any]:
        """The mask of a role's action space now; it is its taker's to change."""
        if role is Role.AD_WIZARD:
            self._note_task()
        fields: dict[str, Any] = {**self._sheets[role].copy(), **self._unmasked[role]}
        if role is Role.CO_WIZARD:
            self._write_physical(fields["physical"], fields["angle"])
            fields["plan"] = tuple(fields["plan"])
        elif role is Role.AD_WIZARD:
            self._write_props(fields["exception"])
        return fields

    def _write_physical(self, physical: Mask, angle: Mask) -> None:
        """What the car may be told to do (`physical`), and with which angles."""
        world, planner = self._world, self._world.planner
        speed = float(world.car.speed)
        left, right = planner.may_switch(LinkType.LANE_CHANGE_LEFT), planner.may_switch(LinkType.LANE_CHANGE_RIGHT)
        committed = planner.is_committed(speed)
        exits = () if committed else self._prospect.options.exits
        busy = planner.in_manoeuvre or world.town.lanes[planner.lane].in_junction
        held, cruise = planner.held, world.driver.cruise
        physical[PhysicalAction.LANE_FOLLOW] = (
            not busy and not committed and (held or planner.manoeuvre[0] is not None)
        )
        physical[PhysicalAction.LANE_SWITCH] = left or right
        physical[PhysicalAction.U_TURN] = not busy and planner.may_turn_round(speed)
        physical[PhysicalAction.J_TURN] = bool(exits)
        physical[PhysicalAction.STOP] = not held
        physical[PhysicalAction.START] = held
        physical[PhysicalAction.SPEED_CHANGE] = MIN_CRUISE + SPEED_STEP <= cruise or cruise <= MAX_CRUISE - SPEED_STEP
        planned = None if held else planner.turn_ahead
        for way in exits:
            angle[way.angle + 180] = way.angle != planned
        if left:
            angle[90 + 180] = 1
        if right:
            angle[-90 + 180] = 1

    def _note_task(self) -> None:
        """What may be done with the task, when that has changed."""
        task = self._task
        if task.version == self._version:
            return
        self._version = task.version
        form = self._sheets[Role.AD_WIZARD].form["exception"]
        form[ExceptionKind.TASK_TRIGGER] = bool(task.possible_triggers())
        form[ExceptionKind.TASK_DELETE] = bool(task.possible_deletions())
        form[ExceptionKind.TASK_CHANGE] = bool(task.possible_changes())

    def _write_props(self, exception: Mask) -> None:
        count = len(self._world.actors.props)
        exception[ExceptionKind.PLACE_PROP] = count < self._limits.props
        exception[ExceptionKind.MOVE_PROP] = exception[ExceptionKind.DELETE_PROP] = count > 0


def _shape(space: spaces.Space[Any]) -> Shape | None:
    """Shape of the mask of a field, if it takes one; the choices of a multi-discrete one are all as many."""
    if isinstance(space, spaces.Discrete):
        return (int(space.n),)
    if isinstance(space, spaces.MultiDiscrete):
        return len(space.nvec), int(space.nvec[0])
    return None
