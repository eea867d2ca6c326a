from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

pytest.importorskip("stable_baselines3", reason="needs the extra 'baselines'")

from dorothie_gym.cli.app import app

SHORT = ["--set", "max_seconds=5", "--set", "traffic=none", "--episodes", "1", "--environments", "1", "--workers", "0"]

AD_WIZARD = ["maskable_ppo", "--env", "dorothie_gym/AdWizard-v0", "--set"]


def test_training_prints_its_result_as_json(tmp_path: Path) -> None:
    out = tmp_path / "run"
    result = CliRunner().invoke(app, ["train-rl", "a2c", "--out", str(out), "--steps", "32", *SHORT, "--json"])
    assert result.exit_code == 0, result.output
    facts = json.loads(result.stdout)
    assert facts["finished"] and facts["steps"] >= 32 and facts["settings"]["algorithm"] == "a2c"
    assert facts["settings"]["env_settings"] == {"max_seconds": 5, "traffic": "none"}
    assert facts["best"]["steps"] == facts["evaluations"][-1]["steps"]
    assert (out / "best" / "model.json").is_file()
    again = CliRunner().invoke(app, ["train-rl", "a2c", "--out", str(out), "--steps", "32", *SHORT])
    assert again.exit_code == 0 and "curve.png" in again.stdout


@pytest.mark.long
def test_an_ad_wizard_is_trained_against_given_partners_and_plays_in_rollouts(tmp_path: Path) -> None:
    out, env = tmp_path / "run", "dorothie_gym/AdWizard-v0"
    options = ["--steps", "64", "--environments", "1", "--workers", "0", "--episodes", "1", "--set", "max_cycles=20"]
    partners = 'partners={co_wizard: "pretrained:maskable-ppo", participant: silent}'
    words = ["train-rl", "maskable_ppo", "--env", env, "--out", str(out), *options, "--set", partners]
    result = CliRunner().invoke(app, [*words, "--json"])
    assert result.exit_code == 0, result.output
    settings = json.loads(result.stdout)["settings"]["env_settings"]
    assert settings["partners"] == {"co_wizard": "pretrained:maskable-ppo", "participant": "silent"}
    sessions = ["--sessions", "1", "--towns", "brookside", "--max-seconds", "20", "--workers", "1", "--json"]
    played = CliRunner().invoke(app, ["rollout", "--ad-wizard", str(out), *sessions])
    assert played.exit_code == 0, played.output
    assert json.loads(played.stdout)["errored"] == 0


def test_ctrl_c_while_a_corpus_is_read_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*arguments: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("dorothie_gym.baselines.rl.behaviour_cloning.replayable_sessions", interrupted)
    result = CliRunner().invoke(
        app, ["train-rl", "ppo", "--out", str(tmp_path), "--warm-start", str(tmp_path), "--workers", "0"]
    )
    assert result.exit_code == 130 and "before the first step" in result.stderr


@pytest.mark.long
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["trpo"], "algorithm is 'trpo'"),
        (["ppo", "--set", "guidance"], "NAME=VALUE"),
        (["ppo", "--set", "guidance=stars"], "guidance is 'stars'"),
        (["ppo", "--set", "guidance=stars", "--workers", "1"], "guidance is 'stars'"),
        (["ppo", "--env", "dorothie_gym/Nope-v0", "--workers", "1"], "Nope"),
        (["ppo", "--env", "dorothie_gym/NoSuch-v0"], "dorothie_gym/NoSuch-v0"),
        (["sac", "--env", "dorothie_gym/Navigation-v0"], "sac on dorothie_gym/Navigation-v0"),
        (["selfplay"], "algorithm is 'selfplay'"),
        ([*AD_WIZARD, "partners={co_wizard: scriptd}"], "co_wizard: there is no policy 'scriptd', nor a file"),
        ([*AD_WIZARD, "partners={ad_wizard: scripted}"], "partners has 'ad_wizard'"),
        ([*AD_WIZARD, "partners={participant: 'pretrained:co-wizard'}"], "participant: there is no policy"),
        (["ppo", "--environments", "1", "--workers", "2"], "workers is 2"),
        (["dqn", "--warm-start", "corpus"], "warm_start: dqn"),
        (["ppo", "--warm-start", "no-such-corpus"], "no-such-corpus"),
    ],
)
def test_invalid_arguments_are_reported(arguments: list[str], message: str, tmp_path: Path) -> None:
    result = CliRunner().invoke(
        app,
        [
            "train-rl",
            *arguments,
            *(["--workers", "0"] if "--workers" not in arguments else []),
            "--out",
            str(tmp_path / "run"),
        ],
    )
    assert result.exit_code == 2
    assert message in " ".join(result.stderr.split())
    assert "Traceback" not in result.output
