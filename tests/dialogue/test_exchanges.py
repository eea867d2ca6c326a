import pytest

from dorothie_gym.dialogue import EXPECTATIONS, ExchangeState, ExchangeTracker, Span, Utterance
from dorothie_gym.ontology import (
    ActionValue,
    DialogueAct,
    DialogueMove,
    GoalStatus,
    LandmarkName,
    Role,
    SlotValue,
    StreetName,
)

P, C = Role.PARTICIPANT, Role.CO_WIZARD
M = DialogueMove


def said(speaker: Role, start: float, *moves: DialogueMove, seconds: float = 1.0) -> Utterance:
    return Utterance(speaker, tuple(Span("words", DialogueAct.of(move)) for move in moves), start, start + seconds)


def test_command_and_acknowledgement_are_one_exchange():
    tracker = ExchangeTracker()
    assert tracker.update(said(P, 0.0, M.INSTRUCT)) == (0,)
    assert tracker.exchanges[0].state is ExchangeState.OPEN
    assert tracker.update(said(C, 2.0, M.ACKNOWLEDGE)) == (0,)
    (exchange,) = tracker.exchanges
    assert (exchange.initiator, exchange.start, exchange.end) == (P, 0.0, 3.0)
    assert exchange.state is ExchangeState.FULFILLED
    assert exchange.acts == 2


@pytest.mark.parametrize("question", EXPECTATIONS, ids=lambda move: move.label)
def test_every_expected_answer_fulfils_exchange(question):
    for answer in EXPECTATIONS[question]:
        tracker = ExchangeTracker()
        tracker.update(said(C, 0.0, question))
        assert tracker.update(said(P, 1.5, answer)) == (0,)
        assert tracker.exchanges[0].state is ExchangeState.FULFILLED


def test_answer_and_command_in_one_utterance_close_and_open_exchanges():
    tracker = ExchangeTracker()
    tracker.update(said(C, 0.0, M.QUERY_YN))
    assert tracker.update(said(P, 2.0, M.REPLY_Y, M.INSTRUCT)) == (0, 1)
    assert [exchange.state for exchange in tracker.exchanges] == [ExchangeState.FULFILLED, ExchangeState.OPEN]


def test_reason_and_following_question_share_exchange():
    tracker = ExchangeTracker()
    assert tracker.update(said(C, 0.0, M.EXPLAIN, M.QUERY_YN)) == (0, 0)
    assert tracker.update(said(P, 2.0, M.REPLY_N)) == (0,)


def test_explanation_after_answer_belongs_to_its_exchange():
    tracker = ExchangeTracker()
    tracker.update(said(P, 0.0, M.INSTRUCT))
    assert tracker.update(said(C, 2.0, M.ACKNOWLEDGE, M.EXPLAIN)) == (0, 0)
    assert tracker.exchanges[0].state is ExchangeState.FULFILLED


def test_two_overlapping_exchanges_are_both_closed():
    tracker = ExchangeTracker()
    assert tracker.update(said(P, 0.0, M.INSTRUCT)) == (0,)
    assert tracker.update(said(C, 0.2, M.QUERY_W)) == (1,)
    assert tracker.update(said(P, 2.0, M.REPLY_W)) == (1,)
    assert tracker.update(said(C, 3.5, M.ACKNOWLEDGE)) == (0,)
    assert tracker.open() == []


def test_speaker_cannot_answer_own_question():
    tracker = ExchangeTracker()
    tracker.update(said(C, 0.0, M.QUERY_YN))
    tracker.update(said(C, 2.0, M.REPLY_Y))
    assert tracker.exchanges[0].state is ExchangeState.OPEN


def test_misunderstood_exchange_stays_open_until_repair():
    tracker = ExchangeTracker()
    tracker.update(said(P, 0.0, M.INSTRUCT))
    assert tracker.update(said(C, 2.0, M.CONFUSE)) == (0,)
    assert tracker.update(said(P, 4.0, M.CLARIFY)) == (0,)
    assert tracker.exchanges[0].state is ExchangeState.OPEN
    assert tracker.update(said(C, 6.0, M.CONFIRM)) == (0,)
    assert tracker.exchanges[0].state is ExchangeState.FULFILLED


