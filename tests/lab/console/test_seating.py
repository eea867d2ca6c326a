"""Plans of the seats from the command line."""

from __future__ import annotations

import pytest

from dorothie_gym.errors import PolicyLoadError, SettingsError
from dorothie_gym.lab.console.seating import Occupancy, parse_roles
from dorothie_gym.ontology import Role


def test_roles_that_are_not_named_are_open() -> None:
    plans = parse_roles("co-wizard=human, participant=scripted")
    assert {role: plan.label for role, plan in plans.items()} == {
        Role.PARTICIPANT: "scripted",
        Role.CO_WIZARD: "human",
        Role.AD_WIZARD: "open",
    }
    assert {plan.occupancy for plan in parse_roles("").values()} == {Occupancy.OPEN}


def test_traits_of_a_persona_may_contain_commas() -> None:
    plans = parse_roles("participant=scripted:patience=0..0.2,directions=vague,co_wizard=lane-follow")
    assert plans[Role.PARTICIPANT].player.name == "scripted:patience=0..0.2,directions=vague"
    assert plans[Role.CO_WIZARD].player.name == "lane-follow"


@pytest.mark.parametrize("text", ["pilot=human", "participant", "participant=", "co_wizard=human,co_wizard=open"])
def test_mistakes_are_named(text: str) -> None:
    with pytest.raises(SettingsError, match="--roles"):
        parse_roles(text)


def test_unknown_policies_are_named() -> None:
    with pytest.raises(PolicyLoadError, match="there is no policy 'robot'"):
        parse_roles("participant=robot")


def test_language_models_do_not_play_in_real_time() -> None:
    with pytest.raises(PolicyLoadError, match="co_wizard: llm:any cannot play with people in real time"):
        parse_roles("co_wizard=llm:any")
