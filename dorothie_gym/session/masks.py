"""Action masks of the three roles, in the form that `Dict.sample(mask=...)` takes."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import ClassVar, TypeAlias

from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.ontology.world_exceptions import ExceptionKind
from dorothie_gym.session.session_views import SessionViews
from dorothie_gym.session.view_arrays import Mask
from dorothie_gym.support.copying import CachedViews
from dorothie_gym.tasks.state import TaskState

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


class ActionMasks(CachedViews):
    """Action masks of a session.

    Fields are masked independently, so an action inside the mask may still be refused for a combination of its fields.
    Box, text and multi-binary fields have no mask (None). Compiled code writes the masks of physical actions
    (`view_steps`); those of exceptions are written when the props or the task have changed, the others once.
    """

    CACHED_VIEWS: ClassVar[Sequence[str]] = ("_exceptions",)

    def __init__(self, views: SessionViews, task: TaskState) -> None:
        """Writes the constant masks of the session.

        Args:
            views: the row of the session.
            task: progress in the storyboard.
        """
        self._views, self._task = views, task
        town = views.world.town
        longest = max(lane.length for lane in town.lanes)
        for role in AGENT_ROLES:
            masks = {name: array[views.row] for name, array in views.arrays.masks[role].arrays.items()}
            for mask in masks.values():
                mask[...] = 1
            if "lane" in masks:
                masks["lane"][len(town.lanes) :] = 0
                masks["metres"][int(longest) + 1 :] = 0
            if "plan" in masks:
                masks["plan"][:, len(town.junctions) + 1 :] = 0
        self._exceptions[:] = 0
        self._exceptions[[int(kind) for kind in ALWAYS_FEASIBLE]] = 1
        self._task_state = (-1, -1)

    @cached_property
    def _exceptions(self) -> Mask:
        mask: Mask = self._views.arrays.masks[Role.AD_WIZARD].arrays["exception"][self._views.row]
        return mask

    def mask(self, role: Role) -> RoleMask:
        """Returns the mask of a role's action space at the present decision; the caller owns it."""
        if role is Role.CO_WIZARD:
            self._views.find_feasible()
        elif role is Role.AD_WIZARD:
            self.write()
        arrays = self._views.arrays.masks[role].copy_row(self._views.row)
        fields: RoleMask = {**arrays, **dict.fromkeys(self._views.arrays.unmasked[role])}
        if role is Role.CO_WIZARD:
            fields["plan"] = tuple(arrays["plan"])
        return fields

    def write(self) -> None:
        """Writes the mask of exceptions if props or task have changed."""
        task, actors = self._task, self._views.world.actors
        props = len(actors.props) if actors.has_props else 0
        if (task.version, props) == self._task_state:
            return
        self._task_state = task.version, props
        mask = self._exceptions
        mask[ExceptionKind.PLACE_PROP] = props < self._views.most_props
        mask[ExceptionKind.MOVE_PROP] = mask[ExceptionKind.DELETE_PROP] = props > 0
        mask[ExceptionKind.TASK_TRIGGER] = bool(task.possible_triggers())
        mask[ExceptionKind.TASK_DELETE] = bool(task.possible_deletions())
        mask[ExceptionKind.TASK_CHANGE] = bool(task.possible_changes())
