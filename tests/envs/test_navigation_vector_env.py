"""Vectorised navigation environments against single ones that Gymnasium's `SyncVectorEnv` steps."""

from __future__ import annotations

import copy
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from dorothie_gym.envs.navigation.driving_vector_env import DrivingVectorEnv
from dorothie_gym.envs.navigation_continuous_vector_env import NavigationContinuousVectorEnv
from dorothie_gym.envs.navigation_v0 import NavigationEnv
from dorothie_gym.envs.navigation_vector_env import NavigationVectorEnv
from dorothie_gym.ontology import Role
from dorothie_gym.policies.ad_wizard import AdWizardState, ScriptedAdWizard
from dorothie_gym.policies.decision_random import policy_seed
from dorothie_gym.policies.navigation.observation_fields import DECISION_FREQUENCY
from dorothie_gym.session.observations import LazyObservations
from dorothie_gym.session.spaces import AdWizardAction, Observation, SpaceLimits
from dorothie_gym.sim.state.codes import Walk
from tests.envs.navigation_drivers import drive, obey
from tests.malformed.memory import peak_memory

NAVIGATION, CONTINUOUS = "dorothie_gym/Navigation-v0", "dorothie_gym/Navigation-continuous-v0"
SHORT: dict[str, Any] = {"max_seconds": 40.0, "patience": 20.0}


def check_equal(found: Any, expected: Any, path: str = "") -> None:
    """Compares values, types, shapes and dtypes."""
    assert type(found) is type(expected), path
    if isinstance(expected, dict):
        assert found.keys() == expected.keys(), path
        for name in expected:
            check_equal(found[name], expected[name], f"{path}.{name}")
    elif isinstance(expected, list | tuple) or (isinstance(expected, np.ndarray) and expected.dtype == np.object_):
        for one, two in zip(found, expected, strict=True):
            check_equal(one, two, path)
    elif isinstance(expected, np.ndarray):
        assert (found.dtype, found.shape) == (expected.dtype, expected.shape), path
        np.testing.assert_array_equal(found, expected, err_msg=path)
    else:
        assert found == expected, path


def play_both(
    name: str,
    mode: AutoresetMode,
    actions: Any,
    steps: int,
    count: int = 3,
    threads: int | None = None,
    **settings: Any,
) -> int:
    """Plays the same actions in both kinds of batches; returns the number of episodes that ended."""
    native = gym.make_vec(name, num_envs=count, autoreset_mode=mode, threads=threads, **settings)
    plain = gym.make_vec(
        name, num_envs=count, vectorization_mode="sync", vector_kwargs={"autoreset_mode": mode}, **settings
    )
    check_equal(native.reset(seed=5), plain.reset(seed=5))
    rng, ended = np.random.default_rng(3), 0
    for _ in range(steps):
        chosen = actions(rng)
        outcome = native.step(chosen)
        check_equal(outcome, plain.step(chosen))
        over = outcome[2] | outcome[3]
        ended += int(over.sum())
        if mode is AutoresetMode.DISABLED and over.any():
            options = {"reset_mask": over}
            check_equal(native.reset(options=dict(options)), plain.reset(options=dict(options)))
    native.close()
    plain.close()
    return ended


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_batch_is_equal_to_single_environments(mode: AutoresetMode) -> None:
    assert play_both(NAVIGATION, mode, lambda rng: rng.integers(0, 18, 3), 160, **SHORT) >= 4


def pedals(rng: np.random.Generator) -> np.ndarray:
    return rng.uniform(-1.0, 1.0, (3, 3)).astype(np.float32)


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_batch_with_pedals_is_equal_to_single_environments(mode: AutoresetMode) -> None:
    assert play_both(CONTINUOUS, mode, pedals, 450, **SHORT) >= 3


@pytest.mark.parametrize("frequency", [5.0, 0.5])  # several calls of the physics a decision below 2 Hz
def test_settings_with_pedals_are_those_of_the_single_environment(frequency: float) -> None:
    settings: dict[str, Any] = {"exceptions": 4.0, "traffic": "medium", "decision_frequency": frequency}
    play_both(CONTINUOUS, AutoresetMode.NEXT_STEP, pedals, 60, **SHORT, **settings)


