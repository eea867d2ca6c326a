"""Answers of the participant to checks and yes/no questions of the car."""

from __future__ import annotations

import math
import re
from collections.abc import Collection
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.intentions import CommunicativeFunction as Function
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.ontology.slots import ActionValue, LandmarkName, Slot, SlotValue, StreetName
from dorothie_gym.policies import act_builders
from dorothie_gym.policies.participant.answer_parts import addition, checked, denied, short
from dorothie_gym.policies.participant.final_approach import about_to_arrive, creep_instruction
from dorothie_gym.policies.participant.proposition_truth import LEFT_TO_THE_CAR, has_just_finished, is_elsewhere
from dorothie_gym.policies.participant.repairs import ask_back, name_step_or_place
from dorothie_gym.policies.participant.subgoals import announcement, route_length, switch_target
from dorothie_gym.policies.participant.turn_by_turn_guidance import next_step, note_step
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.route_progress import first_new_street
from dorothie_gym.policies.speech import Remark, intend

if TYPE_CHECKING:
    from dorothie_gym.dialogue.nlu import ParsedText
    from dorothie_gym.policies.observation_parser import SeenSubgoal
    from dorothie_gym.policies.participant.state import ParticipantState
    from dorothie_gym.policies.participant.view import ParticipantView

_WAYS = frozenset({ActionValue.J_TURN, ActionValue.U_TURN, ActionValue.LANE_FOLLOW, ActionValue.LANE_SWITCH})
"""Actions that determine the route."""

_ASKS_WHERE = re.compile(r"\b(where|which|tell me|what)\b")
"""Words of an open question for the way, of which a part was misheard."""

_UNASKED = frozenset({ActionValue.SPEED_CHANGE, ActionValue.LIGHT_CHANGE})
"""Actions that the car checks only if it has heard an order."""

_AHEAD = frozenset({ActionValue.LANE_FOLLOW, ActionValue.J_TURN})


