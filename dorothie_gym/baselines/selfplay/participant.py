"""Interface of the participant, which knows the subgoals and the route and has a dozen utterances."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from dorothie_gym.baselines.selfplay.role_interface import (
    LastUtterance,
    Mask,
    RoleInterface,
    last_utterance,
    one_hot,
)
from dorothie_gym.dialogue.lexicon import load_lexicon
from dorothie_gym.dialogue.nlu import understand
from dorothie_gym.dialogue.realization_context import Direction
from dorothie_gym.maps.routing import LaneEntry, Place
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import ActionValue, LandmarkName
from dorothie_gym.policies.navigation.observation_vector import CLOSE_UNIT, DISTANCE_UNIT, TOWN_UNIT
from dorothie_gym.policies.observation_parser import read_landmarks, read_subgoals, scalar
from dorothie_gym.policies.route_progress import RouteProgress
from dorothie_gym.spaces.actions import ActionMapping, ParticipantAction, Speech
from dorothie_gym.spaces.observations import ObservationMapping

_DIRECTIONS = tuple(Direction)
_ENTRIES = (LaneEntry.CHANGE_LEFT, LaneEntry.CHANGE_RIGHT, LaneEntry.U_TURN)


class ParticipantPhrase(enum.IntEnum):
    """Utterances of the participant."""

    NOTHING = 0
    TURN_LEFT = 1
    TURN_RIGHT = 2
    STRAIGHT_ON = 3
    TURN_ROUND = 4
    SWITCH_LEFT = 5
    SWITCH_RIGHT = 6
    STOP = 7
    GO_ON = 8
    NAME_GOAL = 9
    """Names the landmark of the current subgoal."""
    YES = 10
    NO = 11


_INSTRUCTIONS: Mapping[ParticipantPhrase, tuple[ActionValue, str]] = {
    ParticipantPhrase.TURN_LEFT: (ActionValue.J_TURN, "Turn left at the next junction."),
    ParticipantPhrase.TURN_RIGHT: (ActionValue.J_TURN, "Turn right at the next junction."),
    ParticipantPhrase.STRAIGHT_ON: (ActionValue.J_TURN, "Go straight on at the next junction."),
    ParticipantPhrase.TURN_ROUND: (ActionValue.U_TURN, "Please turn around."),
    ParticipantPhrase.SWITCH_LEFT: (ActionValue.LANE_SWITCH, "Change to the left lane."),
    ParticipantPhrase.SWITCH_RIGHT: (ActionValue.LANE_SWITCH, "Change to the right lane."),
    ParticipantPhrase.STOP: (ActionValue.STOP, "Stop here, please."),
    ParticipantPhrase.GO_ON: (ActionValue.START, "Start driving again, please."),
}
_ANSWERS: Mapping[ParticipantPhrase, Speech] = {
    ParticipantPhrase.YES: Speech(act=DialogueAct.of(DialogueMove.REPLY_Y), text="Yes."),
    ParticipantPhrase.NO: Speech(act=DialogueAct.of(DialogueMove.REPLY_N), text="No."),
}
_REPLIES = {DialogueMove.REPLY_Y: ParticipantPhrase.YES, DialogueMove.REPLY_N: ParticipantPhrase.NO}
_PHRASES: Mapping[tuple[ActionValue, Direction | None], ParticipantPhrase] = {
    (ActionValue.J_TURN, Direction.LEFT): ParticipantPhrase.TURN_LEFT,
    (ActionValue.J_TURN, Direction.RIGHT): ParticipantPhrase.TURN_RIGHT,
    (ActionValue.J_TURN, Direction.STRAIGHT): ParticipantPhrase.STRAIGHT_ON,
    (ActionValue.LANE_SWITCH, Direction.LEFT): ParticipantPhrase.SWITCH_LEFT,
    (ActionValue.LANE_SWITCH, Direction.RIGHT): ParticipantPhrase.SWITCH_RIGHT,
    (ActionValue.U_TURN, None): ParticipantPhrase.TURN_ROUND,
    (ActionValue.STOP, None): ParticipantPhrase.STOP,
    (ActionValue.START, None): ParticipantPhrase.GO_ON,
}
"""Utterance for each instructed action, with the direction of its words where there is one."""


@dataclass(frozen=True, kw_only=True)
class SubgoalRoute:
    """Current subgoal and the route to it.

    Attributes:
        subgoal: row of the subgoal in `subgoals`.
        landmark: row of its landmark in `landmarks`.
        name: name of the landmark.
        route: route to the landmark and the progress on it.
    """

    subgoal: int
    landmark: int
    name: LandmarkName
    route: RouteProgress


@dataclass(frozen=True, kw_only=True)
class ParticipantMemory:
    """Memory of the participant: the Co-Wizard's last utterance, and the current subgoal with its route."""

    heard: LastUtterance | None = None
    target: SubgoalRoute | None = None


