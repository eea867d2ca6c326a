"""Corrections of a car that is about to go wrong: another side, another lane, or too fast to turn."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.slots import ActionValue, Slot
from dorothie_gym.policies.feasibility import slowing_distance
from dorothie_gym.policies.mood import Happening
from dorothie_gym.policies.participant.final_approach import BRAKING
from dorothie_gym.policies.participant.order_wording import order
from dorothie_gym.policies.participant.route_steps import RouteStep, route_step
from dorothie_gym.policies.route_progress import lanes_beside
from dorothie_gym.policies.turn_lanes import turn_lanes

if TYPE_CHECKING:
    from dorothie_gym.dialogue.nlu import ParsedText
    from dorothie_gym.ontology.dialogue_acts import DialogueAct
    from dorothie_gym.policies.participant.state import ParticipantState
    from dorothie_gym.policies.participant.view import ParticipantView

_NEAR: Final = 90.0  # distance to a turn within which an announcement of the car is about it [m]
_LANE: Final = (30.0, 70.0)  # distances to a turn between which a wrong lane is pointed out [m]
_TIME: Final = 6.0  # time since the last order within which the car may still be about to obey it [s]
_OBEYING: Final = 4.0  # time that the car has after an order before it is corrected [s]
_TURNING: Final = 7.0  # speed at which a car still turns without haste [m/s]
_SIDEWAYS: Final = frozenset({Direction.LEFT, Direction.RIGHT})


def correct_early(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    """Corrects a guided car that is in another lane than its turn, or drives towards it without slowing down."""
    step = _turn_ahead(state, view)
    if step is None or view.standing or view.turning or view.other_speaking:
        return
    if not state.speech.idle or view.speaking > 0.0 or state.guidance.corrected == step.key:
        return
    ordered = max(state.guidance.step_at, state.speech.last_end)
    settled = view.time - max(ordered, state.conversation.heard_at) > _TIME
    lane = _missing_lane(state, view, step)
    if lane is not None and settled:
        wording, action = Wording(topic="early_lane", direction=lane), ActionValue.LANE_SWITCH
    elif view.time - ordered > _OBEYING and _is_too_fast(state, view, step) and rng.random() < state.style.corrects:
        wording, action = Wording(topic="early_turn", direction=step.direction), ActionValue.J_TURN
    else:
        return
    state.guidance = state.guidance.after_correcting(step.key)
    state.say(order(DialogueMove.CLARIFY, action, wording, urgent=True))


def contradicts_turn(state: ParticipantState, view: ParticipantView, act: DialogueAct, words: ParsedText) -> bool:
    """Corrects a guided car that announces a turn to another side than the next one; returns whether it did."""
    step = _turn_ahead(state, view)
    announced = ActionValue.J_TURN in act.values(Slot.ACTION) and words.direction in _SIDEWAYS
    if step is None or not announced or step.distance > _NEAR or words.direction is step.direction:
        return False
    state.feel(Happening.MISUNDERSTOOD, view.time)
    state.guidance = state.guidance.after_correcting(step.key)
    wording = Wording(topic="early_side", direction=step.direction)
    state.say_only(order(DialogueMove.CLARIFY, ActionValue.J_TURN, wording, urgent=True))
    return True


def _turn_ahead(state: ParticipantState, view: ParticipantView) -> RouteStep | None:
    """Returns the turn to the left or right to which the car is guided next; None for another step."""
    progress = state.route.progress
    if not state.guidance.guiding or progress is None or progress.astray:
        return None
    step = route_step(state, view)
    return step if step is not None and step.key[0] == "turn" and step.direction in _SIDEWAYS else None


def _missing_lane(state: ParticipantState, view: ParticipantView, step: RouteStep) -> Direction | None:
    """Returns the side on which the turn lane is, if the car is beside it; None if it is on it, or if it has none."""
    lane = step.key[1]
    told = state.guidance.step == step.key or step.key in state.guidance.way
    if not told or lane == view.lane or lane not in turn_lanes(state.town) or not _LANE[0] < step.distance < _LANE[1]:
        return None
    return step.direction if lane in lanes_beside(state.town, view.lane) else None


def _is_too_fast(state: ParticipantState, view: ParticipantView, step: RouteStep) -> bool:
    """Returns whether a car that was told of a turn neither brakes nor can do so later."""
    told = state.guidance.step == step.key
    brakes = view.speed < state.motion.speed - BRAKING
    return told and not brakes and slowing_distance(view.speed, _TURNING**2) > step.distance
