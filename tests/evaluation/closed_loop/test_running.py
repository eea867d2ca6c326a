from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from dorothie_gym.archive import Corpus
from dorothie_gym.errors import SessionError
from dorothie_gym.evaluation.closed_loop import RolloutSettings, roll_out
from dorothie_gym.ontology import Role
from dorothie_gym.policies import ALL_SCRIPTED, Player
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.recording import Session
from tests.evaluation.closed_loop.players import load_fainting

SETTINGS = RolloutSettings(
    cast={**ALL_SCRIPTED, Role.CO_WIZARD: Player(name="lane-follow")},
    towns=("brookside", "midtown"),
    sessions=4,
    seed=5,
    config=EnvConfig(max_seconds=10.0),
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("rollout") / "undisturbed"
    result = roll_out(SETTINGS, root)
    assert result.complete and result.errored == 0
    return root


def test_sessions_are_kept_for_replay(folder: Path) -> None:
    sessions = list(Corpus.load(folder / "sessions"))
    assert [(session.header.town, session.header.seed) for session in sessions] == [
        (plan.town, plan.seed) for plan in SETTINGS.plans()
    ]
    assert all(session.complete and session.decisions is not None for session in sessions)
    assert {path.name for path in folder.iterdir()} == {"settings.json", "rollout.json", "cost.json", "sessions"}


@pytest.mark.long
def test_two_workers_write_the_same_bytes(folder: Path, tmp_path: Path) -> None:
    roll_out(SETTINGS, tmp_path, workers=2)
    assert (tmp_path / "rollout.json").read_bytes() == (folder / "rollout.json").read_bytes()


def test_measures_agree_with_what_the_environment_said(folder: Path) -> None:
    rows = json.loads((folder / "rollout.json").read_text())["rows"]
    for row, plan in zip(rows, SETTINGS.plans(), strict=True):
        summary = Session.load(folder / plan.path).summary
        assert summary is not None
        assert row["record"]["success"] == summary["success"]
        assert {"live": row["record"]["live"], "reached": row["record"]["reached"]} == summary["subgoals"]
        assert row["record"]["seconds"] == summary["seconds"]
        assert row["record"]["talk"]["utterances"] == summary["utterances"]
        assert row["record"]["infractions"]["timeout"] == 1


def test_interruption_keeps_the_result_so_far_and_the_next_run_resumes(folder: Path, tmp_path: Path) -> None:
    def stop(done: int, total: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        roll_out(SETTINGS, tmp_path, on_session=stop)
    page = json.loads((tmp_path / "rollout.json").read_text())
    assert page["sessions"] == 2 and not page["complete"]
    before = (tmp_path / SETTINGS.plans()[0].path / "events.jsonl").stat().st_mtime_ns
    roll_out(SETTINGS, tmp_path)
    assert (tmp_path / SETTINGS.plans()[0].path / "events.jsonl").stat().st_mtime_ns == before
    assert (tmp_path / "rollout.json").read_bytes() == (folder / "rollout.json").read_bytes()


def test_folder_of_another_rollout_is_not_gone_on_with(folder: Path, tmp_path: Path) -> None:
    shutil.copytree(folder, tmp_path / "copy")
    other = RolloutSettings(cast=ALL_SCRIPTED, towns=SETTINGS.towns, sessions=4, seed=5, config=SETTINGS.config)
    with pytest.raises(SessionError, match="has co_wizard 'lane-follow', not 'scripted'"):
        roll_out(other, tmp_path / "copy")


def test_session_whose_policy_fails_is_counted_and_reported(tmp_path: Path) -> None:
    file = tmp_path / "player.faint"
    file.write_text("faint")
    cast = {**ALL_SCRIPTED, Role.CO_WIZARD: Player(name=str(file), path=file, loader=load_fainting)}
    settings = RolloutSettings(cast=cast, towns=("brookside",), sessions=6, config=EnvConfig(max_seconds=8.0))
    result = roll_out(settings, tmp_path / "out")
    assert 0 < result.errored < 6 and result.complete
    assert {row.error for row in result.rows} == {None, "RuntimeError: I feel faint"}
    assert len(Corpus.load(tmp_path / "out" / "sessions")) == 6 - result.errored


def test_no_workers_do_nothing(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="workers is 0"):
        roll_out(SETTINGS, tmp_path, workers=0)
