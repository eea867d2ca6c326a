"""Directions given in advance over several junctions: time, parts still open, and confirmation by the car."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

import numpy as np

from dorothie_gym.dialogue.intentions import CommunicativeFunction as Function
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.dialogue.routes import StepAction
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.slots import Slot
from dorothie_gym.policies import act_builders
from dorothie_gym.policies.mood import Happening
from dorothie_gym.policies.participant.approach_end import ending_behind
from dorothie_gym.policies.participant.route_description import WayStep, way_ahead, way_behind_u_turn, way_remarks
from dorothie_gym.policies.persona import Directions
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.scripted_agent_limits import reach_at
from dorothie_gym.policies.speech import Remark, intend, repeated

if TYPE_CHECKING:
    from dorothie_gym.dialogue.routes import DrivingPlan
    from dorothie_gym.policies.heard_utterance import HeardUtterance
    from dorothie_gym.policies.participant.state import ParticipantState, StepKey
    from dorothie_gym.policies.participant.view import ParticipantView

EARLY: Final = 240.0
"""Distance to the first turn within which a way is described, rather than a turn announced [m]."""

_TELLING: Final = 1.7  # time to say a step [s]
_REACTION: Final = 2.0  # time of the car to take directions up [s]
_FORGOTTEN: Final = 40.0  # time after which one reminds of a step [s]
_REMINDS: Final = 0.1  # probability of a reminder of a step that the car has repeated a moment ago
_REMINDS_UNSURE: Final = 0.6  # probability of a reminder of another step
_PLANS: Final = 2.0  # foresight of those who plan
_SINGLE: Final = 0.08  # probability that they name one step all the same
_WAITS: Final = 0.6  # share of the turns left to a question of the car that are also left out of a whole way
_SLOW: Final = 4.0  # speed up to which there is time to say more than "turn around" [m/s]
_U_TURN_ROOM: Final = 40.0  # road that a U-turn needs behind the words, so that they may be longer [m]
_SIDE: Final = 0.4  # probability that the end of the way is told with the side of the street
_ROOM: Final = 3  # number of acts in one breath behind which there is room for another one
_BRIEF: Final = 12.0  # time within which the car takes up directions [s]
_SIGNS: Final = frozenset({DialogueMove.CONFIRM, DialogueMove.ACKNOWLEDGE, DialogueMove.CHECK})
_OPENS: Final = re.compile(r"right\b[, ]", re.IGNORECASE)  # "right, the next left" asks for no turn to the right
_OWN_WORDS: Final = frozenset({Directions.LANDMARKS, Directions.STREETS, Directions.COMPASS})
"""Manners in which even a single turn is described in words of their own."""


def is_described(state: ParticipantState, view: ParticipantView, key: StepKey, distance: float) -> bool:
    """Returns whether a step has been described and is not near yet."""
    return key in state.guidance.way and distance > turn_distance(state, view)


def turn_distance(state: ParticipantState, view: ParticipantView) -> float:
    """Returns the distance to a junction at which a turn is announced [m]."""
    return reach_at(state.config.turn_distance, view.speed, state.town)


def needs_no_reminder(state: ParticipantState, view: ParticipantView, key: StepKey, rng: np.random.Generator) -> bool:
    """Returns whether a near step was described and understood, so that nothing is said; otherwise it is said again."""
    guidance = state.guidance
    if key not in guidance.way:
        return False
    age = view.time - guidance.way_at
    fresh = guidance.way_taken_up and age < _FORGOTTEN
    rest = guidance.way[guidance.way.index(key) + 1 :]
    if age > _BRIEF and rng.random() < (_REMINDS if fresh else _REMINDS_UNSURE):
        state.guidance = replace(guidance, way=rest)
        return False
    state.guidance = guidance.after_step(key, view.time, state.config.lane_return_time)
    return True


def tell_way(
    state: ParticipantState, view: ParticipantView, key: StepKey, distance: float, rng: np.random.Generator
) -> tuple[Remark, ...]:
    """Returns the description of the way when the speaker wants to give it before the car asks; otherwise nothing.

    Args:
        state: working copy of the state.
        view: observation.
        key: next step, a turn.
        distance: distance to it [m].
        rng: random generator of the decision.
    """
    guidance, near = state.guidance, distance < turn_distance(state, view)
    early = distance < EARLY and state.style.manner is not Directions.VAGUE
    if key in guidance.way or guidance.step == key or guidance.looked_ahead == (key, near) or not (near or early):
        return ()
    state.guidance = replace(guidance, looked_ahead=(key, near))
    if rng.random() < _WAITS * state.style.waits:
        return ()
    steps = _steps(state, view, key, distance, rng)
    if len(steps) < 2 and not near:
        return ()
    return _said(state, view, steps, DialogueMove.INSTRUCT, rng)


def answer_with_way(
    state: ParticipantState,
    view: ParticipantView,
    key: StepKey,
    distance: float,
    move: DialogueMove,
    rng: np.random.Generator,
) -> tuple[Remark, ...]:
    """Returns the description of the way as an answer or an instruction; nothing where one step is named plainly."""
    if key[0] != "turn":
        return ()
    return _said(state, view, _steps(state, view, key, distance, rng), move, rng)


def _steps(
    state: ParticipantState, view: ParticipantView, key: StepKey, distance: float, rng: np.random.Generator
) -> tuple[WayStep, ...]:
    """Returns the steps to describe, which begin with a given one."""
    manner, time = state.style.manner, distance / max(view.speed, 1.0) - _REACTION
    count = min(_looks_ahead(state, rng), int(time / _TELLING))
    steps = way_ahead(state, view, count, manner, rng) if count > 0 else ()
    if not steps or steps[0].keys[0] != key:
        return ()
    first = steps[0].step
    if first.action is not StepAction.TURN:
        return steps if first.places and manner is Directions.LANDMARKS else ()
    return steps if len(steps) > 1 or len(steps[0].keys) > 1 or manner in _OWN_WORDS else ()


def _looks_ahead(state: ParticipantState, rng: np.random.Generator) -> int:
    """Returns the number of steps to describe: up to the foresight, and rarely one for those who plan."""
    foresight = state.style.foresight
    least = 1.0 if foresight < _PLANS or rng.random() < _SINGLE else 2.0
    return int(least + rng.random() * max(foresight - least + 1.0, 0.0))


def way_back(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> tuple[Remark, ...]:
    """Returns the description of the way behind a U-turn, to be said after the instruction to turn round."""
    steps = way_behind_u_turn(state, view, _looks_ahead(state, rng) - 1, state.style.manner, rng)
    rest = state.town.lanes[view.lane].length - view.station
    hurried = view.speed > _SLOW and rest < _TELLING * (len(steps) + 1) * view.speed + _U_TURN_ROOM
    if hurried or not steps or rng.random() < _WAITS * state.style.waits:
        return ()
    keys = tuple(key for one in steps for key in one.keys)
    state.guidance = state.guidance.after_describing(keys, view.time)
    return tuple(replace(item, joined=True) for item in way_remarks(steps, DialogueMove.INSTRUCT))


def _said(
    state: ParticipantState,
    view: ParticipantView,
    steps: tuple[WayStep, ...],
    move: DialogueMove,
    rng: np.random.Generator,
) -> tuple[Remark, ...]:
    if not steps:
        return ()
    first, *rest = (key for one in steps for key in one.keys)
    now = view.time
    state.guidance = state.guidance.after_step(first, now, state.config.lane_return_time)
    state.guidance = state.guidance.after_describing(tuple(rest), now)
    remarks = way_remarks(steps, move)
    if len(steps) <= _ROOM and move is DialogueMove.INSTRUCT and rng.random() < _SIDE:
        remarks = (*remarks, *ending_behind(state, view, steps[-1].keys[-1], rng))
    return remarks


# --- taken up by the car ----------------------------------------------------------------------------------------------


def take_up_confirmation(
    state: ParticipantState, view: ParticipantView, heard: HeardUtterance, rng: np.random.Generator
) -> bool:
    """Compares the car's repetition of a way with what was said; returns whether it was answered.

    Args:
        state: working copy of the state.
        view: observation.
        heard: utterance of the car.
        rng: random generator of the decision.
    """
    told = _last_way(state, view)
    if not told or not heard.acts or heard.acts[0].move not in _SIGNS or not heard.words.plan:
        return False
    if any(act.move in act_builders.QUESTIONS for act in heard.acts[1:]):
        return False  # the car has an objection, and asks for another way
    wanted = [str(item.wording.direction) for item in told if item.wording.direction is not None]
    turns = _turns(heard.words.plan)
    if _OPENS.match(heard.words.text) is not None and turns[1:] == wanted:
        turns = wanted
    # several steps are no single turn that may be to the wrong side
    several = len(heard.words.plan) > 1 and heard.acts[0].move is not DialogueMove.CHECK
    if len(turns) != len(wanted):
        return several  # parts of the repetition were not understood
    if len(wanted) < 2 and turns == wanted:
        state.guidance = state.guidance.after_taking_up()
    if len(wanted) < 2:
        return several and turns == wanted
    if turns != wanted:
        if told[0].act.move is DialogueMove.CLARIFY:
            return False  # it was said twice
        state.feel(Happening.MISUNDERSTOOD, view.time)
        again = tuple(
            replace(repeated(item, Function.CORRECTION), joined=number > 0) for number, item in enumerate(told)
        )
        state.say_only(*again)
        return True
    state.guidance = state.guidance.after_taking_up()
    if heard.acts[0].move is DialogueMove.CHECK or rng.random() < 0.3 * state.style.nods:
        state.say_first(intend(Function.POSITIVE_FEEDBACK, wording=Wording(topic="taken_up")))
    return True


def _last_way(state: ParticipantState, view: ParticipantView) -> tuple[Remark, ...]:
    """Returns the remarks of the way that has just been described; nothing otherwise."""
    if not state.speech.has_just_spoken(view.time, _BRIEF):
        return ()
    found: list[Remark] = []
    for item in reversed(state.speech.said):
        if not (item.wording.topic or "").startswith("way_"):
            if found or (item.act.move is DialogueMove.INSTRUCT and item.act.values(Slot.ACTION)):
                break  # another order was given since
            continue
        found.insert(0, item)
        if not item.joined:
            break
    return tuple(found)


def _turns(plan: DrivingPlan) -> list[str]:
    return [str(step.direction) for step in plan if step.action is StepAction.TURN and step.direction is not None]
