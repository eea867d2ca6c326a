"""Repairs of the dialogue: the Co-Wizard finds out that it may have misheard the participant."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.conversation import is_partly_inaudible, speech_seconds
from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.intentions import CommunicativeFunction as Function
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.dialogue.reactions import is_in_passing, is_praise
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.ontology.slots import ActionValue, GoalStatus, LandmarkName, Slot
from dorothie_gym.policies import act_builders
from dorothie_gym.policies.co_wizard.destinations import believed_destination, doubt
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.speech import intend, repeated

if TYPE_CHECKING:
    from dorothie_gym.dialogue.nlu import ParsedText
    from dorothie_gym.policies.co_wizard.state import CoWizardState
    from dorothie_gym.policies.co_wizard.view import CoWizardView
    from dorothie_gym.policies.heard_utterance import HeardUtterance

FRAGMENT = 3
"""Maximum number of meaningless words that count as the rest of a misheard utterance."""


_UNKNOWN_PLACE: Final = re.compile(r"\b(take|bring|drive|get|go|head|run)\b( \w+){0,3} to (the|a|an|my|our) [a-z]{3,}")
"""Request to drive to a place whose noun is masked by no name."""

_REPEATABLE = act_builders.QUESTIONS | {DialogueMove.EXPLAIN, DialogueMove.INSTRUCT, DialogueMove.REPLY_W}
"""Moves that are repeated on request."""

_WITHOUT_CONTENT = frozenset(
    {
        DialogueMove.ACKNOWLEDGE,
        DialogueMove.CONFIRM,
        DialogueMove.IRRELEVANT,
        DialogueMove.REPLY_Y,
        DialogueMove.REPLY_N,
        DialogueMove.REPLY_U,
    }
)
"""Moves that may be said without any content."""

_WANTS_REPLY = act_builders.QUESTIONS | {DialogueMove.INSTRUCT, DialogueMove.CONFUSE, DialogueMove.ALIGN}
_EMPTY = frozenset({DialogueMove.ACKNOWLEDGE, DialogueMove.CONFIRM, DialogueMove.IRRELEVANT, DialogueMove.EXPLAIN})
_ORDERS = frozenset({DialogueMove.INSTRUCT, DialogueMove.CLARIFY, DialogueMove.REPLY_W})

SLOWEST: Final = 10
"""Lowest speed to which a car is asked to speed up [km/h]."""

SPEED_TOLERANCE: Final = 5
"""Error with which a passenger estimates the speed [km/h]."""

_NO_MORE: Final = 6.0  # time after a remark within which a murmur is a reaction to it [s]

_CORRECTED = frozenset({Predicate.GOAL, Predicate.WILL, Predicate.ARRIVED, Predicate.KNOWS})
"""Moves that are repeated as "I said ..."; other statements are repeated unchanged."""


def is_garbled(words: ParsedText) -> bool:
    """Returns whether words that make no sense are so few that they have probably been misheard."""
    return len(words.text.split()) <= FRAGMENT


def is_lost_order(state: CoWizardState, view: CoWizardView, words: ParsedText) -> bool:
    """Returns whether a few words that state nothing may be the rest of an order ("lane, mate"): the car is guided."""
    guided = state.beliefs.goal is not None and not state.beliefs.exact and not state.intentions.arrived
    says = words.told is not None or is_in_passing(words.text) or is_praise(words.text)
    return guided and is_garbled(words) and not says and state.speech.may_ask_back(view.time)


def names_unknown_place(state: CoWizardState, words: ParsedText) -> bool:
    """Returns whether words ask a car without a destination to drive to a place that it has no name for."""
    return state.beliefs.goal is None and _UNKNOWN_PLACE.search(words.masked) is not None


def ask_for_known_place(state: CoWizardState, view: CoWizardView) -> None:
    """Says that a place is not on the map, and asks where to go."""
    unknown = Proposition.of(Predicate.KNOWS, negated=True)
    unmarked = act_builders.errand(None, GoalStatus.UNKNOWN)
    where = act_builders.destination(LandmarkName.QUERIED)
    state.say(
        intend(Function.INFORM, unknown, unmarked, wording=Wording(topic="unknown_place")),
        intend(Function.SET_QUESTION, where, joined=True),
    )
    state.dialogue = state.dialogue.after_asking(view.time)


def is_murmur(state: CoWizardState, view: CoWizardView, heard: HeardUtterance) -> bool:
    """Returns whether a few words without content follow a remark that needs no answer: "okay, mate", half heard."""
    last, words = state.speech.last, heard.words
    asked = last is None or last.act.move in _WANTS_REPLY or not state.speech.has_just_spoken(view.time, _NO_MORE)
    content = (
        words.plan or words.question or words.told or any(act.slots or act.move not in _EMPTY for act in heard.acts)
    )
    return not (asked or content or expects_stop(state, view, words)) and is_garbled(words)


def is_unclear(state: CoWizardState, view: CoWizardView, heard: HeardUtterance) -> bool:
    """Returns whether an utterance is partly inaudible and must be repeated.

    A stop cannot wait. After one repetition, the parts that were understood must do.
    """
    stops = any(ActionValue.STOP in act.values(Slot.ACTION) for act in heard.acts)
    if stops or not is_partly_inaudible(heard.words.text):
        return False
    return state.speech.may_ask_back(view.time) or not any(act.slots for act in heard.acts)


def lacks_what_to_do(state: CoWizardState, view: CoWizardView, heard: HeardUtterance) -> bool:
    """Returns whether an order was heard without what it asks for, and must be repeated.

    That is a turn to no side ("we-turn"), a number without an action ("go up to fairly-five"), or a speed that is
    lower than the present one although the car shall speed up ("speed up to five").

    Args:
        state: state of the Co-Wizard.
        view: observation.
        heard: the utterance.
    """
    act, words = heard.acts[0], heard.words
    if len(heard.acts) > 1 or act.move not in _ORDERS or words.question or not state.speech.may_ask_back(view.time):
        return False  # once it has been repeated, it must do
    actions = act.values(Slot.ACTION)
    if not act.slots:
        return words.speed is not None and not words.plan
    if actions == (ActionValue.J_TURN,):
        return act.slots == {ActionValue.J_TURN} and words.direction is None and not words.turns
    return actions == (ActionValue.SPEED_CHANGE,) and words.speed is not None and _is_absurd(view, words)


def _is_absurd(view: CoWizardView, words: ParsedText) -> bool:
    """Returns whether a speed was probably misheard: the car shall speed up, to less than it drives."""
    return words.faster is True and (words.speed or 0) < max(SLOWEST, 3.6 * view.speed - SPEED_TOLERANCE)


def is_unclear_reply(state: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText) -> bool:
    """Returns whether a reply answers neither the question nor the Co-Wizard's counter-question."""
    if words.order is not None or act.slots or (words.parse is not None and words.parse.aside):
        return False
    asked_back = act.move is DialogueMove.CLARIFY and state.speech.has_just_asked_back
    return asked_back or view.time - state.dialogue.asked_at < state.config.answer_time


