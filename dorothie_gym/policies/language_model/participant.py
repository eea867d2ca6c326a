"""The participant's interface to a language model: tasks, the route to the place it guides to, and its remarks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from dorothie_gym.maps.routing import LaneEntry
from dorothie_gym.ontology.roles import Role
from dorothie_gym.policies.language_model.answer_schema import AnswerSchema, ChoiceField, distinct
from dorothie_gym.policies.language_model.role_interface import (
    KEEP,
    NONE,
    Memory,
    RoleInterface,
    clock,
    look_lines,
    named_places,
    next_speech,
    section,
    street_here,
    street_name,
    talk_lines,
    thought_field,
    weather_words,
    with_heard,
    with_talk,
    words_fields,
)
from dorothie_gym.policies.language_model.sight_words import object_lines, object_name, sight_lines
from dorothie_gym.policies.participant.obstacles import obstacle_on_route
from dorothie_gym.policies.participant.view import ParticipantView
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.route_progress import RouteProgress, stopping_distance
from dorothie_gym.policies.route_state import RouteState
from dorothie_gym.policies.turn_lanes import next_turn
from dorothie_gym.session.spaces.actions import ActionDict, ParticipantAction
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.spaces.observations import ObservationMapping

ANNOUNCED = 70.0
"""Distance to a junction at which its turn is due to be announced [m]; a car at 40 km/h takes 6 s for it."""

NEAR = 60.0
"""Distance to the place, after the last step, at which the car can be instructed to slow down [m]."""

SAYING_STOP = 1.0
"""Time that it takes to say stop [s]."""

LONG_STANDSTILL = 8.0
"""Standstill that triggers a call [s]."""

OBSTACLE_SIGHT = 80.0
"""Distance at which an obstacle on the way is noticed, as by the scripted participant [m]."""

REPLAN_AFTER = 2
"""Decisions off the route after which another one is planned."""


@dataclass(frozen=True, kw_only=True)
class ParticipantMemory(Memory):
    """Memory of the participant.

    Attributes:
        guide: name of the place to which it guides the car; empty if there is none.
        route: route to that place, if there is one, and the roadblocks that it leads around.
        told: kind and lane of the step of the route that was last pointed out.
        tasks: last observed list of tasks, with their states.
        standing_since: time since which the car stands [s]; None if it drives.
        told_standing: whether the current standstill was pointed out.
    """

    guide: str = ""
    route: RouteState = RouteState()
    told: tuple[str, int] = ("", -1)
    tasks: tuple[str, ...] = ()
    standing_since: float | None = None
    told_standing: bool = False

    @property
    def progress(self) -> RouteProgress | None:
        """Progress on the way; None without one."""
        return self.route.progress


class ParticipantInterface(RoleInterface[ParticipantMemory]):
    """Interface of the participant."""

    role = Role.PARTICIPANT

    def begin(self, town: Town) -> ParticipantMemory:
        """Returns the memory before the first decision."""
        return ParticipantMemory(town=town)

    def attend(
        self, observation: ObservationMapping, memory: ParticipantMemory, delay: float
    ) -> tuple[ParticipantMemory, tuple[str, ...]]:
        """Follows the route, and detects events that trigger a call."""
        view = ParticipantView.read(observation, memory.town)
        memory = replace(memory, clock=memory.clock.ticked(view.time))
        memory = replace(memory, route=memory.route.with_progress(_followed(memory, view)))
        memory, said = with_heard(memory, observation, Role.CO_WIZARD, "driver")
        events = [f'The driver said: "{said}"'] if said else []
        if message := str(observation["message"]).strip():
            events.append(f'A message has arrived: "{message}"')
        tasks = tuple(task_lines(observation, view))
        if memory.tasks and tasks != memory.tasks:
            events.append("Your tasks have changed.")
        memory = replace(memory, tasks=tasks)
        for notice in (_notice_standstill, _notice_obstacle):
            memory, noticed = notice(memory, view)
            events += noticed
        memory, noticed = _notice_step(memory, view)
        return memory, (*events, *noticed)

    def prompt(
        self, observation: ObservationMapping, memory: ParticipantMemory, events: Sequence[str]
    ) -> tuple[str, AnswerSchema]:
        """Returns the prompt of a call and the schema of its answer."""
        view, town = ParticipantView.read(observation, memory.town), memory.town
        lines = [
            f"Time: {clock(view.time)}",
            f"Story: {str(observation['story']).strip()}",
            *section("Your tasks, in order", task_lines(observation, view)),
            f"Car: {view.speed * 3.6:.0f} km/h, on {street_here(observation, town, view.lane)}; "
            f"weather: {weather_words(observation)}; head lights {'on' if observation['lights'] else 'off'}",
            *sight_lines(observation),
            *section("In sight", object_lines(observation)),
            *section("Places", _place_lines(observation, view, town)),
            *section("Looks", look_lines(observation, town, view.landmarks)),
            f"You guide to: {memory.guide or 'no place'}",
        ]
        if memory.progress is not None:
            step = _next_step(memory, view)
            lines.append(f"Way there: {_left_words(memory.progress, view)}; {step[1]}" if step else "Way there: none")
        if memory.note:
            lines.append(f"Your note: {memory.note}")
        lines += section("Conversation, the latest last", talk_lines(memory.talk))
        lines += section("Just now", [f"- {event}" for event in events])
        return "\n".join(lines), _schema(observation, town)

    def accept(
        self, observation: ObservationMapping, memory: ParticipantMemory, answer: Mapping[str, str]
    ) -> tuple[ParticipantMemory, int]:
        """Processes words, and the place to guide to."""
        view = ParticipantView.read(observation, memory.town)
        memory = with_talk(memory, answer, view.time)
        label = answer["guide"]
        if label == KEEP:
            return memory, 0
        if label == NONE:
            return replace(memory, guide="", route=memory.route.with_progress(None)), 0
        place = named_places(observation, memory.town)[label].place
        progress = RouteProgress.plan(memory.town, view.place, place, memory.route.blocked)
        return replace(memory, guide=label, route=memory.route.with_progress(progress), told=("", -1)), 0

    def act(
        self, observation: ObservationMapping, memory: ParticipantMemory
    ) -> tuple[ActionDict, ParticipantMemory, int]:
        """Speaks the next span."""
        speech, memory = next_speech(observation, memory)
        return ParticipantAction(speech=speech).encode(self.limits), memory, 0


def _schema(observation: ObservationMapping, town: Town) -> AnswerSchema:
    say, note, again = words_fields()
    labels = distinct((KEEP, NONE, *named_places(observation, town)))
    guide = ChoiceField(
        name="guide",
        labels=labels,
        meaning="the place that you guide the car to; you see the way",
        listed=f"{KEEP}, {NONE}, or a place of the page",
    )
    return AnswerSchema(name="participant", fields=(thought_field(), guide, say, note, again))


def task_lines(observation: ObservationMapping, view: ParticipantView) -> list[str]:
    """Returns the live tasks with their state, a line each."""
    lines = []
    live = [goal for goal in view.subgoals if goal.live]
    for goal, text in zip(live, str(observation["tasks"]).split("\n"), strict=False):
        state = "done" if goal.reached else "can be done now" if goal.allowed else "later"
        mark = view.landmark(goal.landmark)
        where = "" if mark is None else f" (place: {mark.name.label} on {street_name(mark.street)})"
        lines.append(f"- {text}{where}: {state}")
    return lines


def _place_lines(observation: ObservationMapping, view: ParticipantView, town: Town) -> list[str]:
    x, y = view.position
    return [
        f"- {label}, on {street_name(mark.street)}, {pm.hypot(mark.x - x, mark.y - y):.0f} m away as the crow flies"
        for label, mark in named_places(observation, town).items()
    ]


# --- Route ------------------------------------------------------------------------------------------------------------


def _followed(memory: ParticipantMemory, view: ParticipantView) -> RouteProgress | None:
    """Returns the progress on the route, or a new route if the car has left the previous one."""
    progress = memory.progress
    if progress is None or view.turning:
        return progress
    progress = progress.followed(memory.town, view.lane, view.station)
    if progress.astray < REPLAN_AFTER:
        return progress
    return progress.replanned(memory.town, view.place, memory.route.blocked)


def _next_step(memory: ParticipantMemory, view: ParticipantView) -> tuple[tuple[str, int], str, bool] | None:
    """Returns identity, words and urgency of the next step of the route; None without a route."""
    progress, town = memory.progress, memory.town
    if progress is None or progress.route is None:
        return None
    crossing, manoeuvre = next_turn(progress, town, view.station), progress.next_manoeuvre(view.station)
    if manoeuvre is not None and (crossing is None or manoeuvre[1] < crossing.distance):
        entry, distance = manoeuvre
        if entry is LaneEntry.U_TURN:
            soon = distance < 3.0 * view.speed + 15.0
            return ("round", view.lane), f"next: turn round in {max(distance, 0.0):.0f} m", soon
        side = "left" if entry is LaneEntry.CHANGE_LEFT else "right"
        return ("lane", view.lane), f"next: change to the {side} lane", distance < ANNOUNCED
    if crossing is not None:
        onto = street_here(view.raw, town, crossing.exit.lane)
        way = "straight on" if crossing.direction.value == "straight" else crossing.direction.value
        words = f"next: {way} in {crossing.distance:.0f} m, onto {onto}"
        return ("turn", crossing.lane), words, crossing.distance < ANNOUNCED
    left = progress.left(view.station)
    room = stopping_distance(view.speed) + SAYING_STOP * view.speed
    if view.standing or left > NEAR:
        return ("ahead", view.lane), "the place is straight ahead", False
    if left <= room:
        return ("stop", view.lane), "say stop now", True
    return ("near", view.lane), "the place is near: say how far, or to slow down", True


def _left_words(progress: RouteProgress, view: ParticipantView) -> str:
    return f"{progress.left(view.station):.0f} m by the route"


def _notice_step(memory: ParticipantMemory, view: ParticipantView) -> tuple[ParticipantMemory, list[str]]:
    """Notices a step of the route that is due for announcement."""
    step = _next_step(memory, view)
    if step is None or not step[2] or step[0] == memory.told:
        return memory, []
    return replace(memory, told=step[0]), [f"On the way: {step[1]}"]


def _notice_obstacle(memory: ParticipantMemory, view: ParticipantView) -> tuple[ParticipantMemory, list[str]]:
    """Notices an obstacle in sight on the way, and plans another way around it."""
    progress = memory.progress
    if progress is None or view.turning:
        return memory, []
    found = obstacle_on_route(memory.town, view, progress, OBSTACLE_SIGHT)
    if found is None or memory.route.knows_roadblock(found[0]):
        return memory, []
    place, thing = found
    route = memory.route.with_roadblock(memory.town, place)
    another = progress.replanned(memory.town, view.place, route.blocked)
    words = f"The way is blocked, {thing.distance:.0f} m from here: {object_name(thing)}."
    if another.route is not None:
        words += " The way there now leads around it."
    return replace(memory, route=route.with_progress(another), told=("", -1)), [words]


def _notice_standstill(memory: ParticipantMemory, view: ParticipantView) -> tuple[ParticipantMemory, list[str]]:
    """Notices that the car has been standing for long."""
    since = (memory.standing_since if memory.standing_since is not None else view.time) if view.standing else None
    told, events = memory.told_standing and since is not None, []
    if since is not None and not told and view.time - since >= LONG_STANDSTILL:
        told = True
        events.append(f"The car has been standing for {LONG_STANDSTILL:.0f} s.")
    return replace(memory, standing_since=since, told_standing=told), events
