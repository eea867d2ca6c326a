from __future__ import annotations

import sys
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env

from dorothie_gym.archive import Corpus
from dorothie_gym.envs.nfd_v0 import NfDEnv
from dorothie_gym.envs.rfn_v0 import RfNEnv
from dorothie_gym.envs.teacher_forced import TeacherForcedEnv
from dorothie_gym.envs.ufn_v0 import UfNEnv
from dorothie_gym.errors import SessionError
from dorothie_gym.ontology import DialogueMove, PhysicalAction, Role
from dorothie_gym.session.spaces import NO_MOVE, LandmarkColumn, SpaceLimits
from tests.archive.sdn.builders import hub, release, sample
from tests.session.recording.builders import physical, session, utterance, write
from tests.session.recording.dialogues import DONE, OKAY, STREET, TO_KFC, talk

ENVS = [UfNEnv, RfNEnv, NfDEnv]


def play(env: TeacherForcedEnv, right: bool = True) -> tuple[list[dict[str, Any]], list[float], dict[str, Any]]:
    """Plays an episode with the labels, or with random actions."""
    observation, info = env.reset(seed=0)
    observations, rewards, terminated = [observation], [], False
    env.action_space.seed(0)
    while not terminated:
        assert env._point is not None
        action = env.rules.label(env._point) if right else env.action_space.sample()
        observation, reward, terminated, truncated, info = env.step(action)
        observations.append(observation)
        rewards.append(reward)
        assert not truncated
    return observations, rewards, info


@pytest.mark.parametrize("env_class", ENVS)
def test_gymnasium_accepts_the_environment(env_class: type[TeacherForcedEnv]) -> None:
    sessions = [session(talk()), session(talk(), name="two")]
    made = gym.make(EnvSpec("test/Task-v0", entry_point=env_class, kwargs={"corpus": sessions}), render_mode="ansi")
    check_env(made.unwrapped)  # its warnings are errors here


@pytest.mark.parametrize(("env_class", "count"), [(UfNEnv, 4), (RfNEnv, 3), (NfDEnv, 5)])
def test_labels_get_full_reward(env_class: type[TeacherForcedEnv], count: int) -> None:
    _observations, rewards, info = play(env_class([session(talk())]))
    assert rewards == [1.0] * count
    assert set(info["metrics"].values()) == {1.0}
    assert info["session"] == "one"


@pytest.mark.parametrize("env_class", ENVS)
def test_observations_do_not_depend_on_predictions(env_class: type[TeacherForcedEnv]) -> None:
    one, _, _ = play(env_class([session(talk())]))
    other, _, _ = play(env_class([session(talk())]), right=False)
    np.testing.assert_equal(one, other)


@pytest.mark.parametrize("env_class", ENVS)
def test_every_observation_is_in_the_space(env_class: type[TeacherForcedEnv]) -> None:
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


def test_only_ufn_observes_words() -> None:
    for env in (RfNEnv([session(talk())]), NfDEnv([session(talk())])):
        assert "utterance" not in env.observation_space.spaces  # type: ignore[attr-defined]  # a `Dict`, declared as `Space`


def test_reward_of_ufn_is_the_mean_of_move_and_slots() -> None:
    env = UfNEnv([session(talk())])
    env.reset(seed=0)
    action = {"move": int(DialogueMove.INSTRUCT), "slots": np.zeros(69, dtype=np.int8)}
    _, reward, _, _, info = env.step(action)
    assert (reward, info["reward_terms"]) == (0.5, {"move": 1.0, "slots": 0.0})
    assert info["metrics"] == {"move_accuracy": 1.0, "slot_f1": 0.0, "slot_score_paper": 0.0}
    assert tuple(info["label"]["slots"]) == TO_KFC.vector
    _, reward, _, _, info = env.step(action)
    assert (reward, info["reward_terms"]) == (0.5, {"move": 0.0, "slots": 1.0}), "a plain yes has no slots"
    assert info["metrics"]["move_accuracy"] == 0.5
    half = np.array(STREET.vector, dtype=np.int8)
    half[np.flatnonzero(half)[0]] = 0
    _, _, _, _, info = env.step({"move": int(DialogueMove.INSTRUCT), "slots": half})
    assert info["reward_terms"]["slots"] == pytest.approx(2 / 3), "one of two, nothing wrong: F1 of 2 / 3"


def test_reward_of_nfd_is_the_mean_of_action_and_joint_on_the_circle() -> None:
    env = NfDEnv([session([physical(1, PhysicalAction.J_TURN, -179.0), physical(2, PhysicalAction.J_TURN, 10.0)])])
    env.reset(seed=0)
    assert env.step({"action": 3, "angle": 179})[1] == 1.0
    _, reward, _, _, info = env.step({"action": 3, "angle": 25})
    assert (reward, info["reward_terms"]) == (0.5, {"action": 1.0, "joint": 0.0})


def test_reward_without_recorded_angle_is_that_of_the_action() -> None:
    env = NfDEnv([session([physical(1, PhysicalAction.J_TURN), physical(2, PhysicalAction.STOP)])])
    env.reset(seed=0)
    _, reward, _, _, info = env.step({"action": 3, "angle": 77})
    assert (reward, info["reward_terms"]["action"]) == (1.0, 1.0)
    assert np.isnan([info["reward_terms"]["joint"], info["metrics"]["joint_accuracy"]]).all(), "nothing to compare with"


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
def test_error_names_malformed_field(env_class: type[TeacherForcedEnv], action: Any, message: str) -> None:
    env = env_class([session(talk())])
    env.reset(seed=0)
    with pytest.raises(ValueError, match=message):
        env.step(action)


