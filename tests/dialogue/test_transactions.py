from __future__ import annotations

from dorothie_gym.dialogue import Span, Utterance
from dorothie_gym.dialogue.transactions import TransactionTracker
from dorothie_gym.ontology import ActionValue, DialogueAct, DialogueMove, GoalStatus, LandmarkName, Role, SlotValue

M, S = DialogueMove, GoalStatus
KFC, IKEA, SHELL = LandmarkName.KFC, LandmarkName.IKEA, LandmarkName.SHELL


class Drive:
    def __init__(self, *goals: LandmarkName) -> None:
        self.tracker = TransactionTracker(goals)

    def say(self, exchange: int, move: DialogueMove, *values: SlotValue, speaker: Role = Role.PARTICIPANT) -> int:
        utterance = Utterance(speaker, (Span("words", DialogueAct.of(move, *values)),), 0.0, 1.0)
        return self.tracker.update(utterance, (exchange,))


def test_each_goal_is_a_transaction() -> None:
    drive = Drive(KFC, IKEA)
    assert drive.say(0, M.INSTRUCT, KFC) == 0
    assert drive.say(1, M.INSTRUCT, ActionValue.J_TURN) == 0
    drive.tracker.note(KFC, S.COMPLETE)
    assert drive.say(2, M.EXPLAIN, S.COMPLETE) == 0
    assert drive.say(3, M.INSTRUCT, IKEA) == 1
    assert [each.landmark for each in drive.tracker.transactions] == [KFC, IKEA]


def test_interrupted_goal_is_resumed_in_its_transaction() -> None:
    drive = Drive(KFC, IKEA)
    assert [drive.say(k, M.INSTRUCT, goal) for k, goal in enumerate((KFC, IKEA, KFC))] == [0, 1, 0]


def test_pending_goal_keeps_current_transaction_open() -> None:
    drive = Drive(KFC, IKEA)
    drive.say(0, M.INSTRUCT, KFC)
    assert drive.say(1, M.INSTRUCT, IKEA, S.PENDING) == 1
    assert drive.say(2, M.INSTRUCT, ActionValue.LANE_FOLLOW) == 0


def test_answer_belongs_to_transaction_of_question() -> None:
    drive = Drive(KFC, IKEA)
    drive.say(0, M.INSTRUCT, KFC)
    drive.say(1, M.EXPLAIN, IKEA, S.PENDING)
    assert drive.say(1, M.ACKNOWLEDGE, speaker=Role.CO_WIZARD) == 1


def test_question_for_next_goal_starts_transaction_of_answer() -> None:
    drive = Drive(KFC, SHELL)
    drive.say(0, M.INSTRUCT, KFC)
    drive.tracker.note(KFC, S.COMPLETE)
    assert drive.say(1, M.QUERY_W, LandmarkName.QUERIED, speaker=Role.CO_WIZARD) == 1
    assert drive.say(1, M.REPLY_W, SHELL) == 1
    assert drive.tracker.transactions[1].landmark is SHELL


def test_place_that_is_only_passed_is_no_goal() -> None:
    drive = Drive(KFC)
    drive.say(0, M.INSTRUCT, KFC)
    assert drive.say(1, M.INSTRUCT, ActionValue.J_TURN, SHELL) == 0


def test_added_landmark_becomes_goal() -> None:
    drive = Drive(KFC)
    drive.say(0, M.INSTRUCT, KFC)
    drive.tracker.note(SHELL, S.ONGOING)
    assert drive.say(1, M.INSTRUCT, SHELL) == 1


def test_replacement_begins_transaction_of_new_goal() -> None:
    drive = Drive(KFC, IKEA)
    drive.say(0, M.INSTRUCT, KFC)
    assert drive.say(1, M.INSTRUCT, KFC, IKEA, S.ABANDONED, S.ONGOING) == 1
    assert drive.say(2, M.INSTRUCT, ActionValue.J_TURN) == 1


def test_arrival_names_landmark_of_anonymous_transaction() -> None:
    drive = Drive(KFC)
    assert drive.say(0, M.INSTRUCT, ActionValue.LANE_FOLLOW) == 0
    drive.tracker.note(KFC, S.COMPLETE)
    assert drive.say(1, M.EXPLAIN, KFC, S.COMPLETE) == 0


def test_current_goal_precedes_pending_goal_in_one_utterance() -> None:
    tracker = TransactionTracker((KFC, IKEA))
    now, later = DialogueAct.of(M.INSTRUCT, KFC), DialogueAct.of(M.EXPLAIN, IKEA, S.PENDING)
    for k, acts in enumerate(((now, later), (later, now))):
        utterance = Utterance(Role.PARTICIPANT, tuple(Span("words", act) for act in acts), float(k), k + 0.5)
        assert tracker.update(utterance, (k, k)) == 0
    assert [each.landmark for each in tracker.transactions] == [KFC]


def test_two_houses_are_two_transactions() -> None:
    house = LandmarkName.HOUSE
    drive = Drive(house, house, KFC)
    assert drive.say(0, M.INSTRUCT, house) == 0
    assert drive.say(1, M.CHECK, house, speaker=Role.CO_WIZARD) == 0
    drive.tracker.note(house, S.COMPLETE)
    assert drive.say(2, M.EXPLAIN, house, S.COMPLETE) == 0
    assert drive.say(3, M.INSTRUCT, house) == 1
    drive.tracker.note(house, S.COMPLETE)
    assert drive.say(4, M.INSTRUCT, house) == 1  # there is no third one
    assert drive.say(5, M.INSTRUCT, KFC) == 2
