"""Drivers that learn from pictures."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

pytest.importorskip("torch", reason="needs the extra 'baselines'")
pytest.importorskip("stable_baselines3", reason="needs the extra 'baselines'")
pytest.importorskip("sb3_contrib", reason="needs the extra 'baselines'")

import torch
from typer.testing import CliRunner

from dorothie_gym.baselines.rl import Training, TrainingSettings, load_model, tuned_settings
from dorothie_gym.baselines.rl.picture_features import STREET, PictureFeatures
from dorothie_gym.cli.app import app
from dorothie_gym.errors import PolicyLoadError, SettingsError
from dorothie_gym.ontology import Role
from dorothie_gym.policies.policy_loader import find_player
from dorothie_gym.session.spaces import SpaceLimits

NAVIGATION, CONTINUOUS = "dorothie_gym/Navigation-v0", "dorothie_gym/Navigation-continuous-v0"


def settings_for(algorithm: str, **changes: Any) -> TrainingSettings:
    given = {
        "env": NAVIGATION, "steps": 128, "environments": 2, "evaluate_every": 128, "episodes": 1, "network": (8,),
        "channels": (4, 4, 4), "parameters": {"n_steps": 32, "batch_size": 32, "n_epochs": 1},
        "env_settings": {"observation": "camera", "max_seconds": 10.0, "traffic": "none"}, **changes,
    }  # fmt: skip
    return TrainingSettings(algorithm=algorithm, **given)


@pytest.mark.long
@pytest.mark.parametrize(("algorithm", "env"), [("maskable_ppo", NAVIGATION), ("ppo", CONTINUOUS)])
def test_saved_model_acts_by_pictures(algorithm: str, env: str, tmp_path: Path) -> None:
    training = Training(settings_for(algorithm, env=env, steps=256), tmp_path)
    run = training.run()
    assert run.finished and run.steps == 256 and run.rows[-1].outcome.episodes == 1
    model, settings = load_model(tmp_path)
    assert settings == training.settings and settings.sees
    single = gym.make(env, observation="camera")
    picture, _ = single.reset(seed=0)
    action, _ = model.predict(picture, deterministic=True)
    np.testing.assert_array_equal(action, training.model.predict(picture, deterministic=True)[0])
    picture, *_ = single.step(action)
    assert picture.shape == (84, 84, 3)


@pytest.mark.long
def test_resumed_run_ends_like_an_undisturbed_one(tmp_path: Path) -> None:
    Training(settings_for("ppo"), tmp_path / "resumed").run()
    resumed = Training(settings_for("ppo", steps=256), tmp_path / "resumed")
    resumed.run()
    undisturbed = Training(settings_for("ppo", steps=256), tmp_path / "undisturbed")
    undisturbed.run()
    one, other = (each.model.policy.state_dict() for each in (resumed, undisturbed))
    for name in one:  # to the last bits: products of matrices round differently on some AMD processors
        torch.testing.assert_close(one[name], other[name], rtol=1e-5, atol=1e-7)


def test_street_and_dashboard_move_features_and_the_width_is_as_asked() -> None:
    space = gym.spaces.Box(0, 255, (3, 84, 84), np.uint8)
    features = PictureFeatures(space, (4, 6, 8))
    dark, sky, lamp = torch.zeros(3, 1, 3, 84, 84)
    sky[..., :40, :], lamp[..., 80, :] = 1.0, 1.0
    seen = [features(picture)[0] for picture in (dark, sky, lamp)]
    assert seen[0].shape == (features.features_dim,)
    changed = [(each != seen[0]).nonzero().flatten() for each in seen[1:]]
    assert len(changed[0]) and changed[0].max() < STREET  # the dashboard is dark in both
    assert len(changed[1]) and changed[1].max() >= STREET
    assert [layer.out_channels for layer in features.modules() if isinstance(layer, torch.nn.Conv2d)] == [4, 6, 8]


@pytest.mark.parametrize("algorithm", ["ppo", "maskable_ppo", "a2c"])
def test_pictures_have_tuned_settings_of_their_own(algorithm: str) -> None:
    vectors = tuned_settings(algorithm, NAVIGATION)
    pictures = tuned_settings(algorithm, NAVIGATION, env_settings={"observation": "camera", "town": "midtown"})
    assert pictures.env_settings["town"] == "midtown"
    assert (pictures.sees, vectors.sees) == (True, False)
    assert pictures.environments <= 16 < 256
    assert TrainingSettings(**json.loads(json.dumps(pictures.as_json()))) == pictures


@pytest.mark.parametrize(
    ("algorithm", "changes", "message"),
    [
        ("dqn", {"parameters": {}}, "dqn would keep gigabytes of pictures"),
        ("ppo", {"warm_start": "corpus"}, "warm_start"),
        ("ppo", {"fine_inputs": True}, "fine_inputs"),
        ("ppo", {"channels": (0, 4, 4)}, "channels"),
        ("ppo", {"channels": (4, 4)}, "channels"),
    ],
)
def test_settings_that_do_not_go_with_pictures_are_refused(
    algorithm: str, changes: dict[str, Any], message: str
) -> None:
    with pytest.raises(SettingsError, match=message):
        settings_for(algorithm, **changes)


def test_unknown_observation_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="observation is 'radar'; it must be one of vector, camera"):
        Training(replace(settings_for("ppo"), env_settings={"observation": "radar"}), tmp_path)


def test_model_of_pictures_does_not_play_the_co_wizard(tmp_path: Path) -> None:
    Training(settings_for("ppo"), tmp_path).run()
    with pytest.raises((SettingsError, PolicyLoadError), match="was trained on pictures"):
        find_player(str(tmp_path), Role.CO_WIZARD).make(Role.CO_WIZARD, SpaceLimits())


def test_command_trains_on_pictures(tmp_path: Path) -> None:
    short = ["--environments", "16", "--steps", "64", "--episodes", "1", "--set", "max_seconds=5", "--json"]
    result = CliRunner().invoke(
        app, ["train-rl", "a2c", "--observation", "camera", "--out", str(tmp_path / "run"), *short]
    )
    assert result.exit_code == 0, result.output
    facts = json.loads(result.stdout)
    assert facts["finished"]
    assert facts["settings"]["env_settings"] == {"max_seconds": 5, "observation": "camera"}