class ParticipantInterface(RoleInterface[ParticipantMemory, ParticipantAction]):
    """Interface of the participant; `ParticipantPhrase` lists its utterances."""

    role = Role.PARTICIPANT
    speakers = (Role.CO_WIZARD,)
    fields = ("lights", "speaking", "speed", "subgoals", "time")
    actions = len(ParticipantPhrase)
    own_size: ClassVar[int] = 4 + 2 + len(Direction) + 1 + len(_ENTRIES)

    def initial_memory(self) -> ParticipantMemory:
        """Returns an empty memory."""
        return ParticipantMemory()

    def update(self, observation: ObservationMapping, memory: ParticipantMemory) -> ParticipantMemory:
        """Stores the last utterance, and follows the route to the first subgoal that is open and allowed."""
        heard = last_utterance(observation, Role.CO_WIZARD, memory.heard)
        place = int(observation["lane"]), scalar(observation, "station")
        return ParticipantMemory(heard=heard, target=self._target(observation, place, memory.target))

    def utterances(self, memory: ParticipantMemory) -> tuple[LastUtterance | None, ...]:
        """Returns the Co-Wizard's last utterance."""
        return (memory.heard,)

    def own_features(self, observation: ObservationMapping, memory: ParticipantMemory) -> list[float]:
        """Returns the remaining distance, the direction of the next turn, and the next lane change or U-turn."""
        if memory.target is None:
            return [0.0] * self.own_size
        station, route = scalar(observation, "station"), memory.target.route
        left = route.left(station)
        crossing, manoeuvre = route.next_crossing(self.town, station), route.next_manoeuvre(station)
        turn = None if crossing is None else _DIRECTIONS.index(crossing.direction)
        entry = None if manoeuvre is None or manoeuvre[0] not in _ENTRIES else _ENTRIES.index(manoeuvre[0])
        return [
            1.0, _scaled(left, TOWN_UNIT), _scaled(left, DISTANCE_UNIT), _scaled(left, CLOSE_UNIT),
            float(crossing is not None), 0.0 if crossing is None else _scaled(crossing.distance, DISTANCE_UNIT),
            *one_hot(turn, len(_DIRECTIONS)),
            0.0 if manoeuvre is None else _scaled(manoeuvre[1], DISTANCE_UNIT), *one_hot(entry, len(_ENTRIES)),
        ]  # fmt: skip

    def mask(self, observation: ObservationMapping, memory: ParticipantMemory) -> Mask:
        """Returns the possible utterances: none while speaking; the name of a landmark only if there is a subgoal."""
        mask = np.full(self.actions, scalar(observation, "speaking") <= 0.0)
        mask[ParticipantPhrase.NOTHING] = True
        mask[ParticipantPhrase.NAME_GOAL] &= memory.target is not None
        return mask

    def permitted(self, observation: ObservationMapping, memory: ParticipantMemory, masks: ActionMapping) -> Mask:
        """Returns all actions: the environment never masks speech."""
        return np.ones(self.actions, dtype=np.bool_)

    def act(
        self, choice: int, observation: ObservationMapping, memory: ParticipantMemory
    ) -> tuple[ParticipantAction, ParticipantMemory]:  # fmt: skip
        """Returns the action that says a phrase."""
        return ParticipantAction(speech=_speech(ParticipantPhrase(choice), memory.target)), memory

    def choice_of(
        self, action: ParticipantAction, observation: ObservationMapping, memory: ParticipantMemory
    ) -> int:  # fmt: skip
        """Returns the phrase with the same act and direction; a landmark must be that of the current subgoal."""
        speech = action.speech
        if speech is None:
            return ParticipantPhrase.NOTHING
        if speech.act.move in _REPLIES:
            return _REPLIES[speech.act.move]
        actions = [value for value in speech.act.ordered if isinstance(value, ActionValue)]
        direction = understand(speech.text).direction
        for value in actions:
            if phrase := _PHRASES.get((value, direction)) or _PHRASES.get((value, None)):
                return phrase
        named = memory.target is not None and memory.target.name in speech.act.slots
        return ParticipantPhrase.NAME_GOAL if named else ParticipantPhrase.NOTHING

    def _target(
        self, observation: ObservationMapping, place: Place, previous: SubgoalRoute | None
    ) -> SubgoalRoute | None:
        """Returns the previous target while its subgoal is open, else the first open subgoal; None without one."""
        subgoals = read_subgoals(observation)
        if previous is not None:
            now = subgoals[previous.subgoal]
            if now.open and now.allowed and now.landmark == previous.landmark:
                return replace(previous, route=self._followed(previous.route, place))
        landmarks = {mark.row: mark for mark in read_landmarks(observation, self.town)}
        for subgoal in subgoals:
            mark = landmarks.get(subgoal.landmark)
            if subgoal.open and subgoal.allowed and mark is not None:
                route = RouteProgress.plan(self.town, place, mark.place)
                return SubgoalRoute(subgoal=subgoal.index, landmark=mark.row, name=mark.name, route=route)
        return None

    def _followed(self, route: RouteProgress, place: Place) -> RouteProgress:
        """Returns the progress on a route at a place; plans another route where the car has left it."""
        route = route.followed(self.town, *place)
        return route.replanned(self.town, place) if route.lost(place[1]) else route


def _speech(phrase: ParticipantPhrase, target: SubgoalRoute | None) -> Speech | None:
    if phrase in _INSTRUCTIONS:
        action, text = _INSTRUCTIONS[phrase]
        return Speech(act=DialogueAct.of(DialogueMove.INSTRUCT, action), text=text)
    if phrase is ParticipantPhrase.NAME_GOAL and target is not None:
        name = load_lexicon().forms(target.name, "say")[0]
        return Speech(act=DialogueAct.of(DialogueMove.INSTRUCT, target.name), text=f"We need to go to {name}.")
    return _ANSWERS.get(phrase)


def _scaled(metres: float, unit: float) -> float:
    """Returns a distance in a unit, limited to -1..1."""
    return max(min(metres / unit, 1.0), -1.0)
