"""Answers of the Co-Wizard to questions, from its beliefs."""

from __future__ import annotations

import itertools
import re
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.intentions import CommunicativeFunction as Function
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.ontology.dialogue_acts import DialogueAct
from dorothie_gym.ontology.slots import ActionValue, GoalStatus, LandmarkName, ObjectClass, Slot, StreetName
from dorothie_gym.policies import act_builders
from dorothie_gym.policies.co_wizard.acknowledgement import plan_remark
from dorothie_gym.policies.co_wizard.clarification_requests import ask_back
from dorothie_gym.policies.co_wizard.destinations import set_goal
from dorothie_gym.policies.co_wizard.drive_answers import drive_answer
from dorothie_gym.policies.co_wizard.driving import wanted_exit
from dorothie_gym.policies.co_wizard.plan_contents import told_plan
from dorothie_gym.policies.co_wizard.proposition_truth import (
    believes,
    reason_to_stand,
    reason_to_turn_round,
    seconds_to_goal,
    sees_far,
    street_here,
)
from dorothie_gym.policies.co_wizard.small_remarks import switch_lights_on
from dorothie_gym.policies.notable_conditions import fault_remark, view_remark
from dorothie_gym.policies.observation_parser import street_of
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.route_progress import direction_of
from dorothie_gym.policies.speech import Remark, intend
from dorothie_gym.policies.view_range import camera_fault, limit_of, sight
from dorothie_gym.sim.state.codes import Motion

if TYPE_CHECKING:
    from dorothie_gym.dialogue.nlu import ParsedText
    from dorothie_gym.ontology.dialogue_acts import DialogueAct
    from dorothie_gym.policies.co_wizard.state import CoWizardState
    from dorothie_gym.policies.co_wizard.view import CoWizardView
    from dorothie_gym.policies.knowledge import CoWizardKnowledge

_ABOUT_THE_GOAL = frozenset(
    {Predicate.CLOSE, Predicate.HAS_ROUTE, Predicate.RIGHT_WAY, Predicate.ARRIVED, Predicate.KNOWS}
)

_ABOUT_THE_VIEW = frozenset({Predicate.VISIBILITY, Predicate.SAFE, Predicate.FAILED})

_REQUEST = re.compile(r"\b(could|can|would|will) you\b(?!.*\b(know|find|see|remember|hear|tell|take)\b)")
"""Words that request an action, even if the verb was misheard."""

_MODAL = re.compile(r"^\W*(?:\w+\W+){0,2}?(could|can|would|will)\b(?!\W+(it|that|there|this|they)\b)", re.I)
"""Beginning of a request, of which "you" may be misheard: "could aw please stop here?"."""

_ASKING = re.compile(r"\b(are|is|was|were|did|do|does|have|has|should|shall|am)\b|'(re|s|m)\b", re.I)
"""Verb of a question about what the car does."""

RECENT_STOP = 45.0
"""Time after a standstill within which the participant can ask for its reason [s]."""


