from __future__ import annotations

from dataclasses import asdict
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from dorothie_gym.envs.navigation_continuous_v0 import NavigationContinuousEnv
from dorothie_gym.envs.navigation_v0 import NavigationEnv
from dorothie_gym.ontology import DialogueMove
from dorothie_gym.policies.navigation import FIELD_SPECS, FIELDS, NavigationAction, layout
from dorothie_gym.policies.navigation.cost_to_go import CostToGo
from dorothie_gym.session.rewards import NavigationWeights, RewardWeights
from dorothie_gym.session.scenario import draw_scenario
from tests.envs.navigation_drivers import drive, follow_lane, obey

FIELD = layout()


@pytest.fixture(scope="module")
def env() -> NavigationEnv:
    return NavigationEnv("brookside")


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_obedient_driver_succeeds(env: NavigationEnv, seed: int) -> None:
    info = drive(env, obey, seed)
    assert info["is_success"], info
    assert info["subgoals"]["reached"] == info["subgoals"]["live"]


@pytest.mark.parametrize("seed", [3, 4])
def test_goals_on_the_map_are_found_without_turn_guidance(seed: int) -> None:
    assert drive(NavigationEnv("brookside", guidance="goals"), obey, seed)["is_success"]


@pytest.mark.slow
@pytest.mark.parametrize("guidance", ["turns", "goals"])
@pytest.mark.parametrize("town", ["brookside", "millbrook", "midtown", "northgate"])
@pytest.mark.parametrize("exceptions", [0.0, 2.5])
def test_obedient_drivers_succeed_in_all_towns(town: str, guidance: str, exceptions: float) -> None:
    env = NavigationEnv(town, guidance=guidance, exceptions=exceptions)
    assert np.mean([drive(env, obey, seed)["is_success"] for seed in range(100, 120)]) >= 0.9


def test_participant_gives_up_on_lane_following() -> None:
    info = drive(NavigationEnv("brookside", patience=20.0), follow_lane, 0)
    assert (info["is_success"], info["reason"]) == (False, "gave up")


def test_episode_is_truncated_at_time_limit() -> None:
    env = NavigationEnv("brookside", max_seconds=12.0)
    _, info = env.reset(seed=1)
    terminated = truncated = False
    while not (terminated or truncated):
        _, _, terminated, truncated, info = env.step(0)
    assert info["reason"] == "out of time"
    assert env.session.world.time == pytest.approx(12.0)
    assert truncated and not terminated


def play(env: NavigationEnv, seed: int, steps: int) -> list[tuple[Any, float]]:
    """Plays random feasible actions."""
    rng = np.random.default_rng(seed)
    observation, info = env.reset(seed=seed)
    played = [(observation, 0.0)]
    for _ in range(steps):
        action = rng.choice(np.flatnonzero(info["action_mask"]))
        observation, reward, terminated, truncated, info = env.step(action)
        played.append((observation, reward))
        if terminated or truncated:
            break
    return played


def test_equal_seeds_and_actions_give_equal_episodes(env: NavigationEnv) -> None:
    first, second = play(env, 5, 60), play(NavigationEnv("brookside"), 5, 60)
    for (one, reward), (two, other) in zip(first, second, strict=True):
        np.testing.assert_array_equal(one, two)
        assert reward == other


@pytest.mark.parametrize("settings", [{}, {"guidance": "goals", "exceptions": 4.0, "traffic": "heavy"}])
def test_masked_actions_are_not_refused(settings: dict[str, Any]) -> None:
    env = NavigationEnv(**settings)
    for seed in range(3):
        rng = np.random.default_rng(seed)
        _, info = env.reset(seed=seed)
        for _ in range(80):
            action = NavigationAction(rng.choice(np.flatnonzero(info["action_mask"])))
            _, _, terminated, truncated, info = env.step(action)
            assert not any(info["refused"].values()), action.name
            if terminated or truncated:
                break


def test_planned_turn_may_be_repeated(env: NavigationEnv) -> None:
    env.reset(seed=0)
    planner, again = env.session.world.planner, 0
    for _ in range(60):
        turns = np.flatnonzero(env.action_masks()[NavigationAction.turn(0) :])
        planned = planner.turn_ahead
        _, _, _, _, info = env.step(NavigationAction.turn(int(turns[0])) if len(turns) else NavigationAction.NOTHING)
        if planned is not None and planned == planner.turn_ahead and len(turns):
            assert not any(info["refused"].values()) and info["reward_terms"]["action"] == 0.0
            again += 1
    assert again > 5


