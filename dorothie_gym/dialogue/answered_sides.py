"""Answers that name only a side: the question before them tells whether it is one of a lane, a stop, or a place.

"Left" after "which lane?" asks for the left lane, and after "which side should I stop on?" for a stop on the left.
After a question for the way, or without any, it is a turn.
"""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.routes import DrivingPlan, PlanStep, StepAction
from dorothie_gym.ontology.dialogue_acts import DialogueAct
from dorothie_gym.ontology.slots import ActionValue

if TYPE_CHECKING:
    from collections.abc import Sequence

    from dorothie_gym.dialogue.nlu import ParsedText

_ASKS: Final = re.compile(r"\b(which|what|whether)\b|\bor\b|\?")
_LANE: Final = re.compile(r"\blanes?\b")
_SIDE: Final = re.compile(r"\b(sides?|kerb|curb|pavement|sidewalk)\b")
_PLACE: Final = re.compile(
    r"\bside (is|are|was|'s)\b|\b(is|are) (it|he|she|they|the|your|my)\b|\bside's\b|\bside do (they|you) live\b"
)
_WAYS: Final = re.compile(r"\b(way|ways|lanes?|sides?|left|right|direction|turn|kerb|curb)\b")
_RIGHT: Final = re.compile(
    r"^(\W*(?:um,? |uh,? |er,? |oh,? )*right)\s*,\s*(please|thanks|thank you|i (?:think|guess)|mate|sir)\b", re.I
)
_TURNING: Final = re.compile(
    r"\b(turn|turning|hang|bear|take a|make|first|second|third|next|junction|corner|exit|street|at the)\b"
    r"|\ba (left|right)\b"
)
"""Words of an answer that is about a turn all the same."""


def asked_about(question: str) -> StepAction | None:
    """Returns what a side answers after a question; None for a turn.

    Args:
        question: words of the other speaker's last remark; may be empty.

    Returns:
        LANE for "which lane?", STOP for "which side should I stop on?", VISIT for "which side is it on?", or None.
    """
    words = question.lower()
    if _ASKS.search(words) is None:
        return None
    if _LANE.search(words) is not None:
        return StepAction.LANE
    if _SIDE.search(words) is None:
        return None
    return StepAction.VISIT if _PLACE.search(words) is not None else StepAction.STOP


def plain_answer(text: str, question: str) -> str:
    """Returns an answer without the comma that makes a sign of hearing of its side: "right, please".

    Args:
        text: the answer.
        question: words of the other speaker's last remark.
    """
    words = question.lower()
    asks = _ASKS.search(words) is not None and _WAYS.search(words) is not None
    return _RIGHT.sub(r"\1 \2", text, count=1) if asks else text


def answering(parsed: ParsedText, asked: StepAction | None) -> ParsedText:
    """Returns the parsed answer to a question, where a mere side is what was asked for.

    Args:
        parsed: the answer by itself.
        asked: as from `asked_about`.
    """
    first = parsed.plan.steps[0] if parsed.plan.steps else None
    if asked is None or first is None or not _is_side(first) or _TURNING.search(parsed.text.lower()) is not None:
        return parsed
    side = first.direction or first.side
    steps = {
        StepAction.LANE: (PlanStep(action=StepAction.LANE, direction=side),),
        StepAction.STOP: (PlanStep(action=StepAction.STOP, side=side),),
    }.get(asked, ())
    plan = DrivingPlan((*steps, *parsed.plan.steps[1:]))
    turns = parsed.turns if len(parsed.turns) > 1 or asked is StepAction.LANE else ()
    parse = None if parsed.parse is None else replace(parsed.parse, plan=plan, aside=asked is not StepAction.LANE)
    return replace(parsed, plan=plan, parse=parse, turns=turns, actions=_actions(parsed.actions, asked))


def answering_act(act: DialogueAct, parsed: ParsedText, asked: StepAction | None) -> DialogueAct:
    """Returns the act of an answer to a question, where a mere side is what was asked for; see `answering`."""
    meant = answering(parsed, asked)
    if meant is parsed:
        return act
    kept = frozenset(value for value in act.slots if not isinstance(value, ActionValue))
    return DialogueAct(act.move, kept | frozenset(meant.actions))


def _is_side(step: PlanStep) -> bool:
    """Returns whether a step names nothing but a side."""
    if step.action is StepAction.TURN:
        return step == PlanStep(action=StepAction.TURN, direction=step.direction) and step.direction is not None
    return step.side is not None and step == PlanStep(action=StepAction.STOP, side=step.side)


def _actions(actions: Sequence[ActionValue], asked: StepAction) -> tuple[ActionValue, ...]:
    kept = tuple(value for value in actions if value not in (ActionValue.J_TURN, ActionValue.STOP))
    return (ActionValue.LANE_SWITCH, *kept) if asked is StepAction.LANE else kept