def answer_yes_no(
    state: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    """Answers a yes/no question from the Co-Wizard's beliefs."""
    asked = asked_proposition(act, words)
    place = act_builders.first_name(act.values(Slot.LANDMARK))
    requests = words.asked is None and _REQUEST.search(words.text.lower()) is not None
    if requests and place is not None:
        set_goal(state, view, place, act_builders.named_streets(act), rng, sure=False)  # "could you hard to KFC?"
    elif requests or (place is None and _is_order(act) and not _ASKING.search(words.text)):
        ask_back(state, view, words)  # a request that was misheard is not refused
    elif asked is None:
        ask_back(state, view, words, question=True)
    elif words.asked is None and ActionValue.SPEED_CHANGE in act.values(Slot.ACTION):
        state.say(*drive_answer(state, view, Proposition.of(Predicate.DRIVES_AT), None))
    elif asked.asks:
        answer_open(state, view, act, words, rng)
    elif asked.predicate is Predicate.LIGHTS_ON:
        _answer_lights(state, view)
    else:
        if asked.predicate is Predicate.KNOWS:  # "it isn't on my map" need not be said twice
            state.speech = state.speech.without_statements(frozenset({Predicate.KNOWS}))
        state.say_first(judged(state.knowledge, view, asked), *_more(state, view, asked, rng))


def asks_to_act(act: DialogueAct, words: ParsedText) -> bool:
    """Returns whether a question asks the car to do something: "could you stop here?"."""
    asks = _REQUEST.search(words.text.lower()) or _MODAL.match(words.text)
    return _is_order(act) and asks is not None


def _is_order(act: DialogueAct) -> bool:
    """Returns whether an act names an action that the car could be asked for."""
    return bool(set(act.values(Slot.ACTION)) - {ActionValue.LIGHT_CHANGE, ActionValue.QUERIED})


def asked_proposition(act: DialogueAct, words: ParsedText) -> Proposition | None:
    """Returns the proposition of a yes/no question; None if it is unclear."""
    slots = (act.values(slot) for slot in (Slot.OBJECT, Slot.ACTION, Slot.LANDMARK, Slot.STREET))
    return words.asked or act_builders.asked_by_slots(*slots)


def judged(
    known: CoWizardKnowledge, view: CoWizardView, asked: Proposition, yes: Function = Function.AFFIRMATIVE_ANSWER
) -> Remark:
    """Returns the answer to whether a proposition is true: yes, no, or that this is not known.

    Args:
        known: beliefs of the Co-Wizard.
        view: observation.
        asked: the proposition; if it concerns the goal and names no place, the current goal is meant.
        yes: function of a yes.
    """
    if asked.predicate in _ABOUT_THE_GOAL and asked.get("place") is None:
        asked = Proposition.of(asked.predicate, negated=asked.negated, place=known.goal)
    held = believes(known, view, asked)
    elided = [name for name, _ in asked.arguments]
    if held is None:
        return intend(Function.UNCERTAIN_ANSWER, asked, elided=elided)
    return intend(yes if held else Function.NEGATIVE_ANSWER, asked if held else asked.opposite, elided=elided)


def _answer_lights(state: CoWizardState, view: CoWizardView) -> None:
    """Answers a question about the headlights, which is also a request to switch them on."""
    state.say(judged(state.knowledge, view, Proposition.of(Predicate.LIGHTS_ON)))
    switch_lights_on(state, announced=not view.lights, joined=True)


def _more(state: CoWizardState, view: CoWizardView, asked: Proposition, rng: np.random.Generator) -> tuple[Remark, ...]:
    """Returns, with some probability, an addition to an answer: why something is not seen, or the time to the goal."""
    unseen = asked.predicate is Predicate.SEES and not believes(state.knowledge, view, asked)
    if unseen or (asked.predicate in _ABOUT_THE_VIEW and not sees_far(view)):
        return _poor_view(state, view, rng)
    if asked.predicate in (Predicate.CLOSE, Predicate.RIGHT_WAY, Predicate.KNOWS, Predicate.HAS_ROUTE):
        holds = believes(state.knowledge, view, asked)
        return plan_remark(state, view, rng, joined=True) if holds else ()
    return ()


def _poor_view(state: CoWizardState, view: CoWizardView, rng: np.random.Generator) -> tuple[Remark, ...]:
    """Returns, with some probability, a remark about a limited view."""
    limit, fault = limit_of(view.raw), camera_fault(view.raw)
    if limit is None or rng.random() < 0.3:
        return ()
    if fault is not None:
        state.dialogue = state.dialogue.with_view_fault(fault)  # need not be reported any more
        return (fault_remark(fault, joined=True),)
    return (replace(view_remark(limit, sight(view.raw), rng), joined=True),)


# --- open questions ---------------------------------------------------------------------------------------------------


def answer_open(
    state: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    """Answers an open question."""
    asked, actions, landmarks = words.asked, act.values(Slot.ACTION), act.values(Slot.LANDMARK)
    if GoalStatus.QUERIED in act.values(Slot.STATUS):
        asked = Proposition.of(Predicate.TASK)
    if asked is not None and _answer_asked(state, view, asked, act_builders.first_name(landmarks)):
        return
    if ActionValue.STOP in actions:
        _explain_standing(state, view)
    elif ActionValue.U_TURN in actions:
        state.say(why_turning_round(state.knowledge, view))
    elif ObjectClass.QUERIED in act.values(Slot.OBJECT):
        _name_objects(state, view)
    elif ActionValue.QUERIED in actions:
        _name_way(state, view)
    elif landmarks:
        mark = next((mark for mark in view.landmarks if mark.name in landmarks), None)
        if mark is None or mark.street is StreetName.UNKNOWN:
            state.say(intend(Function.UNCERTAIN_ANSWER))
        else:
            located = Proposition.of(Predicate.LOCATED, place=mark.name, street=mark.street)
            state.say(intend(Function.ANSWER, located, elided=("place",)))
    elif StreetName.QUERIED in act.values(Slot.STREET) or (
        asked is not None and asked.predicate is Predicate.ON_STREET
    ):
        _name_street(state, view)
    else:
        ask_back(state, view, words, question=True)


def _answer_asked(state: CoWizardState, view: CoWizardView, asked: Proposition, place: LandmarkName | None) -> bool:
    """Answers a question by its content, where that is enough; returns whether it was."""
    about_drive = drive_answer(state, view, asked, place)
    if about_drive:
        state.say(*about_drive)
    elif asked.predicate is Predicate.BECAUSE:
        _explain_standing(state, view)
    elif asked.predicate is Predicate.WILL and asked.asks:
        _name_way(state, view)
    elif asked.predicate is Predicate.SEES and asked.asks:
        _name_objects(state, view)
    elif asked.predicate is Predicate.WEATHER:
        state.say(judged(state.knowledge, view, asked))
    else:
        return False
    return True


def arrival(known: CoWizardKnowledge, view: CoWizardView) -> Remark:
    """Returns the answer to when the car will reach its goal, without content if that is unknown."""
    seconds = seconds_to_goal(known, view)
    if seconds is None:
        return intend(Function.UNCERTAIN_ANSWER)
    arrives = Proposition.of(Predicate.ARRIVES_IN, place=known.goal, seconds=seconds)
    return intend(Function.ANSWER, arrives, elided=("place",))


def _explain_standing(state: CoWizardState, view: CoWizardView) -> None:
    """Answers why the car stands, or stood until just now."""
    answer = why_standing(state.knowledge, view)
    if _is_held_up(state.knowledge, view):
        reason = _present_reason(state.knowledge, view)
        if reason is None and not state.intentions.arrived:
            state.intentions = state.intentions.resumed()
        elif reason is not None and reason.predicate is not Predicate.GOAL:
            state.dialogue = state.dialogue.after_explaining_hazard(view.time)
        elif reason is not None:
            stands = Proposition.of(Predicate.STANDS, action=ActionValue.STOP)
            state.say(_explanation(stands, reason), replace(answer, joined=True))
            return
    state.say(answer)


def why_standing(known: CoWizardKnowledge, view: CoWizardView) -> Remark:
    """Returns the answer to why the car stands, or stood until just now."""
    stands, last = Proposition.of(Predicate.STANDS, action=ActionValue.STOP), known.standstill
    if _is_held_up(known, view):
        reason = _present_reason(known, view)
        if reason is not None and reason.predicate is Predicate.GOAL:
            where = Proposition.of(Predicate.GOAL, place=LandmarkName.QUERIED)
            return intend(Function.SET_QUESTION, where)
        return _explanation(stands, reason)
    if view.time - last.until < RECENT_STOP:
        return _explanation(stands, last.reason, at=round(last.until if last.reason is None else last.reason_since))
    return intend(Function.ANSWER, stands.opposite, elided=("action",))


def _is_held_up(known: CoWizardKnowledge, view: CoWizardView) -> bool:
    """Returns whether the car stands, or brakes for something without a recent standstill."""
    return view.standing or (view.motion is Motion.HAZARD and view.time - known.standstill.until >= RECENT_STOP)


def _present_reason(known: CoWizardKnowledge, view: CoWizardView) -> Proposition | None:
    return reason_to_stand(known, view) or known.standstill.reason


def why_turning_round(known: CoWizardKnowledge, view: CoWizardView) -> Remark:
    """Returns the answer to why the car turns round."""
    turns = Proposition.of(Predicate.DOES, action=ActionValue.U_TURN)
    return _explanation(turns, reason_to_turn_round(known, view))


def _explanation(effect: Proposition, cause: Proposition | None, at: int | None = None) -> Remark:
    """Returns the answer to why an effect holds, or held at a time [s], without content if there is no cause."""
    if cause is None:
        return intend(Function.UNCERTAIN_ANSWER)
    because = Proposition.of(Predicate.BECAUSE, effect=effect, cause=cause, at=at)
    elided = ("effect",) if at is None else ("effect", "at")
    topic = "because" if at is None else "because_then"
    return intend(Function.ANSWER, because, elided=elided, wording=Wording(topic=topic))


def _name_objects(state: CoWizardState, view: CoWizardView) -> None:
    things = tuple(dict.fromkeys(thing.kind for thing in view.objects))[:2]
    if not things:
        state.say(intend(Function.ANSWER, Proposition.of(Predicate.SEES, object=ObjectClass.ROAD)))
    wording = Wording(topic="sees_only") if len(things) == 1 else None
    for number, thing in enumerate(things):
        seen = Proposition.of(Predicate.SEES, object=thing)
        state.say(intend(Function.ANSWER, seen, wording=wording, joined=number > 0))


def _name_way(state: CoWizardState, view: CoWizardView) -> None:
    if state.plan.steps:
        state.say(told_plan(state.plan.steps, Function.ANSWER))
        return
    plan = () if state.intentions.directive is not None else _next_turns(state, view)
    if not plan:
        way, progress = wanted_exit(state, view), state.route.progress
        if way is not None:
            street = street_of(view.raw, state.town, way.lane)
            plan = (_planned(direction_of(way), street),)
        elif progress is not None:
            action = ActionValue.U_TURN if progress.changes_before(None) else ActionValue.LANE_FOLLOW
            plan = (Proposition.of(Predicate.WILL, action=action),)
        else:
            state.say(intend(Function.UNCERTAIN_ANSWER))
            return
    for number, step in enumerate(plan):
        direction = step.get("direction")
        wording = Wording(direction=direction if isinstance(direction, Direction) else None, topic="plan")
        state.say(intend(Function.ANSWER, step, wording=wording, joined=number > 0))


def _planned(direction: Direction, street: StreetName) -> Proposition:
    """Returns the statement that the car will leave a junction in a direction."""
    action = ActionValue.LANE_FOLLOW if direction is Direction.STRAIGHT else ActionValue.J_TURN
    named = None if street is StreetName.UNKNOWN else street
    return Proposition.of(Predicate.WILL, action=action, direction=direction, street=named)


def _next_turns(state: CoWizardState, view: CoWizardView) -> tuple[Proposition, ...]:
    """Returns the next turns of the route to the left or right, at most two."""
    progress = state.route.progress
    if progress is None or progress.turns_round_first(state.town, view.station):
        return ()
    crossings = itertools.islice(progress.crossings(state.town, view.station), state.config.plan_junctions)
    turns = [crossing for crossing in crossings if crossing.direction in (Direction.LEFT, Direction.RIGHT)]
    return tuple(
        _planned(crossing.direction, street_of(view.raw, state.town, crossing.exit.lane)) for crossing in turns[:2]
    )


def _name_street(state: CoWizardState, view: CoWizardView) -> None:
    street = street_here(state.town, view)
    if street is StreetName.UNKNOWN:
        state.say(intend(Function.UNCERTAIN_ANSWER))
    else:
        state.say(intend(Function.ANSWER, Proposition.of(Predicate.ON_STREET, street=street)))


def answer_check(
    state: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    """Confirms or denies what the participant checks.

    Args:
        state: working copy of the state.
        view: observation.
        act: the check.
        words: what was heard.
        rng: random generator of the decision.
    """
    checked = _checked(state, act, words)
    held = believes(state.knowledge, view, checked)
    elided = act_builders.arguments_of(checked)
    if held is None:
        state.say(intend(Function.UNCERTAIN_ANSWER, checked, elided=elided))
        return
    said = intend(
        Function.CONFIRM if held else Function.NEGATIVE_ANSWER, checked if held else checked.opposite, elided=elided
    )
    about_way = words.asked is None or bool(act.slots)
    state.say(said, *(plan_remark(state, view, rng, joined=True) if about_way else ()))


def _checked(state: CoWizardState, act: DialogueAct, words: ParsedText) -> Proposition:
    """Returns the subject of a check by the participant: a street, an action, or a named or current destination."""
    places, streets, actions = (
        act_builders.named_landmarks(act),
        act_builders.named_streets(act),
        act.values(Slot.ACTION),
    )
    if places:
        return act_builders.destination(places[0])
    if streets:
        return Proposition.of(Predicate.ON_STREET, street=streets[0])
    if words.asked is not None:
        return words.asked
    if actions:
        return Proposition.of(Predicate.DOES, action=actions[0])
    return act_builders.destination(state.beliefs.goal)
