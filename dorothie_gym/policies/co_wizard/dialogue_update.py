"""State update from an utterance of the participant: one reaction for each dialogue move and each action named."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.dialogue.intentions import CommunicativeFunction as Function
from dorothie_gym.dialogue.reactions import is_greeting
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import ActionValue, GoalStatus, LandmarkName, Slot, StreetName
from dorothie_gym.policies import act_builders
from dorothie_gym.policies.co_wizard.acknowledgement import (
    STEERING_AWAY,
    accept_change,
    acknowledge,
    sign_of_hearing,
    what_keeps,
)
from dorothie_gym.policies.co_wizard.answer_merging import in_one_breath, is_plain_sign, still_due
from dorothie_gym.policies.co_wizard.answers import (
    answer_check,
    answer_open,
    answer_yes_no,
    asks_to_act,
)
from dorothie_gym.policies.co_wizard.clarification_requests import ask_back, explain_differently
from dorothie_gym.policies.co_wizard.described_looks import looks_heard, take_up_look, without_looks
from dorothie_gym.policies.co_wizard.destinations import (
    abandon,
    accept_offer,
    accept_street,
    approach_stop,
    complete,
    doubt,
    hear_description,
    is_on_another_street,
    plan_route,
    postpone,
    set_goal,
)
from dorothie_gym.policies.co_wizard.errand_memory import note_friend, note_owner, remember, without_purposes
from dorothie_gym.policies.co_wizard.instructed_actions import OBEYED, do_stop, do_turn, limit_remark
from dorothie_gym.policies.co_wizard.intentions import Directive
from dorothie_gym.policies.co_wizard.obstacles import take_detour
from dorothie_gym.policies.co_wizard.places_ahead import distance_ahead
from dorothie_gym.policies.co_wizard.plan_acceptance import is_incomplete, planned_acts, settle_with_order, take_plan
from dorothie_gym.policies.co_wizard.refusals import answer_in_any_case, refuse_unmet
from dorothie_gym.policies.co_wizard.repairs import (
    ask_for_known_place,
    check_goal,
    expects_stop,
    is_garbled,
    is_here,
    is_lost_order,
    is_murmur,
    is_settled,
    is_unclear,
    is_unclear_reply,
    names_unknown_place,
    note_contradiction,
    repeat_last,
)
from dorothie_gym.policies.co_wizard.repetition import note_order
from dorothie_gym.policies.co_wizard.small_remarks import take_statement
from dorothie_gym.policies.heard_utterance import HeardUtterance, heard_utterance
from dorothie_gym.policies.mood import Happening
from dorothie_gym.policies.observation_parser import COMMON
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.speech import intend
from dorothie_gym.policies.turn_lanes import junction_meant

if TYPE_CHECKING:
    from dorothie_gym.dialogue.nlu import ParsedText
    from dorothie_gym.policies.co_wizard.state import CoWizardState
    from dorothie_gym.policies.co_wizard.view import CoWizardView

FAR = 150
"""Distance up to which the car is sent to a place ahead, rather than along a road [m]."""

_STEERING = frozenset(
    {ActionValue.J_TURN, ActionValue.U_TURN, ActionValue.LANE_FOLLOW, ActionValue.LANE_SWITCH, ActionValue.START}
)
_COMMANDS = _STEERING | {ActionValue.STOP}
_IDLE = frozenset({DialogueMove.IRRELEVANT, DialogueMove.ALIGN})
_WAYS = frozenset({ActionValue.J_TURN, ActionValue.LANE_FOLLOW, ActionValue.U_TURN})
_STOP_AHEAD = frozenset({ActionValue.STOP, ActionValue.LANE_FOLLOW})
_UNNAMED = (LandmarkName.UNKNOWN, LandmarkName.QUERIED)


def listen(state: CoWizardState, view: CoWizardView, rng: np.random.Generator) -> None:
    """Updates the state with the participant's utterances since the last decision, and queues answers."""
    last = state.speech.last
    after, question = (None, "") if last is None else (last.act.move, last.text)
    heard = heard_utterance(view.raw, Role.PARTICIPANT, after, question)
    if heard is None:
        return
    state.dialogue = state.dialogue.after_hearing(view.time, heard.words.text)
    state.speech = state.speech.heard_other(view.time, heard.acts, rng, state.clock.interval / 2.0)
    if state.persona is not None:
        reaction = state.persona.draw_reaction(rng) - state.clock.interval / 2.0
        state.commands = state.commands.reacting_until(view.time + reaction)
    done = any(GoalStatus.COMPLETE in act.slots for act in heard.acts)
    state.speech = state.speech.without_told(heard.words.told)
    before, behind = ((), ()) if done else still_due(state, heard.acts)
    state.speech = state.speech.cleared()
    if is_murmur(state, view, heard):
        state.say(*before, *behind)
        return
    unclear = is_unclear(state, view, heard) or is_incomplete(state, view, heard)
    if unclear and is_garbled(heard.words) and expects_stop(state, view, heard.words):
        do_stop(state, view, heard.acts[0], heard.words)
    looks = looks_heard(state, heard)
    heard = without_purposes(without_looks(heard, looks))
    refused = refuse_unmet(state, heard)
    planned = planned_acts(state, heard) - looks.keys() - refused
    if (unclear or (_mishears(state, view, heard, rng) and not planned and not looks)) and not refused:
        ask_back(state, view, heard.words)
        state.say(*before)
        return
    state.dialogue = state.dialogue.with_noticed(state.dialogue.noticed.after_hearing(heard.words, view.time))
    note_owner(state, view, heard)
    note_friend(state, heard)
    for number, act in enumerate(heard.acts):
        if number in looks:
            take_up_look(state, looks[number], rng)
        if number in looks or number in refused:
            continue
        idle = act.move in _IDLE or (act.move is DialogueMove.REPLY_W and heard.classified and not act.slots)
        asks = idle and heard.words.question and heard.words.asked is not None
        react = answer_open if asks else _REACTIONS.get(act.move)
        if react is not None and number not in planned:
            # an act without content is judged by the whole utterance: how short it is tells whether it was misheard
            react(state, view, act, heard.words_of(number) if act.slots else heard.words, rng)
    if planned:
        take_plan(state, view, heard, rng)
    answer_in_any_case(state, heard, planned)
    remember(state, heard, rng)
    answer = in_one_breath(state.speech.queue)
    before = tuple(itertools.dropwhile(is_plain_sign, before))  # the "okay" to what was said before comes too late
    if before:
        before = (replace(before[0], joined=False), *before[1:])
    state.speech = state.speech.cleared().plan(*before, *answer, *behind)