def check(
    state: ParticipantState, view: ParticipantView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    """Confirms or corrects a check of the car."""
    landmarks, streets = act.values(Slot.LANDMARK), act.values(Slot.STREET)
    goal = state.task.goal
    if goal is not None and not state.task.announced and act.values(Slot.ACTION):
        _name_untold_place(state, view, rng)  # "what's left?", half heard
        return
    if goal is not None and words.order is not None and " or " in words.text:
        state.say_first(replace(go_first(goal.name), joined=False))  # "before or after the Panera?" wants no yes
        return
    where = (
        streets if not act.values(Slot.ACTION) else ()
    )  # its place may have been misheard: "the ... on Beal, right?"
    if goal is not None and (landmarks or where):
        right = landmarks in ((), (goal.name,)) and streets in ((), (goal.street,))
        if not right:
            again = intend(Function.REQUEST, act_builders.destination(goal.name, goal.street), joined=True)
            state.say_first(denied(checked(state, act, words)), again)
            return
    elif _is_unasked(state, act):
        state.say_first(denied(checked(state, act, words)))
        if goal is not None and state.task.announced:
            state.task = state.task.after_reminding(view.time)
            there = act_builders.destination(goal.name, goal.street)
            state.say(intend(Function.REQUEST, there, joined=True))
        return
    elif act.values(Slot.ACTION) and not _fits(state, view, act, words, rng):
        _refuse_with_step(state, view, act, words, rng)
        return
    if landmarks:
        state.set_guiding(False)  # the car knows the place
        state.task = state.task.after_announcement(view.time)
    wanted = checked(state, act, words)
    state.say_first(short(Function.CONFIRM, wanted), *addition(state, view, rng))


def _is_unasked(state: ParticipantState, act: DialogueAct) -> bool:
    """Returns whether the car takes up a speed or lights that were not spoken of: it has misheard something else."""
    taken_up = _UNASKED & set(act.values(Slot.ACTION))
    return bool(taken_up) and not any(taken_up & set(item.act.values(Slot.ACTION)) for item in state.speech.said)


def _fits(
    state: ParticipantState, view: ParticipantView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> bool:
    """Returns whether an action named by the car is the next step or the last instruction."""
    step = next_step(state, view, DialogueMove.INSTRUCT, rng)
    actions = set(act.values(Slot.ACTION))
    if step is None or actions & LEFT_TO_THE_CAR:
        return True
    instructed = next((item for item in reversed(state.speech.said) if item.act.values(Slot.ACTION)), None)
    lately = state.speech.has_just_spoken(view.time, state.config.checked_within)
    if instructed is not None and lately and actions & set(instructed.act.slots):
        return words.direction is None or instructed.wording.direction in (None, words.direction)
    meant, wanted = set(step[2].act.values(Slot.ACTION)), step[2].wording.direction
    if ActionValue.U_TURN in meant and actions == {ActionValue.J_TURN} and words.direction is None:
        return True  # "shall I turn?"
    if wanted is Direction.STRAIGHT:
        return bool(actions & _AHEAD) and words.direction in (None, Direction.STRAIGHT)
    return bool(actions & meant) and (wanted is None or words.direction is wanted)


def _refuse_with_step(
    state: ParticipantState, view: ParticipantView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    """Says no, and names the right step unless a stop instruction is being spoken."""
    step = next_step(state, view, DialogueMove.INSTRUCT, rng)
    refusal = denied(checked(state, act, words))
    just_stopped = view.time - state.guidance.stopped_at < state.config.just_said
    if step is None or just_stopped or (step[0][0] == "on" and step[1] < state.config.stop_distance):
        state.say_first(refusal)
        return
    key, _, instead = step
    note_step(state, view, key)
    state.say_first(refusal, replace(instead, joined=True))


def answer_yes_no(
    state: ParticipantState, view: ParticipantView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    """Answers a question that expects a yes or a no."""
    objects, landmarks = act.values(Slot.OBJECT), act.values(Slot.LANDMARK)
    offered = _offered_subgoal(state, view, landmarks)
    if _asks_about_finished(state, view, act, words):
        there = Proposition.of(Predicate.ARRIVED, place=state.task.finished[0])
        state.say_first(short(Function.AFFIRMATIVE_ANSWER, there))
    elif offered is not None:
        _answer_offer(state, view, offered)
    elif act.values(Slot.STREET) and not landmarks and not act.values(Slot.ACTION):
        _answer_street(state, view, act, rng)
    elif objects:
        seen = any(thing.kind in objects for thing in view.objects)
        sight = Proposition.of(Predicate.SEES, object=objects[0])
        state.say_first(short(Function.AFFIRMATIVE_ANSWER, sight) if seen else denied(sight))
    elif landmarks and state.task.goal is not None:
        if state.task.goal.name in landmarks and is_elsewhere(state, view):
            deny_arrival(state)
        elif state.task.goal.name in landmarks:
            state.say_first(short(Function.AFFIRMATIVE_ANSWER, words.asked or checked(state, act, words)))
        else:
            again = announcement(state, view, rng)
            state.say_first(denied(words.asked or checked(state, act, words)), replace(again, joined=True))
    elif set(act.values(Slot.ACTION)) & _WAYS:
        _answer_proposal(state, view, act, words, rng)
    elif not act.slots and is_just_short(state, view):
        correct_arrival(state, view, words.asked)
    elif words.asked is not None and words.asked.predicate is Predicate.ARRIVED and not about_to_arrive(state, view):
        deny_arrival(state)
    else:
        goal = state.task.goal
        arriving = not act.slots and goal is not None and view.standing and about_to_arrive(state, view)
        place = Proposition.of(Predicate.ARRIVED, place=goal.name) if arriving and goal is not None else None
        asked = words.asked or place or (checked(state, act, words) if act.slots else None)
        if asked is None:
            ask_back(state, view, words, rng)
            return
        unsure = (short(Function.UNCERTAIN_ANSWER, asked),) if rng.random() < state.config.unsure else ()
        yes = short(Function.AFFIRMATIVE_ANSWER, asked)
        state.say_first(*unsure, yes, *(() if unsure else addition(state, view, rng)))


def _asks_about_finished(state: ParticipantState, view: ParticipantView, act: DialogueAct, words: ParsedText) -> bool:
    """Returns whether the stationary car asks if it has arrived where an errand was just done."""
    place = state.task.finished[0]
    if not view.standing or not has_just_finished(state, view, (place,)):
        return False
    if words.asked is not None:
        return words.asked.predicate is Predicate.ARRIVED and act.slots <= {place}
    return act.slots == {place}


def _offered_subgoal(
    state: ParticipantState, view: ParticipantView, landmarks: tuple[SlotValue, ...]
) -> SeenSubgoal | None:
    """Returns the subgoal, other than the target, that the car proposes to do first."""
    if state.task.goal is None or state.task.goal.name in landmarks:
        return None
    for subgoal in view.subgoals:
        landmark = view.landmark(subgoal.landmark)
        if subgoal.open and subgoal.allowed and landmark is not None and landmark.name in landmarks:
            return subgoal
    return None


def _answer_offer(state: ParticipantState, view: ParticipantView, offered: SeenSubgoal) -> None:
    """Accepts a subgoal that is nearer than the target, and insists on the target otherwise."""
    goal, progress = state.task.destination, state.route.progress
    landmark = view.landmark(offered.landmark)
    left = progress.left(view.station) if progress is not None else math.inf
    if landmark is not None and route_length(state, view, landmark) < left:
        switch_target(state, view, offered, landmark)
        state.say_first(short(Function.AFFIRMATIVE_ANSWER, act_builders.destination(landmark.name)))
        return
    state.say_first(denied(act_builders.destination(None if landmark is None else landmark.name)), go_first(goal.name))


def go_first(name: LandmarkName) -> Remark:
    """Returns the instruction to go to a place first, as the rest of an answer."""
    return intend(Function.REQUEST, act_builders.destination(name), wording=Wording(topic="first"), joined=True)


def _name_untold_place(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    """Names the next place to a car that asks about the way before it has been told where to go."""
    state.task = state.task.after_announcement(view.time)
    state.say_only(announcement(state, view, rng))


def _answer_street(state: ParticipantState, view: ParticipantView, act: DialogueAct, rng: np.random.Generator) -> None:
    """Accepts a detour that is the participant's own, or over a street that it has named; else insists on its own."""
    if not state.task.announced and state.task.goal is not None:
        _name_untold_place(state, view, rng)  # it cannot be about the way to a place that it does not know
        return
    own = first_new_street(view.raw, state.town, view.lane, state.route.progress)
    proposed = act_builders.action(None, street=next(v for v in act.values(Slot.STREET) if isinstance(v, StreetName)))
    named = {street for item in state.speech.said for street in item.act.values(Slot.STREET)}
    if own is None or not {own, *named}.isdisjoint(act.values(Slot.STREET)):
        state.say_first(short(Function.AFFIRMATIVE_ANSWER, proposed))
        return
    over = act_builders.action(None, street=own)
    state.say_first(denied(proposed), intend(Function.REQUEST, over, wording=Wording(topic="detour"), joined=True))


def _answer_proposal(
    state: ParticipantState, view: ParticipantView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    """Confirms the right way, or else names it; names the place to a car that has not been told where to go."""
    if state.task.goal is not None and not state.task.announced:
        _name_untold_place(state, view, rng)
        return
    state.set_guiding(True)
    if words.direction is None and _ASKS_WHERE.search(words.text.lower()):
        name_step_or_place(state, view, rng)  # "please tell me where turn"
        return
    if not _fits(state, view, act, words, rng):
        _refuse_with_step(state, view, act, words, rng)
        return
    step = next_step(state, view, DialogueMove.INSTRUCT, rng)
    if step is not None:
        note_step(state, view, step[0])
    proposed = checked(state, act, words)
    first = (short(Function.UNCERTAIN_ANSWER, proposed),) if rng.random() < state.config.unsure else ()
    state.say_first(*first, short(Function.AFFIRMATIVE_ANSWER, proposed), *addition(state, view, rng))


# --- arrivals ---------------------------------------------------------------------------------------------------------


def is_just_short(state: ParticipantState, view: ParticipantView) -> bool:
    """Returns whether the car stands just before the target that it is guided to."""
    progress = state.route.progress
    if not state.guidance.guiding or not view.standing or progress is None:
        return False
    return about_to_arrive(state, view) and progress.left(view.station) > 0.0


def correct_arrival(state: ParticipantState, view: ParticipantView, said: Proposition | None = None) -> None:
    """Denies a question or statement (by default that it has arrived) of a car before the target; directs it on."""
    arrived = Proposition.of(Predicate.ARRIVED, place=state.task.destination.name)
    state.say_only(denied(said or arrived), replace(creep_instruction(state, view), joined=True))


def deny_other_place(state: ParticipantState, places: Collection[SlotValue]) -> None:
    """Corrects a car that claims to have reached another place, and names the target again."""
    if state.task.goal is None or not state.task.announced:
        return
    state.set_guiding(True)
    other = Proposition.of(Predicate.GOAL, negated=True, place=act_builders.first_name(places))
    again = intend(Function.REQUEST, act_builders.destination(state.task.goal.name), joined=True)
    state.say_only(intend(Function.NEGATIVE_ANSWER, other, elided=("place",)), again)


def deny_arrival(state: ParticipantState) -> None:
    """Corrects a car that has mistaken another place for the target."""
    if state.task.goal is None:
        state.say_first(intend(Function.UNCERTAIN_ANSWER))
        return
    state.set_guiding(True)
    away = Proposition.of(Predicate.ARRIVED, negated=True, place=state.task.goal.name)
    state.say_first(intend(Function.NEGATIVE_ANSWER, away))
