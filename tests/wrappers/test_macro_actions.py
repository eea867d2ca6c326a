from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env

import dorothie_gym
from dorothie_gym import EnvConfig, MacroActions
from dorothie_gym.ontology.dialogue_acts import LABELS
from dorothie_gym.ontology.slots import LandmarkName
from dorothie_gym.session.recording.events import EventType
from dorothie_gym.wrappers.macro_actions import MACRO_ACTIONS

NUMBERS = {one.name: number for number, one in enumerate(MACRO_ACTIONS)}
PARTNERS = {"participant": "silent", "ad_wizard": "silent"}


def made(**settings: Any) -> MacroActions:
    arguments = {"town": "brookside", "config": EnvConfig(max_seconds=90.0), "partners": PARTNERS, **settings}
    return MacroActions(gym.make("dorothie_gym/CoWizard-v0", **arguments))


def places(env: MacroActions) -> list[int]:
    mask = env.action_masks()
    return [number for number, one in enumerate(MACRO_ACTIONS) if one.place is not None and mask[number]]


def goal_id(number: int) -> int:
    place = MACRO_ACTIONS[number].place
    assert place is not None
    return place.value


@pytest.mark.filterwarnings("ignore:.*different from the unwrapped version")
def test_there_are_tens_of_actions_and_the_environment_is_valid() -> None:
    env = made()
    assert env.action_space == spaces.Discrete(31) and len(NUMBERS) == 31
    check_env(env, skip_render_check=True, skip_close_check=True)


def test_a_goal_is_driven_to_and_reported_as_belief() -> None:
    env = made(config=EnvConfig(max_seconds=240.0))
    env.reset(seed=7)
    goal = places(env)[0]
    observation, _, _, _, _ = env.step(goal)
    assert observation["goal"] == goal_id(goal)
    for _ in range(60):
        observation, _, _, truncated, info = env.step(NUMBERS["continue"])
        assert not any(info["refused"].values())
        if observation["arrived"] or truncated:
            break
    assert observation["arrived"] == 1 and observation["speed"][0] < 1.0
    assert observation["goal"] == goal_id(goal)


def test_the_grammar_words_what_is_said() -> None:
    env = MacroActions(made().env, seconds=0.5)
    env.reset(seed=7)
    env.step(places(env)[0])
    said: list[str] = []
    wanted = ["ask_where_to", "ask_which_way", "say_okay", "say_goal", "ask_goal", "say_not_understood"]
    while wanted:
        name = wanted[0] if env.action_masks()[NUMBERS[wanted[0]]] else "continue"
        env.step(NUMBERS[name])
        wanted = wanted[name != "continue" :]
        said += spoken(env)
    for _ in range(10):
        env.step(NUMBERS["continue"])
        said += spoken(env)
    assert all(said) and len(said) == len(set(said)) == 6, said


def spoken(env: MacroActions) -> list[str]:
    events = env.unwrapped.engine.last_events  # type: ignore[attr-defined]  # `unwrapped` is declared as `Env`
    return [str(one.data["text"]) for one in events if one.type is EventType.DIALOGUE_MOVE]


def test_words_that_were_heard_stay_in_the_observation_and_fade() -> None:
    env = made(partners={"ad_wizard": "silent"})
    observation, _ = env.reset(seed=1)
    for _ in range(8):
        observation, _, _, _, _ = env.step(NUMBERS["continue"])
        if observation["heard"].any():
            break
    named = int(observation["heard"].argmax())
    before = float(observation["heard"][named])
    assert 0.0 < before <= 1.0 and observation["heard_moves"].any()
    assert named < len(LABELS)
    assert observation in env.observation_space


def test_driving_commands_drop_the_goal_and_speed_keeps_it() -> None:
    env = made()
    env.reset(seed=7)
    goal = places(env)[0]
    env.step(goal)
    observation, *_ = env.step(NUMBERS["slower"])
    assert observation["goal"] == goal_id(goal)
    observation, *_ = env.step(NUMBERS["stop"])
    assert observation["goal"] == LandmarkName.UNKNOWN.value
    for _ in range(4):
        observation, *_ = env.step(NUMBERS["continue"])
    assert observation["speed"][0] < 0.5


