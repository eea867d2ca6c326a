"""What each role can do in a decision: typed, with the space it comes from.

Actions of the environments are dicts of plain numbers and texts; these classes read and write them. A malformed
dict raises `ValueError` naming the field. Whether a well-formed action is legal is the environment's business.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, ClassVar, TypeAlias

import numpy as np
from gymnasium import spaces

from dorothie_gym.ontology import (
    LABELS,
    DialogueAct,
    DialogueMove,
    ExceptionKind,
    GoalStatus,
    LandmarkName,
    MentalAction,
    PhysicalAction,
    PropKind,
    Role,
    Sensor,
    WeatherParameter,
    decode_slots,
    encode_slots,
)
from dorothie_gym.spaces.action_reader import ActionFieldTable, ActionReader
from dorothie_gym.spaces.limits import (
    MESSAGE_LENGTH,
    METRES,
    PERCENT,
    TEXT_CHARACTERS,
    UTTERANCE_LENGTH,
    SpaceLimits,
)

NO_MOVE = len(DialogueMove)
"""Value of `move` that says nothing."""

PROPS = tuple(PropKind)
SENSORS = tuple(Sensor)
WEATHER = tuple(WeatherParameter)
LANDMARKS = tuple(LandmarkName)
STATUSES = tuple(GoalStatus)
EXCEPTIONS = tuple(ExceptionKind(value) for value in range(len(ExceptionKind)))

ActionDict: TypeAlias = dict[str, Any]


@dataclass(frozen=True, kw_only=True)
class Speech:
    """One span of an utterance: an act, and its words (empty: the generator words the act)."""

    act: DialogueAct
    text: str = ""


@dataclass(frozen=True, kw_only=True)
class LanePosition:
    """A place on the map: a lane and whole metres along it."""

    lane: int = 0
    metres: int = 0


@dataclass(frozen=True, kw_only=True)
class ParticipantAction:
    """The human talks, or does not."""

    role: ClassVar[Role] = Role.PARTICIPANT
    speech: Speech | None = None

    def encode(self, limits: SpaceLimits) -> ActionDict:
        """The action as the environment takes it."""
        return _encode_speech(self.speech)

    @classmethod
    def decode(cls, action: Mapping[str, Any], limits: SpaceLimits) -> ParticipantAction:
        """Reads a dict; raises `ValueError` naming the field that is wrong."""
        return cls.read(ActionReader(action, _fields(cls.role, limits)))

    @classmethod
    def read(cls, reader: ActionReader) -> ParticipantAction:
        """The same from the fields."""
        speech = _read_speech(reader)
        return cls(speech=speech) if speech is not None else _SILENCE


@dataclass(frozen=True, kw_only=True)
class Physical:
    """A physical action: `angle` in degrees, positive left, for JTurn and LaneSwitch; `up` for speed and light."""

    action: PhysicalAction
    angle: int = 0
    up: bool = True


@dataclass(frozen=True, kw_only=True)
class Mental:
    """A belief update: a plan (indices in `Town.junctions`), goals, a landmark's status, or a guess of its place."""

    action: MentalAction
    plan: tuple[int, ...] = ()
    goals: tuple[LandmarkName, ...] = ()
    landmark: LandmarkName = LandmarkName.UNKNOWN
    status: GoalStatus = GoalStatus.UNKNOWN
    place: LanePosition = field(default_factory=LanePosition)


