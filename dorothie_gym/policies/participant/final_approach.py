"""Guidance on the final approach to a place: slower, stop, a bit further."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.intentions import CommunicativeFunction
from dorothie_gym.dialogue.nlg import word_act
from dorothie_gym.dialogue.phrases import Register
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.dialogue.speaker_style import SpeakerStyle
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import ActionValue
from dorothie_gym.policies.participant.approach_end import ending
from dorothie_gym.policies.participant.failed_guidance import IN_VAIN, why_standing
from dorothie_gym.policies.participant.order_history import times_told
from dorothie_gym.policies.participant.order_wording import of_place, order
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.route_progress import stopping_distance
from dorothie_gym.policies.scripted_agent_limits import FASTEST, reach_at, usual_cruise
from dorothie_gym.policies.speech import Remark, intend

if TYPE_CHECKING:
    from dorothie_gym.policies.participant.state import GuidanceState, ParticipantState
    from dorothie_gym.policies.participant.view import ParticipantView

STOP_REPEAT = 5.0
"""Time after which the stop instruction is repeated [s]."""

REACTION = 1.8
"""Time after which a car that has heard an instruction to stop begins to brake [s]."""

PASSED = 15.0
"""Distance past the place up to which a stop instruction that was not obeyed is repeated [m]."""

BRAKING = 0.2
"""Loss of speed within a decision that shows that the car brakes [m/s]."""

SLOWS_WITHIN = 3.0
"""Time after the announcement of the place within which the car begins to slow down [s]."""

OVERSHOOT = 3.0
"""Number of metres before the place that one metre past it is worth: the car cannot back up."""

GAIN_RANGE = (-2.0, 3.0)
"""Range of accelerations that are extrapolated [m/s^2]."""

FURTHER = 5.0
"""Distance to the place up to which "a bit further" is said, and above which car lengths [m]."""

LENGTHS = 16.0
"""Distance to the place up to which car lengths are said, and above which the car is told to keep going [m]."""

SHORT_RESERVE = 1.0
"""Distance by which short spoken distances are shortened [m]."""

HARDLY = 1.0
"""Way of the car that shows that it follows instructions to drive on a little [m]."""

FEWEST = 3.0
"""Smallest distance that is said [m]; the car stops a little earlier."""

ROLLING = 3.5
"""Speed up to which a car that was sent on a little may still stop by itself [m/s]; it may have misheard how far."""

SHOUTS = 3
"""Number of short wordings that are compared when there is only time for a shout."""

REWORDINGS = 4
"""Number of draws of other words for a stop instruction that is repeated."""

BEHIND_CORNER = 5.0
"""Distance from the start of a lane within which a car has just turned and is about to accelerate [m]."""

ENDING_TIME = 2.0
"""Time to say on which side of the street the place is, and what stands there [s]."""

SPEAKING = 2.0
"""Time in which a car that has just turned gets faster while the place is announced [s]."""

STANDING_RANGE = 45.0
"""Distance to the place within which a standing car gets its next instruction [m]."""

PATIENT_TIME = 6.0
"""Standstill after which a car at the place, or one that is not guided, gets its next instruction [s]."""

_STOP = DialogueAct.of(DialogueMove.INSTRUCT, ActionValue.STOP)
_SHOUTING = SpeakerStyle(register=Register.BLUNT, chattiness=0.0, indirectness=0.0)


def approach(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> bool:
    """Guides the car on the last stretch; returns whether the car is on the last stretch."""
    progress, config = state.route.to_goal, state.config
    if (
        progress.next_crossing(state.town, view.station) is not None
        or progress.next_manoeuvre(view.station) is not None
    ):
        return False
    left = progress.left(view.station)
    if view.standing:
        return _guide_standing(state, view, left)
    close = left < reach_at(config.stop_distance, view.speed, state.town)
    if not state.guidance.guiding or _is_sent_a_little(state, view):
        return close  # a car that was sent on a little stops by itself
    prepare_stop(state, view, left, rng)
    if _is_time_to_stop(state, view, left):
        if view.time - state.guidance.stopped_at > _stop_repeat(state, view) and left > 0.0:
            words, points_out = state.guidance.stop_text, state.guidance.points_out
            state.guidance = state.guidance.after_stopping(view.time)
            stop = _here(state) if points_out else order(DialogueMove.INSTRUCT, ActionValue.STOP, urgent=True)
            state.say(replace(stop, text=words))
        return True
    if close and not state.guidance.approach_announced and view.speed > config.slow_speed:
        _announce_place(state, view, left, rng)
    return close


def _is_sent_a_little(state: ParticipantState, view: ParticipantView) -> bool:
    """Returns whether the car was just told to drive on a little, rather than straight on, and does so."""
    lately = view.time - state.guidance.nudged_at < state.config.nudge_time
    straight_on = state.guidance.sent_straight_on
    runs_past = view.speed > ROLLING and state.route.to_goal.left(view.station) < stopping_distance(view.speed)
    return lately and not (straight_on or runs_past)


def repeat_stop(state: ParticipantState, view: ParticipantView) -> None:
    """Repeats a stop instruction to a car that has not obeyed it and drives past the place."""
    progress, since = state.route.to_goal, view.time - state.guidance.stopped_at
    unheeded = _stop_repeat(state, view) < since < STOP_REPEAT and not view.standing
    if unheeded and -PASSED < progress.left(view.station) <= 0.0 and state.speech.idle and view.speaking <= 0.0:
        state.guidance = state.guidance.after_stopping(view.time)
        state.say(order(DialogueMove.CLARIFY, ActionValue.STOP, urgent=True))


def prepare_stop(state: ParticipantState, view: ParticipantView, left: float, rng: np.random.Generator) -> None:
    """Chooses the words of a stop instruction in advance, because their duration determines when to say them."""
    if not state.guidance.stop_text:
        _choose_stop_words(state, rng)
    if room_to_stop(state, view, left)[0] < -state.config.late_stop:
        # there is only time for a shout
        points_out = _has_stopped_twice(state)
        act, wording = (_here(state).act, _here(state).wording) if points_out else (_STOP, Wording())
        shouts = [word_act(act, Role.PARTICIPANT, rng, wording, style=_SHOUTING) for _ in range(SHOUTS)]
        options = [text for text in (*shouts, state.guidance.stop_text) if text != state.guidance.stop_said] or shouts
        shortest = min(options, key=state.speech.delivery.seconds)
        state.guidance = state.guidance.with_stop_text(shortest, points_out=points_out)


def _has_stopped_twice(state: ParticipantState) -> bool:
    """Returns whether the car was told to stop for the place twice, so that a third time is said in another way."""
    return times_told(state, ActionValue.STOP) >= IN_VAIN


def _choose_stop_words(state: ParticipantState, rng: np.random.Generator) -> None:
    """Chooses the words to stop the car with: an instruction, or the statement that this is the place.

    The statement is made the first time at most, and from the third time on.
    """
    first = not state.route.misses and state.guidance.stopped_at == -math.inf
    points_out = (first and rng.random() < state.style.points_out) or _has_stopped_twice(state)
    act, wording = (_here(state).act, _here(state).wording) if points_out else (_STOP, Wording(here=True))
    text = said = state.guidance.stop_said
    for _ in range(REWORDINGS):
        text = word_act(act, Role.PARTICIPANT, rng, wording, style=state.speech.style)
        if text != said:
            break
    state.guidance = state.guidance.with_stop_text(text, points_out=points_out)


def _here(state: ParticipantState) -> Remark:
    """Returns the statement that the place is right here, which makes a guided car stop."""
    place = None if state.task.goal is None else state.task.goal.name
    here = Proposition.of(Predicate.CLOSE, place=place)
    wording = Wording(topic=of_place("here", place))
    return intend(CommunicativeFunction.INFORM, here, elided=("place",), wording=wording, urgent=True)


def _stop_repeat(state: ParticipantState, view: ParticipantView) -> float:
    """Returns the time after which the stop instruction is repeated [s]: soon if the car does not brake."""
    heeded = view.speed < state.motion.speed - BRAKING
    return STOP_REPEAT if heeded else state.speech.delivery.seconds(state.guidance.stop_said) + REACTION


def _announce_place(state: ParticipantState, view: ParticipantView, left: float, rng: np.random.Generator) -> None:
    """Announces the place, or requests a lower speed if there is no time for an announcement."""
    goal, speed = state.task.goal, max(view.speed, _speed_soon(state, view))
    if goal is None:
        return
    if left > 3.5 * speed + 20.0:
        room = left > 3.5 * speed + 20.0 + ENDING_TIME * speed
        end = ending(state, view, rng) if room and rng.random() < state.style.endings else ()
        ahead = Proposition.of(Predicate.CLOSE, place=goal.name)
        words = intend(CommunicativeFunction.INFORM, ahead, wording=Wording(topic="ahead"), urgent=True)
        said = (words, *(replace(item, urgent=True) for item in end))
    elif left > 3.0 * speed + 12.0 and not state.guidance.slowed_early:
        said = (order(DialogueMove.INSTRUCT, ActionValue.SPEED_CHANGE, Wording(faster=False), urgent=True),)
    else:
        return
    state.guidance = state.guidance.with_approach_announced(True)
    state.say(*said)


def _speed_soon(state: ParticipantState, view: ParticipantView) -> float:
    """Returns the speed expected of a car that has just started or turned, after a few words [m/s]."""
    if not _may_be_fast(state):
        return state.config.soon_speed
    return max(min(view.speed + SPEAKING * state.config.pull, _top_speed(state, view)), state.config.soon_speed)


def about_to_arrive(state: ParticipantState, view: ParticipantView) -> bool:
    """Returns whether only the end of the last stretch is left."""
    progress = state.route.progress
    if progress is None or progress.left(view.station) > state.config.arrival_distance:
        return False
    return progress.next_crossing(state.town, view.station) is None and progress.next_manoeuvre(view.station) is None


def _is_time_to_stop(state: ParticipantState, view: ParticipantView, left: float) -> bool:
    """Returns whether a stop instruction given now stops the car closer to the place than one at the next decision."""
    slow = view.speed < max(state.motion.speed - BRAKING, state.config.slow_speed)
    told = state.speech.has_just_spoken(view.time, SLOWS_WITHIN) and view.speed > state.config.slow_speed
    room, after = room_to_stop(state, view, left)
    late = _may_be_fast(state) and after < 0.0
    if state.guidance.approach_announced and left > state.config.slow_distance and (slow or told) and not late:
        return False  # the car is slowing down, or is about to
    return room <= (state.config.short_stop if state.route.misses else state.config.aim) or room < -OVERSHOOT * after


def _is_about_to_speed_up(state: ParticipantState, view: ParticipantView, delay: float) -> bool:
    """Returns whether the car drives slowly and has just turned, or will finish a turn within a delay [s]."""
    lane = state.town.lanes[view.lane]
    out = lane.length - view.station < delay * view.speed if lane.in_junction else view.station < BEHIND_CORNER
    warned = state.guidance.slowed_early or state.guidance.approach_announced
    return out and not warned and view.speed < state.config.soon_speed


def _is_about_to_slow_down(state: ParticipantState, view: ParticipantView) -> bool:
    """Returns whether the car has just been told that the place is near, and drives too fast for its end."""
    told = state.guidance.approach_announced and state.speech.has_just_spoken(view.time, REACTION)
    return told and view.speed > state.config.slow_speed


def room_to_stop(state: ParticipantState, view: ParticipantView, left: float) -> tuple[float, float]:
    """Returns the distance before the place at which the car stops [m]: instructed now, and at the next decision.

    Negative distances lie past the place. The words take effect when they end; until then the present
    acceleration is extrapolated.
    """
    interval, config = state.clock.interval, state.config
    delay = math.ceil(state.speech.delivery.seconds(state.guidance.stop_text) / interval - 1e-6) * interval
    gain = min(max((view.speed - state.motion.speed) / interval, GAIN_RANGE[0]), GAIN_RANGE[1])
    if _is_about_to_speed_up(state, view, delay):
        gain = config.pull
    elif _is_about_to_slow_down(state, view):
        gain = GAIN_RANGE[0]
    slow = (state.guidance.slowed_early or state.guidance.approach_announced) and not _speeds_up(state, view)
    now, top = view.speed, max(config.soon_speed if slow else _top_speed(state, view), view.speed)
    soon = min(max(now + gain * interval, 0.0), top)
    rooms = []
    for speed, ahead in ((now, left), (soon, left - (now + soon) / 2 * interval)):
        then = min(max(speed + gain * delay, 0.0), top)
        rooms.append(ahead - (speed + then) / 2 * delay - stopping_distance(then))
    return rooms[0], rooms[1]


def _speeds_up(state: ParticipantState, view: ParticipantView) -> bool:
    """Returns whether the car gets faster than one that drives slowly, as it was told to."""
    faster = view.speed > max(state.motion.speed + BRAKING, state.config.slow_speed)
    return faster and _may_be_fast(state)


def _may_be_fast(state: ParticipantState) -> bool:
    """Returns whether the streets are fast, or the place was missed before, so that a slow car is not relied on."""
    return state.town.cruise is None or state.route.misses > 0


def _top_speed(state: ParticipantState, view: ParticipantView) -> float:
    """Returns the largest speed expected of the car on its lane [m/s]."""
    if state.town.cruise is not None:
        return state.config.top_speed
    return min(usual_cruise(state.town, view.lane) / 3.6, FASTEST)


def _guide_standing(state: ParticipantState, view: ParticipantView, left: float) -> bool:
    """Instructs a standing car how to continue; returns whether it is close to the place."""
    since, config = state.motion.standing_since, state.config
    if since is None or left > STANDING_RANGE:
        return False
    waited = view.time - max(since, state.guidance.nudged_at, state.speech.last_end, state.conversation.heard_at)
    patient = abs(left) <= config.arrived_within or not state.guidance.guiding
    cycles = state.guidance.nudges // (IN_VAIN + 1)  # the more was said in vain, the longer the wait
    if waited > (PATIENT_TIME if patient else config.ready_time) * (1 + cycles) and not _is_excused(state, view):
        state.say(creep_instruction(state, view))
    return True


def _is_excused(state: ParticipantState, view: ParticipantView) -> bool:
    """Returns whether the car has just said what keeps it from driving on, when asked why it stands."""
    return state.guidance.nudges > IN_VAIN and view.time < state.motion.excused_until


def creep_instruction(state: ParticipantState, view: ParticipantView) -> Remark:
    """Returns the instruction for a car that stands a little before the place; it counts when it is said.

    A third instruction to a car that has hardly moved is replaced by the question why it stands; then the car is told
    to go straight on, in case it waits before a junction, and to start. A car that moves, but too little, is told the
    distance, in car lengths; one that stands far away is told to keep going until it is stopped.
    """
    left = state.route.to_goal.left(view.station)
    counted = state.guidance.after_nudging(view.time, left)
    words = _nudge(state, view, left, counted)
    state.guidance = replace(state.guidance, planned_nudge=words.act)
    return words


def _nudge(state: ParticipantState, view: ParticipantView, left: float, counted: GuidanceState) -> Remark:
    again, attempt = divmod(counted.nudges, IN_VAIN + 1)
    too_little = counted.nudges > IN_VAIN and counted.nudged_from - left > HARDLY
    if attempt == 0 and not too_little:
        return why_standing(state, view)
    if again and not too_little:
        return order(DialogueMove.INSTRUCT, ActionValue.START) if attempt == IN_VAIN else straight_on()
    if left > 30.0:
        state.guidance = state.guidance.with_approach_announced(False)
    if left > LENGTHS:
        wording = Wording(topic="run_up")
    elif too_little:
        wording = Wording(distance=max(left, FEWEST))
    else:
        wording = Wording(distance=left - SHORT_RESERVE) if left > FURTHER else Wording(topic="further")
    return order(DialogueMove.INSTRUCT, ActionValue.LANE_FOLLOW, wording)


def straight_on() -> Remark:
    """Returns the instruction to go straight on, also across a junction."""
    return order(DialogueMove.INSTRUCT, ActionValue.LANE_FOLLOW, Wording(direction=Direction.STRAIGHT))
