"""The Ad-Wizard's interface to a language model: its prompt, and the changes of world and task that it can make."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.world_exceptions import ExceptionKind, PropKind, Sensor, WeatherParameter
from dorothie_gym.policies.language_model.answer_schema import AnswerSchema, ChoiceField, WordsField
from dorothie_gym.policies.language_model.role_interface import (
    NONE,
    Memory,
    RoleInterface,
    clock,
    edited_note,
    named_places,
    note_field,
    section,
    street_here,
    street_name,
    talk_lines,
    thought_field,
    weather_words,
    with_heard,
)
from dorothie_gym.policies.observation_parser import place_on_path, read_subgoals, scalar, weather
from dorothie_gym.policies.policy import replace
from dorothie_gym.session.spaces.actions import ActionDict, AdWizardAction, LanePosition
from dorothie_gym.session.spaces.observations import ObservationMapping, PropColumn
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town

AGAIN = ("60", "20", "30", "90", "120")
"""Times after which the model can request another call [s]."""

MESSAGE_LENGTH = 200
"""Longest message to the participant [characters]."""

PROPS_AHEAD = (60, 100)
"""Distances ahead on the car's path at which a prop can be placed, or actors spawned [m]."""

PROP_MARGINS = (30.0, 8.0)
"""Minimum distances of a prop from the start and the end of its lane, within which it is refused [m]."""

SAME_WEATHER = 0.02
"""Difference, as a share of the range of a parameter, below which the weather is so already."""

SPAWNED = 5
"""Number of vehicles or pedestrians that appear."""

EXTENT = 25
"""Half the side of the square in which they appear [m]."""

_WEATHERS: Mapping[str, tuple[WeatherParameter, float]] = {
    "fog": (WeatherParameter.FOG_DENSITY, 0.7),
    "no fog": (WeatherParameter.FOG_DENSITY, 0.02),
    "heavy rain": (WeatherParameter.PRECIPITATION, 0.8),
    "no rain": (WeatherParameter.PRECIPITATION, 0.0),
    "night": (WeatherParameter.SUN_ALTITUDE_ANGLE, 0.3),
    "day": (WeatherParameter.SUN_ALTITUDE_ANGLE, 0.75),
    "storm": (WeatherParameter.WIND_INTENSITY, 0.9),
    "little wind": (WeatherParameter.WIND_INTENSITY, 0.1),
}
"""Changes of the weather: the parameter, and its new value as a share of its range."""

_TASKS = {
    ExceptionKind.TASK_TRIGGER: ("can_trigger", "add the task", "trigger_messages"),
    ExceptionKind.TASK_DELETE: ("can_delete", "remove the task", "delete_messages"),
    ExceptionKind.TASK_CHANGE: ("can_change", "change the task", "change_messages"),
}


@dataclass(frozen=True, kw_only=True)
class AdWizardMemory(Memory):
    """Memory of the Ad-Wizard.

    Attributes:
        order: requested change; None if there is none.
        label: label of the change that was requested last.
        tasks: last observed state of the tasks.
    """

    order: AdWizardAction | None = None
    label: str = ""
    tasks: bytes = b""


class AdWizardInterface(RoleInterface[AdWizardMemory]):
    """Interface of the Ad-Wizard."""

    role = Role.AD_WIZARD
    patience = 12.0
    action_field = "change"

    def begin(self, town: Town) -> AdWizardMemory:
        """Returns the memory before the first decision."""
        return AdWizardMemory(town=town)

    def attend(
        self, observation: ObservationMapping, memory: AdWizardMemory, delay: float
    ) -> tuple[AdWizardMemory, tuple[str, ...]]:
        """Listens to both speakers; a change of the tasks, or a refusal of the last one, triggers a call."""
        memory = replace(memory, clock=memory.clock.ticked(scalar(observation, "time")))
        memory, _ = with_heard(memory, observation, Role.PARTICIPANT, "participant")
        memory, _ = with_heard(memory, observation, Role.CO_WIZARD, "driver")
        tasks = observation["subgoals"].tobytes()
        events = ["The tasks have changed, or one is done."] if memory.tasks and tasks != memory.tasks else []
        if reason := str(observation["refusal_reason"]):
            events.append(f'Your change "{memory.label}" was refused: {reason.partition(": ")[2]}.')
        return replace(memory, tasks=tasks), tuple(events)

    def prompt(
        self, observation: ObservationMapping, memory: AdWizardMemory, events: Sequence[str]
    ) -> tuple[str, AnswerSchema]:
        """Returns the prompt of a call and the schema of its answer."""
        town = memory.town
        options = exception_options(observation, town)
        lines = [
            f"Time: {clock(scalar(observation, 'time'))}",
            f"Story: {str(observation['story']).strip()}",
            *section("Tasks of the participant", _task_lines(observation)),
            f"Car: {3.6 * scalar(observation, 'speed'):.0f} km/h, on "
            f"{street_here(observation, town, int(observation['lane']))}; weather: {weather_words(observation)}",
            *section("Places", _place_lines(observation, town)),
            *section("Sensor faults", [f"- {name}" for name in _faults(observation)]),
        ]
        if memory.note:
            lines.append(f"Your note: {memory.note}")
        lines += section("Conversation, the latest last", talk_lines(memory.talk))
        lines += section("Just now", [f"- {event}" for event in events])
        lines.append(f"You can change: {', '.join(options)}")
        return "\n".join(lines), _schema(tuple(options))

    def accept(
        self, observation: ObservationMapping, memory: AdWizardMemory, answer: Mapping[str, str]
    ) -> tuple[AdWizardMemory, int]:
        """Processes the change, with its message."""
        now = scalar(observation, "time")
        memory = replace(memory, note=edited_note(memory.note, answer["note"]), again_at=now + float(answer["again"]))
        order = exception_options(observation, memory.town).get(answer["change"])
        if order is None:
            return memory, int(answer["change"] != NONE)
        if order.exception.is_task or order.exception is ExceptionKind.MESSAGE:
            order = replace(order, message=answer["message"] or order.message)
        return replace(memory, order=order, label=answer["change"]), 0

    def act(self, observation: ObservationMapping, memory: AdWizardMemory) -> tuple[ActionDict, AdWizardMemory, int]:
        """Makes the change."""
        action = AdWizardAction() if memory.order is None else memory.order
        return action.encode(self.limits), replace(memory, order=None), 0


