"""Action masks of the three roles, in the form that `Dict.sample(mask=...)` takes."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from dorothie_gym.engine.path_measurements import UpcomingJunction
from dorothie_gym.ontology import ExceptionKind, PhysicalAction, Role
from dorothie_gym.sim.ego.feasibility import may_change_cruise
from dorothie_gym.sim.world import World
from dorothie_gym.spaces import AnySpace, SpaceLimits, action_space
from dorothie_gym.spaces.fields import FieldBuffer, Shape
from dorothie_gym.tasks import TaskState

Mask: TypeAlias = NDArray[np.int8]
"""Mask of one field: 1 for values that would be accepted."""

RoleMask: TypeAlias = dict[str, Mask | tuple[Mask, ...] | None]
"""Mask of a role's action space, by field; None for fields without a mask."""

ALWAYS_FEASIBLE = (
    ExceptionKind.NONE,
    ExceptionKind.WEATHER,
    ExceptionKind.SPAWN_VEHICLES,
    ExceptionKind.SPAWN_PEDESTRIANS,
    ExceptionKind.SENSOR_FAULT,
    ExceptionKind.MESSAGE,
)
"""Exceptions that are feasible at any time for some arguments."""


class ActionMasks:
    """Action masks of a session.

    Fields are masked independently, so an action inside the mask may still be refused for a combination of its fields.
    Box, text and multi-binary fields have no mask (None). Templates of the masks are updated when the ego, the props or
    the task have changed.
    """

    def __init__(self, world: World, task: TaskState, limits: SpaceLimits, junction: UpcomingJunction) -> None:
        self._world, self._task, self._limits = world, task, limits
        self._junction = junction
        self._unmasked: dict[Role, dict[str, None]] = {}
        self._buffers: dict[Role, FieldBuffer] = {}
        town = world.town
        longest = max(lane.length for lane in town.lanes)
        for role in (Role.PARTICIPANT, Role.CO_WIZARD, Role.AD_WIZARD):
            fields = {name: _shape(space) for name, space in action_space(role, limits).spaces.items()}
            self._unmasked[role] = {name: None for name, shape in fields.items() if shape is None}
            buffer = FieldBuffer({name: (np.int8, shape) for name, shape in fields.items() if shape is not None})
            for array in buffer.template.values():
                array[...] = 1
            if "lane" in buffer.template:
                buffer.template["lane"][len(town.lanes) :] = 0
                buffer.template["metres"][int(longest) + 1 :] = 0
            if "plan" in buffer.template:
                buffer.template["plan"][:, len(town.junctions) + 1 :] = 0
            self._buffers[role] = buffer
        self._buffers[Role.AD_WIZARD].template["exception"][:] = 0
        self._buffers[Role.AD_WIZARD].template["exception"][[int(kind) for kind in ALWAYS_FEASIBLE]] = 1
        self._state: tuple[object, ...] = ()  # state of the ego that the template belongs to
        self._task_state = (-1, -1)

    def mask(self, role: Role) -> RoleMask:
        """Returns the mask of a role's action space at the present decision; the caller owns it."""
        if role is Role.CO_WIZARD:
            self._update_physical()
        elif role is Role.AD_WIZARD:
            self._update_exceptions()
        arrays = self._buffers[role].copy()
        fields: RoleMask = {**arrays, **self._unmasked[role]}
        if role is Role.CO_WIZARD:
            fields["plan"] = tuple(arrays["plan"])
        return fields

    def _update_physical(self) -> None:
        """Updates the masks of physical actions and their angles if the state of the ego has changed."""
        planner, speed, cruise = self._world.planner, float(self._world.car.speed), self._world.ego.cruise
        state = *planner.state, speed, cruise
        if state == self._state:
            return
        self._state = state
        template = self._buffers[Role.CO_WIZARD].template
        physical, angle = template["physical"], template["angle"]
        feasible = planner.feasible(speed)
        exits = self._junction.options().exits if feasible.j_turn else ()
        physical[PhysicalAction.LANE_FOLLOW] = feasible.lane_follow
        physical[PhysicalAction.LANE_SWITCH] = feasible.switch_left or feasible.switch_right
        physical[PhysicalAction.U_TURN] = feasible.u_turn
        physical[PhysicalAction.J_TURN] = bool(exits)
        physical[PhysicalAction.STOP] = not planner.held
        physical[PhysicalAction.START] = planner.held
        physical[PhysicalAction.SPEED_CHANGE] = may_change_cruise(cruise, True) or may_change_cruise(cruise, False)
        planned = None if planner.held else planner.turn_ahead
        angle[:] = 0
        angle[180] = 1
        for way in exits:
            angle[way.angle + 180] = way.angle != planned
        for side, possible in ((90, feasible.switch_left), (-90, feasible.switch_right)):
            angle[side + 180] |= possible

    def _update_exceptions(self) -> None:
        """Updates the mask of exceptions if props or task have changed."""
        task, props = self._task, len(self._world.actors.props)
        if (task.version, props) == self._task_state:
            return
        self._task_state = task.version, props
        form = self._buffers[Role.AD_WIZARD].template["exception"]
        form[ExceptionKind.PLACE_PROP] = props < self._limits.props
        form[ExceptionKind.MOVE_PROP] = form[ExceptionKind.DELETE_PROP] = props > 0
        form[ExceptionKind.TASK_TRIGGER] = bool(task.possible_triggers())
        form[ExceptionKind.TASK_DELETE] = bool(task.possible_deletions())
        form[ExceptionKind.TASK_CHANGE] = bool(task.possible_changes())


def _shape(space: AnySpace) -> Shape | None:
    """Returns the shape of a field's mask; all entries of a multi-discrete field have the same number of choices."""
    if isinstance(space, spaces.Discrete):
        return (int(space.n),)
    if isinstance(space, spaces.MultiDiscrete):
        return len(space.nvec), int(space.nvec[0])
    return None
