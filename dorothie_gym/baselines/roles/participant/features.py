"""Inputs of the network: the state of car, road, route, tasks and dialogue, and the errands to choose from."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from dorothie_gym.baselines.roles.learned_role.encoding import (
    AWAY,
    TOPICS,
    age_scales,
    distance_scales,
    one_hot,
    seconds_since,
    time_scales,
)
from dorothie_gym.baselines.roles.participant.memory import NotedEvent, SessionMemory
from dorothie_gym.baselines.roles.participant.records import next_step
from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.maps.routing import router
from dorothie_gym.maps.town import LightColour
from dorothie_gym.maps.whereabouts import is_on_right
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.slots import ActionValue, LandmarkName, ObjectClass, StreetName
from dorothie_gym.policies.observation_parser import SeenSubgoal, is_dark, is_foggy, is_rainy, street_of
from dorothie_gym.policies.participant.final_approach import about_to_arrive, room_to_stop
from dorothie_gym.policies.participant.proposition_truth import believes, is_elsewhere
from dorothie_gym.policies.participant.route_steps import is_last_stretch
from dorothie_gym.policies.participant.stories import purpose_of_target
from dorothie_gym.policies.participant.target_hints import famous_nearby
from dorothie_gym.policies.route_progress import light_ahead, next_choice
from dorothie_gym.policies.turn_lanes import turn_lanes
from dorothie_gym.policies.view_range import camera_fault, sight, suitable_speed

if TYPE_CHECKING:
    from dorothie_gym.baselines.roles.learned_role.utterance_inputs import Utterance
    from dorothie_gym.policies.participant.view import ParticipantView

MAX_ERRANDS: Final = 12
"""Number of subgoals among which the target is chosen."""

STEPS: Final = ("turn", "lane", "round", "on")
_DIRECTIONS: Final = tuple(Direction)
_OBJECTS: Final = tuple(ObjectClass)
_WAITS: Final = (1.6, 4.0, 6.0, 9.0, 10.0, 40.0)
"""Durations of a standstill after which the scripted participant makes a remark [s]."""

_MOVES: Final = tuple(DialogueMove)
_ACTIONS: Final = (
    ActionValue.J_TURN,
    ActionValue.U_TURN,
    ActionValue.LANE_SWITCH,
    ActionValue.LANE_FOLLOW,
    ActionValue.STOP,
    ActionValue.START,
    ActionValue.SPEED_CHANGE,
)


def state_vector(memory: SessionMemory, view: ParticipantView, utterances: Sequence[Utterance]) -> list[float]:
    """Returns the state of car, road, route, tasks and dialogue.

    Args:
        memory: working memory.
        view: observation.
        utterances: last utterances of the car, the latest first.
    """
    return [
        *_car(memory, view),
        *_route(memory, view),
        *_stop(memory, view),
        *_tasks(memory, view),
        *_own_talk(memory, view),
        *_question(memory, view, utterances),
    ]


def _distance(metres: float) -> list[float]:
    """Returns a distance [m] on several scales."""
    return distance_scales(metres, (1.0, 5.0, 25.0, 100.0, 400.0))


def _car(memory: SessionMemory, view: ParticipantView) -> list[float]:
    records, now = memory.records, view.time
    motion = records.motion
    stands = motion.standstill(now)
    said = max(records.speech.last_end, records.conversation.heard_at)
    silent = min(stands, max(now - said, 0.0)) if view.standing else 0.0
    light = light_ahead(records.town, view.lane, view.station, now)
    suitable = suitable_speed(sight(view.raw))
    return [
        min(now, 60.0) / 60.0, float(now < 2.0), view.speed / 15.0,
        min(max(view.speed - motion.speed, -3.0), 3.0) / 3.0,
        float(view.standing), float(view.turning), *time_scales(stands if view.standing else AWAY),
        min(stands, 60.0) / 60.0,
        *(float(stands > wait) for wait in _WAITS), *(float(silent > wait) for wait in _WAITS),
        float(now < motion.excused_until), float(light is not None), float(light is LightColour.RED),
        float(light is LightColour.GREEN), float(bool(view.raw["lights"])), float(is_dark(view.raw)),
        float(is_foggy(view.raw)), float(is_rainy(view.raw)), float(camera_fault(view.raw) is not None),
        sight(view.raw) / 100.0, suitable / 60.0, float(view.speed > (suitable + 5.0) / 3.6),
        float(records.town.lanes[view.lane].in_junction),
        *(float(any(thing.kind is kind for thing in view.objects)) for kind in _OBJECTS),
    ]  # fmt: skip


def _route(memory: SessionMemory, view: ParticipantView) -> list[float]:
    records, now = memory.records, view.time
    progress, guidance, step = records.route.progress, records.guidance, next_step(records, view)
    if progress is None or step is None:
        return [0.0] * ROUTE_SIZE
    left = progress.left(view.station)
    config, key = records.config, guidance.step
    lane = step.junction.lane if step.junction is not None else -1
    run_up = progress.run_up()
    room = records.town.lanes[view.lane].length - view.station
    announced = key == step.key
    waited = now - max(guidance.step_at, records.conversation.heard_at)
    found = [
        1.0, float(guidance.guiding), *_distance(left), *one_hot(STEPS.index(step.key[0]), len(STEPS)),
        *one_hot(-1 if step.direction is None else _DIRECTIONS.index(step.direction), len(_DIRECTIONS)),
        *_distance(step.distance), float(step.distance < config.turn_distance),
        float(step.distance < config.turn_late_distance), min(step.distance / max(view.speed, 1.0), 30.0) / 10.0,
        float(lane in turn_lanes(records.town)), float(lane == view.lane),
        float(announced), float(key is not None), *one_hot(-1 if key is None else STEPS.index(key[0]), len(STEPS)),
        min(guidance.repeats, 3) / 3.0, *age_scales(now, guidance.step_at),
        float(waited > config.repeat_after), float(now - guidance.step_at < config.switch_time),
        float(progress.turns_round_on(view.lane)), float(run_up is not None),
        *_distance(run_up[0] if run_up is not None else AWAY), (run_up[1] if run_up is not None else 0) / 2.0,
        *_distance(room), progress.astray / 3.0, min(records.route.misses, 3) / 3.0, min(guidance.passes, 3) / 3.0,
        min(guidance.u_turns, 3) / 3.0, float(left > guidance.best + config.lost_detour),
        math.tanh((left - guidance.best) / 100.0) if math.isfinite(guidance.best) else 0.0,
        float(records.task.described and left < config.take_over_distance), float(left < config.take_over_distance),
        float(left < 120.0), float(left > 220.0), float(bool(records.route.blocked)),
    ]  # fmt: skip
    choice = next_choice(records.town, view.lane, view.station)
    directions = () if choice is None else tuple(way.type for way in choice.exits)
    found += [float(len(directions) > 2), float(choice is not None and lane == choice.lane)]
    onto = step.junction is not None and street_of(view.raw, records.town, step.junction.exit.lane)
    return [*found, float(onto not in (False, StreetName.UNKNOWN))]


ROUTE_SIZE: Final = 65
"""Length of the part of the state about the route."""


def _stop(memory: SessionMemory, view: ParticipantView) -> list[float]:
    records, now = memory.records, view.time
    progress = records.route.progress
    if progress is None or not is_last_stretch(records, view):
        return [0.0] * STOP_SIZE
    left, guidance, config = progress.left(view.station), records.guidance, records.config
    room, later = room_to_stop(records, view, left) if guidance.stop_text else (AWAY, AWAY)
    since = records.motion.standing_since
    goal = records.task.goal
    waited = 0.0
    if since is not None:
        waited = now - max(since, guidance.nudged_at, records.speech.last_end, records.conversation.heard_at)
    speed = max(view.speed, config.soon_speed)
    slow = view.speed < max(records.motion.speed, config.slow_speed)
    return [
        1.0, float(about_to_arrive(records, view)), *_distance(room), *_distance(later), float(room <= 0.0),
        float(room <= config.short_stop), float(room < -later), float(room < -config.late_stop), float(left > 0.0),
        *_distance(left), float(abs(left) <= config.arrived_within), float(left < config.stop_distance),
        float(left < 45.0), float(left > config.slow_distance), float(slow), float(view.speed > config.slow_speed),
        float(left > 3.5 * speed + 20.0), float(left > 3.0 * speed + 12.0), float(guidance.approach_announced),
        float(guidance.slowed_early), float(guidance.points_out), *age_scales(now, guidance.stopped_at),
        float(now - guidance.stopped_at > 5.0), *age_scales(now, guidance.nudged_at),
        float(now - guidance.nudged_at < config.nudge_time), min(guidance.nudges, 4) / 4.0,
        float(waited > config.ready_time), float(waited > 6.0), float(left < 5.0), float(left > 18.0),
        float(goal is not None and is_on_right(records.town, goal.lane, goal.x, goal.y)),
    ]  # fmt: skip


STOP_SIZE: Final = 49
"""Length of the part of the state about the stop at the target."""


def _tasks(memory: SessionMemory, view: ParticipantView) -> list[float]:
    records, now = memory.records, view.time
    task = records.task
    ages: list[float] = []
    for kind in NotedEvent:
        happened = memory.event(kind)
        ages += time_scales(AWAY if happened is None else now - happened[0])
    open_goals = [goal for goal in view.subgoals if goal.open]
    goal = task.goal
    purpose = purpose_of_target(records, view)
    silence = now - max(task.announced_at, records.speech.last_end)
    unheard = records.conversation.heard_at < task.announced_at
    finished = memory.event(NotedEvent.DONE)
    return [
        *ages, float(task.target is not None), float(task.announced), *age_scales(now, task.announced_at),
        float(task.described), float(task.target in task.put_off), min(len(open_goals), 5) / 5.0,
        float(any(other.index != task.target for other in open_goals)), float(bool(open_goals)),
        float(goal is not None and view.unique(goal)), float(goal is not None and goal.street is StreetName.UNKNOWN),
        float(goal is not None and famous_nearby(goal, view, records.config.near_landmark) is not None),
        float(math.isfinite(task.resume_at)), float(now >= task.resume_at), float(unheard),
        float(unheard and silence > records.config.unanswered_after),
        float(finished is not None and now - finished[0] < records.config.next_task_delay),
        float(finished is not None and now - finished[0] < 12.0 and view.standing),
        float(purpose is not None and purpose.action is not None), float(purpose is not None and bool(purpose.reason)),
    ]  # fmt: skip


def _own_talk(memory: SessionMemory, view: ParticipantView) -> list[float]:
    speech, now = memory.records.speech, view.time
    said = dict(memory.said_at)
    last = speech.last
    moves = one_hot(-1 if last is None else _MOVES.index(last.act.move), len(_MOVES))
    actions = [float(last is not None and action in last.act.slots) for action in _ACTIONS]
    return [
        *(math.exp(-seconds_since(now, said.get(topic, -AWAY)) / 10.0) for topic in TOPICS),
        *(float(topic in said) for topic in TOPICS), *moves, *actions,
        *age_scales(now, speech.last_end), *age_scales(now, memory.records.conversation.heard_at),
        *age_scales(now, memory.records.conversation.asked_at),
        float(now - memory.records.conversation.lights_at < 25.0), float(view.speaking > 0.0), view.speaking / 5.0,
        float(view.other_speaking), float(not speech.idle), len(speech.queue) / 3.0, float(now < speech.quiet_until),
    ]  # fmt: skip


STATE_SIZE: Final = 415
"""Length of `state_vector`."""


# --- Questions and statements of the car ------------------------------------------------------------------------------


def _question(memory: SessionMemory, view: ParticipantView, utterances: Sequence[Utterance]) -> list[float]:
    latest = utterances[0] if utterances and utterances[0].time >= view.time else None
    goal = memory.records.task.goal
    if latest is None:
        return [0.0] * QUESTION_SIZE
    true = answer_to(memory, view, latest)
    told = latest.heard.words.told
    holds = None if told is None else believes(memory.records, view, told)
    places = latest.places
    other = [name for name in places if goal is None or name is not goal.name]
    open_places = [_name_of(view, subgoal) for subgoal in view.subgoals if subgoal.open and subgoal.allowed]
    step, direction = next_step(memory.records, view), latest.heard.words.direction
    actions = {value for act in latest.heard.acts for value in act.slots if isinstance(value, ActionValue)}
    said = {value for item in memory.records.speech.said for value in item.act.slots}
    done = memory.records.task.finished[0]
    return [
        1.0, float(true is True), float(true is False), float(latest.asked is not None and true is None),
        float(holds is True), float(holds is False), float(goal is not None and goal.name in places),
        float(bool(other)),
        float(any(name in open_places for name in other)), float(bool(places) and places[0] in said),
        float(any(name in said for name in other)), float(done is not None and done in places),
        float(goal is not None and goal.street in latest.streets), float(bool(latest.streets)),
        float(step is not None and step.action in actions),
        float(step is not None and direction is not None and direction is step.direction),
        float(step is not None and direction is not None and direction is not step.direction),
        float(direction is not None and _said_other_side(memory, direction)),
    ]  # fmt: skip


QUESTION_SIZE: Final = 18
"""Length of the part of the state about the latest utterance of the car."""


def _name_of(view: ParticipantView, subgoal: SeenSubgoal) -> LandmarkName | None:
    landmark = view.landmark(subgoal.landmark)
    return None if landmark is None else landmark.name


def _said_other_side(memory: SessionMemory, direction: Direction) -> bool:
    """Returns whether the participant's last direction differs."""
    said = [item.wording.direction for item in memory.records.speech.said if item.wording.direction is not None]
    return bool(said) and said[-1] is not direction


