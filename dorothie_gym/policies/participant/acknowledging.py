"""Uptake of what the car says: acknowledgement, thanks, consent, a question, or silence, by persona."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.intentions import CommunicativeFunction as Function
from dorothie_gym.dialogue.propositions import ASKED, Predicate, Proposition
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.ontology.dialogue_acts import ORDERING_MOVES, SIGNS_OF_HEARING, DialogueMove
from dorothie_gym.ontology.slots import ActionValue, GoalStatus, ObjectClass, Slot
from dorothie_gym.policies import act_builders
from dorothie_gym.policies.participant.answer_parts import addition, checked
from dorothie_gym.policies.participant.final_approach import about_to_arrive
from dorothie_gym.policies.participant.trip_memory import UNDER_WAY
from dorothie_gym.policies.speech import Remark, intend

if TYPE_CHECKING:
    import numpy as np

    from dorothie_gym.policies.heard_utterance import HeardUtterance
    from dorothie_gym.policies.participant.state import ParticipantState
    from dorothie_gym.policies.participant.view import ParticipantView

_TAKEN_UP = 8.0
"""Time within which the car takes up an order [s]."""

_REPLIES = frozenset(
    {DialogueMove.REPLY_W, DialogueMove.REPLY_Y, DialogueMove.REPLY_N, DialogueMove.REPLY_U, DialogueMove.CONFIRM}
)

_VISIBLE = frozenset(
    {
        Predicate.FAILED,
        Predicate.VISIBILITY,
        Predicate.WEATHER,
        Predicate.CROWDED,
        Predicate.SEES,
        Predicate.BLOCKED,
        Predicate.LIGHTS_ON,
    }
)
"""Remarks on something that both can see."""

_AFTER_A_NOD = frozenset({DialogueMove.EXPLAIN, DialogueMove.INSTRUCT})
"""Moves that may follow an acknowledgement in the same breath."""

THANKS_FIRST: Final = 0.35
"""Largest share of the arrivals for which a polite passenger thanks before saying that it is done."""

_MANOEUVRES: Final = frozenset({ActionValue.J_TURN, ActionValue.U_TURN, ActionValue.LANE_SWITCH})
"""Actions of a car that finds its own way to which a passenger may consent."""

CONSENTS: Final = 0.35
"""Largest share of the announcements of the car that a trusting passenger consents to."""

ASKS_BACK: Final = 0.3
"""Share of the announcements of the car after which an impatient passenger asks how far it is."""


def take_note(state: ParticipantState, view: ParticipantView, heard: HeardUtterance, rng: np.random.Generator) -> None:
    """Reacts to a statement of the car: with a sign of hearing, consent, a question about the way, or not at all.

    Args:
        state: working copy of the state.
        view: observation.
        heard: the utterance; one that takes up an instruction needs no acknowledgement of its own.
        rng: random generator of the decision.
    """
    alone = heard.acts[0].move not in SIGNS_OF_HEARING
    nod = nod_to(view, heard)
    if alone and state.speech.idle and not state.guidance.guiding and not nod.wording.topic:
        nod = _in_own_manner(state, view.time, heard, rng) or nod
    _nod(state, view, rng, nod, heard.words.told, alone=alone)


def _in_own_manner(
    state: ParticipantState, now: float, heard: HeardUtterance, rng: np.random.Generator
) -> Remark | None:
    """Returns the consent to an announced manoeuvre, or the question how far it is; None for an acknowledgement."""
    act, style = heard.acts[-1], state.style
    if act.move is not DialogueMove.EXPLAIN or not _MANOEUVRES & act.slots or state.task.goal is None:
        return None
    draw = rng.random()
    if draw < CONSENTS * style.thanks:
        announced = checked(state, act, heard.words)
        elided, wording = act_builders.arguments_of(announced), Wording(topic="goes_along")
        return intend(Function.ACCEPT, announced, elided=elided, wording=wording)
    on_the_way = now - state.task.announced_at > UNDER_WAY
    if draw < CONSENTS * style.thanks + ASKS_BACK * style.hurries and on_the_way:
        place = state.task.goal.name
        for asked in (
            intend(Function.PROPOSITIONAL_QUESTION, Proposition.of(Predicate.CLOSE, place=place), elided=("place",)),
            intend(
                Function.SET_QUESTION,
                Proposition.of(Predicate.ARRIVES_IN, place=place, seconds=ASKED),
                elided=("place",),
            ),
        ):
            if not any(asked.meaning == item.meaning for item in state.speech.said):
                return asked
    return None


def nod_to(view: ParticipantView, heard: HeardUtterance) -> Remark:
    """Returns an acknowledgement of an explanation: of a reason for a stop, of something visible, or in general."""
    said = {value for act in heard.acts for value in act.slots}
    objects, told = any(isinstance(value, ObjectClass) for value in said), heard.words.told
    visible = told is not None and told.predicate in _VISIBLE
    reason = objects and not visible and (view.standing or ActionValue.STOP in said)
    topic = "why" if reason else "seen" if visible or objects else None
    return intend(Function.POSITIVE_FEEDBACK, wording=Wording(topic=topic))


def needs_nod(state: ParticipantState, view: ParticipantView, heard: HeardUtterance) -> bool:
    """Returns whether an utterance states something, asks for nothing, and does not only take up an order."""
    moves = {act.move for act in heard.acts}
    unasked = not state.speech.has_just_spoken(view.time, _TAKEN_UP)
    told = unasked or heard.words.told is not None or any(act.slots for act in heard.acts)
    explains = told and DialogueMove.EXPLAIN in moves and moves.isdisjoint(act_builders.QUESTIONS)
    return explains and not _takes_up_order(state, view, heard)


def _takes_up_order(state: ParticipantState, view: ParticipantView, heard: HeardUtterance) -> bool:
    """Returns whether the car only says that it does what it was just told to do."""
    last = state.speech.last
    if last is None or last.act.move not in ORDERING_MOVES or not state.speech.has_just_spoken(view.time, _TAKEN_UP):
        return False
    return any(set(act.values(Slot.ACTION)) & set(last.act.values(Slot.ACTION)) for act in heard.acts)


def answers_question(state: ParticipantState, heard: HeardUtterance) -> bool:
    """Returns whether the car has answered the last question."""
    last = state.speech.last
    return last is not None and last.act.move in act_builders.QUESTIONS and heard.acts[0].move in _REPLIES


def thank(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    """Acknowledges, with some probability, the answer of the car."""
    busy = not state.speech.idle or (state.guidance.guiding and about_to_arrive(state, view))
    if not busy and rng.random() < state.style.thanks:
        state.say(intend(Function.POSITIVE_FEEDBACK, wording=Wording(topic="answered")), *addition(state, view, rng))


def _nod(
    state: ParticipantState,
    view: ParticipantView,
    rng: np.random.Generator,
    nod: Remark,
    told: Proposition | None,
    *,
    alone: bool,
) -> None:
    """Acknowledges an explanation: before the next remark, or, where `alone` allows it, by itself."""
    waiting = state.speech.first
    if told is not None and told.predicate is Predicate.ARRIVED and state.guidance.guiding and waiting is not None:
        return  # "fine, and then a bit further" would agree that this is the place
    if waiting is not None and not waiting.urgent and not waiting.text:
        done = GoalStatus.COMPLETE in waiting.act.slots
        if waiting.act.move in _AFTER_A_NOD and not done and rng.random() < state.config.nods_first:
            state.speech = state.speech.led_by(nod)
        elif done and not state.guidance.guiding and rng.random() < THANKS_FIRST * state.style.thanks:
            thanks = intend(Function.POSITIVE_FEEDBACK, wording=Wording(topic="arrived"))
            state.speech = state.speech.plan_first(thanks)  # apart from the report, which is heard by itself
    elif (
        not alone
        or not state.speech.idle
        or _has_just_said(state, view, told)
        or (state.guidance.guiding and about_to_arrive(state, view))
    ):
        return
    elif rng.random() < state.style.nods:
        state.say(nod, *addition(state, view, rng))


def _has_just_said(state: ParticipantState, view: ParticipantView, told: Proposition | None) -> bool:
    """Returns whether the participant has just made the same statement as the car."""
    if told is None or not state.speech.has_just_spoken(view.time, state.config.checked_within):
        return False
    return any(said.contains(told) for item in state.speech.said[-2:] for said in item.meaning)
