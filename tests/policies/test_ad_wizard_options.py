from __future__ import annotations

import pytest

from dorothie_gym.errors import PolicyLoadError
from dorothie_gym.maps import load_town
from dorothie_gym.ontology import Role
from dorothie_gym.policies import ScriptedAdWizard, find_player, make_policy
from dorothie_gym.policies.ad_wizard import AdWizardConfig, Trick
from dorothie_gym.policies.ad_wizard_options import AdWizardOptions, parse_ad_wizard


def test_options_are_those_of_the_policy() -> None:
    found = parse_ad_wizard("rate=4, spacing=12,bad_weather_time=140..240,crowd_sizes=2..3,kinds=roadblock+weather")
    assert found == AdWizardOptions(
        rate=4.0,
        kinds=(Trick.ROADBLOCK, Trick.WEATHER),
        config=AdWizardConfig(spacing=12.0, bad_weather_time=(140.0, 240.0), crowd_sizes=(2, 3)),
    )


def test_a_single_number_is_a_range_of_one_value() -> None:
    assert parse_ad_wizard("roadblock_ahead=80").config.roadblock_ahead == (80.0, 80.0)


@pytest.mark.parametrize(
    "text",
    [
        "rate=5",
        "spacing=-1",
        "spacing=1..2",
        "speed=3",
        "kinds=flood",
        "most_roadblocks=1.5",
        "rate=",
        "crowd_sizes=4..2",
    ],
)
def test_wrong_options_are_refused_by_name(text: str) -> None:
    name = text.partition("=")[0]
    with pytest.raises(ValueError, match=name):
        parse_ad_wizard(text)
    with pytest.raises(PolicyLoadError, match=f"ad_wizard: .*{name}"):
        find_player(f"scripted:{text}", Role.AD_WIZARD)


def test_a_higher_rate_plans_more_tricks() -> None:
    town = load_town("brookside")

    def tricks(name: str) -> int:
        policy = make_policy(name, Role.AD_WIZARD)
        assert isinstance(policy, ScriptedAdWizard)
        return sum(len(policy.initial_state(seed, town).planned) for seed in range(40))

    assert tricks("scripted:rate=4") == 160 > tricks("scripted") > tricks("scripted:rate=1") == 40
    assert tricks("scripted:rate=2.5") == tricks("scripted")
