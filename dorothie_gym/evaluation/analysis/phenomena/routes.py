"""Queries of phenomena 1 to 4, 17, 18 and 22: destinations and routes."""

from __future__ import annotations

import re
from collections.abc import Iterator

from dorothie_gym.evaluation.analysis.phenomena.dialogue_view import (
    CAR,
    HUMAN,
    DialogueView,
    Occurrence,
    Turn,
    asks_for,
    named,
)
from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.slots import ActionValue, GoalStatus, LandmarkName, Slot

M = DialogueMove

STEPS = (
    ActionValue.LANE_FOLLOW,
    ActionValue.LANE_SWITCH,
    ActionValue.U_TURN,
    ActionValue.J_TURN,
    ActionValue.STOP,
    ActionValue.START,
)

_TAKEN_UP = (M.ACKNOWLEDGE, M.CONFIRM, M.REPLY_Y)
_WAYS = frozenset({ActionValue.LANE_FOLLOW, ActionValue.LANE_SWITCH, ActionValue.U_TURN, ActionValue.J_TURN})
"""Actions that choose a route."""

_NOT_TO_BE = frozenset({GoalStatus.ABANDONED, GoalStatus.COMPLETE})

_WHY = re.compile(r"\bwhy\b(?! not\b| don't\b)|\bhow come\b|\bwhat for\b|\breason\b")
_WAY = re.compile(r"\bhow (?:are|will|do|would)\b|\bwhich (?:way|route|road|street)\b|\broute\b|\bplan\b|\bway\b")
_WRONG = re.compile(
    r"\bwrong (?:way|turn|one|street|road|lane|side|direction|exit|corner)\b"
    r"|\b(?:was|is|that's|it's|went|gone|turned) wrong\b|\bwent past\b|\bpassed it\b"
    r"|\b(?:you|we|you've|we've)(?: have)?(?: just)? (?:missed|passed) (?:it|that|the|our)\b"
    r"|\bnot (?:that|this|the right) (?:way|one|turn|street|road)\b|\bturned? too (?:early|late|soon)\b"
    r"|\b(?:you|we) (?:should(?:'ve| have)|shouldn't have) (?:turned|gone|taken|stayed|kept|stopped|made|been|driven)\b"
    r"|\bdidn't (?:say|mean|want)\b"
)
_REFERENCE = re.compile(
    r"(?<!out )\bthere\b"
    r"|\b(?:the|this|that) (?:next|last|first|second|third|other|same) (?:one|street|road|side|turn|light|corner)\b"
    r"|\bnext one\b|\bother side\b|\bsame (?:street|road|place|way)\b|\bone we (?:just )?(?:passed|saw|took)\b"
    r"|\bpast it\b|\bthe latter\b|\bthe former\b"
)
_NOT_A_PLACE = re.compile(
    r"\bthere(?:'s| is| are| was| were| will| seems|'re)\b|\b(?:hi|hey|hello|almost|nearly|hang|hold on) there\b"
    r"|\b(?:is|are|was|were) there (?:a|an|any|no|some|something|time)\b|\bthere (?:you|we) (?:go|are)\b|\bthere yet\b"
)


def goal_level(talk: DialogueView) -> Iterator[Occurrence]:
    """Finds 1: the participant instructs by naming a place, and the car takes it up."""
    for turn in talk.by(HUMAN, M.INSTRUCT):
        goals = [act for act in turn.doing(M.INSTRUCT) if named(act, Slot.LANDMARK) and not act.slots & _NOT_TO_BE]
        if goals and talk.replied(turn, *_TAKEN_UP):
            yield Occurrence(turn, "goal")


def step_level(talk: DialogueView) -> Iterator[Occurrence]:
    """Finds 2: the participant instructs the next step without naming a place, and the car takes it up."""
    for turn in talk.by(HUMAN, M.INSTRUCT):
        steps = [act for act in turn.doing(M.INSTRUCT) if named(act, Slot.ACTION) & set(STEPS)]
        if steps and not turn.names(Slot.LANDMARK) and talk.replied(turn, *_TAKEN_UP):
            yield Occurrence(turn, "step")


