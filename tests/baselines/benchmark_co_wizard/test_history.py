"""What became of the own words and actions follows from observations."""

from __future__ import annotations

import pytest

from dorothie_gym.baselines.benchmark_co_wizard.history import History, HistoryTracker, carried_out
from dorothie_gym.dialogue import Span
from dorothie_gym.evaluation.teacher_forced.features import HistorySizes
from dorothie_gym.ontology import DialogueAct, DialogueMove, PhysicalAction, Role
from dorothie_gym.session.spaces import Physical, Speech
from dorothie_gym.sim.state.codes import Motion
from tests.baselines.benchmark_co_wizard.observed import town, view

OKAY = DialogueAct.of(DialogueMove.ACKNOWLEDGE)
TURN = PhysicalAction.J_TURN
STOPPED, DRIVING = {"motion": Motion.STOPPED}, {"motion": Motion.DRIVING}
TURNING_LEFT = {"manoeuvre": TURN, "angle": 90.0}


@pytest.mark.parametrize(
    ("tried", "before", "after", "done"),
    [
        (Physical(action=PhysicalAction.STOP), DRIVING, STOPPED, True),
        (Physical(action=PhysicalAction.STOP), STOPPED, STOPPED, False),
        (Physical(action=PhysicalAction.START), STOPPED, DRIVING, True),
        (Physical(action=PhysicalAction.START), DRIVING, DRIVING, False),
        (Physical(action=PhysicalAction.SPEED_CHANGE, up=True), {"cruise": 40.0}, {"cruise": 45.0}, True),
        (Physical(action=PhysicalAction.SPEED_CHANGE, up=True), {"cruise": 60.0}, {"cruise": 60.0}, False),
        (Physical(action=PhysicalAction.LIGHT_CHANGE, up=True), {"lights": False}, {"lights": True}, True),
        (Physical(action=PhysicalAction.LIGHT_CHANGE, up=True), {"lights": True}, {"lights": True}, False),
        (Physical(action=TURN, angle=88), DRIVING, TURNING_LEFT, True),
        (Physical(action=TURN, angle=88), TURNING_LEFT, TURNING_LEFT, False),
        (Physical(action=TURN, angle=88), {**STOPPED, **TURNING_LEFT}, {**DRIVING, **TURNING_LEFT}, True),
        (Physical(action=TURN, angle=88), STOPPED, STOPPED, False),
        (Physical(action=PhysicalAction.LANE_FOLLOW), TURNING_LEFT, DRIVING, True),
        (Physical(action=PhysicalAction.LANE_FOLLOW), DRIVING, DRIVING, False),
        (Physical(action=PhysicalAction.U_TURN), DRIVING, {"manoeuvre": PhysicalAction.U_TURN}, True),
        (Physical(action=PhysicalAction.U_TURN), DRIVING, DRIVING, False),
    ],
)
def test_an_action_was_carried_out_if_the_car_does_it_now(tried, before, after, done):
    assert carried_out(tried, view(**before), view(**after)) is done


def begin() -> HistoryTracker:
    return HistoryTracker(history=History.begin(view().raw, town(), HistorySizes())).observed(
        view(time=0.0), town(), ()
    )


def said(following: HistoryTracker) -> list[tuple[str, str, int]]:
    moves = [move for utterance in following.history.encoded.utterances for move in utterance.moves]
    return [(str(move.speaker), move.span, move.frame) for move in moves]


def test_the_own_words_are_known_when_they_are_over():
    speaks = begin().acted(Speech(act=OKAY, text="Okay, going there."), None, view(time=0.0), 4)
    meanwhile = speaks.observed(view(time=0.5, speaking=0.6), town(), ())
    assert said(meanwhile) == []
    assert said(meanwhile.observed(view(time=1.5, speaking=0.0), town(), ())) == [
        ("co_wizard", "Okay, going there.", 45)
    ]


def test_utterances_that_end_together_are_ordered_by_their_start():
    heard = (Span("Go to the shop on Fuller Street and then stop please.", OKAY),)
    late = begin().acted(None, None, view(time=0.0), 4).observed(view(time=3.0), town(), ())
    late = late.acted(Speech(act=OKAY, text="Okay."), None, view(time=3.0), 4)
    both = late.observed(view(time=4.0, speaking=0.0), town(), heard)
    assert [speaker for speaker, _, _ in said(both)] == ["participant", "co_wizard"]


def test_acts_beyond_the_size_of_an_utterance_are_dropped():
    following = begin()
    for k in range(3):
        following = following.acted(Speech(act=OKAY, text=f"Okay {k}."), None, view(time=0.0), 2)
    assert [span for _, span, _ in said(following.observed(view(time=9.0), town(), ()))] == ["Okay 0.", "Okay 1."]


def test_a_history_is_left_as_it_is():
    first = begin().history
    first.said(Role.PARTICIPANT, (Span("Hello.", OKAY),), 0)
    first.done(Physical(action=PhysicalAction.STOP), 0)
    assert first.events == 0 and first.encoded.utterances == first.encoded.actions == ()