def test_number_of_threads_changes_nothing_with_pedals() -> None:
    one, two = (NavigationContinuousVectorEnv(9, "brookside", max_seconds=10.0, threads=threads) for threads in (1, 2))
    check_equal(one.reset(seed=2), two.reset(seed=2))
    rng = np.random.default_rng(5)
    for _ in range(120):
        actions = rng.uniform(-1.0, 1.0, (9, 3)).astype(np.float32)
        check_equal(one.step(actions), two.step(actions))
    assert (one.threads, two.threads) == (1, 2)


@pytest.mark.parametrize(
    "settings", [{"guidance": "goals", "exceptions": 3.0}, {"town": "midtown", "traffic": "medium"}]
)
def test_settings_are_those_of_the_single_environment(settings: dict[str, Any]) -> None:
    play_both(NAVIGATION, AutoresetMode.NEXT_STEP, lambda rng: rng.integers(0, 18, 3), 40, **SHORT, **settings)


@pytest.mark.slow
@pytest.mark.parametrize("guidance", ["turns", "goals"])
@pytest.mark.parametrize(
    ("town", "traffic", "exceptions"),
    [("brookside", "light", 0.0), ("midtown", "medium", 2.0), ("millbrook", "none", 4.0), ("northgate", "heavy", 0.0)],
)
def test_hundreds_of_episodes_are_equal_to_those_of_single_environments(
    town: str, traffic: str, exceptions: float, guidance: str
) -> None:
    settings: dict[str, Any] = {"town": town, "traffic": traffic, "exceptions": exceptions, "guidance": guidance}
    ended = 0
    for count, threads, steps in ((1, 1, 150), (7, 2, 100), (64, 2, 60), (64, 1, 60)):
        ended += play_both(
            NAVIGATION, AutoresetMode.SAME_STEP, lambda rng, count=count: rng.integers(0, 18, count), steps, count,
            threads, max_seconds=25.0, patience=12.0, **settings,
        )  # fmt: skip
    assert ended >= 130


@pytest.mark.slow
def test_a_day_of_driving_leaks_no_memory() -> None:
    envs = NavigationVectorEnv(
        64, ["brookside", "midtown"], guidance="goals", traffic="medium", exceptions=2.0, autoreset_mode="SameStep"
    )
    rng = np.random.default_rng(0)

    def drive(hours: float) -> int:
        for _ in range(round(hours * 3600.0 * DECISION_FREQUENCY / envs.num_envs)):
            masks = envs.action_masks()
            envs.step((rng.random(masks.shape) * masks).argmax(axis=1))
        return peak_memory()

    envs.reset(seed=0)
    after_some_hours = drive(6.0)
    assert drive(24.0) - after_some_hours < 8_000_000


def test_environment_does_not_depend_on_its_place_in_the_batch() -> None:
    alone = NavigationVectorEnv(1, "brookside", max_seconds=20.0)
    among = NavigationVectorEnv(7, "brookside", max_seconds=20.0)
    one, _ = alone.reset(seed=9)
    all_of_them, _ = among.reset(seed=5)
    rng = np.random.default_rng(0)
    for _ in range(60):
        np.testing.assert_array_equal(one[0], all_of_them[4])
        actions = rng.integers(0, 18, 7)
        one, reward, *_ = alone.step(actions[4:5])
        all_of_them, rewards, *_ = among.step(actions)
        assert reward[0] == rewards[4]


def test_several_towns_are_played_in_turn() -> None:
    env = NavigationVectorEnv(5, ["brookside", "millbrook"])
    observations, _ = env.reset(seed=3)
    for number, town in enumerate(("brookside", "millbrook", "brookside", "millbrook", "brookside")):
        alone, _ = NavigationEnv(town).reset(seed=3 + number)
        np.testing.assert_array_equal(observations[number], alone)


def test_number_of_threads_changes_nothing() -> None:
    one, two = (NavigationVectorEnv(9, "brookside", max_seconds=30.0, threads=threads) for threads in (1, 2))
    check_equal(one.reset(seed=2), two.reset(seed=2))
    rng = np.random.default_rng(5)
    for _ in range(70):
        actions = rng.integers(0, 18, 9)
        check_equal(one.step(actions), two.step(actions))


