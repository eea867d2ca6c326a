"""Phenomena 1 to 4, 17, 18, 22: where to go and how."""

from __future__ import annotations

import re
from collections.abc import Iterator

from dorothie_gym.ontology import ActionValue, DialogueMove, LandmarkName, PhysicalAction, Slot
from dorothie_gym.sessions.statistics.phenomena.query import CAR, HUMAN, Finding
from dorothie_gym.sessions.statistics.phenomena.talk import Talk, asks_for, named

M = DialogueMove

STEPS = (
    ActionValue.LANE_FOLLOW, ActionValue.LANE_SWITCH, ActionValue.U_TURN, ActionValue.J_TURN, ActionValue.STOP,
    ActionValue.START,
)  # fmt: skip

_TAKEN_UP = (M.ACKNOWLEDGE, M.CONFIRM, M.REPLY_Y)
_WHY = re.compile(r"\bwhy\b|\bhow come\b|\bwhat for\b|\breason\b")
_WAY = re.compile(r"\bhow (?:are|will|do|would)\b|\bwhich (?:way|route|road|street)\b|\broute\b|\bplan\b|\bway\b")
_WRONG = re.compile(
    r"\bwrong\b|\bmissed\b|\bnot (?:that|this|the right) (?:way|one|turn|street|road)\b"
    r"|\bshould(?:'ve| have)\b|\bshouldn't\b|\bdidn't (?:say|mean|want)\b|\bturned? too\b|\bwent past\b|\bpassed it\b"
)
_REFERENCE = re.compile(
    r"(?<!out )\bthere\b"
    r"|\b(?:the|this|that) (?:next|last|first|second|third|other|same) (?:one|street|road|side|turn|light|corner)\b"
    r"|\bnext one\b|\bother side\b|\bsame (?:street|road|place|way)\b|\bone we (?:just )?(?:passed|saw|took)\b"
    r"|\bpast it\b|\bthe latter\b|\bthe former\b"
)
_NOT_A_PLACE = re.compile(
    r"\bthere(?:'s| is| are| was| were| will| seems|'re)\b|\bhi there\b|\bhey there\b|\bhello there\b"
)


def goal_level(talk: Talk) -> Iterator[Finding]:
    """1: the participant instructs by naming a place, and the car takes it up."""
    for turn in talk.by(HUMAN, M.INSTRUCT):
        if any(named(act, Slot.LANDMARK) for act in turn.doing(M.INSTRUCT)) and talk.answered(turn, *_TAKEN_UP):
            yield Finding(turn, "goal")


def step_level(talk: Talk) -> Iterator[Finding]:
    """2: the participant instructs the next step without naming a place, and the car takes it up."""
    for turn in talk.by(HUMAN, M.INSTRUCT):
        steps = [act for act in turn.doing(M.INSTRUCT) if named(act, Slot.ACTION) & set(STEPS)]
        if steps and not turn.names(Slot.LANDMARK) and talk.answered(turn, *_TAKEN_UP):
            yield Finding(turn, "step")


def two_acts(talk: Talk) -> Iterator[Finding]:
    """3: an utterance of the participant does two different things."""
    for turn in talk.by(HUMAN):
        if len({act.move for act in turn.acts}) > 1:
            yield Finding(turn, "two acts")


def asked_at_junction(talk: Talk) -> Iterator[Finding]:
    """4: the car asks which way, and the participant says it."""
    for turn in talk.by(CAR, M.QUERY_W):
        if not any(asks_for(act, Slot.ACTION, Slot.STREET) for act in turn.doing(M.QUERY_W)):
            continue
        for answer in talk.answers(turn, M.REPLY_W, M.INSTRUCT):
            if answer.names(Slot.ACTION) | answer.names(Slot.STREET):
                yield Finding(turn, "told")
                break


def plan_on_request(talk: Talk) -> Iterator[Finding]:
    """17: the participant asks how the car will go, and it names turns or streets."""
    for turn in talk.by(HUMAN, M.QUERY_W):
        asks = any(asks_for(act, Slot.ACTION, Slot.STREET) for act in turn.doing(M.QUERY_W))
        if turn.says(_WHY) or not (asks or turn.says(_WAY)):
            continue
        for answer in talk.answers(turn, M.REPLY_W):
            told = {value for act in answer.doing(M.REPLY_W, M.EXPLAIN) for value in act.slots}
            if answer.names(Slot.STREET) or told & set(STEPS):
                yield Finding(turn, "described")
                break


def wrong_turn(talk: Talk) -> Iterator[Finding]:
    """18: the participant says that the car went wrong, and it says or does something about it."""
    for turn in talk.by(HUMAN, M.EXPLAIN, M.REPLY_N, M.INSTRUCT, M.CLARIFY):
        turned = talk.did(*_TURNS, since=turn.start - 45.0, until=turn.end)
        if not turn.says(_WRONG) or not turned:
            continue
        if talk.did(*_TURNS, since=turn.end, until=turn.end + 30.0):
            yield Finding(turn, "corrected")
        elif talk.answered(turn):
            yield Finding(turn, "answered")


_TURNS = (PhysicalAction.J_TURN, PhysicalAction.U_TURN, PhysicalAction.LANE_SWITCH)


def turns_at_junctions(talk: Talk) -> bool:
    """Whether the car turned at a junction."""
    return talk.did(PhysicalAction.J_TURN)


def references(talk: Talk) -> Iterator[Finding]:
    """22: a place is pointed at, by where or when, instead of being named."""
    for turn in talk.turns:
        text = _NOT_A_PLACE.sub(" ", turn.text.casefold().replace("’", "'"))
        if turn.does(M.IRRELEVANT) and len(turn.acts) == 1:
            continue
        if _REFERENCE.search(text):
            yield Finding(turn, "human" if turn.speaker is HUMAN else "car")


def asks_where_next(talk: Talk, number: int) -> bool:
    """Whether the turn of a number is the question where to go next."""
    return any(LandmarkName.QUERIED in act.slots for act in talk.turns[number].doing(M.QUERY_W))


def is_why(text: str) -> bool:
    """Whether a question asks for a reason."""
    return _WHY.search(text.casefold()) is not None
