"""Submissions to the leaderboard: honest rollouts pass, and each kind of tampering is found."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from dorothie_gym.cli.app import app
from dorothie_gym.engine.config import EnvConfig
from dorothie_gym.errors import RolloutError
from dorothie_gym.ontology import Role
from dorothie_gym.policies import ALL_SCRIPTED, Player
from dorothie_gym.rollout.closed_loop import RolloutSettings, roll_out, submission
from dorothie_gym.rollout.closed_loop.submission import LeaderboardProtocol, check_submission, differences_from

CONFIG = EnvConfig(max_seconds=15.0)
PROTOCOL = LeaderboardProtocol(sessions=3, config=CONFIG)


def settings(**changes: Any) -> RolloutSettings:
    cast = {**ALL_SCRIPTED, Role.CO_WIZARD: Player(name="lane-follow")}
    return RolloutSettings(**{"cast": cast, "towns": ("brookside",), "sessions": 3, "config": CONFIG, **changes})


@pytest.fixture(scope="module")
def honest(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("submission") / "honest"
    roll_out(settings(), folder)
    return folder


@pytest.fixture
def copy(honest: Path, tmp_path: Path) -> Path:
    shutil.copytree(honest, tmp_path / "rollout")
    return tmp_path / "rollout"


def faults(folder: Path, protocol: LeaderboardProtocol = PROTOCOL, sample: int | None = None) -> str:
    found = check_submission(folder, sample=sample, protocol=protocol)
    assert (found.submission is None) == bool(found.faults)
    return "\n".join(found.faults)


def edit(file: Path, change: Callable[[Any], None]) -> None:
    page = json.loads(file.read_text())
    change(page)
    file.write_text(json.dumps(page))


def sessions_of(folder: Path) -> list[Path]:
    return sorted((folder / "sessions").iterdir())


def test_honest_rollout_has_no_fault(honest: Path) -> None:
    found = check_submission(honest, sample=2, protocol=PROTOCOL)
    assert found.faults == ()
    assert len(found.resimulated) == 2
    assert found.submission is not None
    page: Any = json.loads(json.dumps(found.submission))
    assert [len(row["sha256"]) for row in page["sessions"]] == [64] * 3
    assert page["part"] == "unseen" and page["results"]["sessions"] == 3
    assert check_submission(honest, sample=2, protocol=PROTOCOL) == found
    others = {check_submission(honest, sample=1, seed=seed, protocol=PROTOCOL).resimulated for seed in range(8)}
    assert len(others) > 1


def test_changed_metric_of_a_session_is_found(copy: Path) -> None:
    edit(copy / "rollout.json", lambda page: page["rows"][1]["record"].update(success=True))
    assert "session 1 (brookside" in faults(copy) and "success is True; the session has False" in faults(copy)


def test_changed_metric_of_the_table_is_found(copy: Path) -> None:
    edit(copy / "rollout.json", lambda page: page["success"].update(mean=1.0))
    assert faults(copy) == "rollout.json: its tables are not those of its rows"


def test_changed_action_is_found(copy: Path) -> None:
    file = next(path for folder in sessions_of(copy) for path in folder.glob("actions.jsonl") if path.stat().st_size)
    lines = file.read_text().splitlines()
    kept = [line for line in lines if '"co_wizard"' not in line] if '"co_wizard"' in "".join(lines) else lines[1:]
    file.write_text("".join(f"{line}\n" for line in kept))
    assert "simulated again, it differs at frame" in faults(copy)


def test_changed_frames_are_found(copy: Path) -> None:
    first, second = (folder / "frames.parquet" for folder in sessions_of(copy)[:2])
    shutil.copyfile(second, first)
    assert "session 0" in faults(copy)


def test_missing_session_is_found(copy: Path) -> None:
    shutil.rmtree(sessions_of(copy)[2])
    assert "session 2" in faults(copy) and "holds no finished session" in faults(copy)
    edit(copy / "rollout.json", lambda page: page["rows"].pop())
    assert "session 2" in faults(copy) and "has no row" in faults(copy)


def test_swapped_sessions_are_found(copy: Path) -> None:
    first, second, _ = sessions_of(copy)
    first.rename(copy / "kept")
    second.rename(first)
    (copy / "kept").rename(second)
    assert "session 0" in faults(copy) and "the session is of brookside, seed" in faults(copy)


def test_session_in_place_of_another_is_found_although_its_header_was_changed(copy: Path) -> None:
    first, second, _ = sessions_of(copy)
    seed = json.loads((first / "session.json").read_text())["seed"]
    shutil.rmtree(first)
    shutil.copytree(second, first)
    edit(first / "session.json", lambda page: page.update(seed=seed))
    found = faults(copy)
    assert "session 0" in found


def test_session_that_was_declared_an_error_is_found(copy: Path) -> None:
    edit(copy / "rollout.json", lambda page: page["rows"][0].update(record=None, error="ValueError: no"))
    assert "its row has an error, but the session is finished" in faults(copy)


def test_surplus_session_and_repeated_row_are_found(copy: Path) -> None:
    shutil.copytree(sessions_of(copy)[0], copy / "sessions" / "0009-brookside")
    assert "sessions/0009-brookside: is none of the planned sessions" in faults(copy)
    edit(copy / "rollout.json", lambda page: page["rows"].append(page["rows"][0]))
    assert "two rows have the same number" in faults(copy)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"seed": 1}, "seed is 1; that of the protocol is 0"),
        ({"towns": ("brookside", "millbrook")}, "towns are brookside, millbrook; the protocol has"),
        ({"towns": ("millbrook",)}, "towns are millbrook; the protocol has"),
        ({"sessions": 2}, "2 sessions; the protocol has at least 3"),
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


def test_command_writes_and_checks_a_submission(
    honest: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:  # fmt: skip
    monkeypatch.setattr(submission, "PROTOCOL", PROTOCOL)
    monkeypatch.setenv("COLUMNS", "200")
    file = tmp_path / "submission.json"

    def call(*arguments: object) -> Any:
        return CliRunner().invoke(app, ["submit", *map(str, arguments)])

    done = call(honest, "--out", file, "--sample", 1)
    assert done.exit_code == 0, done.output
    assert "1 sessions simulated again; no fault" in done.stdout
    assert call(honest, "--check", file, "--sample", "all").exit_code == 0
    edit(file, lambda page: page.update(part="seen"))
    wrong = call(honest, "--check", file, "--json", "--sample", 1)
    assert wrong.exit_code == 1
    assert len(json.loads(wrong.stdout)["faults"]) == 2
    for arguments in (("--sample", "none"), ("--sample", "0")):
        assert "give a number of sessions, or all" in call(honest, *arguments).stderr
    assert "does not exist" in call(tmp_path / "nowhere").stderr