def expects_stop(state: CoWizardState, view: CoWizardView, words: ParsedText) -> bool:
    """Returns whether meaningless words are probably a request to stop: the car is guided to a place that is near."""
    guided = state.beliefs.goal is not None and not state.beliefs.exact and state.route.progress is None
    return guided and not view.standing and (state.intentions.creeping or "here" in words.text.lower().split())


def is_here(state: CoWizardState, view: CoWizardView, words: ParsedText) -> bool:
    """Returns whether a place that the car has not found by itself is said to be right here."""
    here = words.told is not None and words.told.predicate is Predicate.ARRIVED and not words.told.negated
    return here and not view.standing and not state.intentions.arrived and state.beliefs.goal is not None


def is_settled(state: CoWizardState, view: CoWizardView, words: ParsedText) -> bool:
    """Returns whether what the participant has not understood needs no repetition.

    The car has said something else meanwhile, or has asked where to go and knows it by now.
    """
    last = state.speech.last_content
    if last is None:
        return False
    asks_goal = last.act.move is DialogueMove.QUERY_W and LandmarkName.QUERIED in last.act.values(Slot.LANDMARK)
    spoke_meanwhile = state.speech.last_end > view.time - 0.5 * speech_seconds(words.text)
    return spoke_meanwhile or (asks_goal and state.beliefs.goal is not None and not state.intentions.arrived)