@pytest.mark.parametrize("town", ["brookside", "midtown", "millbrook", "northgate"])
def test_an_environment_takes_at_most_a_hundred_kilobytes_in_every_town(town: str) -> None:
    env = NavigationVectorEnv(64, town, traffic="medium", threads=1)
    env.reset(seed=5)
    rng = np.random.default_rng(0)
    for _ in range(100):  # long paths make room for themselves
        mask = env.action_masks()
        env.step((rng.random(mask.shape) * mask).argmax(axis=1))
    assert env.nbytes / 64 < 100_000


def test_crowds_and_roadblocks_find_room_in_the_batch() -> None:
    env = NavigationVectorEnv(16, "midtown", traffic="medium", exceptions=4.0)
    observations, infos = env.reset(seed=0)
    (batch,) = env.batches
    before, people, props = batch.worlds.order.shape, 0, 0
    for _ in range(400):
        actions = [obey(*each) for each in zip(observations, infos["action_mask"], strict=True)]
        observations, *_, infos = env.step(np.array(actions))
        people = max(people, int((batch.worlds.pedestrians["state"] != Walk.EMPTY).sum(axis=1).max()))
        props = max(props, int(batch.worlds.props["present"].sum(axis=1).max()))
    assert people > 4 and props > 0
    assert batch.worlds.order.shape == before


def test_masks_are_those_of_infos() -> None:
    env = NavigationVectorEnv(4, "brookside")
    _, infos = env.reset(seed=1)
    for _ in range(20):
        np.testing.assert_array_equal(env.action_masks(), infos["action_mask"].astype(bool))
        rng = np.random.default_rng(2)
        _, _, _, _, infos = env.step(np.array([rng.choice(np.flatnonzero(mask)) for mask in env.action_masks()]))
        assert not any(any(infos["refused"][kind]) for kind in ("mental", "physical"))


def test_obedient_driver_succeeds_in_a_batch() -> None:
    env = NavigationVectorEnv(2, "brookside", autoreset_mode=AutoresetMode.DISABLED)
    observations, infos = env.reset(seed=0)
    outcomes: dict[int, bool] = {}
    while len(outcomes) < 2:
        actions = np.array([obey(*pair) for pair in zip(observations, infos["action_mask"], strict=True)])
        observations, _, terminated, truncated, infos = env.step(actions)
        for number in np.flatnonzero(terminated | truncated).tolist():
            outcomes[number] = bool(infos["is_success"][number])
            observations, infos = env.reset(seed=0, options={"reset_mask": terminated | truncated})
            infos["action_mask"] = env.action_masks()
    assert outcomes == {seed: drive(NavigationEnv("brookside"), obey, seed)["is_success"] for seed in (0, 1)}


@pytest.mark.parametrize("kind", [NavigationVectorEnv, NavigationContinuousVectorEnv])
def test_states_of_a_batch_are_restored(kind: type[DrivingVectorEnv]) -> None:
    env = kind(2, max_seconds=30.0, exceptions=4.0)  # type: ignore[call-arg]  # arguments of both kinds
    env.reset(seed=4)
    env.action_space.seed(1)
    actions = [env.action_space.sample() for _ in range(90)]
    for action in actions[:20]:
        env.step(action)
    state, twin = env.clone_state(), copy.deepcopy(env)
    first = [env.step(action) for action in actions[20:]]
    env.restore_state(state)
    check_equal(first, [env.step(action) for action in actions[20:]])
    check_equal(first, [twin.step(action) for action in actions[20:]])


def test_any_environment_is_drawn() -> None:
    env = NavigationVectorEnv(2, "brookside", render_mode="rgb_array", view="session")
    env.reset(seed=6)
    (frame,) = env.render() or ()
    other = env.render_one(1)
    assert other is not None and frame.shape == other.shape == (800, 1280, 3)
    assert (frame != other).any()