@dataclass(frozen=True, kw_only=True)
class CoWizardAction:
    """The car talks, drives and notes what it believes, all in one decision."""

    role: ClassVar[Role] = Role.CO_WIZARD
    speech: Speech | None = None
    physical: Physical | None = None
    mental: Mental | None = None

    def encode(self, limits: SpaceLimits) -> ActionDict:
        """The action as the environment takes it; junctions of a plan beyond `limits.plan` are left out."""
        physical = self.physical
        mental = self.mental or Mental(action=MentalAction.OTHER)
        plan = np.zeros(limits.plan, dtype=np.int64)
        kept = mental.plan[: limits.plan]
        plan[: len(kept)] = [junction + 1 for junction in kept]
        goals = np.zeros(len(LANDMARKS), dtype=np.int8)
        goals[[landmark.value for landmark in mental.goals]] = 1
        return {
            **_encode_speech(self.speech),
            "physical": int(physical.action) if physical else 0,
            "angle": physical.angle if physical else 0,
            "up": int(physical.up) if physical else 0,
            "mental": int(mental.action) if self.mental else 0,
            "plan": plan,
            "goals": goals,
            "landmark": mental.landmark.value,
            "status": mental.status.value,
            **_encode_place(mental.place),
        }

    @classmethod
    def decode(cls, action: Mapping[str, Any], limits: SpaceLimits) -> CoWizardAction:
        """Reads a dict; raises `ValueError` naming the field that is wrong."""
        return cls.read(ActionReader(action, _fields(cls.role, limits)))

    @classmethod
    def read(cls, reader: ActionReader) -> CoWizardAction:
        """The same from the fields."""
        physical, mental, angle, up, landmark, status, lane, metres = reader.integers(_CO_WIZARD_NUMBERS)
        plan, goals = reader.numbers("plan"), reader.flags("goals")
        speech = _read_speech(reader)
        if not physical and not mental and speech is None:
            return _INACTION
        return cls(
            speech=speech,
            physical=Physical(action=PhysicalAction(physical), angle=angle, up=bool(up)) if physical else None,
            mental=Mental(
                action=MentalAction(mental),
                plan=tuple(j - 1 for j in plan if j > 0),
                goals=tuple(LANDMARKS[i] for i, marked in enumerate(goals) if marked),
                landmark=LANDMARKS[landmark],
                status=STATUSES[status],
                place=LanePosition(lane=lane, metres=metres),
            )
            if mental
            else None,
        )


@dataclass(frozen=True, kw_only=True)
class AdWizardAction:
    """The adversary changes the world or the task, and may send the participant a message.

    Attributes:
        exception: what is done; NONE does nothing.
        weather: parameter to set, to `share` of its range.
        share: in [0, 1], in steps of a hundredth.
        prop: kind of prop to place.
        item: which prop (its row in the observation) to move or delete, or which subgoal a task exception is about.
        place: where, for props and for the middle of the rectangle of a spawn.
        count: how many vehicles or pedestrians to spawn.
        extent: half the side of that rectangle [m].
        sensor, on: fault to switch on or off.
        message: context for the participant.
    """

    role: ClassVar[Role] = Role.AD_WIZARD
    exception: ExceptionKind = ExceptionKind.NONE
    weather: WeatherParameter = WeatherParameter.CLOUDINESS
    share: float = 0.0
    prop: PropKind = PROPS[0]
    item: int = 0
    place: LanePosition = field(default_factory=LanePosition)
    count: int = 0
    extent: int = 0
    sensor: Sensor = SENSORS[0]
    on: bool = False
    message: str = ""

    def encode(self, limits: SpaceLimits) -> ActionDict:
        """The action as the environment takes it."""
        return {
            "exception": int(self.exception),
            "weather": WEATHER.index(self.weather),
            "share": round(self.share * (PERCENT - 1)),
            "prop": PROPS.index(self.prop),
            "item": self.item,
            **_encode_place(self.place),
            "count": self.count,
            "extent": self.extent,
            "sensor": SENSORS.index(self.sensor),
            "on": int(self.on),
            "message": self.message,
        }

    @classmethod
    def decode(cls, action: Mapping[str, Any], limits: SpaceLimits) -> AdWizardAction:
        """Reads a dict; raises `ValueError` naming the field that is wrong."""
        return cls.read(ActionReader(action, _fields(cls.role, limits)))

    @classmethod
    def read(cls, reader: ActionReader) -> AdWizardAction:
        """The same from the fields."""
        numbers, message = reader.integers(_AD_WIZARD_NUMBERS), reader.text("message")
        if not any(numbers) and not message:
            return _INTACT
        exception, weather, share, prop, item, lane, metres, count, extent, sensor, on = numbers
        return cls(
            exception=EXCEPTIONS[exception],
            weather=WEATHER[weather],
            share=share / (PERCENT - 1),
            prop=PROPS[prop],
            item=item,
            place=LanePosition(lane=lane, metres=metres),
            count=count,
            extent=extent,
            sensor=SENSORS[sensor],
            on=bool(on),
            message=message,
        )


_CO_WIZARD_NUMBERS = ("physical", "mental", "angle", "up", "landmark", "status", "lane", "metres")
_AD_WIZARD_NUMBERS = (
    "exception", "weather", "share", "prop", "item", "lane", "metres", "count", "extent", "sensor", "on",
)  # fmt: skip

_SILENCE, _INACTION, _INTACT = ParticipantAction(), CoWizardAction(), AdWizardAction()
"""What most decisions are, made once."""

RoleAction: TypeAlias = ParticipantAction | CoWizardAction | AdWizardAction

_CLASSES: dict[Role, type[ParticipantAction] | type[CoWizardAction] | type[AdWizardAction]] = {
    cls.role: cls for cls in (ParticipantAction, CoWizardAction, AdWizardAction)
}


