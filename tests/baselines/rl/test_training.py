from __future__ import annotations

import json
import re
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("torch", reason="needs the extra 'baselines'")
pytest.importorskip("stable_baselines3", reason="needs the extra 'baselines'")
pytest.importorskip("sb3_contrib", reason="needs the extra 'baselines'")

import torch

from dorothie_gym.baselines.rl import ALGORITHMS, Training, TrainingSettings, load_model, tuned_settings
from dorothie_gym.baselines.rl import training as training_module
from dorothie_gym.baselines.rl.environments import make_training_env
from dorothie_gym.errors import ModelFileError, PolicyLoadError, SettingsError
from dorothie_gym.ontology import Role
from dorothie_gym.policies.policy_loader import find_player
from dorothie_gym.session.spaces import SpaceLimits

DISCRETE = "dorothie_gym/Navigation-v0"
CONTINUOUS = "dorothie_gym/Navigation-continuous-v0"
SMALL: dict[str, dict[str, Any]] = {
    "ppo": {"n_steps": 16, "batch_size": 32, "n_epochs": 1, "ent_coef": 0.01, "final_ent_coef": 0.002},
    "maskable_ppo": {"n_steps": 16, "batch_size": 32, "n_epochs": 1},
    "a2c": {"n_steps": 8},
    "dqn": {"learning_starts": 16, "buffer_size": 200, "batch_size": 8},
    "sac": {"learning_starts": 16, "buffer_size": 200, "batch_size": 8, "n_steps": 3},
}


def settings_for(algorithm: str, **changes: Any) -> TrainingSettings:
    env = CONTINUOUS if algorithm == "sac" else DISCRETE
    more = {"env_settings": {"max_seconds": 10.0, "traffic": "none"}}
    return TrainingSettings(
        **{
            "algorithm": algorithm, "env": env, "steps": 64, "environments": 2, "evaluate_every": 64, "episodes": 1,
            "network": (8,), "parameters": SMALL[algorithm], **more, **changes,
        }
    )  # fmt: skip


@pytest.mark.parametrize("algorithm", sorted(ALGORITHMS))
def test_saved_model_acts_like_the_trained_one(algorithm: str, tmp_path: Path) -> None:
    training = Training(settings_for(algorithm), tmp_path)
    run = training.run()
    assert run.finished and run.steps >= 64 and run.rows[-1].steps == run.steps
    model, settings = load_model(tmp_path)
    assert settings == training.settings and model.num_timesteps == run.steps
    observations = np.stack([model.observation_space.sample() for _ in range(20)])
    np.testing.assert_array_equal(
        model.predict(observations, deterministic=True)[0], training.model.predict(observations, deterministic=True)[0]
    )
    assert {"model.json", "model.safetensors", "progress.jsonl", "curve.png", "best"} <= {
        path.name for path in tmp_path.iterdir()
    }
    assert not list(tmp_path.rglob("*.zip")) and not list(tmp_path.rglob("*.pkl"))


@pytest.mark.parametrize("algorithm", ["maskable_ppo", "sac"])
def test_network_gets_its_inputs_in_two_scales(algorithm: str, tmp_path: Path) -> None:
    training = Training(settings_for(algorithm, fine_inputs=True), tmp_path)
    size = training.model.observation_space.shape[0]
    first = next(value for name, value in training.model.policy.named_parameters() if value.ndim == 2)
    assert first.shape[1] == 2 * size
    training.run()
    model, settings = load_model(tmp_path)
    assert settings.fine_inputs
    slow, standing = np.zeros((2, size), dtype=np.float32)
    slow[0] = 0.03
    inputs = model.policy.actor.features_extractor if algorithm == "sac" else model.policy.features_extractor
    difference = (inputs(torch.from_numpy(slow[None])) - inputs(torch.from_numpy(standing[None]))).abs().max()
    assert float(difference) == pytest.approx(0.3)


def test_weight_of_the_entropy_falls_to_its_last_value(tmp_path: Path) -> None:
    training = Training(settings_for("ppo"), tmp_path)
    assert training.model.ent_coef == 0.01
    training.run()
    assert training.model.ent_coef == pytest.approx(0.002)
    with pytest.raises(SettingsError, match="final_ent_coef"):
        settings_for("sac", parameters={**SMALL["sac"], "final_ent_coef": 0.0})
    with pytest.raises(SettingsError, match="final_ent_coef"):
        settings_for("ppo", parameters={"final_ent_coef": 0.0})
    with pytest.raises(SettingsError, match="final_ent_coef is 'low'"):
        settings_for("ppo", parameters={"ent_coef": 0.01, "final_ent_coef": "low"})