def test_masks_exclude_unknown_places_and_exits_that_do_not_exist() -> None:
    env = made()
    observation, info = env.reset(seed=7)
    on_map = {LandmarkName(int(row[0])) for row in observation["landmarks"] if row[0] > 0}
    assert {MACRO_ACTIONS[number].place for number in places(env)} == on_map
    assert (info["action_mask"] == env.action_masks()).all()
    assert not env.action_masks()[NUMBERS["say_goal"]]


def test_excluded_actions_continue_and_wrong_ones_raise() -> None:
    env = made()
    env.reset(seed=7)
    excluded = int(np.flatnonzero(~env.action_masks())[0])
    assert not any(env.step(excluded)[4]["refused"].values())
    with pytest.raises(ValueError, match=r"action is 31; it must be a whole number in 0..30"):
        env.step(31)


def test_only_a_co_wizard_that_observes_acts_is_wrapped() -> None:
    with pytest.raises(ValueError, match="MacroActions wraps dorothie_gym/CoWizard-v0"):
        MacroActions(gym.make("dorothie_gym/Participant-v0", town="brookside"))
    with pytest.raises(ValueError, match="leave EnvConfig.observe_acts at True"):
        made(config=EnvConfig(observe_acts=False))


def test_flat_box_holds_the_observation_normalised_and_equal_seeds_give_equal_episodes() -> None:
    runs = []
    for _ in range(2):
        env = dorothie_gym.flatten(made(partners={"ad_wizard": "silent"}), box=True)
        assert isinstance(env.observation_space, spaces.Box) and env.action_space == spaces.Discrete(31)
        rng = np.random.default_rng(0)
        observation, _ = env.reset(seed=3)
        rows = [observation]
        for _ in range(10):
            observation, *_ = env.step(int(rng.choice(np.flatnonzero(env.action_masks()))))
            assert observation in env.observation_space
            rows.append(observation)
        runs.append(np.array(rows))
    assert (runs[0] == runs[1]).all() and np.abs(runs[0]).max() <= 1.0


def test_kinds_keep_their_actions_and_masks() -> None:
    env = MacroActions(made().env, seconds=5.0, kinds={"goal", "ask"})
    names = [one.name for one in env.actions]
    assert names[0] == "continue" and {name.split("_")[0] for name in names} == {"continue", "goal", "ask"}
    assert env.action_space == spaces.Discrete(len(names))
    _, info = env.reset(seed=7)
    assert info["action_mask"].shape == (len(names),) and info["action_mask"][0]
    with pytest.raises(ValueError, match=f"must be a whole number in 0..{len(names) - 1}"):
        env.step(len(names))


@pytest.mark.parametrize("kinds", [{"goals"}, "goal"])
def test_unknown_kinds_are_named(kinds: Any) -> None:
    with pytest.raises(ValueError, match="kinds has 'goals?'; give a set of continue, drive, goal, say, ask"):
        MacroActions(made().env, kinds=kinds)


def test_the_place_that_was_mentioned_becomes_the_goal() -> None:
    partners = {"participant": "scripted:talkativeness=0..0.2", "ad_wizard": "silent"}
    env = made(partners=partners, config=EnvConfig(max_seconds=120.0, word_error_rate=0.0))
    followed = 0
    for seed in range(6):
        observation, info = env.reset(seed=seed)
        assert not info["action_mask"][NUMBERS["goal_heard"]], "nothing was said"
        while not info["action_mask"][NUMBERS["goal_heard"]]:
            observation, _, _, over, info = env.step(NUMBERS["continue"])
            if over:
                break
        else:
            places_heard = {one.value for one in LandmarkName if observation["heard"][LABELS.index(one)] > 0.0}
            observation, _, _, _, info = env.step(NUMBERS["goal_heard"])
            assert int(observation["goal"]) in places_heard - {0}
            assert not info["action_mask"][NUMBERS["goal_heard"]] or observation["heard_moves"].any()
            followed += 1
    assert followed >= 2


def test_specification_with_kinds_is_json_and_makes_the_same_actions() -> None:
    env = MacroActions(gym.make("dorothie_gym/CoWizard-v0", town="brookside"), kinds={"goal", "ask"})
    assert env.spec is not None
    again = gym.make(EnvSpec.from_json(env.spec.to_json()))
    assert again.get_wrapper_attr("actions") == env.actions
