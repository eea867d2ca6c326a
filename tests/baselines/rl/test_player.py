from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("stable_baselines3", reason="needs the extra 'baselines'")
pytest.importorskip("sb3_contrib", reason="needs the extra 'baselines'")

from dorothie_gym.baselines.rl import EpisodeStatistics, Training, TrainingSettings, load_model
from dorothie_gym.baselines.rl.environments import make_env
from dorothie_gym.baselines.rl.evaluation import greedy_policy
from dorothie_gym.baselines.rl.run import TrainingEvaluation
from dorothie_gym.baselines.rl.training import best_of
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.errors import ModelFileError, SettingsError
from dorothie_gym.evaluation.closed_loop import RolloutSettings, parse_towns, roll_out
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.maps import load_town
from dorothie_gym.ontology import Role
from dorothie_gym.policies import ALL_SCRIPTED, find_player
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.recording import Session
from dorothie_gym.session.spaces import SpaceLimits
from dorothie_gym.session.spaces.flat import FlatActions


def train(folder: Path, algorithm: str = "ppo", **changes: Any) -> None:
    settings = TrainingSettings(
        **{
            "algorithm": algorithm,
            "env": "dorothie_gym/Navigation-v0",
            "steps": 64,
            "environments": 2,
            "evaluate_every": 64,
            "episodes": 1,
            "network": (8,),
            "env_settings": {"max_seconds": 10.0, "traffic": "none"},
            "parameters": {"n_steps": 16, "batch_size": 32, "n_epochs": 1},
            **changes,
        }
    )
    Training(settings, folder).run()


@pytest.mark.parametrize("algorithm", ["ppo", "maskable_ppo"])
def test_trained_model_plays_the_co_wizard(algorithm: str, tmp_path: Path) -> None:
    train(tmp_path / "run", algorithm)
    player = find_player(str(tmp_path / "run" / "best"), Role.CO_WIZARD)
    assert player.training["steps"] == 64 and player.training["seconds"] > 0.0
    settings = RolloutSettings(
        cast={**ALL_SCRIPTED, Role.CO_WIZARD: player},
        towns=parse_towns("brookside"),
        sessions=1,
        seed=2,
        config=EnvConfig(max_seconds=30.0),
    )
    first, second = (roll_out(settings, tmp_path / name, workers=1) for name in ("one", "two"))
    assert first.errored == 0 and first.rows[0].record == second.rows[0].record
    session = Session.load(next((tmp_path / "one").rglob("session.json")).parent)
    decisions = [decision.actions.get(Role.CO_WIZARD, {}) for decision in session.decisions or ()]
    assert any("physical" in decision for decision in decisions), "it drives"
    assert any("move" in decision for decision in decisions), "it talks"


def test_other_roles_and_damaged_models_are_refused(tmp_path: Path) -> None:
    limits = DuoWizardEnv("brookside").limits
    train(tmp_path)
    with pytest.raises(ValueError, match="only models trained in dorothie_gym/Participant-v0 can play the participant"):
        find_player(str(tmp_path), Role.PARTICIPANT).make(Role.PARTICIPANT, limits)
    description = json.loads((tmp_path / "model.json").read_text())
    assert description["kind"] == "dorothie_gym-rl"
    (tmp_path / "model.safetensors").write_bytes(b"nothing")
    with pytest.raises(ModelFileError, match="model.safetensors"):
        find_player(str(tmp_path), Role.CO_WIZARD).make(Role.CO_WIZARD, limits)


def test_model_of_another_environment_is_refused(tmp_path: Path) -> None:
    train(tmp_path, env="dorothie_gym/Participant-v0", env_settings={"max_cycles": 20})
    limits = DuoWizardEnv("brookside").limits
    for role in (Role.CO_WIZARD, Role.AD_WIZARD):
        with pytest.raises(SettingsError, match=f"was trained in dorothie_gym/Participant-v0; .*can play the {role}"):
            find_player(str(tmp_path), role).make(role, limits)
    larger = SpaceLimits(landmarks=limits.landmarks + 1)
    with pytest.raises(SettingsError, match="other sizes than those of the participant in this town"):
        find_player(str(tmp_path), Role.PARTICIPANT).make(Role.PARTICIPANT, larger)


ROLES = {"Participant-v0": Role.PARTICIPANT, "CoWizard-v0": Role.CO_WIZARD, "AdWizard-v0": Role.AD_WIZARD}