def test_rollouts_keep_their_size_with_other_numbers_of_environments() -> None:
    tuned = tuned_settings("ppo", DISCRETE)
    for environments in (1, 8, 512):
        changed = tuned_settings("ppo", DISCRETE, environments=environments)
        assert environments * changed.parameters["n_steps"] == tuned.environments * tuned.parameters["n_steps"]
    given = tuned_settings("ppo", DISCRETE, environments=8, parameters={"n_steps": 4, "batch_size": 8})
    assert given.parameters["n_steps"] == 4


def test_driver_of_several_towns(tmp_path: Path) -> None:
    towns = {"town": ["brookside", "northgate"], "max_seconds": 10.0, "traffic": "none"}
    run = Training(settings_for("maskable_ppo", env_settings=towns), tmp_path).run()
    assert run.rows[-1].outcome.episodes == 2  # one in each town
    model, settings = load_model(tmp_path)
    assert settings.env_settings == towns and model.observation_space.shape == (161,)
    with pytest.raises(SettingsError, match="several towns"):
        Training(settings_for("maskable_ppo", env_settings=towns, workers=2), tmp_path / "workers")
    with pytest.raises(SettingsError, match="town"):
        Training(settings_for("maskable_ppo", env_settings={"town": ["brookside", "nowhere"]}), tmp_path / "unknown")
    with pytest.raises(SettingsError, match="at least one town"):
        Training(settings_for("maskable_ppo", env_settings={"town": []}), tmp_path / "none")


def test_algorithm_that_cannot_choose_the_actions_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match=r"sac cannot choose actions of Discrete\(18\)"):
        Training(settings_for("sac", env=DISCRETE), tmp_path)
    with pytest.raises(SettingsError, match="batch_size"):
        Training(settings_for("ppo", parameters={"n_steps": 16, "batch_size": 1}), tmp_path)


def test_unknown_device_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="device 'abacus' cannot be used"):
        Training(settings_for("ppo"), tmp_path, device="abacus")


def test_network_on_a_gpu_is_saved_and_resumed(tmp_path: Path) -> None:
    if not torch.cuda.is_available():
        pytest.skip("needs a GPU")
    first = Training(settings_for("ppo"), tmp_path, device="cuda")
    assert first.model.device.type == "cuda"
    first.run()
    again = Training(settings_for("ppo", steps=128), tmp_path)
    observations = np.stack([again.model.observation_space.sample() for _ in range(20)])
    there, here = (
        each.model.policy.predict_values(each.model.policy.obs_to_tensor(observations)[0]) for each in (first, again)
    )
    np.testing.assert_allclose(there.detach().cpu(), here.detach(), atol=1e-5)
    assert again.run().steps >= 128


def test_resumed_run_keeps_weights_optimiser_and_evaluations(tmp_path: Path) -> None:
    first = Training(settings_for("ppo"), tmp_path)
    run = first.run()
    second = Training(settings_for("ppo", steps=128), tmp_path)
    for name, state in first.model.get_parameters().items():
        again = second.model.get_parameters()[name]
        if "param_groups" in state:
            for index, values in state["state"].items():
                for key, value in values.items():
                    np.testing.assert_array_equal(again["state"][index][key], value)
        else:
            for key, value in state.items():
                np.testing.assert_array_equal(again[key], value)
    more = second.run()
    assert more.steps >= 128 and more.rows[: len(run.rows)] == run.rows and len(more.rows) > len(run.rows)
    lines = (tmp_path / "progress.jsonl").read_text(encoding="utf-8").splitlines()
    assert [json.loads(line)["steps"] for line in lines] == [row.steps for row in more.rows]


