import pytest
from hypothesis import given
from hypothesis import strategies as st

from dorothie_gym.errors import OntologyError
from dorothie_gym.ontology import (
    DECISION_TREE,
    Answer,
    DialogueMove,
    MoveGroup,
    Question,
    groups_of,
    path_to,
    paths,
    walk,
)


@pytest.mark.parametrize("move", DialogueMove, ids=lambda move: move.label)
def test_path_to_move_leads_to_it(move: DialogueMove) -> None:
    assert walk(answer.label for _, answer in path_to(move)) is move


def test_paths_lead_to_distinct_moves_and_reach_all() -> None:
    assert sorted(move for _, move in paths()) == list(DialogueMove)


@given(st.data())
def test_every_choice_of_answers_ends_in_move(data: st.DataObject) -> None:
    node: Question | DialogueMove = DECISION_TREE
    labels: list[str] = []
    while isinstance(node, Question):
        labels.append(data.draw(st.sampled_from([answer.label for answer in node.answers])))
        node = node.follow(labels[-1])
    assert walk(labels) is node


@pytest.mark.parametrize(
    ("group", "names"),
    [
        (MoveGroup.INITIATE, "Instruct Explain Align Check QueryYN QueryW"),
        (MoveGroup.RESPOND, "Acknowledge Confuse Clarify Confirm ReplyY ReplyN ReplyU ReplyW"),
        (MoveGroup.ASK, "Align Check QueryYN QueryW"),
        (MoveGroup.QUERY, "QueryYN QueryW"),
        (MoveGroup.COMMUNICATE, "Acknowledge Confuse"),
        (MoveGroup.INFORM, "Clarify Confirm ReplyY ReplyN ReplyU ReplyW"),
        (MoveGroup.REPLY, "ReplyY ReplyN ReplyU ReplyW"),
    ],
)
def test_groups_contain_moves_of_specification(group: MoveGroup, names: str) -> None:
    assert [move.label for move in group.moves] == names.split()


def test_groups_of_move_are_ordered_from_wide_to_narrow() -> None:
    assert groups_of(DialogueMove.QUERY_W) == (MoveGroup.INITIATE, MoveGroup.ASK, MoveGroup.QUERY)
    assert groups_of(DialogueMove.IRRELEVANT) == ()


def test_error_names_answer_that_is_not_offered() -> None:
    with pytest.raises(OntologyError, match=r"'it opens nothing'.*'it opens something'"):
        walk(["it opens nothing"])


def test_too_few_answers_raise_error_with_open_question() -> None:
    with pytest.raises(OntologyError, match="before the question"):
        walk([DECISION_TREE.answers[1].label])


def test_surplus_answer_raises_error_with_move_found() -> None:
    with pytest.raises(OntologyError, match="after the move Irrelevant"):
        walk([DECISION_TREE.answers[0].label, "yes"])


def test_question_with_one_answer_raises_error() -> None:
    with pytest.raises(OntologyError, match="two or more"):
        Question("Why?", (Answer("so", DialogueMove.EXPLAIN),))
