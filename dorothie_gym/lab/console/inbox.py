"""Commands of a person at a seat, in order, and the action of the role that carries out the next ones."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from dorothie_gym.errors import OntologyError
from dorothie_gym.lab.console import messages as m
from dorothie_gym.lab.console.messages import Command, MessageError
from dorothie_gym.lab.console.speech_input import TypedAct, typed_acts
from dorothie_gym.ontology.actions import MentalAction
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.spellings import (
    parse_goal_status,
    parse_landmark,
    parse_physical_action,
    parse_prop,
    parse_sensor,
    parse_weather_parameter,
)
from dorothie_gym.ontology.world_exceptions import ExceptionKind
from dorothie_gym.session.spaces.actions import (
    AdWizardAction,
    CoWizardAction,
    LanePosition,
    Mental,
    ParticipantAction,
    Physical,
    RoleAction,
    Speech,
)
from dorothie_gym.session.spaces.fields import MESSAGE_LENGTH, SpaceLimits, plain_text

if TYPE_CHECKING:
    from dorothie_gym.lab.console.lane_lookup import LaneLookup
    from dorothie_gym.session.spaces.observations import ObservationMapping

MOST_WAITING: Final = 24
"""Maximum number of commands of one kind that wait; more are refused."""


@dataclass(frozen=True, kw_only=True)
class TakenActions:
    """Action of a seat in one decision.

    Attributes:
        action: the action of the role.
        spoken: typed span whose speech begins in this decision; None if there is none.
        done: highest number of the executed commands; 0 for none.
    """

    action: RoleAction
    spoken: TypedAct | None = None
    done: int = 0


@dataclass
class _SpanQueue:
    """Typed spans that wait for their decision.

    A span continues the utterance that is being spoken, up to the number of spans that an utterance may have.
    """

    limit: int
    waiting: deque[tuple[int, TypedAct]] = field(default_factory=deque)
    in_utterance: int = 0

    def take(self, speaking: float) -> tuple[int, TypedAct] | None:
        """Returns the next span, if it can be spoken now; `speaking` is the rest of the role's utterance [s]."""
        if speaking <= 0.0:
            self.in_utterance = 0
        if not self.waiting or self.in_utterance >= self.limit:
            return None
        self.in_utterance += 1
        return self.waiting.popleft()


