"""Submissions to the leaderboard: honest rollouts pass, others do not; `test_tampering` has the ways of cheating."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from dorothie_gym.cli.app import app
from dorothie_gym.errors import RolloutError
from dorothie_gym.evaluation.closed_loop import RolloutSettings, protocol, read_result, roll_out
from dorothie_gym.evaluation.closed_loop.protocol import LeaderboardProtocol
from dorothie_gym.evaluation.closed_loop.submission import (
    SubmissionCheck,
    check_submission,
    differences_from,
)
from dorothie_gym.evaluation.rollout.play import with_personas
from dorothie_gym.maps import load_town
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies import ALL_SCRIPTED, Player, find_player
from dorothie_gym.policies.decision_random import policy_seed
from dorothie_gym.policies.policy import policy_inputs
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.recorder import SessionRecorder
from dorothie_gym.session.recording import Session, SessionWriter
from dorothie_gym.session.session_batch import SessionBatch
from dorothie_gym.session.spaces import SpaceLimits
from tests.evaluation.closed_loop.players import load_fainting, load_forgetful
from tests.evaluation.closed_loop.rollout_edits import (
    CONFIG,
    PROTOCOL,
    add_usage,
    edit,
    edit_settings,
    sessions_of,
    settings,
)

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def honest(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("submission") / "honest"
    roll_out(settings(), folder)
    return folder


@pytest.fixture
def copy(honest: Path, tmp_path: Path) -> Path:
    shutil.copytree(honest, tmp_path / "rollout")
    return tmp_path / "rollout"


def own_policy(folder: Path) -> Player:
    """A Co-Wizard from a file, which the package does not have."""
    file = folder / "player.forgetful"
    file.write_text("forgetful")
    return Player(
        name="own/player.forgetful",
        path=file,
        loader=load_forgetful,
        sha256="a" * 64,
        training={"steps": 1000, "seconds": 5.0},
    )


def cast_with(co_wizard: Player) -> dict[Role, Player]:
    return {**ALL_SCRIPTED, Role.CO_WIZARD: co_wizard}


def faults(folder: Path, protocol: LeaderboardProtocol = PROTOCOL, sample: int | None = None) -> str:
    found = check_submission(folder, sample=sample, protocol=protocol)
    assert (found.submission is None) == bool(found.faults)
    return "\n".join(found.faults)


def test_honest_rollout_has_no_fault(honest: Path) -> None:
    found = check_submission(honest, sample=2, protocol=PROTOCOL)
    assert found.faults == ()
    assert len(found.resimulated) == 2
    assert found.submission is not None
    page: Any = json.loads(json.dumps(found.submission))
    assert [len(row["sha256"]) for row in page["sessions"]] == [64] * 3
    assert page["part"] == "development" and page["results"]["sessions"] == 3
    assert found.seed is not None
    assert page["check"] == {
        "resimulated": list(found.resimulated),
        "share": 2 / 3,
        "seed": found.seed,
        "co_wizard_played": True,
        "claims": ["run time"],
    }
    assert check_submission(honest, sample=2, seed=found.seed, protocol=PROTOCOL) == found
    others = {check_submission(honest, sample=1, seed=seed, protocol=PROTOCOL).resimulated for seed in range(8)}
    assert len(others) > 1


def test_missing_session_is_found(copy: Path) -> None:
    shutil.rmtree(sessions_of(copy)[2])
    assert "session 2" in faults(copy) and "holds no finished session" in faults(copy)
    edit(copy / "rollout.json", lambda page: page["rows"].pop())
    assert "session 2" in faults(copy) and "has no row" in faults(copy)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"seed": 1}, "seed is 1; that of the protocol is 0"),
        ({"towns": ("brookside", "millbrook")}, "towns are brookside, millbrook; the protocol has"),
        ({"towns": ("millbrook",)}, "towns are millbrook; the protocol has"),
        ({"sessions": 2}, "2 sessions; the protocol has 3"),
        ({"sessions": 4}, "4 sessions; the protocol has 3"),
        ({"config": EnvConfig(max_seconds=15.0, word_error_rate=0.0)}, "config, word_error_rate is 0.0"),
        ({"cast": {**ALL_SCRIPTED, Role.AD_WIZARD: Player(name="silent")}}, "ad_wizard is silent"),
    ],
)
def test_rollout_of_another_protocol_is_found(tmp_path: Path, changes: dict[str, Any], message: str) -> None:
    roll_out(settings(**{"sessions": 3, **changes}), tmp_path / "other")
    assert message in faults(tmp_path / "other")


def test_settings_that_were_changed_afterwards_are_found(tmp_path: Path) -> None:
    roll_out(settings(seed=1), tmp_path / "other")
    for name in ("rollout.json", "settings.json"):
        edit(tmp_path / "other" / name, lambda page: page.get("settings", page).update(seed=0))
    assert "its row is of brookside, seed" in faults(tmp_path / "other")


def test_submission_file_is_compared_with_the_folder(honest: Path, tmp_path: Path) -> None:
    made = check_submission(honest, sample=1, protocol=PROTOCOL).submission
    assert made is not None
    file = tmp_path / "submission.json"
    file.write_text(json.dumps(made))
    assert differences_from(file, made) == ()
    edit(file, lambda page: page["results"]["success"].update(mean=1.0))
    found = differences_from(file, made)
    assert "does not have its hash" in found[0] and "'results' is not that of the folder" in found[1]
    (tmp_path / "other.json").write_text("{}")
    with pytest.raises(RolloutError, match="is no submission"):
        differences_from(tmp_path / "other.json", made)


def test_command_writes_and_checks_a_submission(honest: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(protocol, "PROTOCOL", PROTOCOL)
    monkeypatch.setenv("COLUMNS", "200")
    file = tmp_path / "submission.json"

    def call(*arguments: object) -> Any:
        return CliRunner().invoke(app, ["submit", *map(str, arguments)])

    done = call(honest, "--out", file, "--sample", 1, "--workers", 1)
    assert done.exit_code == 0, done.output
    assert "1 sessions simulated again; no fault" in done.stdout
    assert "Simulated: 1 of 3 sessions, drawn with seed" in done.stdout and "by its own policy" in done.stdout
    assert "Claimed, not checked: run time" in done.stdout
    assert call(honest, "--check", file, "--workers", 1).exit_code == 0
    edit(file, lambda page: page.update(part="seen"))
    wrong = call(honest, "--check", file, "--json", "--sample", 1, "--workers", 1)
    assert wrong.exit_code == 1
    page = json.loads(wrong.stdout)
    assert len(page["faults"]) == 2 and page["claims"] == ["run time"] and page["sessions"] == 3
    for arguments in (("--sample", "none"), ("--sample", "0")):
        assert "give a number of sessions, or all" in call(honest, *arguments).stderr
    assert "does not exist" in call(tmp_path / "nowhere").stderr


# --- Honest rollouts of all kinds -------------------------------------------------------------------------------------


def accepted(folder: Path, config: EnvConfig = CONFIG, **options: Any) -> SubmissionCheck:
    """The check of a rollout, which must have no fault."""
    found = check_submission(folder, protocol=LeaderboardProtocol(sessions=3, config=config), **options)
    assert found.faults == () and found.submission is not None
    return found


def test_policy_of_a_file_with_state_and_persona_is_accepted_with_claims(tmp_path: Path) -> None:
    roll_out(settings(cast=cast_with(own_policy(tmp_path))), tmp_path / "own")
    found = accepted(tmp_path / "own")
    assert not found.played and found.resimulated == (0, 1, 2)
    assert found.claims == ("name", "weights", "persona", "training cost", "run time")


def test_what_nobody_can_check_may_be_edited_and_is_claimed(tmp_path: Path) -> None:
    folder = tmp_path / "own"
    roll_out(settings(cast=cast_with(own_policy(tmp_path))), folder)
    edit_settings(
        folder,
        lambda page: page.update(
            co_wizard="best/model", sha256={"co_wizard": "b" * 64}, training={"co_wizard": {"steps": 1}}
        ),
    )
    (folder / "rollout.json").write_text(json.dumps(read_result(folder).to_json()))
    edit(folder / "cost.json", lambda page: page.update(cpu_seconds=0.1))
    for path in sessions_of(folder):
        edit(path / "session.json", lambda page: page["personas"].update(co_wizard={"patience": 1.0}))
    assert set(accepted(folder).claims) >= {"name", "weights", "persona", "training cost", "run time"}


def test_usage_of_a_language_model_is_accepted_as_a_claim(tmp_path: Path) -> None:
    folder = tmp_path / "own"
    roll_out(settings(cast=cast_with(own_policy(tmp_path))), folder)
    add_usage(folder)
    assert "usage" in accepted(folder).claims


def test_session_that_ended_in_an_error_is_refused_whatever_the_reason(tmp_path: Path) -> None:
    file = tmp_path / "player.faint"
    file.write_text("faint")
    player = Player(name="own/faint", path=file, loader=load_fainting)
    result = roll_out(settings(cast=cast_with(player)), tmp_path / "out")
    found = check_submission(tmp_path / "out", protocol=PROTOCOL)
    assert result.errored == len(found.faults) > 0
    assert all(
        "ended in an error (RuntimeError: I feel faint); a submission has complete" in each for each in found.faults
    )


@pytest.mark.parametrize("name", ["silent", "scripted:patience=0.2..0.4", "random"])
def test_policies_by_name_are_played_again(name: str, tmp_path: Path) -> None:
    roll_out(settings(cast=cast_with(find_player(name, Role.CO_WIZARD))), tmp_path / "out")
    assert accepted(tmp_path / "out").played


@pytest.mark.long
@pytest.mark.parametrize("name", ["pretrained:maskable-ppo", "pretrained:co-wizard", "pretrained:reader"])
def test_shipped_models_are_played_again(name: str, tmp_path: Path) -> None:
    pytest.importorskip("sb3_contrib", reason="needs the extra 'baselines'")
    roll_out(settings(cast=cast_with(find_player(name, Role.CO_WIZARD))), tmp_path / "out")
    found = accepted(tmp_path / "out")
    assert found.played and found.claims == ("training cost", "run time")
    file = next(path / "actions.jsonl" for path in sessions_of(tmp_path / "out"))
    file.write_text(file.read_text().replace('"co_wizard"', '"participant"', 1))
    assert check_submission(tmp_path / "out", protocol=PROTOCOL).faults


def test_name_of_a_model_that_cannot_be_played_here_is_a_claim(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from dorothie_gym.policies import policy_loader

    player = find_player("pretrained:ppo", Role.CO_WIZARD)
    roll_out(settings(cast=cast_with(own_policy(tmp_path))), tmp_path / "out")
    edit_settings(
        tmp_path / "out",
        lambda page: page.update(
            co_wizard=player.name, sha256={"co_wizard": player.sha256}, training={"co_wizard": dict(player.training)}
        ),
    )
    (tmp_path / "out" / "rollout.json").write_text(json.dumps(read_result(tmp_path / "out").to_json()))

    def missing(path: Path, role: Role, limits: SpaceLimits) -> Any:
        raise ModuleNotFoundError("No module named 'torch'", name="torch")

    monkeypatch.setattr(policy_loader, "_loader_of", lambda kind: missing)
    found = accepted(tmp_path / "out")
    assert not found.played and {"name", "weights"} <= set(found.claims)


@pytest.mark.long
def test_whole_sessions_that_arrive_are_accepted(tmp_path: Path) -> None:
    config = EnvConfig()
    result = roll_out(settings(cast=ALL_SCRIPTED, config=config), tmp_path / "out")
    assert result.figures()["success"].mean == 1.0
    assert accepted(tmp_path / "out", config).played


@pytest.mark.long
def test_rollouts_and_checks_of_several_processes_are_alike(honest: Path, tmp_path: Path) -> None:
    roll_out(settings(), tmp_path / "two", workers=2)
    reports: list[tuple[int, int]] = []
    found = accepted(tmp_path / "two", workers=2, on_session=lambda done, total: reports.append((done, total)))
    assert reports == [(k, 3) for k in range(4)]
    one = accepted(honest)
    assert found.submission is not None and one.submission is not None
    assert found.submission["sessions"] == one.submission["sessions"]
    sessions = [json.loads((path / "session.json").read_text()) for path in sessions_of(tmp_path / "two")]
    assert [page["seed"] for page in sessions] == [plan.seed for plan in settings().plans()]
    edit(sessions_of(tmp_path / "two")[1] / "session.json", lambda page: page.update(story="another one"))
    edit(sessions_of(tmp_path / "two")[0] / "session.json", lambda page: page.update(story="another one"))
    faults_of_two = check_submission(tmp_path / "two", protocol=PROTOCOL, workers=2).faults
    assert [fault[:9] for fault in faults_of_two] == ["session 0", "session 1"]


@pytest.mark.long
def test_rollout_that_was_killed_and_resumed_is_accepted(tmp_path: Path) -> None:
    folder, config = tmp_path / "killed", EnvConfig(max_seconds=600.0)
    arguments = ["rollout", "--co-wizard", "lane-follow", "--towns", "brookside", "--sessions", "3", "--workers", "1"]
    process = subprocess.Popen(
        [sys.executable, "-m", "dorothie_gym.cli", *arguments, "--max-seconds", "600", "--out", str(folder)],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        start_new_session=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    while process.poll() is None and not any(folder.glob(".parts/*/*.journal")):
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    assert not (folder / "rollout.json").exists()
    roll_out(settings(config=config), folder)
    accepted(folder, config)


def test_sessions_that_were_played_in_a_batch_are_accepted(honest: Path, tmp_path: Path) -> None:
    made = settings(cast=cast_with(own_policy(tmp_path)))
    folder = tmp_path / "batch"
    roll_out(made, folder)
    for path in sessions_of(folder):
        shutil.rmtree(path)
    play_in_a_batch(made, folder)
    assert accepted(folder).resimulated == (0, 1, 2)


def play_in_a_batch(made: RolloutSettings, folder: Path) -> None:
    """Plays the sessions of a rollout side by side, and records them."""
    town, plans = load_town("brookside"), made.plans()
    limits = SpaceLimits.for_town(town)
    batch = SessionBatch(
        town, None, config=made.config, max_cycles=None, limits=limits, numbers=range(len(plans)), threads=2
    )
    policies = {role: made.cast[role].make(role, limits) for role in AGENT_ROLES}
    states, writers, recorders = [], [], []
    for row, plan in enumerate(plans):
        batch.begin(row, plan.seed, None)
        own = {role: policies[role].initial_state(policy_seed(plan.seed, role), town) for role in AGENT_ROLES}
        header = with_personas(batch.engines[row].session_header(), policies, own)
        states.append(own)
        writers.append(SessionWriter(folder / plan.path, header))
        recorders.append(SessionRecorder(batch.engines[row], writers[-1]))
    batch.observe()
    while rows := [row for row, engine in enumerate(batch.engines) if not engine.over]:
        actions: dict[int, dict[str, Any]] = {row: {} for row in rows}
        for row in rows:
            inputs = policy_inputs(batch.engines[row], policies)
            for role in AGENT_ROLES:
                actions[row][str(role)], states[row][role] = policies[role].step(inputs[role], states[row][role])
        batch.step(batch.decode(actions))
        batch.observe()
        for row in rows:
            recorders[row].record(actions[row])
    for row, writer in enumerate(writers):
        writer.finish(batch.engines[row].summary())
    batch.close()
    assert all(Session.load(folder / plan.path).complete for plan in plans)
