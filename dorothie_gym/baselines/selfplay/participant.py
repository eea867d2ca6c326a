"""Interface of the participant, which knows the subgoals and the route and has a dozen utterances."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from dorothie_gym.baselines.selfplay.role_interface import Mask, RoleInterface, one_hot
from dorothie_gym.baselines.selfplay.utterance_memory import HeardRemark, listen
from dorothie_gym.dialogue import Direction, load_lexicon, understand
from dorothie_gym.maps.routing import LaneEntry, Place
from dorothie_gym.ontology import ActionValue, DialogueAct, DialogueMove, LandmarkName, Role
from dorothie_gym.policies.observation_parser import read_landmarks, read_subgoals, scalar
from dorothie_gym.policies.route_progress import RouteProgress
from dorothie_gym.spaces import ParticipantAction, Speech

ACROSS, FAR, CLOSE = 500.0, 100.0, 10.0
"""Scales of distances [m]."""

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
    """Names the next place to go to."""
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
    """The way to the subgoal that is next; `goal` is a row of the landmarks."""

    subgoal: int
    goal: int
    name: LandmarkName
    journey: RouteProgress


@dataclass(frozen=True, kw_only=True)
class ParticipantMemory:
    """Memory of the participant: the Co-Wizard's last utterance, and the route to the current subgoal."""

    heard: HeardRemark | None = None
    errand: SubgoalRoute | None = None


class ParticipantInterface(RoleInterface[ParticipantMemory]):
    """Interface of the participant; `ParticipantPhrase` lists its utterances."""

    role = Role.PARTICIPANT
    speakers = (Role.CO_WIZARD,)
    fields = ("lights", "speaking", "speed", "subgoals", "time")
    actions = len(ParticipantPhrase)
    own_size: ClassVar[int] = 4 + 2 + len(Direction) + 1 + len(_ENTRIES)

    def begin(self) -> ParticipantMemory:
        """Returns an empty memory."""
        return ParticipantMemory()

    def notice(self, observation: Mapping[str, Any], memory: ParticipantMemory) -> ParticipantMemory:
        """Takes the first errand that may be done now, and follows the way to it."""
        heard = listen(observation, Role.CO_WIZARD, memory.heard)
        place = int(observation["lane"]), scalar(observation, "station")
        return ParticipantMemory(heard=heard, errand=self._errand(observation, place, memory.errand))

    def remarks(self, memory: ParticipantMemory) -> tuple[HeardRemark | None, ...]:
        """Returns the Co-Wizard's last utterance."""
        return (memory.heard,)

    def own(self, observation: Mapping[str, Any], memory: ParticipantMemory) -> list[float]:
        """Returns the remaining distance, the direction of the next turn, and the next lane change or U-turn."""
        errand = memory.errand
        if errand is None:
            return [0.0] * self.own_size
        station, journey = scalar(observation, "station"), errand.journey
        left = journey.left(station)
        crossing, manoeuvre = journey.next_crossing(self.town, station), journey.next_manoeuvre(station)
        turn = None if crossing is None else _DIRECTIONS.index(crossing.direction)
        entry = None if manoeuvre is None or manoeuvre[0] not in _ENTRIES else _ENTRIES.index(manoeuvre[0])
        return [
            1.0, _share(left, ACROSS), _share(left, FAR), _share(left, CLOSE),
            float(crossing is not None), 0.0 if crossing is None else _share(crossing.distance, FAR),
            *one_hot(turn, len(_DIRECTIONS)),
            0.0 if manoeuvre is None else _share(manoeuvre[1], FAR), *one_hot(entry, len(_ENTRIES)),
        ]  # fmt: skip

    def mask(self, observation: Mapping[str, Any], memory: ParticipantMemory) -> Mask:
        """Returns the possible utterances: none while speaking; naming a goal only if there is one."""
        mask = np.full(self.actions, scalar(observation, "speaking") <= 0.0)
        mask[ParticipantPhrase.NOTHING] = True
        mask[ParticipantPhrase.NAME_GOAL] &= memory.errand is not None
        return mask

    def allowed(self, observation: Mapping[str, Any], masks: Mapping[str, Any]) -> Mask:
        """Returns all actions: the environment never masks speech."""
        return np.ones(self.actions, dtype=np.bool_)

    def act(
        self, choice: int, observation: Mapping[str, Any], memory: ParticipantMemory
    ) -> tuple[ParticipantAction, ParticipantMemory]:  # fmt: skip
        """Says a phrase."""
        return ParticipantAction(speech=_speech(ParticipantPhrase(choice), memory.errand)), memory

    def choice_of(
        self, action: ParticipantAction, observation: Mapping[str, Any], memory: ParticipantMemory
    ) -> int:  # fmt: skip
        """Returns the utterance with the same act and direction; a named place must be the next one."""
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
        named = memory.errand is not None and memory.errand.name in speech.act.slots
        return ParticipantPhrase.NAME_GOAL if named else ParticipantPhrase.NOTHING

    def _errand(self, observation: Mapping[str, Any], place: Place, errand: SubgoalRoute | None) -> SubgoalRoute | None:
        subgoals = read_subgoals(observation)
        if errand is not None:
            now = subgoals[errand.subgoal]
            if now.open and now.allowed and now.landmark == errand.goal:
                return replace(errand, journey=self._followed(errand.journey, place))
        landmarks = {mark.row: mark for mark in read_landmarks(observation, self.town)}
        for subgoal in subgoals:
            mark = landmarks.get(subgoal.landmark)
            if subgoal.open and subgoal.allowed and mark is not None:
                journey = RouteProgress.plan(self.town, place, mark.place)
                return SubgoalRoute(subgoal=subgoal.index, goal=mark.row, name=mark.name, journey=journey)
        return None

    def _followed(self, journey: RouteProgress, place: Place) -> RouteProgress:
        journey = journey.followed(self.town, *place)
        return journey.replanned(self.town, place) if journey.lost(place[1]) else journey


def _speech(phrase: ParticipantPhrase, errand: SubgoalRoute | None) -> Speech | None:
    if phrase in _INSTRUCTIONS:
        action, text = _INSTRUCTIONS[phrase]
        return Speech(act=DialogueAct.of(DialogueMove.INSTRUCT, action), text=text)
    if phrase is ParticipantPhrase.NAME_GOAL and errand is not None:
        name = load_lexicon().forms(errand.name, "say")[0]
        return Speech(act=DialogueAct.of(DialogueMove.INSTRUCT, errand.name), text=f"We need to go to {name}.")
    return _ANSWERS.get(phrase)


def _share(metres: float, of: float) -> float:
    return max(min(metres / of, 1.0), -1.0)
