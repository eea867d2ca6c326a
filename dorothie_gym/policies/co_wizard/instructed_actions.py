"""Actions that the participant requests, converted to driving goals of the Co-Wizard."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Final, TypeAlias

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.intentions import CommunicativeFunction
from dorothie_gym.dialogue.nlu import ParsedText
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.ontology.actions import SPEED_STEP
from dorothie_gym.ontology.dialogue_acts import DialogueAct
from dorothie_gym.ontology.slots import ActionValue, StreetName
from dorothie_gym.policies import act_builders
from dorothie_gym.policies.co_wizard.destinations import approach_stop
from dorothie_gym.policies.co_wizard.intentions import Directive, Wish
from dorothie_gym.policies.co_wizard.proposition_truth import speed_limit
from dorothie_gym.policies.co_wizard.state import CoWizardState
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.knowledge import TOLD_TO_STOP
from dorothie_gym.policies.route_progress import default_lane_place
from dorothie_gym.policies.scripted_agent_limits import CALM_SPEED
from dorothie_gym.policies.speech import Remark, intend
from dorothie_gym.policies.turn_lanes import junction_meant
from dorothie_gym.sim.ego.limits import MAX_CRUISE
from dorothie_gym.sim.state.codes import Motion

STRAIGHT_ON_DISTANCE = 60.0
"""Distance to a junction within which "go on" means straight across it [m]."""

SLOWER_DISTANCE = 20.0
"""Distance to a goal off the map that "slower" without a reason is taken to mean [m]."""

SOON_AGAIN = 250.0
"""Way back to a place that was missed, for which a speed is kept that was asked for [m]."""

ASKED_SPEED_CHANGE = 10
"""Change of the cruise speed for "faster" and "slower" without a number [km/h]."""

LIMIT_TOLERANCE = 3
"""Excess over the speed limit that is not remarked on [km/h]."""

SPEED_RANGE = (10, 60)
"""Range of cruise speeds that the Co-Wizard accepts in a town with slow traffic [km/h]; elsewhere up to the car's."""

_SETS_RIGHT: Final = re.compile(r"\b(i mean|i meant|no|wrong|instead|not (?:faster|slower))\b", re.I)
"""Words by which a change of the speed takes the place of the opposite one."""

Obey: TypeAlias = Callable[[CoWizardState, CoWizardView, DialogueAct, ParsedText], None]
"""Reaction to an instruction: changes the state (working copy) by the observation, the act and its words."""


def do_turn(state: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText) -> None:
    """Intends the requested turn."""
    streets, junction = act_builders.named_streets(act), junction_meant(state.town, view.here, view.choice)
    directive = Directive(
        direction=words.direction,
        street=streets[0] if streets else StreetName.UNKNOWN,
        skip=max((words.ordinal or 1) - 1, 0),
        junction=-1 if junction is None else junction.junction,
    )
    state.intentions = state.intentions.turning(directive)


def _do_follow(state: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText) -> None:
    lost = view.standing and not state.beliefs.exact  # a car that knows its way stands for the traffic
    close = state.intentions.halted or state.intentions.creeping or lost
    choice = junction_meant(state.town, view.here, view.choice)
    way = math.inf if choice is None else choice.distance
    across = words.direction is Direction.STRAIGHT or way < STRAIGHT_ON_DISTANCE
    if close and (words.further or words.distance is not None):
        distance = float(words.distance) if words.distance is not None else state.config.nudge_distance
        if distance <= way:
            state.intentions = state.intentions.nudged(default_lane_place(state.town, view.here, distance))
            return
        across = True  # at the junction, the car would wait for the way
    state.intentions = state.intentions.proceeding()
    if choice is not None and across:
        straight = Directive(direction=Direction.STRAIGHT, junction=choice.junction)
        state.intentions = state.intentions.directed(straight)


def _do_u_turn(state: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText) -> None:
    # a car that was stopped for a place off the map and now must turn round has passed it
    guided = state.beliefs.goal is not None and not state.beliefs.exact
    creeping = guided and view.time - state.dialogue.stop_instructed_at < state.config.recent_stop
    creeping = creeping and state.town.cruise is not None  # elsewhere the car drove fast, and the place is far behind
    state.intentions = state.intentions.turning_round(view.time + state.config.wish_time, creeping=creeping)
    state.dialogue = state.dialogue.with_detour_question(None).after_u_turn_instruction(view.time)


