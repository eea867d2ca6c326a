"""Typed actions of the roles, their action spaces, and the conversion from and to action dicts.

Environments take dicts of numbers and texts; these classes encode and decode them. A field that a dict leaves out has
its value in `noop`. A malformed dict raises `ValueError` with the name of the field. The environment decides whether a
well-formed action is feasible.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, ClassVar, TypeAlias

import numpy as np
from gymnasium import spaces

from dorothie_gym.dialogue.propositions import Proposition, encode_meaning, find_meaning
from dorothie_gym.errors import ActionError, short_repr
from dorothie_gym.ontology.actions import MentalAction, PhysicalAction
from dorothie_gym.ontology.dialogue_acts import LABELS, DialogueAct, DialogueMove, decode_slots, encode_slots
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import GoalStatus, LandmarkName
from dorothie_gym.ontology.world_exceptions import ExceptionKind, PropKind, Sensor, WeatherParameter
from dorothie_gym.session.spaces.action_reader import ActionFieldTable, ActionReader
from dorothie_gym.session.spaces.fields import (
    LANE_METRES,
    MEANING_LENGTH,
    MESSAGE_LENGTH,
    PERCENT,
    UTTERANCE_LENGTH,
    FieldSpec,
    SpaceLimits,
    choice,
    choices,
    dict_space,
    flags,
    text,
)
from dorothie_gym.support.copying import shared

NO_MOVE = len(DialogueMove)
"""Value of `move` for silence."""

MAX_ONSET = 100
"""Longest time from a decision to the first word [0.01 s]."""

MAX_PACE = 250
"""Fastest speaking rate relative to that of the environment [%]."""

PROPS = tuple(PropKind)
SENSORS = tuple(Sensor)
WEATHER = tuple(WeatherParameter)
LANDMARKS = tuple(LandmarkName)
STATUSES = tuple(GoalStatus)
EXCEPTIONS = tuple(ExceptionKind(value) for value in range(len(ExceptionKind)))

ActionDict: TypeAlias = dict[str, Any]
"""Action dict of one role: values by field name, as specified by `action_fields`."""

StepInfo: TypeAlias = dict[str, Any]
"""Info dict of a reset or a step, for one role."""

ActionMapping: TypeAlias = Mapping[str, Any]
"""Read-only action dict, as accepted by the decoders."""

MAX_SPAWNED = 16
"""Maximum number of actors in one spawn exception."""

MAX_EXTENT = 100
"""Largest half side of the square of a spawn exception [m]."""


@dataclass(frozen=True, kw_only=True)
class Speech:
    """Span of an utterance.

    Attributes:
        act: the dialogue act.
        text: its words; if empty, they are generated.
        meaning: propositions that the speaker states, asks or requests. They are recorded, but no role observes them.
        onset: time from the decision to the first word of an utterance [s]; a span that continues one has none.
        pace: speaking rate relative to that of the environment.
    """

    act: DialogueAct
    text: str = ""
    meaning: tuple[Proposition, ...] = ()
    onset: float = 0.0
    pace: float = 1.0


@dataclass(frozen=True, kw_only=True)
class LanePosition:
    """Position on the map: a lane id and the distance along the lane in whole metres."""

    lane: int = 0
    metres: int = 0


@dataclass(frozen=True, kw_only=True)
class ParticipantAction:
    """Action of the participant: speech or silence."""

    role: ClassVar[Role] = Role.PARTICIPANT
    speech: Speech | None = None

    def encode(self, limits: SpaceLimits) -> ActionDict:
        """Returns the action dict."""
        return _encode_speech(self.speech)

    @classmethod
    def decode(cls, action: ActionMapping, limits: SpaceLimits) -> ParticipantAction:
        """Decodes an action dict; raises `ValueError` with the name of an invalid field."""
        return cls.read(ActionReader(action, _fields(cls.role, limits)))

    @classmethod
    def read(cls, reader: ActionReader) -> ParticipantAction:
        """Decodes the fields of a reader; errors as in `decode`."""
        speech = _read_speech(reader)
        return cls(speech=speech) if speech is not None else _SILENCE


@dataclass(frozen=True, kw_only=True)
class Physical:
    """Physical action with its argument.

    Attributes:
        action: the action.
        angle: argument of JTurn and LaneSwitch [degrees, positive left].
        up: argument of SpeedChange (True: faster) and LightChange (True: on).
    """

    action: PhysicalAction
    angle: int = 0
    up: bool = True


@dataclass(frozen=True, kw_only=True)
class Mental:
    """Belief update.

    Attributes:
        action: kind of the update.
        plan: indices in `Town.junctions` (PlanUpdate).
        goals: landmarks (GoalUpdate).
        landmark: landmark of a StatusUpdate or KnowledgeUpdate.
        status: status of the landmark (StatusUpdate).
        place: estimated position of the landmark (KnowledgeUpdate).
    """

    action: MentalAction
    plan: tuple[int, ...] = ()
    goals: tuple[LandmarkName, ...] = ()
    landmark: LandmarkName = LandmarkName.UNKNOWN
    status: GoalStatus = GoalStatus.UNKNOWN
    place: LanePosition = field(default_factory=LanePosition)


@dataclass(frozen=True, kw_only=True)
class CoWizardAction:
    """Action of the Co-Wizard: speech, a physical action and a belief update in one decision."""

    role: ClassVar[Role] = Role.CO_WIZARD
    speech: Speech | None = None
    physical: Physical | None = None
    mental: Mental | None = None

    def encode(self, limits: SpaceLimits) -> ActionDict:
        """Returns the action dict; junctions of a plan beyond `limits.plan` are dropped."""
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
    def decode(cls, action: ActionMapping, limits: SpaceLimits) -> CoWizardAction:
        """Decodes an action dict; raises `ValueError` with the name of an invalid field."""
        return cls.read(ActionReader(action, _fields(cls.role, limits)))

    @classmethod
    def read(cls, reader: ActionReader) -> CoWizardAction:
        """Decodes the fields of a reader; errors as in `decode`."""
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
    """Action of the Ad-Wizard: an exception and a message to the participant.

    Attributes:
        exception: kind of the exception; NONE for no exception.
        weather: weather parameter to set.
        share: new value of the parameter as a share of its range, in [0, 1], in steps of 0.01.
        prop: kind of prop to place.
        item: row of the prop to move or delete, or index of the subgoal of a task exception.
        place: position of a prop, or centre of the square of a spawn.
        count: number of vehicles or pedestrians to spawn.
        extent: half the side of the square [m].
        sensor: sensor with the fault.
        on: whether the fault is switched on.
        message: message to the participant.
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
        """Returns the action dict."""
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
    def decode(cls, action: ActionMapping, limits: SpaceLimits) -> AdWizardAction:
        """Decodes an action dict; raises `ValueError` with the name of an invalid field."""
        return cls.read(ActionReader(action, _fields(cls.role, limits)))

    @classmethod
    def read(cls, reader: ActionReader) -> AdWizardAction:
        """Decodes the fields of a reader; errors as in `decode`."""
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
"""Shared instances of the actions that do nothing, which are by far the most frequent."""

