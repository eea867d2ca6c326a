from __future__ import annotations

from dataclasses import replace

import gymnasium as gym
import pytest

import dorothie_gym  # registers the environments
from dorothie_gym.baselines.roles.learned_role.dagger_sessions import TRAINED
from dorothie_gym.evaluation.tiers import HELD_OUT_PERSONAS, ROUGH, STANDARD, STRANGERS, TIERS, Tier, find_tier
from dorothie_gym.maps.folds import SEEN_TOWNS, UNSEEN_TOWNS, TownFold, fold_of
from dorothie_gym.ontology import Role
from dorothie_gym.policies import find_player
from dorothie_gym.policies.persona import parse_traits
from dorothie_gym.session.config import ChannelKind, EnvConfig
from dorothie_gym.session.scenario import ReferenceDrive, draw_scenario
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.time_allowed import reference_seconds, time_allowed, time_extended
from dorothie_gym.sim.config import AutomaticBraking
from dorothie_gym.tasks import StoryboardSource


@pytest.mark.parametrize("tier", TIERS.values(), ids=list(TIERS))
def test_players_and_towns_of_a_tier_exist(tier: Tier) -> None:
    assert find_tier(tier.name) is tier
    assert not tier.config.observe_acts
    assert find_player(tier.ad_wizard, Role.AD_WIZARD)
    for name in tier.participants:
        assert find_player(name, Role.PARTICIPANT).name == name
    assert all(fold_of(town) is not None for town in tier.towns)
    assert EnvConfig(**{**vars(tier.config)}) == tier.config


@pytest.mark.parametrize("tier", TIERS.values(), ids=list(TIERS))
def test_the_oracle_differs_in_what_it_knows_only(tier: Tier) -> None:
    config = tier.oracle
    assert config.observe_acts and config.word_error_rate == 0.0 and config.channel is ChannelKind.TEXT
    assert config.world.braking is AutomaticBraking.COMPLETE
    words = replace(
        config, observe_acts=False, word_error_rate=tier.config.word_error_rate, channel=tier.config.channel
    )
    assert replace(words, world=replace(words.world, braking=tier.config.world.braking)) == tier.config


def test_tiers_are_harder_one_after_the_other() -> None:
    driven = [tier.config for tier in TIERS.values() if tier.config.talk is None]
    errors = [config.word_error_rate for config in driven if config.channel is ChannelKind.TEXT]
    assert errors == sorted(errors)
    assert STRANGERS.config.channel is ChannelKind.SPEECH and STRANGERS.towns == UNSEEN_TOWNS
    assert set(SEEN_TOWNS) < set(STANDARD.towns)


def test_strangers_have_storyboards_of_their_own_and_other_tiers_keep_the_shipped_ones() -> None:
    for tier in TIERS.values():
        generated = tier.config.storyboards is StoryboardSource.GENERATED
        assert generated is (tier is STRANGERS)
        assert ("storyboards" in tier.config.record()) is generated
    with pytest.raises(ValueError, match=r"EnvConfig\.storyboards is 'mine'; it must be shipped or generated"):
        EnvConfig(storyboards="mine")


def test_held_out_personas_are_outside_of_those_of_training() -> None:
    for name in HELD_OUT_PERSONAS:
        ((trait, (low, high)),) = parse_traits(name.removeprefix("scripted:")).items()
        first, last = TRAINED[trait]
        assert high <= float(first) or low >= float(last)


def test_an_unknown_tier_is_refused_with_the_names() -> None:
    with pytest.raises(ValueError, match="standard, ears, rough, strangers, ask-first, admit-it"):
        find_tier("tough")


def test_drawn_storyboards_have_a_number_of_stops() -> None:
    engine = SessionEngine("midtown")
    for seed in range(30):
        board = draw_scenario(engine.town, None, seed, (4, 6)).storyboard
        assert 4 <= sum(not goal.trigger for goal in board.subgoals) <= 6


def test_time_is_a_multiple_of_the_reference_of_the_scenario() -> None:
    town = SessionEngine("brookside").town
    scenario, config = draw_scenario(town, None, 3), EnvConfig(time_factor=2.0, max_seconds=1000.0)
    measured = replace(scenario, reference=ReferenceDrive(seconds=200.0, exchanges=9, subgoals=3))
    assert time_allowed(town, measured, config) == 400.0
    assert time_allowed(town, scenario, config) == min(1000.0, round(2.0 * reference_seconds(town, scenario)))
    assert time_allowed(town, measured, replace(config, max_seconds=300.0)) == 300.0
    assert time_allowed(town, measured, EnvConfig()) == 900.0


def test_an_added_task_lengthens_the_time_in_proportion() -> None:
    config = EnvConfig(time_factor=2.0, max_seconds=1000.0)
    assert time_extended(400.0, 4, 5, config) == 500.0
    assert time_extended(400.0, 4, 3, config) == 400.0
    assert time_extended(900.0, 2, 3, config) == 1000.0
    assert time_extended(900.0, 2, 3, EnvConfig()) == 900.0
    assert ReferenceDrive(seconds=100.0, exchanges=1, subgoals=4).seconds_for(5) == 125.0


def test_records_without_tiers_are_those_of_before() -> None:
    usual, hard = EnvConfig().record(), ROUGH.config.record()
    assert not {"time_factor", "stops"} & usual.keys()
    assert hard["time_factor"] == 2.0 and hard["stops"] == [4, 6] and usual.keys() < hard.keys()


def test_environments_take_settings_and_partners_of_a_tier() -> None:
    env = gym.make("dorothie_gym/CoWizard-v0", tier="rough", town="brookside")
    inner = env.unwrapped
    assert inner.engine.config == ROUGH.config and inner.engine.town.name == "brookside"  # type: ignore[attr-defined]
    observation, _ = env.reset(seed=4)
    assert "participant_act" not in observation and observation["participant_text"] == ""
    limit = inner.engine.session.seconds_allowed  # type: ignore[attr-defined]
    assert limit == round(2.0 * reference_seconds(inner.engine.town, inner.engine.scenario))  # type: ignore[attr-defined]
    env.close()


def test_given_arguments_replace_those_of_the_tier() -> None:
    mild = replace(ROUGH.config, word_error_rate=0.0)
    env = gym.make("dorothie_gym/AdWizard-v0", tier="rough", config=mild, partners={"participant": "silent"})
    inner = env.unwrapped
    assert inner.engine.config == mild  # type: ignore[attr-defined]
    assert type(inner.partners[Role.PARTICIPANT]).__name__ == "SilentPolicy"  # type: ignore[attr-defined]
    env.close()


def test_batches_and_all_roles_take_a_tier() -> None:
    envs = gym.make_vec("dorothie_gym/CoWizard-v0", num_envs=2, vectorization_mode="sync", tier="ears")
    assert all(env.unwrapped.engine.config == TIERS["ears"].config for env in envs.envs)  # type: ignore[attr-defined]
    envs.close()
    duo = dorothie_gym.DuoWizardEnv(tier="standard")
    assert duo.config == STANDARD.config
    duo.close()
    assert fold_of(STRANGERS.town) is TownFold.UNSEEN