def answer_to(memory: SessionMemory, view: ParticipantView, utterance: Utterance) -> bool | None:
    """Returns whether the answer to a question is yes; None for other questions, or without evidence."""
    asked, direction = utterance.asked, utterance.heard.words.direction
    if asked is None:
        return None
    plans = asked.predicate in (Predicate.WILL, Predicate.DOES)
    if plans and asked.get("direction") is None and direction is not None:
        action = asked.get("action")
        asked = Proposition.of(asked.predicate, negated=asked.negated, action=action, direction=direction)
    found = believes(memory.records, view, asked)
    if asked.predicate is Predicate.KNOWS and utterance.heard.words.asked is None:
        # a place alone: a check refers to the errand, another question to the position of the car
        checks = any(act.move is DialogueMove.CHECK for act in utterance.heard.acts)
        return found and (checks or not is_elsewhere(memory.records, view))
    return found


# --- Errands ----------------------------------------------------------------------------------------------------------


def errand_vectors(
    memory: SessionMemory, view: ParticipantView, utterances: Sequence[Utterance]
) -> tuple[list[list[float]], tuple[int, ...]]:
    """Returns a vector for each subgoal that may be reached now, and their numbers."""
    latest = utterances[0] if utterances and utterances[0].time >= view.time else None
    found = [one for one in view.subgoals if one.open and one.allowed and view.landmark(one.landmark) is not None]
    found = found[:MAX_ERRANDS]
    lengths = [_way_to(memory, view, one) for one in found]
    added = memory.event(NotedEvent.ADDED)
    vectors = []
    for one, length in zip(found, lengths, strict=True):
        name = _name_of(view, one)
        vectors.append(
            [
                1.0,
                float(one.index == memory.records.task.target),
                float(one.index in memory.records.task.put_off),
                *_distance(length),
                float(length <= min(lengths)),
                float(latest is not None and name in latest.places),
                float(added is not None and added[1] is name and view.time - added[0] < 1.0),
                one.index / MAX_ERRANDS,
            ]
        )
    return vectors, tuple(one.index for one in found)


ERRAND_SIZE: Final = 12
"""Length of the vector of an errand."""


def _way_to(memory: SessionMemory, view: ParticipantView, subgoal: SeenSubgoal) -> float:
    """Returns the length of the route to a subgoal [m]; infinite if there is none."""
    landmark = view.landmark(subgoal.landmark)
    if landmark is None:
        return math.inf
    route = router(memory.records.town).route(view.place, landmark.place, memory.records.route.blocked)
    return math.inf if route is None else route.length
