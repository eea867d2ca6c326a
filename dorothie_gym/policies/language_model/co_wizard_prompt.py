"""The Co-Wizard's prompt: its observation in words, and the choices for its answer."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from functools import lru_cache
from types import MappingProxyType
from typing import TYPE_CHECKING

from dorothie_gym.maps.model import LinkType
from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.slots import GoalStatus, LandmarkName, ObjectClass, StreetName
from dorothie_gym.policies.language_model.answer_schema import AnswerSchema, ChoiceField, WordsField, distinct
from dorothie_gym.policies.language_model.driving_plan import AS_ASKED, PLAN_LENGTH
from dorothie_gym.policies.language_model.role_interface import (
    ALL_NAMES,
    KEEP,
    NONE,
    Line,
    clock,
    look_lines,
    named_places,
    section,
    street_here,
    street_name,
    talk_lines,
    thought_field,
    weather_words,
    words_fields,
)
from dorothie_gym.policies.language_model.sight_words import object_lines, sight_lines
from dorothie_gym.policies.route_progress import default_lane_place, direction_of, streets_named
from dorothie_gym.policies.town_tables import kept_with_town
from dorothie_gym.session.spaces.actions import Physical
from dorothie_gym.session.spaces.observations import ExitColumn
from dorothie_gym.sim.ego.limits import may_change_cruise
from dorothie_gym.sim.state.codes import Motion
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    from dorothie_gym.maps.routing import Place
    from dorothie_gym.maps.town import Town
    from dorothie_gym.policies.co_wizard.view import CoWizardView
    from dorothie_gym.policies.language_model.driving_plan import PlanPad
    from dorothie_gym.policies.language_model.navigator import Navigator, RouteStep

AHEAD = (5, 10, 20, 30, 50, 80)
"""Distances ahead at which a place can be marked [m]."""

MEASURED = 0.18
"""Variance of the position above which it is not measured, but estimated from speed and steering [m^2]."""

UNCERTAINTIES = (2, 5, 10, 20, 50)
"""Uncertainties of the position that prompts show [m]."""

PLAN_EXAMPLE = "left, then straight on at the next junction, then stop at the KFC"
"""Plan in words, as prompts show it."""

SHARED_NAMES = (LandmarkName.HOUSE, LandmarkName.PERSON)
"""Names of several places, some of which may be missing from the map."""

STRAIGHT_ANGLE = 180
"""Index of the angle 0 in the mask of angles."""

_MOTION = {
    Motion.DRIVING: "driving",
    Motion.STOPPED: "told to stop; it stays so until Start, LaneFollow or a manoeuvre",
    Motion.WAITING: "waiting at the end of its lane: choose a turn",
    Motion.HAZARD: "braking or standing because of what is ahead",
}
_SIDES = {LinkType.LANE_CHANGE_LEFT: (90, "left"), LinkType.LANE_CHANGE_RIGHT: (-90, "right")}


# --- Choices ----------------------------------------------------------------------------------------------------------


def drive_options(view: CoWizardView, town: Town) -> Mapping[str, Physical | None]:
    """Returns the physical actions that the mask allows, with their arguments, by their labels; "none" first."""
    possible, angles = view.raw["action_mask"]["physical"], view.raw["action_mask"]["angle"]
    turns: tuple[int, ...] = ()
    if possible[PhysicalAction.J_TURN]:
        turns = tuple(angle for angle in exit_angles(view) if angles[angle + STRAIGHT_ANGLE])
    sides = tuple(
        side
        for side, (angle, _) in _SIDES.items()
        if possible[PhysicalAction.LANE_SWITCH]
        and angles[angle + STRAIGHT_ANGLE]
        and town.neighbour(view.lane, side) is not None
    )
    steps = tuple(up for up in (True, False) if may_change_cruise(view.cruise, up))
    allowed = frozenset(action for action in PhysicalAction if possible[action])
    return _options(allowed, turns, sides, steps, view.lights)


@lru_cache(maxsize=1024)
def _options(
    allowed: frozenset[PhysicalAction],
    turns: tuple[int, ...],
    sides: tuple[LinkType, ...],
    steps: tuple[bool, ...],
    lights: bool,
) -> Mapping[str, Physical | None]:
    """Returns the physical actions of `drive_options`.

    Args:
        allowed: actions that the mask allows with some argument.
        turns: angles of the turns that it allows [degrees].
        sides: sides to which the car may change lanes.
        steps: changes of the cruise speed, up or down.
        lights: whether the head lights are on.
    """
    arguments: dict[PhysicalAction, dict[str, Physical]] = {
        PhysicalAction.J_TURN: {f"{angle}": Physical(action=PhysicalAction.J_TURN, angle=angle) for angle in turns},
        PhysicalAction.LANE_SWITCH: {
            _SIDES[side][1]: Physical(action=PhysicalAction.LANE_SWITCH, angle=_SIDES[side][0]) for side in sides
        },
        PhysicalAction.SPEED_CHANGE: {
            "up" if up else "down": Physical(action=PhysicalAction.SPEED_CHANGE, up=up) for up in steps
        },
        PhysicalAction.LIGHT_CHANGE: {
            "off" if lights else "on": Physical(action=PhysicalAction.LIGHT_CHANGE, up=not lights)
        },
    }
    options: dict[str, Physical | None] = {NONE: None}
    for action in PhysicalAction:
        if action in allowed:
            for argument, order in arguments.get(action, {"": Physical(action=action)}).items():
                options[f"{action.label} {argument}".strip()] = order
    return MappingProxyType(options)


def exit_angles(view: CoWizardView) -> tuple[int, ...]:
    """Returns the angles of the exits of the next junction [degrees, positive left], from left to right."""
    rows = view.raw["exits"].tolist()
    return tuple(sorted({int(row[ExitColumn.ANGLE]) for row in rows if row[ExitColumn.PRESENT] > 0}, reverse=True))


def goal_options(view: CoWizardView, town: Town) -> dict[str, tuple[LandmarkName, Place | None]]:
    """Returns name and place of each possible goal by its label: those on the map, and names without a place."""
    options: dict[str, tuple[LandmarkName, Place | None]] = {
        label: (mark.name, mark.place) for label, mark in named_places(view.raw, town).items()
    }
    on_map = {name for name, _ in options.values()}
    for name in ALL_NAMES:
        if name not in on_map:
            options[name.label] = name, None
        elif name in SHARED_NAMES:
            options[f"another {name.label}"] = name, None
    return options


_LISTED_GOALS = (
    f"{KEEP}, {NONE}, a place of the page, a name that is not on it ({', '.join(name.label for name in ALL_NAMES)}), "
    f"or another one ({', '.join(f'another {name.label}' for name in SHARED_NAMES)})"
)
_LISTED_MARKS = (
    f"{NONE}, here, {', '.join(f'{metres} m ahead' for metres in AHEAD)}, beside a place of the page (beside PLACE), "
    "or on a street of the town (on STREET)"
)


def mark_options(view: CoWizardView, town: Town) -> dict[str, Place]:
    """Returns the places that can be marked by their labels: ahead, beside places on the map, and on streets."""
    options = {"here": (view.lane, view.station)}
    options |= {f"{metres} m ahead": default_lane_place(town, view.here, float(metres)) for metres in AHEAD}
    options |= {f"beside {label}": mark.place for label, mark in named_places(view.raw, town).items()}
    names = sorted({int(value) for value in view.raw["street_names"]} - {StreetName.UNKNOWN.value})
    for street in (StreetName(value) for value in names):
        place = _middle_of(town, view, street)
        if place is not None:
            options[f"on {street_name(street)}"] = place
    return options


def _middle_of(town: Town, view: CoWizardView, street: StreetName) -> Place | None:
    """Returns the centre of the lane of a street that is nearest to the car as the crow flies."""
    x, y = view.position
    middles = _middles(town, streets_named(view.raw["street_names"], street))
    found = [(pm.hypot(middle[0] - x, middle[1] - y), lane) for lane, middle in middles]
    if not found:
        return None
    nearest = min(found)[1]
    return nearest, town.lanes[nearest].length / 2


@kept_with_town
def _middles(town: Town, streets: frozenset[int]) -> tuple[tuple[int, tuple[float, float]], ...]:
    """Returns the lanes of streets outside junctions, each with its centre [m]."""
    lanes = (lane for lane in town.lanes if lane.street in streets and not lane.in_junction)
    centres = ((lane.id, lane.position(lane.length / 2)) for lane in lanes)
    return tuple((lane, (float(centre[0]), float(centre[1]))) for lane, centre in centres)


def answer_schema(view: CoWizardView, town: Town) -> AnswerSchema:
    """Returns the schema of the answer to a prompt at this moment."""
    statuses = [status.label for status in GoalStatus if status is not GoalStatus.QUERIED]
    say, note, again = words_fields()
    return AnswerSchema(
        name="co_wizard",
        fields=(
            thought_field(),
            ChoiceField(
                name="drive",
                labels=tuple(drive_options(view, town)),
                meaning="what the car does now; none to go on as before",
                listed='one of the choices under "You can drive"',
            ),
            ChoiceField(
                name="goal",
                labels=distinct((KEEP, NONE, *goal_options(view, town))),
                meaning="the place that you drive to",
                listed=_LISTED_GOALS,
            ),
            ChoiceField(
                name="mark",
                labels=distinct((NONE, *mark_options(view, town))),
                meaning="where you suppose the goal if it is not on your map; you drive there and slow down near it",
                listed=_LISTED_MARKS,
            ),
            ChoiceField(name="status", labels=(KEEP, *statuses), meaning="status of the goal, for your records"),
            WordsField(
                name="plan",
                length=PLAN_LENGTH,
                meaning=f"the steps that you still mean to take, in order, such as: {PLAN_EXAMPLE}; {AS_ASKED}: those "
                f"that the passenger asked for last; {NONE}: no plan; empty: as before",
            ),
            say,
            note,
            again,
        ),
    )


# --- Words ------------------------------------------------------------------------------------------------------------


def prompt_text(
    view: CoWizardView,
    town: Town,
    navigator: Navigator,
    step: RouteStep | None,
    events: Sequence[str],
    *,
    goal: str,
    talk: Sequence[Line],
    note: str,
    mark: bool,
    visited: Collection[Place],
    plan: PlanPad,
) -> str:
    """Returns the user's part of the prompt.

    Args:
        view: observation of the Co-Wizard, with its action mask.
        town: the map.
        navigator: route to the goal.
        step: next step on it.
        events: events since the last call, in words.
        goal: name of the goal; empty if there is none.
        talk: the conversation.
        note: note of the model to itself.
        mark: whether the place of the goal is a mark.
        visited: places of the map at which the car has stopped.
        plan: steps that are still to be taken.
    """
    lines = [
        f"Time: {clock(view.time)}",
        f"Car: {_MOTION[view.motion]}; {view.speed * 3.6:.0f} km/h, cruise speed {view.cruise:.0f} km/h, "
        f"head lights {'on' if view.lights else 'off'}",
        f"Place: {street_here(view.raw, town, view.lane)}; weather: {weather_words(view.raw)}",
    ]
    lines += _position_lines(view)
    if view.hazard is not ObjectClass.UNLABELED:
        lines.append(f"Ahead: {view.hazard.label}, {float(view.raw['hazard_distance'][0]):.0f} m")
    if view.manoeuvre is not None:
        angle = f" {view.angle:.0f}" if view.manoeuvre is PhysicalAction.J_TURN else ""
        lines.append(f"Prepared: {view.manoeuvre.label}{angle}")
    lines += section("Exits of the next junction", _exit_lines(view, town))
    lines += sight_lines(view.raw)
    lines += section("In sight", object_lines(view.raw))
    lines += section("Places on your map", _place_lines(view, town, visited))
    lines += section("Looks of what is in view", look_lines(view.raw, town, view.landmarks_in_view))
    lines.append(_goal_line(view, navigator, goal, mark))
    if step is not None:
        lines.append(f"Route: {'now' if step.due else 'next'}: {step_words(step, view, town)}")
    lines += section("Your plan", plan.lines())
    if note:
        lines.append(f"Your note: {note}")
    lines += section("Conversation, the latest last", talk_lines(talk))
    lines += section("Just now", [f"- {event}" for event in events])
    lines.append(f"You can drive: {', '.join(drive_options(view, town))}")
    return "\n".join(lines)


def _position_lines(view: CoWizardView) -> list[str]:
    """Returns the line of a position that is not measured, as without satellite navigation; none for a measured one."""
    if view.variance <= MEASURED:
        return []
    deviation = math.sqrt(view.variance)
    within = next((metres for metres in UNCERTAINTIES if deviation <= metres), None)
    words = f"more than {UNCERTAINTIES[-1]} m" if within is None else f"up to {within} m"
    return [f"Position: only estimated, as satellite navigation is missing; it may be wrong by {words}"]


def _exit_lines(view: CoWizardView, town: Town) -> list[str]:
    lines, names = [], view.raw["street_names"]
    words = {} if view.choice is None else {way.angle: direction_of(way).value for way in view.choice.exits}
    rows = [row for row in view.raw["exits"] if row[ExitColumn.PRESENT] > 0]
    for row in sorted(rows, key=lambda row: -row[ExitColumn.ANGLE]):
        angle, street = int(row[ExitColumn.ANGLE]), int(row[ExitColumn.STREET])
        name = StreetName(int(names[street])) if 0 <= street < len(names) else StreetName.UNKNOWN
        way = words.get(angle) or _side(angle)
        lines.append(f"- JTurn {angle}: {way}, into {street_name(name)}, in {row[ExitColumn.DISTANCE]:.0f} m")
    return lines


def _side(angle: int) -> str:
    return "straight" if abs(angle) < 45 else "left" if angle > 0 else "right"


def _place_lines(view: CoWizardView, town: Town, visited: Collection[Place]) -> list[str]:
    (x, y), lines = view.position, []
    for label, mark in named_places(view.raw, town).items():
        away = pm.hypot(mark.x - x, mark.y - y)
        been = "; you have stopped there" if mark.place in visited else ""
        lines.append(f"- {label}, on {street_name(mark.street)}, {away:.0f} m away as the crow flies{been}")
    return lines


def _goal_line(view: CoWizardView, navigator: Navigator, goal: str, mark: bool) -> str:
    if not goal and not mark:
        return "Goal: none"
    name = goal or "an unknown place"
    if navigator.goal is None:
        return f"Goal: {name}, which is not on your map: the passenger has to show the way"
    left = navigator.left(view)
    where = "where you have marked it" if mark else "on your map"
    if not math.isfinite(left):
        return f"Goal: {name}, {where}; there is no route to it"
    if abs(left) <= 2.0 and view.standing:
        return f"Goal: {name}, {where}; you are there"
    return f"Goal: {name}, {where}; {left:.0f} m by the route"


def step_words(step: RouteStep, view: CoWizardView, town: Town) -> str:
    """Returns a step of the route in words, starting with the label of its action."""
    where = f"in {step.distance:.0f} m"
    if step.action is PhysicalAction.J_TURN:
        way = next((way for way in town.exits(step.place) if way.angle == step.angle), None)
        into = "" if way is None else f" ({direction_of(way).value}, into {street_here(view.raw, town, way.lane)})"
        return f"JTurn {step.angle}{into} {where}"
    if step.action is PhysicalAction.LANE_SWITCH:
        return f"LaneSwitch {'left' if step.angle > 0 else 'right'} {where}"
    if step.action is PhysicalAction.STOP:
        return f"Stop at the goal {where}"
    return f"{step.action.label} {where}"
