from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from dorothie_gym.cli.app import app
from dorothie_gym.evaluation.closed_loop.leaderboard import ENOUGH
from dorothie_gym.evaluation.closed_loop.leaderboard_plan import LeaderboardPlan, usual_rows
from dorothie_gym.evaluation.closed_loop.protocol import LeaderboardProtocol
from dorothie_gym.maps import SEEN_TOWNS, UNSEEN_TOWNS
from dorothie_gym.ontology import Role
from dorothie_gym.policies import Player
from dorothie_gym.policies.pretrained import names_for

SHORT = ("--sessions", "2", "--max-seconds", "5", "--workers", "1")
ROWS = ("--row", "lane-follow", "--row", "silent")


def board(tmp_path: Path, *arguments: str) -> dict[str, Any]:
    call = ["leaderboard", str(tmp_path / "runs"), "--out", str(tmp_path / "board.md"), *arguments, "--json"]
    done = CliRunner().invoke(app, call)
    assert done.exit_code == 0, done.output
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def test_one_command_plays_and_ranks_and_makes_the_same_figures_elsewhere(tmp_path: Path) -> None:
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
    one = board(tmp_path / "one", "--play", *ROWS, "--parts", "development", *SHORT)
    two = board(tmp_path / "two", "--play", *ROWS, "--parts", "development", *SHORT)
    assert [row["policy"] for row in one["rows"]] == [row["policy"] for row in two["rows"]]
    assert one["sha256"] == two["sha256"]
    page = (tmp_path / "one" / "board.md").read_text()
    assert one["sha256"] in page and "### Development town, by exception" in page
    heads = [line for line in page.splitlines() if line.startswith("| Co-Wizard |") and "| none |" in line]
    assert heads and all(line.count("none") == 1 for line in heads)
    assert f"Rows of fewer than {ENOUGH} sessions" in page
    assert board(tmp_path / "one")["sha256"] == one["sha256"]  # from the folder, without playing
    rollout = tmp_path / "one" / "runs" / "development-silent" / "rollout.json"
    found = json.loads(rollout.read_text())
    found["rows"][0]["record"]["seconds"] += 0.5
    rollout.write_text(json.dumps(found))
    assert board(tmp_path / "one")["sha256"] != one["sha256"]


def test_plan_has_all_rows_in_all_parts() -> None:
    plan = LeaderboardPlan(co_wizards=[Player(name="scripted")], imported=("Town01.xodr",))
    rollouts = plan.rollouts()
    assert list(rollouts) == ["seen-scripted", "unseen-scripted", "imported-scripted"]
    assert rollouts["seen-scripted"].towns == SEEN_TOWNS and rollouts["unseen-scripted"].towns == UNSEEN_TOWNS
    assert {one.sessions for one in rollouts.values()} == {ENOUGH} == {LeaderboardProtocol().sessions}


def test_usual_rows_have_scripts_and_all_shipped_models() -> None:
    assert usual_rows()[:3] == ("scripted", "lane-follow", "random")
    assert set(names_for(Role.CO_WIZARD)) <= set(usual_rows())


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"parts": ("seen", "home")}, "give some of seen, development, unseen"),
        ({"imported": ("town.yaml",)}, "OpenDRIVE"),
        ({"co_wizards": []}, "nobody"),
    ],
)
def test_wrong_plans_are_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        LeaderboardPlan(**{"co_wizards": [Player(name="scripted")], **changes})


def test_play_takes_one_folder(tmp_path: Path) -> None:
    call = ["leaderboard", str(tmp_path / "a"), str(tmp_path / "b"), "--play", "--out", str(tmp_path / "board.md")]
    done = CliRunner().invoke(app, call)
    assert done.exit_code == 2 and "--play takes one folder" in done.stderr


def test_row_of_other_weights_is_reported_before_anything_is_played(tmp_path: Path) -> None:
    pytest.importorskip("sb3_contrib", reason="needs the extra 'baselines'")
    former = tmp_path / "seen-pretrained-ppo-00000000"
    former.mkdir()
    done = CliRunner().invoke(app, ["leaderboard", str(tmp_path), "--play", "--row", "pretrained:ppo"])
    assert done.exit_code == 2 and done.stderr.count("\n") == 1
    assert f"{former}: sessions of other weights of pretrained:ppo" in done.stderr
    assert list(tmp_path.iterdir()) == [former]