class SeatInbox:
    """Commands of one seat that wait for their decision.

    Args:
        role: role of the seat.
        limits: sizes of the spaces.
        places: nearest places on lanes, for clicks on the map.
    """

    def __init__(self, role: Role, limits: SpaceLimits, places: LaneLookup) -> None:
        self._role, self._limits, self._places = role, limits, places
        self._spans = _SpanQueue(limits.spans)
        self._physical: deque[tuple[int, Physical]] = deque()
        self._mental: deque[tuple[int, Mental]] = deque()
        self._exceptions: deque[tuple[int, AdWizardAction]] = deque()
        self._handlers = self._table()[role]

    def clear(self) -> None:
        """Drops the waiting commands."""
        for queue in self._queues():
            queue.clear()
        self._spans.in_utterance = 0

    def _queues(self) -> tuple[deque[tuple[int, Any]], ...]:
        return self._spans.waiting, self._physical, self._mental, self._exceptions

    def forget_numbers(self) -> None:
        """Keeps the commands that wait, without the numbers of a connection that has ended."""
        for queue in self._queues():
            waiting = [(0, entry) for _, entry in queue]
            queue.clear()
            queue.extend(waiting)

    def start_turn(self) -> None:
        """Delays the first span until the end of an utterance that a policy has begun in the role."""
        self._spans.in_utterance = self._limits.spans

    def put(self, command: Command, after: DialogueMove | None = None) -> None:
        """Appends a command.

        Args:
            command: the command.
            after: last move of the other speaker.

        Raises:
            MessageError: the seat has no such command, a label is unknown, or too many commands wait.
        """
        handler = self._handlers.get(type(command))
        if handler is None:
            raise MessageError(f"the seat of {self._role.value} has no command {type(command).__name__.lower()!r}")
        try:
            handler(command, after)
        except OntologyError as error:
            raise MessageError(str(error)) from None

    def take(self, observation: ObservationMapping) -> TakenActions:
        """Returns the action of the current decision: at most one span, one physical and one mental action.

        Args:
            observation: observation of the role at the decision.
        """
        if self._role is Role.AD_WIZARD:
            n, exception = self._exceptions.popleft() if self._exceptions else (0, AdWizardAction())
            return TakenActions(action=exception, done=n)
        span = self._spans.take(float(observation["speaking"][0]))
        n, typed = span if span is not None else (0, None)
        speech = None if typed is None else Speech(act=typed.act, text=typed.text)
        if self._role is Role.PARTICIPANT:
            return TakenActions(action=ParticipantAction(speech=speech), spoken=typed, done=n)
        k, physical = self._physical.popleft() if self._physical else (0, None)
        j, mental = self._mental.popleft() if self._mental else (0, None)
        action = CoWizardAction(speech=speech, physical=physical, mental=mental)
        return TakenActions(action=action, spoken=typed, done=max(n, k, j))

    # --- commands ---------------------------------------------------------------------------------------------------

    def _table(self) -> Mapping[Role, Mapping[type[Any], Callable[[Any, DialogueMove | None], None]]]:
        speech: _Handlers = {m.Say: self._say}
        return {
            Role.PARTICIPANT: speech,
            Role.CO_WIZARD: {
                **speech,
                m.Drive: self._drive,
                m.Plan: self._plan,
                m.Goal: self._goal,
                m.Status: self._status,
                m.Mark: self._mark,
                m.Other: self._other,
            },
            Role.AD_WIZARD: {
                m.Weather: self._weather,
                m.Prop: self._prop,
                m.Move: self._move,
                m.Remove: self._remove,
                m.Spawn: self._spawn,
                m.SensorFault: self._fault,
                m.Task: self._task,
                m.Message: self._message,
            },
        }

    def _say(self, command: m.Say, after: DialogueMove | None) -> None:
        for act in typed_acts(command, after):
            _append(self._spans.waiting, command.n, act)

    def _drive(self, command: m.Drive, after: DialogueMove | None) -> None:
        action = parse_physical_action(command.action)
        _append(self._physical, command.n, Physical(action=action, angle=command.angle, up=command.up))

    def _plan(self, command: m.Plan, after: DialogueMove | None) -> None:
        if any(junction >= self._limits.junctions for junction in command.junctions):
            raise MessageError(f"junctions are numbered below {self._limits.junctions}")
        if len(command.junctions) > self._limits.plan:
            raise MessageError(f"a plan has at most {self._limits.plan} junctions")
        mental = Mental(action=MentalAction.PLAN_UPDATE, plan=tuple(command.junctions))
        _append(self._mental, command.n, mental)

    def _goal(self, command: m.Goal, after: DialogueMove | None) -> None:
        goals = tuple(parse_landmark(label) for label in command.landmarks)
        _append(self._mental, command.n, Mental(action=MentalAction.GOAL_UPDATE, goals=goals))

    def _status(self, command: m.Status, after: DialogueMove | None) -> None:
        landmark, status = parse_landmark(command.landmark), parse_goal_status(command.status)
        mental = Mental(action=MentalAction.STATUS_UPDATE, landmark=landmark, status=status)
        _append(self._mental, command.n, mental)

    def _mark(self, command: m.Mark, after: DialogueMove | None) -> None:
        landmark = parse_landmark(command.landmark)
        mental = Mental(
            action=MentalAction.KNOWLEDGE_UPDATE, landmark=landmark, place=self._place(command.x, command.y)
        )
        _append(self._mental, command.n, mental)

    def _other(self, command: m.Other, after: DialogueMove | None) -> None:
        _append(self._mental, command.n, Mental(action=MentalAction.OTHER))

    def _weather(self, command: m.Weather, after: DialogueMove | None) -> None:
        parameter = parse_weather_parameter(command.parameter)
        action = AdWizardAction(exception=ExceptionKind.WEATHER, weather=parameter, share=round(command.share, 2))
        _append(self._exceptions, command.n, action)

    def _prop(self, command: m.Prop, after: DialogueMove | None) -> None:
        prop, place = parse_prop(command.prop), self._place(command.x, command.y)
        _append(self._exceptions, command.n, AdWizardAction(exception=ExceptionKind.PLACE_PROP, prop=prop, place=place))

    def _move(self, command: m.Move, after: DialogueMove | None) -> None:
        item, place = self._item(command.item), self._place(command.x, command.y)
        _append(self._exceptions, command.n, AdWizardAction(exception=ExceptionKind.MOVE_PROP, item=item, place=place))

    def _remove(self, command: m.Remove, after: DialogueMove | None) -> None:
        action = AdWizardAction(exception=ExceptionKind.DELETE_PROP, item=self._item(command.item))
        _append(self._exceptions, command.n, action)

    def _spawn(self, command: m.Spawn, after: DialogueMove | None) -> None:
        vehicles = command.what == "vehicles"
        action = AdWizardAction(
            exception=ExceptionKind.SPAWN_VEHICLES if vehicles else ExceptionKind.SPAWN_PEDESTRIANS,
            place=self._place(command.x, command.y),
            count=command.count,
            extent=command.extent,
        )
        _append(self._exceptions, command.n, action)

    def _fault(self, command: m.SensorFault, after: DialogueMove | None) -> None:
        sensor = parse_sensor(command.sensor)
        action = AdWizardAction(exception=ExceptionKind.SENSOR_FAULT, sensor=sensor, on=command.on)
        _append(self._exceptions, command.n, action)

    def _task(self, command: m.Task, after: DialogueMove | None) -> None:
        kinds = {
            "trigger": ExceptionKind.TASK_TRIGGER,
            "delete": ExceptionKind.TASK_DELETE,
            "change": ExceptionKind.TASK_CHANGE,
        }
        message = plain_text(command.message, MESSAGE_LENGTH)
        action = AdWizardAction(exception=kinds[command.change], item=self._item(command.item), message=message)
        _append(self._exceptions, command.n, action)

    def _message(self, command: m.Message, after: DialogueMove | None) -> None:
        message = plain_text(command.text, MESSAGE_LENGTH).strip()
        if not message:
            raise MessageError("the message holds no characters that can be shown")
        _append(self._exceptions, command.n, AdWizardAction(exception=ExceptionKind.MESSAGE, message=message))

    # --- arguments --------------------------------------------------------------------------------------------------

    def _place(self, x: float, y: float) -> LanePosition:
        place = self._places.place(x, y)
        if place is None:
            raise MessageError("that is too far from any road; choose a place on a road or beside it")
        return place

    def _item(self, item: int) -> int:
        most = max(self._limits.props, self._limits.subgoals)
        if item >= most:
            raise MessageError(f"rows are numbered below {most}")
        return item


_Handlers: TypeAlias = dict[type[Any], Callable[[Any, DialogueMove | None], None]]


def _append(queue: deque[tuple[int, Any]], n: int, entry: object) -> None:
    if len(queue) >= MOST_WAITING:
        raise MessageError("too many actions are waiting; wait until they are carried out")
    queue.append((n, entry))