def test_ten_seconds_of_silence_abandon_a_question():
    tracker = ExchangeTracker()
    tracker.update(said(C, 0.0, M.QUERY_W))  # until 1 s
    tracker.tick(11.0)
    assert tracker.exchanges[0].state is ExchangeState.OPEN
    tracker.tick(11.5)
    assert tracker.exchanges[0].state is ExchangeState.ABANDONED


def test_unanswered_statement_is_fulfilled():
    tracker = ExchangeTracker()
    tracker.update(said(C, 0.0, M.EXPLAIN))
    tracker.tick(20.0)
    assert tracker.exchanges[0].state is ExchangeState.FULFILLED


def test_answer_that_started_in_time_counts():
    tracker = ExchangeTracker()
    tracker.update(said(C, 0.0, M.QUERY_W))
    tracker.tick(12.0)
    assert tracker.update(said(P, 10.5, M.REPLY_W, seconds=3.0)) == (0,)
    assert tracker.exchanges[0].state is ExchangeState.FULFILLED


def test_unprompted_response_joins_last_exchange_or_none():
    tracker = ExchangeTracker()
    assert tracker.update(said(P, 0.0, M.ACKNOWLEDGE)) == (0,)
    assert tracker.exchanges[0].unprompted
    assert tracker.exchanges[0].state is ExchangeState.FULFILLED
    assert tracker.update(said(C, 5.0, M.ACKNOWLEDGE)) == (0,)
    assert tracker.update(said(C, 30.0, M.REPLY_Y)) == (0,)


def test_irrelevant_act_leaves_exchanges_unchanged():
    tracker = ExchangeTracker()
    tracker.update(said(C, 0.0, M.QUERY_W))
    assert tracker.update(said(P, 2.0, M.IRRELEVANT)) == (0,)
    assert tracker.exchanges[0].state is ExchangeState.OPEN


def test_irrelevant_act_after_silence_is_in_no_exchange():
    tracker = ExchangeTracker()
    assert tracker.update(said(P, 0.0, M.IRRELEVANT)) == (None,)
    tracker.update(said(C, 5.0, M.QUERY_W))
    assert tracker.update(said(P, 60.0, M.IRRELEVANT)) == (None,)
    assert tracker.update(said(P, 70.0, M.INSTRUCT)) == (1,)


def test_patience_must_be_positive():
    with pytest.raises(ValueError, match="patience"):
        ExchangeTracker(0.0)


def test_question_about_command_stays_in_its_exchange():
    tracker = ExchangeTracker()
    tracker.update(said(P, 0.0, M.INSTRUCT))
    assert tracker.update(said(C, 2.0, M.CHECK)) == (0,)
    assert tracker.exchanges[0].state is ExchangeState.OPEN
    assert tracker.update(said(P, 4.0, M.CONFIRM)) == (0,)
    assert tracker.exchanges[0].state is ExchangeState.FULFILLED


def test_explanation_of_missing_knowledge_stays_in_exchange():
    tracker = ExchangeTracker()
    tracker.update(said(P, 0.0, M.INSTRUCT))
    assert tracker.update(said(C, 2.0, M.EXPLAIN)) == (0,)
    assert tracker.update(said(P, 4.0, M.EXPLAIN)) == (0,)
    assert tracker.update(said(C, 6.0, M.ACKNOWLEDGE)) == (0,)
    assert tracker.exchanges[0].state is ExchangeState.FULFILLED


def test_question_may_be_answered_by_command():
    tracker = ExchangeTracker()
    tracker.update(said(C, 0.0, M.QUERY_W))
    assert tracker.update(said(P, 2.0, M.INSTRUCT)) == (0,)
    assert tracker.exchanges[0].state is ExchangeState.FULFILLED


def test_command_during_question_begins_new_exchange():
    tracker = ExchangeTracker()
    tracker.update(said(C, 0.0, M.QUERY_W, seconds=2.0))
    assert tracker.update(said(P, 1.0, M.INSTRUCT, seconds=2.0)) == (1,)


def naming(speaker: Role, start: float, move: DialogueMove, *values: SlotValue) -> Utterance:
    return Utterance(speaker, (Span("words", DialogueAct.of(move, *values)),), start, start + 1.0)


