"""Queries of phenomena 5 to 7, 15, 16, 19 to 21 and 24: questions, answers and grounding."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from types import MappingProxyType

from dorothie_gym.dialogue.exchanges import ANSWER_TIMEOUT, EXPECTATIONS
from dorothie_gym.evaluation.analysis.diversity import plain, words_of
from dorothie_gym.evaluation.analysis.phenomena.dialogue_view import CAR, HUMAN, DialogueView, Occurrence, Turn
from dorothie_gym.evaluation.analysis.phenomena.routes import asks_why
from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.slots import Slot, SlotValue
from dorothie_gym.session.recording.events import EventType

M = DialogueMove

QUESTIONS = (M.QUERY_YN, M.QUERY_W, M.CHECK, M.ALIGN)
REPEAT_WINDOW = 30.0
"""Time within which a question is repeated [s]."""

MENTION_WINDOW = 45.0
"""Time within which a named place counts as mentioned before [s]."""

_YES_NO: Mapping[DialogueMove, str] = MappingProxyType(
    {M.REPLY_Y: "yes", M.REPLY_N: "no", M.REPLY_U: "unsure"},
)


def yes_no(talk: DialogueView) -> Iterator[Occurrence]:
    """Finds 5: the car asks a yes/no question; the participant says yes, no, or is not sure."""
    for turn in talk.by(CAR, M.QUERY_YN):
        answer = next(talk.replies(turn, *_YES_NO), None)
        if answer is not None:
            yield Occurrence(turn, next(_YES_NO[act.move] for act in answer.doing(*_YES_NO)))


def check(talk: DialogueView) -> Iterator[Occurrence]:
    """Finds 6: the car checks an assumption, and the participant confirms or denies it."""
    for turn in talk.by(CAR, M.CHECK):
        answer = next(talk.replies(turn, M.CONFIRM, M.REPLY_Y, M.REPLY_N, M.CLARIFY), None)
        if answer is not None:
            yield Occurrence(turn, "confirmed" if answer.does(M.CONFIRM, M.REPLY_Y) else "denied")


def align(talk: DialogueView) -> Iterator[Occurrence]:
    """Finds 7: a speaker asks whether it was understood; the listener confirms, or the utterance is rephrased."""
    for turn in talk.turns:
        if not turn.does(M.ALIGN):
            continue
        if talk.replied(turn, M.ACKNOWLEDGE, M.REPLY_Y):
            yield Occurrence(turn, "understood")
            continue
        puzzled = next(talk.replies(turn, M.CONFUSE, M.REPLY_N), None)
        if puzzled is not None and talk.answered(puzzled, M.CLARIFY, M.INSTRUCT):
            yield Occurrence(turn, "repaired")


def perception(talk: DialogueView) -> Iterator[Occurrence]:
    """Finds 15: the participant asks whether the car sees an object, and the car answers."""
    for turn in talk.by(HUMAN, M.QUERY_YN):
        if not any(act.values(Slot.OBJECT) for act in turn.doing(M.QUERY_YN)):
            continue
        answer = next(talk.replies(turn, M.REPLY_Y, M.REPLY_N, M.REPLY_U), None)
        if answer is not None:
            yield Occurrence(turn, "seen" if answer.does(M.REPLY_Y) else "not seen")


def reason(talk: DialogueView) -> Iterator[Occurrence]:
    """Finds 16: the participant asks for the reason of an action, and the car gives it."""
    for turn in talk.by(HUMAN, M.QUERY_W, M.QUERY_YN):
        if asks_why(turn) and talk.replied(turn, M.REPLY_W, M.EXPLAIN):
            yield Occurrence(turn, "explained")


def acts_by_itself(talk: DialogueView) -> bool:
    """Returns whether the car performs an action that needs a reason: stops for a hazard, or turns round."""
    return talk.happened(EventType.HAZARD_STOP) or talk.did(PhysicalAction.U_TURN)


def overlap(talk: DialogueView) -> Iterator[Occurrence]:
    """Finds 19: both speakers begin an exchange while the other is speaking, and both are answered."""
    begun = sorted(_answered_exchanges(talk), key=lambda turn: turn.number)
    for k, first in enumerate(begun):
        for other in itertools.islice(begun, k + 1, None):
            if other.start >= first.end:
                break
            if first.speaker is not other.speaker:
                yield Occurrence(first, "both answered")
                break


def _answered_exchanges(talk: DialogueView) -> Iterator[Turn]:
    """Returns the turns that open an exchange in which the other speaker takes part."""
    opened: dict[int | None, Turn] = {}
    answered: dict[int | None, Turn] = {}
    for turn in talk.turns:
        for act, exchange in zip(turn.acts, turn.exchanges, strict=True):
            if exchange is None:
                continue
            if exchange not in opened:
                opened[exchange] = turn
            elif opened[exchange].speaker is not turn.speaker and act.move not in EXPECTATIONS:
                answered.setdefault(exchange, opened[exchange])
    return (opener for opener in answered.values() if opener.does(*EXPECTATIONS))


def irrelevant(talk: DialogueView) -> Iterator[Occurrence]:
    """Finds 20: talk unrelated to the drive."""
    for turn in talk.turns:
        if turn.does(M.IRRELEVANT):
            yield Occurrence(turn, "human" if turn.speaker is HUMAN else "car")


def abandoned(talk: DialogueView) -> Iterator[Occurrence]:
    """Finds 21: a question gets no answer for ten seconds, and is rephrased or dropped."""
    said_by_both: dict[int | None, set[object]] = {}
    for turn in talk.turns:
        for exchange in turn.exchanges:
            said_by_both.setdefault(exchange, set()).add(turn.speaker)
    for turn in talk.turns:
        asked = [k for act, k in zip(turn.acts, turn.exchanges, strict=True) if act.move in QUESTIONS]
        unanswered = any(k is not None and len(said_by_both[k]) == 1 for k in asked)
        if not unanswered or talk.session.duration - turn.end < ANSWER_TIMEOUT:
            continue
        answered = talk.answers(turn, *(set(M) - {M.IRRELEVANT, M.ALIGN}), within=ANSWER_TIMEOUT)
        if any(not other.does(*EXPECTATIONS) for other in answered):
            continue
        yield Occurrence(turn, "asked again" if _asked_again(talk, turn) else "dropped")


def _asked_again(talk: DialogueView, turn: Turn) -> bool:
    slots = {value.slot for act in turn.doing(*QUESTIONS) for value in act.slots}
    for other in talk.later(turn, within=REPEAT_WINDOW):
        if other.speaker is turn.speaker and other.does(*QUESTIONS) and plain(other.text) != plain(turn.text):
            if not slots or slots & {value.slot for act in other.doing(*QUESTIONS) for value in act.slots}:
                return True
    return False


def has_question(talk: DialogueView) -> bool:
    """Returns whether there is a question."""
    return any(turn.does(*QUESTIONS) for turn in talk.turns)


def speech_trouble(talk: DialogueView) -> Iterator[Occurrence]:
    """Finds 24: the recogniser misheard the participant, the car's answer shows it, and the participant corrects it.

    The car's answer shows confusion, or a name that was not said; the participant then clarifies, denies, or repeats
    the intended content.
    """
    for turn in talk.by(HUMAN):
        if not misheard(turn):
            continue
        for answer in talk.answers(turn):
            puzzled = answer.does(M.CONFUSE)
            got = answer.names(Slot.LANDMARK) | answer.names(Slot.STREET)
            mistaken = bool(got) and not got & _said_lately(talk, turn)
            if (puzzled or mistaken) and _put_right(talk, turn, answer):
                yield Occurrence(turn, "not understood" if puzzled else "misunderstood")
                break


def _said_lately(talk: DialogueView, turn: Turn) -> frozenset[SlotValue]:
    """Returns the places that were named in a turn, or by any speaker shortly before it."""
    turns = [turn, *talk.before(turn, within=MENTION_WINDOW)]
    return frozenset(value for each in turns for slot in (Slot.LANDMARK, Slot.STREET) for value in each.names(slot))


def _put_right(talk: DialogueView, turn: Turn, answer: Turn) -> bool:
    for repair in talk.answers(answer):
        if repair.does(M.CLARIFY, M.REPLY_N):
            return True
        meant = {value for act in turn.acts for value in act.slots}
        if repair.does(M.INSTRUCT, M.EXPLAIN, M.REPLY_W) and meant & {v for act in repair.acts for v in act.slots}:
            return True
    return False


def misheard(turn: Turn) -> bool:
    """Returns whether a recogniser returned other words than were said."""
    return turn.recognised is not None and words_of(turn.recognised) != words_of(turn.text)


def has_mishearing(talk: DialogueView) -> bool:
    """Returns whether the participant was misheard."""
    return any(misheard(turn) for turn in talk.by(HUMAN))
