"""Physical and mental actions of the Co-Wizard; ids as in SDN."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from types import MappingProxyType

from dorothie_gym.errors import OntologyError
from dorothie_gym.ontology.labelled_enums import LabelledInt
from dorothie_gym.ontology.slots import ActionValue

LANE_SWITCH_LEFT = 90.0
"""Angle argument of a lane switch to the left [degrees, positive left]."""

LANE_SWITCH_RIGHT = -90.0
"""Angle argument of a lane switch to the right [degrees, positive left]."""

U_TURN_ANGLE = -180.0
"""Angle that action histories record for a U-turn [degrees]; the action itself takes no argument."""

SPEED_STEP = 5.0
"""Change of cruise speed by one SpeedChange, up or down [km/h]."""


class ActionGroup(StrEnum):
    """Purpose of a physical action (paper, appendix A.2)."""

    NAVIGATION = "navigation"
    ADAPTIVE = "adaptive"
    EPISTEMIC = "epistemic"


class ArgumentKind(StrEnum):
    """Kind of argument of a physical action."""

    NONE = "none"
    SIDE = "side"
    ANGLE = "angle"
    SPEED_STEP = "speed_step"
    SWITCH = "switch"

    @property
    def domain(self) -> str:
        """Description of the accepted arguments for error messages."""
        return _DOMAINS[self]

    def accepts(self, argument: float | None) -> bool:
        """Returns whether `argument` is valid for this kind; a switch takes True (on) and False (off)."""
        if argument is None or self is ArgumentKind.NONE:
            return argument is None and self is ArgumentKind.NONE
        if self is ArgumentKind.ANGLE:
            return -180.0 <= argument < 180.0
        return argument in _CHOICES[self]


class PhysicalAction(LabelledInt):
    """Physical action of the car, chosen by the Co-Wizard."""

    LANE_FOLLOW = 1, "LaneFollow"
    LANE_SWITCH = 2, "LaneSwitch"
    U_TURN = 3, "UTurn"
    J_TURN = 4, "JTurn"
    STOP = 5, "Stop"
    START = 6, "Start"
    SPEED_CHANGE = 7, "SpeedChange"
    LIGHT_CHANGE = 8, "LightChange"

    @property
    def group(self) -> ActionGroup:
        """Purpose of the action."""
        return _GROUPS.get(self, ActionGroup.NAVIGATION)

    @property
    def argument(self) -> ArgumentKind:
        """Kind of argument that the action takes."""
        return _ARGUMENTS.get(self, ArgumentKind.NONE)

    @property
    def slot_value(self) -> ActionValue:
        """Value of `Slot.ACTION` that names the action."""
        return ActionValue(self.value)

    @property
    def nfd_class(self) -> int:
        """Class of the action in the Navigation from Dialogue task, 0 to 5.

        Raises:
            OntologyError: if the action is not a navigation action.
        """
        if self not in NAVIGATION_ACTIONS:
            raise OntologyError(f"physical action: {self.label} is {self.group}, only navigation actions are in NfD")
        return self.value - 1

    @classmethod
    def from_nfd_class(cls, index: int) -> PhysicalAction:
        """Returns the navigation action of class `index`; the inverse of `nfd_class`.

        Raises:
            OntologyError: if `index` is not in 0 to 5.
        """
        if not 0 <= index < len(NAVIGATION_ACTIONS):
            raise OntologyError(f"NfD class: {index!r} is out of range, expected 0 to {len(NAVIGATION_ACTIONS) - 1}")
        return NAVIGATION_ACTIONS[index]

    def check_argument(self, argument: float | None) -> None:
        """Checks the argument of the action.

        Raises:
            OntologyError: if the action does not take `argument`; the message lists the accepted values.
        """
        if not self.argument.accepts(argument):
            raise OntologyError(f"argument of {self.label}: {argument!r} is not {self.argument.domain}")


class MentalAction(LabelledInt):
    """Update of the Co-Wizard's beliefs."""

    PLAN_UPDATE = 1, "PlanUpdate"
    GOAL_UPDATE = 2, "GoalUpdate"
    STATUS_UPDATE = 3, "StatusUpdate"
    KNOWLEDGE_UPDATE = 4, "KnowledgeUpdate"
    OTHER = 5, "Other"

    @property
    def arguments(self) -> tuple[str, ...]:
        """Names of the arguments: junction ids, landmark names, a status, or an estimated position (x, y) [m]."""
        return _MENTAL_ARGUMENTS[self]


_GROUPS: Mapping[PhysicalAction, ActionGroup] = MappingProxyType(
    {
        PhysicalAction.SPEED_CHANGE: ActionGroup.ADAPTIVE,
        PhysicalAction.LIGHT_CHANGE: ActionGroup.EPISTEMIC,
    }
)

_ARGUMENTS: Mapping[PhysicalAction, ArgumentKind] = MappingProxyType(
    {
        PhysicalAction.LANE_SWITCH: ArgumentKind.SIDE,
        PhysicalAction.J_TURN: ArgumentKind.ANGLE,
        PhysicalAction.SPEED_CHANGE: ArgumentKind.SPEED_STEP,
        PhysicalAction.LIGHT_CHANGE: ArgumentKind.SWITCH,
    }
)

_CHOICES: Mapping[ArgumentKind, tuple[float, ...]] = MappingProxyType(
    {
        ArgumentKind.SIDE: (LANE_SWITCH_LEFT, LANE_SWITCH_RIGHT),
        ArgumentKind.SPEED_STEP: (SPEED_STEP, -SPEED_STEP),
        ArgumentKind.SWITCH: (True, False),
    }
)

_DOMAINS: Mapping[ArgumentKind, str] = MappingProxyType(
    {
        ArgumentKind.NONE: "None (the action takes no argument)",
        ArgumentKind.SIDE: f"{LANE_SWITCH_LEFT:+g} (left) or {LANE_SWITCH_RIGHT:+g} (right) degrees",
        ArgumentKind.ANGLE: "an angle in [-180, 180) degrees, positive to the left",
        ArgumentKind.SPEED_STEP: f"{SPEED_STEP:+g} or {-SPEED_STEP:+g} km/h",
        ArgumentKind.SWITCH: "True (on) or False (off)",
    }
)

_MENTAL_ARGUMENTS: Mapping[MentalAction, tuple[str, ...]] = MappingProxyType(
    {
        MentalAction.PLAN_UPDATE: ("junctions",),
        MentalAction.GOAL_UPDATE: ("landmarks",),
        MentalAction.STATUS_UPDATE: ("landmark", "status"),
        MentalAction.KNOWLEDGE_UPDATE: ("x", "y"),
        MentalAction.OTHER: (),
    }
)

NAVIGATION_ACTIONS: tuple[PhysicalAction, ...] = tuple(
    action for action in PhysicalAction if action.group is ActionGroup.NAVIGATION
)
"""Actions that choose the path of the car: ids 1 to 6, the classes of NfD."""

ADAPTIVE_ACTIONS: tuple[PhysicalAction, ...] = tuple(
    action for action in PhysicalAction if action.group is ActionGroup.ADAPTIVE
)
"""Actions that change the speed of the car."""

EPISTEMIC_ACTIONS: tuple[PhysicalAction, ...] = tuple(
    action for action in PhysicalAction if action.group is ActionGroup.EPISTEMIC
)
"""Actions that improve perception (lights)."""
