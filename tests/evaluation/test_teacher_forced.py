from __future__ import annotations

import sys
import types
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env

from dorothie_gym.evaluation import NfDEnv, RfNEnv, TeacherForcedEnv, UfNEnv
from dorothie_gym.ontology import DialogueMove, PhysicalAction, Role
from dorothie_gym.sessions import SessionError
from dorothie_gym.spaces import NO_MOVE, LandmarkColumn, SpaceLimits
from tests.sessions.builders import physical, session, utterance, write
from tests.sessions.dialogues import DONE, OKAY, STREET, TO_KFC, talk

ENVS = [UfNEnv, RfNEnv, NfDEnv]


def play(env: TeacherForcedEnv[Any], right: bool = True) -> tuple[list[dict[str, Any]], list[float], dict[str, Any]]:
    """Plays an episode with the labels, or with random actions."""
    observation, info = env.reset(seed=0)
    observations, rewards, points = [observation], [], env._points
    env.action_space.seed(0)
    for point in points:
        action = env._label(point) if right else env.action_space.sample()
        observation, reward, terminated, truncated, info = env.step(action)
        observations.append(observation)
        rewards.append(reward)
    assert terminated and not truncated
    return observations, rewards, info


@pytest.mark.parametrize("env_class", ENVS)
def test_gymnasium_accepts_the_environment(env_class: type[TeacherForcedEnv[Any]]) -> None:
    sessions = [session(talk()), session(talk(), name="two")]
    made = gym.make(EnvSpec("test/Task-v0", entry_point=env_class, kwargs={"sessions": sessions}), render_mode="ansi")
    check_env(made.unwrapped)  # its warnings are errors here


@pytest.mark.parametrize(("env_class", "count"), [(UfNEnv, 4), (RfNEnv, 3), (NfDEnv, 5)])
def test_labels_earn_everything(env_class: type[TeacherForcedEnv[Any]], count: int) -> None:
    observations, rewards, info = play(env_class([session(talk())]))
    assert rewards == [1.0] * count
    assert info["points_left"] == 0
    assert set(info["metrics"].values()) == {1.0}
    assert info["session"] == "one"


@pytest.mark.parametrize("env_class", ENVS)
def test_predictions_do_not_change_what_is_observed(env_class: type[TeacherForcedEnv[Any]]) -> None:
    one, _, _ = play(env_class([session(talk())]))
    other, _, _ = play(env_class([session(talk())]), right=False)
    np.testing.assert_equal(one, other)


@pytest.mark.parametrize("env_class", ENVS)
def test_every_observation_is_in_the_space(env_class: type[TeacherForcedEnv[Any]]) -> None:
    env = env_class([session(talk() + utterance(280, Role.PARTICIPANT, 8, ("caf\u00e9 \u2019" * 200, DONE)))])
    for observation in play(env)[0]:
        assert env.observation_space.contains(observation)


def test_observation_holds_the_history_newest_first() -> None:
    observations, _, _ = play(UfNEnv([session(talk())]))
    third = observations[2]
    assert third["utterance"] == "Yes, left on Fuller."
    expected = [DialogueMove.REPLY_Y, DialogueMove.EXPLAIN, DialogueMove.ACKNOWLEDGE, DialogueMove.INSTRUCT]
    assert third["moves"].tolist() == [*expected, *[NO_MOVE] * 12]
    assert third["move_speakers"][:5].tolist() == [1, 2, 2, 1, 0]
    assert tuple(third["move_slots"][3]) == TO_KFC.vector
    assert third["move_times"][:2].tolist() == [4.0, 2.0]
    assert third["actions"][:4].tolist() == [
        PhysicalAction.SPEED_CHANGE,
        PhysicalAction.J_TURN,
        PhysicalAction.START,
        0,
    ]
    assert third["action_angles"][:3].tolist() == [0.0, 88.0, 0.0]
    assert third["co_wizard_text"] == "Okay, turning left."
    assert (third["time"][0], third["speed"][0], third["pose"][0]) == (4.0, 6.0, pytest.approx(119 / 5))
    assert third["landmarks"][:, LandmarkColumn.NAME].tolist()[:2] == [4.0, 0.0]


def test_only_ufn_sees_the_words() -> None:
    for env in (RfNEnv([session(talk())]), NfDEnv([session(talk())])):
        assert "utterance" not in env.observation_space.spaces  # type: ignore[attr-defined]


def test_reward_of_ufn_is_the_move_and_the_metrics_hold_the_slots() -> None:
    env = UfNEnv([session(talk())])
    env.reset(seed=0)
    action = {"move": int(DialogueMove.INSTRUCT), "slots": np.zeros(69, dtype=np.int8)}
    _, reward, _, _, info = env.step(action)
    assert reward == 1.0
    assert info["metrics"] == {"move_accuracy": 1.0, "slot_f1": 0.0, "slot_score_paper": 0.0}
    assert tuple(info["label"]["slots"]) == TO_KFC.vector
    _, reward, _, _, info = env.step(action)
    assert (reward, info["metrics"]["move_accuracy"]) == (0.0, 0.5)


