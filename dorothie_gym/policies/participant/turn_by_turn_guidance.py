"""Turn-by-turn guidance: turns, U-turns, lane changes, and the return to the route."""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.dialogue.conversation import speech_seconds
from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.intentions import CommunicativeFunction
from dorothie_gym.dialogue.nlg import word_act
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.maps.model import LinkType
from dorothie_gym.maps.routing import LaneEntry
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import ActionValue, Slot, StreetName
from dorothie_gym.policies.feasibility import slowing_distance
from dorothie_gym.policies.mood import Happening
from dorothie_gym.policies.observation_parser import street_of
from dorothie_gym.policies.participant.advance_directions import (
    answer_with_way,
    is_described,
    needs_no_reminder,
    tell_way,
    turn_distance,
    way_back,
)
from dorothie_gym.policies.participant.failed_guidance import (
    IN_VAIN,
    been_here,
    remark_on_miss,
    remark_on_wrong_turn,
    stop_circling,
    why_standing,
)
from dorothie_gym.policies.participant.final_approach import about_to_arrive, approach, repeat_stop
from dorothie_gym.policies.participant.order_history import (
    has_turned_since,
    is_about_to_turn_round,
    last_given,
    turned_round_lately,
)
from dorothie_gym.policies.participant.order_wording import order
from dorothie_gym.policies.participant.route_steps import route_step
from dorothie_gym.policies.participant.standstill import cannot_go_on, waits_for_road
from dorothie_gym.policies.participant.target_hints import hint
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.route_legs import END_ROOM
from dorothie_gym.policies.route_progress import Choice, RouteJunction, find_exit, next_choice
from dorothie_gym.policies.route_state import section
from dorothie_gym.policies.scripted_agent_limits import CALM_SPEED, reach_at
from dorothie_gym.policies.speech import Remark, intend
from dorothie_gym.policies.turn_lanes import leads_beside, turn_lanes
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    from dorothie_gym.policies.participant.state import ParticipantState, StepKey
    from dorothie_gym.policies.participant.view import ParticipantView

ANNOUNCING_TIME = 1.5
"""Time that the car drives on while a U-turn is being announced [s]."""

U_TURN_WAIT = 4.0
"""Standstill on the lane of a U-turn after which the U-turn is announced although it is not near [s]."""

SENT_ON = 12.0
"""Time for which "straight on" need not be said again [s]."""

OBEYING = 3.0
"""Time after an order before which its failure is none of the guidance [s]."""

STOPPING = 8.0
"""Time after an order to stop within which nothing is said about the speed [s]."""

FAST = 50.0
"""Speed above which the car is asked to slow down long before the place [km/h]."""

WRONG_WAY_EXPIRES = 4.0
"""Time within which a wrong turn is pointed out [s]."""


def follow_route(state: ParticipantState, view: ParticipantView) -> None:
    """Updates the progress on the route, and plans another one where the car has left it."""
    former = state.route.progress
    if former is None or view.turning:
        return
    config = state.config
    before = former.left(view.station)
    state.route = state.route.entering(state.town, view.lane)
    if state.task.goal is not None:
        x, y = view.position
        away = pm.hypot(state.task.goal.x - x, state.task.goal.y - y)
        state.guidance = state.guidance.near_place(away)
    former = former.followed(state.town, view.lane, view.station)
    if is_about_to_turn_round(state, view):
        return  # the way is looked at again when the car has turned, or has failed to
    if former.astray and _is_changing_for_turn(state, view):
        former = replace(former, astray=0)
    state.route = state.route.with_progress(former)
    passed = view.standing and former.left(view.station) < -config.arrived_within
    if passed:
        state.set_guiding(True)
    if former.astray >= config.off_route or passed:
        state.route = state.route.replanned(state.town, view.place)
        drove_past = before < config.missed_within and former.next_manoeuvre(view.station) is None
        missed = drove_past or state.route.has_missed(before, view.station)
        if state.guidance.guiding and missed and _was_told(state, view):
            state.feel(Happening.MISSED, view.time)
            state.guidance = state.guidance.after_miss()
            state.route = state.route.after_miss(state.town, view.place, former)
            remark_on_miss(state, view, passed=drove_past)
        state.guidance = state.guidance.for_another_approach().without_way()
        if not drove_past:
            _point_out_wrong_turn(state, view, before)
        if drove_past and not state.guidance.guiding:
            # the car does not know yet that it has arrived
            state.guidance = state.guidance.for_new_route(state.route.to_goal.left(view.station))
    state.guidance = state.guidance.with_distance(state.route.to_goal.left(view.station))