def _mishears(state: CoWizardState, view: CoWizardView, heard: HeardUtterance, rng: np.random.Generator) -> bool:
    """Returns whether an instruction is not understood; never an urgent one, nor one that would not be repeated.

    It is a fault that is acted where acts are observed; who reads words makes faults of its own.
    """
    act = heard.acts[0]
    if heard.classified or len(heard.acts) > 1 or act.move is not DialogueMove.INSTRUCT or act.values(Slot.STATUS):
        return False
    plain = ActionValue.J_TURN in act.values(Slot.ACTION) or bool(act.values(Slot.LANDMARK))
    overhears = plain and not act.values(Slot.ACTION)[1:] and rng.random() < state.style.mishears
    return overhears and state.speech.may_ask_back(view.time)


def _instruction(
    state: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    landmarks = tuple(name for name in act.values(Slot.LANDMARK) if name not in _UNNAMED)
    actions = tuple(value for value in act.values(Slot.ACTION) if isinstance(value, ActionValue) and value in OBEYED)
    if words.parse is not None and words.parse.forbidding:
        actions = (ActionValue.LANE_FOLLOW,)  # "don't turn here"
    streets = tuple(name for name in act.values(Slot.STREET) if isinstance(name, StreetName))
    if words.parse is not None and words.parse.contingent and not words.plan.steps:
        state.say(intend(Function.REQUEST, wording=Wording(topic="tell_if")))  # "stop as soon as the rain stops"
    elif not actions and landmarks:
        _instructed_place(state, view, act, words, rng)
    elif words.distance is not None and not view.standing and _STOP_AHEAD & set(actions) and words.distance <= FAR:
        name = landmarks[0] if landmarks and isinstance(landmarks[0], LandmarkName) else None
        approach_stop(state, view, name, float(words.distance))
        if state.speech.idle:
            state.say(sign_of_hearing("ordered"))
    elif actions:
        _obey(state, view, act, actions, words, rng)
    elif streets:
        _instructed_street(state, view, streets[0])
    elif state.dialogue.detour_asked_at is not None:
        take_detour(state, view, rng)
    elif not act.slots and names_unknown_place(state, words):
        ask_for_known_place(state, view)
    elif not act.slots:
        state.dialogue = state.dialogue.with_orders_settled()  # another route may be tried
        _senseless(state, view, act, words, asks=state.beliefs.goal is None or is_garbled(words))


def _senseless(state: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText, *, asks: bool) -> bool:
    """Stops after meaningless words if a stop is expected, or else asks again; returns whether it did either."""
    if is_garbled(words) and expects_stop(state, view, words):
        do_stop(state, view, act, words)
        return True
    if asks:
        ask_back(state, view, words)
    return asks


def _obey(
    state: CoWizardState,
    view: CoWizardView,
    act: DialogueAct,
    actions: Sequence[ActionValue],
    words: ParsedText,
    rng: np.random.Generator,
) -> None:
    """Carries out and acknowledges requested actions."""
    if state.intentions.arrived and _STEERING & set(actions) and not words.further:
        doubt(state)
    state.dialogue = state.dialogue.with_proposal(None)
    if _STEERING & set(actions):
        state.dialogue = state.dialogue.after_steering(view.time)
        if not state.beliefs.exact:  # the car is guided and need not search for the place
            state.route = state.route.with_progress(None)
    settle_with_order(state, actions, words)
    contradicts = note_contradiction(state, view, actions[0], words.direction, words.ordinal)
    for action in actions:
        OBEYED[action](state, view, act, words)
    answers = act.move is not DialogueMove.INSTRUCT and actions[0] in _WAYS
    keeps = what_keeps(state, view, actions[0])
    limited = limit_remark(state, view, words.speed) if ActionValue.SPEED_CHANGE in actions and words.speed else ()
    if limited:
        state.say(*limited)
    elif keeps is None or actions[0] in STEERING_AWAY:
        acknowledge(state, view, actions[0], words, rng, answers=answers)
    if keeps is not None:
        state.say(replace(keeps, joined=not state.speech.idle))
    note_order(state, view, actions[0])
    if contradicts:
        check_goal(state, view)


def _instructed_place(
    state: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    landmarks = act_builders.named_landmarks(act)
    statuses, streets = act.values(Slot.STATUS), act.values(Slot.STREET)
    # where the town has several, the one that the car is being guided to is meant, not another one on its map
    known = state.beliefs.exact or state.beliefs.described or landmarks[0] in COMMON
    if GoalStatus.ABANDONED in statuses:
        _abandoned_place(state, view, act, words, rng)
    elif GoalStatus.PENDING in statuses:
        postpone(state, view, landmarks[0], rng)
    elif landmarks[0] is state.beliefs.goal and known and not state.intentions.arrived and not streets:
        state.intentions = state.intentions.resumed()
        state.say(intend(Function.POSITIVE_FEEDBACK, act_builders.destination(landmarks[0])))
    else:
        state.plan = state.plan.dropped()
        set_goal(
            state, view, landmarks[0], act_builders.named_streets(act), rng, sure=landmarks[0] not in words.guessed
        )


def _abandoned_place(
    state: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    """Abandons a place, possibly in favour of another one, now or later."""
    landmarks = act_builders.named_landmarks(act)
    dropped = next((name for name in words.dropped if name in landmarks), landmarks[0])
    others = [name for name in landmarks if name is not dropped]
    if others and GoalStatus.PENDING in act.values(Slot.STATUS):
        beliefs = state.beliefs.with_status(dropped, GoalStatus.ABANDONED)
        state.beliefs = beliefs.with_status(others[0], GoalStatus.PENDING)
        wording = Wording(topic="changed", dropped=dropped)
        later = act_builders.errand(others[0], GoalStatus.PENDING)
        state.say(intend(Function.ACCEPT, later, elided=("status",), wording=wording))
    elif others:
        set_goal(state, view, others[0], act_builders.named_streets(act), rng, dropped=dropped)
    else:
        abandon(state, dropped)
        accept_change(state, act_builders.errand(dropped, GoalStatus.ABANDONED), rng)


def _instructed_street(state: CoWizardState, view: CoWizardView, street: StreetName) -> None:
    if state.dialogue.detour_asked_at is not None:
        state.dialogue = state.dialogue.with_detour_question(None)
        state.intentions = state.intentions.resumed()
        plan_route(state, view)
        over = act_builders.action(None, street=street)
        state.say(intend(Function.ACCEPT, over, wording=Wording(topic="detour")))
        return
    junction = junction_meant(state.town, view.here, view.choice)
    directive = Directive(direction=None, street=street, junction=-1 if junction is None else junction.junction)
    state.intentions = state.intentions.directed(directive).resumed()
    state.say(intend(Function.ACCEPT, act_builders.action(None, street=street), wording=Wording(topic="taken")))


# --- other moves ----------------------------------------------------------------------------------------------------


def _explanation(
    state: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    landmarks, statuses = act_builders.named_landmarks(act), act.values(Slot.STATUS)
    name = landmarks[0] if landmarks else None
    if _COMMANDS & set(act.values(Slot.ACTION)):
        _instruction(state, view, act, words, rng)  # "you should be turning left" counts as an instruction
    elif name is not None and name is state.beliefs.goal and (ahead := distance_ahead(state, words)) is not None:
        approach_stop(state, view, name, ahead)
        if rng.random() > state.style.silent:
            state.say(sign_of_hearing("near"))
    elif is_here(state, view, words):
        do_stop(state, view, act, words)
        stops = act_builders.action(ActionValue.STOP)
        state.say(intend(Function.ACCEPT, stops, wording=Wording(topic="stops_here")))
    elif GoalStatus.COMPLETE in statuses:
        state.feel(Happening.DONE, view.time)
        complete(state, name)
        if rng.random() < 0.8:
            state.say(sign_of_hearing("done"))
    elif GoalStatus.ABANDONED in statuses:
        abandon(state, name)
        if name is None:
            state.say(sign_of_hearing("told"))
        else:
            accept_change(state, act_builders.errand(name, GoalStatus.ABANDONED), rng)
    elif name is not None and not statuses and (state.beliefs.goal is None or state.intentions.arrived):
        _mentioned_place(state, view, act, words, name, rng)
    elif act.values(Slot.STREET):
        hear_description(state, view, act_builders.named_streets(act), landmarks, rng)
    elif act.slots or not _senseless(state, view, act, words, asks=is_lost_order(state, view, words)):
        take_statement(state, view, act, words, rng)


def _mentioned_place(
    state: CoWizardState,
    view: CoWizardView,
    act: DialogueAct,
    words: ParsedText,
    name: LandmarkName,
    rng: np.random.Generator,
) -> None:
    """Takes a place that is mentioned while there is no goal as the next goal, unless the car stands at it."""
    if name is state.beliefs.goal:
        ask_back(state, view, words)
    else:
        set_goal(state, view, name, act_builders.named_streets(act), rng, sure=False)


def _reply(
    state: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    """Processes an answer to an open question, or a clarification: an action, a direction or a place."""
    asked_elsewhere = view.choice is not None and state.dialogue.asked_lane not in (-1, view.choice.lane)
    if act.move is DialogueMove.REPLY_W and asked_elsewhere and state.beliefs.exact and words.turns:
        return  # the car has passed the junction in question and now knows the way
    if act.values(Slot.ACTION):
        _instruction(state, view, act, words, rng)
    elif words.turns:
        state.dialogue = state.dialogue.with_proposal(None)
        if not state.beliefs.exact:
            state.route = state.route.with_progress(None)
        do_turn(state, view, act, words)
        acknowledge(state, view, ActionValue.J_TURN, words, rng, answers=True)
    elif act.values(Slot.STREET) or act.values(Slot.LANDMARK):
        _reply_with_place(state, view, act, rng)
    elif is_unclear_reply(state, view, act, words):
        ask_back(state, view, words)
    elif rng.random() < 0.5:
        state.say(sign_of_hearing("answered"))


def _reply_with_place(state: CoWizardState, view: CoWizardView, act: DialogueAct, rng: np.random.Generator) -> None:
    landmarks, streets, goal = act_builders.named_landmarks(act), act_builders.named_streets(act), state.beliefs.goal
    other = bool(landmarks) and (goal is not landmarks[0] or is_on_another_street(state, view, streets))
    if act.move is DialogueMove.CLARIFY and other:
        set_goal(state, view, landmarks[0], streets, rng, corrected=True)
    elif (goal is None or state.intentions.arrived) and landmarks:
        set_goal(state, view, landmarks[0], streets, rng)
    elif act.move is DialogueMove.CLARIFY and landmarks and state.beliefs.exact:
        state.say(intend(Function.ACCEPT, act_builders.destination(landmarks[0]), wording=Wording(topic="taken")))
    else:
        hear_description(state, view, streets, landmarks, rng)


def _yes(
    state: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    dialogue = state.dialogue
    if dialogue.offer is not None:
        accept_offer(state, view)
    elif dialogue.offered_street is not None:
        accept_street(state, view)
    elif dialogue.detour_asked_at is not None:
        take_detour(state, view, rng)
    elif dialogue.proposed is not None:
        if dialogue.proposed.junction == view.junction and state.intentions.directive is None:
            state.intentions = state.intentions.directed(dialogue.proposed).resumed()
        state.dialogue = dialogue.with_proposal(None)
    elif dialogue.slower is not None:
        speed = dialogue.slower
        state.dialogue = dialogue.with_slower(None)
        state.intentions = state.intentions.with_speed(speed)
        wording = Wording(faster=False, speed=speed)
        state.say(intend(Function.INFORM, act_builders.action(ActionValue.SPEED_CHANGE, speed=speed), wording=wording))


def _no(
    state: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    state.feel(Happening.MISUNDERSTOOD, view.time)
    state.dialogue = state.dialogue.after_refusal()
    if state.intentions.arrived:
        doubt(state)
    if words.turns and not act.values(Slot.ACTION):
        do_turn(state, view, act, words)


def _yes_no_question(
    state: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    """Answers a question, or carries out what is asked for in the form of one: "could you stop here?"."""
    if asks_to_act(act, words):
        _instruction(state, view, act, words, rng)
    else:
        answer_yes_no(state, view, act, words, rng)


def _alignment(
    state: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    if state.beliefs.goal is not None or state.intentions.directive is not None:
        state.say(sign_of_hearing("hears" if words.about_hearing else "align"))
    else:
        ask_back(state, view, words)


def _confusion(
    state: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    """Repeats a remark that was not understood; another time, expresses it differently."""
    state.feel(Happening.MISUNDERSTOOD, view.time)
    if is_settled(state, view, words):
        return
    if state.speech.has_just_asked_back or state.speech.turns_of_repair(view.time):
        explain_differently(state, view, words, rng)
    else:
        repeat_last(state)


def _small_talk(
    state: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    if is_greeting(words.text):
        return _alignment(state, view, act, words, rng)
    awaited = not state.beliefs.statuses or view.time - state.dialogue.asked_at < state.config.answer_time
    expected = awaited and state.beliefs.goal is None and state.intentions.directive is None
    if _senseless(state, view, act, words, asks=expected):
        return
    if rng.random() < state.style.chats:
        replies = intend(Function.OTHER, wording=Wording(topic="reply"))
        state.say(replies if rng.random() < 0.6 else sign_of_hearing("chat"))


_REACTIONS: dict[
    DialogueMove, Callable[[CoWizardState, CoWizardView, DialogueAct, ParsedText, np.random.Generator], None]
] = {
    DialogueMove.INSTRUCT: _instruction,
    DialogueMove.EXPLAIN: _explanation,
    DialogueMove.REPLY_W: _reply,
    DialogueMove.CLARIFY: _reply,
    DialogueMove.REPLY_Y: _yes,
    DialogueMove.CONFIRM: _yes,
    DialogueMove.REPLY_N: _no,
    DialogueMove.ALIGN: _alignment,
    DialogueMove.CHECK: answer_check,
    DialogueMove.CONFUSE: _confusion,
    DialogueMove.IRRELEVANT: _small_talk,
    DialogueMove.QUERY_YN: _yes_no_question,
    DialogueMove.QUERY_W: answer_open,
}