class ActionDecoder:
    """Reads the actions of a role; for who reads many, as everything that depends on the role is looked up once."""

    def __init__(self, role: Role, limits: SpaceLimits) -> None:
        """Looks up what the fields may hold."""
        self.role = role
        self._fields, self._read = _fields(role, limits), _CLASSES[role].read

    def __call__(self, action: Mapping[str, Any]) -> RoleAction:
        """Reads an action; raises `ValueError` naming the role and the field that is wrong."""
        if type(action) is not dict and not isinstance(action, Mapping):
            raise ValueError(f"action of {self.role}: expected a dict, got {type(action).__name__}")
        try:
            return self._read(ActionReader(action, self._fields))
        except ValueError as error:
            raise ValueError(f"action of {self.role}: {error}") from None


def decode_action(role: Role, action: Mapping[str, Any], limits: SpaceLimits) -> RoleAction:
    """Reads the action of a role; raises `ValueError` naming the role and the field that is wrong."""
    return ActionDecoder(role, limits)(action)


def noop(role: Role, limits: SpaceLimits) -> ActionDict:
    """The action that does nothing."""
    return _CLASSES[role]().encode(limits)


@lru_cache(maxsize=64)
def action_space(role: Role, limits: SpaceLimits) -> spaces.Dict:
    """The action space of a role, documented field by field in the classes above.

    The object is shared: an environment that is to be seeded on its own takes a copy.
    """
    if role is Role.PARTICIPANT:
        return spaces.Dict(_speech_space())
    if role is Role.CO_WIZARD:
        return spaces.Dict(
            {
                **_speech_space(),
                "physical": spaces.Discrete(len(PhysicalAction) + 1),
                "angle": spaces.Discrete(360, start=-180),
                "up": spaces.Discrete(2),
                "mental": spaces.Discrete(len(MentalAction) + 1),
                "plan": spaces.MultiDiscrete([limits.junctions + 1] * limits.plan),
                "goals": spaces.MultiBinary(len(LANDMARKS)),
                "landmark": spaces.Discrete(len(LANDMARKS)),
                "status": spaces.Discrete(len(STATUSES)),
                **_place_space(limits),
            }
        )
    if role is Role.AD_WIZARD:
        return spaces.Dict(
            {
                "exception": spaces.Discrete(len(ExceptionKind)),
                "weather": spaces.Discrete(len(WEATHER)),
                "share": spaces.Discrete(PERCENT),
                "prop": spaces.Discrete(len(PROPS)),
                "item": spaces.Discrete(max(limits.props, limits.subgoals)),
                **_place_space(limits),
                "count": spaces.Discrete(17),
                "extent": spaces.Discrete(101),
                "sensor": spaces.Discrete(len(SENSORS)),
                "on": spaces.Discrete(2),
                "message": spaces.Text(MESSAGE_LENGTH, min_length=0, charset=TEXT_CHARACTERS),
            }
        )
    raise ValueError(f"{role} takes no actions")


def _speech_space() -> dict[str, spaces.Space[Any]]:
    return {
        "move": spaces.Discrete(NO_MOVE + 1),
        "slots": spaces.MultiBinary(len(LABELS)),
        "utterance": spaces.Text(UTTERANCE_LENGTH, min_length=0, charset=TEXT_CHARACTERS),
    }


def _place_space(limits: SpaceLimits) -> dict[str, spaces.Space[Any]]:
    return {"lane": spaces.Discrete(limits.lanes), "metres": spaces.Discrete(METRES)}


def _encode_speech(speech: Speech | None) -> ActionDict:
    slots = encode_slots(speech.act.slots) if speech else [0] * len(LABELS)
    return {
        "move": int(speech.act.move) if speech else NO_MOVE,
        "slots": np.array(slots, dtype=np.int8),
        "utterance": speech.text if speech else "",
    }


def _encode_place(place: LanePosition) -> ActionDict:
    return {"lane": place.lane, "metres": place.metres}


@lru_cache(maxsize=64)
def _fields(role: Role, limits: SpaceLimits) -> ActionFieldTable:
    return ActionFieldTable(action_space(role, limits))


def _read_speech(reader: ActionReader) -> Speech | None:
    move, slots, text = reader.integer("move"), reader.flags("slots"), reader.text("utterance")
    return None if move == NO_MOVE else Speech(act=_act(move, slots), text=text)


@lru_cache(maxsize=4096)
def _act(move: int, slots: bytes) -> DialogueAct:
    return DialogueAct(move=DialogueMove(move), slots=decode_slots(slots))
