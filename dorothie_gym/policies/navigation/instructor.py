"""Instructor of the navigation environments: dialogue acts that guide the car, without words."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.ontology.slots import ActionValue, LandmarkName, StreetName
from dorothie_gym.policies.navigation.junction_exits import JunctionExits
from dorothie_gym.support.compilation.records import fields
from dorothie_gym.tasks.catalogue import map_label

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.policies.navigation.instructor_arrays import InstructorArrays

    pass


class Guidance(enum.StrEnum):
    """Level at which the participant guides."""

    TURNS = "turns"
    """Turn by turn, before each junction; at the end, the distance to the stopping place."""

    GOALS = "goals"
    """By the name of the next goal; turn by turn only to places that are not on the Co-Wizard's map."""


@dataclass(frozen=True, kw_only=True)
class NavigationInstruction:
    """Instruction given to a driver.

    Attributes:
        act: move and slots: the action, and the street or landmark where one is named.
        sector: direction, as an index of `junction_exits.SECTORS`; None where the act has no direction.
        distance: stated distance to the place of the action [m].
        time: time at which it was given [s].
    """

    act: DialogueAct
    sector: int | None = None
    distance: float = 0.0
    time: float = 0.0

    @property
    def action(self) -> ActionValue | None:
        """Requested action."""
        return next((value for value in self.act.slots if isinstance(value, ActionValue)), None)

    @property
    def landmark(self) -> LandmarkName | None:
        """Landmark named."""
        return next((value for value in self.act.slots if isinstance(value, LandmarkName)), None)

    @property
    def street(self) -> StreetName | None:
        """Street named."""
        return next((value for value in self.act.slots if isinstance(value, StreetName)), None)


class GuidanceStep(NamedTuple):
    """Step of the guidance before it is said.

    Attributes:
        key: identity of the step; two steps with the same key are the same instruction, repeated.
        values: slot values.
        sector: direction as an index of `junction_exits.SECTORS`, or None.
        distance: distance to the place of the action [m].
    """

    key: tuple[object, ...]
    values: tuple[ActionValue | StreetName | LandmarkName, ...]
    sector: int | None = None
    distance: float = 0.0


@lru_cache(maxsize=16)
def exit_sectors(town: Town) -> NDArray[np.int32]:
    """Returns the sector of each exit of `route_tables`, or -1 (exits,)."""
    exits = JunctionExits(town)
    found = [exits.sector_of(lane.id, way.connector) for lane in town.lanes for way in town.exits(lane.id)]
    return np.array([-1 if sector is None else sector for sector in found] or [-1], dtype=np.int32)


def instruction_of(arrays: InstructorArrays) -> NavigationInstruction:
    """Returns the last instruction as a value."""
    distance, time, action, street, landmark, sector = fields(
        arrays.said, "distance", "time", "action", "street", "landmark", "sector"
    ).item()
    values: list[ActionValue | StreetName | LandmarkName] = []
    if action >= 0:
        values.append(ActionValue(action))
    if street >= 0:
        values.append(StreetName(street))
    if landmark >= 0:
        values.append(LandmarkName(landmark))
    act = DialogueAct.of(DialogueMove.INSTRUCT, *values)
    return NavigationInstruction(act=act, sector=None if sector < 0 else sector, distance=distance, time=time)


_DIRECTIONS = ("back", "sharp right", "right", "half right", "straight on", "half left", "left", "sharp left")
_VERBS = {
    ActionValue.J_TURN: "Turn",
    ActionValue.LANE_SWITCH: "Switch lanes",
    ActionValue.U_TURN: "Make a U-turn",
    ActionValue.STOP: "Stop",
    ActionValue.START: "Drive on",
}


def words_of(instruction: NavigationInstruction) -> str:
    """Returns an instruction in words for pictures, such as "Turn left in 60 m, into Baits"."""
    action, street, landmark = instruction.action, instruction.street, instruction.landmark
    if action is None:
        return f"Drive to {map_label(landmark)}" if landmark is not None else str(instruction.act)
    words = _VERBS.get(action, action.label)
    if instruction.sector is not None:
        straight = action is ActionValue.J_TURN and _DIRECTIONS[instruction.sector] == "straight on"
        words = "Go straight on" if straight else f"{words} {_DIRECTIONS[instruction.sector]}"
    if instruction.distance >= 1.0:
        words += f" in {instruction.distance:.0f} m"
    if landmark is not None:
        words += f", at {map_label(landmark)}"
    return words if street is None else f"{words}, into {street.label}"
