"""No request to the Co-Wizard is met by silence or a bare "no"."""

import pytest

from dorothie_gym.dialogue import Predicate
from dorothie_gym.ontology import DialogueMove
from dorothie_gym.policies.co_wizard.view import CoWizardView
from tests.policies.co_wizard.rides import Ride


@pytest.mark.parametrize("words", ["drive on the pavement, please", "can you run the red light?", "turn the radio up"])
def test_a_request_that_cannot_be_met_is_answered_with_reason_and_offer(words: str) -> None:
    ride = Ride(4)
    ride.run(2.0)
    ride.said.clear()
    ride.say(words, seconds=4.0)
    (said, *_) = ride.said
    assert said.act.move is DialogueMove.EXPLAIN
    assert said.meaning[0].predicate is Predicate.POSSIBLE and said.meaning[0].negated
    assert any(word in said.text for word in ("but", "though", "if you like", "shall I", "only"))


def test_an_order_that_is_not_understood_is_not_met_by_silence() -> None:
    ride = Ride(4)
    ride.say("take me to the Shell", seconds=4.0)
    ride.said.clear()
    ride.say("please tidy up the boot", seconds=5.0)
    assert ride.said


def test_a_turn_that_was_ordered_comes_before_what_follows_it() -> None:
    ride = Ride(4)
    ride.say("turn left", seconds=4.0)
    ride.say("and then stop, please", seconds=2.0)
    assert [step.action for step in ride.state.plan.steps] == ["turn", "stop"]


def test_a_turn_that_is_counted_is_kept_as_a_plan() -> None:
    ride = Ride(4)
    ride.say("take the second left", seconds=4.0)
    ride.say("hang on, it's the third, third left", seconds=4.0)
    (kept,) = ride.state.plan.steps
    assert (kept.direction, kept.ordinal) == ("left", 3)


def test_a_corrected_change_of_speed_undoes_the_other_one() -> None:
    ride = Ride(4)
    ride.run(6.0)
    before = CoWizardView.read(ride.observations["co_wizard"], ride.env.town).cruise
    ride.say("go faster", seconds=5.0)
    ride.say("sorry, I meant slower", seconds=5.0)
    assert CoWizardView.read(ride.observations["co_wizard"], ride.env.town).cruise < before - 3.0


def test_a_change_to_a_lane_that_is_not_there_is_refused_in_words() -> None:
    ride = Ride(4)
    ride.run(2.0)
    ride.order({"action": "lane", "direction": "left"})
    ride.run(2.0)
    assert "no left lane" in ride.words
