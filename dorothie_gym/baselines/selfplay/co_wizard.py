"""Interface of the Co-Wizard, which drives as in `Navigation-v0`, sets the goal that was named, and can ask."""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from dorothie_gym.angles import wrap_degrees
from dorothie_gym.baselines.selfplay.role_interface import LastUtterance, Mask, RoleInterface, last_utterance
from dorothie_gym.engine.config import EnvConfig
from dorothie_gym.maps.routing import Place
from dorothie_gym.maps.town import Town
from dorothie_gym.ontology.actions import MentalAction, PhysicalAction
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import ActionValue, LandmarkName
from dorothie_gym.policies.navigation.actions import (
    ACTIONS,
    EstimatedActionMask,
    NavigationAction,
    physical_of,
)
from dorothie_gym.policies.navigation.demonstrations import action_of
from dorothie_gym.policies.navigation.driver_view import DriverArrays, driver_of
from dorothie_gym.policies.navigation.instructor import NavigationInstruction
from dorothie_gym.policies.navigation.junction_exits import JunctionExits, nearest_sector
from dorothie_gym.policies.navigation.observation_vector import FIELDS, HeardInstruction, NavigationEncoder
from dorothie_gym.policies.observation_parser import read_landmarks, scalar
from dorothie_gym.policies.route_progress import CANONICAL
from dorothie_gym.spaces.actions import ActionMapping, CoWizardAction, Mental, Physical, Speech
from dorothie_gym.spaces.limits import SpaceLimits
from dorothie_gym.spaces.observations import ExitColumn, ObservationMapping


class ExtraAction(enum.IntEnum):
    """Actions of the Co-Wizard besides driving, numbered after `NavigationAction`."""

    NOTE_GOAL = len(ACTIONS)
    """Sets the last-named landmark as goal: the car approaches it slowly."""
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
    """Memory of the Co-Wizard.

    Attributes:
        heard: the participant's last utterance.
        named: landmark that was named last.
        noted: landmark that is set as goal.
        instruction: last instruction, in the form of `Navigation-v0`.
        previous: observation of the previous decision.
        driver: view of the driver at that decision.
    """

    heard: LastUtterance | None = None
    named: LandmarkName | None = None
    noted: LandmarkName | None = None
    instruction: HeardInstruction = field(default_factory=HeardInstruction)
    previous: ObservationMapping | None = None
    driver: DriverArrays | None = field(default=None, compare=False)