def test_infeasible_action_is_refused(env: NavigationEnv) -> None:
    _, info = env.reset(seed=0)
    assert not info["action_mask"][NavigationAction.START]
    _, _, _, _, info = env.step(NavigationAction.START)
    assert info["refused"]["physical"] and not info["refused"]["mental"] and info["reward_terms"]["refusal"] < 0.0


def test_the_reward_is_the_sum_of_its_terms(env: NavigationEnv) -> None:
    rng = np.random.default_rng(0)
    env.reset(seed=3)
    for _ in range(30):
        _, reward, _, _, info = env.step(rng.integers(18))
        assert reward == pytest.approx(sum(info["reward_terms"].values()))
        assert set(info["reward_terms"]) == set(asdict(NavigationWeights()))


def test_progress_adds_up_to_decrease_of_cost_to_go(env: NavigationEnv) -> None:
    """Progress is a difference of potentials, so detours do not earn more."""
    env.reset(seed=0)
    left, rng, total = CostToGo(env.town), np.random.default_rng(1), 0.0
    left.aim(env.batch.goal(0))
    planner = env.session.world.planner
    before = left.from_place(planner.lane, planner.station)
    for _ in range(40):
        _, _, _, _, info = env.step(rng.choice(np.flatnonzero(env.action_masks())))
        assert not env.batch.blocked(0) and not info["reward_terms"]["subgoal"]
        total += info["reward_terms"]["progress"]
    after = left.from_place(planner.lane, planner.station)
    assert total == pytest.approx(NavigationWeights().progress * (before - after))


def test_sparse_reward_is_given_for_subgoals_only() -> None:
    env = NavigationEnv("brookside", reward="sparse")
    assert drive(env, follow_lane, 2)["return"] == 0.0
    reached = drive(env, obey, 2)
    assert reached["return"] == pytest.approx(reached["subgoals"]["reached"] + 2.0)


def test_scenario_of_seed_is_that_of_all_environments(env: NavigationEnv) -> None:
    env.reset(seed=17)
    assert env.session.scenario == draw_scenario(env.town, None, 17)
    scenario = draw_scenario(env.town, None, 18)
    env.reset(seed=17, options={"scenario": scenario})
    assert env.session.scenario == scenario
    with pytest.raises(ValueError, match="scenario"):
        env.reset(options={"scenario": 3})


def test_turn_instructions_have_distance_to_junction(env: NavigationEnv) -> None:
    observation, info = env.reset(seed=0)
    errors = []
    for _ in range(200):
        field = {name: observation[where] for name, where in FIELD.items()}
        if field["said"][0]:
            assert field["said"][1 + DialogueMove.INSTRUCT] == 1.0
            if field["said_action"][4] and field["junction"][0]:
                errors.append(float(field["said_distance"][0] - field["junction"][1]))
        observation, _, terminated, _, info = env.step(obey(observation, info["action_mask"]))
        if terminated:
            break
    assert len(errors) > 10
    assert np.median(np.abs(errors)) < 0.03  # in units of 100 m: the instructed distance is the true one


def test_turn_guidance_does_not_reveal_goal(env: NavigationEnv) -> None:
    observation, info = env.reset(seed=0)
    for _ in range(60):
        assert not observation[FIELD["goal"]].any() and not observation[FIELD["detours"]].any()
        observation, _, _, _, info = env.step(obey(observation, info["action_mask"]))


def test_named_places_off_the_map_are_not_revealed() -> None:
    """Guidance to a hidden goal is turn by turn, also where goals are named."""
    env = NavigationEnv("brookside", guidance="goals")
    seen = {True: 0, False: 0}
    for seed in range(6):
        observation, info = env.reset(seed=seed)
        for _ in range(150):
            goal = env.batch.goal(0)
            hidden = {mark.site for mark in env.session.scenario.storyboard.landmarks if mark.hidden}
            place = {(mark.lane, mark.station): mark.site for mark in env.session.scenario.storyboard.landmarks}
            if goal is not None:
                is_hidden = place[goal] in hidden
                seen[is_hidden] += 1
                assert bool(observation[FIELD["goal"]][0]) != is_hidden
            observation, _, terminated, _, info = env.step(obey(observation, info["action_mask"]))
            if terminated:
                break
    assert min(seen.values()) > 20


def test_exceptions_happen_when_enabled() -> None:
    env = NavigationEnv("brookside", exceptions=4.0)
    drive(env, obey, 1)
    assert env.session.summary()["exceptions"] > 0