def two_acts(talk: DialogueView) -> Iterator[Occurrence]:
    """Finds 3: an utterance of the participant holds two different acts."""
    for turn in talk.by(HUMAN):
        if len({act.move for act in turn.acts} - {M.IRRELEVANT}) > 1:
            yield Occurrence(turn, "two acts")


def asked_at_junction(talk: DialogueView) -> Iterator[Occurrence]:
    """Finds 4: the car asks for the direction, and the participant gives it."""
    for turn in talk.by(CAR, M.QUERY_W):
        if not any(asks_for(act, Slot.ACTION, Slot.STREET) for act in turn.doing(M.QUERY_W)):
            continue
        for answer in talk.replies(turn, M.REPLY_W, M.INSTRUCT):
            if answer.names(Slot.ACTION) & _WAYS or answer.names(Slot.STREET):
                yield Occurrence(turn, "answered")
                break


def plan_on_request(talk: DialogueView) -> Iterator[Occurrence]:
    """Finds 17: the participant asks for the route, and the car names turns or streets."""
    for turn in talk.by(HUMAN, M.QUERY_W):
        asks = any(asks_for(act, Slot.ACTION, Slot.STREET) for act in turn.doing(M.QUERY_W))
        if turn.says(_WHY, M.QUERY_W) or not (asks or turn.says(_WAY, M.QUERY_W)):
            continue
        for answer in talk.replies(turn, M.REPLY_W):
            mentioned = {value for act in answer.doing(M.REPLY_W, M.EXPLAIN) for value in act.slots}
            if answer.names(Slot.STREET) or mentioned & set(STEPS):
                yield Occurrence(turn, "described")
                break


def wrong_turn(talk: DialogueView) -> Iterator[Occurrence]:
    """Finds 18: the participant reports a wrong turn, and the car answers or corrects it."""
    for turn in talk.by(HUMAN, *_OBJECTS):
        turned = talk.did(*_TURNS, since=turn.start - 45.0, until=turn.end)
        if not turn.says(_WRONG, *_OBJECTS) or not turned:
            continue
        if talk.did(PhysicalAction.U_TURN, since=turn.start, until=turn.end + 30.0):
            yield Occurrence(turn, "corrected")
        elif talk.answered(turn):
            yield Occurrence(turn, "answered")


_OBJECTS = (M.EXPLAIN, M.REPLY_N, M.INSTRUCT, M.CLARIFY)
_TURNS = (PhysicalAction.J_TURN, PhysicalAction.U_TURN, PhysicalAction.LANE_SWITCH)


def turns_at_junctions(talk: DialogueView) -> bool:
    """Returns whether the car turned at a junction."""
    return talk.did(PhysicalAction.J_TURN)


def references(talk: DialogueView) -> Iterator[Occurrence]:
    """Finds 22: a place is referred to by position or time instead of its name."""
    for turn in talk.turns:
        spans = (span for act, span in zip(turn.acts, turn.spans, strict=True) if act.move is not M.IRRELEVANT)
        if any(_REFERENCE.search(_NOT_A_PLACE.sub(" ", span.casefold().replace("’", "'"))) for span in spans):
            yield Occurrence(turn, "human" if turn.speaker is HUMAN else "car")


def asks_where_next(talk: DialogueView, number: int) -> bool:
    """Returns whether the turn with this number asks for the next destination."""
    return any(LandmarkName.QUERIED in act.slots for act in talk.turns[number].doing(M.QUERY_W))


def asks_why(turn: Turn) -> bool:
    """Returns whether a turn asks for a reason."""
    return turn.says(_WHY, M.QUERY_W, M.QUERY_YN)