class CoWizardInterface(RoleInterface[CoWizardMemory, CoWizardAction]):
    """Interface of the Co-Wizard: `NavigationAction` and `ExtraAction` list its actions, `FIELDS` its own features."""

    role = Role.CO_WIZARD
    speakers = (Role.PARTICIPANT,)
    fields = ("speaking",)
    actions = len(ACTIONS) + len(ExtraAction)
    own_size: ClassVar[int] = sum(FIELDS.values()) + 2

    def __init__(self, town: Town, limits: SpaceLimits) -> None:
        super().__init__(town, limits)
        self._exits = JunctionExits(town)
        self._feasible = EstimatedActionMask(town)
        self._encoder = NavigationEncoder(town, self._exits, EnvConfig.max_seconds)

    def initial_memory(self) -> CoWizardMemory:
        """Returns an empty memory."""
        return CoWizardMemory()

    def update(self, observation: ObservationMapping, memory: CoWizardMemory) -> CoWizardMemory:
        """Stores an utterance as instruction, and a named landmark that is on the map as goal."""
        instruction = memory.instruction
        if memory.previous is not None:
            instruction = instruction.driven_on(memory.previous, observation)
        heard, named = last_utterance(observation, Role.PARTICIPANT, memory.heard), memory.named
        if heard is not None and heard is not memory.heard:
            instruction = replace(instruction, instruction=self._instruction(observation, heard), driven=0.0)
            if heard.landmark is not None:
                named = heard.landmark
                instruction = replace(instruction, goal=self._place(observation, heard.landmark))
        driver = driver_of(observation, self._exits)
        return replace(
            memory, heard=heard, named=named, instruction=instruction, previous=observation, driver=driver
        )  # fmt: skip

    def _driver(self, observation: ObservationMapping, memory: CoWizardMemory) -> DriverArrays:
        """Returns the view of the driver: that of `update`, if it was called with the same observation."""
        if memory.driver is not None and memory.previous is observation:
            return memory.driver
        return driver_of(observation, self._exits)

    def utterances(self, memory: CoWizardMemory) -> tuple[LastUtterance | None, ...]:
        """Returns the participant's last utterance."""
        return (memory.heard,)

    def own_features(self, observation: ObservationMapping, memory: CoWizardMemory) -> list[float]:
        """Returns the observation of `Navigation-v0`, whether a goal is set, and whether it is the last-named one."""
        view: list[float] = self._encoder.observe(observation, memory.instruction, ()).tolist()
        noted = memory.noted is not None
        return [*view, float(noted), float(noted and memory.noted is memory.named)]

    def mask(self, observation: ObservationMapping, memory: CoWizardMemory) -> Mask:
        """Returns the actions that the car would probably carry out and that change something."""
        mask = np.zeros(self.actions, dtype=np.bool_)
        mask[: len(ACTIONS)] = self._feasible.mask(self._driver(observation, memory))
        mask[ExtraAction.NOTE_GOAL] = memory.named is not None and memory.named is not memory.noted
        mask[list(_SPEECH)] = scalar(observation, "speaking") <= 0.0
        return mask

    def permitted(self, observation: ObservationMapping, memory: CoWizardMemory, masks: ActionMapping) -> Mask:
        """Returns the actions that the car would carry out, or already prepares."""
        permitted = np.ones(self.actions, dtype=np.bool_)
        driver = self._driver(observation, memory)
        for action in ACTIONS[1:]:
            physical = physical_of(action, driver)
            if physical is None:
                continue
            permitted[action] = bool(masks["physical"][physical.action])
            if physical.action in (PhysicalAction.J_TURN, PhysicalAction.LANE_SWITCH):
                permitted[action] &= bool(masks["angle"][physical.angle + 180])
        return permitted

    def act(
        self, choice: int, observation: ObservationMapping, memory: CoWizardMemory
    ) -> tuple[CoWizardAction, CoWizardMemory]:  # fmt: skip
        """Returns the action that drives, speaks or sets the goal."""
        if choice == ExtraAction.NOTE_GOAL and memory.named is not None:
            note = Mental(action=MentalAction.GOAL_UPDATE, goals=(memory.named,))
            return CoWizardAction(mental=note), replace(memory, noted=memory.named)
        if choice in _SPEECH:
            return CoWizardAction(speech=_SPEECH[choice]), memory
        return CoWizardAction(physical=physical_of(NavigationAction(choice), self._driver(observation, memory))), memory

    def choice_of(self, action: CoWizardAction, observation: ObservationMapping, memory: CoWizardMemory) -> int:
        """Returns the number of the driving action, else of the goal that is set, else of the utterance."""
        physical, mental, speech = action.physical, action.mental, action.speech
        if physical is not None:
            return self._driving_choice(physical, observation)
        if mental is not None and mental.action is MentalAction.GOAL_UPDATE and memory.named in mental.goals:
            return ExtraAction.NOTE_GOAL
        if speech is None:
            return NavigationAction.NOTHING
        same = (choice for choice, known in _SPEECH.items() if known.act.move is speech.act.move)
        return next((k for k in same if _SPEECH[k].act.slots <= speech.act.slots), int(NavigationAction.NOTHING))

    def _driving_choice(self, physical: Physical, observation: ObservationMapping) -> int:
        if physical.action is PhysicalAction.SPEED_CHANGE:
            return NavigationAction.FASTER if physical.up else NavigationAction.SLOWER
        if physical.action is PhysicalAction.LIGHT_CHANGE:
            return NavigationAction.LIGHTS
        return action_of(physical, observation, self._exits)

    def _instruction(self, observation: ObservationMapping, heard: LastUtterance) -> NavigationInstruction:
        """Returns an utterance as an instruction of `Navigation-v0`; turns refer to the next junction with a choice."""
        exits = observation["exits"][observation["exits"][:, ExitColumn.PRESENT] > 0.0]
        turns = ActionValue.J_TURN in heard.act.slots
        distance = float(exits[0, ExitColumn.DISTANCE]) if turns and len(exits) else 0.0
        sector = None if heard.direction is None else self._sector(observation, CANONICAL[heard.direction])
        return NavigationInstruction(act=heard.act, sector=sector, distance=distance, time=heard.time)

    def _sector(self, observation: ObservationMapping, angle: float) -> int:
        """Returns the sector of the exit whose angle is closest to `angle` [degrees]."""
        lane = self._exits.choice_ahead(observation)
        exits = () if lane is None else self._exits.by_sector(lane)
        misfits = {k: abs(float(wrap_degrees(way.angle - angle))) for k, way in enumerate(exits) if way is not None}
        return min(misfits, key=misfits.__getitem__) if misfits else nearest_sector(angle)

    def _place(self, observation: ObservationMapping, name: LandmarkName) -> Place | None:
        """Returns the stopping place of the nearest landmark of a name on the map."""
        x, y, _ = observation["pose"].tolist()
        marks = [mark for mark in read_landmarks(observation, self.town) if mark.name is name]
        return min(marks, key=lambda mark: math.hypot(mark.x - x, mark.y - y)).place if marks else None
