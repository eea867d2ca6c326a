"""Dialogue moves and acts, and the decision tree that annotates them."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from types import MappingProxyType
from typing import Self, TypeAlias

from dorothie_gym.errors import OntologyError
from dorothie_gym.ontology.labelled_enums import LabelledInt, complete, unknown_spelling
from dorothie_gym.ontology.slots import SLOT_VALUES, Slot, SlotValue
from dorothie_gym.support.copying import shared


class DialogueMove(LabelledInt):
    """Communicative function of a span of an utterance; ids as in SDN (moves after Carletta et al. 1997)."""

    IRRELEVANT = 0, "Irrelevant"
    INSTRUCT = 1, "Instruct"
    EXPLAIN = 2, "Explain"
    ALIGN = 3, "Align"
    CHECK = 4, "Check"
    QUERY_YN = 5, "QueryYN"
    QUERY_W = 6, "QueryW"
    ACKNOWLEDGE = 7, "Acknowledge"
    CONFUSE = 8, "Confuse"
    CLARIFY = 9, "Clarify"
    CONFIRM = 10, "Confirm"
    REPLY_Y = 11, "ReplyY"
    REPLY_N = 12, "ReplyN"
    REPLY_U = 13, "ReplyU"
    REPLY_W = 14, "ReplyW"


VECTOR_SLOTS: tuple[Slot, ...] = (Slot.ACTION, Slot.STREET, Slot.STATUS, Slot.LANDMARK, Slot.OBJECT)
"""Slots in the order of the label vector; SDN puts Status before Landmark despite its larger slot id."""

LABELS: tuple[SlotValue, ...] = tuple(itertools.chain.from_iterable(SLOT_VALUES[slot] for slot in VECTOR_SLOTS))
"""Slot value of each of the 69 entries of the label vector."""

LABEL_INDEX: Mapping[SlotValue, int] = MappingProxyType({value: index for index, value in enumerate(LABELS)})
"""Index of each value in the label vector."""

SLOT_SPANS: Mapping[Slot, slice] = MappingProxyType(
    {slot: slice(LABEL_INDEX[SLOT_VALUES[slot][0]], LABEL_INDEX[SLOT_VALUES[slot][-1]] + 1) for slot in VECTOR_SLOTS}
)
"""Slice of the label vector for each slot; Null has none."""


def in_label_order(values: Iterable[SlotValue]) -> tuple[SlotValue, ...]:
    """Returns the distinct `values` in the order of the label vector.

    Raises:
        OntologyError: if one of them is not a slot value.
    """
    given = tuple(values)
    for value in given:
        if not isinstance(value, SlotValue):
            raise OntologyError(
                f"slot value: {value!r} is not a slot value; pass members of the slot enums, e.g. LandmarkName.KFC"
            )
    return tuple(sorted(set(given), key=LABEL_INDEX.__getitem__))


def encode_slots(values: Iterable[SlotValue]) -> tuple[int, ...]:
    """Returns the label vector (69,) of `values`, with entries 0 and 1.

    Raises:
        OntologyError: if one of the values is not a slot value.
    """
    vector = [0] * len(LABELS)
    for value in in_label_order(values):
        vector[LABEL_INDEX[value]] = 1
    return tuple(vector)


def decode_slots(vector: Iterable[int]) -> frozenset[SlotValue]:
    """Returns the slot values of a label vector (69,) of 0 and 1; the inverse of `encode_slots`.

    Raises:
        OntologyError: if the vector has another length, or if an entry is neither 0 nor 1.
    """
    entries = tuple(vector)
    if len(entries) != len(LABELS):
        raise OntologyError(f"label vector: has {len(entries)} entries, expected {len(LABELS)}")
    for index, (entry, value) in enumerate(zip(entries, LABELS, strict=True)):
        if entry not in (0, 1):
            place = f"{index} ({value.slot.label}={value.label})"
            raise OntologyError(f"label vector: entry {place} is {entry!r}, expected 0 or 1")
    return frozenset(value for entry, value in zip(entries, LABELS, strict=True) if entry)


@shared
@dataclass(frozen=True)
class DialogueAct:
    """Dialogue act of one span of an utterance: a move with slot values.

    Attributes:
        move: the dialogue move.
        slots: slot values; a slot may have none, one or several.

    Raises:
        OntologyError: if `move` is not a DialogueMove, or `slots` is not a frozenset of slot values.
    """

    move: DialogueMove
    slots: frozenset[SlotValue] = frozenset()

    def __post_init__(self) -> None:
        if not isinstance(self.move, DialogueMove):
            raise OntologyError(f"DialogueAct.move: {self.move!r} is not a DialogueMove")
        if not isinstance(self.slots, frozenset):
            raise OntologyError(f"DialogueAct.slots: expected a frozenset, got {self.slots!r}; see DialogueAct.of")
        in_label_order(self.slots)

    @classmethod
    def of(cls, move: DialogueMove, *values: SlotValue) -> Self:
        """Returns the act with `move` and `values`."""
        return cls(move, frozenset(values))

    @property
    def ordered(self) -> tuple[SlotValue, ...]:
        """Slot values in the order of the label vector."""
        return in_label_order(self.slots)

    @cached_property
    def vector(self) -> tuple[int, ...]:
        """Label vector (69,) of the slot values, entries 0 and 1."""
        return encode_slots(self.slots)

    def values(self, slot: Slot) -> tuple[SlotValue, ...]:
        """Returns the values of `slot`, by id."""
        return tuple(value for value in self.ordered if value.slot is slot)

    def slot_labels(self) -> dict[str, list[str]]:
        """Returns {slot: [values]} in the spelling of SDN, slots in vector order; `parse_act` is the inverse."""
        labels = {slot.label: [value.label for value in self.values(slot)] for slot in VECTOR_SLOTS}
        return {slot: values for slot, values in labels.items() if values}

    def __str__(self) -> str:
        slots = ", ".join(f"{slot}={'+'.join(values)}" for slot, values in self.slot_labels().items())
        return f"{self.move.label}({slots})"


class UnitEnd(StrEnum):
    """Outcome of a dialogue unit."""

    COMPLETED = "completed"
    INTERRUPTED = "interrupted"
    FULFILLED = "fulfilled"
    ABANDONED = "abandoned"


class DialogueUnit(StrEnum):
    """Unit of dialogue structure.

    A transaction contains all utterances on one subgoal; an exchange contains an initiating utterance and the
    responses to it. Exchanges may overlap.
    """

    TRANSACTION = "transaction"
    EXCHANGE = "exchange"

    @property
    def ends(self) -> tuple[UnitEnd, ...]:
        """Possible outcomes of the unit."""
        return _ENDS[self]


_ENDS: Mapping[DialogueUnit, tuple[UnitEnd, ...]] = MappingProxyType(
    {
        DialogueUnit.TRANSACTION: (UnitEnd.COMPLETED, UnitEnd.INTERRUPTED, UnitEnd.ABANDONED),
        DialogueUnit.EXCHANGE: (UnitEnd.FULFILLED, UnitEnd.ABANDONED),
    }
)


ORDERING_MOVES = frozenset({DialogueMove.INSTRUCT, DialogueMove.REPLY_W, DialogueMove.CLARIFY})
"""Moves by which a passenger orders something: an instruction, the answer to an open question, a correction."""

SIGNS_OF_HEARING = frozenset({DialogueMove.ACKNOWLEDGE, DialogueMove.CONFIRM})
"""Moves that show that something was heard."""


# --- decision tree ----------------------------------------------------------------------------------------------------


class MoveGroup(StrEnum):
    """Inner node of the decision tree: a class of moves, used by coarser statistics."""

    INITIATE = "Initiate"
    RESPOND = "Respond"
    ASK = "Ask"
    QUERY = "Query"
    COMMUNICATE = "Communicate"
    INFORM = "Inform"
    REPLY = "Reply"

    @property
    def label(self) -> str:
        """Spelling in tables."""
        return self.value

    @property
    def moves(self) -> tuple[DialogueMove, ...]:
        """Moves below the node, by id."""
        return MOVE_GROUPS[self]


@dataclass(frozen=True)
class Answer:
    """One answer to a question, with the node that follows.

    Attributes:
        label: the answer, short enough for a button.
        next: the next question, or the resulting move.
    """

    label: str
    next: Node


@dataclass(frozen=True)
class Question:
    """Question about a span of an utterance.

    Attributes:
        text: the question.
        answers: two or more, with distinct labels.
        group: class of all moves below the question; None at the root.
    """

    text: str
    answers: tuple[Answer, ...]
    group: MoveGroup | None = None

    def __post_init__(self) -> None:
        labels = [answer.label for answer in self.answers]
        if len(labels) < 2 or len(set(labels)) < len(labels):
            raise OntologyError(f"question {self.text!r}: needs two or more different answers, has {labels}")

    def follow(self, label: str) -> Node:
        """Returns the node that follows the answer `label`.

        Raises:
            OntologyError: if the question has no such answer.
        """
        for answer in self.answers:
            if answer.label == label:
                return answer.next
        raise unknown_spelling(label, f"answer to {self.text!r}", [answer.label for answer in self.answers])


Node: TypeAlias = Question | DialogueMove
TreePath: TypeAlias = tuple[tuple[Question, Answer], ...]

DECISION_TREE = Question(
    "What is the span for?",
    (
        Answer("nothing to do with the drive", DialogueMove.IRRELEVANT),
        Answer(
            "it opens something",
            Question(
                "What is opened?",
                (
                    Answer("a command", DialogueMove.INSTRUCT),
                    Answer("a statement", DialogueMove.EXPLAIN),
                    Answer(
                        "a question",
                        Question(
                            "What does the question want to know?",
                            (
                                Answer("whether the other side is following", DialogueMove.ALIGN),
                                Answer("whether something inferred is right", DialogueMove.CHECK),
                                Answer(
                                    "something the speaker cannot infer",
                                    Question(
                                        "Which answers would do?",
                                        (
                                            Answer("yes or no", DialogueMove.QUERY_YN),
                                            Answer("any other", DialogueMove.QUERY_W),
                                        ),
                                        MoveGroup.QUERY,
                                    ),
                                ),
                            ),
                            MoveGroup.ASK,
                        ),
                    ),
                ),
                MoveGroup.INITIATE,
            ),
        ),
        Answer(
            "it reacts to something",
            Question(
                "Does it say something about the drive, or only about the talk?",
                (
                    Answer(
                        "only about the talk",
                        Question(
                            "Did the message arrive?",
                            (
                                Answer("it did", DialogueMove.ACKNOWLEDGE),
                                Answer("it did not", DialogueMove.CONFUSE),
                            ),
                            MoveGroup.COMMUNICATE,
                        ),
                    ),
                    Answer(
                        "about the drive",
                        Question(
                            "What does it do with what was said before?",
                            (
                                Answer("amplifies or repairs it", DialogueMove.CLARIFY),
                                Answer("accepts or verifies it", DialogueMove.CONFIRM),
                                Answer(
                                    "answers it",
                                    Question(
                                        "What is the answer?",
                                        (
                                            Answer("yes", DialogueMove.REPLY_Y),
                                            Answer("no", DialogueMove.REPLY_N),
                                            Answer("unknown or unsure", DialogueMove.REPLY_U),
                                            Answer("anything else", DialogueMove.REPLY_W),
                                        ),
                                        MoveGroup.REPLY,
                                    ),
                                ),
                            ),
                            MoveGroup.INFORM,
                        ),
                    ),
                ),
                MoveGroup.RESPOND,
            ),
        ),
    ),
)
"""The root question."""


def walk(answers: Iterable[str], tree: Question = DECISION_TREE) -> DialogueMove:
    """Returns the move that a sequence of answer labels, starting at the root, leads to.

    Raises:
        OntologyError: if an answer does not belong to its question, or if there are too few or too many answers.
    """
    node: Node = tree
    for label in answers:
        if not isinstance(node, Question):
            raise OntologyError(f"answer {label!r} comes after the move {node.label} has been found")
        node = node.follow(label)
    if isinstance(node, Question):
        raise OntologyError(f"the answers end before the question {node.text!r}")
    return node


def paths(tree: Question = DECISION_TREE) -> Iterator[tuple[TreePath, DialogueMove]]:
    """Yields every path through `tree` as (question, answer) pairs with the move at its end, depth first."""
    for answer in tree.answers:
        step = (tree, answer)
        if isinstance(answer.next, Question):
            for path, move in paths(answer.next):
                yield (step, *path), move
        else:
            yield (step,), answer.next


def path_to(move: DialogueMove) -> TreePath:
    """Returns the (question, answer) pairs that lead from the root to `move`."""
    return _PATHS[move]


def groups_of(move: DialogueMove) -> tuple[MoveGroup, ...]:
    """Returns the classes that contain `move`, the widest first; empty for Irrelevant."""
    return tuple(question.group for question, _ in path_to(move) if question.group is not None)


_PATHS: Mapping[DialogueMove, TreePath] = complete(
    {move: path for path, move in paths()}, DialogueMove, "DECISION_TREE", __name__
)

MOVE_GROUPS: Mapping[MoveGroup, tuple[DialogueMove, ...]] = MappingProxyType(
    {group: tuple(move for move in DialogueMove if group in groups_of(move)) for group in MoveGroup}
)
"""Moves of each class, by id."""
