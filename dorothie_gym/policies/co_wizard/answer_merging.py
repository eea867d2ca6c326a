"""Merging of the Co-Wizard's answers to one utterance: order, repetitions, and remarks of before that are still due."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from dorothie_gym.dialogue.propositions import Predicate
from dorothie_gym.ontology.dialogue_acts import ORDERING_MOVES, SIGNS_OF_HEARING, DialogueMove, MoveGroup
from dorothie_gym.ontology.slots import GoalStatus, Slot, StreetName
from dorothie_gym.policies import act_builders
from dorothie_gym.policies.policy import replace

if TYPE_CHECKING:
    from dorothie_gym.ontology.dialogue_acts import DialogueAct
    from dorothie_gym.policies.co_wizard.state import CoWizardState
    from dorothie_gym.policies.speech import Remark

_SETTLED = act_builders.QUESTIONS | {DialogueMove.ALIGN}
_YES = DialogueMove.REPLY_Y
_ANSWERS = MoveGroup.REPLY.moves
_NAMING = SIGNS_OF_HEARING | {DialogueMove.CONFIRM}
_PLANS = frozenset({Predicate.GOAL, Predicate.ARRIVES_IN, Predicate.HAS_ROUTE, Predicate.KNOWS})


def still_due(state: CoWizardState, acts: Sequence[DialogueAct]) -> tuple[tuple[Remark, ...], tuple[Remark, ...]]:
    """Returns the queued remarks without the Co-Wizard's questions and plans, which the utterance may have settled.

    Args:
        state: working copy of the state.
        acts: acts of the utterance; after an order, or a request to repeat, only answers are still due.

    Returns:
        Answers and what is joined to them, which come before the reply to the utterance, and other remarks, which come
        after it.
    """
    ordered = any(
        act.move is DialogueMove.CONFUSE or (act.move in ORDERING_MOVES and act.values(Slot.ACTION)) for act in acts
    )
    kept: list[Remark] = []
    dropped = False
    for item in state.speech.queue:
        idle = item.act.move in _SETTLED or any(said.predicate in _PLANS for said in item.meaning)
        idle = idle or (ordered and item.act.move not in _ANSWERS)
        dropped = dropped if item.joined else idle and not item.urgent
        if not dropped:
            kept.append(item)
    if len(kept) < len(state.speech.queue):
        state.dialogue = state.dialogue.with_proposal(None)
    return _owed_first(kept)


def _owed_first(queue: Sequence[Remark]) -> tuple[tuple[Remark, ...], tuple[Remark, ...]]:
    """Divides remarks into reactions, with what is joined to them, and remarks of the speaker's own accord."""
    owed: list[Remark] = []
    own: list[Remark] = []
    kind = owed
    for item in queue:
        if not item.joined:
            kind = own if item.act.move is DialogueMove.EXPLAIN and not item.urgent else owed
        kind.append(item)
    return tuple(owed), tuple(own)


def in_one_breath(answers: Sequence[Remark]) -> tuple[Remark, ...]:
    """Joins the answers to an utterance.

    An "okay" is dropped if another remark follows, and "what?" if a part of the utterance was understood; small talk is
    only answered where there is nothing else. Plans come last.
    """
    answers = [item for item in answers if item.act.move is not DialogueMove.IRRELEVANT] or answers
    answers = [item for k, item in enumerate(answers) if not any(_says_same(item, other) for other in answers[:k])]
    if any(said.predicate is Predicate.KNOWS for item in answers if item.act.move is _YES for said in item.meaning):
        answers = [item for item in answers if item.act.move is not DialogueMove.CHECK and not _knows_way(item)]
    answers = [item for k, item in enumerate(answers) if not _is_named_again(item, answers[k + 1 :])]
    if any(GoalStatus.UNKNOWN in item.act.slots for item in answers):
        answers = [item for item in answers if not _takes_street(item)]
    checked = [item.act.values(Slot.LANDMARK) for item in answers if item.act.move is DialogueMove.CHECK]
    answers = [
        item
        for item in answers
        if item.act.move not in SIGNS_OF_HEARING or item.act.values(Slot.LANDMARK) not in checked
    ]
    understood = [item for item in answers if item.act.move is not DialogueMove.CONFUSE]
    answers = sorted(understood or answers[:1], key=_tells_plan)
    plans = [k for k, item in enumerate(answers) if _tells_plan(item)]
    answers = [item for k, item in enumerate(answers) if k not in plans[1:]]  # one of them is enough
    plain = list(map(is_plain_sign, answers))
    leads = [following.joined for following in answers[1:]]
    kept = [item for k, item in enumerate(answers) if not plain[k] or (k == 0 and (all(plain) or leads[0]))]
    return tuple(replace(item, joined=k > 0 or item.joined) for k, item in enumerate(kept))


def _takes_street(item: Remark) -> bool:
    """Returns whether a remark only takes on a street, which contradicts that the place is unknown."""
    return item.act.move is DialogueMove.CONFIRM and all(isinstance(value, StreetName) for value in item.act.slots)


def _knows_way(item: Remark) -> bool:
    """Returns whether a remark states that the way is known, as "I know where it is" has said."""
    return any(said.predicate is Predicate.HAS_ROUTE for said in item.meaning) and not item.act.slots


def _is_named_again(item: Remark, behind: Sequence[Remark]) -> bool:
    """Returns whether a place that is only acknowledged is named again behind: "the house, the house it is"."""
    places = item.act.values(Slot.LANDMARK)
    if item.act.move is not DialogueMove.ACKNOWLEDGE or not places or item.act.values(Slot.STATUS):
        return False
    return any(other.act.move in _NAMING and other.act.values(Slot.LANDMARK) == places for other in behind)


def _says_same(item: Remark, other: Remark) -> bool:
    """Returns whether two remarks have the same contents, and some at all."""
    alike = item.act.move is other.act.move or {item.act.move, other.act.move} <= SIGNS_OF_HEARING
    same = item.act.slots == other.act.slots and item.wording.direction is other.wording.direction
    return bool(item.act.slots) and alike and same


def is_plain_sign(item: Remark) -> bool:
    """Returns whether a remark is a mere "okay" or "will do"."""
    taken = item.act.move is DialogueMove.CONFIRM and item.wording.topic == "taken"
    return (taken or item.act.move is DialogueMove.ACKNOWLEDGE) and not item.act.slots


def _tells_plan(item: Remark) -> bool:
    """Returns whether a remark states a plan without being asked."""
    plan = any(said.predicate in _PLANS for said in item.meaning)
    return item.act.move is DialogueMove.EXPLAIN and plan and GoalStatus.UNKNOWN not in item.act.slots