def _do_switch(state: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText) -> None:
    wish = Wish.switch(words.direction, state.town.traffic)
    state.intentions = state.intentions.switching(wish, view.time + state.config.wish_time)


def do_stop(state: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText) -> None:
    """Intends to stop here, on an instruction or because the goal is said to be here."""
    told = words.told is not None and words.told.predicate is Predicate.ARRIVED and not words.told.negated
    place = Proposition.of(Predicate.ARRIVED, place=state.beliefs.goal)
    reason = place if told and state.beliefs.goal is not None else TOLD_TO_STOP
    state.dialogue = state.dialogue.after_stop_instruction(view.time, reason)
    state.intentions = state.intentions.stopped()


def _do_start(state: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText) -> None:
    state.intentions = state.intentions.started()
    if view.motion is Motion.WAITING:  # for the way, which the instruction leaves open
        state.dialogue = state.dialogue.asking_way_again()


def _do_speed(state: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText) -> None:
    guided = state.beliefs.goal is not None and not state.beliefs.exact
    if words.speed is None and words.faster is False and guided:
        # without a reason given, the goal that is not on the map must be near
        approach_stop(state, view, None, SLOWER_DISTANCE)
        return
    asked = asked_speed(state, view, words.speed, words.faster)
    if words.speed is None and _SETS_RIGHT.search(words.text):
        asked = asked_speed(
            state, view, 2 * asked - round(view.cruise), words.faster
        )  # the other change is undone, too
    seconds = state.config.slow_time
    if words.speed is not None and guided:  # for the way back to a place that was missed
        seconds = max(seconds, 3.6 * SOON_AGAIN / asked)
    until = view.time + seconds
    state.intentions = state.intentions.with_asked_speed(asked, state.config.open_road_speed, until)
    if state.town.cruise is None and asked < state.config.open_road_speed:
        state.intentions = state.intentions.calmed(CALM_SPEED)


def asked_speed(state: CoWizardState, view: CoWizardView, speed: int | None, faster: bool | None) -> int:
    """Returns the cruise speed that the car is set to on a request [km/h].

    Args:
        state: state of the Co-Wizard.
        view: observation.
        speed: speed asked for [km/h]; None for a change.
        faster: direction of the change.
    """
    asked = speed
    if asked is None:
        asked = round(view.cruise) + (ASKED_SPEED_CHANGE if faster else -ASKED_SPEED_CHANGE)
    low, high = SPEED_RANGE
    if state.town.cruise is None:
        high = int(MAX_CRUISE)
    return min(max(int(SPEED_STEP) * round(asked / int(SPEED_STEP)), low), high)


def limit_remark(state: CoWizardState, view: CoWizardView, speed: int) -> tuple[Remark, ...]:
    """Returns the remark that the limit of the street is lower than a speed [km/h] asked for, if it is."""
    limit = speed_limit(state.town, view.lane)
    if speed < limit + LIMIT_TOLERANCE:
        return ()
    content = Proposition.of(Predicate.DRIVES_AT, speed=limit, limit=True)
    return (intend(CommunicativeFunction.INFORM, content, wording=Wording(topic="limit", speed=limit)),)


def _do_lights(state: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText) -> None:
    state.intentions = state.intentions.with_lights(words.lights is not False)


OBEYED: Final[Mapping[ActionValue, Obey]] = MappingProxyType(
    {
        ActionValue.J_TURN: do_turn,
        ActionValue.LANE_FOLLOW: _do_follow,
        ActionValue.U_TURN: _do_u_turn,
        ActionValue.LANE_SWITCH: _do_switch,
        ActionValue.STOP: do_stop,
        ActionValue.START: _do_start,
        ActionValue.SPEED_CHANGE: _do_speed,
        ActionValue.LIGHT_CHANGE: _do_lights,
    }
)
"""Reaction to an instruction, by the action that it names."""