def test_step_without_point_raises_error() -> None:
    env = UfNEnv([session(talk())])
    with pytest.raises(ResetNeeded, match=r"call reset\(\) first"):
        env.step({"move": 1, "slots": np.zeros(69, dtype=np.int8)})
    play(env)
    with pytest.raises(ResetNeeded, match=r"call reset\(\) first"):
        env.step({"move": 1, "slots": np.zeros(69, dtype=np.int8)})


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for fold, name in (("train", "a"), ("train", "b"), ("val/seen", "c"), ("test/seen", "d"), ("test/unseen", "e")):
        write(tmp_path / fold / name, talk())
    return tmp_path


@pytest.mark.parametrize(
    ("split", "names"),
    [("all", "abcde"), ("train", "ab"), ("val", "c"), ("test", "de"), ("test_seen", "d"), ("test_unseen", "e")],
)
def test_split_selects_fold_of_corpus(folder: Path, split: str, names: str) -> None:
    env = gym.make("dorothie_gym/UfN-v0", corpus=folder, split=split)
    assert {env.reset(seed=seed)[1]["session"] for seed in range(30)} == set(names)


def test_error_for_missing_split_lists_folds(folder: Path) -> None:
    with pytest.raises(SessionError, match="split 'val_unseen' has no session; there are train, val_seen, test_seen"):
        UfNEnv(folder, split="val_unseen")


def test_session_is_selected_by_number_or_name(folder: Path) -> None:
    env = RfNEnv(Corpus.load(folder), split="train")
    assert env.reset(options={"session": 1})[1]["session"] == "b"
    assert env.reset(options={"session": "a"})[1]["session"] == "a"
    for wrong in ("c", 2, -1, 0.5):
        with pytest.raises(ValueError, match="option 'session' is "):
            env.reset(options={"session": wrong})


@pytest.mark.parametrize("env_class", ENVS)
@pytest.mark.parametrize("layout", [release, sample, hub])
def test_sdn_sessions_can_be_played(
    env_class: type[TeacherForcedEnv], layout: Callable[[Path], Path], tmp_path: Path
) -> None:
    layout(tmp_path / "val" / "seen" / "log_1")
    env = env_class(tmp_path, split="val_seen")
    for observation in play(env, right=False)[0]:
        assert env.observation_space.contains(observation)


def test_several_environments_step_together(folder: Path) -> None:
    envs = gym.make_vec("dorothie_gym/RfN-v0", 3, vectorization_mode="sync", corpus=folder, split="train")
    envs.reset(seed=0)
    _, rewards, *_ = envs.step(envs.action_space.sample())
    assert rewards.shape == (3,)
    envs.close()


def test_same_seed_draws_the_same_session() -> None:
    env = UfNEnv([session(talk(), name=name) for name in "abcdef"])
    assert env.reset(seed=5)[1]["session"] == env.reset(seed=5)[1]["session"]


def test_sessions_without_points_are_skipped() -> None:
    env = RfNEnv([session(talk()), session(utterance(30, Role.PARTICIPANT, 0, ("Okay", OKAY)), name="silent")])
    assert {env.reset(seed=seed)[1]["session"] for seed in range(10)} == {"one"}


def test_empty_corpus_raises_error(tmp_path: Path) -> None:
    with pytest.raises(SessionError, match="holds no session"):
        UfNEnv(tmp_path)
    with pytest.raises(SessionError, match="no such folder"):
        UfNEnv(tmp_path / "missing")
    with pytest.raises(SessionError, match="corpus is empty"):
        UfNEnv([])
    with pytest.raises(SessionError, match="none of the 1 sessions has a point of the task nfd"):
        NfDEnv([session(utterance(30, Role.PARTICIPANT, 0, ("Fuller", STREET)))]).reset()


def test_error_names_wrong_argument() -> None:
    with pytest.raises(ValueError, match="render_mode is 'human'"):
        UfNEnv([session(talk())], render_mode="human")
    with pytest.raises(ValueError, match="split is 'dev'; it must be one of all, train, val_seen"):
        UfNEnv([session(talk())], split="dev")
    with pytest.raises(ValueError, match="split is 'val', but sessions in memory lie in no fold"):
        UfNEnv([session(talk())], split="val")
    with pytest.raises(ValueError, match=r"2 landmarks; SpaceLimits.landmarks is 1"):
        UfNEnv([session(talk())], limits=SpaceLimits(landmarks=1)).reset()


def test_the_default_corpus_is_the_cached_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path / "cached", talk())
    corpus = types.ModuleType("dorothie_gym.evaluation.rollout.corpus_cache")
    corpus.default_corpus = lambda: tmp_path  # type: ignore[attr-defined]  # an attribute of an empty module
    monkeypatch.setitem(sys.modules, "dorothie_gym.evaluation.rollout.corpus_cache", corpus)
    assert UfNEnv().reset(seed=0)[1]["session"] == "cached"
    assert gym.make("dorothie_gym/UfN-v0", corpus="default").reset(seed=0)[1]["session"] == "cached"


def test_render_prints_dialogue_and_words_to_infer() -> None:
    env = UfNEnv([session(talk())], render_mode="ansi")
    env.reset(seed=0)
    env.step(env.action_space.sample())
    picture = env.render()
    assert picture is not None
    assert "To the KFC please. [Instruct(Landmark=KFC)]" in picture
    assert picture.splitlines()[-1].endswith("ufn? Yes, left on Fuller.")
    assert UfNEnv([session(talk())]).render() is None