def test_mistakes_are_explained() -> None:
    with pytest.raises(ValueError, match="num_envs is 0"):
        NavigationVectorEnv(0, "brookside")
    with pytest.raises(ValueError, match="town is an empty sequence"):
        NavigationVectorEnv(2, [])
    with pytest.raises(ValueError, match="None or 'rgb_array'"):
        NavigationVectorEnv(2, "brookside", render_mode="human")
    with pytest.raises(ValueError, match="threads is 0"):
        NavigationVectorEnv(2, "brookside", threads=0)
    env = NavigationVectorEnv(2, "brookside", max_seconds=10.0, autoreset_mode="Disabled")
    with pytest.raises(gym.error.ResetNeeded, match=r"environments \[0, 1\] wait for a reset"):
        env.step(np.array([0, 0]))
    env.reset(seed=1)
    for actions, message in (([0], "2 whole numbers"), ([0.5, 1.0], "2 whole numbers"), ([0, 18], r"in 0\.\.17")):
        with pytest.raises(ValueError, match=message):
            env.step(np.array(actions))
    with pytest.raises(ValueError, match="reset_mask"):
        env.reset(options={"reset_mask": [True, False]})
    with pytest.raises(ValueError, match="3 seeds for 2 environments"):
        env.reset(seed=[1, 2, 3])
    for _ in range(20):
        _, _, _, truncated, _ = env.step(np.array([0, 0]))
    assert truncated.all()
    with pytest.raises(gym.error.ResetNeeded, match="wait for a reset"):
        env.step(np.array([0, 0]))


def test_session_that_is_looked_up_late_is_the_one_that_was_played() -> None:
    watched, alone = (NavigationVectorEnv(3, "brookside", guidance="goals", max_seconds=60.0) for _ in range(2))
    check_equal(watched.reset(seed=21), alone.reset(seed=21))
    rng = np.random.default_rng(2)
    for _ in range(40):
        mask = alone.action_masks()
        actions = (rng.random(mask.shape) * mask).argmax(axis=1)
        check_equal(watched.step(actions), alone.step(actions))
        sessions = [watched.batches[0].catch_up(number) for number in range(3)]
    for number, session in enumerate(sessions):
        late = alone.batches[0].catch_up(number)
        assert (late.world.time, late.beliefs.goals) == (session.world.time, session.beliefs.goals)
        assert late.world.ego.goals == session.world.ego.goals
        assert late.log.infractions == session.log.infractions
        np.testing.assert_array_equal(late.world.localizer.pose, session.world.localizer.pose)
        np.testing.assert_array_equal(late.world.seen(), session.world.seen())
    assert any(session.beliefs.goals for session in sessions)


@pytest.mark.parametrize("town", ["brookside", "midtown"])
def test_ad_wizard_is_asked_at_the_decisions_at_which_it_acts(town: str, monkeypatch: pytest.MonkeyPatch) -> None:
    asked, step = [], ScriptedAdWizard.step

    def note(wizard: ScriptedAdWizard, observation: Observation, state: AdWizardState) -> Any:
        asked.append((state.seed, state.count))
        return step(wizard, observation, state)

    monkeypatch.setattr(ScriptedAdWizard, "step", note)
    env = NavigationVectorEnv(10, town, traffic="medium", exceptions=4.0, autoreset_mode=AutoresetMode.DISABLED)
    observations, infos = env.reset(seed=20)
    (batch,) = env.batches
    wizard = ScriptedAdWizard(SpaceLimits.for_town(batch.town), rate=4.0)
    seeds = [policy_seed(batch.catch_up(number).scenario.seed, Role.AD_WIZARD) for number in range(10)]
    states, idle = [wizard.initial_state(seed, batch.town) for seed in seeds], AdWizardAction().encode(wizard.limits)
    expected = []
    for _ in range(400):
        for number, before in enumerate(states):
            seen = LazyObservations(batch.catch_up(number))["ad_wizard"]
            action, states[number] = step(wizard, seen, before)
            if any(not np.array_equal(action[name], idle[name]) for name in idle):
                expected.append((before.seed, before.count))
        actions = [obey(*each) for each in zip(observations, infos["action_mask"], strict=True)]
        observations, _, terminations, truncations, infos = env.step(np.array(actions))
        if (terminations | truncations).any():
            break
    assert len(expected) > 3
    assert asked == expected
