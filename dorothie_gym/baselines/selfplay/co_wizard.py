"""The Co-Wizard's seat: it sees and drives as in `Navigation-v0`, notes the goal that was named, and can ask."""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np

from dorothie_gym.angles import wrap_degrees
from dorothie_gym.baselines.selfplay.role_interface import Mask, RoleInterface
from dorothie_gym.baselines.selfplay.utterance_memory import HeardRemark, listen
from dorothie_gym.engine.config import EnvConfig
from dorothie_gym.maps import Town
from dorothie_gym.maps.routing import Place
from dorothie_gym.ontology import (
    ActionValue,
    DialogueAct,
    DialogueMove,
    LandmarkName,
    MentalAction,
    PhysicalAction,
    Role,
)
from dorothie_gym.policies.navigation.actions import (
    ACTIONS,
    EstimatedActionMask,
    NavigationAction,
    physical_of,
    prepares,
)
from dorothie_gym.policies.navigation.demonstrations import action_of
from dorothie_gym.policies.navigation.instructor import NavigationInstruction
from dorothie_gym.policies.navigation.junction_exits import JunctionExits, nearest_sector
from dorothie_gym.policies.navigation.observation_vector import FIELDS, HeardInstruction, NavigationEncoder
from dorothie_gym.policies.observation_parser import read_landmarks, scalar
from dorothie_gym.policies.route_progress import CANONICAL
from dorothie_gym.spaces import CoWizardAction, ExitColumn, Mental, Physical, SpaceLimits, Speech


class ExtraAction(enum.IntEnum):
    """Actions of the Co-Wizard besides driving, numbered after `NavigationAction`."""

    NOTE_GOAL = len(ACTIONS)
    """Heads for the place that was named last: the car comes up to it slowly."""
    ACKNOWLEDGE = len(ACTIONS) + 1
    ASK_GOAL = len(ACTIONS) + 2
    ASK_WAY = len(ACTIONS) + 3


_SPEECH: Mapping[int, Speech] = {
    ExtraAction.ACKNOWLEDGE: Speech(act=DialogueAct.of(DialogueMove.ACKNOWLEDGE), text="Okay."),
    ExtraAction.ASK_GOAL: Speech(
        act=DialogueAct.of(DialogueMove.QUERY_W, LandmarkName.QUERIED), text="Where do you want to go?"
    ),
    ExtraAction.ASK_WAY: Speech(act=DialogueAct.of(DialogueMove.QUERY_W, ActionValue.QUERIED), text="Which way now?"),
}


@dataclass(frozen=True, kw_only=True)
class CoWizardMemory:
    """What the Co-Wizard remembers: the participant's last remark, the place named last, and the one noted.

    `told` is the same as a driver of `Navigation-v0` has it; `seen` is what was observed at the decision before.
    """

    heard: HeardRemark | None = None
    named: LandmarkName | None = None
    noted: LandmarkName | None = None
    told: HeardInstruction = field(default_factory=HeardInstruction)
    seen: Mapping[str, Any] | None = None