def test_returned_objects_may_be_changed(env: NavigationEnv) -> None:
    observation, info = env.reset(seed=0)
    before = observation.copy()
    info["action_mask"][:] = 0
    info["reward_terms"].clear()
    env.step(0)
    np.testing.assert_array_equal(observation, before)
    assert env.action_masks().any()


def test_fields_fill_the_observation() -> None:
    assert sum(FIELDS.values()) == NavigationEnv("brookside").observation_space.shape[0]  # type: ignore[index]  # a `Box` always has a shape
    assert [where.stop - where.start for where in FIELD.values()] == list(FIELDS.values())


def test_values_lie_in_the_ranges_of_their_fields() -> None:
    env = NavigationEnv("brookside", exceptions=4.0, traffic="medium")
    env.action_space.seed(3)
    observation, info = env.reset(seed=3)
    least, greatest = observation.copy(), observation.copy()
    for _ in range(200):
        observation, _, terminated, truncated, info = env.step(env.action_space.sample(info["action_mask"]))
        least, greatest = np.minimum(least, observation), np.maximum(greatest, observation)
        if terminated or truncated:
            observation, info = env.reset()
    for spec in FIELD_SPECS:
        assert spec.low <= least[FIELD[spec.name]].min() and greatest[FIELD[spec.name]].max() <= spec.high, spec.name


@pytest.mark.parametrize(
    ("settings", "named"),
    [
        ({"guidance": "signs"}, "guidance"),
        ({"traffic": "thick"}, "traffic"),
        ({"exceptions": 5.0}, "exceptions"),
        ({"patience": 1.0}, "patience"),
        ({"max_seconds": 0.0}, "max_seconds"),
        ({"reward": "nice"}, "reward"),
        ({"render_mode": "ascii"}, "render_mode"),
    ],
)
def test_error_names_invalid_setting(settings: dict[str, Any], named: str) -> None:
    with pytest.raises(ValueError, match=named):
        NavigationEnv(**settings)


def test_reward_weights_must_be_finite() -> None:
    with pytest.raises(ValueError, match="NavigationWeights.progress is nan"):
        NavigationWeights(progress=float("nan"))
    with pytest.raises(ValueError, match="RewardWeights.time is inf"):
        RewardWeights(time=float("inf"))


def test_step_before_reset_raises_error() -> None:
    env = NavigationEnv("brookside", max_seconds=1.0)
    with pytest.raises(gym.error.ResetNeeded):
        env.step(0)
    env.reset(seed=0)
    with pytest.raises(ValueError, match="0..17"):
        env.step(18)
    env.step(0)
    env.step(0)
    with pytest.raises(gym.error.ResetNeeded):
        env.step(0)


def test_vector_environment_equals_single_ones() -> None:
    vector = gym.make_vec("dorothie_gym/Navigation-v0", num_envs=3, max_seconds=5.0, town="brookside")
    observations, infos = vector.reset(seed=4)
    assert observations.shape == (3, sum(FIELDS.values())) and infos["action_mask"].shape == (3, len(NavigationAction))
    for _ in range(12):
        observations, *_ = vector.step(np.zeros(3, dtype=np.int64))
    single, _ = NavigationEnv("brookside", max_seconds=5.0).reset(seed=5)
    np.testing.assert_array_equal(vector.reset(seed=4)[0][1], single)
    vector.close()


def test_environments_pass_stable_baselines_checker() -> None:
    checker = pytest.importorskip("stable_baselines3.common.env_checker", reason="needs the extra 'baselines'")
    checker.check_env(NavigationEnv("brookside"))
    checker.check_env(NavigationContinuousEnv("brookside"))


def test_state_is_restored_where_other_goals_were_driven_to() -> None:
    one, other = (NavigationEnv("brookside", guidance="goals", exceptions=4.0) for _ in range(2))
    one.reset(seed=1)
    for seed in (50, 51, 52):
        other.reset(seed=seed)
    for _ in range(30):
        one.step(0)
    size = one.clone_state().nbytes
    other.restore_state(one.clone_state())
    for _ in range(120):
        expected, found = one.step(NavigationAction.STOP), other.step(NavigationAction.STOP)
        np.testing.assert_array_equal(expected[0], found[0])
        assert expected[1:4] == found[1:4] and expected[4]["reward_terms"] == found[4]["reward_terms"]
        if expected[2]:
            break
    for seed in range(12):
        one.reset(seed=seed)
    assert one.clone_state().nbytes < 1.5 * size  # old goals are forgotten
