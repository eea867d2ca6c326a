"""Records of the learned participant about the way: the next step on the route, and what own remarks change in them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from dorothie_gym.dialogue.propositions import Predicate
from dorothie_gym.dialogue.realization_context import Direction
from dorothie_gym.maps.routing import LaneEntry
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.slots import ActionValue, GoalStatus, Slot
from dorothie_gym.policies.participant.arriving import about_to_arrive
from dorothie_gym.policies.participant.guidance import note_step
from dorothie_gym.policies.participant.state import ParticipantState, StepKey
from dorothie_gym.policies.participant.view import ParticipantView
from dorothie_gym.policies.route_progress import RouteJunction
from dorothie_gym.policies.speech import Remark
from dorothie_gym.policies.turn_lanes import next_turn, turn_lanes


@dataclass(frozen=True, kw_only=True)
class RouteStep:
    """Next step on the route to the target.

    Attributes:
        key: identity.
        distance: distance to it [m].
        action: action of the car that it asks for.
        direction: direction of a turn or lane switch; None for others.
        junction: junction of a turn; None for others.
    """

    key: StepKey
    distance: float
    action: ActionValue
    direction: Direction | None = None
    junction: RouteJunction | None = None


def is_last_stretch(records: ParticipantState, view: ParticipantView) -> bool:
    """Returns whether there is a route, and no junction or manoeuvre left on it before the target."""
    progress = records.route.progress
    if progress is None or progress.route is None:
        return False
    ahead = progress.next_crossing(records.town, view.station), progress.next_manoeuvre(view.station)
    return ahead == (None, None)


def next_step(records: ParticipantState, view: ParticipantView) -> RouteStep | None:
    """Returns the next step on the route; None without a route."""
    progress, town = records.route.progress, records.town
    if progress is None or progress.route is None:
        return None
    crossing, manoeuvre = next_turn(progress, town, view.station), progress.next_manoeuvre(view.station)
    nearer = manoeuvre is not None and (crossing is None or manoeuvre[1] < crossing.distance)
    if nearer and manoeuvre is not None and manoeuvre[0] is LaneEntry.U_TURN:
        return RouteStep(key=("round", 0, 0), distance=manoeuvre[1], action=ActionValue.U_TURN)
    switch = nearer and (crossing is None or _needs_switch(records, view, crossing))
    if crossing is not None and not switch:
        straight = crossing.direction is Direction.STRAIGHT
        return RouteStep(
            key=("turn", crossing.lane, crossing.exit.connector),
            distance=crossing.distance,
            action=ActionValue.LANE_FOLLOW if straight else ActionValue.J_TURN,
            direction=crossing.direction,
            junction=crossing,
        )
    if manoeuvre is not None and manoeuvre[0] is not LaneEntry.U_TURN:
        left = manoeuvre[0] is LaneEntry.CHANGE_LEFT
        return RouteStep(
            key=("lane", view.lane, int(left)),
            distance=manoeuvre[1],
            action=ActionValue.LANE_SWITCH,
            direction=Direction.LEFT if left else Direction.RIGHT,
        )
    left_over = progress.left(view.station)
    return RouteStep(key=("on", view.lane, 0), distance=left_over, action=ActionValue.LANE_FOLLOW)


def _needs_switch(records: ParticipantState, view: ParticipantView, crossing: RouteJunction) -> bool:
    """Returns whether the lane before a junction has to be asked for; "turn left" includes the way to a turn lane."""
    progress = records.route.to_goal
    if crossing.lane in turn_lanes(records.town):
        return crossing.direction is Direction.STRAIGHT
    return progress.needs_switch(records.town, view.lane, view.station, crossing)


# --- Own remarks ------------------------------------------------------------------------------------------------------

_NAMES_GOAL: Final = (DialogueMove.INSTRUCT, DialogueMove.REPLY_W, DialogueMove.CLARIFY)
_STEPS: Final = (ActionValue.J_TURN, ActionValue.U_TURN, ActionValue.LANE_SWITCH, ActionValue.LANE_FOLLOW)


def topic_of(remark: Remark) -> str:
    """Returns what a remark is about: its predicate or, without content, its move."""
    return str(remark.meaning[0].predicate) if remark.meaning else remark.act.move.label


def note_remark(records: ParticipantState, view: ParticipantView, remark: Remark) -> None:
    """Enters an own remark into records: what is announced, described, asked for, or mentioned by it."""
    act, now, goal = remark.act, view.time, records.task.goal
    actions, statuses = act.values(Slot.ACTION), act.values(Slot.STATUS)
    later = {GoalStatus.PENDING, GoalStatus.ABANDONED, GoalStatus.COMPLETE} & set(statuses)
    if goal is not None and act.move in _NAMES_GOAL and goal.name in act.values(Slot.LANDMARK) and not later:
        records.task = records.task.after_announcement(now)
    if act.move in _NAMES_GOAL and actions:
        _note_order(records, view, remark, actions)
    predicates = {said.predicate for said in remark.meaning}
    if remark.wording.topic == "where":
        records.task = records.task.after_describing()
    elif act.move is DialogueMove.EXPLAIN and remark.meaning:
        records.task = records.task.after_telling(remark.meaning[0])
    if remark.wording.topic == "here":
        records.guidance = records.guidance.after_stopping(now)
    if remark.wording.topic == "ahead":
        records.guidance = records.guidance.with_approach_announced(True)
    if predicates & {Predicate.STANDS, Predicate.BECAUSE} and act.move is DialogueMove.QUERY_W:
        records.conversation = records.conversation.after_asking_why(now)
    if Predicate.LIGHTS_ON in predicates or ActionValue.LIGHT_CHANGE in actions:
        records.conversation = records.conversation.after_mentioning_lights(now)


def _note_order(records: ParticipantState, view: ParticipantView, remark: Remark, actions: Sequence[object]) -> None:
    """Enters an order into records."""
    now, ends = view.time, about_to_arrive(records, view)
    if records.task.goal is not None and not records.task.announced:
        records.task = records.task.after_announcement(now)
    if ActionValue.STOP in actions:
        if ends:
            records.guidance = records.guidance.after_stopping(now)
        else:
            records.task = records.task.waiting_until(now + records.config.thinking_time)
    elif ActionValue.SPEED_CHANGE in actions:
        if ends:
            records.guidance = records.guidance.with_approach_announced(True)
        elif remark.wording.faster is False:
            records.guidance = records.guidance.after_slowing_early()
    elif ends and view.standing:
        since = records.motion.standing_since
        records.guidance = records.guidance.after_nudging(now, now if since is None else since)
    elif ends and remark.wording.distance is not None:
        records.guidance = records.guidance.with_approach_announced(True)
    elif ActionValue.START in actions:
        records.task = records.task.waiting_until(math.inf)
        note_step(records, view, ("on", view.lane, 0))
    elif set(actions) & set(_STEPS):
        step = next_step(records, view)
        if step is not None:
            note_step(
                records, view, step.key if step.action in actions or step.key[0] == "turn" else ("on", view.lane, 0)
            )
