"""Inputs of the network: the state of car, road, memory and talk, the places on the map, and the possible commands."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.baselines.roles.co_wizard.memory import CONFIG, ORDERS, STATUSES, VARIABLES, WorkingMemory
from dorothie_gym.baselines.roles.learned_role.encoding import (
    AWAY,
    TOPICS,
    distance_scales,
    one_hot,
    seconds_since,
)
from dorothie_gym.baselines.roles.learned_role.input_layout import (
    AGE,
    DISTANCE,
    DISTANCE_SCALES,
    FADED,
    MISSING,
    NUMBER,
    TIME,
    Layout,
    choice,
)
from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.slots import GoalStatus, ObjectClass
from dorothie_gym.policies.co_wizard.proposition_truth import believes, distance_to_goal, is_red_ahead
from dorothie_gym.policies.language_model.co_wizard_prompt import SHARED_NAMES
from dorothie_gym.policies.observation_parser import SeenLandmark, is_dark
from dorothie_gym.policies.route_progress import Choice, direction_of, find_exit, stopping_distance, streets_named
from dorothie_gym.policies.turn_lanes import junction_meant
from dorothie_gym.policies.view_range import Limit, camera_fault, limit_of, sight, suitable_speed
from dorothie_gym.sim.state.codes import Motion
from dorothie_gym.support.compilation import compiled, fixed

if TYPE_CHECKING:
    from dorothie_gym.baselines.roles.learned_role.utterance_inputs import Utterance
    from dorothie_gym.maps.model import Exit
    from dorothie_gym.policies.co_wizard.view import CoWizardView
    from dorothie_gym.policies.language_model.navigator import RouteStep
    from dorothie_gym.session.spaces.actions import Physical

HAZARDS: Final = (
    ObjectClass.TRAFFIC_LIGHT,
    ObjectClass.VEHICLES,
    ObjectClass.PEDESTRIAN,
    ObjectClass.STATIC,
    ObjectClass.TRAFFIC_SIGN,
)
PHYSICAL: Final = tuple(PhysicalAction)
_SILENCES: Final = (4.0, 7.0, 8.0, 10.0)  # silences after which the scripted Co-Wizard asks [s]

MAX_PLACES: Final = 24
"""Number of places on the map among which the goal is chosen."""

MAX_COMMANDS: Final = 20
"""Number of physical actions among which is chosen, "none" included."""


def car_values(memory: WorkingMemory, view: CoWizardView) -> list[float]:
    """Returns the fields of the car, see `_CAR`; they do not change within a decision."""
    standing = MISSING if memory.standstill.since is None else view.time - memory.standstill.since
    long = 0.0 if memory.standstill.since is None else standing
    fault, limit = camera_fault(view.raw), limit_of(view.raw)
    hazard = HAZARDS.index(view.hazard) if view.hazard in HAZARDS else -1 if view.hazard is ObjectClass.UNLABELED else 5
    angle, variance, seen = math.radians(view.angle), view.variance, sight(view.raw)
    return [
        min(view.time, 60.0) / 60.0, view.time < 5.0, view.speed / 15.0, view.standing, view.cruise / 60.0, view.lights,
        int(view.motion), hazard, min(float(view.raw["hazard_distance"][0]), 60.0) / 60.0,
        -1 if view.manoeuvre is None else PHYSICAL.index(view.manoeuvre),
        math.sin(angle), math.cos(angle), view.manoeuvring,
        standing, memory.standstill.since is not None, min(long, 30.0) / 30.0, long > 4.0, long > 5.0,
        -1 if limit is None else _LIMITS.index(limit), is_dark(view.raw), fault is not None, seen / 100.0,
        suitable_speed(seen) / 60.0, math.tanh(variance), variance > CONFIG.gps_variance,
        variance > CONFIG.lost_variance, is_red_ahead(memory.town, view),
    ]  # fmt: skip


_LIMITS: Final = tuple(Limit)
_CAR: Final = (
    *[NUMBER] * 6,
    choice(len(Motion)),
    choice(len(HAZARDS) + 1),
    NUMBER,
    choice(len(PHYSICAL)),
    *[NUMBER] * 3,
    TIME,
    *[NUMBER] * 4,
    choice(len(Limit)),
    *[NUMBER] * 8,
)


def state_values(
    memory: WorkingMemory, view: CoWizardView, step: RouteStep | None, utterances: Sequence[Utterance], *, queued: bool
) -> list[float]:
    """Returns the fields of road, route, memory and talk, see `_ROAD`, `_ROUTE`, `_REMEMBERED` and `_TALK`.

    Args:
        memory: working memory.
        view: observation.
        step: next step on the navigator's route.
        utterances: last utterances of the participant, the latest first.
        queued: whether its remarks wait to be said.
    """
    return [
        *_road(memory, view),
        *_route(memory, view, step),
        *_remembered(memory, view),
        *_talk(memory, view, utterances, queued),
    ]


def _distance(metres: float) -> list[float]:
    """Returns a distance [m] on several scales."""
    return distance_scales(metres, DISTANCE_SCALES)


def _road(memory: WorkingMemory, view: CoWizardView) -> list[float]:
    ahead, meant = view.choice, junction_meant(memory.town, view.here, view.choice)
    directions = () if ahead is None else tuple(direction_of(way) for way in ahead.exits)
    ordered = ordered_exit(memory, view, meant)
    counts = dict.fromkeys(HAZARDS, 0)
    prop = AWAY
    for thing in view.objects:
        if thing.kind in counts:
            counts[thing.kind] += 1
        if thing.kind is ObjectClass.STATIC:
            prop = min(prop, thing.distance)
    distance = math.inf if ahead is None else ahead.distance
    return [
        ahead is not None, AWAY if ahead is None else distance, distance < 24.0, distance < 75.0, distance < 85.0,
        distance - stopping_distance(view.speed) < 8.0, *(direction in directions for direction in Direction),
        len(directions) / 4.0, memory.town.lanes[view.lane].in_junction,
        meant is not None and meant.junction == memory.junction, memory.junction < 0, ordered is not None,
        ahead is not None and ahead.lane == memory.asked_lane,
        ahead is not None and ahead.junction == memory.junction_of_action,
        *(min(count, 8) / 8.0 for count in counts.values()), prop,
    ]  # fmt: skip


_ROAD: Final = (
    NUMBER,
    DISTANCE,
    *[NUMBER] * 4,
    *[NUMBER] * len(Direction),
    *[NUMBER] * 7,
    *[NUMBER] * len(HAZARDS),
    DISTANCE,
)


def ordered_exit(memory: WorkingMemory, view: CoWizardView, choice: Choice | None) -> Exit | None:
    """Returns the exit of a junction that matches the turn in the memory, regardless of junctions to pass before."""
    order = ORDERS[memory.value("order")]
    if order is None or choice is None:
        return None
    direction = order if isinstance(order, Direction) else None
    return find_exit(memory.town, choice, direction, streets_named(view.raw["street_names"], memory.street))


def _route(memory: WorkingMemory, view: CoWizardView, step: RouteStep | None) -> list[float]:
    progress = memory.navigator.route.progress
    target, near = memory.distance_to(memory.target, view), memory.distance_to(memory.navigator.goal, view)
    stopping = stopping_distance(view.speed)
    crossing = None if progress is None else progress.next_crossing(memory.town, view.station)
    here = crossing is not None and view.choice is not None and crossing.lane == view.choice.lane
    stop = MISSING if target is None else target - stopping  # how far the place is beyond where the car would stop
    later = stop - max(view.speed, 1.0) * memory.clock.interval  # a decision later
    return [
        memory.navigator.arrives, memory.navigator.left(view), step is not None, step is not None and step.due,
        -1 if step is None else PHYSICAL.index(step.action), AWAY if step is None else step.distance,
        0.0 if step is None else step.angle / 90.0, near is not None, AWAY if near is None else near - stopping,
        target is not None, stop, stop + later <= 0.4, target is not None and target < -2.0,
        progress is not None and progress.turns_round_first(memory.town, view.station), here,
        crossing is not None and progress is not None and progress.changes_before(crossing),
        memory.navigator.blocked_at, memory.navigator.route.misses / 3.0, progress is not None and progress.astray > 0,
    ]  # fmt: skip


_ROUTE: Final = (
    NUMBER,
    DISTANCE,
    NUMBER,
    NUMBER,
    choice(len(PHYSICAL)),
    DISTANCE,
    NUMBER,
    NUMBER,
    DISTANCE,
    NUMBER,
    DISTANCE,
    *[NUMBER] * 5,
    AGE,
    NUMBER,
    NUMBER,
)


def _remembered(memory: WorkingMemory, view: CoWizardView) -> list[float]:
    left = distance_to_goal(memory.knowledge, view)
    far = math.inf if left is None else left
    return [
        *memory.values, *memory.changed_at, memory.goal is not None, memory.goal_mark >= 0, memory.goal in SHARED_NAMES,
        memory.goal_at, abs(far) < 2.0, far < 120.0, far < 70.0, bool(memory.statuses),
        any(status is GoalStatus.COMPLETE for _, status in memory.statuses), bool(memory.updates),
        -1 if memory.physical is None else PHYSICAL.index(memory.physical), memory.physical_at,
    ]  # fmt: skip


_REMEMBERED: Final = (
    *(choice(size) for size in VARIABLES.values()), *[AGE] * len(VARIABLES), *[NUMBER] * 3, AGE, *[NUMBER] * 6,
    choice(len(PHYSICAL)), AGE,
)  # fmt: skip


def _talk(memory: WorkingMemory, view: CoWizardView, utterances: Sequence[Utterance], queued: bool) -> list[float]:
    latest = utterances[0] if utterances and utterances[0].time >= view.time else None
    asked = None if latest is None else latest.asked
    found = None if asked is None else believes(memory.knowledge, view, asked)
    places = () if latest is None else latest.places
    on_map = [any(mark.name is name for mark in view.landmarks) for name in places[:2]]
    silence = seconds_since(view.time, max(memory.asked_at, memory.heard_at))
    mute = seconds_since(view.time, memory.spoke_at)
    return [
        *_said(memory.said_at), memory.heard_at, memory.spoke_at, memory.asked_at, memory.asked_at > memory.heard_at,
        queued, *(silence > wait for wait in _SILENCES), mute > 4.0, mute > 8.0, mute > 10.0, mute > 20.0,
        view.speaking > 0.0, view.other_speaking, memory.heard_at > -AWAY,
        found is True, found is False, asked is not None and found is None,
        bool(places) and places[0] is memory.goal, len(places) > 1 and places[1] is memory.goal,
        bool(on_map) and on_map[0], len(on_map) > 1 and on_map[1], bool(places) and places[0] in SHARED_NAMES,
    ]  # fmt: skip


@lru_cache(maxsize=256)
def _said(said_at: tuple[tuple[str, float], ...]) -> tuple[float, ...]:
    """Returns the time of the last remark about each topic [s]."""
    said = dict(said_at)
    return tuple(said.get(topic, MISSING) for topic in TOPICS)


_TALK: Final = (
    *[FADED] * len(TOPICS), AGE, AGE, AGE, NUMBER, NUMBER, *[NUMBER] * (len(_SILENCES) + 4), *[NUMBER] * 11,
)  # fmt: skip

STATE: Final = Layout((*_CAR, *_ROAD, *_ROUTE, *_REMEMBERED, *_TALK))
"""Layout of `car_values` and `state_values` together."""


# --- Places on the map ------------------------------------------------------------------------------------------------


def place_vectors(memory: WorkingMemory, view: CoWizardView, utterances: Sequence[Utterance]) -> list[list[float]]:
    """Returns a vector for each row of the landmarks up to `MAX_PLACES`; rows that are not in use are missing."""
    return [_place(mark, memory, view, utterances) for mark in view.landmarks if mark.row < MAX_PLACES]


def _place(
    mark: SeenLandmark, memory: WorkingMemory, view: CoWizardView, utterances: Sequence[Utterance]
) -> list[float]:
    x, y = view.position
    distance = math.hypot(mark.x - x, mark.y - y)
    alike = [other for other in view.landmarks if other.name is mark.name]
    free = [other for other in alike if other.place not in memory.ruled_out]
    latest = utterances[0] if utterances and utterances[0].time >= view.time else None
    status = dict(memory.statuses).get(mark.name)
    told: list[float] = []
    for k in range(2):
        heard = utterances[k] if k < len(utterances) and view.time - utterances[k].time < 20.0 else None
        places, streets = (heard.places, heard.streets) if heard is not None else ((), ())
        told += [
            float(mark.name in places),
            float(bool(places) and places[0] is mark.name),
            float(bool(places) and places[-1] is mark.name),
            float(mark.street in streets),
            float(bool(streets)),
            float(heard is not None and mark.name in heard.heard.words.dropped),
            float(heard is not None and mark.name in heard.heard.words.past),
            float(mark.name in places and mark.street in streets),
        ]
    return [
        *told, float(latest is not None), float(mark.row == memory.goal_mark), float(mark.name is memory.goal),
        float(mark.name is memory.former), float(mark.place in memory.ruled_out), float(mark.name in SHARED_NAMES),
        float(len(free) > 1), float(bool(free) and free[0] is mark),
        float(any(other.street in latest.streets for other in free) if latest is not None else False),
        *one_hot(STATUSES.index(status) if status in STATUSES else -1, len(STATUSES)), *_distance(distance),
        float(distance < 45.0),
    ]  # fmt: skip


# --- Commands ---------------------------------------------------------------------------------------------------------


def write_commands(
    commands: Sequence[Physical | None],
    memory: WorkingMemory,
    view: CoWizardView,
    step: RouteStep | None,
    options: NDArray[np.float32],
) -> None:
    """Writes a vector for each physical action that can be commanded, including "none".

    Args:
        commands: the actions.
        memory: memory after listening.
        view: observation.
        step: next step on the navigator's route.
        options: (k, `COMMAND_SIZE`) zeros, written.
    """
    meant = junction_meant(memory.town, view.here, view.choice)
    way, ways = ordered_exit(memory, view, meant), () if meant is None else meant.exits
    names = {exit_.angle: direction_of(exit_) for exit_ in (*ways, *(() if view.choice is None else view.choice.exits))}
    order = ORDERS[memory.value("order")]
    situation = _Situation(
        step_action=-1 if step is None else PHYSICAL.index(step.action),
        step_angle=0 if step is None else step.angle,
        step_due=step is not None and step.due,
        manoeuvre=-1 if view.manoeuvre is None else PHYSICAL.index(view.manoeuvre),
        manoeuvre_angle=view.angle,
        wanted=memory.value("manoeuvre"),
        order=_DIRECTIONS.index(order) if isinstance(order, Direction) else -1,
        skip=memory.value("skip"),
        way=way is not None,
        way_angle=0 if way is None else way.angle,
        former=-1 if memory.physical is None else PHYSICAL.index(memory.physical),
        former_since=seconds_since(view.time, memory.physical_at),
        speed_gap=10.0 + 5.0 * memory.value("speed") - view.cruise,
    )
    table = [
        _NO_COMMAND
        if command is None
        else (
            PHYSICAL.index(command.action),
            command.angle,
            command.up,
            _DIRECTIONS.index(names[command.angle])
            if command.action is PhysicalAction.J_TURN and command.angle in names
            else -1,
        )
        for command in commands
    ]
    _write_command_vectors(np.array(table, dtype=np.float64), _Situation(*map(float, situation)), options)


class _Situation(NamedTuple):
    """Numbers that the vectors of commands are compared with; -1 where there is no action or direction."""

    step_action: float
    step_angle: float
    step_due: float
    manoeuvre: float
    manoeuvre_angle: float
    wanted: float
    order: float
    skip: float
    way: float
    way_angle: float
    former: float
    former_since: float
    speed_gap: float


_DIRECTIONS: Final = tuple(Direction)
_NO_COMMAND: Final = (-1, 0, 0, -1)
_J_TURN, _U_TURN, _SIDEWAYS, _SPEED_CHANGE = (
    float(PHYSICAL.index(action))
    for action in (
        PhysicalAction.J_TURN, PhysicalAction.U_TURN, PhysicalAction.LANE_SWITCH, PhysicalAction.SPEED_CHANGE,
    )
)  # fmt: skip
_STRAIGHT: Final = float(_DIRECTIONS.index(Direction.STRAIGHT))
_ACTIONS, _WAYS = len(PHYSICAL), len(_DIRECTIONS)


@compiled
def write_command_vectors(commands: NDArray[np.float64], situation: _Situation, options: NDArray[np.float32]) -> None:
    """Writes the vectors of commands.

    Args:
        commands: (k, 4) action, angle [degrees], up, and direction of the exit; an action of -1 stands for "none".
        situation: what they are compared with.
        options: (k, `COMMAND_SIZE`) zeros, written.
    """
    for k in range(len(commands)):
        vector = options[k]
        action, angle, up, direction = commands[k, 0], commands[k, 1], commands[k, 2], commands[k, 3]
        if action < 0.0:
            vector[0] = 1.0
            continue
        turns, sideways, wanted = action == _J_TURN, action == _SIDEWAYS, situation.wanted
        vector[1 + int(action)] = 1.0
        if direction >= 0.0:
            vector[1 + _ACTIONS + int(direction)] = 1.0
        on_route = situation.step_action == action and situation.step_angle == angle
        ordered = turns and situation.way > 0.0 and situation.way_angle == angle
        asked = action == _U_TURN and wanted == 1.0
        asked = asked or (sideways and wanted == (2.0 if angle > 0.0 else 3.0))
        near = not turns or abs(situation.manoeuvre_angle - angle) < 1.0
        place = 1 + _ACTIONS + _WAYS
        vector[place] = angle / 90.0
        vector[place + 1] = up
        vector[place + 2] = 1.0 if on_route else 0.0
        vector[place + 3] = 1.0 if on_route and situation.step_due > 0.0 else 0.0
        vector[place + 4] = 1.0 if situation.manoeuvre == action and near else 0.0
        vector[place + 5] = 1.0 if asked else 0.0
        vector[place + 6] = 1.0 if ordered else 0.0
        vector[place + 7] = 1.0 if ordered and situation.skip == 0.0 else 0.0
        vector[place + 8] = 1.0 if direction == _STRAIGHT and situation.skip > 0.0 else 0.0
        vector[place + 9] = 1.0 if direction >= 0.0 and direction == situation.order else 0.0
        vector[place + 10] = 1.0 if sideways and wanted == 1.0 and angle > 0.0 else 0.0
        if situation.former == action:
            vector[place + 11] = math.exp(-situation.former_since / 2.0)
        if action == _SPEED_CHANGE:
            vector[place + 12] = math.tanh(situation.speed_gap / 5.0) * (1.0 if up > 0.0 else -1.0)


_write_command_vectors = fixed(write_command_vectors)

COMMAND_SIZE: Final = 1 + _ACTIONS + _WAYS + 13
"""Length of the vector of a command."""

PLACE_SIZE: Final = 34
"""Length of the vector of a place."""
