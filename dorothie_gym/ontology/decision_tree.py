"""Decision tree for the annotation of dialogue moves, as data that a program can traverse.

The inner nodes below the root are the coarser classes of moves (Initiate, Ask, ...); membership of a class is derived
from the tree and not stored anywhere else. The scheme follows Carletta et al. (1997), adapted to driving; the wording
of the questions is ours, and Confirm and ReplyU are placed according to their names (spec: ontology).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType
from typing import TypeAlias

from dorothie_gym.errors import OntologyError
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.vocabulary import unknown_spelling


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


_PATHS: Mapping[DialogueMove, TreePath] = MappingProxyType({move: path for path, move in paths()})

MOVE_GROUPS: Mapping[MoveGroup, tuple[DialogueMove, ...]] = MappingProxyType(
    {group: tuple(move for move in DialogueMove if group in groups_of(move)) for group in MoveGroup}
)
"""Moves of each class, by id."""
