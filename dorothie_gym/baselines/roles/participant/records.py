"""Route records of the learned participant: the next step on the route, and the updates after its own remarks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.propositions import Predicate
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.slots import ActionValue, GoalStatus, Slot
from dorothie_gym.policies.participant.final_approach import about_to_arrive
from dorothie_gym.policies.participant.order_history import note_said
from dorothie_gym.policies.participant.route_steps import RouteStep, route_step
from dorothie_gym.policies.participant.turn_by_turn_guidance import note_step

if TYPE_CHECKING:
    from dorothie_gym.policies.participant.state import ParticipantState
    from dorothie_gym.policies.participant.view import ParticipantView
    from dorothie_gym.policies.speech import Remark


def next_step(records: ParticipantState, view: ParticipantView) -> RouteStep | None:
    """Returns the next step on the route; None without a route."""
    progress = records.route.progress
    return None if progress is None or progress.route is None else route_step(records, view)


# --- Own remarks ------------------------------------------------------------------------------------------------------

_NAMES_GOAL: Final = (DialogueMove.INSTRUCT, DialogueMove.REPLY_W, DialogueMove.CLARIFY)
_STEPS: Final = (ActionValue.J_TURN, ActionValue.U_TURN, ActionValue.LANE_SWITCH, ActionValue.LANE_FOLLOW)


def note_remark(records: ParticipantState, view: ParticipantView, remark: Remark) -> None:
    """Enters into the records what a remark of the participant announces, describes, requests or mentions."""
    note_said(records, view, remark)
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
        records.guidance = records.guidance.after_nudging(now, records.route.to_goal.left(view.station))
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