def _was_told(state: ParticipantState, view: ParticipantView) -> bool:
    """Returns whether the car has been guided on this way for long enough to do as it was told."""
    last, guidance = last_given(state), state.guidance
    ordered = last is not None and view.time - last.time > OBEYING
    return ordered or guidance.approach_announced or guidance.stopped_at > -math.inf


def _is_changing_for_turn(state: ParticipantState, view: ParticipantView) -> bool:
    """Returns whether the car is heading for the lane of the announced turn on lanes of its own choice."""
    step = state.guidance.step
    if step is None or step[0] != "turn" or not state.guidance.guiding:
        return False
    return leads_beside(state.town, view.lane, step[1])


def _point_out_wrong_turn(state: ParticipantState, view: ParticipantView, before: float) -> None:
    """Points out that the car has not taken the announced turn."""
    guidance, progress = state.guidance, state.route.to_goal
    farther = progress.left(view.station) > before + state.config.wrong_turn_detour and math.isfinite(before)
    if not guidance.guiding or guidance.step is None or guidance.step[0] != "turn" or not farther:
        return
    if state.motion.moved_at <= guidance.wrong_way_at:
        return  # it was pointed out, and the car has not moved since
    state.guidance = guidance.after_pointing_out(view.time)
    state.feel(Happening.WRONG_WAY, view.time)
    if not remark_on_wrong_turn(state, view, guidance.step):
        expires = view.time + WRONG_WAY_EXPIRES
        state.say_only(_wrong_way(state, expires))


def _wrong_way(state: ParticipantState, expires: float = math.inf, topic: str = "wrong_way") -> Remark:
    """Returns the remark that the car has left the route to the place, or is heading away from it."""
    place = None if state.task.goal is None else state.task.goal.name
    wrong = Proposition.of(Predicate.RIGHT_WAY, negated=True, place=place)
    wording = Wording(topic=topic)
    return intend(CommunicativeFunction.INFORM, wrong, elided=("place",), wording=wording, expires=expires)


def watch(state: ParticipantState, view: ParticipantView) -> None:
    """Begins to guide a car that makes a long detour, comes along for the third time, or stands for a long time."""
    progress, config = state.route.progress, state.config
    if state.guidance.guiding or progress is None or not state.task.announced:
        return
    left = progress.left(view.station)
    if state.task.described and left < config.take_over_distance:
        state.set_guiding(True)
        return
    lost = left > state.guidance.best + config.lost_detour
    if lost:
        state.guidance = replace(state.guidance, best=left)  # it is said once of one detour
        if not turned_round_lately(state, view):
            state.say(_wrong_way(state, topic="heading_away"))
    circles = state.route.driven.count(section(state.town, view.lane)) > IN_VAIN
    if circles and not lost:
        state.say(been_here(view))
    stuck = state.motion.standstill(view.time) > config.lost_standstill and view.time > state.motion.excused_until
    if lost or circles or stuck:
        state.set_guiding(True)


