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


def test_each_goal_that_is_driven_to_is_a_transaction() -> None:
    drive = Drive(KFC, IKEA)
    assert drive.say(0, M.INSTRUCT, KFC) == 0
    assert drive.say(1, M.INSTRUCT, ActionValue.J_TURN) == 0
    drive.tracker.note(KFC, S.COMPLETE)
    assert drive.say(2, M.EXPLAIN, S.COMPLETE) == 0
    assert drive.say(3, M.INSTRUCT, IKEA) == 1
    assert [each.landmark for each in drive.tracker.transactions] == [KFC, IKEA]


def test_an_interrupted_goal_is_resumed_in_its_own_transaction() -> None:
    drive = Drive(KFC, IKEA)
    assert [drive.say(k, M.INSTRUCT, goal) for k, goal in enumerate((KFC, IKEA, KFC))] == [0, 1, 0]


def test_a_pending_goal_keeps_the_current_transaction_open() -> None:
    drive = Drive(KFC, IKEA)
    drive.say(0, M.INSTRUCT, KFC)
    assert drive.say(1, M.INSTRUCT, IKEA, S.PENDING) == 1
    assert drive.say(2, M.INSTRUCT, ActionValue.LANE_FOLLOW) == 0


def test_an_answer_belongs_to_the_transaction_of_its_question() -> None:
    drive = Drive(KFC, IKEA)
    drive.say(0, M.INSTRUCT, KFC)
    drive.say(1, M.EXPLAIN, IKEA, S.PENDING)
    assert drive.say(1, M.ACKNOWLEDGE, speaker=Role.CO_WIZARD) == 1


def test_a_question_for_the_next_goal_starts_the_transaction_of_the_answer() -> None:
    drive = Drive(KFC, SHELL)
    drive.say(0, M.INSTRUCT, KFC)
    drive.tracker.note(KFC, S.COMPLETE)
    assert drive.say(1, M.QUERY_W, LandmarkName.QUERIED, speaker=Role.CO_WIZARD) == 1
    assert drive.say(1, M.REPLY_W, SHELL) == 1
    assert drive.tracker.transactions[1].landmark is SHELL


def test_a_place_that_one_only_passes_is_no_goal() -> None:
    drive = Drive(KFC)
    drive.say(0, M.INSTRUCT, KFC)
    assert drive.say(1, M.INSTRUCT, ActionValue.J_TURN, SHELL) == 0


def test_a_landmark_becomes_a_goal_when_it_is_added() -> None:
    drive = Drive(KFC)
    drive.say(0, M.INSTRUCT, KFC)
    drive.tracker.note(SHELL, S.ONGOING)
    assert drive.say(1, M.INSTRUCT, SHELL) == 1


def test_not_this_but_that_begins_the_transaction_of_that() -> None:
    drive = Drive(KFC, IKEA)
    drive.say(0, M.INSTRUCT, KFC)
    assert drive.say(1, M.INSTRUCT, KFC, IKEA, S.ABANDONED, S.ONGOING) == 1
    assert drive.say(2, M.INSTRUCT, ActionValue.J_TURN) == 1


def test_an_arrival_names_the_landmark_of_an_anonymous_transaction() -> None:
    drive = Drive(KFC)
    assert drive.say(0, M.INSTRUCT, ActionValue.LANE_FOLLOW) == 0
    drive.tracker.note(KFC, S.COMPLETE)
    assert drive.say(1, M.EXPLAIN, KFC, S.COMPLETE) == 0


def test_a_current_goal_takes_precedence_over_a_pending_goal_in_one_utterance() -> None:
    tracker = TransactionTracker((KFC, IKEA))
    now, later = DialogueAct.of(M.INSTRUCT, KFC), DialogueAct.of(M.EXPLAIN, IKEA, S.PENDING)
    for k, acts in enumerate(((now, later), (later, now))):
        utterance = Utterance(Role.PARTICIPANT, tuple(Span("words", act) for act in acts), float(k), k + 0.5)
        assert tracker.update(utterance, (k, k)) == 0
    assert [each.landmark for each in tracker.transactions] == [KFC]
