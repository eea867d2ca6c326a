"""The Co-Wizard's interface to a language model: times of calls, and effects of answers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from dorothie_gym.maps.routing import Place
from dorothie_gym.ontology.actions import MentalAction, PhysicalAction
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import GoalStatus, LandmarkName, ObjectClass
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.language_model.co_wizard_prompt import (
    PLAN_EXAMPLE,
    answer_schema,
    drive_options,
    goal_options,
    mark_options,
    prompt_text,
)
from dorothie_gym.policies.language_model.driving_plan import PlanPad, planned_junctions
from dorothie_gym.policies.language_model.navigator import Navigator, RouteStep
from dorothie_gym.policies.language_model.role_interface import (
    KEEP,
    NONE,
    Memory,
    RoleInterface,
    next_speech,
    with_heard,
    with_talk,
)
from dorothie_gym.policies.policy import replace
from dorothie_gym.session.spaces.actions import ActionDict, CoWizardAction, LanePosition, Mental, Physical
from dorothie_gym.sim.state.codes import Motion

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.policies.language_model.answer_schema import AnswerSchema
    from dorothie_gym.session.spaces.observations import ObservationMapping

REPEAT_AFTER = 3.0
"""Time after which a step that is still due is pointed out once more [s]."""

JUNCTION_DISTANCE = 40.0
"""Distance to a junction at which the model is called for its turn if none is prepared [m]."""

HELD_UP = 6.0
"""Standstill before a hazard, other than a red light, that triggers a call [s]."""

ARRIVED = 2.0
"""Distance to the goal at which a stationary car has arrived [m]."""

ORDER_LIFETIME = 4.0
"""Time for which an action is kept that is not possible yet [s]."""


@dataclass(frozen=True, kw_only=True)
class CoWizardMemory(Memory):
    """Memory of the Co-Wizard.

    Attributes:
        goal: place where the Co-Wizard is going; None if there is none.
        goal_name: name of the goal in prompts.
        marks: places that were marked on the map, by landmark.
        navigator: route to the goal.
        step: next step on the route; None without a route.
        drive: action to be carried out, with the time until which it is kept [s]; None if there is none.
        updates: belief updates to be sent, the next first.
        motion: state of motion at the last decision.
        standing_since: time since which the car stands [s]; None if it drives.
        told_held_up: whether the current standstill before a hazard was pointed out.
        told_step: step that was pointed out last, and when [s].
        told_junction: junction that was pointed out last.
        visited: goals at which the car has stopped.
        plan: steps that are still to be taken, and those that the passenger has asked for.
        unread: plan of the last answer that has no steps, in words; empty if there is none.
        sent_plan: junctions of the last `PlanUpdate`, as indices in `Town.junctions`.
    """

    goal: LandmarkName | None = None
    goal_name: str = ""
    marks: tuple[tuple[LandmarkName, Place], ...] = ()
    navigator: Navigator = Navigator()
    step: RouteStep | None = None
    drive: tuple[Physical, float] | None = None
    updates: tuple[Mental, ...] = ()
    motion: Motion = Motion.DRIVING
    standing_since: float | None = None
    told_held_up: bool = False
    told_step: tuple[tuple[int, int, int], float] = ((0, 0, 0), -math.inf)
    told_junction: int = -1
    visited: frozenset[Place] = frozenset()
    plan: PlanPad = PlanPad()
    unread: str = ""
    sent_plan: tuple[int, ...] = ()


class CoWizardInterface(RoleInterface[CoWizardMemory]):
    """Interface of the Co-Wizard."""

    role = Role.CO_WIZARD
    action_field = "drive"

    def begin(self, town: Town) -> CoWizardMemory:
        """Returns the memory before the first decision."""
        return CoWizardMemory(town=town)

    def attend(
        self, observation: ObservationMapping, memory: CoWizardMemory, delay: float
    ) -> tuple[CoWizardMemory, tuple[str, ...]]:
        """Follows the route, and detects events that trigger a call."""
        view = CoWizardView.read(observation, memory.town)
        memory = replace(memory, clock=memory.clock.ticked(view.time))
        navigator = memory.navigator.followed(memory.town, view)
        step = navigator.step(memory.town, view, memory.clock.interval, delay)
        found_block = navigator.blocked_at > memory.navigator.blocked_at
        memory = replace(memory, navigator=navigator, step=step, plan=memory.plan.followed(memory.town, view))
        memory, said = with_heard(memory, observation, Role.PARTICIPANT, "passenger")
        events = [f'The passenger said: "{said}"'] if said else []
        memory, noticed = _notice_plan(memory, said)
        events += noticed
        memory, noticed = _notice_motion(memory, view)
        events += noticed
        goal = navigator.goal
        if goal is not None and view.standing and abs(navigator.left(view)) <= ARRIVED and goal not in memory.visited:
            memory = replace(memory, visited=memory.visited | {goal})
        if found_block:
            events.append("The road ahead is blocked; the navigator has planned around it.")
        memory, noticed = _notice_way(memory, view)
        return _with_route_sent(replace(memory, motion=view.motion)), (*events, *noticed)

    def prompt(
        self, observation: ObservationMapping, memory: CoWizardMemory, events: Sequence[str]
    ) -> tuple[str, AnswerSchema]:
        """Returns the prompt of a call and the schema of its answer."""
        view = CoWizardView.read(observation, memory.town)
        text = prompt_text(
            view, memory.town, memory.navigator, memory.step, events, goal=memory.goal_name, talk=memory.talk,
            note=memory.note, mark=_mark(memory) is not None, visited=memory.visited, plan=memory.plan,
        )  # fmt: skip
        return text, answer_schema(view, memory.town)

    def accept(
        self, observation: ObservationMapping, memory: CoWizardMemory, answer: Mapping[str, str]
    ) -> tuple[CoWizardMemory, int]:
        """Processes goal, mark, status, words, and the action to carry out."""
        view = CoWizardView.read(observation, memory.town)
        memory = with_talk(memory, answer, view.time)
        memory = _with_goal(memory, view, answer["goal"])
        memory = _with_mark(memory, view, answer["mark"])
        memory = _with_status(memory, answer["status"])
        memory = _with_plan(memory, view, answer["plan"])
        chosen = drive_options(view, memory.town).get(answer["drive"])
        expired = answer["drive"] != NONE and chosen is None
        if chosen is not None:
            memory = replace(memory, drive=(chosen, view.time + ORDER_LIFETIME))
        return memory, int(expired)

    def act(self, observation: ObservationMapping, memory: CoWizardMemory) -> tuple[ActionDict, CoWizardMemory, int]:
        """Speaks the next span, sends the next belief update, and carries out the action."""
        speech, memory = next_speech(observation, memory)
        mental, physical, expired = None, None, 0
        if memory.updates:
            mental, memory = memory.updates[0], replace(memory, updates=memory.updates[1:])
        if memory.drive is not None:
            view = CoWizardView.read(observation, memory.town)
            order, until = memory.drive
            if order in drive_options(view, memory.town).values():
                physical, memory = order, replace(memory, drive=None)
            elif view.time > until:
                memory, expired = replace(memory, drive=None), 1
        action = CoWizardAction(speech=speech, physical=physical, mental=mental)
        return action.encode(self.limits), memory, expired


# --- Triggers of calls ------------------------------------------------------------------------------------------------


def _notice_motion(memory: CoWizardMemory, view: CoWizardView) -> tuple[CoWizardMemory, list[str]]:
    """Notices that the car has stopped, waits, or is held up."""
    events = []
    since = (memory.standing_since if memory.standing_since is not None else view.time) if view.standing else None
    held_up = since is not None and view.motion is Motion.HAZARD
    told = memory.told_held_up and held_up
    if view.motion is not memory.motion and view.motion is Motion.STOPPED:
        events.append("The car has been told to stop.")
    if view.motion is not memory.motion and view.motion is Motion.WAITING:
        events.append("The car waits at the end of its lane for a turn.")
    lights = view.hazard is ObjectClass.TRAFFIC_LIGHT
    if held_up and not told and not lights and since is not None and view.time - since >= HELD_UP:
        told = True
        events.append(f"The car has been standing for {HELD_UP:.0f} s because of what is ahead: {view.hazard.label}.")
    return replace(memory, standing_since=since, told_held_up=told), events


def _notice_way(memory: CoWizardMemory, view: CoWizardView) -> tuple[CoWizardMemory, list[str]]:
    """Notices a step of the route that is due, or a junction for which no turn is prepared."""
    step, options = memory.step, drive_options(view, memory.town)
    if step is not None and step.due and _order_of(step) in options.values():
        key, told_at = memory.told_step
        if key != step.key or view.time - told_at >= REPEAT_AFTER:
            return replace(memory, told_step=(step.key, view.time)), ["The step of the route is due now."]
    choice = view.choice
    near = choice is not None and choice.distance <= JUNCTION_DISTANCE
    prepared = view.manoeuvre is PhysicalAction.J_TURN or (memory.navigator.arrives and not _lost(memory))
    if choice is not None and near and not prepared and choice.junction != memory.told_junction:
        memory = replace(memory, told_junction=choice.junction)
        return memory, [f"A junction is {choice.distance:.0f} m ahead and no turn is prepared."]
    if choice is not None and not near and memory.told_junction != -1:
        memory = replace(memory, told_junction=-1)
    return memory, []


def _notice_plan(memory: CoWizardMemory, said: str) -> tuple[CoWizardMemory, list[str]]:
    """Notices directions of several steps, and a plan of the model that has none."""
    events = []
    if memory.unread:
        events.append(f'Your plan "{memory.unread}" has no steps; write them like "{PLAN_EXAMPLE}".')
        memory = replace(memory, unread="")
    if said:
        plan = memory.plan.heard(said)
        if plan is not memory.plan and plan.asked:
            events.append(f"In steps: {plan.asked_words()}")
        memory = replace(memory, plan=plan)
    return memory, events


def _lost(memory: CoWizardMemory) -> bool:
    return memory.step is None


def _order_of(step: RouteStep) -> Physical:
    return Physical(action=step.action, angle=step.angle)


# --- What an answer does ----------------------------------------------------------------------------------------------


def _mark(memory: CoWizardMemory) -> Place | None:
    """Returns the marked place of the goal; None if it has none."""
    return next((place for name, place in memory.marks if name is memory.goal), None)


def _with_goal(memory: CoWizardMemory, view: CoWizardView, label: str) -> CoWizardMemory:
    """Sets or clears the goal."""
    if label == KEEP:
        return memory
    if label == NONE:
        memory = replace(memory, goal=None, goal_name="", updates=(*memory.updates, _goal_update(())))
        return replace(memory, navigator=memory.navigator.to(memory.town, view, None), step=None)
    name, place = goal_options(view, memory.town)[label]
    memory = replace(memory, goal=name, goal_name=label, updates=(*memory.updates, _goal_update((name,))))
    marks = tuple(pair for pair in memory.marks if pair[0] is not name)  # a goal that is named again is not at its mark
    memory = replace(memory, marks=marks)
    return replace(memory, navigator=memory.navigator.to(memory.town, view, place), step=None)


def _with_mark(memory: CoWizardMemory, view: CoWizardView, label: str) -> CoWizardMemory:
    """Marks the assumed place of the goal; the car drives there, and slows down near it."""
    if label == NONE:
        return memory
    place = mark_options(view, memory.town)[label]
    name = memory.goal if memory.goal is not None else LandmarkName.UNKNOWN
    where = LanePosition(lane=place[0], metres=int(place[1]))
    mark = Mental(action=MentalAction.KNOWLEDGE_UPDATE, landmark=name, place=where)
    marks = (*(pair for pair in memory.marks if pair[0] is not name), (name, place))
    navigator = memory.navigator.to(memory.town, view, place)
    updates = (*memory.updates, mark, _goal_update((name,)))
    return replace(memory, goal=name, marks=marks, updates=updates, navigator=navigator, step=None)


def _with_status(memory: CoWizardMemory, label: str) -> CoWizardMemory:
    """Sends the status of the goal."""
    if label == KEEP or memory.goal is None:
        return memory
    status = next(status for status in GoalStatus if status.label == label)
    update = Mental(action=MentalAction.STATUS_UPDATE, landmark=memory.goal, status=status)
    return replace(memory, updates=(*memory.updates, update))


def _with_plan(memory: CoWizardMemory, view: CoWizardView, words: str) -> CoWizardMemory:
    """Sets or drops the plan; no words, or "keep", leave it as it is."""
    if words in ("", KEEP):
        return memory
    if words == NONE:
        return replace(memory, plan=replace(memory.plan, steps=()))
    plan = memory.plan.written(words)
    if plan is None:
        return replace(memory, unread=words)
    memory = replace(memory, plan=plan)
    return _with_junctions_sent(memory, planned_junctions(memory.town, view.here, plan.steps))


def _with_route_sent(memory: CoWizardMemory) -> CoWizardMemory:
    """Sends the junctions of the route if it has changed and there is no plan of the model."""
    progress = memory.navigator.route.progress
    if progress is None or progress.route is None or memory.plan.steps:
        return memory
    return _with_junctions_sent(memory, progress.route.junctions(memory.town))


def _with_junctions_sent(memory: CoWizardMemory, junctions: Sequence[int]) -> CoWizardMemory:
    """Sends a `PlanUpdate` unless it was sent already; an earlier one that waits is dropped.

    Args:
        memory: the memory.
        junctions: ids of the junctions in order.
    """
    numbers = memory.town.junction_indices
    plan = tuple(numbers[junction] for junction in junctions if junction in numbers)
    if not plan or plan == memory.sent_plan:
        return memory
    update = Mental(action=MentalAction.PLAN_UPDATE, plan=plan)
    waiting = tuple(each for each in memory.updates if each.action is not MentalAction.PLAN_UPDATE)
    return replace(memory, updates=(*waiting, update), sent_plan=plan)


def _goal_update(goals: tuple[LandmarkName, ...]) -> Mental:
    return Mental(action=MentalAction.GOAL_UPDATE, goals=goals)
