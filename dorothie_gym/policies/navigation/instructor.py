"""Instructor of the navigation environments: dialogue acts that guide the car, without words."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import NamedTuple

from dorothie_gym.maps import Town
from dorothie_gym.maps.routing import LaneEntry, Place
from dorothie_gym.ontology import ActionValue, DialogueAct, DialogueMove, LandmarkName, ObjectClass, StreetName
from dorothie_gym.policies.feasibility import slowing_distance
from dorothie_gym.policies.guidance_config import GuidanceConfig
from dorothie_gym.policies.navigation.cost_to_go import CostToGo
from dorothie_gym.policies.navigation.junction_exits import JunctionExits, nearest_sector
from dorothie_gym.policies.observation_parser import (
    SeenLandmark,
    SeenSubgoal,
    place_on_lanes,
    read_landmarks,
    read_objects,
    read_subgoals,
    scalar,
    street_of,
)
from dorothie_gym.policies.route_progress import RouteJunction, RouteProgress, RouteState
from dorothie_gym.sim.ego.limits import U_TURN_SPEED
from dorothie_gym.spaces import ObjectColumn, Observation
from dorothie_gym.tasks import map_label


@dataclass(frozen=True, kw_only=True)
class InstructorConfig(GuidanceConfig):
    """Tunable numbers of the instructor, in addition to those of all guidance.

    Attributes:
        switch_distance: distance at which a lane switch is announced [m].
        reaction_time: time from an instruction to its effect [s].
        u_turn_speed_squared: square of the speed of a U-turn [m^2/s^2]; the local planner's.
    """

    switch_distance: float = 80.0
    reaction_time: float = 1.5
    u_turn_speed_squared: float = U_TURN_SPEED**2


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


class Instructor:
    """Participant that guides the car to one subgoal after another.

    Attributes:
        goal: landmark of the present subgoal, or None when all are done.
        route: route to it, and the roadblocks seen.
        cost_to_go: cost of the route to it from anywhere; progress is measured by it.
        instruction: last instruction given.
    """

    def __init__(self, town: Town, exits: JunctionExits, guidance: Guidance) -> None:
        self._town, self._exits, self._guidance, self._config = town, exits, guidance, InstructorConfig()
        self.goal: SeenLandmark | None = None
        self.route = RouteState()
        self.cost_to_go = CostToGo(town)
        self.instruction: NavigationInstruction | None = None
        self._target: SeenSubgoal | None = None
        self._key: tuple[object, ...] = ()
        self._subgoals = b""

    @property
    def blocked(self) -> tuple[Place, ...]:
        """Places behind the roadblocks seen."""
        return self.route.blocked

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
        place = int(observation["lane"]), scalar(observation, "station")
        self._choose_target(observation, place)
        if self.route.progress is None or self.goal is None:
            return None
        self._note_roadblocks(observation, place)
        if not turning:
            self._follow(place)
        if self._guidance is Guidance.GOALS and self.goal.place in known:
            step: GuidanceStep | None = GuidanceStep(("goal", self.goal.row), (self.goal.name,))
        elif turning:
            step = self._stop_after_manoeuvre(place, turning, waits=waits)
        else:
            step = self._next_step(observation, place, waits=waits)
        if step is None:
            return None
        now, last = scalar(observation, "time"), self.instruction
        if step.key == self._key and last is not None and now - last.time < self._config.repeat_after:
            return None
        self._key = step.key
        act = DialogueAct.of(DialogueMove.INSTRUCT, *step.values)
        self.instruction = NavigationInstruction(act=act, sector=step.sector, distance=step.distance, time=now)
        return self.instruction

    # --- destination ------------------------------------------------------------------------------------------------

    def _choose_target(self, observation: Observation, place: Place) -> None:
        """Keeps the present subgoal while it is open; otherwise chooses the closest one that may be reached now."""
        table = observation["subgoals"].tobytes()
        if table == self._subgoals:
            return  # unchanged, as at most decisions
        self._subgoals = table
        landmarks = {mark.row: mark for mark in read_landmarks(observation, self._town)}
        subgoals = read_subgoals(observation)
        if self._target is not None:
            now = subgoals[self._target.index]
            if now.open and now.allowed and now.landmark == self._target.landmark:
                return
        self._target, self.goal, self._key = None, None, ()
        best, progress = math.inf, None
        for subgoal in subgoals:
            mark = landmarks.get(subgoal.landmark)
            if not (subgoal.open and subgoal.allowed) or mark is None:
                continue
            planned = RouteProgress.plan(self._town, place, mark.place, self.blocked)
            cost = planned.route.cost if planned.route is not None else math.inf
            if self._target is None or cost < best:
                best, self._target, self.goal, progress = cost, subgoal, mark, planned
        self.route = self.route.with_progress(progress)
        self.cost_to_go.aim(self.goal.place if self.goal is not None else None, self.blocked)

    def _note_roadblocks(self, observation: Observation, place: Place) -> None:
        """Adds the roadblocks that have come into sight, and plans around them."""
        assert self.route.progress is not None and self.goal is not None
        if not (observation["objects"][:, ObjectColumn.KIND] == ObjectClass.STATIC.value).any():
            return
        lanes = [leg.lane for leg in self.route.progress.legs[:6]]
        for thing in read_objects(observation):
            if thing.kind is not ObjectClass.STATIC or thing.distance > self._config.roadblock_sight:
                continue
            found = place_on_lanes(self._town, lanes, thing.x, thing.y)
            if found is None or (found[0] == place[0] and found[1] < place[1]) or self.route.knows_roadblock(found):
                continue
            self.route = self.route.with_roadblock(self._town, found).replanned(self._town, place)
            self.cost_to_go.aim(self.goal.place, self.blocked)

    def _follow(self, place: Place) -> None:
        """Updates the progress on the route, and plans another one when the car has left it."""
        assert self.route.progress is not None
        progress = self.route.progress.followed(self._town, *place)
        if progress.lost(place[1]):
            progress, self._key = progress.replanned(self._town, place), ()
        self.route = self.route.with_progress(progress)

    # --- steps ------------------------------------------------------------------------------------------------------

    def _next_step(self, observation: Observation, place: Place, *, waits: bool) -> GuidanceStep | None:
        """Returns the next step on the route if it is near; a stopped car is sent on."""
        progress = self.route.progress
        assert progress is not None
        if progress.astray:
            return None
        lane, station = place
        crossing, manoeuvre = progress.next_crossing(self._town, station), progress.next_manoeuvre(station)
        if manoeuvre is not None and (crossing is None or manoeuvre[1] < crossing.distance):
            entry, distance = manoeuvre
            alone = crossing is None or progress.needs_switch(self._town, lane, station, crossing)
            own_step = alone or entry is LaneEntry.U_TURN
            step = self._manoeuvre_step(observation, lane, entry, distance) if own_step else None
            if step is not None:
                return step
            if crossing is None or entry is LaneEntry.U_TURN:
                return _send_on(waits)
        if crossing is None:
            return self._stop_step(progress.left(station), waits=waits)
        near = crossing.distance <= self._config.turn_distance
        return self._turn_step(observation, crossing) if near else _send_on(waits)

    def _turn_step(self, observation: Observation, crossing: RouteJunction) -> GuidanceStep:
        sector = self._exits.sector_of(crossing.lane, crossing.exit.connector)
        street = street_of(observation, self._town, crossing.exit.lane)
        values = (ActionValue.J_TURN, street) if street is not StreetName.UNKNOWN else (ActionValue.J_TURN,)
        return GuidanceStep(("turn", crossing.lane, crossing.exit.connector), values, sector, crossing.distance)

    def _manoeuvre_step(
        self, observation: Observation, lane: int, entry: LaneEntry, distance: float
    ) -> GuidanceStep | None:
        """Returns a U-turn, or a lane switch that is not part of a turn, if it is near."""
        config = self._config
        if entry is LaneEntry.U_TURN:
            speed = scalar(observation, "speed")
            near = distance <= config.reaction_time * speed + slowing_distance(speed, config.u_turn_speed_squared)
            return GuidanceStep(("round", lane), (ActionValue.U_TURN,), None, distance) if near else None
        if distance > config.switch_distance:
            return None
        left = entry is LaneEntry.CHANGE_LEFT
        sector = nearest_sector(90.0 if left else -90.0)
        return GuidanceStep(("lane", lane, left), (ActionValue.LANE_SWITCH,), sector, distance)

    def _stop_after_manoeuvre(self, place: Place, turning: float, *, waits: bool) -> GuidanceStep | None:
        """Returns a stop for a goal right behind the manoeuvre under way, while there is time to stop."""
        assert self.goal is not None
        lane, station = self.goal.place
        left = station - place[1]  # a car in a manoeuvre is reported at the manoeuvre's end
        if lane == place[0] and -self._config.arrived_within <= left <= self._config.stop_distance:
            return self._stop_step(left + turning, waits=waits)
        return _send_on(waits)

    def _stop_step(self, left: float, *, waits: bool) -> GuidanceStep | None:
        """Returns a stop in so many metres; a car that stands elsewhere than at the goal is sent on."""
        assert self.goal is not None
        if waits:
            return None if abs(left) <= self._config.arrived_within else _send_on(waits, left)
        if left > self._config.stop_distance:
            return None
        return GuidanceStep(("stop", self.goal.row), (ActionValue.STOP, self.goal.name), None, max(left, 0.0))


def _send_on(waits: bool, distance: float = 0.0) -> GuidanceStep | None:
    return GuidanceStep(("on",), (ActionValue.START,), None, distance) if waits else None


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