@pytest.mark.parametrize(("algorithm", "loss"), [("ppo", "train/value_loss"), ("dqn", "train/loss")])
def test_tensorboard_logs_rewards_losses_and_success(
    algorithm: str, loss: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(training_module, "LOGGED_STEPS", 32)
    accumulator = pytest.importorskip("tensorboard.backend.event_processing.event_accumulator")
    Training(settings_for(algorithm, steps=128, env_settings={"max_seconds": 5.0, "traffic": "none"}), tmp_path).run()
    (folder,) = (tmp_path / "tensorboard").iterdir()
    events = accumulator.EventAccumulator(str(folder))
    events.Reload()
    wanted = {"rollout/ep_rew_mean", "rollout/ep_len_mean", "rollout/success_rate", "eval/success", "eval/length", loss}
    assert wanted <= set(events.Tags()["scalars"])


def test_finished_run_is_not_trained_again(tmp_path: Path) -> None:
    Training(settings_for("ppo"), tmp_path).run()
    again = Training(settings_for("ppo"), tmp_path).run()
    assert again.finished and again.steps == 64 and len(again.rows) == 1


def test_folder_with_another_run_is_refused(tmp_path: Path) -> None:
    Training(settings_for("ppo"), tmp_path).run()
    with pytest.raises(SettingsError, match="another seed"):
        Training(settings_for("ppo", seed=1), tmp_path)


@pytest.mark.long
def test_worker_processes_do_not_change_results() -> None:
    settings = settings_for("maskable_ppo", environments=3)
    here, there = (make_training_env(replace(settings, workers=workers)) for workers in (0, 2))
    rng, ended = np.random.default_rng(0), 0
    try:
        np.testing.assert_array_equal(here.reset(), there.reset())
        for _ in range(30):  # episodes of 20 decisions: each restarts
            masks = np.stack(here.env_method("action_masks"))
            np.testing.assert_array_equal(masks, np.stack(there.env_method("action_masks")))
            actions = np.array([rng.choice(np.flatnonzero(mask)) for mask in masks])
            one, two = here.step(actions), there.step(actions)
            for mine, theirs in zip(one[:3], two[:3], strict=True):
                np.testing.assert_array_equal(mine, theirs)
            for number in np.flatnonzero(one[2]).tolist():  # the native environment leaves other infos empty
                ended += 1
                assert one[3][number]["is_success"] is two[3][number]["is_success"]
                assert one[3][number]["TimeLimit.truncated"] == two[3][number]["TimeLimit.truncated"]
        assert ended
        assert there.has_attr("action_masks") and not there.has_attr("no_such")
        assert there.env_method("action_masks", indices=[2])[0].shape == (18,)
        with pytest.raises(RuntimeError, match=r"0\.\.17"):
            there.step(np.array([0, 0, 40]))
    finally:
        here.close()
        there.close()


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"algorithm": "trpo"}, "algorithm"),
        ({"steps": 0}, "steps"),
        ({"workers": 9}, "workers"),
        ({"seed": -1}, "seed"),
        ({"episodes": 0}, "episodes"),
    ],
)
def test_invalid_settings_are_named(changes: dict[str, Any], named: str) -> None:
    with pytest.raises(SettingsError, match=named):
        replace(settings_for("ppo"), **changes)


def test_untrainable_settings_are_reported(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="sac on dorothie_gym/Navigation-v0"):
        Training(replace(settings_for("sac"), env=DISCRETE), tmp_path)
    with pytest.raises(SettingsError, match="guidance"):
        Training(settings_for("ppo", env_settings={"guidance": "stars"}), tmp_path)
    with pytest.raises(SettingsError, match="no_such"):
        Training(settings_for("ppo", parameters={"no_such": 1}), tmp_path)


@pytest.mark.parametrize("algorithm", sorted(ALGORITHMS))
def test_tuned_settings_survive_json(algorithm: str) -> None:
    settings = tuned_settings(algorithm, DISCRETE, steps=7, episodes=None)
    assert settings.steps == 7 and settings.parameters and settings.network
    assert TrainingSettings(**json.loads(json.dumps(settings.as_json()))) == settings


def test_damaged_models_are_reported(tmp_path: Path) -> None:
    with pytest.raises(ModelFileError, match=r"model\.json: does not exist"):
        load_model(tmp_path)
    Training(settings_for("ppo"), tmp_path).run()
    (tmp_path / "model.safetensors").write_bytes(b"nothing")
    with pytest.raises(ModelFileError, match="model.safetensors"):
        load_model(tmp_path)
    (tmp_path / "model.json").write_text("{", encoding="utf-8")
    with pytest.raises(ModelFileError, match=r"model\.json, column 2"):
        load_model(tmp_path)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("env", "stranger_probe:Navigation-v0"),
        ("env", "CartPole-v1"),
        ("env", "dorothie_gym/Town-v0"),
        ("algorithm", "stranger_probe.PPO"),
        ("algorithm", "os"),
    ],
)
def test_model_of_a_stranger_imports_nothing_and_is_refused(
    field: str, value: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Training(settings_for("ppo"), tmp_path / "model").run()
    page = json.loads((tmp_path / "model" / "model.json").read_text(encoding="utf-8"))
    page["settings"][field] = value
    (tmp_path / "model" / "model.json").write_text(json.dumps(page), encoding="utf-8")
    (tmp_path / "stranger_probe.py").write_text("raise SystemExit('the code of a stranger runs')", encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises((ModelFileError, SettingsError), match=re.escape(value)):
        load_model(tmp_path / "model")
    with pytest.raises((ModelFileError, SettingsError, PolicyLoadError), match=re.escape(value)):
        find_player(str(tmp_path / "model"), Role.CO_WIZARD).make(Role.CO_WIZARD, SpaceLimits())
    assert "stranger_probe" not in sys.modules


@pytest.mark.parametrize("name", ["CoWizard", "Participant"])
def test_other_roles_can_be_trained(name: str, tmp_path: Path) -> None:
    settings = settings_for(
        "ppo",
        env=f"dorothie_gym/{name}-v0",
        env_settings={"max_cycles": 20},
        environments=1,
        steps=16,
        parameters={"n_steps": 16, "batch_size": 16, "n_epochs": 1},
    )
    assert Training(settings, tmp_path).run().finished