def guide(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    """Gives the next step if it is due."""
    progress, config = state.route.progress, state.config
    if progress is None or not state.task.announced or view.turning or _is_astray(state, view):
        return
    turns = is_about_to_turn_round(state, view)
    stop_circling(state, view)
    if not _may_speak(state, view) or approach(state, view, rng) or not state.guidance.guiding or turns:
        return
    step = next_step(state, view, DialogueMove.INSTRUCT, rng)
    if step is None:
        return
    key, distance, words = step
    turns_round = key[0] == "round"
    if _slow_down_early(state, view, rng) or (
        turns_round and (_turns_later(state, view) or _takes_run_up(state, view))
    ):
        return
    near = distance < (_u_turn_distance(state, view) if key[0] == "round" else turn_distance(state, view))
    if _has_told_way(state, view, key, distance, rng):
        return
    if _is_left_to_ask(state, view, key, distance, words.wording.direction is Direction.STRAIGHT, rng):
        return
    progress = state.route.to_goal
    waited = view.time - max(state.guidance.step_at, state.conversation.heard_at)
    on_its_lane = key[0] == "round" and progress.turns_round_on(view.lane)
    if on_its_lane and state.motion.standstill(view.time) > U_TURN_WAIT:
        near = True
    stuck = view.standing and waited > config.repeat_after and view.time > state.motion.excused_until
    if not near and stuck:
        key, words = ("on", view.lane, 0), order(DialogueMove.INSTRUCT, ActionValue.START)
        near = True
    if stuck and state.guidance.step == key and state.guidance.repeats + 1 >= IN_VAIN and not _told_to_stop(state):
        note_step(state, view, ("why", view.lane, 0))
        state.say(why_standing(state, view))
        return
    overdue = stuck or (key[0] != "turn" and waited > config.repeat_after)
    changing = state.guidance.step is not None and state.guidance.step[0] == "lane"
    switching = changing and view.time - state.guidance.step_at < config.switch_time
    if key[0] == "lane" and (switching or view.time < state.motion.excused_until):
        return
    again = state.guidance.step == key
    if near and (not again or overdue):
        _announce(state, view, step=(key, distance, words), again=again, rng=rng)


def _told_to_stop(state: ParticipantState) -> bool:
    """Returns whether the car stands because that was the last order."""
    last = last_given(state)
    return last is not None and ActionValue.STOP in last.act.slots


def _has_just_sent_on(state: ParticipantState, view: ParticipantView) -> bool:
    """Returns whether the car was told a moment ago to go straight on, and has not turned since."""
    last = last_given(state)
    sent = last is not None and ActionValue.LANE_FOLLOW in last.act.slots and view.time - last.time < SENT_ON
    return sent and last is not None and not has_turned_since(view, last)


def _has_told_way(
    state: ParticipantState, view: ParticipantView, key: StepKey, distance: float, rng: np.random.Generator
) -> bool:
    """Returns whether the next step needs no words of its own: it has to wait, was described, or is described now."""
    if key[0] in ("turn", "on") and waits_for_road(state, view):
        return True
    if key[0] != "turn":
        return False
    if is_described(state, view, key, distance) or needs_no_reminder(state, view, key, rng):
        return True
    way = tell_way(state, view, key, distance, rng)
    state.say(*way)
    return bool(way)


def _announce(
    state: ParticipantState,
    view: ParticipantView,
    *,
    step: tuple[StepKey, float, Remark],
    again: bool,
    rng: np.random.Generator,
) -> None:
    """Announces a step that is near, if possible with those behind it."""
    key, distance, words = step
    way = () if again else answer_with_way(state, view, key, distance, DialogueMove.INSTRUCT, rng)
    if way:
        state.say(*way)
        return
    if key[0] in ("turn", "lane") and not again and rng.random() < state.style.hints:
        words = replace(words, wording=replace(words.wording, topic="indirect"))
    note_step(state, view, key)
    back = way_back(state, view, rng) if key[0] == "round" and not again else ()
    state.say(*((words, *back) if back else _with_addition(state, view, words, again, rng)))


def _is_astray(state: ParticipantState, view: ParticipantView) -> bool:
    """Returns whether the car is off the route; where it drives past the place, repeats the stop first."""
    astray = state.route.progress is not None and state.route.progress.astray > 0
    if astray:
        repeat_stop(state, view)
    return astray


def _may_speak(state: ParticipantState, view: ParticipantView) -> bool:
    """Returns whether a step may be announced now; drops other remarks as the car comes close to the place."""
    if state.guidance.guiding and about_to_arrive(state, view) and not view.standing:
        state.speech = state.speech.cleared()
    return state.speech.idle and view.speaking <= 0.0


def _with_addition(
    state: ParticipantState, view: ParticipantView, words: Remark, again: bool, rng: np.random.Generator
) -> tuple[Remark, ...]:
    """Returns a step with a possible addition in the same breath: a hint, or a question whether it was understood."""
    if _leaves_ending_lane(state, view, words):
        ends = Proposition.of(Predicate.POSSIBLE, action=ActionValue.LANE_FOLLOW, negated=True)
        wording = Wording(topic="lane_ends")
        return words, intend(CommunicativeFunction.INFORM, ends, elided=("action",), wording=wording, joined=True)
    draw = rng.random()
    if words.act.values(Slot.ACTION) == (ActionValue.U_TURN,):
        # the moment must not be missed: the shorter of two wordings
        drawn = [word_act(words.act, Role.PARTICIPANT, rng, words.wording, style=state.speech.style) for _ in range(2)]
        return (replace(words, text=min(drawn, key=speech_seconds)),)
    if (again and rng.random() < 0.25) or draw < state.style.aligns:
        wording = Wording(topic="understood")
        return words, intend(CommunicativeFunction.FEEDBACK_ELICITATION, wording=wording, joined=True)
    if draw < state.style.aligns + 0.7 * state.style.reasons:
        return words, *hint(state, view, rng)
    return (words,)


def _leaves_ending_lane(state: ParticipantState, view: ParticipantView, words: Remark) -> bool:
    """Returns whether a remark asks for the lane switch out of a lane that ends."""
    side = state.town.merge(view.lane)
    left = side is LinkType.LANE_CHANGE_LEFT
    switches = words.act.values(Slot.ACTION) == (ActionValue.LANE_SWITCH,)
    return side is not None and switches and words.wording.direction is (Direction.LEFT if left else Direction.RIGHT)


def _is_left_to_ask(
    state: ParticipantState,
    view: ParticipantView,
    key: StepKey,
    distance: float,
    goes_straight: bool,
    rng: np.random.Generator,
) -> bool:
    """Returns whether a turn is announced only if the car asks; driving straight on needs no announcement."""
    if goes_straight and not view.standing and _has_just_sent_on(state, view):
        return True
    if key[0] != "turn" or state.guidance.step == key:
        return False
    if key[1] in turn_lanes(state.town) and (goes_straight or view.lane == key[1]):
        return state.motion.standstill(view.time) <= state.config.repeat_after  # the lane leads there by itself
    if key[1] in turn_lanes(state.town):
        return False  # the car needs time to change lanes
    if state.guidance.considered != key:
        chance = max(state.style.waits, state.config.omits_straight) if goes_straight else state.style.waits
        state.guidance = state.guidance.with_consideration(key, bool(rng.random() < chance))
    if not state.guidance.left_to_ask or state.motion.standstill(view.time) > state.config.repeat_after:
        return False
    return distance > state.config.turn_late_distance or goes_straight


def _slow_down_early(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> bool:
    """Asks the car to slow down for a place that was missed before, or is easily missed after a manoeuvre."""
    progress, config = state.route.to_goal, state.config
    fast = state.town.cruise is None and 3.6 * view.speed > FAST
    far = progress.left(view.station) > (1 + fast) * reach_at(config.stop_distance, view.speed, state.town)
    stops = view.time - state.guidance.stopped_at < STOPPING
    if state.guidance.slowed_early or far or stops or view.speed < config.slow_speed:
        return False
    if not state.route.misses and not fast and not _is_easily_missed(state, view):
        return False
    state.guidance = state.guidance.after_slowing_early()
    speed = float(rng.choice(config.careful_speeds)) if state.route.misses or not fast else float(CALM_SPEED)
    if 3.6 * view.speed <= speed:
        return False
    wording = Wording(faster=False, speed=speed)
    state.say(order(DialogueMove.INSTRUCT, ActionValue.SPEED_CHANGE, wording))
    return True


def _is_easily_missed(state: ParticipantState, view: ParticipantView) -> bool:
    """Returns whether there is too little time to stop between the next junction or lane change and the place."""
    progress, step, config = state.route.to_goal, state.guidance.step, state.config
    left = progress.left(view.station)
    crossing = progress.next_crossing(state.town, view.station)
    if crossing is None:
        manoeuvre = progress.next_manoeuvre(view.station)
        return manoeuvre is not None and manoeuvre[0] is not LaneEntry.U_TURN
    announced = step is not None and step[0] == "turn"
    return announced and crossing.distance < config.corner_distance and left - crossing.distance < config.behind_corner


def _u_turn_distance(state: ParticipantState, view: ParticipantView) -> float:
    """Returns the distance at which a U-turn is announced [m]: driven during the announcement and while braking."""
    announcing = ANNOUNCING_TIME * view.speed
    if not state.route.to_goal.turns_round_on(view.lane):
        return announcing
    return announcing + slowing_distance(view.speed)


def _takes_run_up(state: ParticipantState, view: ParticipantView) -> bool:
    """Returns whether the U-turn is postponed: a car that turned round here could not stop at the place in time."""
    progress, config = state.route.to_goal, state.config
    after = progress.run_up()
    crosses = progress.next_crossing(state.town, view.station) is not None
    if after is None or crosses or not progress.turns_round_on(view.lane):
        return False
    rest, changes = after
    room = state.town.lanes[view.lane].length - view.station - _u_turn_distance(state, view)
    missing = config.run_up + changes * config.run_up_per_lane - rest
    if missing < 0.0 or room < END_ROOM + view.speed or not _turns_better(state, view, min(missing, room - END_ROOM)):
        return False
    if cannot_go_on(state, view):
        return False
    if progress.next_manoeuvre(view.station) == (LaneEntry.U_TURN, 0.0):
        state.route = state.route.replanned(state.town, view.place)
    _send_on(state, view)
    return True


def _turns_later(state: ParticipantState, view: ParticipantView) -> bool:
    """Returns whether a U-turn is not ordered yet: while the car drives over a junction, or says what keeps it."""
    kept = state.motion.moved_at <= state.guidance.step_at and view.time < state.motion.excused_until
    crossing = state.town.lanes[view.lane].in_junction and state.motion.standstill(view.time) <= U_TURN_WAIT
    return kept or crossing


def _turns_better(state: ParticipantState, view: ParticipantView, farther: float) -> bool:
    """Returns whether a U-turn `farther` metres ahead is possible as well and leaves more road before the place."""
    progress = state.route.to_goal
    later = progress.replanned(state.town, (view.lane, view.station + farther), state.route.closed)
    now, then = progress.run_up(), later.run_up()
    return now is not None and then is not None and later.turns_round_on(view.lane) and then[0] > now[0] + farther / 2


def _send_on(state: ParticipantState, view: ParticipantView) -> None:
    """Instructs a standing car to drive on and turn round later."""
    waited = view.time - max(state.guidance.step_at, state.conversation.heard_at, state.speech.last_end)
    ready = waited > state.config.ready_time and view.time > state.motion.excused_until
    if view.standing and ready and state.guidance.step != ("on", view.lane, 0):
        note_step(state, view, ("on", view.lane, 0))
        state.say(order(DialogueMove.INSTRUCT, ActionValue.LANE_FOLLOW, Wording(topic="run_up")))


def note_step(state: ParticipantState, view: ParticipantView, key: StepKey) -> None:
    """Records a step that is announced to the car."""
    state.guidance = state.guidance.after_step(key, view.time, state.config.lane_return_time)


def next_step(
    state: ParticipantState, view: ParticipantView, move: DialogueMove, rng: np.random.Generator
) -> tuple[StepKey, float, Remark] | None:
    """Returns the next step on the route: its identity, its distance [m], and the remark; None without a route.

    Args:
        state: working copy of the state.
        view: observation.
        move: an instruction, an answer to an open question, or a clarification.
        rng: random generator of the decision.
    """
    step = route_step(state, view)
    if step is None:
        return None
    if step.junction is not None:
        return step.key, step.distance, _turn_remark(state, view, move, step.junction, rng)
    return step.key, step.distance, _order_of_step(move, step.action, step.direction)


def _turn_remark(
    state: ParticipantState,
    view: ParticipantView,
    move: DialogueMove,
    crossing: RouteJunction,
    rng: np.random.Generator,
) -> Remark:
    direction = crossing.direction
    action = ActionValue.J_TURN
    if direction is Direction.STRAIGHT and (move is not DialogueMove.INSTRUCT or rng.random() < 0.6):
        action = ActionValue.LANE_FOLLOW
    onto: StreetName | None = None
    street = street_of(view.raw, state.town, crossing.exit.lane)
    helps = street is not StreetName.UNKNOWN and direction is not Direction.STRAIGHT
    if helps and (_is_ambiguous(state, view, crossing) or rng.random() < state.style.names_street * 0.6):
        onto = street
    first = crossing.distance < 60.0 or rng.random() < 0.5
    ordinal = 1 if first and onto is None and action is ActionValue.J_TURN and rng.random() < 0.5 else None
    return _order_of_step(move, action, direction, ordinal, onto)


@functools.lru_cache(maxsize=512)
def _order_of_step(
    move: DialogueMove,
    action: ActionValue,
    direction: Direction | None,
    ordinal: int | None = None,
    street: StreetName | None = None,
) -> Remark:
    return order(move, action, Wording(direction=direction, ordinal=ordinal), street=street)


def _is_ambiguous(state: ParticipantState, view: ParticipantView, crossing: RouteJunction) -> bool:
    """Returns whether the direction alone refers to another exit."""
    if crossing.lane in turn_lanes(state.town):
        return False
    choice = next_choice(state.town, view.lane, view.station)
    if choice is None or choice.lane != crossing.lane:
        choice = Choice(lane=crossing.lane, distance=0.0, exits=state.town.exits(crossing.lane))
    meant = find_exit(state.town, choice, crossing.direction)
    lanes = state.town.lanes
    return meant is not None and lanes[meant.lane].road_id != lanes[crossing.exit.lane].road_id
