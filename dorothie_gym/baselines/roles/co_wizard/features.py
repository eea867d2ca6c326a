"""Inputs of the network: the state of car, road, memory and talk, the places on the map, and the possible commands."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from dorothie_gym.baselines.roles.co_wizard.memory import CONFIG, ORDERS, STATUSES, VARIABLES, WorkingMemory
from dorothie_gym.baselines.roles.learned_role.encoding import (
    AWAY,
    TOPICS,
    age_scales,
    distance_scales,
    one_hot,
    seconds_since,
    time_scales,
)
from dorothie_gym.dialogue.realization_context import Direction
from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.slots import GoalStatus, ObjectClass
from dorothie_gym.policies.co_wizard.proposition_truth import believes, distance_to_goal, is_red_ahead
from dorothie_gym.policies.language_model.co_wizard_prompt import SHARED_NAMES
from dorothie_gym.policies.observation_parser import SeenLandmark, is_dark
from dorothie_gym.policies.route_progress import Choice, direction_of, find_exit, stopping_distance, streets_named
from dorothie_gym.policies.turn_lanes import junction_meant
from dorothie_gym.policies.view_range import Limit, camera_fault, limit_of, sight, suitable_speed
from dorothie_gym.sim.state.codes import Motion

if TYPE_CHECKING:
    from dorothie_gym.baselines.roles.learned_role.hearing import Utterance
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


def state_vector(
    memory: WorkingMemory, view: CoWizardView, step: RouteStep | None, utterances: Sequence[Utterance], *, queued: bool
) -> list[float]:
    """Returns the state of road, memory and talk.

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
    return distance_scales(metres, (1.0, 5.0, 25.0, 100.0))


def car_vector(memory: WorkingMemory, view: CoWizardView) -> list[float]:
    """Returns the state of the car; it does not change within a decision."""
    standing = None if memory.standstill.since is None else view.time - memory.standstill.since
    variances = CONFIG.gps_variance, CONFIG.lost_variance
    fault, limit = camera_fault(view.raw), limit_of(view.raw)
    hazard = HAZARDS.index(view.hazard) if view.hazard in HAZARDS else -1 if view.hazard is ObjectClass.UNLABELED else 5
    return [
        min(view.time, 60.0) / 60.0, float(view.time < 5.0), view.speed / 15.0, float(view.standing),
        view.cruise / 60.0, float(view.lights), *one_hot(int(view.motion), len(Motion)),
        *one_hot(hazard, len(HAZARDS) + 1),
        min(float(view.raw["hazard_distance"][0]), 60.0) / 60.0,
        *one_hot(-1 if view.manoeuvre is None else PHYSICAL.index(view.manoeuvre), len(PHYSICAL)),
        math.sin(math.radians(view.angle)), math.cos(math.radians(view.angle)), float(view.manoeuvring),
        *(time_scales(standing) if standing is not None else [0.0] * 4), float(standing is not None),
        min(standing or 0.0, 30.0) / 30.0, float((standing or 0.0) > 4.0), float((standing or 0.0) > 5.0),
        *one_hot(-1 if limit is None else tuple(Limit).index(limit), len(Limit)), float(is_dark(view.raw)),
        float(fault is not None), sight(view.raw) / 100.0, suitable_speed(sight(view.raw)) / 60.0,
        math.tanh(view.variance), *(float(view.variance > most) for most in variances),
        float(is_red_ahead(memory.town, view)),
    ]  # fmt: skip