RoleAction: TypeAlias = ParticipantAction | CoWizardAction | AdWizardAction

AnyAction: TypeAlias = ActionMapping | RoleAction
"""Action of a role as the engine takes it: an action dict, or a typed action, which need not be encoded."""

_IDLE: dict[Role, RoleAction] = {action.role: action for action in (_SILENCE, _INACTION, _INTACT)}
_IDLE_OF: dict[type, RoleAction] = {type(action): action for action in _IDLE.values()}

_CLASSES: dict[Role, type[ParticipantAction] | type[CoWizardAction] | type[AdWizardAction]] = {
    cls.role: cls for cls in (ParticipantAction, CoWizardAction, AdWizardAction)
}


@shared
class ActionDecoder:
    """Decoder of the actions of one role; all role-dependent look-ups are done once."""

    def __init__(self, role: Role, limits: SpaceLimits) -> None:
        """Looks up the field bounds of a role."""
        self.role, self._limits = role, limits
        self._class, self._idle = _CLASSES[role], _IDLE[role]
        self._fields, self._read = _fields(role, limits), _CLASSES[role].read

    def __call__(self, action: AnyAction) -> RoleAction:
        """Decodes an action dict; raises `ActionError` with the role and the name of an invalid field.

        A typed action gives what its action dict would give: values in the steps and bounds of the action space.
        """
        if type(action) is self._class:
            if action is self._idle or action == self._idle:
                return self._idle
            action = action.encode(self._limits)
        if type(action) is not dict and not isinstance(action, Mapping):
            raise ActionError(
                f"action of {self.role}: expected a dict of fields or a {self._class.__name__}, "
                f"got {type(action).__name__} {short_repr(action)}"
            )
        try:
            return self._read(ActionReader(action, self._fields))
        except ValueError as error:
            raise ActionError(f"action of {self.role}: {error}") from None


