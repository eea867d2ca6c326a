"""What the scripted Co-Wizard does when nobody answers."""

from __future__ import annotations

import itertools

from dorothie_gym.ontology import ActionValue, DialogueMove
from dorothie_gym.policies.co_wizard.unprompted_remarks import UNANSWERED
from tests.policies.co_wizard.rides import Ride


def test_unanswered_questions_about_the_way_end_in_a_way_that_is_announced() -> None:
    ride = Ride(3)
    for _ in range(260):
        ride.step()
    asked = [ActionValue.QUERIED in speech.act.slots or speech.act.move is DialogueMove.CHECK for speech in ride.said]
    announced = [
        number
        for number, speech in enumerate(ride.said)
        if speech.act.move is DialogueMove.EXPLAIN and {ActionValue.LANE_FOLLOW, ActionValue.J_TURN} & speech.act.slots
    ]
    assert sum(asked[: announced[0]]) == UNANSWERED
    assert len(announced) >= 2 and max(sum(asked[a:b]) for a, b in itertools.pairwise(announced)) <= 1
    assert len({lane for lane, _ in ride.lanes}) > 5  # it does not wait for ever
