"""The Co-Wizard's seat: it drives as in `Navigation-v0`, notes the goal that was named, and can ask."""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.baselines.selfplay.heard import Remark, listen
from dorothie_gym.baselines.selfplay.seat import Mask, Seat
from dorothie_gym.navigation.actions import ACTIONS, FIRST_TURN, LEFT, PLAIN, RIGHT, NavigationAction
from dorothie_gym.navigation.ways import SECTORS, nearest_sector
from dorothie_gym.ontology import (
    ActionValue,
    DialogueAct,
    DialogueMove,
    LandmarkName,
    MentalAction,
    PhysicalAction,
    Role,
)
from dorothie_gym.policies.scenery import read_landmarks, scalar
from dorothie_gym.spaces import CoWizardAction, ExitColumn, Mental, Motion, Physical, Speech
from dorothie_gym.world.car.driver import MAX_CRUISE, MIN_CRUISE
from dorothie_gym.world.town import LinkType
from dorothie_gym.world.town.model import wrap_degrees

ACROSS, FAR, CLOSE = 500.0, 100.0, 10.0
"""Ways are shares of these [m]."""


class OtherAction(enum.IntEnum):
    """What the Co-Wizard can do beside driving; numbers go on where `NavigationAction` ends."""

    NOTE_GOAL = len(ACTIONS)
    """Heads for the place that was named last: the car comes up to it slowly."""
    ACKNOWLEDGE = len(ACTIONS) + 1
    ASK_GOAL = len(ACTIONS) + 2
    ASK_WAY = len(ACTIONS) + 3


_SPEECH: Mapping[int, Speech] = {
    OtherAction.ACKNOWLEDGE: Speech(act=DialogueAct.of(DialogueMove.ACKNOWLEDGE), text="Okay."),
    OtherAction.ASK_GOAL: Speech(
        act=DialogueAct.of(DialogueMove.QUERY_W, LandmarkName.QUERIED), text="Where do you want to go?"
    ),
    OtherAction.ASK_WAY: Speech(act=DialogueAct.of(DialogueMove.QUERY_W, ActionValue.QUERIED), text="Which way now?"),
}
_SIDES = {
    NavigationAction.SWITCH_LEFT: (LinkType.LANE_CHANGE_LEFT, LEFT),
    NavigationAction.SWITCH_RIGHT: (LinkType.LANE_CHANGE_RIGHT, RIGHT),
}


@dataclass(frozen=True, kw_only=True)
class CoWizardMemory:
    """What the Co-Wizard remembers: the participant's last remark, the place named last, and the one noted."""

    heard: Remark | None = None
    named: LandmarkName | None = None
    noted: LandmarkName | None = None


