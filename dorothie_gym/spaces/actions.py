"""What each role can do in a decision: typed, with the space it comes from.

Actions of the environments are dicts of plain numbers and texts; these classes read and write them. A malformed
dict raises `ValueError` naming the field. Whether a well-formed action is legal is the environment's business.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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

ActionDict: TypeAlias = dict[str, Any]


@dataclass(frozen=True, kw_only=True)
class Speech:
    """One span of an utterance: an act, and its words (empty: the generator words the act)."""

    act: DialogueAct
    text: str = ""


@dataclass(frozen=True, kw_only=True)
class Place:
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
        reader = _Reader(action, action_space(cls.role, limits))
        return cls(speech=reader.speech())


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
    place: Place = field(default_factory=Place)


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
        reader = _Reader(action, action_space(cls.role, limits))
        physical = reader.integer("physical")
        mental = reader.integer("mental")
        angle, up = reader.integer("angle"), reader.integer("up")
        plan, goals = reader.array("plan"), reader.array("goals")
        landmark, status, place = reader.integer("landmark"), reader.integer("status"), reader.place()
        return cls(
            speech=reader.speech(),
            physical=Physical(action=PhysicalAction(physical), angle=angle, up=bool(up)) if physical else None,
            mental=Mental(
                action=MentalAction(mental),
                plan=tuple(int(j) - 1 for j in plan if j > 0),
                goals=tuple(LANDMARKS[i] for i in np.flatnonzero(goals)),
                landmark=LANDMARKS[landmark],
                status=STATUSES[status],
                place=place,
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
    place: Place = field(default_factory=Place)
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
        reader = _Reader(action, action_space(cls.role, limits))
        return cls(
            exception=ExceptionKind(reader.integer("exception")),
            weather=WEATHER[reader.integer("weather")],
            share=reader.integer("share") / (PERCENT - 1),
            prop=PROPS[reader.integer("prop")],
            item=reader.integer("item"),
            place=reader.place(),
            count=reader.integer("count"),
            extent=reader.integer("extent"),
            sensor=SENSORS[reader.integer("sensor")],
            on=bool(reader.integer("on")),
            message=reader.text("message"),
        )


RoleAction: TypeAlias = ParticipantAction | CoWizardAction | AdWizardAction

_CLASSES: dict[Role, type[ParticipantAction] | type[CoWizardAction] | type[AdWizardAction]] = {
    cls.role: cls for cls in (ParticipantAction, CoWizardAction, AdWizardAction)
}


def decode_action(role: Role, action: Mapping[str, Any], limits: SpaceLimits) -> RoleAction:
    """Reads the action of a role; raises `ValueError` naming the role and the field that is wrong."""
    if not isinstance(action, Mapping):
        raise ValueError(f"action of {role}: expected a dict, got {type(action).__name__}")
    try:
        return _CLASSES[role].decode(action, limits)
    except ValueError as error:
        raise ValueError(f"action of {role}: {error}") from None


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


def _encode_place(place: Place) -> ActionDict:
    return {"lane": place.lane, "metres": place.metres}


class _Reader:
    """Takes fields out of an action dict, checking each against its space."""

    def __init__(self, action: Mapping[str, Any], space: spaces.Dict) -> None:
        self._action, self._space = action, space
        missing = [name for name in space if name not in action]
        unknown = [str(name) for name in action if name not in space.spaces]
        if missing:
            raise ValueError(f"field {missing[0]!r} is missing; the fields are {', '.join(space)}")
        if unknown:
            raise ValueError(f"field {unknown[0]!r} is unknown; the fields are {', '.join(space)}")

    def integer(self, name: str) -> int:
        space = self._space[name]
        assert isinstance(space, spaces.Discrete)
        value = self._action[name]
        low, high = int(space.start), int(space.start + space.n) - 1
        if not isinstance(value, int | np.integer | np.ndarray) or isinstance(value, bool) or np.ndim(value) != 0:
            raise ValueError(f"field {name!r} is {value!r}; it must be a whole number in {low}..{high}")
        if np.asarray(value).dtype.kind not in "iu" or not low <= int(value) <= high:
            raise ValueError(f"field {name!r} is {value!r}; it must be a whole number in {low}..{high}")
        return int(value)

    def array(self, name: str) -> Sequence[int]:
        space, value = self._space[name], np.asarray(self._action[name])
        if value.shape != space.shape or value.dtype.kind not in "iub":
            raise ValueError(
                f"field {name!r} has shape {value.shape} and type {value.dtype}; "
                f"it must hold whole numbers in shape {space.shape}"
            )
        top = space.nvec - 1 if isinstance(space, spaces.MultiDiscrete) else np.ones(value.shape, dtype=np.int64)
        if np.any(value < 0) or np.any(value > top):
            raise ValueError(f"field {name!r} has a value outside 0..{int(np.max(top))}")
        return [int(v) for v in value]

    def text(self, name: str) -> str:
        space, value = self._space[name], self._action[name]
        assert isinstance(space, spaces.Text)
        if not isinstance(value, str):
            raise ValueError(f"field {name!r} is a {type(value).__name__}; it must be a text")
        if len(value) > space.max_length:
            raise ValueError(f"field {name!r} has {len(value)} characters; at most {space.max_length} are taken")
        if wrong := sorted({c for c in value if c not in space.character_set}):
            raise ValueError(f"field {name!r} has characters that the space does not: {''.join(wrong)!r}")
        return value

    def place(self) -> Place:
        return Place(lane=self.integer("lane"), metres=self.integer("metres"))

    def speech(self) -> Speech | None:
        move, slots, text = self.integer("move"), self.array("slots"), self.text("utterance")
        if move == NO_MOVE:
            return None
        return Speech(act=DialogueAct(move=DialogueMove(move), slots=decode_slots(slots)), text=text)