def exception_options(observation: ObservationMapping, town: Town) -> dict[str, AdWizardAction | None]:
    """Returns the exceptions that the mask allows, with their arguments, by their labels; "none" first."""
    possible = observation["action_mask"]["exception"]
    options: dict[str, AdWizardAction | None] = {NONE: None}
    options["message"] = AdWizardAction(exception=ExceptionKind.MESSAGE)
    for words, (parameter, share) in _WEATHERS.items():
        now = (weather(observation, parameter) - parameter.low) / (parameter.high - parameter.low)
        if abs(now - share) < SAME_WEATHER:
            continue
        options[f"weather: {words}"] = AdWizardAction(exception=ExceptionKind.WEATHER, weather=parameter, share=share)
    for sensor, faulty in zip(Sensor, observation["sensors"], strict=True):
        word = "repair" if faulty else "break"
        options[f"{word} sensor {sensor}"] = AdWizardAction(
            exception=ExceptionKind.SENSOR_FAULT, sensor=sensor, on=not faulty
        )
    options |= _road_options(observation, town)
    options |= _task_options(observation)
    return {label: each for label, each in options.items() if each is None or possible[each.exception]}


def _road_options(observation: ObservationMapping, town: Town) -> dict[str, AdWizardAction]:
    """Returns the choices of objects to place on the road ahead, and of props to remove."""
    options: dict[str, AdWizardAction] = {}
    for ahead in PROPS_AHEAD:
        place = place_on_path(town, observation, float(ahead))
        if place is None or town.lanes[place[0]].in_junction:
            continue
        where, length = LanePosition(lane=place[0], metres=int(place[1])), town.lanes[place[0]].length
        fits = PROP_MARGINS[0] <= where.metres <= length - PROP_MARGINS[1]
        for kind in (PropKind.STREET_BARRIER, PropKind.CONSTRUCTION_CONE) if fits else ():
            options[f"put a {kind} {ahead} m ahead"] = AdWizardAction(
                exception=ExceptionKind.PLACE_PROP, prop=kind, place=where
            )
        for exception, what in (
            (ExceptionKind.SPAWN_VEHICLES, "vehicles"),
            (ExceptionKind.SPAWN_PEDESTRIANS, "pedestrians"),
        ):
            options[f"let {what} appear {ahead} m ahead"] = AdWizardAction(
                exception=exception, place=where, count=SPAWNED, extent=EXTENT
            )
    for row, prop in enumerate(observation["props"]):
        if prop[PropColumn.KIND] > 0:
            options[f"remove object {row + 1} from the road"] = AdWizardAction(
                exception=ExceptionKind.DELETE_PROP, item=row
            )
    return options


def _task_options(observation: ObservationMapping) -> dict[str, AdWizardAction]:
    """Returns the changes of the task, with the messages that the storyboard gives for them."""
    options: dict[str, AdWizardAction] = {}
    for kind, (flag, words, field) in _TASKS.items():
        messages = str(observation[field]).split("\n")
        for goal in read_subgoals(observation):
            if getattr(goal, flag):
                message = messages[goal.index] if goal.index < len(messages) else ""
                options[f"{words} {goal.index + 1}"] = AdWizardAction(exception=kind, item=goal.index, message=message)
    return options


def _schema(options: tuple[str, ...]) -> AnswerSchema:
    return AnswerSchema(
        name="ad_wizard",
        fields=(
            thought_field(),
            ChoiceField(
                name="change",
                labels=options,
                meaning="what you change now; none for nothing",
                listed='one of the choices under "You can change"',
            ),
            WordsField(
                name="message",
                length=MESSAGE_LENGTH,
                meaning="message to the participant, with a message or a change of the task; empty for the usual one",
            ),
            note_field(),
            ChoiceField(name="again", labels=AGAIN, meaning="ask me again after so many seconds if nothing happens"),
        ),
    )


def _task_lines(observation: ObservationMapping) -> list[str]:
    texts = str(observation["tasks"]).split("\n")
    lines = []
    for goal in read_subgoals(observation):
        if goal.index < len(texts) and texts[goal.index]:
            state = "not given yet" if not goal.live else "done" if goal.reached else "open"
            lines.append(f"- {goal.index + 1}: {texts[goal.index]}: {state}")
    return lines


def _place_lines(observation: ObservationMapping, town: Town) -> list[str]:
    x, y = (float(value) for value in observation["pose"][:2])
    lines = []
    for label, mark in named_places(observation, town).items():
        hidden = ", missing from the driver's map" if observation["hidden"][mark.row] else ""
        away = pm.hypot(mark.x - x, mark.y - y)
        lines.append(f"- {label}, on {street_name(mark.street)}, {away:.0f} m away as the crow flies{hidden}")
    return lines


def _faults(observation: ObservationMapping) -> list[str]:
    return [str(sensor) for sensor, faulty in zip(Sensor, observation["sensors"], strict=True) if faulty]