class CoWizardSeat(Seat[CoWizardMemory]):
    """See `NavigationAction` for how it drives, `OtherAction` for the rest."""

    role = Role.CO_WIZARD
    speakers = (Role.PARTICIPANT,)
    actions = len(ACTIONS) + len(OtherAction)
    own_size: ClassVar[int] = 2 * len(SECTORS) + 1 + 6 + len(Motion) + len(PhysicalAction) + 1

    def begin(self) -> CoWizardMemory:
        """Nothing has been heard."""
        return CoWizardMemory()

    def notice(self, observation: Mapping[str, Any], memory: CoWizardMemory) -> CoWizardMemory:
        """Listens."""
        heard = listen(observation, Role.PARTICIPANT, memory.heard)
        named = memory.named if heard is None or heard is memory.heard else heard.landmark or memory.named
        return replace(memory, heard=heard, named=named)

    def remarks(self, memory: CoWizardMemory) -> tuple[Remark | None, ...]:
        """The participant's."""
        return (memory.heard,)

    def own(self, observation: Mapping[str, Any], memory: CoWizardMemory) -> list[float]:
        """The ways on by sectors, how far the junction is, the goal that was noted, and what the car is about."""
        exits = self._exits(observation)
        planned = _turn_planned(observation)
        values = [0.0] * (2 * len(SECTORS))
        for sector, row in exits.items():
            values[2 * sector] = 1.0
            values[2 * sector + 1] = float(planned == int(row[ExitColumn.ANGLE]))
        distance = min((float(row[ExitColumn.DISTANCE]) for row in exits.values()), default=FAR)
        motion = [float(int(observation["motion"]) == kind) for kind in Motion]
        manoeuvre = [float(int(observation["manoeuvre"]) == k) for k in range(len(PhysicalAction) + 1)]
        return [*values, min(distance / FAR, 1.0), *self._goal(observation, memory), *motion, *manoeuvre]

    def mask(self, observation: Mapping[str, Any], memory: CoWizardMemory) -> Mask:
        """What would change nothing is left out, as is what the map has no room for; turns may be asked for again."""
        lane = self.town.lanes[int(observation["lane"])]
        stopped = int(observation["motion"]) == Motion.STOPPED
        manoeuvre, cruise = int(observation["manoeuvre"]), scalar(observation, "cruise_speed")
        mask = np.zeros(self.actions, dtype=np.bool_)
        mask[[NavigationAction.NOTHING, NavigationAction.LIGHTS]] = True
        mask[NavigationAction.STOP], mask[NavigationAction.START] = not stopped, stopped
        mask[NavigationAction.LANE_FOLLOW] = stopped or manoeuvre != 0
        mask[NavigationAction.FASTER], mask[NavigationAction.SLOWER] = cruise < MAX_CRUISE, cruise > MIN_CRUISE
        if not lane.in_junction:
            under_way = manoeuvre, round(scalar(observation, "manoeuvre_angle"))
            for action, (side, angle) in _SIDES.items():
                beside = self.town.neighbour(lane.id, side) is not None
                mask[action] = beside and under_way != (PhysicalAction.LANE_SWITCH, angle)
            mask[NavigationAction.U_TURN] = manoeuvre != PhysicalAction.U_TURN
        mask[[FIRST_TURN + sector for sector in self._exits(observation)]] = True
        mask[OtherAction.NOTE_GOAL] = memory.named is not None and memory.named is not memory.noted
        mask[list(_SPEECH)] = scalar(observation, "speaking") <= 0.0
        return mask

    def allowed(self, observation: Mapping[str, Any], masks: Mapping[str, Any]) -> Mask:
        """What the car would carry out."""
        allowed = np.ones(self.actions, dtype=np.bool_)
        for choice in range(1, len(ACTIONS)):
            if self._plans_turn(choice, observation):
                continue
            physical = self._physical(choice, observation)
            allowed[choice] = physical is not None and bool(masks["physical"][physical.action])
            if physical is not None and physical.action in (PhysicalAction.J_TURN, PhysicalAction.LANE_SWITCH):
                allowed[choice] &= bool(masks["angle"][physical.angle + 180])
        return allowed

    def act(
        self, choice: int, observation: Mapping[str, Any], memory: CoWizardMemory
    ) -> tuple[CoWizardAction, CoWizardMemory]:  # fmt: skip
        """Drives, speaks or notes."""
        if choice == OtherAction.NOTE_GOAL and memory.named is not None:
            note = Mental(action=MentalAction.GOAL_UPDATE, goals=(memory.named,))
            return CoWizardAction(mental=note), replace(memory, noted=memory.named)
        if choice in _SPEECH:
            return CoWizardAction(speech=_SPEECH[choice]), memory
        if self._plans_turn(choice, observation):
            return CoWizardAction(), memory  # it just goes on
        return CoWizardAction(physical=self._physical(choice, observation)), memory

    def choice_of(self, action: CoWizardAction, observation: Mapping[str, Any], memory: CoWizardMemory) -> int:
        """What was driven, else the goal that was noted, else what was said, as far as it has a number."""
        physical, mental, speech = action.physical, action.mental, action.speech
        if physical is not None:
            return self._driven(physical, observation)
        if mental is not None and mental.action is MentalAction.GOAL_UPDATE and memory.named in mental.goals:
            return OtherAction.NOTE_GOAL
        if speech is None:
            return NavigationAction.NOTHING
        same = (choice for choice, known in _SPEECH.items() if known.act.move is speech.act.move)
        return next((k for k in same if _SPEECH[k].act.slots <= speech.act.slots), int(NavigationAction.NOTHING))

    def _driven(self, physical: Physical, observation: Mapping[str, Any]) -> int:
        """The number of a physical action; of turns that into the exit which fits best."""
        if physical.action is PhysicalAction.J_TURN:
            exits = self._exits(observation)
            misfits = {k: abs(float(wrap_degrees(row[ExitColumn.ANGLE] - physical.angle))) for k, row in exits.items()}
            return FIRST_TURN + min(misfits, key=misfits.__getitem__) if misfits else int(NavigationAction.NOTHING)
        alike = (choice for choice in range(1, FIRST_TURN) if self._physical(choice, observation) == physical)
        return next(alike, int(NavigationAction.NOTHING))

    def _plans_turn(self, choice: int, observation: Mapping[str, Any]) -> bool:
        """Whether a choice is the turn that the car is about to take."""
        if int(observation["motion"]) == Motion.STOPPED:
            return False
        planned, row = _turn_planned(observation), self._exits(observation).get(choice - FIRST_TURN)
        return planned is not None and row is not None and int(row[ExitColumn.ANGLE]) == planned

    def _physical(self, choice: int, observation: Mapping[str, Any]) -> Physical | None:
        if choice == NavigationAction.LIGHTS:
            return Physical(action=PhysicalAction.LIGHT_CHANGE, up=not int(observation["lights"]))
        if FIRST_TURN <= choice < len(ACTIONS):
            row = self._exits(observation).get(choice - FIRST_TURN)
            return None if row is None else Physical(action=PhysicalAction.J_TURN, angle=int(row[ExitColumn.ANGLE]))
        return PLAIN.get(choice)

    def _exits(self, observation: Mapping[str, Any]) -> dict[int, NDArray[np.float64]]:
        """The exit of each sector that has one: of several the one closest to its middle."""
        found: dict[int, NDArray[np.float64]] = {}
        for row in observation["exits"]:
            if not row[ExitColumn.PRESENT]:
                break
            sector = nearest_sector(float(row[ExitColumn.ANGLE]))
            if sector not in found or _misfit(row, sector) < _misfit(found[sector], sector):
                found[sector] = row
        return found

    def _goal(self, observation: Mapping[str, Any], memory: CoWizardMemory) -> list[float]:
        """Whether a goal is noted and on the map; how far ahead and to the right; how far on this lane, if it is."""
        x, y, heading = observation["pose"].tolist()
        marks = [mark for mark in read_landmarks(observation, self.town) if mark.name is memory.noted]
        if not marks:
            return [float(memory.noted is not None), 0.0, 0.0, 0.0, 0.0, 0.0]
        mark = min(marks, key=lambda mark: math.hypot(mark.x - x, mark.y - y))
        east, south = mark.x - x, mark.y - y
        ahead, right = (
            east * math.cos(heading) + south * math.sin(heading),
            south * math.cos(heading) - east * math.sin(heading),
        )
        on_lane = mark.lane == int(observation["lane"])
        left = mark.station - scalar(observation, "station") if on_lane else FAR
        return [1.0, 1.0, ahead / ACROSS, right / ACROSS, left / FAR, max(min(left / CLOSE, 1.0), -1.0)]


def _misfit(row: NDArray[np.float64], sector: int) -> float:
    return abs(float(wrap_degrees(row[ExitColumn.ANGLE] - SECTORS[sector])))


def _turn_planned(observation: Mapping[str, Any]) -> int | None:
    """Angle of the turn that the car is about to take [degrees]."""
    if int(observation["manoeuvre"]) != PhysicalAction.J_TURN:
        return None
    return round(scalar(observation, "manoeuvre_angle"))