def _road(memory: WorkingMemory, view: CoWizardView) -> list[float]:
    choice, meant = view.choice, junction_meant(memory.town, view.here, view.choice)
    directions = () if choice is None else tuple(direction_of(way) for way in choice.exits)
    ordered = ordered_exit(memory, view, meant)
    counts = [sum(thing.kind is kind for thing in view.objects) for kind in HAZARDS]
    props = [thing.distance for thing in view.objects if thing.kind is ObjectClass.STATIC]
    return [
        float(choice is not None),
        *_distance(choice.distance if choice is not None else AWAY),
        float(choice is not None and choice.distance < 24.0),
        float(choice is not None and choice.distance < 75.0),
        float(choice is not None and choice.distance < 85.0),
        float(choice is not None and choice.distance - stopping_distance(view.speed) < 8.0),
        *(float(direction in directions) for direction in Direction),
        len(directions) / 4.0,
        float(memory.town.lanes[view.lane].in_junction),
        float(meant is not None and meant.junction == memory.junction),
        float(memory.junction < 0),
        float(ordered is not None),
        float(choice is not None and choice.lane == memory.asked_lane),
        float(choice is not None and choice.junction == memory.junction_of_action),
        *(min(count, 8) / 8.0 for count in counts),
        *_distance(min(props, default=AWAY)),
    ]


def ordered_exit(memory: WorkingMemory, view: CoWizardView, choice: Choice | None) -> Exit | None:
    """Returns the exit of a junction that matches the turn in the memory, regardless of junctions to pass before."""
    order = ORDERS[memory.value("order")]
    if order is None or choice is None:
        return None
    direction = order if isinstance(order, Direction) else None
    return find_exit(memory.town, choice, direction, streets_named(view.raw["street_names"], memory.street))


def _route(memory: WorkingMemory, view: CoWizardView, step: RouteStep | None) -> list[float]:
    left, progress = memory.navigator.left(view), memory.navigator.route.progress
    target = memory.distance_to(memory.target, view)
    near = memory.distance_to(memory.navigator.goal, view)
    crossing = None if progress is None else progress.next_crossing(memory.town, view.station)
    here = crossing is not None and view.choice is not None and crossing.lane == view.choice.lane
    return [
        float(memory.navigator.arrives), *_distance(left), float(step is not None),
        float(step is not None and step.due),
        *one_hot(-1 if step is None else PHYSICAL.index(step.action), len(PHYSICAL)),
        *_distance(AWAY if step is None else step.distance), 0.0 if step is None else step.angle / 90.0,
        float(near is not None), *_distance(AWAY if near is None else near - stopping_distance(view.speed)),
        float(target is not None), *_stop_at(memory, view, target),
        float(progress is not None and progress.turns_round_first(memory.town, view.station)), float(here),
        float(crossing is not None and progress is not None and progress.changes_before(crossing)),
        *age_scales(view.time, memory.navigator.blocked_at), memory.navigator.route.misses / 3.0,
        float(progress is not None and progress.astray > 0),
    ]  # fmt: skip


def _stop_at(memory: WorkingMemory, view: CoWizardView, distance: float | None) -> list[float]:
    """Returns how far a place is beyond where the car would stop, now and a decision later."""
    if distance is None:
        return [0.0] * 6
    left = distance - stopping_distance(view.speed)
    later = left - max(view.speed, 1.0) * memory.clock.interval
    return [*_distance(left), float(left + later <= 0.4), float(distance < -2.0)]


def _remembered(memory: WorkingMemory, view: CoWizardView) -> list[float]:
    hot = [value for name, size in VARIABLES.items() for value in one_hot(memory.value(name), size)]
    ages = [value for at in memory.changed_at for value in age_scales(view.time, at)]
    left = distance_to_goal(memory.knowledge, view)
    fault = float(any(status is GoalStatus.COMPLETE for _, status in memory.statuses))
    return [
        *hot, *ages, float(memory.goal is not None), float(memory.goal_mark >= 0), float(memory.goal in SHARED_NAMES),
        *age_scales(view.time, memory.goal_at), float(left is not None and abs(left) < 2.0),
        float(left is not None and left < 120.0), float(left is not None and left < 70.0),
        float(bool(memory.statuses)), fault, float(bool(memory.updates)),
        *one_hot(-1 if memory.physical is None else PHYSICAL.index(memory.physical), len(PHYSICAL)),
        *age_scales(view.time, memory.physical_at),
    ]  # fmt: skip


