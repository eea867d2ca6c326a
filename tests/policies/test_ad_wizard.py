import numpy as np
import pytest

from dorothie_gym.maps import load_town
from dorothie_gym.ontology import ExceptionKind, LandmarkName
from dorothie_gym.policies import ScriptedAdWizard, Trick
from dorothie_gym.policies.ad_wizard import task_message
from dorothie_gym.spaces import AdWizardAction, SpaceLimits
from tests.policies.walk import play

TOWN = load_town("brookside")


def test_one_to_four_tricks_are_planned_and_none_at_rate_zero():
    counts = {len(ScriptedAdWizard().initial_state(seed, TOWN).planned) for seed in range(40)}
    assert counts <= {1, 2, 3, 4} and len(counts) > 2
    assert not ScriptedAdWizard(rate=0.0).initial_state(1, TOWN).planned


def test_only_permitted_kinds_are_planned():
    wizard = ScriptedAdWizard(rate=4.0, kinds=["weather"])
    tricks = {item.trick for seed in range(10) for item in wizard.initial_state(seed, TOWN).planned}
    assert tricks == {Trick.WEATHER}


def test_invalid_arguments_raise_value_error():
    with pytest.raises(ValueError, match="rate is 9"):
        ScriptedAdWizard(rate=9.0)
    with pytest.raises(ValueError, match="earthquake"):
        ScriptedAdWizard(kinds=["earthquake"])


@pytest.mark.parametrize("kind", [ExceptionKind.TASK_TRIGGER, ExceptionKind.TASK_DELETE, ExceptionKind.TASK_CHANGE])
def test_messages_name_the_place_and_fit_their_field(kind):
    for seed in range(20):
        text = task_message(kind, LandmarkName.SEVEN_ELEVEN, np.random.default_rng(seed))
        assert "SevenEleven" in text
        AdWizardAction.decode(AdWizardAction(exception=kind, message=text).encode(SpaceLimits()), SpaceLimits())


def test_bad_weather_comes_and_clears_up():
    wizard = ScriptedAdWizard(rate=1.0, kinds=["weather"])
    played = play(
        1, decisions=860, names={"participant": "silent", "co_wizard": "silent"}, policies={"ad_wizard": wizard}
    )
    values = [e.data["value"] for e in played.events if e.type == "Exception" and e.data["kind"] == "weather"]
    assert len(values) == 2 and values[0] != values[1]
