"""Instructor of the navigation environments: dialogue acts that guide the car, without words."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.compilation.records import fields, plain
from dorothie_gym.maps import Town
from dorothie_gym.maps.routing import Place, router
from dorothie_gym.maps.routing_graph import routing_graph
from dorothie_gym.ontology import ActionValue, DialogueAct, DialogueMove, LandmarkName, ObjectClass, StreetName
from dorothie_gym.policies.navigation.cost_to_go import CostToGo
from dorothie_gym.policies.navigation.guidance_steps import instruct
from dorothie_gym.policies.navigation.instructor_arrays import InstructorArrays, instructor_arrays
from dorothie_gym.policies.navigation.junction_exits import JunctionExits
from dorothie_gym.policies.observation_parser import SeenLandmark, read_landmarks, read_subgoals, scalar
from dorothie_gym.policies.route_tables import route_tables
from dorothie_gym.spaces import ObjectColumn, Observation
from dorothie_gym.tasks import map_label


class Guidance(enum.StrEnum):
    """Level at which the participant guides."""

    TURNS = "turns"
    """Turn by turn, before each junction; at the end, the distance to the place where the car is to stop."""

    GOALS = "goals"
    """By the name of the next goal; turn by turn only to places that are not on the Co-Wizard's map."""


@dataclass(frozen=True, kw_only=True)
class NavigationInstruction:
    """Instruction given to a driver.

    Attributes:
        act: move and slots: the action, and the street or landmark where one is named.
        sector: direction, as an index of `junction_exits.SECTORS`; None where the act has no direction.
        distance: distance to the place where it is to be carried out, as said [m].
        time: time at which it was given [s].
    """

    act: DialogueAct
    sector: int | None = None
    distance: float = 0.0
    time: float = 0.0

    @property
    def action(self) -> ActionValue | None:
        """Action asked for."""
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
        distance: distance to where it is to be carried out [m].
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


class Instructor:
    """Participant that guides the car to one subgoal after another: a face of `guidance_steps.instruct`.

    Attributes:
        goal: landmark of the present subgoal, or None when all are done.
        blocked: places behind the roadblocks seen.
        cost_to_go: cost of the route to it from anywhere; progress is measured by it.
        instruction: last instruction given.
    """

    def __init__(self, town: Town, guidance: Guidance) -> None:
        self._town, self._guidance = town, guidance
        self.goal: SeenLandmark | None = None
        self.blocked: tuple[Place, ...] = ()
        self.cost_to_go = CostToGo(town)
        self.instruction: NavigationInstruction | None = None
        self._arrays: InstructorArrays | None = None
        self._marks: dict[int, SeenLandmark] = {}
        self._subgoals = b""

    def instruct(
        self, observation: Observation, known: frozenset[Place], *, waits: bool, turning: float
    ) -> NavigationInstruction | None:
        """Gives an instruction if one is due.

        Args:
            observation: observation of the participant.
            known: places of the landmarks on the Co-Wizard's map.
            waits: whether the car was instructed to stop, and stands.
            turning: remaining length of the lane switch or U-turn under way [m]; 0 where there is none.

        Returns:
            The instruction, or None.
        """
        town, arrays = self._town, self._arrays
        if arrays is None:
            arrays = self._arrays = self._begin(observation, known)
        self._read(observation, arrays, waits, turning)
        search = router(town).search
        given = instruct(route_tables(town), routing_graph(town), search, exit_sectors(town), arrays)
        _, row, closed = fields(arrays.route, "subgoal", "landmark", "closed").item()
        self.goal = self._marks.get(row)
        if closed != len(self.blocked):
            self.blocked = tuple((lane, station) for station, lane in plain(arrays.closed)[:closed].tolist())
        self.cost_to_go.aim(self.goal.place if self.goal is not None else None, self.blocked)
        if not given:
            return None
        self.instruction = _instruction_of(arrays)
        return self.instruction

    def _begin(self, observation: Observation, known: frozenset[Place]) -> InstructorArrays:
        """Returns the arrays of the session: the landmarks, and the names of the streets."""
        names = np.asarray(observation["street_names"], dtype=np.int32)
        arrays = instructor_arrays(
            lanes=len(self._town.lanes), subgoals=len(observation["subgoals"]),
            landmarks=len(observation["landmarks"]), streets=len(names), things=len(observation["objects"]),
        )  # fmt: skip
        arrays.names[:] = names
        self._marks = {mark.row: mark for mark in read_landmarks(observation, self._town)}
        marks = plain(arrays.marks)
        for row, mark in self._marks.items():
            marks[row] = mark.station, mark.lane, mark.name.value, mark.place in known
        return arrays

    def _read(self, observation: Observation, arrays: InstructorArrays, waits: bool, turning: float) -> None:
        """Writes what is seen at this decision."""
        table = observation["subgoals"].tobytes()
        if table != self._subgoals:  # as at few decisions
            self._subgoals = table
            rows = plain(arrays.subgoals)
            for subgoal in read_subgoals(observation):
                rows[subgoal.index] = subgoal.landmark, subgoal.open, subgoal.allowed
        objects = observation["objects"]
        static = objects[objects[:, ObjectColumn.KIND] == ObjectClass.STATIC.value].tolist()
        if static:
            things = plain(arrays.things)
            for row, thing in enumerate(static):
                things[row] = thing[ObjectColumn.X], thing[ObjectColumn.Y], thing[ObjectColumn.DISTANCE]
        fields(arrays.now, *_VIEW)[()] = (
            scalar(observation, "station"), scalar(observation, "speed"), scalar(observation, "time"), turning,
            int(observation["lane"]), len(static), waits, self._guidance is Guidance.GOALS,
        )  # fmt: skip


_VIEW = ("station", "speed", "time", "turning", "lane", "things", "waits", "by_name")


def _instruction_of(arrays: InstructorArrays) -> NavigationInstruction:
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