def test_reward_of_nfd_is_joint_and_on_the_circle() -> None:
    env = NfDEnv([session([physical(1, PhysicalAction.J_TURN, -179.0), physical(2, PhysicalAction.J_TURN, 10.0)])])
    env.reset(seed=0)
    assert env.step({"action": 3, "angle": 179})[1] == 1.0
    assert env.step({"action": 3, "angle": 25})[1] == 0.0


def test_unknown_angles_are_left_out_and_counted() -> None:
    env = NfDEnv([session([physical(1, PhysicalAction.J_TURN), physical(2, PhysicalAction.STOP)])])
    assert (env.reset(seed=0)[1]["points_left"], env.points_without_angle) == (1, 1)


@pytest.mark.parametrize(
    ("env_class", "action", "message"),
    [
        (UfNEnv, 3, "a dict with the fields move, slots"),
        (UfNEnv, {"move": 1}, "'slots' is missing"),
        (UfNEnv, {"move": 15, "slots": np.zeros(69, dtype=np.int8)}, "'move' is 15"),
        (UfNEnv, {"move": 1, "slots": np.zeros(68, dtype=np.int8)}, "'slots'"),
        (UfNEnv, {"move": 1, "slots": np.full(69, 2, dtype=np.int8)}, "'slots'"),
        (RfNEnv, {"move": 1, "slots": np.zeros(69, dtype=np.int8), "angle": 3}, "no field 'angle'"),
        (NfDEnv, {"action": 6, "angle": 0}, "'action' is 6"),
        (NfDEnv, {"action": 1, "angle": 180}, "'angle' is 180"),
        (NfDEnv, {"action": 1, "angle": 1.5}, "'angle' is 1.5"),
    ],
)
def test_malformed_action_is_told_by_field(env_class: type[TeacherForcedEnv[Any]], action: Any, message: str) -> None:
    env = env_class([session(talk())])
    env.reset(seed=0)
    with pytest.raises(ValueError, match=message):
        env.step(action)


def test_step_without_a_point_is_refused() -> None:
    env = UfNEnv([session(talk())])
    with pytest.raises(ValueError, match="call reset first"):
        env.step({"move": 1, "slots": np.zeros(69, dtype=np.int8)})


def test_sessions_come_from_a_folder_and_are_chosen_by_split_number_and_name(tmp_path: Path) -> None:
    for name in "abc":
        write(tmp_path / name, talk())
    assert {UfNEnv(tmp_path).reset(seed=seed)[1]["session"] for seed in range(20)} == {"a", "b", "c"}
    assert UfNEnv(tmp_path, split="train").reset(seed=0)[1]["session"] == "a"
    env = UfNEnv(str(tmp_path), split="test")
    assert env.reset(options={"session": 1})[1]["session"] == "c"
    assert env.reset(options={"session": "b"})[1]["session"] == "b"
    with pytest.raises(ValueError, match="'session' is 'a'"):
        env.reset(options={"session": "a"})


def test_same_seed_draws_the_same_session() -> None:
    env = UfNEnv([session(talk(), name=name) for name in "abcdef"])
    assert env.reset(seed=5)[1]["session"] == env.reset(seed=5)[1]["session"]


def test_session_without_points_is_left_out_and_named() -> None:
    env = RfNEnv([session(talk()), session(utterance(30, Role.PARTICIPANT, 0, ("Okay", OKAY)), name="silent")])
    assert env.sessions_without_points == ("silent",)


def test_no_sessions_are_one_clear_error(tmp_path: Path) -> None:
    with pytest.raises(SessionError, match="holds no session"):
        UfNEnv(tmp_path)
    with pytest.raises(SessionError, match="no such folder"):
        UfNEnv(tmp_path / "missing")
    with pytest.raises(SessionError, match="sessions is empty"):
        UfNEnv([])
    with pytest.raises(SessionError, match="none of the 1 sessions has a point of the task nfd"):
        NfDEnv([session(utterance(30, Role.PARTICIPANT, 0, ("Fuller", STREET)))])
    with pytest.raises(SessionError, match="at least 2 sessions"):
        UfNEnv([session(talk())], split="train")


def test_wrong_arguments_are_named() -> None:
    with pytest.raises(ValueError, match="render_mode is 'human'"):
        UfNEnv([session(talk())], render_mode="human")
    with pytest.raises(ValueError, match="split is 'val'"):
        UfNEnv([session(talk())], split="val")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"2 landmarks; SpaceLimits.landmarks is 1"):
        UfNEnv([session(talk())], limits=SpaceLimits(landmarks=1))


def test_without_sessions_the_cached_corpus_is_taken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path / "cached", talk())
    corpus = types.ModuleType("dorothie_gym.rollout.corpus")
    corpus.default_corpus = lambda: tmp_path  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "dorothie_gym.rollout.corpus", corpus)
    assert UfNEnv().reset(seed=0)[1]["session"] == "cached"


def test_render_shows_the_talk_and_the_words_in_question() -> None:
    env = UfNEnv([session(talk())], render_mode="ansi")
    env.reset(seed=0)
    env.step(env.action_space.sample())
    picture = env.render()
    assert picture is not None
    assert "To the KFC please. [Instruct(Landmark=KFC)]" in picture
    assert picture.splitlines()[-1].endswith("ufn? Yes, left on Fuller.")
    assert UfNEnv([session(talk())]).render() is None