@pytest.mark.long
@pytest.mark.parametrize(("name", "role"), ROLES.items())
def test_model_of_a_role_plays_as_in_its_environment(name: str, role: Role, tmp_path: Path) -> None:
    train(tmp_path, "maskable_ppo", env=f"dorothie_gym/{name}", env_settings={"max_cycles": 20})
    model, settings = load_model(tmp_path)
    env = make_env(settings.env, settings.env_settings)
    policy = find_player(str(tmp_path), role).make(role, DuoWizardEnv("brookside").limits)
    act, state = greedy_policy(model, masked=True), policy.initial_state(0, load_town("brookside"))
    observation, info = env.reset(seed=4)
    for _ in range(20):
        seen = {**env.get_wrapper_attr("engine").observations.of((role,))[role], "action_mask": info["action_mask"]}
        chosen, state = policy.step(seen, state)
        (wanted,) = act(observation[None], env.get_wrapper_attr("action_masks")()[None])
        assert_same(chosen, env.get_wrapper_attr("unflatten")(wanted))
        observation, _, _, _, info = env.step(wanted)


def assert_same(one: Any, other: Any) -> None:
    assert one.keys() == other.keys()
    for name, value in one.items():
        np.testing.assert_array_equal(value, other[name], err_msg=name)


@pytest.mark.long
def test_partners_are_named_or_files_and_play_as_in_any_other_session(tmp_path: Path) -> None:
    train(tmp_path, "maskable_ppo")
    partners = {"participant": "scripted", "co_wizard": str(tmp_path)}
    config = EnvConfig(max_seconds=60.0)
    env = make_env("dorothie_gym/AdWizard-v0", {"town": "midtown", "config": config, "partners": partners})
    env.reset(seed=5)
    engine, resting, events, over = env.get_wrapper_attr("engine"), env.get_wrapper_attr("noop_action"), [], False
    flat = FlatActions(env.unwrapped.action_space).vector(resting)
    while not over:
        _, _, _, over, _ = env.step(flat)
        events.extend(engine.last_events)
    duo = DuoWizardEnv("midtown", config=config)
    names = {Role.PARTICIPANT: "scripted", Role.CO_WIZARD: str(tmp_path), Role.AD_WIZARD: "silent"}
    cast = {role: find_player(name, role).make(role, duo.limits) for role, name in names.items()}
    played: list[object] = []
    play_session(duo, cast, seed=5, on_step=lambda duo: played.extend(duo.last_events))
    assert len(events) > 5 and events == played


def test_a_model_is_played_without_the_partners_of_its_training(tmp_path: Path) -> None:
    partners = {"participant": "silent", "co_wizard": "silent"}
    train(tmp_path, env="dorothie_gym/AdWizard-v0", env_settings={"max_cycles": 20, "partners": partners})
    page = tmp_path / "model.json"
    page.write_text(page.read_text().replace('"silent"', '"no-such-file"'))
    find_player(str(tmp_path), Role.AD_WIZARD).make(Role.AD_WIZARD, DuoWizardEnv("brookside").limits)


def test_best_evaluation_of_an_ad_wizard_is_that_with_the_highest_reward() -> None:
    rows = [evaluation(steps=1, success=0.5, reward=1.0), evaluation(steps=2, success=0.0, reward=2.0)]
    found = {
        name: best_of(rows, TrainingSettings(algorithm="ppo", env=f"dorothie_gym/{name}"))
        for name in ("CoWizard-v0", "AdWizard-v0")
    }
    assert found == {"CoWizard-v0": rows[0], "AdWizard-v0": rows[1]}


def evaluation(*, steps: int, success: float, reward: float) -> TrainingEvaluation:
    outcome = EpisodeStatistics(success=success, low=0.0, high=1.0, reward=reward, length=9.0, episodes=2)
    return TrainingEvaluation(steps=steps, seconds=1.0, outcome=outcome)


def test_kinds_of_models_are_known_without_torch() -> None:
    script = (
        "import sys, dorothie_gym.baselines.loaders; from dorothie_gym.policies import loadable_kinds;"
        "sys.exit('torch' in sys.modules or 'dorothie_gym-rl' not in loadable_kinds())"
    )
    assert subprocess.run([sys.executable, "-c", script], timeout=120, check=False).returncode == 0
