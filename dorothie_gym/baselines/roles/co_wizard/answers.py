"""Answers of the learned Co-Wizard from its evidence, and rules that exclude remarks.

The network chooses whether to answer a question. The answers are those of the scripted Co-Wizard with the knowledge of
the memory (`policies.co_wizard.answers`). A remark that was not understood is repeated from memory.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from dorothie_gym.baselines.roles.learned_role.encoding import seconds_since
from dorothie_gym.dialogue.intentions import CommunicativeFunction
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.slots import ActionValue, ObjectClass, Slot, SlotValue, StreetName
from dorothie_gym.policies.co_wizard.answers import arrival, judged, why_standing, why_turning_round
from dorothie_gym.policies.co_wizard.proposition_truth import believes
from dorothie_gym.policies.speech import Remark, repeated

if TYPE_CHECKING:
    from dorothie_gym.baselines.roles.co_wizard.memory import WorkingMemory
    from dorothie_gym.baselines.roles.learned_role.utterance_inputs import Utterance
    from dorothie_gym.policies.co_wizard.view import CoWizardView

_OPEN_QUESTIONS: Final[Mapping[SlotValue, tuple[Predicate, ...]]] = MappingProxyType(
    {
        ActionValue.STOP: (Predicate.STANDS,),
        ActionValue.U_TURN: (Predicate.DOES,),
        ObjectClass.QUERIED: (Predicate.SEES,),
        ActionValue.QUERIED: (Predicate.WILL, Predicate.GOAL),
        StreetName.QUERIED: (Predicate.ON_STREET,),
    }
)
"""Subjects of answers to open questions, by a slot value of the question; the subject of a reason is its effect."""

QUESTIONS: Final = (DialogueMove.QUERY_W, DialogueMove.QUERY_YN, DialogueMove.CHECK)

ANSWERED_WITHIN: Final = 10.0
"""Longest time between a question and its answer [s]."""

SAID_AGAIN_AFTER: Final = 8.0
"""Time after which a remark may be repeated although the participant has said nothing since [s]."""

_ANSWERS: Final = (DialogueMove.REPLY_Y, DialogueMove.REPLY_N, DialogueMove.REPLY_U, DialogueMove.CONFIRM)
_REASONS_AND_TIMES: Final = (Predicate.BECAUSE, Predicate.STANDS, Predicate.ARRIVES_IN)
_STATEMENTS: Final = (*_ANSWERS, DialogueMove.REPLY_W, DialogueMove.EXPLAIN)


def answer_to(utterance: Utterance | None, memory: WorkingMemory, view: CoWizardView) -> Remark | None:
    """Returns the answer to the last question if it follows from the evidence; None without such a question.

    These are questions that yes or no answers, why the car stands or turns round, and when it arrives.

    Args:
        utterance: latest utterance of the participant.
        memory: working memory.
        view: observation.
    """
    if utterance is None or view.time - utterance.time > ANSWERED_WITHIN:
        return None
    if utterance.asks is None:
        return _open_answer(utterance, memory, view)
    asked = _verified(utterance, memory)
    if asked is None:
        return None
    checks = utterance.asks is DialogueMove.CHECK
    yes = CommunicativeFunction.CONFIRM if checks else CommunicativeFunction.AFFIRMATIVE_ANSWER
    return judged(memory.knowledge, view, asked, yes)


def _verified(utterance: Utterance, memory: WorkingMemory) -> Proposition | None:
    """Returns the proposition of a yes/no question; a check without further content is about the current goal."""
    if utterance.asks is not DialogueMove.CHECK:
        return utterance.asked
    if utterance.places:
        return Proposition.of(Predicate.GOAL, place=utterance.places[0])
    return utterance.asked or Proposition.of(Predicate.GOAL, place=memory.goal)


def _open_answer(utterance: Utterance, memory: WorkingMemory, view: CoWizardView) -> Remark | None:
    """Returns the answer to why the car stands or turns round, or when it arrives; None to other questions."""
    if utterance.asks_why is ActionValue.STOP:
        return why_standing(memory.knowledge, view)
    if utterance.asks_why is ActionValue.U_TURN:
        return why_turning_round(memory.knowledge, view)
    asked = utterance.stated
    if asked is None or asked.predicate is not Predicate.ARRIVES_IN:
        return None
    return arrival(memory.knowledge, view)


def is_answer(remark: Remark, answer: Remark) -> bool:
    """Returns whether a remark is an answer like those of `answer`: yes, no, a reason, a time, or "not known"."""
    if remark.act.move is DialogueMove.REPLY_W:
        to_open_question = answer.act.move not in _ANSWERS or not answer.meaning
        return to_open_question and bool(remark.meaning) and remark.meaning[0].predicate in _REASONS_AND_TIMES
    if remark.act.move not in _ANSWERS:
        return False
    return not remark.meaning or (bool(answer.meaning) and remark.meaning[0].predicate is answer.meaning[0].predicate)


def said_again(utterance: Utterance | None, memory: WorkingMemory) -> Remark | None:
    """Returns a repetition of the Co-Wizard's last remark if the participant has just not understood it."""
    if utterance is None or memory.last is None or not utterance.heard.acts:
        return None
    if utterance.heard.acts[0].move is not DialogueMove.CONFUSE:
        return None
    if memory.last.act.move in QUESTIONS or not memory.last.act.slots:
        return memory.last
    return repeated(memory.last, CommunicativeFunction.CORRECTION)