def test_grounding_act_with_name_refers_to_exchange_of_that_name():
    tracker = ExchangeTracker()
    tracker.update(naming(C, 0.0, M.EXPLAIN, LandmarkName.PANERA))  # 0: without a response so far
    assert tracker.update(naming(P, 1.5, M.INSTRUCT, LandmarkName.HOUSE)) == (1,)
    assert tracker.update(said(C, 3.0, M.ACKNOWLEDGE)) == (1,)
    assert tracker.update(naming(C, 5.0, M.CONFIRM, LandmarkName.HOUSE)) == (1,)
    assert tracker.update(naming(P, 7.0, M.ACKNOWLEDGE, LandmarkName.PANERA)) == (0,)


@pytest.mark.parametrize("value", [LandmarkName.QUERIED, LandmarkName.UNKNOWN])
def test_queried_and_unknown_values_are_not_names(value):
    tracker = ExchangeTracker()
    tracker.update(naming(P, 0.0, M.QUERY_W, value))
    tracker.update(said(C, 1.5, M.REPLY_W))
    tracker.update(said(P, 3.0, M.INSTRUCT))
    assert tracker.update(naming(C, 4.5, M.ACKNOWLEDGE, value)) == (1,)


def test_repetition_before_answer_continues_exchange():
    tracker = ExchangeTracker()
    tracker.update(naming(P, 0.0, M.INSTRUCT, ActionValue.STOP))
    assert tracker.update(naming(P, 4.0, M.INSTRUCT, ActionValue.STOP)) == (0,)
    assert tracker.update(naming(P, 8.0, M.INSTRUCT, ActionValue.U_TURN)) == (1,)
    tracker.update(said(C, 10.0, M.ACKNOWLEDGE))
    assert tracker.update(naming(P, 12.0, M.INSTRUCT, ActionValue.U_TURN)) == (2,)


@pytest.mark.parametrize("puzzled", [M.CONFUSE, M.CHECK, M.EXPLAIN])
def test_repetition_after_misunderstanding_continues_exchange(puzzled):
    tracker = ExchangeTracker()
    tracker.update(naming(P, 0.0, M.INSTRUCT, LandmarkName.COCO, ActionValue.U_TURN))
    tracker.update(said(C, 2.0, puzzled))
    assert tracker.update(naming(P, 4.0, M.INSTRUCT, LandmarkName.COCO)) == (0,)
    assert tracker.exchanges[0].state is ExchangeState.OPEN
    assert tracker.update(said(C, 6.0, M.CONFIRM)) == (0,)
    assert tracker.exchanges[0].state is ExchangeState.FULFILLED


def test_unrelated_act_does_not_answer_check():
    tracker = ExchangeTracker()
    tracker.update(naming(P, 0.0, M.INSTRUCT, LandmarkName.COCO))
    tracker.update(said(C, 2.0, M.CHECK))
    assert tracker.update(naming(P, 4.0, M.INSTRUCT, ActionValue.STOP)) == (1,)


def test_repetition_after_ten_seconds_starts_new_exchange():
    tracker = ExchangeTracker()
    tracker.update(naming(P, 0.0, M.INSTRUCT, ActionValue.STOP))
    tracker.tick(12.0)
    assert tracker.update(naming(P, 12.0, M.INSTRUCT, ActionValue.STOP)) == (1,)


def test_explanation_answers_statement_of_missing_knowledge():
    tracker = ExchangeTracker()
    tracker.update(naming(C, 0.0, M.EXPLAIN, LandmarkName.HOUSE, GoalStatus.UNKNOWN))
    assert tracker.update(naming(P, 2.0, M.EXPLAIN, StreetName.FULLER)) == (0,)
    assert tracker.exchanges[0].state is ExchangeState.FULFILLED
    assert tracker.update(said(C, 4.0, M.ACKNOWLEDGE)) == (0,)
    tracker.update(naming(C, 20.0, M.EXPLAIN, LandmarkName.HOUSE))
    assert tracker.update(naming(P, 22.0, M.EXPLAIN, StreetName.FULLER)) == (2,), "nothing was unknown"