def encoded(action: AnyAction, limits: SpaceLimits) -> ActionMapping:
    """Returns the action dict of an action, which may be one already."""
    return action if isinstance(action, Mapping) else action.encode(limits)


def idle_action(role: Role) -> RoleAction:
    """Returns the typed action that does nothing."""
    return _IDLE[role]


def is_idle(action: AnyAction) -> bool:
    """Returns whether an action is typed and does nothing."""
    idle = _IDLE_OF.get(type(action))
    return idle is not None and (action is idle or action == idle)


def decode_action(role: Role, action: ActionMapping, limits: SpaceLimits) -> RoleAction:
    """Decodes the action dict of a role; raises `ActionError` with the role and the name of an invalid field."""
    return ActionDecoder(role, limits)(action)


def noop(role: Role, limits: SpaceLimits) -> ActionDict:
    """Returns the action dict that does nothing."""
    return _CLASSES[role]().encode(limits)


@lru_cache(maxsize=64)
def action_fields(role: Role, limits: SpaceLimits) -> tuple[FieldSpec, ...]:
    """Returns the specifications of the action fields of a role.

    Raises:
        ValueError: if the role has no actions.
    """
    if role not in _ACTION_FIELDS:
        raise ValueError(f"{role} has no actions")
    return _ACTION_FIELDS[role](limits)


def _participant_fields(limits: SpaceLimits) -> tuple[FieldSpec, ...]:
    return (
        choice("move", NO_MOVE + 1, meaning=f"id of the `DialogueMove`; {NO_MOVE} for silence"),
        flags("slots", len(LABELS), meaning="label vector of the slot values, in the order of `LABELS`"),
        text("utterance", UTTERANCE_LENGTH, meaning="words; empty to let the NLG word the act"),
        text("meaning", MEANING_LENGTH, meaning="propositions as JSON (`encode_meaning`), recorded; may be empty"),
        choice("onset", MAX_ONSET + 1, unit="0.01 s", meaning="time to the first word; 0 at once"),
        choice("pace", MAX_PACE + 1, unit="%", meaning="speaking rate relative to the environment's; 0 for 100"),
    )


def _co_wizard_fields(limits: SpaceLimits) -> tuple[FieldSpec, ...]:
    return (
        *_participant_fields(limits),
        choice("physical", len(PhysicalAction) + 1, meaning="id of the `PhysicalAction`; 0 for none"),
        choice("angle", 360, start=-180, unit="deg", meaning="argument of JTurn and LaneSwitch, positive left"),
        choice("up", 2, meaning="argument of SpeedChange (1: faster) and LightChange (1: on)"),
        choice("mental", len(MentalAction) + 1, meaning="id of the `MentalAction`; 0 for none"),
        choices(
            "plan", limits.junctions + 1, limits.plan, meaning="1 + index of the junctions of a PlanUpdate; 0 for none"
        ),
        flags("goals", len(LANDMARKS), meaning="landmarks of a GoalUpdate, by id"),
        choice("landmark", len(LANDMARKS), meaning="id of the `LandmarkName` of a StatusUpdate or KnowledgeUpdate"),
        choice("status", len(STATUSES), meaning="id of the `GoalStatus` of a StatusUpdate"),
        *_position_fields(limits),
    )