def _talk(memory: WorkingMemory, view: CoWizardView, utterances: Sequence[Utterance], queued: bool) -> list[float]:
    said = dict(memory.said_at)
    ages = [math.exp(-seconds_since(view.time, said[topic]) / 10.0) if topic in said else 0.0 for topic in TOPICS]
    latest = utterances[0] if utterances and utterances[0].time >= view.time else None
    asked = None if latest is None else latest.asked
    found = None if asked is None else believes(memory.knowledge, view, asked)
    places = () if latest is None else latest.places
    on_map = [any(mark.name is name for mark in view.landmarks) for name in places]
    return [
        *ages, *age_scales(view.time, memory.heard_at), *age_scales(view.time, memory.spoke_at),
        *age_scales(view.time, memory.asked_at), float(memory.asked_at > memory.heard_at), float(queued),
        *(float(seconds_since(view.time, max(memory.asked_at, memory.heard_at)) > wait) for wait in _SILENCES),
        *(float(seconds_since(view.time, memory.spoke_at) > wait) for wait in (4.0, 8.0, 10.0, 20.0)),
        float(view.speaking > 0.0), float(view.other_speaking), float(memory.heard_at > -AWAY),
        float(found is True), float(found is False), float(asked is not None and found is None),
        float(bool(places) and places[0] is memory.goal), float(len(places) > 1 and places[1] is memory.goal),
        float(bool(on_map) and on_map[0]), float(len(on_map) > 1 and on_map[1]),
        float(bool(places) and places[0] in SHARED_NAMES),
    ]  # fmt: skip


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


def command_vectors(
    commands: Sequence[Physical | None], memory: WorkingMemory, view: CoWizardView, step: RouteStep | None
) -> list[list[float]]:
    """Returns a vector for each physical action that can be commanded, including "none"."""
    meant = junction_meant(memory.town, view.here, view.choice)
    way, ways = ordered_exit(memory, view, meant), () if meant is None else meant.exits
    names = {exit_.angle: direction_of(exit_) for exit_ in (*ways, *(() if view.choice is None else view.choice.exits))}
    return [_command(command, memory, view, step, way, names) for command in commands]


def _command(
    command: Physical | None,
    memory: WorkingMemory,
    view: CoWizardView,
    step: RouteStep | None,
    way: Exit | None,
    names: dict[int, Direction],
) -> list[float]:
    if command is None:
        return [1.0, *[0.0] * (COMMAND_SIZE - 1)]
    action, angle = command.action, command.angle
    turns = action is PhysicalAction.J_TURN
    direction = names.get(angle) if turns else None
    sideways = action is PhysicalAction.LANE_SWITCH
    on_route = step is not None and step.action is action and step.angle == angle
    prepared = view.manoeuvre is action and (not turns or abs(view.angle - angle) < 1.0)
    wanted, order = memory.value("manoeuvre"), ORDERS[memory.value("order")]
    asked = (action is PhysicalAction.U_TURN and wanted == 1) or (sideways and wanted == (2 if angle > 0 else 3))
    ordered = turns and way is not None and way.angle == angle
    return [
        0.0, *one_hot(PHYSICAL.index(action), len(PHYSICAL)), *(float(direction is one) for one in Direction),
        angle / 90.0, float(command.up), float(on_route), float(on_route and step is not None and step.due),
        float(prepared), float(asked), float(ordered), float(ordered and memory.value("skip") == 0),
        float(turns and direction is Direction.STRAIGHT and memory.value("skip") > 0),
        float(turns and direction is not None and direction is order),
        float(sideways and wanted == 1 and angle > 0),
        float(memory.physical is action) * math.exp(-seconds_since(view.time, memory.physical_at) / 2.0),
        math.tanh((10.0 + 5.0 * memory.value("speed") - view.cruise) / 5.0) * (1.0 if command.up else -1.0)
        * float(action is PhysicalAction.SPEED_CHANGE),
    ]  # fmt: skip


COMMAND_SIZE: Final = 1 + len(PHYSICAL) + len(Direction) + 13
"""Length of the vector of a command."""

PLACE_SIZE: Final = 34
"""Length of the vector of a place."""

STATE_SIZE: Final = 347
"""Length of `car_vector` and `state_vector` together."""
