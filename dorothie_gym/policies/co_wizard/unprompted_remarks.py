"""Unprompted remarks of the Co-Wizard: questions, reasons, arrivals, weather and localization."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.intentions import CommunicativeFunction as Function
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.dialogue.realization_context import Wording, WordingContext
from dorothie_gym.maps.model import LinkType
from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.slots import ActionValue, GoalStatus, LandmarkName, ObjectClass, StreetName
from dorothie_gym.ontology.world_exceptions import Sensor, WeatherParameter
from dorothie_gym.policies import act_builders
from dorothie_gym.policies.co_wizard.acknowledgement import plan_remark
from dorothie_gym.policies.co_wizard.driving import wanted_exit
from dorothie_gym.policies.co_wizard.errand_memory import arrival_reminder
from dorothie_gym.policies.co_wizard.intentions import Wish
from dorothie_gym.policies.co_wizard.proposals import go_on_unanswered, probable_way, propose_way
from dorothie_gym.policies.co_wizard.proposition_truth import NAMED_ACTIONS, is_localised, reason_to_stand
from dorothie_gym.policies.notable_conditions import PARAMETER, fault_remark, notice, view_remark
from dorothie_gym.policies.observation_parser import is_dark, nearest_landmark, street_of
from dorothie_gym.policies.route_progress import Choice, direction_of
from dorothie_gym.policies.scripted_agent_limits import reach_at
from dorothie_gym.policies.speech import Remark, intend
from dorothie_gym.policies.view_range import Limit, camera_fault, limit_of, sight, suitable_speed
from dorothie_gym.sim.state.codes import Motion

if TYPE_CHECKING:
    from dorothie_gym.policies.co_wizard.state import CoWizardState
    from dorothie_gym.policies.co_wizard.view import CoWizardView
    from dorothie_gym.session.spaces.actions import Physical

_HANDLED = frozenset(
    {WeatherParameter.FOG_DENSITY, WeatherParameter.PRECIPITATION, WeatherParameter.SUN_ALTITUDE_ANGLE}
)
"""Parameters of the weather that have a reaction of their own."""

HAZARD_EXPIRES = 4.0
"""Time within which the reason for a standstill is mentioned [s]."""

UNANSWERED = 3
"""Number of questions about the way without a word of the participant after which the car goes on by itself."""

SENT_ON = 30.0
"""Time for which a car asks for no way that was told to drive on until it hears more [s]."""

_ANNOUNCES_U_TURN = 0.85  # probability that a car that turns round on its own says so
_JUST_SAID = 8.0  # time for which a manoeuvre that was named need not be announced [s]
_JUST_TOLD = 3  # number of remarks among which an answer about the camera counts as the report of its fault
_CAUTION = 5  # by which a gentle driver is slower than the sight allows [km/h]

_WISHED = {
    Wish.U_TURN: ActionValue.U_TURN,
    Wish.SWITCH_LEFT: ActionValue.LANE_SWITCH,
    Wish.SWITCH_RIGHT: ActionValue.LANE_SWITCH,
}
"""Action of each manoeuvre that the participant may have requested."""


_UNMENTIONED = frozenset({ObjectClass.UNLABELED, ObjectClass.TRAFFIC_SIGN})
"""Reasons to stand that nobody explains: none, and a stop sign."""


def take_initiative(state: CoWizardState, view: CoWizardView, rng: np.random.Generator) -> None:
    """Queues at most one remark, if none is queued or being spoken; drops the reason for an ended standstill."""
    if not view.standing and any(_explains_standing(item) for item in state.speech.queue):
        state.speech = state.speech.without_statements(frozenset({Predicate.BECAUSE}))
    if not state.speech.idle or view.speaking > 0.0:
        return
    for consider in (
        _give_up_wish,
        _ask_way,
        _say_arrived,
        _mention_localization,
        _ask_goal,
        _explain_hazard,
        _mention_camera,
        _mention_weather,
        _look_around,
    ):
        consider(state, view, rng)
        if not state.speech.idle:
            return


def _explains_standing(item: Remark) -> bool:
    """Returns whether a remark states, unasked, why the car stands."""
    return item.act.move is DialogueMove.EXPLAIN and any(said.predicate is Predicate.BECAUSE for said in item.meaning)


def scene_of(state: CoWizardState, view: CoWizardView) -> WordingContext:
    """Returns the context that utterances may refer to: street, landmark nearby, and whether there is an exception."""
    landmark = nearest_landmark(view.raw, view.landmarks, *view.position)
    street = street_of(view.raw, state.town, view.lane)
    blocked = view.motion is Motion.HAZARD and view.hazard is ObjectClass.STATIC
    return WordingContext(
        street=street if street is not StreetName.UNKNOWN else None,
        landmark=landmark.name if landmark is not None else None,
        exception=state.dialogue.detour_asked_at is not None or blocked,
        owner=state.beliefs.owner if state.beliefs.goal is LandmarkName.HOUSE else None,
        friend=state.beliefs.friend if state.beliefs.goal is LandmarkName.PERSON else None,
    )


def _give_up_wish(state: CoWizardState, view: CoWizardView, rng: np.random.Generator) -> None:
    wish = state.intentions.wish
    if wish is not None and view.time > state.intentions.wish_until:
        state.intentions = state.intentions.without_wish()
        refused = Proposition.of(Predicate.POSSIBLE, negated=True, action=_WISHED.get(wish))
        state.say(intend(Function.INFORM, refused, wording=Wording(topic="given_up")))
        if wish is Wish.U_TURN and state.route.progress is None:
            way = act_builders.action(ActionValue.QUERIED)
            state.say(intend(Function.SET_QUESTION, way, wording=Wording(topic="another_way"), joined=True))


def _ask_way(state: CoWizardState, view: CoWizardView, rng: np.random.Generator) -> None:
    choice = view.choice
    if choice is None or not _may_ask_way(state, view, choice):
        return
    progress, config, dialogue = state.route.progress, state.config, state.dialogue
    waiting = _waits_for_way(state, view)
    asked = dialogue.asked_lane == choice.lane
    silence = view.time - max(dialogue.asked_at, dialogue.heard_at)
    if (asked and not waiting) or silence < config.ask_interval * asked:
        return
    if waiting and dialogue.way_asks >= UNANSWERED:
        go_on_unanswered(state, choice)
        return
    guided = state.beliefs.goal is not None and progress is None
    straight = any(way.type is LinkType.STRAIGHT for way in choice.exits)
    optional = guided and straight and not waiting
    told_to_wait = view.time - dialogue.sent_on_at < SENT_ON
    if optional and (dialogue.considered_lane == choice.lane or told_to_wait):
        return
    state.dialogue = dialogue.after_considering(choice.lane)
    if optional and rng.random() > state.style.asks:
        return  # without an answer the car goes straight on
    state.dialogue = state.dialogue.after_asking_way(choice.lane, view.time)
    pausing = state.intentions.pausing or (progress is None and bool(rng.random() < state.style.careful))
    state.intentions = state.intentions.with_pause(pausing)
    if state.beliefs.goal is None and dialogue.heard_at >= 0.0 and silence > config.goal_interval:
        # the place may have been misheard, and asking for it helps more than asking for the way
        state.say(intend(Function.SET_QUESTION, act_builders.destination(LandmarkName.QUERIED)))
    elif not asked and rng.random() < state.style.proposes and probable_way(state, view, choice) is not None:
        propose_way(state, view, choice, rng)
    else:
        state.dialogue = state.dialogue.with_proposal(None)
        first = plan_remark(state, view, rng)
        asked_way = intend(Function.SET_QUESTION, act_builders.action(ActionValue.QUERIED), joined=bool(first))
        state.say(*first, asked_way)


def _waits_for_way(state: CoWizardState, view: CoWizardView) -> bool:
    """Returns whether the car stands before a junction because it does not know the way."""
    return view.motion is Motion.WAITING or (state.intentions.pausing and view.motion is Motion.STOPPED)


def _may_ask_way(state: CoWizardState, view: CoWizardView, choice: Choice) -> bool:
    """Returns whether the way at a junction is unknown and the junction is near."""
    intentions, progress = state.intentions, state.route.progress
    creeps = intentions.creeping and view.motion is not Motion.WAITING
    busy = intentions.halted or creeps or intentions.nudge is not None
    if busy or view.time < state.config.first_word or intentions.wish is Wish.U_TURN or view.manoeuvring:
        return False
    waiting = _waits_for_way(state, view)
    near = waiting or choice.distance < reach_at(state.config.ask_distance, view.speed, state.town)
    if not near or wanted_exit(state, view) is not None:
        return False
    if progress is not None and state.beliefs.exact and not waiting:
        return False  # the car finds its own way, and is only beside it for a moment
    if progress is not None:
        crossing = progress.next_crossing(state.town, view.station)
        if crossing is None or progress.changes_before(crossing):
            return False  # the goal or a U-turn comes before the junction
    return waiting or view.manoeuvre is not PhysicalAction.J_TURN


def _say_arrived(state: CoWizardState, view: CoWizardView, rng: np.random.Generator) -> None:
    goal, stays = state.beliefs.goal, state.intentions.arrived and state.intentions.halted and view.standing
    if not stays or goal is None or state.dialogue.asked_at > state.commands.stop_sent_at:
        return
    state.dialogue = state.dialogue.after_asking(view.time)
    arrived = Proposition.of(Predicate.ARRIVED, place=goal)
    if state.beliefs.exact and rng.random() < state.style.echoes + 0.5:
        state.say(intend(Function.INFORM, arrived), *arrival_reminder(state, rng))
    elif not state.beliefs.exact:
        state.say(intend(Function.PROPOSITIONAL_QUESTION, arrived, elided=("place",)))


def _ask_goal(state: CoWizardState, view: CoWizardView, rng: np.random.Generator) -> None:
    intentions, dialogue, config = state.intentions, state.dialogue, state.config
    goal = state.beliefs.goal
    stopped = view.time - dialogue.stop_instructed_at < config.recent_stop
    unknown = goal is not None and not state.beliefs.exact
    lost = unknown and intentions.halted and not (intentions.arrived or stopped)
    idle = (
        (goal is None or lost)
        and intentions.directive is None
        and intentions.wish is None
        and intentions.nudge is None
        and not state.plan.steps
        and state.route.progress is None
    )
    if not idle or intentions.creeping:
        state.dialogue = dialogue.busy(view.time)
        return
    if view.time - dialogue.idle_since < (config.next_delay if intentions.halted else config.start_delay):
        return
    silent = view.time - max(dialogue.asked_at, state.speech.last_end)
    unanswered = silent < config.goal_interval and dialogue.asked_at > dialogue.heard_at
    if unanswered or not (intentions.halted or view.standing):
        return
    unheard = dialogue.asked_at > dialogue.heard_at
    state.dialogue = dialogue.after_asking(view.time)
    draw = rng.random()
    if unheard and draw < 0.5:
        state.say(intend(Function.FEEDBACK_ELICITATION, wording=Wording(topic="hearing")))
    elif lost:
        street = draw < 0.75 and not (state.beliefs.described or state.beliefs.streets)
        asked = act_builders.located(goal, StreetName.QUERIED) if street else act_builders.action(ActionValue.QUERIED)
        state.say(intend(Function.SET_QUESTION, asked))
    elif state.beliefs.statuses and draw < 0.25:
        state.say(intend(Function.SET_QUESTION, act_builders.errand(None, GoalStatus.QUERIED)))
    else:
        state.say(intend(Function.SET_QUESTION, act_builders.destination(LandmarkName.QUERIED)))


def _explain_hazard(state: CoWizardState, view: CoWizardView, rng: np.random.Generator) -> None:
    commands, config = state.commands, state.config
    resting = view.time < commands.rest_until
    hazard = commands.rest_for if resting else view.hazard
    if not (resting or view.motion is Motion.HAZARD) or state.standstill.since is None:
        return
    if hazard in _UNMENTIONED or view.time - state.standstill.since < config.hazard_delay:
        return
    again = state.dialogue.hazard_explained_at >= state.standstill.since
    interval = config.hazard_again if again else config.hazard_interval
    if view.time - state.dialogue.hazard_explained_at < interval:
        return
    state.dialogue = state.dialogue.after_explaining_hazard(view.time)
    if rng.random() < (0.85 if hazard is ObjectClass.TRAFFIC_LIGHT else 0.4):
        return  # most hazards, red lights above all, are obvious to the participant
    reason = reason_to_stand(state.knowledge, view)
    if reason is None:
        return
    stands = Proposition.of(Predicate.STANDS, action=ActionValue.STOP)
    because = Proposition.of(Predicate.BECAUSE, effect=stands, cause=reason)
    full = resting or rng.random() < 0.3
    wording = Wording(topic="because_standing" if full else "because")
    elided = () if full else ("effect",)
    state.say(intend(Function.INFORM, because, elided=elided, wording=wording, expires=view.time + HAZARD_EXPIRES))


def _mention_camera(state: CoWizardState, view: CoWizardView, rng: np.random.Generator) -> None:
    """Reports a camera failure, drives more slowly and asks for help; reports when the camera works again."""
    fault, known = camera_fault(view.raw), state.dialogue.view_fault
    if fault is known:
        return
    state.dialogue = state.dialogue.with_view_fault(fault)
    if fault is None and known is not None:
        state.intentions = state.intentions.with_speed(state.intentions.usual)
        if rng.random() < state.style.notices:
            state.say(fault_remark(known, over=True))
        return
    if fault is None or known is not None:
        return  # the picture changes, the fault stays
    if any(said.predicate is Predicate.FAILED for item in state.speech.said[-_JUST_TOLD:] for said in item.meaning):
        _slower(state, view)  # it has answered a question about it
        return
    effect = (view_remark(Limit.CAMERA, sight(view.raw), rng),) if rng.random() < state.style.rambles else ()
    failed = fault_remark(fault, joined=bool(effect))
    state.say(*effect, failed, *_slower(state, view))
    if state.beliefs.goal is not None and rng.random() < state.style.asks:
        state.say(intend(Function.REQUEST, wording=Wording(topic="help"), joined=True))


def _slower(state: CoWizardState, view: CoWizardView) -> tuple[Remark, ...]:
    """Lowers the speed to one suitable for the sight distance, if it is higher, and returns the announcement."""
    speed = suitable_speed(sight(view.raw)) - _CAUTION * state.style.gentle
    if state.intentions.speed <= speed or view.standing:
        return ()
    state.intentions = state.intentions.with_speed(speed)
    wording = Wording(faster=False, speed=speed)
    return (
        intend(
            Function.INFORM, act_builders.action(ActionValue.SPEED_CHANGE, speed=speed), wording=wording, joined=True
        ),
    )


def _mention_weather(state: CoWizardState, view: CoWizardView, rng: np.random.Generator) -> None:
    """Mentions fog, rain or darkness once; proposes to slow down, or switches on the lights."""
    limit = limit_of(view.raw)
    dark = is_dark(view.raw) and not view.lights
    bad = limit in (Limit.FOG, Limit.RAIN)
    if limit is Limit.CAMERA or (not bad and not dark):
        state.dialogue = state.dialogue.with_weather_mentioned(bad and state.dialogue.weather_mentioned)
        return
    if state.dialogue.weather_mentioned or view.standing:
        return
    state.dialogue = state.dialogue.with_weather_mentioned(True)
    condition = Limit.NIGHT if limit is None else limit
    if state.dialogue.noticed.has_mentioned(PARAMETER[condition]) or rng.random() < state.config.leaves_weather:
        return
    noticed = state.dialogue.noticed.with_mention(PARAMETER[condition], high=True)
    state.dialogue = state.dialogue.with_noticed(noticed)
    state.say(view_remark(condition, sight(view.raw), rng))
    speed = suitable_speed(sight(view.raw)) - _CAUTION * state.style.gentle
    if bad and state.intentions.speed > speed:
        if rng.random() < state.style.checks + 0.3:
            state.dialogue = state.dialogue.with_slower(speed)
            content = act_builders.action(ActionValue.SPEED_CHANGE, speed=speed)
            state.say(intend(Function.OFFER, content, wording=Wording(faster=False, speed=speed), joined=True))
        else:
            state.say(*_slower(state, view))
    elif dark:
        state.intentions = state.intentions.with_lights(True)
        content = act_builders.action(ActionValue.LIGHT_CHANGE)
        state.say(intend(Function.INFORM, content, wording=Wording(lights=True, topic="own_lights"), joined=True))


def _look_around(state: CoWizardState, view: CoWizardView, rng: np.random.Generator) -> None:
    """Mentions, with some probability, a weather change or a crowd, after leaving time to the participant."""
    silence = view.time - max(state.dialogue.heard_at, state.speech.last_end)
    if state.count % state.config.looks_every or silence < state.config.looks_after:
        return  # the participant sees the same, and may be about to speak of it
    said, noticed = notice(
        state.dialogue.noticed, view.raw, view.objects, rng, chance=state.style.notices, handled=_HANDLED
    )
    state.dialogue = state.dialogue.with_noticed(noticed)
    if said is not None:
        state.speech = state.speech.hold(view.time + state.config.remark_delay)  # both may notice at the same moment
        state.say(said)


def _mention_localization(state: CoWizardState, view: CoWizardView, rng: np.random.Generator) -> None:
    """Reports once that the position is only estimated by dead reckoning."""
    config, mentioned = state.config, state.dialogue.lost_mentioned
    if mentioned and is_localised(view, config.found_variance):
        state.dialogue = state.dialogue.with_lost_mentioned(False)
    elif not mentioned and not is_localised(view, config.gps_variance):
        state.dialogue = state.dialogue.with_lost_mentioned(True)
        state.say(fault_remark(Sensor.GPS))


def announce_action(
    state: CoWizardState, view: CoWizardView, physical: Physical | None, rng: np.random.Generator
) -> None:
    """Announces, with some probability, a planned manoeuvre."""
    spoken = not state.speech.idle or view.speaking > 0.0
    if physical is None or spoken or state.intentions.directive is not None:
        return
    action = NAMED_ACTIONS.get(physical.action)
    chance = max(state.style.announces, _ANNOUNCES_U_TURN) if action is ActionValue.U_TURN else state.style.announces
    if action is None or state.intentions.wish is not None or rng.random() > chance:
        return
    named = any(action in item.act.slots for item in state.speech.said[-2:])
    if named and state.speech.has_just_spoken(view.time, _JUST_SAID):
        return
    street: StreetName | None = None
    direction = Direction.LEFT if physical.angle > 0 else Direction.RIGHT
    if action is ActionValue.J_TURN:
        way = wanted_exit(state, view)
        if way is None or direction_of(way) is Direction.STRAIGHT:
            return
        direction = direction_of(way)
        street = street_of(view.raw, state.town, way.lane) if rng.random() < 0.6 else None
    content = act_builders.action(action, direction=direction, street=street)
    state.say(intend(Function.INFORM, content, wording=Wording(direction=direction)))