def _ad_wizard_fields(limits: SpaceLimits) -> tuple[FieldSpec, ...]:
    return (
        choice("exception", len(ExceptionKind), meaning="id of the `ExceptionKind`; 0 for none"),
        choice("weather", len(WEATHER), meaning="index of the `WeatherParameter` to set"),
        choice("share", PERCENT, unit="%", meaning="new value of the parameter, as a share of its range"),
        choice("prop", len(PROPS), meaning="index of the `PropKind` to place"),
        choice("item", max(limits.props, limits.subgoals), meaning="row of the prop or the subgoal to change"),
        *_position_fields(limits),
        choice("count", MAX_SPAWNED + 1, meaning="number of vehicles or pedestrians to spawn"),
        choice("extent", MAX_EXTENT + 1, unit="m", meaning="half the side of the square in which actors are spawned"),
        choice("sensor", len(SENSORS), meaning="index of the `Sensor` with the fault"),
        choice("on", 2, meaning="1 to switch the fault on, 0 to switch it off"),
        text("message", MESSAGE_LENGTH, meaning="message to the participant"),
    )


def _position_fields(limits: SpaceLimits) -> tuple[FieldSpec, ...]:
    return (
        choice("lane", limits.lanes, meaning="id of the lane of a position"),
        choice("metres", LANE_METRES, unit="m", meaning="distance of the position along the lane"),
    )


_ACTION_FIELDS: Mapping[Role, Callable[[SpaceLimits], tuple[FieldSpec, ...]]] = {
    Role.PARTICIPANT: _participant_fields,
    Role.CO_WIZARD: _co_wizard_fields,
    Role.AD_WIZARD: _ad_wizard_fields,
}


@lru_cache(maxsize=64)
def action_space(role: Role, limits: SpaceLimits) -> spaces.Dict:
    """Returns the action space of a role, built from `action_fields`; errors as there.

    The object is cached and shared: copy it before seeding.
    """
    return dict_space(action_fields(role, limits))


def _encode_speech(speech: Speech | None) -> ActionDict:
    slots = encode_slots(speech.act.slots) if speech else [0] * len(LABELS)
    return {
        "move": int(speech.act.move) if speech else NO_MOVE,
        "slots": np.array(slots, dtype=np.int8),
        "utterance": speech.text if speech else "",
        "meaning": encode_meaning(speech.meaning) if speech else "",
        "onset": min(round(100 * speech.onset), MAX_ONSET) if speech else 0,
        "pace": min(round(100 * speech.pace), MAX_PACE) if speech and speech.pace != 1.0 else 0,
    }


def _encode_place(place: LanePosition) -> ActionDict:
    return {"lane": place.lane, "metres": place.metres}


@lru_cache(maxsize=64)
def _fields(role: Role, limits: SpaceLimits) -> ActionFieldTable:
    return ActionFieldTable(action_space(role, limits), noop(role, limits))


def _read_speech(reader: ActionReader) -> Speech | None:
    move, slots, text = reader.integer("move"), reader.flags("slots"), reader.text("utterance")
    meaning, onset, pace = reader.text("meaning"), reader.integer("onset"), reader.integer("pace")
    if move == NO_MOVE:
        return None
    return Speech(
        act=_act(move, slots),
        text=text,
        meaning=find_meaning(meaning) or (),
        onset=onset / 100,
        pace=(pace or 100) / 100,
    )


@lru_cache(maxsize=4096)
def _act(move: int, slots: bytes) -> DialogueAct:
    return DialogueAct(move=DialogueMove(move), slots=decode_slots(slots))