def is_sayable(
    remark: Remark,
    topic: str,
    memory: WorkingMemory,
    view: CoWizardView,
    utterance: Utterance | None,
    answer: Remark | None = None,
) -> bool:
    """Returns whether a remark is not ruled out.

    The evidence rules out statements that it denies, answers to other questions, acknowledgements instead of an answer,
    and repetitions. Only the last rule applies to the answer that follows from the evidence.

    Args:
        remark: the remark.
        topic: topic of the remark.
        memory: working memory.
        view: observation.
        utterance: latest utterance of the participant.
        answer: answer to the last question (`answer_to`).
    """
    said_at = dict(memory.said_at).get(topic)
    if said_at is not None and said_at > memory.heard_at and seconds_since(view.time, said_at) < SAID_AGAIN_AFTER:
        return False
    if answer is not None and (remark.act, remark.meaning) == (answer.act, answer.meaning):
        return True
    if remark.act.move is DialogueMove.ACKNOWLEDGE:
        return utterance is None or not _waits_for_answer(utterance, memory)
    if remark.act.move not in _STATEMENTS:
        return True
    if any(_is_denied(memory, view, said) for said in remark.meaning):
        return False
    if remark.act.move is DialogueMove.EXPLAIN or utterance is None or not remark.meaning:
        return True
    return _is_about(remark.meaning[0], utterance)


def _waits_for_answer(utterance: Utterance, memory: WorkingMemory) -> bool:
    """Returns whether an utterance contains a question that has not been answered yet."""
    return memory.spoke_at < utterance.time and any(act.move in QUESTIONS for act in utterance.heard.acts)


def _is_denied(memory: WorkingMemory, view: CoWizardView, said: Proposition) -> bool:
    if said.predicate is Predicate.BECAUSE:
        cause = said.get("cause")
        return said.get("at") is None and isinstance(cause, Proposition) and _is_denied(memory, view, cause)
    return believes(memory.knowledge, view, said) is False


def _is_about(answer: Proposition, utterance: Utterance) -> bool:
    """Returns whether an answer is about the question of an utterance, as it was understood."""
    asked = _asked_about(utterance)
    if not asked:
        return True
    effect = answer.get("effect") if answer.predicate is Predicate.BECAUSE else answer
    return answer.predicate in asked or (isinstance(effect, Proposition) and effect.predicate in asked)


def _asked_about(utterance: Utterance) -> tuple[Predicate, ...]:
    """Returns the predicates of answers to a question; empty if it was not understood."""
    asked = utterance.asked if utterance.asks is not None else utterance.stated
    if asked is not None:
        return (asked.predicate,)
    for act in utterance.heard.acts:
        if act.move in (DialogueMove.QUERY_W, DialogueMove.QUERY_YN):
            found = (predicates for value, predicates in _OPEN_QUESTIONS.items() if value in act.slots)
            return next(found, (Predicate.LOCATED,) if act.values(Slot.LANDMARK) else ())
    return ()
