"""What the Co-Wizard makes of the human's words."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from dorothie_gym.dialogue import Direction, ParsedText, Wording
from dorothie_gym.ontology import (
    ActionValue,
    DialogueAct,
    DialogueMove,
    GoalStatus,
    LandmarkName,
    ObjectClass,
    Role,
    Slot,
    StreetName,
)
from dorothie_gym.policies.co_wizard.acknowledgement import musing, take_up
from dorothie_gym.policies.co_wizard.answers import answer_open, answer_yes_no
from dorothie_gym.policies.co_wizard.driving import place_ahead
from dorothie_gym.policies.co_wizard.goals import (
    CONFIRMS_CHANGES,
    accept_offer,
    complete,
    doubt,
    give_up,
    hear_description,
    hear_goal,
    hear_later,
    hear_stop_ahead,
    plan_way,
)
from dorothie_gym.policies.co_wizard.obstacles import detour
from dorothie_gym.policies.co_wizard.state import CoWizardState, Directive, Wish
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.observation_parser import street_of
from dorothie_gym.policies.speech import remark
from dorothie_gym.policies.utterance_input import HeardUtterance, heard_utterance

NUDGE = 3.0
"""How far "a bit further" is: less than from where a car is short of a place to where it is past it [m]."""

WISH_TIME = 30.0
"""A manoeuvre that finds no place for this long is given up [s]."""

_MOVES = frozenset(
    {ActionValue.J_TURN, ActionValue.U_TURN, ActionValue.LANE_FOLLOW, ActionValue.LANE_SWITCH, ActionValue.START}
)
_STOPS = frozenset({ActionValue.STOP, ActionValue.LANE_FOLLOW})
SLOW = 25
"""Speed in bad weather [km/h]."""

JUST_PASSED = 40.0
"""A place that the car was to stop at no longer ago than this must be near [s]."""

OPEN_ROAD = 20
"""A lower speed is for the moment only [km/h]."""

MOMENT = 40.0
"""So long a speed for the moment only is kept [s]."""

ASKED_LATELY = 12.0
"""What is said no longer than this after a question should answer it [s]."""

_ASKING = frozenset({DialogueMove.QUERY_W, DialogueMove.QUERY_YN, DialogueMove.CHECK})

_CAN_BE_REPEATED = _ASKING | {DialogueMove.EXPLAIN, DialogueMove.INSTRUCT, DialogueMove.REPLY_W}

_UNNAMED = (LandmarkName.UNKNOWN, LandmarkName.QUERIED)


def listen(mind: CoWizardState, view: CoWizardView, rng: np.random.Generator) -> None:
    """Takes in what the human has said since the last decision: believes, prepares actions and answers."""
    last = mind.voice.last
    heard = heard_utterance(view.raw, Role.PARTICIPANT, last.act.move if last is not None else None)
    if heard is None:
        return
    mind.heard_at = mind.idle_since = view.time
    mind.voice = mind.voice.heard_other(view.time, heard.acts)
    before = mind.voice.queue
    if _mishears(mind, heard, rng):
        mind.voice = mind.voice.plan_first(remark(DialogueMove.CONFUSE))
        return
    for act in heard.acts:
        react = _REACTIONS.get(act.move)
        if react is not None:
            react(mind, view, act, heard.words, rng)
    # of several acknowledgements for one utterance the first will do
    added = mind.voice.queue[len(before) :]
    kept = tuple(
        item for k, item in enumerate(added) if not k or item.act.move is not DialogueMove.ACKNOWLEDGE or item.act.slots
    )
    mind.voice = mind.voice.cleared().plan(*before, *kept)


def _mishears(mind: CoWizardState, heard: HeardUtterance, rng: np.random.Generator) -> bool:
    """Whether it does not catch what it is told: nothing urgent, and nothing that it would not be told again."""
    act = heard.acts[0]
    if len(heard.acts) > 1 or act.move is not DialogueMove.INSTRUCT or act.values(Slot.STATUS):
        return False
    plain = ActionValue.J_TURN in act.values(Slot.ACTION) or bool(act.values(Slot.LANDMARK))
    return plain and not act.values(Slot.ACTION)[1:] and rng.random() < mind.style.mishears


def _instruction(
    mind: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    landmarks = tuple(name for name in act.values(Slot.LANDMARK) if name not in _UNNAMED)
    actions = tuple(value for value in act.values(Slot.ACTION) if value in _OBEYED)
    streets = tuple(name for name in act.values(Slot.STREET) if isinstance(name, StreetName))
    if not actions and landmarks:
        _told_place(mind, view, act, words, rng)
    elif words.distance is not None and not view.standing and _STOPS & set(actions):
        name = landmarks[0] if landmarks and isinstance(landmarks[0], LandmarkName) else None
        hear_stop_ahead(mind, view, name, float(words.distance))
        if mind.voice.idle and rng.random() > mind.style.silent:
            mind.voice = mind.voice.plan(remark(DialogueMove.ACKNOWLEDGE))
    elif actions:
        if mind.arrived and _MOVES & set(actions) and not words.further:
            doubt(mind)
        mind.proposed = None
        if _MOVES & set(actions):
            mind.steered_at = view.time
        if _MOVES & set(actions) and not mind.exact:
            mind.journey = None  # it is guided, and need not look for the place by itself
        for action in actions:
            _OBEYED[action](mind, view, act, words)
        take_up(mind, actions[0], words, rng)
    elif streets:
        _told_street(mind, view, streets[0])
    elif mind.detour_at is not None:
        detour(mind, view, rng)
    elif not act.slots and mind.goal is None:
        mind.voice = mind.voice.plan(remark(DialogueMove.CONFUSE))  # what it is to do it has not understood


def _told_place(
    mind: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    landmarks = [name for name in act.values(Slot.LANDMARK) if isinstance(name, LandmarkName)]
    statuses, streets = act.values(Slot.STATUS), act.values(Slot.STREET)
    if GoalStatus.ABANDONED in statuses:
        dropped = next((name for name in words.dropped if name in landmarks), landmarks[0])
        others = [name for name in landmarks if name is not dropped]
        if others and GoalStatus.PENDING in statuses:
            mind.note_status(dropped, GoalStatus.ABANDONED)
            mind.note_status(others[0], GoalStatus.PENDING)
            wording = Wording(topic="changed", dropped=dropped)
            mind.voice = mind.voice.plan(remark(DialogueMove.CONFIRM, others[0], wording=wording))
        elif others:
            hear_goal(mind, view, others[0], _streets(streets), rng, dropped=dropped)
        else:
            give_up(mind, dropped)
            move = DialogueMove.CONFIRM if rng.random() < CONFIRMS_CHANGES else DialogueMove.ACKNOWLEDGE
            mind.voice = mind.voice.plan(remark(move, dropped, GoalStatus.ABANDONED))
    elif GoalStatus.PENDING in statuses:
        hear_later(mind, view, landmarks[0], rng)
    elif landmarks[0] is mind.goal and (mind.exact or mind.described) and not mind.arrived and not streets:
        mind.halted = False
        mind.voice = mind.voice.plan(remark(DialogueMove.ACKNOWLEDGE, landmarks[0]))
    else:
        hear_goal(mind, view, landmarks[0], _streets(streets), rng, sure=landmarks[0] not in words.guessed)


def _streets(values: tuple[object, ...]) -> tuple[StreetName, ...]:
    unnamed = (StreetName.UNKNOWN, StreetName.QUERIED)
    return tuple(name for name in values if isinstance(name, StreetName) and name not in unnamed)


def _told_street(mind: CoWizardState, view: CoWizardView, street: StreetName) -> None:
    if mind.detour_at is not None:
        mind.detour_at, mind.halted = None, False
        plan_way(mind, view)
        mind.voice = mind.voice.plan(remark(DialogueMove.CONFIRM, street, wording=Wording(topic="detour")))
        return
    mind.directive, mind.halted = Directive(direction=None, street=street, junction=view.junction), False
    mind.voice = mind.voice.plan(remark(DialogueMove.ACKNOWLEDGE, street))


# --- what actions mean ----------------------------------------------------------------------------------------------


def _do_turn(mind: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText) -> None:
    streets = _streets(act.values(Slot.STREET))
    skip = max((words.ordinal or 1) - 1, 0)
    mind.directive = Directive(
        direction=words.direction,
        street=streets[0] if streets else StreetName.UNKNOWN,
        skip=skip,
        junction=view.junction,
    )
    mind.wish, mind.halted, mind.nudge, mind.creeping, mind.arrived = None, False, None, False, False


def _do_follow(mind: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText) -> None:
    close = mind.halted or mind.creeping or view.standing
    if close and (words.further or words.distance is not None):
        distance = float(words.distance) if words.distance is not None else NUDGE
        mind.nudge, mind.halted = place_ahead(mind, view, distance), False
        return
    choice = view.choice
    mind.halted, mind.arrived, mind.creeping, mind.wish = False, False, False, None
    if choice is not None and (words.direction is Direction.STRAIGHT or choice.distance < 60.0):
        mind.directive = Directive(direction=Direction.STRAIGHT, junction=choice.junction)


def _do_u_turn(mind: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText) -> None:
    mind.wish, mind.wish_until = Wish.U_TURN, view.time + WISH_TIME
    # who has been stopped for a place that is not on the map and then is turned round has gone past it
    mind.creeping = mind.goal is not None and not mind.exact and view.time - mind.told_to_stop_at < JUST_PASSED
    mind.directive, mind.halted, mind.nudge, mind.arrived = None, False, None, False
    mind.detour_at = None


def _do_switch(mind: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText) -> None:
    right = words.direction is Direction.RIGHT
    mind.wish, mind.wish_until = Wish.SWITCH_RIGHT if right else Wish.SWITCH_LEFT, view.time + WISH_TIME
    mind.halted = False


def _do_stop(mind: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText) -> None:
    mind.told_to_stop_at = view.time
    mind.halted, mind.nudge, mind.wish = True, None, None


def _do_start(mind: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText) -> None:
    mind.halted = mind.arrived = False


def _do_speed(mind: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText) -> None:
    if words.speed is None and words.faster is False and not mind.exact:
        # nobody says why: the place that is not on the map must be near
        hear_stop_ahead(mind, view, None, 20.0)
        return
    if words.speed is not None:
        mind.speed = words.speed
    else:
        mind.speed = round(view.cruise) + (10 if words.faster else -10)
    mind.speed = min(max(5 * round(mind.speed / 5), 10), 60)
    if mind.speed >= OPEN_ROAD:
        mind.usual = mind.speed
    mind.slow_until = view.time + MOMENT


def _do_lights(mind: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText) -> None:
    mind.lights = words.lights is not False


_OBEYED: dict[ActionValue, Callable[[CoWizardState, CoWizardView, DialogueAct, ParsedText], None]] = {
    ActionValue.J_TURN: _do_turn,
    ActionValue.LANE_FOLLOW: _do_follow,
    ActionValue.U_TURN: _do_u_turn,
    ActionValue.LANE_SWITCH: _do_switch,
    ActionValue.STOP: _do_stop,
    ActionValue.START: _do_start,
    ActionValue.SPEED_CHANGE: _do_speed,
    ActionValue.LIGHT_CHANGE: _do_lights,
}


# --- other moves ----------------------------------------------------------------------------------------------------


def _explanation(
    mind: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    landmarks = [name for name in act.values(Slot.LANDMARK) if isinstance(name, LandmarkName)]
    statuses = act.values(Slot.STATUS)
    name = landmarks[0] if landmarks else None
    if _MOVES & set(act.values(Slot.ACTION)):
        _instruction(mind, view, act, words, rng)  # "you should be turning left" is as good as a command
    elif GoalStatus.COMPLETE in statuses:
        complete(mind, name)
        if rng.random() < 0.5:
            mind.voice = mind.voice.plan(remark(DialogueMove.ACKNOWLEDGE))
    elif GoalStatus.ABANDONED in statuses:
        give_up(mind, name)
        values = (name, GoalStatus.ABANDONED) if name is not None else ()
        move = DialogueMove.CONFIRM if values and rng.random() < CONFIRMS_CHANGES else DialogueMove.ACKNOWLEDGE
        mind.voice = mind.voice.plan(remark(move, *values))
    elif act.values(Slot.STREET):
        hear_description(mind, view, _streets(act.values(Slot.STREET)), landmarks, rng)
    elif "wrong" in words.text.lower():
        mind.journey = None if not mind.exact else mind.journey
        mind.voice = mind.voice.plan(remark(DialogueMove.ACKNOWLEDGE, wording=Wording(topic="sorry")))
    elif GoalStatus.PENDING in statuses and name is not None:
        mind.note_status(name, GoalStatus.PENDING)
        mind.voice = mind.voice.plan(remark(DialogueMove.ACKNOWLEDGE))
    elif ObjectClass.STATIC in act.values(Slot.OBJECT) or rng.random() < 0.25:
        mind.voice = mind.voice.plan(remark(DialogueMove.ACKNOWLEDGE))


def _reply(
    mind: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    """An answer to an open question, or an amplification: something to do, or where something is."""
    late = act.move is DialogueMove.REPLY_W and view.choice is not None and mind.asked not in (-1, view.choice.lane)
    if late and mind.exact and words.turns:
        return  # the junction that was asked about lies behind, and the way is known by now
    if act.values(Slot.ACTION):
        _instruction(mind, view, act, words, rng)
    elif words.turns:
        mind.proposed = None
        mind.journey = mind.journey if mind.exact else None
        _do_turn(mind, view, act, words)
        take_up(mind, ActionValue.J_TURN, words, rng)
    elif act.values(Slot.STREET) or act.values(Slot.LANDMARK):
        landmarks = [name for name in act.values(Slot.LANDMARK) if isinstance(name, LandmarkName)]
        clarified = act.move is DialogueMove.CLARIFY and landmarks and mind.goal is not landmarks[0]
        if clarified:
            hear_goal(mind, view, landmarks[0], _streets(act.values(Slot.STREET)), rng, corrected=True)
        elif (mind.goal is None or mind.arrived) and landmarks:
            hear_goal(mind, view, landmarks[0], _streets(act.values(Slot.STREET)), rng)
        else:
            hear_description(mind, view, _streets(act.values(Slot.STREET)), landmarks, rng)
    elif view.time - mind.asked_at < ASKED_LATELY and words.order is None and not act.slots:
        mind.voice = mind.voice.plan(remark(DialogueMove.CONFUSE))  # no answer to what it has asked
    elif rng.random() < 0.5:
        mind.voice = mind.voice.plan(remark(DialogueMove.ACKNOWLEDGE))


def _yes(
    mind: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    if mind.offer is not None:
        accept_offer(mind, view, rng)
    elif mind.detour_at is not None:
        detour(mind, view, rng)
    elif mind.proposed is not None:
        if mind.proposed.junction == view.junction and mind.directive is None:
            mind.directive, mind.halted = mind.proposed, False
        mind.proposed = None
    elif mind.slower_asked:
        mind.slower_asked, mind.speed = False, SLOW
        wording = Wording(faster=False, speed=SLOW)
        mind.voice = mind.voice.plan(remark(DialogueMove.EXPLAIN, ActionValue.SPEED_CHANGE, wording=wording))


def _no(mind: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText, rng: np.random.Generator) -> None:
    mind.proposed = mind.offer = None
    mind.slower_asked = False
    if mind.arrived:
        doubt(mind)
    if words.turns and not act.values(Slot.ACTION):
        _do_turn(mind, view, act, words)


def _alignment(
    mind: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    understood = mind.goal is not None or mind.directive is not None
    if understood:
        mind.voice = mind.voice.plan(remark(DialogueMove.ACKNOWLEDGE, wording=Wording(topic="align")))
    else:
        mind.voice = mind.voice.plan(remark(DialogueMove.CONFUSE))


def _check(
    mind: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    landmarks, streets = act.values(Slot.LANDMARK), act.values(Slot.STREET)
    right = not landmarks or mind.goal in landmarks
    if streets and not landmarks:
        right = street_of(view.raw, mind.town, view.lane) in streets
    move = DialogueMove.CONFIRM if right else DialogueMove.REPLY_N
    mind.voice = mind.voice.plan(remark(move), *musing(mind, rng, joined=True))


def _confusion(
    mind: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    told = [item for item in mind.voice.said if item.act.move in _CAN_BE_REPEATED]
    if not told:
        return
    last = told[-1]
    open_question = last.act.move in _ASKING or not last.act.slots
    move = last.act.move if open_question else DialogueMove.CLARIFY
    mind.voice = mind.voice.plan(remark(move, *last.act.slots, wording=last.wording))


def _small_talk(
    mind: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    if view.time - mind.asked_at < ASKED_LATELY and mind.goal is None:
        mind.voice = mind.voice.plan(remark(DialogueMove.CONFUSE))  # an answer was expected
    elif rng.random() < mind.style.chats:
        move = DialogueMove.IRRELEVANT if rng.random() < 0.6 else DialogueMove.ACKNOWLEDGE
        mind.voice = mind.voice.plan(remark(move))


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
    DialogueMove.CHECK: _check,
    DialogueMove.CONFUSE: _confusion,
    DialogueMove.IRRELEVANT: _small_talk,
    DialogueMove.QUERY_YN: answer_yes_no,
    DialogueMove.QUERY_W: answer_open,
}