def repeat_last(state: CoWizardState) -> None:
    """Repeats the last remark, or the last one in its utterance that has content."""
    latest = state.speech.last_content
    if latest is not None and latest.act.move in _WITHOUT_CONTENT and not latest.act.slots and not latest.joined:
        state.say(replace(latest, text=""))
        return
    said = [
        item
        for place, item in enumerate(state.speech.said, start=1)
        if item.act.move in _REPEATABLE or (place == len(state.speech.said) and item.act.slots)
    ]
    if not said:
        return
    last = said[-1]
    corrects = last.act.slots and bool({said.predicate for said in last.meaning} & _CORRECTED)
    again = corrects and last.act.move not in act_builders.QUESTIONS
    state.say(repeated(last, Function.CORRECTION) if again else replace(last, text="", joined=False))


def note_contradiction(
    state: CoWizardState,
    view: CoWizardView,
    action: ActionValue,
    direction: Direction | None,
    ordinal: int | None = None,
) -> bool:
    """Counts an instruction that leads away from the route to a destination on the map; returns whether it does.

    Args:
        state: working copy of the state.
        view: observation.
        action: requested action.
        direction: side of a turn.
        ordinal: number of the opportunity to turn, from 1.
    """
    if not _contradicts(state, view, action, direction, ordinal):
        return False
    _count_contradiction(state)
    return True


def _count_contradiction(state: CoWizardState) -> int:
    """Counts a contradiction to the destination; returns the number of those to the present one."""
    goal, count = state.dialogue.contradicted
    count = count + 1 if goal is state.beliefs.goal else 1
    state.dialogue = state.dialogue.with_contradictions(state.beliefs.goal, count)
    return count


def hear_wrong_way(state: CoWizardState, view: CoWizardView) -> None:
    """Apologises for a wrong way, and checks the destination once; if it is the wrong way again, gives up its place."""
    if not state.beliefs.exact:
        state.route = state.route.with_progress(None)
    state.say(intend(Function.POSITIVE_FEEDBACK, wording=Wording(topic="sorry")))
    if not state.beliefs.exact or state.beliefs.goal is None:
        return
    if _count_contradiction(state) == 1:
        state.say(intend(Function.CHECK_QUESTION, believed_destination(state, view), joined=True))
    elif state.dialogue.contradicted[1] > state.config.contradictions:
        check_goal(state, view)


def check_goal(state: CoWizardState, view: CoWizardView) -> None:
    """Checks the destination after instructions that lead away from its route; gives up its place if more follow.

    The name may be right and the place wrong: there are several houses.
    """
    goal, count = state.dialogue.contradicted
    if goal is None or goal is not state.beliefs.goal or count < state.config.contradictions:
        return
    if count == state.config.contradictions:
        state.dialogue = state.dialogue.after_asking(view.time)
        state.say(intend(Function.CHECK_QUESTION, believed_destination(state, view)))
    elif count >= 2 * state.config.contradictions:
        state.dialogue = state.dialogue.with_contradictions(goal, 0)
        doubt(state)
        unknown = Proposition.of(Predicate.KNOWS, negated=True, place=goal)
        state.say(intend(Function.INFORM, unknown, elided=("place",)))


def _contradicts(
    state: CoWizardState, view: CoWizardView, action: ActionValue, direction: Direction | None, ordinal: int | None
) -> bool:
    progress = state.route.progress
    if progress is None or not state.beliefs.exact:
        return False
    if action is ActionValue.U_TURN:
        return not progress.turns_round_first(state.town, view.station)
    crossing = progress.next_crossing(state.town, view.station)
    if action is not ActionValue.J_TURN or crossing is None or (ordinal or 1) > 1:
        return False
    sides = (Direction.LEFT, Direction.RIGHT)
    return direction in sides and crossing.direction in sides and direction is not crossing.direction