class CoWizardInterface(RoleInterface[CoWizardMemory]):
    """See `NavigationAction` for how it drives, `ExtraAction` for the rest, and `FIELDS` for what it sees."""

    role = Role.CO_WIZARD
    speakers = (Role.PARTICIPANT,)
    fields = ("speaking",)
    actions = len(ACTIONS) + len(ExtraAction)
    own_size: ClassVar[int] = sum(FIELDS.values()) + 2

    def __init__(self, town: Town, limits: SpaceLimits) -> None:
        super().__init__(town, limits)
        self._ways = JunctionExits(town)
        self._likely = EstimatedActionMask(town, self._ways)
        self._viewpoint = NavigationEncoder(town, self._ways, EnvConfig.max_seconds)

    def begin(self) -> CoWizardMemory:
        """Returns an empty memory."""
        return CoWizardMemory()

    def notice(self, observation: Mapping[str, Any], memory: CoWizardMemory) -> CoWizardMemory:
        """Listens: what was said is an instruction, and a place that was named is the goal, where the map has it."""
        told = memory.told if memory.seen is None else memory.told.driven_on(memory.seen, observation)
        heard, named = listen(observation, Role.PARTICIPANT, memory.heard), memory.named
        if heard is not None and heard is not memory.heard:
            told = replace(told, instruction=self._instruction(observation, heard), driven=0.0)
            if heard.landmark is not None:
                named, told = heard.landmark, replace(told, goal=self._place(observation, heard.landmark))
        return replace(memory, heard=heard, named=named, told=told, seen=observation)

    def remarks(self, memory: CoWizardMemory) -> tuple[HeardRemark | None, ...]:
        """Returns the participant's last utterance."""
        return (memory.heard,)

    def own(self, observation: Mapping[str, Any], memory: CoWizardMemory) -> list[float]:
        """Returns the observation of `Navigation-v0`, whether a goal is noted, and whether it is the last-named one."""
        view: list[float] = self._viewpoint.observe(observation, memory.told, ()).tolist()
        noted = memory.noted is not None
        return [*view, float(noted), float(noted and memory.noted is memory.named)]

    def mask(self, observation: Mapping[str, Any], memory: CoWizardMemory) -> Mask:
        """Returns the actions that the car would probably carry out and that change something."""
        mask = np.zeros(self.actions, dtype=np.bool_)
        mask[: len(ACTIONS)] = self._likely.mask(observation)
        mask[ExtraAction.NOTE_GOAL] = memory.named is not None and memory.named is not memory.noted
        mask[list(_SPEECH)] = scalar(observation, "speaking") <= 0.0
        return mask

    def allowed(self, observation: Mapping[str, Any], masks: Mapping[str, Any]) -> Mask:
        """Returns the actions that the car would carry out, or already prepares."""
        allowed = np.ones(self.actions, dtype=np.bool_)
        for action in ACTIONS[1:]:
            if prepares(action, observation, self._ways):
                continue
            physical = physical_of(action, observation, self._ways)
            assert physical is not None
            allowed[action] = bool(masks["physical"][physical.action])
            if physical.action in (PhysicalAction.J_TURN, PhysicalAction.LANE_SWITCH):
                allowed[action] &= bool(masks["angle"][physical.angle + 180])
        return allowed

    def act(
        self, choice: int, observation: Mapping[str, Any], memory: CoWizardMemory
    ) -> tuple[CoWizardAction, CoWizardMemory]:  # fmt: skip
        """Drives, speaks or notes."""
        if choice == ExtraAction.NOTE_GOAL and memory.named is not None:
            note = Mental(action=MentalAction.GOAL_UPDATE, goals=(memory.named,))
            return CoWizardAction(mental=note), replace(memory, noted=memory.named)
        if choice in _SPEECH:
            return CoWizardAction(speech=_SPEECH[choice]), memory
        return CoWizardAction(physical=physical_of(NavigationAction(choice), observation, self._ways)), memory

    def choice_of(self, action: CoWizardAction, observation: Mapping[str, Any], memory: CoWizardMemory) -> int:
        """Returns the number of the driving action, else of the noted goal, else of the utterance."""
        physical, mental, speech = action.physical, action.mental, action.speech
        if physical is not None:
            return self._driven(physical, observation)
        if mental is not None and mental.action is MentalAction.GOAL_UPDATE and memory.named in mental.goals:
            return ExtraAction.NOTE_GOAL
        if speech is None:
            return NavigationAction.NOTHING
        same = (choice for choice, known in _SPEECH.items() if known.act.move is speech.act.move)
        return next((k for k in same if _SPEECH[k].act.slots <= speech.act.slots), int(NavigationAction.NOTHING))

    def _driven(self, physical: Physical, observation: Mapping[str, Any]) -> int:
        if physical.action is PhysicalAction.SPEED_CHANGE:
            return NavigationAction.FASTER if physical.up else NavigationAction.SLOWER
        if physical.action is PhysicalAction.LIGHT_CHANGE:
            return NavigationAction.LIGHTS
        return action_of(physical, observation, self._ways)

    def _instruction(self, observation: Mapping[str, Any], heard: HeardRemark) -> NavigationInstruction:
        """Returns an utterance as an instruction of `Navigation-v0`; turns refer to the next junction with a choice."""
        exits = observation["exits"][observation["exits"][:, ExitColumn.PRESENT] > 0.0]
        turns = ActionValue.J_TURN in heard.act.slots
        distance = float(exits[0, ExitColumn.DISTANCE]) if turns and len(exits) else 0.0
        sector = None if heard.direction is None else self._sector(observation, CANONICAL[heard.direction])
        return NavigationInstruction(act=heard.act, sector=sector, distance=distance, time=heard.time)

    def _sector(self, observation: Mapping[str, Any], angle: float) -> int:
        """Returns the sector of the exit nearest to an angle [degrees]."""
        choice = self._ways.choice_ahead(observation)
        ways = () if choice is None else self._ways.by_sector(choice)
        misfits = {k: abs(float(wrap_degrees(way.angle - angle))) for k, way in enumerate(ways) if way is not None}
        return min(misfits, key=misfits.__getitem__) if misfits else nearest_sector(angle)

    def _place(self, observation: Mapping[str, Any], name: LandmarkName) -> Place | None:
        """Returns the stopping place of the nearest landmark of a name on the map."""
        x, y, _ = observation["pose"].tolist()
        marks = [mark for mark in read_landmarks(observation, self.town) if mark.name is name]
        return min(marks, key=lambda mark: math.hypot(mark.x - x, mark.y - y)).place if marks else None
